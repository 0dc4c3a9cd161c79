"""Modes compiled by heyoka, in any precision: each when it is first entered."""

from __future__ import annotations

import functools
import itertools
import operator
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from twolink import kane, lagrange
from twolink.arithmetic import Pair
from twolink.chain import Chain
from twolink.contact.elements import CompliantContact
from twolink.effects import Effect
from twolink.optional import heyoka
from twolink.simulation.mode import ContactState, Mode
from twolink.simulation.modes import Modes
from twolink.simulation.smooth.taylor import compact, number_type, step_tolerance
from twolink.simulation.watching import Places, Watch, margin, watches

# What is watched is a multiple of the quantity and a little more. heyoka misses later roots of a
# polynomial that starts at zero exactly, as a gap does after an impact: so little moves no root and
# is not zero. What is not to be watched is 1 all the time.
_IN_SIGHT = (1.0, 1e-100)
_OUT_OF_SIGHT = (0.0, 1.0)

# So often an interval is halved until it is down to rounding, in any precision.
_HALVINGS = 120


class Free(NamedTuple):
    """The variables of what is not touched, by number: gaps, and surfaces that spring back.

    A gap is a variable of its own: it starts at 0 after an impact, and then has digits of its own,
    however low the bounce, where a difference of positions would have none left. A surface that
    springs back by itself, at a rate (1/s), has how far it is still sunk in as another.
    """

    gaps: tuple[int, ...]
    relaxing: dict[int, float]

    @classmethod
    def of(cls, modes: Modes, mode: Mode, sunk: frozenset[int]) -> Free:
        """Return those of a mode in which these surfaces are still sunk in."""
        gaps = tuple(i for i, state in enumerate(mode.states) if state is ContactState.OPEN)
        cushions = {i: e for i in sunk if isinstance(e := modes.elements[i], CompliantContact)}
        rates = {index: cushion.law.relaxation for index, cushion in cushions.items()}
        return cls(gaps, {index: rate for index, rate in rates.items() if rate is not None})


class Segment(NamedTuple):
    """A stretch of the motion in one mode, from a start to an end (s), from a state.

    `effects` are those that act in it. `unwatched` are those whose quantities have only just left
    zero, or stay there. `since` is when the mode is said to begin (s). `last` is where the variable
    of integration ends, where that is not time; `sunk` are the surfaces that have been left, and
    still spring back.
    """

    mode: Mode
    effects: tuple[Effect, ...]
    start: Any
    end: Any
    state: tuple[Any, ...]
    unwatched: frozenset[Watch]
    since: Any
    last: Any = None
    sunk: frozenset[int] = frozenset()

    @property
    def numbers(self) -> list[Any]:
        """The numbers in which segments of the same kind differ, of effects and of dents."""
        effects = [n for effect in self.effects for n in getattr(effect, "numbers", ())]
        return [*effects, *self.mode.numbers]


@dataclass(frozen=True)
class CompiledMode:
    """A mode's integrator, and what it watches for.

    Of its parameters the first are the `numbers` of effects that differ from piece to piece, and
    of dents; then there are two for each event. Where a rooted cushion is pressed the integrator's
    variable is not time but s, with dt = √depth ds, in which the motion is analytic from the first
    touch to the last. Then the time since the start is the last of its variables, an event ends it,
    and the last two parameters are the start and the time until that end.
    """

    integrator: Any
    operations: int
    numbers: int
    watches: tuple[Watch, ...]
    kind: Any
    rooted: bool
    free: Free

    def set_to(self, segment: Segment) -> Any:
        """Return the integrator, set to a segment's start."""
        integrator = self.integrator
        integrator.state[:] = segment.state
        integrator.time = self.kind(0) if self.rooted else segment.start
        pars = [self.kind(number) for number in segment.numbers]
        for watch in self.watches:
            sight = _OUT_OF_SIGHT if watch in segment.unwatched else _IN_SIGHT
            pars += [self.kind(value) for value in sight]
        if pars:
            integrator.pars[: len(pars)] = pars
        if self.rooted:
            integrator.pars[-2] = segment.start
            integrator.pars[-1] = segment.end - segment.start
        if self.watches or self.rooted:
            integrator.reset_cooldowns()
        return integrator

    def output(self, segment: Segment, longest_step: float) -> Callable[[Any], Any]:
        """Return q and u, shape (4, n), as a function of times (s) in a segment."""
        # Its end is known: nothing need be watched for.
        whole = segment._replace(unwatched=frozenset(self.watches))
        integrator = self.set_to(whole)
        if not self.rooted:
            *_, output, _ = integrator.propagate_until(
                segment.end, c_output=True, max_delta_t=self.kind(longest_step)
            )
            return lambda times: np.array(output(times)).T[:4]
        integrator.pars[-1] = segment.end - segment.start + 1
        last = segment.last
        *_, output, _ = integrator.propagate_until(last, c_output=True)

        def at(times: Any) -> Any:
            """Find s for each time by halving: the clock rises."""
            low, high = 0 * times, 0 * times + last
            for _ in range(_HALVINGS):
                middle = (low + high) / 2
                early = np.array(output(middle)).T[-1] < times - segment.start
                low, high = np.where(early, middle, low), np.where(early, high, middle)
            return np.array(output((low + high) / 2)).T[:4]

        return at


def compiled_mode(
    chain: Chain,
    effects: tuple[Effect, ...],
    mode: Mode,
    formulation: str,
    precision: str,
    order: int | None,
    sunk: frozenset[int] = frozenset(),
) -> CompiledMode:
    """Return a mode's integrator, compiled unless it already was.

    `sunk` are the surfaces that have been left, and still spring back.
    """
    varying: tuple[Any, ...] = effects
    blank = tuple(
        effect.with_numbers((0.0,) * len(effect.numbers)) if hasattr(effect, "numbers") else effect
        for effect in varying
    )
    return _compiled(
        chain, blank, mode.kind, formulation, precision, order, sunk, chain._exact_inertia
    )


@functools.lru_cache(maxsize=256)
def _compiled(
    chain: Chain,
    effects: tuple[Effect, ...],
    mode: Mode,
    formulation: str,
    precision: str,
    order: int | None,
    sunk: frozenset[int],
    exact_inertia: Pair | None,
) -> CompiledMode:
    """Return a mode's integrator, kept for all segments and all runs in this mode."""
    hy = heyoka()
    kind = number_type(precision)
    text = kane if formulation == "kane" else lagrange
    parameters = itertools.count()
    modes = Modes(chain.convert(kind), _with_parameters(effects, parameters), text)
    mode = mode.with_numbers(tuple(hy.par[next(parameters)] for _ in mode.numbers))
    numbers = next(parameters)
    q, u = hy.make_vars("q1", "q2"), hy.make_vars("u1", "u2")
    rooted = [
        index
        for index, (element, state) in enumerate(zip(modes.elements, mode.states, strict=True))
        if isinstance(element, CompliantContact)
        and element.law.rooted
        and state is not ContactState.OPEN
    ]
    roots = {index: hy.make_vars(f"root{index}") for index in rooted}
    clock = hy.make_vars("clock")
    wanted = watches(modes, mode)
    now = hy.par[numbers + 2 * len(wanted)] + clock if rooted else hy.time
    solution = modes.solution(mode, q, u, now, roots)
    free = Free.of(modes, mode, sunk)
    gaps = {index: hy.make_vars(f"gap{index}") for index in free.gaps}
    depths = {index: hy.make_vars(f"sunk{index}") for index in free.relaxing}
    springing = {index: -rate * depths[index] for index, rate in free.relaxing.items()}
    gap_rates = [
        modes.elements[index].direction.speed(modes.chain, q, u) + springing.get(index, 0.0)
        for index in gaps
    ]
    variables = [*q, *u, *gaps.values(), *depths.values(), *roots.values()]
    places = Places(gaps, roots)
    events: list[Any] = []
    watched: list[Watch] = []
    for watch in wanted:
        quantity = margin(watch, modes, mode, solution, q, u, places)
        if not _is_constant(quantity):
            place = numbers + 2 * len(events)
            quantity = hy.par[place] * quantity + hy.par[place + 1]
            falling = hy.event_direction.negative
            events.append(hy.t_event(quantity, direction=falling, fp_type=kind))
            watched.append(watch)
    rates = [*u, *solution.du, *gap_rates, *springing.values()]
    if rooted:
        pace = functools.reduce(operator.mul, roots.values())
        rates = [rate * pace for rate in rates]
        for index in rooted:
            # d√δ/ds = dδ/dt/(2√δ) dt/ds, in which the root cancels.
            others = [root for other, root in roots.items() if other != index]
            growth = -modes.elements[index].direction.speed(modes.chain, q, u) / 2
            rates.append(functools.reduce(operator.mul, others, growth))
        variables.append(clock)
        rates.append(pace)
        ends = hy.par[numbers + 2 * len(wanted) + 1] - clock
        events.append(hy.t_event(ends, direction=hy.event_direction.negative, fp_type=kind))
    rates = [rate if isinstance(rate, hy.expression) else hy.expression(rate) for rate in rates]
    integrator = hy.taylor_adaptive(
        list(zip(variables, rates, strict=True)),
        np.array([kind(0)] * len(variables)),
        tol=kind(step_tolerance(precision, order)),
        # A mode lasts for a few steps: optimising them takes longer than they do.
        opt_level=0,
        compact_mode=compact(precision),
        fp_type=kind,
        t_events=events,
    )
    operations = len(integrator.decomposition) - 2 * len(variables)
    return CompiledMode(integrator, operations, numbers, tuple(watched), kind, bool(rooted), free)


def _with_parameters(
    effects: tuple[Any, ...], parameters: itertools.count[int]
) -> tuple[Effect, ...]:
    """Return the effects with parameters for the numbers that differ from piece to piece."""
    par = heyoka().par
    return tuple(
        effect.with_numbers(tuple(par[next(parameters)] for _ in effect.numbers))
        if hasattr(effect, "numbers")
        else effect
        for effect in effects
    )


def _is_constant(value: Any) -> bool:
    """Return whether a number or an expression is the same always: such an event never comes."""
    try:
        float(str(value))
    except ValueError:
        return False
    return True
