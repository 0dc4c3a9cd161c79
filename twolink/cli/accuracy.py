"""The command `twolink accuracy`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from twolink.cli.limits import Force, limits_of
from twolink.cli.options import Methods, SceneName
from twolink.cli.studies import bar_of, check_budget, files_of_study, names_in, write_study
from twolink.cli.terminal import check_folder, console, print_table, refuse, styled

if TYPE_CHECKING:
    from rich.console import Console

    from twolink.accuracy.study import Study

_Engines = Annotated[
    bool, typer.Option("--engines", help="Measure other engines too, if they are installed.")
]
_Budget = Annotated[
    float | None,
    typer.Option(help="Time (s) for the runs that are measured. Default: 15, with engines 75."),
]
_Out = Annotated[
    Path | None,
    typer.Option(help="Write accuracy.json, .csv, .svg and .png into this folder."),
]
_Busy = Annotated[
    bool, typer.Option("--busy", help="Measure other engines even on a busy machine.")
]


def accuracy(
    scene: SceneName,
    methods: Methods = "",
    engines: _Engines = False,
    budget: _Budget = None,
    out: _Out = None,
    busy: _Busy = False,
    force: Force = False,
) -> None:
    """Measure the cost of accuracy, and recommend a method.

    Every method runs at settings from coarse to fine, each is judged by a run in 113 bits, and all
    are timed in turn. Exit code 0, or 2: the input was refused.
    """
    from twolink.accuracy.study import study
    from twolink.environment import load_of_machine
    from twolink.scene import Scene

    if budget is None:
        budget = 75.0 if engines else 15.0
    check_budget(budget)
    check_folder("--out", out, names=files_of_study("accuracy"), inputs=[scene])
    loaded = Scene.load(scene)
    load = load_of_machine()
    if engines and load is not None and load.busy and not busy:
        refuse(
            f"the load of the machine must be at most {load.most:g} to time other engines (--busy"
            f" times them all the same); got {load.average:.2f}"
        )
    with bar_of("measuring") as progress:
        found = study(
            loaded,
            methods=names_in(methods),
            engines=engines,
            budget=budget,
            progress=progress,
            limits=limits_of(force),
        )
    _print(console(), found)
    if out is not None:
        from twolink.viz.plots.work_precision import work_precision_plot

        write_study(out, "accuracy", found, work_precision_plot(found))


def _print(page: Console, found: Study) -> None:
    from twolink.accuracy.tables import MARKS, choices_table, configurations_table, events_table

    measured = found.work_precision
    page.print(styled((measured.scene.title, "bold"), f", {measured.scene.duration:g} s"))
    page.print(
        f"Errors at {measured.judged_at}, measured against {measured.reference.source}.",
        soft_wrap=True,
    )
    if measured.load is not None:
        page.print(f"Load of the machine: {measured.load}.")
    page.print()
    print_table(page, choices_table(found))
    print_table(page, configurations_table(found.configurations))
    page.print(f"{MARKS}\n", soft_wrap=True)
    if found.waste:
        page.print(f"{found.waste}\n", soft_wrap=True)
    if any(point.events for point in found.points):
        print_table(page, events_table(found))
        page.print("Each precision resolves a different number of decaying bounces.\n")
    for sentence in _floor_sentences(found):
        page.print(sentence, soft_wrap=True)
    for reason in measured.notes:
        page.print(reason, style="dim", soft_wrap=True)
    page.print(found.recommendation, style="bold green", soft_wrap=True)


def _floor_sentences(found: Study) -> list[str]:
    floor = found.roundoff_floor
    growth = f"by {floor.growth:.2g} digits a second" if floor.growth > 0.005 else "hardly"
    sentences = [
        f"Double precision ends at an error of {floor.error:.1e}; round-off grows {growth}."
    ]
    held = []
    for digits in (12, 9, 6, 3):
        seconds, measured = floor.held_until(digits)
        if math.isfinite(seconds):
            held.append(
                f"{digits} until t = {seconds:.3g} s{'' if measured else ' (extrapolated)'}"
            )
    if held:
        sentences.append(f"Correct digits: {', '.join(held)}.")
    return sentences
