"""The conditions that the laws of friction and contact put on a mode, and their values."""

from __future__ import annotations

from enum import Enum
from typing import Any, NamedTuple

from twolink.arithmetic import Pair
from twolink.contact.elements import ContactForces, Terms
from twolink.simulation.hybrid.dynamics import LocalEquations
from twolink.simulation.hybrid.system import HybridSystem


class Law(Enum):
    """A condition that a mode must satisfy."""

    PUSHES = "a contact pushes"
    SEPARATES = "a contact that opens separates"
    WITHIN_LIMIT = "friction is within its static limit"
    ACCELERATES = "an element that begins to slide accelerates"

    # A member is the only one of its name: conditions are the keys of dictionaries.
    __hash__ = object.__hash__


class Condition(NamedTuple):
    """A law for the element of this number; `sense` is a direction of friction or sliding."""

    law: Law
    number: int
    sense: int = 0


def value_of(
    system: HybridSystem,
    equations: LocalEquations,
    condition: Condition,
    du: Pair,
    forces: ContactForces,
) -> Any:
    """Return the value of a condition, which is not negative if the condition holds.

    It is a force (N, N m), or an acceleration (m/s², rad/s²) where the element is free to move.
    `du` (rad/s²) and the `forces` of the element are those of a mode.
    """
    law, index, sense = condition
    if law is Law.PUSHES:
        return forces.normal
    if law is Law.WITHIN_LIMIT:
        return system.elements[index].limits(forces.normal)[1] + sense * forces.tangential
    row, bias = along(equations, condition)
    return (sense or 1) * (row[0] * du[0] + row[1] * du[1] + bias)


def along(equations: LocalEquations, condition: Condition) -> Terms:
    """Return the terms of the coordinate of a condition."""
    terms = equations.terms[condition.number]
    assert terms is not None
    is_normal = condition.law in (Law.PUSHES, Law.SEPARATES)
    found = terms.normal if is_normal else terms.tangent
    assert found is not None
    return found
