"""The state of a compliant surface: a frozen value that each contact event replaces.

A law that depends on √depth has it as a variable of the integration; a damped surface that is not
in contact has its residual depth; a yielding one has its plastic state.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from twolink.arithmetic import Scalar, sqrt
from twolink.contact.elements import ContactElement
from twolink.contact.force_laws import Phase, PlasticState
from twolink.simulation.hybrid.tolerances import NO_FORCE


class CompliantState(NamedTuple):
    """`sqrt_depth` (m^½, None if not in use), `residual_depth` (m) to recover, and `plastic`."""

    sqrt_depth: Scalar | None = None
    residual_depth: Scalar = 0
    plastic: PlasticState | None = None

    @property
    def offset(self) -> Scalar:
        """The depth (m) of the surface below its undeformed position."""
        kept = self.plastic.residual if self.plastic is not None else 0
        return self.residual_depth + kept


def undisturbed(element: ContactElement) -> CompliantState | None:
    """Return the state of an undeformed surface, or None for a rigid element."""
    if element.compliant is None:
        return None
    plastic = None if element.hysteresis is None else PlasticState(Phase.WHOLE)
    return CompliantState(plastic=plastic)


def pressed_at(element: ContactElement, state: CompliantState, depth: Any) -> CompliantState:
    """Return the state at the start of a run with a point pressed in to a depth (m).

    A yielding surface is on its curve of first compression.
    """
    plastic, law = state.plastic, element.compliant
    assert law is not None
    if element.hysteresis is not None and plastic is not None:
        while (reach := element.branch(plastic).reach) is not None and reach * reach < depth:
            plastic = element.hysteresis.reached(plastic)
    root = sqrt(depth) if law.uses_root else None
    return CompliantState(root, 0, plastic)


def pressed(element: ContactElement, state: CompliantState, least: Any) -> CompliantState:
    """Return the state at the beginning of a press, at the `least` root of a depth (m^½)."""
    law, plastic = element.compliant, state.plastic
    assert law is not None
    if element.hysteresis is not None and plastic is not None:
        plastic = element.hysteresis.pressed(plastic)
    return CompliantState(least if law.uses_root else None, 0, plastic)


def released(
    element: ContactElement, state: CompliantState, speed: Any, depth: Any, small: float
) -> CompliantState:
    """Return the state after a point has separated at a speed (m/s) and a depth (m).

    If the force of a damped surface has fallen to zero, the surface recovers at that speed, which
    determines its depth best; after an impact the point moves out faster than the surface. The
    depth is known within a `small` one (m).
    """
    law, plastic = element.compliant, state.plastic
    assert law is not None
    if law.relaxation is None:
        return CompliantState(None, 0 * speed, plastic)
    residual = speed / law.relaxation
    differs = abs(residual - depth) > NO_FORCE * abs(residual) + small
    return CompliantState(None, depth if differs else residual, plastic)


def overtaken(element: ContactElement, state: CompliantState, depth: Any) -> CompliantState:
    """Return the state of a surface with a residual depth (m) that is not in contact."""
    return state._replace(sqrt_depth=None, residual_depth=depth)


def reached(element: ContactElement, state: CompliantState) -> CompliantState:
    """Return the state on the next branch of the law, at the same depth."""
    assert element.hysteresis is not None
    assert state.plastic is not None
    return _on_branch(state, element.hysteresis.reached(state.plastic))


def turned(element: ContactElement, state: CompliantState) -> CompliantState:
    """Return the state on the branch that holds from where compression and restitution change."""
    assert element.hysteresis is not None
    assert state.plastic is not None
    assert state.sqrt_depth is not None
    depth = state.sqrt_depth * state.sqrt_depth + state.plastic.residual
    return _on_branch(state, element.hysteresis.turned(state.plastic, depth))


def cleared(state: CompliantState) -> CompliantState:
    """Return the state of a surface after the point has left its plastic indentation."""
    return state._replace(plastic=PlasticState(Phase.WHOLE))


def relaxed(state: CompliantState) -> CompliantState:
    """Return the state of a surface that has recovered."""
    return state._replace(residual_depth=0 * state.residual_depth)


def relaxation_time(element: ContactElement, state: CompliantState, least: float) -> float:
    """Return the time (s) until a surface has recovered to a depth (m), 0 if it has."""
    law = element.compliant
    assert law is not None
    depth = abs(float(state.residual_depth))
    if depth == 0:
        return math.inf
    if depth <= least or law.relaxation is None:
        return 0.0
    return math.log(2 * depth / least) / law.relaxation


def _on_branch(state: CompliantState, plastic: PlasticState) -> CompliantState:
    """Return the state with another plastic state, at the same place."""
    assert state.plastic is not None
    root, sinks = state.sqrt_depth, state.plastic.residual - plastic.residual
    if sinks != 0:
        assert root is not None
        root = sqrt(root * root + sinks)
    return CompliantState(root, state.residual_depth, plastic)
