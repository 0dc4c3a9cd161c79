"""The command `twolink urdf show`."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from twolink.cli.terminal import as_json, console, say
from twolink.text import as_vector

if TYPE_CHECKING:
    from twolink.urdf.description import UrdfDescription


def show(
    urdf: Annotated[Path, typer.Argument(metavar="FILE", help="A URDF of a planar chain.")],
    tip: Annotated[
        str | None, typer.Option(help="The URDF's link to take as the free end D.")
    ] = None,
    json_: Annotated[bool, typer.Option("--json", help="Print the same as JSON.")] = False,
) -> None:
    """Show the interpretation of a URDF.

    Prints frames, parameters, conventions, effects and warnings.
    Exit code 0: it is a planar two-link chain. 2: the input was refused.
    """
    from twolink.urdf.description import read_description

    described = read_description(urdf, tip=tip)
    if json_:
        document = as_json(asdict(described))
        say(json.dumps(document, indent=2, allow_nan=False))
    else:
        _print(described)


def _print(described: UrdfDescription) -> None:
    """Print a description: drawing, tree, parameters, conventions, effects, notes, warnings."""
    from twolink.urdf.description import drawing, tree_lines

    page = console()

    def line(text: str = "") -> None:
        page.print(text, soft_wrap=True)

    line(f"{Path(described.path).name}, both joint angles zero; x to the right, y down")
    line()
    line(drawing(described))
    line()
    for text in tree_lines(described):
        line(text)
    page.print(_parameters(described))
    _print_conventions(described)
    for text in (*described.notes, *_offers(described)):
        line(text)
    for text in described.warnings:
        page.print(text, soft_wrap=True, markup=False, style="bold red")


def _parameters(described: UrdfDescription) -> object:
    from rich import box
    from rich.table import Table

    table = Table(title="Parameters", title_justify="left", box=box.SIMPLE_HEAD)
    for column in (
        "link",
        "mass, kg",
        "length, m",
        "centre along, across, m",
        "inertia I_C, kg m²",
    ):
        table.add_column(column, justify="left" if column == "link" else "right")
    for number, body in enumerate(described.bodies, start=1):
        link = body.parameters
        along, across = (f"{coordinate + 0.0:.9g}" for coordinate in link.centre)
        table.add_row(
            f"{number}",
            f"{link.mass:.9g}",
            f"{link.length:.9g}",
            f"{along}, {across}",
            f"{link.inertia:.9g}",
        )
    return table


def _print_conventions(described: UrdfDescription) -> None:
    """Print how joint angles give absolute ones, and where the plane lies."""
    (s1, s2), (phi1, phi2) = described.sign, described.offset
    x, y, z = described.axes
    lines = (
        f"q1 = {_signed(s1)}θ1 {_added(phi1)}, q2 = q1 {'+' if s2 > 0 else '−'} θ2 {_added(phi2)}",
        f"A is at {as_vector(described.origin)} m of {described.root};"
        f" x is {as_vector(x)}, y {as_vector(y)}, z {as_vector(z)}",
        f"gravity in the plane: {described.gravity:.6g} m/s² along y",
        f"D is {described.tip!r}" if described.tip else "D is no frame of the file",
    )
    for text in lines:
        say(text)


def _offers(described: UrdfDescription) -> list[str]:
    """Return a sentence for each effect that the file offers to scenes."""
    found = []
    for body in described.bodies:
        if body.damping:
            found.append(f"Effect: joint {body.joint!r} has damping {body.damping:g} N m s/rad.")
        if body.friction:
            found.append(f"Effect: joint {body.joint!r} has friction {body.friction:g} N m.")
        if body.limits is not None:
            lower, upper = body.limits
            found.append(f"Effect: joint {body.joint!r} has limits {lower:g} to {upper:g} rad.")
    return found


def _signed(sign: int) -> str:
    return "" if sign > 0 else "−"


def _added(angle: float) -> str:
    return f"{'−' if angle < 0 else '+'} {abs(angle):.6g}"
