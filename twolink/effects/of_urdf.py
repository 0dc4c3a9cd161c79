"""What a URDF says of its joints, as effects: damping, friction, and limits as stops.

It acts where it is asked for, and only there. A URDF counts joint angles θ, and stops count q1 and
q2 − q1; about an axis of the other sign a lower limit is an upper stop. Damping and friction
resist either way of turning alike.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from twolink.effects import Effect, effect_class
from twolink.errors import ParameterError, UrdfError
from twolink.urdf.planar import JOINT_PROPERTIES, PlanarUrdf
from twolink.urdf.reading import Limits, listed, naming, quoted


def effects_of(read: PlanarUrdf, names: Iterable[str]) -> tuple[Effect, ...]:
    """Return the effects that are asked for of what was read from a URDF, in the names' order.

    `names` are of "damping", "friction" and "limits", each at most once; where the file has no
    value but zero there is no effect. A URDF knows one friction, which is kinetic and static, and
    no rebound from limits. Raises `ParameterError` for other names, and `UrdfError` if the file
    has nothing of what is asked for, or values that no joint can have.
    """
    asked = tuple(names)
    _check_names(asked)
    with naming(read.path):
        found = [name for name in asked if _has(read, name)]
        if asked and not found:
            raise UrdfError(_nothing_found(read, asked))
        return tuple(effect for name in found for effect in _MAKERS[name](read))


def _check_names(asked: tuple[str, ...]) -> None:
    if len(set(asked)) < len(asked) or not set(asked) <= set(JOINT_PROPERTIES):
        raise ParameterError(
            f"effects of a URDF are asked for by {asked!r}; allowed are"
            f" {', '.join(JOINT_PROPERTIES)}, each at most once"
        )


def _has(read: PlanarUrdf, name: str) -> bool:
    """Return whether one of the joints has more than zero or nothing of a property."""
    return any(getattr(read, name))


def _nothing_found(read: PlanarUrdf, asked: tuple[str, ...]) -> str:
    """Return the sentence that what is asked for is not there, and what is."""
    there = ", ".join(name for name in JOINT_PROPERTIES if _has(read, name))
    return (
        f"joints {listed(read.joint_names)} have no {' or '.join(asked)} that could act; allowed is"
        f" {f'what they have, {there}' if there else 'to ask for no effects, as they have none'}"
    )


def _damping(read: PlanarUrdf) -> Iterable[Effect]:
    _check_resistance(read, "damping", "N m s/rad")
    yield effect_class("joint_damping")(read.damping)


def _friction(read: PlanarUrdf) -> Iterable[Effect]:
    _check_resistance(read, "friction", "N m")
    yield effect_class("joint_friction")(read.friction)


def _check_resistance(read: PlanarUrdf, name: str, unit: str) -> None:
    """Refuse resistance that drives, by the name of its joint."""
    for joint, value in zip(read.joint_names, getattr(read, name), strict=True):
        if value < 0:
            raise UrdfError(
                f"joint {quoted(joint)}: {name} is {value!r}; allowed is zero or a positive number"
                f" of {unit}"
            )


def _stops(read: PlanarUrdf) -> Iterable[Effect]:
    """Yield a stop for each joint that has limits."""
    ends = zip("AB", read.joint_names, read.limits, strict=True)
    for index, (joint, name, limits) in enumerate(ends):
        if limits is not None:
            sign, offset = read.joints.sign[index], read.joints.offset[index]
            lower, upper = _turned(limits, sign, offset)
            # Asked of the stops, because an offset can round two angles to one.
            if not lower < upper:
                raise UrdfError(_no_room(name, limits))
            yield effect_class("joint_stop")(joint, lower, upper)


def _turned(limits: Limits, sign: int, offset: float) -> Limits:
    """Return limits of θ as those of sθ + φ (rad)."""
    lower, upper = limits if sign > 0 else limits[::-1]
    return sign * lower + offset, sign * upper + offset


def _no_room(name: str, limits: Limits) -> str:
    """Return the sentence that a joint is locked, or has its limits the wrong way round."""
    lower, upper = limits
    return (
        f"joint {quoted(name)}: its limits, 0 where absent, are lower {lower!r} and upper {upper!r}"
        " rad, and leave it no room; allowed is lower below upper"
    )


_MAKERS: dict[str, Any] = {"damping": _damping, "friction": _friction, "limits": _stops}
