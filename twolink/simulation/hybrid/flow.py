"""One arc: the flow of a mode from a state to its first event.

The integrator runs ahead for a few steps, and the event functions on all of them are certified
together (`certificate`). The arc ends at the first event, or at the requested time.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping
from time import perf_counter
from typing import Any

from twolink.contact.states import EventKind
from twolink.errors import IntegrationError
from twolink.integration.precisions import PrecisionName
from twolink.simulation.hybrid import tolerances
from twolink.simulation.hybrid.arc import NO_ARCS, Arc
from twolink.simulation.hybrid.block import Block
from twolink.simulation.hybrid.certificate import Certificate, Finding
from twolink.simulation.hybrid.compile import Compiler
from twolink.simulation.hybrid.compiled import CompiledMode
from twolink.simulation.hybrid.complementarity import NO_ORDERS, Orders
from twolink.simulation.hybrid.course import Course, now, set_up, springing_back
from twolink.simulation.hybrid.end_of_arc import cut, end_state
from twolink.simulation.hybrid.event_functions import locks
from twolink.simulation.hybrid.fastest_rate import fastest_rate
from twolink.simulation.hybrid.mode import Doubt, Mode, Trigger
from twolink.simulation.hybrid.state import HybridState
from twolink.simulation.hybrid.steps_of_arc import take_steps
from twolink.simulation.hybrid.system import HybridSystem

# Initial and largest number of steps between certificates, where no arc was in the same mode or it
# was shorter. A step in a long precision costs more than its certificate.
_AHEAD: dict[PrecisionName, tuple[int, int]] = {
    "double": (8, 32),
    "long double": (2, 16),
    "quadruple": (1, 4),
}


def flow(
    system: HybridSystem,
    state: HybridState,
    mode: Mode,
    until: Any,
    compiler: Compiler,
    progress: Callable[[float, int], None],
    last_arcs: Mapping[CompiledMode, Arc] = NO_ARCS,
    orders: Orders = NO_ORDERS,
    optimised: bool = False,
) -> Arc:
    """Return the arc of a mode from a state until a time (s), or to its first event.

    `progress` receives the time (s) reached and the size (bytes) of the steps so far; `last_arcs`
    has the last arc in each mode, by which the number of steps before the first event detection is
    chosen; `orders` has the numbers of leading coefficients of event functions that are zero by the
    mode selection.
    `optimised` code is worth its compilation in a mode that takes thousands of steps.
    Raises `IntegrationError` where the motion does not stay finite, or its steps become too short.
    """
    begun = perf_counter()
    compiled = compiler.mode(system, mode, springing_back(state), optimised=optimised)
    compile_seconds = perf_counter() - begun
    if compiled.roots:
        until = min(until, state.t + system.number(tolerances.LONGEST_PRESS) * system.cap)
    with compiled.pool.lend() as stepper:
        course = Course(system, compiled, stepper, mode, state, until, compile_seconds)
        return _followed(course, orders, last_arcs.get(compiled), progress)


def _followed(
    course: Course,
    orders: Orders,
    last: Arc | None,
    progress: Callable[[float, int], None],
) -> Arc:
    """Return the arc that an integrator computes from the start of a course.

    The `last` arc in the mode takes as many steps, if motions are alike.
    """
    system, compiled, mode = course.system, course.compiled, course.mode
    set_up(course)
    span = course.until - course.state.t
    certificate = Certificate(system, compiled, mode, span, orders, course.state)
    blocks: list[Block] = []
    doubts: list[Doubt] = []
    taken = size = 0
    longest = _horizon(system, last)
    numbers = _numbers_of_steps(system.precision, compiled, last)
    while True:
        block, over, failure = take_steps(course, next(numbers), longest)
        found: Finding | None = None
        if len(block.lengths):
            found, touched = certificate.first_event(block, at_start=not blocks)
            doubts += touched
            blocks.append(block if found is None else cut(block, found))
        if found is not None or over:
            trigger = None if found is None else found.trigger
            until, departed = None if trigger else course.until, certificate.departed(found)
            arc = _ended(course, blocks, doubts, trigger, until, departed)
            spread = 0.0 if found is None else found.spread
            return arc._replace(spread=spread, lowest=certificate.lowest(found))
        taken += len(block.lengths)
        if not failure and taken > tolerances.MANY_STEPS:
            failure = _endless(course, block)
        if failure:
            arc = _failed(course, blocks, doubts, failure, certificate.departed(None))
            return arc._replace(lowest=certificate.lowest(None))
        longest = system.cap
        size += block.coefficients.nbytes
        progress(float(now(course)), size)


def _numbers_of_steps(
    precision: PrecisionName, compiled: CompiledMode, last: Arc | None
) -> Iterator[int]:
    """Return the numbers of steps before each certificate, endlessly.

    An event that is visible at the end of a step stops the integrator. Steps beyond another one
    would be wasted: there they are at first as many as the last arc took.
    """
    few, most = _AHEAD[precision]
    return itertools.repeat(most) if compiled.shows_events else _growing(few, most, last)


def _growing(few: int, most: int, last: Arc | None) -> Iterator[int]:
    """Yield the number of steps of the last arc, and then `few`, twice as many … up to `most`."""
    left = 0 if last is None else last.step_count
    while left > 0:
        yield min(left, most)
        left -= most
    while True:
        yield few
        few = min(2 * few, most)


def _horizon(system: HybridSystem, last: Arc | None) -> Any:
    """Return the most that the first steps of an arc take (s), by the last arc in its mode."""
    longest = system.cap
    if last is None:
        return longest
    ample = tolerances.HORIZON * (last.end.t - last.start.t)
    return longest if ample > longest else max(ample, tolerances.SHORT_STEPS * longest)


def _ended(
    course: Course,
    blocks: list[Block],
    doubts: list[Doubt],
    trigger: Trigger | None,
    until: Any,
    departed: frozenset[int],
) -> Arc:
    """Return the arc at a time (s) or, if that is None, where its last step was cut.

    Contacts that have `departed` do not touch at its end.
    """
    last = blocks[-1] if blocks else None
    end = end_state(course, last, until, departed) if last else course.state._replace(t=until)
    # A sum is finite only if all terms are.
    if not math.isfinite(sum(map(float, (*end.q, *end.u)))):
        raise IntegrationError(
            f"the motion could not be integrated beyond {float(course.state.t):.9g} s (the state "
            f"is not finite there), in the mode '{course.mode}'"
        )
    return Arc(
        course.mode, course.state, end, tuple(blocks), trigger, tuple(doubts), course.compiled,
        course.compile_seconds,
    )  # fmt: skip


def _endless(course: Course, block: Block) -> str:
    """Return why the arc would require too many steps at the pace of the last ones; empty if not.

    If time is a variable, which grows slowly where a surface is hardly pressed, they are too many
    only if it stands still.
    """
    clock, (_, _, variables, *_) = course.compiled.clock, course.stepper
    if clock is not None:
        passed = variables[clock] - block.coefficients[0, clock, 0]
        moves = passed > tolerances.SHORTEST_STEP * len(block.lengths) * now(course)
        return "" if moves else "time stands still"
    left, pace = course.until - block.starts[-1], block.lengths.mean()
    short = pace < tolerances.SHORT_STEPS * course.system.longest_step
    many = short and left > tolerances.MOST_STEPS * pace
    return "its steps become too short" if many else ""


def _failed(
    course: Course,
    blocks: list[Block],
    doubts: list[Doubt],
    failure: str,
    departed: frozenset[int],
) -> Arc:
    """Return the arc up to where a slide locks, since its normal force grows without bound.

    Raises `IntegrationError` for any other failure.
    """
    system, mode = course.system, course.mode
    arc = _ended(course, blocks, doubts, None, None if blocks else course.state.t, departed)
    pose = system.pose(arc.end.q)
    for index, (element, own) in enumerate(zip(system.elements, mode.states, strict=True)):
        if element.rigid and own.slips and locks(system, mode, pose, index):
            return arc._replace(event=Trigger(EventKind.JAMS, index, own.direction))
    cause = fastest_rate(system, mode, arc.end)
    required = "" if cause else "; it must stay finite, and its loads smooth"
    raise IntegrationError(
        f"the motion could not be integrated beyond {float(arc.end.t):.9g} s ({failure}{cause}), "
        f"in the mode '{mode}'{required}"
    )
