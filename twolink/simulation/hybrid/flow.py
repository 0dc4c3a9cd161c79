"""One arc: the flow of a mode from a state to its first event.

The integrator runs ahead for a few steps, and the event functions on all of them are certified
together (`certificate`). The arc ends at the first event, or at the requested time.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Mapping, Sequence
from time import perf_counter
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from twolink.contact.elements import ContactElement
from twolink.contact.states import ContactState, EventKind
from twolink.errors import IntegrationError
from twolink.integration.outcomes import failure_of
from twolink.integration.precisions import PrecisionName
from twolink.names import FormulationName
from twolink.optional import heyoka
from twolink.simulation.hybrid import tolerances
from twolink.simulation.hybrid.bernstein import product
from twolink.simulation.hybrid.block import Block
from twolink.simulation.hybrid.certificate import Certificate, Finding
from twolink.simulation.hybrid.compile import compiled_mode
from twolink.simulation.hybrid.compiled import CompiledMode
from twolink.simulation.hybrid.complementarity import NO_ORDERS, Orders
from twolink.simulation.hybrid.event_functions import locks
from twolink.simulation.hybrid.impact import stopped
from twolink.simulation.hybrid.mode import Doubt, Mode, Trigger
from twolink.simulation.hybrid.state import HybridState, put
from twolink.simulation.hybrid.stepper import Stepper
from twolink.simulation.hybrid.system import HybridSystem
from twolink.simulation.hybrid.tolerances import SHORTEST_STEP
from twolink.simulation.series import powers_of

# Initial and largest number of steps between certificates, where no arc was in the same mode or it
# was shorter. A step in a long precision costs more than its certificate.
_AHEAD: dict[PrecisionName, tuple[int, int]] = {
    "double": (8, 32),
    "long double": (2, 16),
    "quadruple": (1, 4),
}


class Arc(NamedTuple):
    """The motion in one mode between two jumps: its ends, its steps, and the event that ended it.

    `event` is None if the arc ends at the requested time. The last step is truncated at the end of
    the arc.
    """

    mode: Mode
    start: HybridState
    end: HybridState
    blocks: tuple[Block, ...]
    event: Trigger | None
    doubts: tuple[Doubt, ...]
    compiled: CompiledMode
    compile_seconds: float

    @property
    def step_count(self) -> int:
        """The number of its steps."""
        count = 0
        for block in self.blocks:
            count += len(block.lengths)
        return count


NO_ARCS: Mapping[CompiledMode, Arc] = MappingProxyType({})


def flow(
    system: HybridSystem,
    state: HybridState,
    mode: Mode,
    until: Any,
    formulation: FormulationName,
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
    compiled = compiled_mode(system, mode, formulation, _springing_back(state), optimised)
    compile_seconds = perf_counter() - begun
    if compiled.roots:
        until = min(until, state.t + system.number(tolerances.LONGEST_PRESS))
    with compiled.pool.lend() as stepper:
        course = _Course(system, compiled, stepper, mode, state, until, compile_seconds)
        return _followed(course, orders, last_arcs.get(compiled), progress)


def _followed(
    course: _Course,
    orders: Orders,
    last: Arc | None,
    progress: Callable[[float, int], None],
) -> Arc:
    """Return the arc that an integrator computes from the start of a course.

    The `last` arc in the mode takes as many steps, if motions are alike.
    """
    system, compiled, mode = course.system, course.compiled, course.mode
    _set_up(course)
    span = course.until - course.state.t
    certificate = Certificate(system, compiled, mode, span, orders, course.state)
    blocks: list[Block] = []
    doubts: list[Doubt] = []
    taken = size = 0
    longest = _horizon(system, last)
    numbers = _numbers_of_steps(system.precision, compiled, last)
    while True:
        block, over, failure = _take_steps(course, next(numbers), longest)
        found: Finding | None = None
        if len(block.lengths):
            found, touched = certificate.first_event(block, at_start=not blocks)
            doubts += touched
            blocks.append(block if found is None else _cut(block, found))
        if found is not None or over:
            trigger = None if found is None else found.trigger
            return _ended(course, blocks, doubts, trigger, None if trigger else course.until)
        taken += len(block.lengths)
        if not failure and taken > tolerances.MANY_STEPS and _never_ends(course, block):
            failure = "its steps become too short"
        if failure:
            return _failed(course, blocks, doubts, failure)
        longest = system.cap
        size += block.coefficients.nbytes
        progress(float(_now(course)), size)


def _numbers_of_steps(
    precision: PrecisionName, compiled: CompiledMode, last: Arc | None
) -> Iterator[int]:
    """Yield the numbers of steps before each certificate, endlessly.

    They are at first as many as the last arc took: steps beyond the event would be wasted.
    """
    few, most = _AHEAD[precision]
    # An event that is visible at the end of a step stops the integrator.
    left = 0 if last is None or compiled.shows_events else last.step_count
    few = most if compiled.shows_events else few
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


class _Course(NamedTuple):
    """An arc to be integrated: its mode, its start, and its latest end (s)."""

    system: HybridSystem
    compiled: CompiledMode
    stepper: Stepper
    mode: Mode
    state: HybridState
    until: Any
    compile_seconds: float


def _ended(
    course: _Course, blocks: list[Block], doubts: list[Doubt], trigger: Trigger | None, until: Any
) -> Arc:
    """Return the arc at a time (s) or, if that is None, where its last step was cut."""
    end = _end_state(course, blocks[-1], until) if blocks else course.state._replace(t=until)
    return Arc(
        course.mode, course.state, end, tuple(blocks), trigger, tuple(doubts), course.compiled,
        course.compile_seconds,
    )  # fmt: skip


def _never_ends(course: _Course, block: Block) -> bool:
    """Return whether the arc would require too many steps of the last, short, length."""
    if course.compiled.clock is not None:
        return False
    left, pace = course.until - block.starts[-1], block.lengths.mean()
    short = pace < tolerances.SHORT_STEPS * course.system.longest_step
    return bool(short and left > tolerances.MOST_STEPS * pace)


def _failed(course: _Course, blocks: list[Block], doubts: list[Doubt], failure: str) -> Arc:
    """Return the arc up to where a slide locks, since its normal force grows without bound.

    Raises `IntegrationError` for any other failure.
    """
    system, mode = course.system, course.mode
    arc = _ended(course, blocks, doubts, None, None if blocks else course.state.t)
    pose = system.pose(arc.end.q)
    for index, (element, own) in enumerate(zip(system.elements, mode.states, strict=True)):
        if element.rigid and own.slips and locks(system, mode, pose, index):
            return arc._replace(event=Trigger(EventKind.JAMS, index, own.direction))
    raise IntegrationError(
        f"the motion could not be integrated beyond {float(arc.end.t):.9g} s "
        f"({failure}{_recovering(course)}), in the mode '{mode}'; it must stay finite, and its "
        "loads smooth"
    )


def _recovering(course: _Course) -> str:
    """Return the fastest surface that recovers on an arc, in words; empty if none does."""
    elements = course.system.elements
    rates = {
        i: force_law.relaxation
        for i in _springing_back(course.state)
        if (force_law := elements[i].compliant) is not None and force_law.relaxation is not None
    }
    if not rates:
        return ""
    fastest = max(rates, key=rates.__getitem__)
    return f", while {course.mode.names[fastest]} recovers at {rates[fastest]:.2g} 1/s"


def _springing_back(state: HybridState) -> tuple[int, ...]:
    """Return the surfaces that are not in contact and have not recovered."""
    if not any(state.compliant):
        return ()
    return tuple(
        i for i, own in enumerate(state.compliant) if own is not None and own.residual_depth != 0
    )


def _set_up(course: _Course) -> None:
    """Set the integrator of a mode to the start of an arc."""
    system, compiled, (integrator, _, variables, _, parameters, _), mode, state, *_ = course
    compliant = state.compliant
    vector = [*state.q, *state.u]
    for index in compiled.gaps:
        vector.append(state.gaps[index])
    for index in compiled.recovering:
        vector.append(compliant[index].residual_depth)  # type: ignore[union-attr]
    for index in compiled.roots:
        vector.append(compliant[index].sqrt_depth)  # type: ignore[union-attr]
    if len(vector) < len(variables):
        vector += [system.number(0)] * (len(variables) - len(vector))
    variables[:] = vector
    integrator.time = system.number(0) if compiled.clock is not None else state.t
    if count := len(parameters):
        own = [system.number(n) for n in mode.numbers]
        own += (*system.frictions(mode.states), *system.places)
        every = [*system.effect_numbers, *own, system.number(system.force_scale), state.t]
        # The last parameters may not occur in the expressions of this mode.
        parameters[:] = every[:count]


def _take_steps(course: _Course, ahead: int, longest: Any) -> tuple[Block, bool, str]:
    """Return the next steps, whether they reach the end of the arc, and the failure if any.

    In time they are at most as long as the `longest` (s).
    """
    _, compiled, (integrator, step, variables, tc, _, values), _, state, until, _ = course
    clock, integrals = compiled.clock, compiled.integrals
    by_time, watches_integrals = clock is None, integrals.stop > integrals.start
    complete, falling = _complete(), compiled.falling
    span, shortest = until - state.t, SHORTEST_STEP if by_time else 0
    longest_press = None if by_time else _longest_press(course, span)
    taken = _Taken([], [], [])
    over, failure = False, ""
    for _ in range(ahead):
        start = integrator.time
        if by_time:
            left = until - start
            if not left > 0:
                over = True
                break
            outcome, length = step(left if left < longest else longest, True)
        else:
            outcome, length = step(longest_press, True)
        if outcome.value not in complete:
            failure = failure_of(outcome)
            break
        taken.add(start, length, tc)
        if watches_integrals:
            variables[integrals] = 0
        over = by_time and length == left
        if over or (not by_time and values[clock] >= span):
            break
        if not length > shortest * start:
            failure = "its steps become too short"
            break
        if _has_fallen(values, falling):
            break
    return taken.block(tc), over, failure


def _longest_press(course: _Course, span: Any) -> Any:
    """Return a step (s/m^½) of more than the time in which an arc ends if no depth changes.

    The series of a chain that rests on a surface converges everywhere. A press begins with a root
    of zero, and its clock is slow until the root has grown.
    """
    system, compiled, state = course.system, course.compiled, course.state
    longest = 2 * span
    for index in compiled.roots:
        root = state.compliant[index].sqrt_depth  # type: ignore[union-attr]
        longest = longest / (root or system.least_root)
    return longest


class _Taken(NamedTuple):
    """The starts, lengths and coefficients of steps, the last in bytes.

    Bytes are joined several times faster than small arrays.
    """

    starts: list[Any]
    lengths: list[Any]
    coefficients: list[bytes]

    def add(self, start: Any, length: Any, tc: Any) -> None:
        """Add a step of the coefficients `tc`."""
        self.starts.append(start)
        self.lengths.append(length)
        self.coefficients.append(tc.tobytes())

    def block(self, tc: Any) -> Block:
        """Return the steps, whose coefficients have the shape and the type of `tc`."""
        kind, shape = tc.dtype, (len(self.lengths), *tc.shape)
        joined: Any = np.ndarray(shape, kind, b"".join(self.coefficients))
        return Block(np.array(self.starts, kind), np.array(self.lengths, kind), joined)


def _has_fallen(values: Any, falling: Sequence[int]) -> bool:
    """Return whether an event has occurred: a variable that may fall is below zero."""
    for variable in falling:  # noqa: SIM110
        if values[variable] < 0:
            return True
    return False


@functools.cache
def _complete() -> frozenset[int]:
    """Return heyoka's result codes for a full and for a capped step.

    Integers are compared faster than the codes themselves.
    """
    outcomes = heyoka().taylor_outcome
    return frozenset((outcomes.success.value, outcomes.time_limit.value))


def _now(course: _Course) -> Any:
    """Return the time (s) that the integrator has reached."""
    stepper, clock = course.stepper, course.compiled.clock
    return stepper.integrator.time if clock is None else course.state.t + stepper.state[clock]


def _cut(block: Block, found: Finding) -> Block:
    """Return the steps of a block up to an event."""
    starts, lengths, coefficients = block
    count = found.place + 1
    if count < len(lengths):
        starts, lengths, coefficients = starts[:count], lengths[:count], coefficients[:count]
    lengths = lengths.copy()
    lengths[-1] *= found.x
    return Block(starts, lengths, coefficients)


def _end_state(course: _Course, last: Block, until: Any) -> HybridState:
    """Return the state at the end of an arc, at a time (s) or, if that is None, where it was cut.

    The speeds that the mode holds are exactly zero.
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
    rest = iter(values[4:])
    for index in compiled.gaps:
        gap = next(rest)
        # A touching contact that carries no force stays touching.
        gaps[index] = 0 * gap if index in state.touching else gap
    for index in compiled.recovering:
        compliant[index] = compliant[index]._replace(residual_depth=next(rest))  # type: ignore[union-attr]
    for index in compiled.roots:
        compliant[index] = compliant[index]._replace(sqrt_depth=next(rest))  # type: ignore[union-attr]
    q, u = (values[0], values[1]), (values[2], values[3])
    held = system.held(mode.states)
    if held:
        u = stopped(system.pose(q), held, u, system.rounding)
    sliding = _sliding(course, q, u)
    return HybridState(t, q, u, tuple(gaps), state.touching, sliding, tuple(compliant))


def _sliding(course: _Course, q: Any, u: Any) -> tuple[int, ...]:
    """Return the direction in which each element slides at the end of an arc.

    The slides that begin with an arc have begun, however short it is.
    """
    system, _, _, mode, state, *_ = course
    if u[0] == 0 and u[1] == 0 and any(state.u):
        return (0,) * len(state.sliding)
    found = mode.slides
    for index in state.touching:
        if mode.states[index] is ContactState.OPEN:
            found = put(found, index, _carried(system, system.elements[index], q, u))
    return found


def _carried(system: HybridSystem, element: ContactElement, q: Any, u: Any) -> int:
    """Return the direction in which a contact slides that another one holds off its surface."""
    if element.tangent is None:
        return 0
    speed = element.tangent.speed(system.chain, q, u)
    return 0 if speed == 0 else 1 if speed > 0 else -1
