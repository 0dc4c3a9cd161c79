"""The end of an arc: its last step up to an event, and the state there."""

from __future__ import annotations

from typing import Any

from twolink.contact.elements import ContactElement
from twolink.contact.states import ContactState
from twolink.simulation.hybrid.bernstein import product
from twolink.simulation.hybrid.block import Block
from twolink.simulation.hybrid.certificate import Finding
from twolink.simulation.hybrid.course import Course
from twolink.simulation.hybrid.impact import stopped
from twolink.simulation.hybrid.state import HybridState, put
from twolink.simulation.hybrid.system import HybridSystem
from twolink.simulation.series import powers_of


def cut(block: Block, found: Finding) -> Block:
    """Return the steps of a block up to an event."""
    starts, lengths, coefficients = block
    count = found.place + 1
    if count < len(lengths):
        starts, lengths, coefficients = starts[:count], lengths[:count], coefficients[:count]
    lengths = lengths.copy()
    lengths[-1] *= found.x
    return Block(starts, lengths, coefficients)


def end_state(
    course: Course, last: Block, until: Any, departed: frozenset[int] = frozenset()
) -> HybridState:
    """Return the state at the end of an arc, at a time (s) or, if that is None, where it was cut.

    The speeds that the mode holds are exactly zero. Contacts that have `departed` no longer touch.
    """
    system, compiled, _, mode, state, *_ = course
    coefficients = last.coefficients[-1]
    by_power = powers_of(last.lengths[-1:], coefficients.shape[1])
    values = product(coefficients, by_power).tolist()
    t = until
    if t is None and compiled.clock is None:
        t = last.starts.item(-1) + last.lengths.item(-1)
    elif t is None:
        t = state.t + values[compiled.clock]
    gaps, compliant = list(state.gaps), list(state.compliant)
    touching = state.touching - departed if departed else state.touching
    rest = iter(values[4:])
    for index in compiled.gaps:
        gap = next(rest)
        # A touching contact that carries no force stays touching.
        gaps[index] = 0 * gap if index in touching else gap
    for index in compiled.recovering:
        compliant[index] = compliant[index]._replace(residual_depth=next(rest))  # type: ignore[union-attr]
    for index in compiled.roots:
        compliant[index] = compliant[index]._replace(sqrt_depth=next(rest))  # type: ignore[union-attr]
    q, u = (values[0], values[1]), (values[2], values[3])
    held = system.held(mode.states)
    if held:
        u = stopped(system.pose(q), held, u, system.rounding)
    sliding = _sliding(course, q, u, touching)
    return HybridState(t, q, u, tuple(gaps), touching, sliding, tuple(compliant))


def _sliding(course: Course, q: Any, u: Any, touching: frozenset[int]) -> tuple[int, ...]:
    """Return the direction in which each element slides at the end of an arc.

    The slides that begin with an arc have begun, however short it is.
    """
    system, _, _, mode, state, *_ = course
    if u[0] == 0 and u[1] == 0 and any(state.u):
        return (0,) * len(state.sliding)
    found = mode.slides
    for index in touching:
        if mode.states[index] is ContactState.OPEN:
            found = put(found, index, _carried(system, system.elements[index], q, u))
    return found


def _carried(system: HybridSystem, element: ContactElement, q: Any, u: Any) -> int:
    """Return the direction in which a contact slides that another one holds off its surface."""
    if element.tangent is None:
        return 0
    speed = element.tangent.speed(system.chain, q, u)
    return 0 if speed == 0 else 1 if speed > 0 else -1
