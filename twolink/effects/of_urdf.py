"""Properties of a URDF's joints as effects: damping, friction, and limits as stops.

The properties act only in scenes that request them. A URDF counts joint angles θ, and stops count
q1 and q2 − q1; about an axis of the other sign a lower limit is an upper stop. Damping and friction
resist both directions alike.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from twolink.effects import Effect, effect_class
from twolink.errors import ParameterError, UrdfError
from twolink.names import JOINT_PROPERTIES
from twolink.text import quoted
from twolink.urdf.planar import PlanarUrdf
from twolink.urdf.reading import Limits, listed, naming


def effects_of(read: PlanarUrdf, names: Iterable[str]) -> tuple[Effect, ...]:
    """Return the named effects of a URDF's joints, in the order of `names`.

    `names` are "damping", "friction" and "limits", each at most once; a property that is zero or
    absent for both joints gives no effect. A URDF has one friction, which is kinetic and static,
    and no rebound from limits. Raises `ParameterError` for other names, and `UrdfError` if the file
    has none of the named properties, or invalid values.
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
            f"effects of a URDF must be of {', '.join(JOINT_PROPERTIES)}, each at most once; got"
            f" {asked!r}"
        )


def _has(read: PlanarUrdf, name: str) -> bool:
    """Return whether a property is non-zero for at least one joint."""
    return any(getattr(read, name))


def _nothing_found(read: PlanarUrdf, asked: tuple[str, ...]) -> str:
    """Return the sentence that the file has none of the named properties."""
    there = ", ".join(name for name in JOINT_PROPERTIES if _has(read, name))
    return (
        f"joints {listed(read.joint_names)} have no {' or '.join(asked)}; effects must be of"
        f" {there or 'none, as the joints have none'}"
    )


def _damping(read: PlanarUrdf) -> Iterable[Effect]:
    _check_resistance(read, "damping", "N m s/rad")
    yield effect_class("joint_damping")(read.damping)


def _friction(read: PlanarUrdf) -> Iterable[Effect]:
    _check_resistance(read, "friction", "N m")
    yield effect_class("joint_friction")(read.friction)


def _check_resistance(read: PlanarUrdf, name: str, unit: str) -> None:
    """Raise `UrdfError` for a negative value, by the name of its joint."""
    for joint, value in zip(read.joint_names, getattr(read, name), strict=True):
        if value < 0:
            raise UrdfError(
                f"joint {quoted(joint)}: {name} must be zero or positive to act; got {value!r}"
                f" {unit}"
            )


def _stops(read: PlanarUrdf) -> Iterable[Effect]:
    """Yield a stop for each joint that has limits."""
    ends = zip("AB", read.joint_names, read.limits, strict=True)
    for index, (joint, name, limits) in enumerate(ends):
        if limits is not None:
            sign, offset = read.joints.sign[index], read.joints.offset[index]
            lower, upper = _turned(limits, sign, offset)
            # Compared as stops, because an offset can round two angles to equal values.
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
        f"joint {quoted(name)}: the lower limit must be below the upper one to act as stops; got"
        f" lower {lower!r} and upper {upper!r} rad, 0 where absent"
    )


_MAKERS: dict[str, Any] = {"damping": _damping, "friction": _friction, "limits": _stops}
