"""The command `twolink drift`."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from twolink.cli.limits import Force, limits_of
from twolink.cli.options import Methods
from twolink.cli.studies import bar_of, files_of_study, names_in, write_study
from twolink.cli.terminal import check_folder, console, print_table, styled

if TYPE_CHECKING:
    from rich.console import Console

    from twolink.accuracy.drift import DriftStudy

# Angles beyond this (rad) round ten times as coarsely as those of one turn.
_MANY_TURNS = 63.0


def drift(
    scene: Annotated[
        Path,
        typer.Argument(
            metavar="SCENE", help="A scene that conserves energy: its name, or a TOML file."
        ),
    ],
    seconds: Annotated[float, typer.Option(help="How long to follow the motion (s).")] = 1e5,
    methods: Methods = "",
    out: Annotated[
        Path | None,
        typer.Option(help="Write drift.json, .csv, .svg and .png into this folder."),
    ] = None,
    force: Force = False,
) -> None:
    """Measure the energy drift of each method over a long time.

    Exit code 0, also if a method's drift is undecided or not the expected one (a sentence says
    so), or 2: the input was refused.
    """
    from twolink.accuracy.drift import energy_drift
    from twolink.scene import Scene

    check_folder("--out", out, names=files_of_study("drift"), inputs=[scene])
    loaded = Scene.load(scene)
    with bar_of("following") as progress:
        found = energy_drift(
            loaded,
            seconds=seconds,
            methods=names_in(methods),
            progress=progress,
            limits=limits_of(force),
        )
    _print(console(), found)
    if out is not None:
        from twolink.viz.plots.drift import drift_plot

        write_study(out, "drift", found, drift_plot(found))


def _print(page: Console, found: DriftStudy) -> None:
    from twolink.accuracy.tables import drifts_table

    page.print(styled((found.scene.title, "bold"), f", {found.seconds:g} s"))
    page.print(
        "Energy errors are root mean squares over neighbouring starts, as shares of the greatest "
        f"kinetic energy, {found.kinetic_energy:.3g} J.\n",
        soft_wrap=True,
    )
    print_table(page, drifts_table(found.drifts))
    fitted = [drift.growth for drift in found.drifts if drift.growth is not None]
    if fitted:
        page.print(
            f"Powers of time are fitted from {fitted[0].start:.3g} to {fitted[0].end:.3g} s; "
            "± is the standard error over the starts.",
            soft_wrap=True,
        )
    for sentence in _about_the_motion(found):
        page.print(sentence, soft_wrap=True)
    if found.unexpected:
        for sentence in found.unexpected:
            page.print(sentence, style="bold yellow", soft_wrap=True)
    else:
        page.print(
            "Every method has the expected drift: of 0, 0.5 and 1, the expected power is the "
            "nearest to the measured one, by two standard errors or more.",
            style="bold green",
            soft_wrap=True,
        )


def _about_the_motion(found: DriftStudy) -> Iterator[str]:
    """Return sentences on the motion, which decides how far the powers of time can be measured."""
    apart = found.divergence
    factor = float(f"{apart.factor:.1g}")
    by = f"nearby starts separate by a factor of {factor:g} in {apart.seconds:.3g} s"
    if apart.chaotic:
        yield (
            f"The motion is chaotic: {by}. Where a step is long for its swiftest moments energy "
            "leaps, by symplectic methods too; small_swings is a regular scene."
        )
    else:
        yield f"The motion is regular: {by}."
    if found.farthest > _MANY_TURNS:
        yield (
            f"Angles reach {found.farthest:.2g} rad. They round in proportion to their size, and "
            "tolerances of Taylor series are relative to it: these err faster by as much."
        )
