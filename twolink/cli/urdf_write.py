"""The command `twolink urdf write`."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from twolink.cli.terminal import check_target, refuse, say
from twolink.files import atomic_write

if TYPE_CHECKING:
    from twolink.chain import Chain
    from twolink.urdf import JointProperties

Four = tuple[float, float, float, float]


class JointKind(StrEnum):
    """The types of joints that turn, as a URDF names them."""

    revolute = "revolute"
    continuous = "continuous"


def write(
    out: Annotated[Path, typer.Option(help="The .urdf file to write.")],
    mass: Annotated[tuple[float, float], typer.Option(help="Masses, kg.")] = (1.0, 1.0),
    length: Annotated[tuple[float, float], typer.Option(help="Lengths, m.")] = (1.0, 1.0),
    centre: Annotated[
        Four | None,
        typer.Option(help="Mass centres along and across link 1, then link 2, m. Default: bars."),
    ] = None,
    inertia: Annotated[
        tuple[float, float] | None,
        typer.Option(help="Inertias about the mass centres, kg m². Default: bars."),
    ] = None,
    joint: Annotated[
        JointKind | None,
        typer.Option(help="Type of both joints. Default: revolute with --limits, else continuous."),
    ] = None,
    damping: Annotated[tuple[float, float], typer.Option(help="N m s/rad.")] = (0.0, 0.0),
    friction: Annotated[tuple[float, float], typer.Option(help="N m.")] = (0.0, 0.0),
    limits: Annotated[
        Four | None, typer.Option(help="Lower and upper angle of joint 1, then of joint 2, rad.")
    ] = None,
    name: Annotated[str, typer.Option(help="The robot's name.")] = "twolink",
) -> None:
    """Write a URDF of a chain from its parameters.

    Joint angles are those of the derivation: θ1 = q1, θ2 = q2 − q1. Exit code 0: the file is
    written. 2: the input was refused.
    """
    check_target("--out", out, (".urdf",))
    _check_kind(joint, limits)
    from twolink.urdf import write_planar_urdf

    links = _chain(mass, length, centre, inertia).links
    text = write_planar_urdf(links, name=name, joints=_joints(damping, friction, limits))
    with atomic_write(out) as file:
        file.write_text(text, encoding="utf-8")
    say(out)


def _check_kind(joint: JointKind | None, limits: Four | None) -> None:
    """Refuse a type of joint that does not go with the limits."""
    if joint is JointKind.revolute and limits is None:
        refuse("--joint revolute needs --limits; got none")
    if joint is JointKind.continuous and limits is not None:
        refuse("--joint must be revolute with --limits; got continuous")


def _chain(
    mass: tuple[float, float],
    length: tuple[float, float],
    centre: Four | None,
    inertia: tuple[float, float] | None,
) -> Chain:
    """Return the chain of the parameters, each checked."""
    from twolink.chain import Chain

    places = None if centre is None else (centre[:2], centre[2:])
    if places is not None and inertia is not None:
        return Chain(mass, length, places, inertia)
    bars = Chain.uniform_bars(mass, length)
    return Chain(mass, length, places or bars.centre, inertia or bars.inertia)


def _joints(
    damping: tuple[float, float], friction: tuple[float, float], limits: Four | None
) -> tuple[JointProperties, JointProperties]:
    from twolink.urdf import JointProperties

    pairs = (None, None) if limits is None else (limits[:2], limits[2:])
    first, second = (JointProperties(*each) for each in zip(damping, friction, pairs, strict=True))
    return first, second
