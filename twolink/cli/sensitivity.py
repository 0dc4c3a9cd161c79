"""The command `twolink sensitivity`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Protocol

import typer

from twolink.cli.limits import Force, limits_of
from twolink.cli.options import Samples, check_unused
from twolink.cli.studies import bar_of
from twolink.cli.terminal import (
    FAILED,
    check_target,
    console,
    print_table,
    refuse,
    styled,
    write_json,
)
from twolink.ensembles.parameters import SYMBOLS
from twolink.files import atomic_write
from twolink.suffixes import RESULTS
from twolink.text import either, quoted

if TYPE_CHECKING:
    from twolink.limits import Limits
    from twolink.variations.sensitivity import Sensitivity
    from twolink.variations.spectrum import Spectrum

_Scene = Annotated[
    Path,
    typer.Argument(
        metavar="SCENE", help="A scene without contact and dry friction: its name, or a TOML file."
    ),
]
_By = Annotated[
    list[str] | None,
    typer.Option(
        metavar="NAME",
        help="Differentiate by this number of the scene: its keys in the scene file, such as "
        f"start.q.0, or its symbol: {either(list(SYMBOLS))}. May be repeated.",
    ),
]
_Deviation = Annotated[
    list[str] | None,
    typer.Option(
        metavar="NAME=NUMBER",
        help="The standard deviation of a number of the scene, such as q1=0.01. That of the motion "
        "is printed, to first order. May be repeated.",
    ),
]
_Lyapunov = Annotated[
    float | None,
    typer.Option(
        metavar="SECONDS",
        help="Print no derivatives, but the Lyapunov exponents of the motion over this time.",
    ),
]
_Accuracy = Annotated[
    float | None,
    typer.Option(
        help="Error allowed in q (rad) and u (rad/s), and in a derivative relative to the largest "
        "by the same number. Default: the scene's."
    ),
]
_Out = Annotated[
    Path | None, typer.Option(help=f"Write the result to this {either(RESULTS)} file.")
]


def sensitivity(
    context: typer.Context,
    scene: _Scene,
    by: _By = None,
    deviation: _Deviation = None,
    lyapunov: _Lyapunov = None,
    accuracy: _Accuracy = None,
    samples: Samples = 501,
    out: _Out = None,
    force: Force = False,
) -> None:
    """Differentiate a smooth motion by its start and parameters.

    Prints the derivatives of q and u at the end with their measured errors, or the Lyapunov
    exponents. Exit code 0: the accuracy is met. 1: it is met only until the time that is printed.
    2: the input was refused, as are contact and dry friction, where motions have no derivatives.
    """
    check_target("--out", out, RESULTS, inputs=[scene])
    if lyapunov is not None:
        check_unused(context, "--lyapunov", "by", "deviation", "accuracy", "samples")
        _spectrum(scene, lyapunov, out, limits_of(force))
        return
    deviations = _deviations(deviation or [])
    names = tuple(dict.fromkeys([*(by or ()), *deviations]))
    if not names:
        refuse("--by must name a parameter, such as q1 or chain.mass.1; got none")
    found = _differentiated(scene, names, deviations, accuracy, samples, limits_of(force))
    _print(found, deviations)
    _write(found, out)
    if not found.met:
        raise typer.Exit(FAILED)


def _differentiated(
    scene: Path,
    names: tuple[str, ...],
    deviations: dict[str, float],
    accuracy: float | None,
    samples: int,
    limits: Limits,
) -> Sensitivity:
    """Return the derivatives by the named parameters; refuse wrong deviations before any work."""
    from twolink.variations.sensitivity import sensitivity as differentiated
    from twolink.variations.uncertainty import factor_of

    factor_of(names, deviations, None)
    with bar_of("differentiating") as progress:
        return differentiated(
            scene, names, accuracy=accuracy, samples=samples, progress=progress, limits=limits
        )


def _print(found: Sensitivity, deviations: dict[str, float]) -> None:
    """Print the derivatives at the end, their errors, and the uncertainty that was asked for."""
    page = console()
    page.print(styled((found.scene.title, "bold")))
    print_table(page, found.summary())
    page.print(
        f"Errors are bounds, measured by runs that differ in precision and equations; the kept one"
        f" is in {found.precision}.",
        soft_wrap=True,
    )
    if deviations:
        uncertainty = found.uncertainty(deviations)
        print_table(page, uncertainty.summary())
        page.print(uncertainty.note, soft_wrap=True)
    for note in found.notes:
        page.print(note, style=None if note in found.scene.notes else "bold red", soft_wrap=True)


def _spectrum(scene: Path, seconds: float, out: Path | None, limits: Limits) -> None:
    """Print the Lyapunov exponents of a scene, and how far they are known."""
    if not 0 < seconds < math.inf:
        refuse(f"--lyapunov must be a positive number of seconds; got {seconds:g}")
    from twolink.scene import Scene
    from twolink.variations.spectrum import lyapunov

    loaded = Scene.load(scene)
    with bar_of("following") as progress:
        found: Spectrum = lyapunov(loaded, seconds, progress=progress, limits=limits)
    page = console()
    page.print(styled((loaded.title, "bold")))
    print_table(page, found.summary())
    page.print(f"± is the standard error from {len(found.blocks)} blocks of time.", soft_wrap=True)
    page.print(found.verdict, soft_wrap=True)
    _write(found, out)


class _Result(Protocol):
    def document(self) -> dict[str, object]: ...

    def csv(self) -> str: ...


def _write(found: _Result, out: Path | None) -> None:
    """Write a result to a file of the kind that its name says."""
    if out is None:
        return
    if out.suffix == ".json":
        write_json(out, found.document())
        return
    with atomic_write(out) as file:
        file.write_text(found.csv(), encoding="utf-8")


def _deviations(given: list[str]) -> dict[str, float]:
    """Return the standard deviations by their names, or refuse one of two."""
    pairs = [_named_number(words) for words in given]
    names = [name for name, _ in pairs]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        refuse(f"--deviation must name each number once; got {quoted(twice)} twice")
    return dict(pairs)


def _named_number(words: str) -> tuple[str, float]:
    """Return the name and the number of NAME=NUMBER, or refuse."""
    name, _, number = words.partition("=")
    try:
        return name, float(number)
    except ValueError:
        refuse(f"--deviation must be NAME=NUMBER, such as q1=0.001; got {quoted(words)}")
