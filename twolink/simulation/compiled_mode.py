"""Modes compiled by heyoka, in any precision: each when it is first entered."""

from __future__ import annotations

import functools
import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np

from twolink import kane, lagrange
from twolink.arithmetic import Pair
from twolink.chain import Chain
from twolink.effects import Effect
from twolink.simulation.mode import Mode, State
from twolink.simulation.modes import Modes
from twolink.simulation.taylor import heyoka, number_type, step_tolerance
from twolink.simulation.watching import Kind, Watch, margin, watches

# What is watched is a multiple of the quantity and a little more. heyoka misses later roots of a
# polynomial that starts at zero exactly, as a gap does after an impact: so little moves no root and
# is not zero. What is not to be watched is 1 all the time.
_IN_SIGHT = (1.0, 1e-100)
_OUT_OF_SIGHT = (0.0, 1.0)


@dataclass(frozen=True)
class Segment:
    """A stretch of the motion in one mode, from a start to an end (s), from q, u and the gaps.

    `effects` are those that act in it. `unwatched` are those whose quantities have only just left
    zero, or stay there. `since` is when the mode is said to begin (s).
    """

    mode: Mode
    effects: tuple[Effect, ...]
    start: Any
    end: Any
    state: tuple[Any, ...]
    unwatched: frozenset[Watch]
    since: Any


@dataclass(frozen=True)
class CompiledMode:
    """A mode's integrator, and what it watches for.

    Of its parameters the first are the `numbers` of effects that differ from piece to piece; then
    there are two for each event.
    """

    integrator: Any
    numbers: int
    watches: tuple[Watch, ...]
    kind: Any

    def set_to(self, segment: Segment) -> Any:
        """Return the integrator, set to a segment's start."""
        integrator = self.integrator
        integrator.state[:] = segment.state
        integrator.time = segment.start
        numbers = [
            number for effect in segment.effects for number in getattr(effect, "numbers", ())
        ]
        for place, number in enumerate(numbers):
            integrator.pars[place] = self.kind(number)
        for place, watch in enumerate(self.watches):
            sight = _OUT_OF_SIGHT if watch in segment.unwatched else _IN_SIGHT
            for offset, value in enumerate(sight):
                integrator.pars[self.numbers + 2 * place + offset] = self.kind(value)
        if self.watches:
            integrator.reset_cooldowns()
        return integrator


def compiled_mode(
    chain: Chain,
    effects: tuple[Effect, ...],
    mode: Mode,
    formulation: str,
    precision: str,
    order: int | None,
) -> CompiledMode:
    """Return a mode's integrator, compiled unless it already was."""
    varying: tuple[Any, ...] = effects
    blank = tuple(
        effect.with_numbers((0.0,) * len(effect.numbers)) if hasattr(effect, "numbers") else effect
        for effect in varying
    )
    return _compiled(chain, blank, mode, formulation, precision, order, chain._exact_inertia)


@functools.lru_cache(maxsize=256)
def _compiled(
    chain: Chain,
    effects: tuple[Effect, ...],
    mode: Mode,
    formulation: str,
    precision: str,
    order: int | None,
    exact_inertia: Pair | None,
) -> CompiledMode:
    """Return a mode's integrator, kept for all segments and all runs in this mode."""
    hy = heyoka()
    kind = number_type(precision)
    text = kane if formulation == "kane" else lagrange
    numbers = sum(len(getattr(effect, "numbers", ())) for effect in effects)
    modes = Modes(chain.convert(kind), _with_parameters(effects), text)
    q, u = hy.make_vars("q1", "q2"), hy.make_vars("u1", "u2")
    solution = modes.solution(mode, q, u, hy.time)
    # A gap is a variable of its own: it starts at 0 after an impact, and then has digits of its
    # own, however low the bounce, where a difference of positions would have none left.
    free = [i for i, state in enumerate(mode.states) if state is State.OPEN]
    gaps = {index: hy.make_vars(f"gap{index}") for index in free}
    gap_rates = [modes.elements[index].direction.speed(modes.chain, q, u) for index in free]
    variables = [*q, *u, *gaps.values()]
    events: list[Any] = []
    watched: list[Watch] = []
    for watch in watches(modes, mode):
        if watch.kind is Kind.HITS:
            quantity = gaps[watch.number]
        else:
            quantity = margin(watch, modes, mode, solution, q, u)
        if not _is_constant(quantity):
            place = numbers + 2 * len(events)
            quantity = hy.par[place] * quantity + hy.par[place + 1]
            falling = hy.event_direction.negative
            events.append(hy.t_event(quantity, direction=falling, fp_type=kind))
            watched.append(watch)
    rates = [
        rate if isinstance(rate, hy.expression) else hy.expression(rate)
        for rate in (*u, *solution.du, *gap_rates)
    ]
    integrator = hy.taylor_adaptive(
        list(zip(variables, rates, strict=True)),
        np.array([kind(0)] * len(variables)),
        tol=kind(step_tolerance(precision, order)),
        # A mode lasts for a few steps: optimising them takes longer than they do.
        opt_level=0,
        fp_type=kind,
        t_events=events,
    )
    return CompiledMode(integrator, numbers, tuple(watched), kind)


def _with_parameters(effects: tuple[Any, ...]) -> tuple[Effect, ...]:
    """Return the effects with parameters for the numbers that differ from piece to piece."""
    parameters = itertools.count()
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
