"""The command `twolink urdf convert`."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from twolink.cli.terminal import check_target, fail, say
from twolink.errors import EngineError
from twolink.files import atomic_write


class Format(StrEnum):
    """The formats that a URDF is converted to."""

    mjcf = "mjcf"
    sdf = "sdf"


SUFFIXES = {Format.mjcf: ".xml", Format.sdf: ".sdf"}


def convert(
    urdf: Annotated[Path, typer.Argument(metavar="FILE", help="A URDF of a planar chain.")],
    to: Annotated[Format, typer.Option(help="The format to write.")],
    out: Annotated[
        Path | None, typer.Option(help="The file to write. Default: FILE with .xml or .sdf.")
    ] = None,
) -> None:
    """Convert a URDF to MJCF or SDF, and check it in an engine.

    MuJoCo's writer makes the MJCF. MuJoCo or Drake reads the file back, and its mass matrix,
    gravity and velocity terms are compared at random states. Lists all that the written file does
    not have. Exit code 0: the file is written. 1: the engine is missing, refuses the file or
    disagrees, and nothing is written. 2: the input was refused.
    """
    from twolink.urdf import read_planar_urdf

    # First, so that of a name without a last part, such as ".", none is made for the target.
    read = read_planar_urdf(urdf)
    target = out or urdf.with_suffix(SUFFIXES[to])
    check_target("--out", target, (SUFFIXES[to],), inputs=[urdf])
    from twolink.engines.urdf_conversion import convert as converted
    from twolink.urdf.losses import losses

    try:
        made = converted(read, to.value)
    except EngineError as error:
        fail(str(error))
    with atomic_write(target) as file:
        file.write_text(made.text, encoding="utf-8")
    say(
        f"{made.engine} reads it back; its mass matrix differs by at most {made.difference:.1e}"
        f" of the largest entry, gravity and velocity terms by {made.of_forces:.1e} of their size."
    )
    for text in losses(read.xml, made.text, to.value):
        say(text)
    say(target)
