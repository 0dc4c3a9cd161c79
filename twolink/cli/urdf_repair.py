"""The command `twolink urdf repair`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from twolink.cli.terminal import check_target, fail, say
from twolink.errors import EngineError
from twolink.files import atomic_write

if TYPE_CHECKING:
    from twolink.verification import Verdict

_STATES = 200


def repair(
    urdf: Annotated[Path, typer.Argument(metavar="FILE", help="A URDF of a planar chain.")],
    out: Annotated[Path, typer.Option(help="The file to write.")],
) -> None:
    """Repair a URDF for engines, with the same mechanics.

    Lists every change; writes an equal text if there is none to make. Exit code 0: the file is
    written, and Pinocchio agrees on it. 1: Pinocchio refuses it still, and nothing is written. 2:
    the input was refused, with the reason.
    """
    check_target("--out", out, inputs=[urdf])
    from twolink.urdf import parse_planar_urdf
    from twolink.urdf.repair import repair_file

    try:
        repaired = repair_file(urdf)
        verdict = _verified(parse_planar_urdf(repaired.text, source=str(out)))
    except EngineError as error:
        fail(str(error))
    if not verdict.passed:
        fail(f"{urdf}: after the repair, {verdict.sentence}")
    with atomic_write(out) as file:
        file.write_text(repaired.text, encoding="utf-8", newline="")
    for text in repaired.changes or ("nothing to repair",):
        say(f"  {text}")
    for text in repaired.notes:
        say(text)
    if repaired.changes:
        say("Masses, inertias about the axes, poses, axes, damping and friction are equal.")
    say(verdict.sentence)
    say(out)


def _verified(read: object) -> Verdict:
    """Return the verdict on a repaired chain, at a few states."""
    from twolink.verification import verify

    return verify(read, states=_STATES, seed=1)  # type: ignore[arg-type]
