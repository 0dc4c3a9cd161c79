"""One arc: the flow of a mode from a state to its first event.

The integrator runs ahead for a few steps, and the event functions on all of them are certified
together (`certificate`). The arc ends at the first event, or at the time that is asked for.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

import numpy as np

from twolink.contact.elements import ContactElement
from twolink.contact.states import ContactState, EventKind
from twolink.errors import IntegrationError
from twolink.optional import heyoka
from twolink.simulation.hybrid import tolerances
from twolink.simulation.hybrid.certificate import Block, Certificate, Finding, powers
from twolink.simulation.hybrid.compile import CompiledMode, compiled_mode
from twolink.simulation.hybrid.complementarity import NO_ORDERS, Orders
from twolink.simulation.hybrid.dynamics import Pose, push_of
from twolink.simulation.hybrid.event_functions import locks
from twolink.simulation.hybrid.impact import stopped
from twolink.simulation.hybrid.mode import Doubt, Mode, Trigger
from twolink.simulation.hybrid.state import HybridState
from twolink.simulation.hybrid.system import HybridSystem
from twolink.simulation.hybrid.tolerances import SHORTEST_STEP

# The steps by which the integrator runs ahead of the certificate, at first and at most: a step in
# a long precision costs more than its certificate.
_AHEAD = {"double": (8, 32), "long double": (2, 16), "quadruple": (1, 4)}


@dataclass(frozen=True)
class Arc:
    """The motion in one mode between two jumps: its ends, its steps, and the event that ended it.

    `event` is None if the arc ends at the time that was asked for. The last step is cut where the
    arc ends.
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
        return sum(len(block.lengths) for block in self.blocks)


def flow(
    system: HybridSystem,
    state: HybridState,
    mode: Mode,
    until: Any,
    formulation: str,
    progress: Callable[[float], None],
    expected: int = 0,
    orders: Orders = NO_ORDERS,
) -> Arc:
    """Return the arc of a mode from a state until a time (s), or to its first event.

    `progress` receives the time (s) that is reached, now and then; `expected` is the number of
    steps to take before the first look, 0 for a usual one; `orders` has how many leading
    coefficients of an event function are zero, where the selection of the mode has found that.
    Raises `IntegrationError` where the motion does not stay finite, or its steps become too short.
    """
    begun = perf_counter()
    compiled = compiled_mode(system, mode, formulation, _springing_back(state))
    compile_seconds = perf_counter() - begun
    if compiled.roots:
        until = min(until, state.t + system.number(tolerances.LONGEST_PRESS))
    _set_up(system, compiled, mode, state)
    pressing = _pressing(system, mode, state)
    certificate = Certificate(system, compiled, mode, until - state.t, pressing, orders)
    blocks: list[Block] = []
    doubts: list[Doubt] = []
    taken = 0
    ahead, most_ahead = _AHEAD[system.precision]
    ahead = min(expected or ahead, most_ahead)
    while True:
        block, over, failure = _take_steps(system, compiled, state, until, ahead)
        found: Finding | None = None
        if len(block.lengths):
            found, touched = certificate.first_event(block, at_start=not blocks)
            doubts += touched
            blocks.append(block if found is None else _cut(block, found))
        if found is not None or over:
            break
        taken += len(block.lengths)
        if not failure and taken > tolerances.MANY_STEPS and _never_ends(compiled, block, until):
            failure = "its steps become too short"
        if failure:
            return _failed(system, compiled, mode, state, blocks, doubts, compile_seconds, failure)
        ahead = min(2 * ahead, most_ahead)
        progress(float(_now(compiled, state)))
    trigger = found.trigger if found is not None else None
    end = _end_state(system, compiled, mode, state, blocks, until if trigger is None else None)
    return Arc(mode, state, end, tuple(blocks), trigger, tuple(doubts), compiled, compile_seconds)


def _never_ends(compiled: CompiledMode, block: Block, until: Any) -> bool:
    """Return whether an arc would take far too many steps at the pace of the last ones."""
    if compiled.clock is not None:
        return False
    left, pace = until - block.starts[-1], block.lengths.mean()
    return bool(left > tolerances.MOST_STEPS * pace)


def _failed(
    system: HybridSystem,
    compiled: CompiledMode,
    mode: Mode,
    state: HybridState,
    blocks: list[Block],
    doubts: list[Doubt],
    compile_seconds: float,
    failure: str,
) -> Arc:
    """Return the arc up to where a slide locks, since its normal force grows without bound.

    Raises `IntegrationError` for any other failure.
    """
    end = _end_state(system, compiled, mode, state, blocks, None) if blocks else state
    pose = Pose(system.chain, system.formulation, end.q)
    for index, (element, own) in enumerate(zip(system.elements, mode.states, strict=True)):
        if element.rigid and own.slips and locks(system, mode, pose, index):
            trigger = Trigger(EventKind.JAMS, index, own.direction)
            return Arc(
                mode, state, end, tuple(blocks), trigger, tuple(doubts), compiled, compile_seconds
            )
    raise IntegrationError(
        f"the motion could not be followed beyond {float(end.t):.9g} s ({failure}) while {mode}; "
        "the motion must stay finite"
    )


def _springing_back(state: HybridState) -> tuple[int, ...]:
    """Return the surfaces that have been left and are still sunk in."""
    return tuple(
        i for i, own in enumerate(state.compliant) if own is not None and own.residual_depth != 0
    )


def _set_up(system: HybridSystem, compiled: CompiledMode, mode: Mode, state: HybridState) -> None:
    """Set the integrator of a mode to the start of an arc."""
    integrator, compliant = compiled.integrator, state.compliant
    surfaces = [compliant[i].residual_depth for i in compiled.sunk]  # type: ignore[union-attr]
    surfaces += [compliant[i].sqrt_depth for i in compiled.roots]  # type: ignore[union-attr]
    vector = [*state.q, *state.u, *(state.gaps[i] for i in compiled.gaps), *surfaces]
    vector += [system.number(0)] * (len(integrator.state) - len(vector))
    integrator.state[:] = vector
    integrator.time = system.number(0) if compiled.clock is not None else state.t
    numbers = [n for effect in system.effects for n in getattr(effect, "numbers", ())]
    numbers += mode.numbers
    pars = [*(system.number(n) for n in numbers), system.number(system.force_scale), state.t]
    # The last of them may be in no expression of this mode.
    count = len(integrator.pars)
    integrator.pars[:] = pars[:count]


def _pressing(system: HybridSystem, mode: Mode, state: HybridState) -> float:
    """Return the sum of the accelerations (rad/s²) that single compliant surfaces give."""
    found, pose = 0.0, None
    for index, (element, own) in enumerate(zip(system.elements, state.compliant, strict=True)):
        if own is None or element.normal is None or mode.states[index] is ContactState.OPEN:
            continue
        pose = pose or Pose(system.chain, system.formulation, state.q)
        push = push_of(pose, element, mode.dent(index), state.u, own.sqrt_depth)
        given = pose.impulse_response(pose.row(element.normal))
        found += abs(float(push)) * max(abs(float(x)) for x in given)
    return found


def _take_steps(
    system: HybridSystem, compiled: CompiledMode, state: HybridState, until: Any, ahead: int
) -> tuple[Block, bool, str]:
    """Return the next steps, whether they come to the end of the arc, and why they fail if so."""
    integrator, clock = compiled.integrator, compiled.clock
    (limit, success), longest = _outcomes(), system.number(system.longest_step)
    over, failure, count = False, "", 0
    values, integrals, tc = integrator.state, compiled.integrals, integrator.tc
    watches_integrals = integrals.stop > integrals.start
    starts, lengths = np.empty(ahead, values.dtype), np.empty(ahead, values.dtype)
    coefficients = np.empty((ahead, *tc.shape), values.dtype)
    falling = compiled.falling
    while count < ahead:
        start = integrator.time
        if clock is None:
            left = until - start
            over = not left > 0
            if over:
                break
            outcome, length = integrator.step(min(left, longest), write_tc=True)
        else:
            outcome, length = integrator.step(write_tc=True)
        if outcome is not limit and outcome is not success and outcome not in (limit, success):
            failure = outcome.name
            break
        starts[count], lengths[count], coefficients[count] = start, length, tc
        count += 1
        if watches_integrals:
            values[integrals] = 0
        if clock is not None and values[clock] >= until - state.t:
            break
        if clock is None and length == left:
            over = True
            break
        if not length > (SHORTEST_STEP * start if clock is None else 0):
            failure = "its steps become too short"
            break
        if any(values[variable] < 0 for variable in falling):
            # An event has come.
            break
    return Block(starts[:count], lengths[:count], coefficients[:count]), over, failure


@functools.cache
def _outcomes() -> tuple[Any, Any]:
    """Return heyoka's outcomes of a step: cut at its longest, and not."""
    outcomes = heyoka().taylor_outcome
    return outcomes.time_limit, outcomes.success


def _now(compiled: CompiledMode, state: HybridState) -> Any:
    """Return the time (s) that the integrator has reached."""
    if compiled.clock is None:
        return compiled.integrator.time
    return state.t + compiled.integrator.state[compiled.clock]


def _cut(block: Block, found: Finding) -> Block:
    """Return the steps of a block up to an event."""
    count = found.place + 1
    lengths = block.lengths[:count].copy()
    lengths[-1] = lengths[-1] * found.x
    return Block(block.starts[:count], lengths, block.coefficients[:count])


def _end_state(
    system: HybridSystem,
    compiled: CompiledMode,
    mode: Mode,
    state: HybridState,
    blocks: list[Block],
    until: Any,
) -> HybridState:
    """Return the state at the end of an arc, at a time (s) or, if that is None, where it was cut.

    The speeds that the mode holds are exactly zero.
    """
    if not blocks:
        return replace(state, t=until)
    last = blocks[-1]
    by_power = powers(last.lengths[-1:], last.coefficients.shape[2])[0]
    values = (last.coefficients[-1] @ by_power).tolist()
    t = until
    if t is None and compiled.clock is None:
        t = last.starts[-1] + last.lengths[-1]
    elif t is None:
        t = state.t + values[compiled.clock]
    gaps, compliant = list(state.gaps), list(state.compliant)
    rest = iter(values[4:])
    for index in compiled.gaps:
        gap = next(rest)
        # What is touched is held off by others, and stays touched.
        gaps[index] = 0 * gap if index in state.touching else gap
    for index in compiled.sunk:
        compliant[index] = replace(compliant[index], residual_depth=next(rest))  # type: ignore[type-var]
    for index in compiled.roots:
        compliant[index] = replace(compliant[index], sqrt_depth=next(rest))  # type: ignore[type-var]
    q, u = (values[0], values[1]), (values[2], values[3])
    u = _held(system, mode, q, u)
    sliding = tuple(
        own.direction
        if own.slips
        else _carried(system, element, index in state.touching, own, q, u)
        for index, (element, own) in enumerate(zip(system.elements, mode.states, strict=True))
    )
    if t == state.t or (u[0] == 0 and u[1] == 0):
        sliding = state.sliding if t == state.t else (0,) * len(sliding)
    return HybridState(t, q, u, tuple(gaps), state.touching, sliding, tuple(compliant))


def _carried(
    system: HybridSystem, element: ContactElement, touching: bool, own: ContactState, q: Any, u: Any
) -> int:
    """Return the direction in which a contact slides that another one holds off its surface."""
    if own is not ContactState.OPEN or not touching or element.tangent is None:
        return 0
    speed = element.tangent.speed(system.chain, q, u)
    return 0 if speed == 0 else 1 if speed > 0 else -1


def _held(system: HybridSystem, mode: Mode, q: Any, u: Any) -> Any:
    """Return u without the speeds that a mode holds at zero."""
    held = [
        coordinate
        for element, own in zip(system.elements, mode.states, strict=True)
        for coordinate in element.holds(own)
    ]
    return (
        stopped(Pose(system.chain, system.formulation, q), held, u, system.rounding) if held else u
    )
