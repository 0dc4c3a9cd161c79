"""The command `twolink accuracy`."""

from __future__ import annotations

import math
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from twolink.cli.studies import bar_of, names_in, write_study
from twolink.cli.terminal import check_folder, console, refuse, styled

if TYPE_CHECKING:
    from rich.console import Console

    from twolink.accuracy.study import ConfigurationSummary, Study


def accuracy(
    scene: Annotated[Path, typer.Argument(help="A scene: its name, or a TOML file.")],
    methods: Annotated[
        str, typer.Option(help="These methods alone, separated by commas. Default: all.")
    ] = "",
    engines: Annotated[
        bool, typer.Option("--engines", help="Measure other engines too, if they are installed.")
    ] = False,
    budget: Annotated[
        float | None,
        typer.Option(help="Time (s) for the runs that are measured. Default: 15, with engines 75."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Write accuracy.json, .csv, .svg and .png into this folder."),
    ] = None,
) -> None:
    """Measure the cost of accuracy in time, and recommend a method.

    Every method runs at settings from coarse to fine, each is judged by a run in 113 bits, and all
    are timed in turn. Exit code 0, or 2: the input was refused.
    """
    from twolink.accuracy.study import study
    from twolink.scene import Scene

    if budget is None:
        budget = 75.0 if engines else 15.0
    if not 0 < budget < math.inf:
        refuse(f"--budget must be a positive number of seconds; got {budget:g}")
    check_folder("--out", out)
    loaded = Scene.load(scene)
    with bar_of("measuring") as progress:
        found = study(
            loaded, methods=names_in(methods), engines=engines, budget=budget, progress=progress
        )
    _print(console(), found)
    if out is not None:
        from viz.plots.work_precision import work_precision_plot

        write_study(out, "accuracy", found, work_precision_plot(found))


def _print(page: Console, found: Study) -> None:
    from rich import box
    from rich.table import Table

    measured = found.work_precision
    page.print(styled((measured.scene.title, "bold"), f", {measured.scene.duration:g} s"))
    page.print(f"errors at {measured.judged_at}, measured against {measured.reference.source}\n")
    table = Table(title="Cost of a digit", title_justify="left", box=box.SIMPLE_HEAD)
    for name in ("digits", "cheapest configuration", "setting", "time", "the next digit takes"):
        table.add_column(name, justify="right" if name in ("digits", "time") else "left")
    for point, group in groupby(found.choices, key=lambda choice: choice.point):
        own = list(group)
        digits, further = [choice.digits for choice in own], own[0].next_digit
        table.add_row(
            str(digits[0]) if len(digits) == 1 else f"{digits[0]} to {digits[-1]}",
            point.configuration,
            f"{point.parameter} {point.setting:.3g}",
            _marked(point.seconds, point.repeatable),
            "—" if further is None else f"× {further:.2f}",
        )
    page.print(table)
    page.print(_configurations_table(found.configurations))
    page.print("± marks times whose slowest repeat took twice the fastest, or that stand alone.")
    if any(
        line.seconds is None and line.why_no_time != "not reached" for line in found.configurations
    ):
        page.print("By chance: one setting errs so little, and the next finer one does not.")
    page.print()
    if any(point.events for point in found.points):
        page.print(_events_table(found))
        page.print("Of bounces that die away, each precision sees as many as it can.\n")
    for sentence in _floor_sentences(found):
        page.print(sentence, soft_wrap=True)
    for reason in measured.left_out:
        page.print(f"Left out: {reason}", style="dim", soft_wrap=True)
    page.print(found.recommendation, style="bold green", soft_wrap=True)


def _configurations_table(configurations: tuple[ConfigurationSummary, ...]) -> Any:
    from rich import box
    from rich.table import Table

    from twolink.accuracy.study import COMPARED_AT

    title = f"Every configuration, at an error of {COMPARED_AT:g}"
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD)
    table.add_column("configuration", no_wrap=True)
    for name in ("time", "ratio", "least error", "order", "measured", "failed"):
        table.add_column(name, justify="right")
    for line in configurations:
        table.add_row(
            line.configuration,
            line.why_no_time if line.seconds is None else _marked(line.seconds, line.repeatable),
            "" if line.ratio is None else f"{line.ratio:.3g}",
            f"{line.best:.1e}",
            "" if line.declared is None else str(line.declared),
            "" if line.measured is None else f"{line.measured:.2f}",
            str(line.failures or ""),
        )
    return table


def _events_table(found: Study) -> Any:
    """Return the errors across events: those of their times, and those of the speeds."""
    from rich import box
    from rich.table import Table

    table = Table(title="Across events", title_justify="left", box=box.SIMPLE_HEAD)
    table.add_column("configuration", no_wrap=True)
    for name in ("setting", "time of events", "speed at impacts", "at the samples", "events"):
        table.add_column(name, justify="right")
    for point in found.points:
        if point.events is None:
            continue
        apart = point.events
        table.add_row(
            point.configuration,
            f"{point.parameter} {point.setting:.3g}",
            _above_rounding(apart.time) + " s",
            _above_rounding(apart.approach),
            f"{point.error:.1e}",
            f"{apart.matched} of {apart.all}",
        )
    return table


def _above_rounding(error: float) -> str:
    """Return an error of a float64 log as text; smaller errors than its rounding are not seen."""
    return f"{error:.1e}" if error > 0 else "< 1e-16"


def _floor_sentences(found: Study) -> list[str]:
    floor = found.roundoff_floor
    growth = f"by {floor.growth:.2g} digits a second" if floor.growth > 0.005 else "hardly"
    sentences = [
        f"Double precision ends at an error of {floor.error:.1e}; rounding grows {growth}."
    ]
    held = []
    for digits in (12, 9, 6, 3):
        seconds, measured = floor.held_until(digits)
        if math.isfinite(seconds):
            held.append(f"{digits} until {seconds:.3g} s{'' if measured else ' (extrapolated)'}")
    if held:
        sentences.append(f"Digits that it holds: {', '.join(held)}.")
    return sentences


def _marked(seconds: float, repeatable: bool) -> str:
    """Return a time, with a mark if it is not to be trusted."""
    return _time(seconds) + ("" if repeatable else " ±")


def _time(seconds: float) -> str:
    """Return a time in the unit that suits it."""
    if seconds < 1e-3:
        return f"{seconds * 1e6:.0f} µs"
    return f"{seconds * 1e3:.3g} ms" if seconds < 1 else f"{seconds:.3g} s"
