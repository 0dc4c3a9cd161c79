"""The limit of work of a run, and the work that a run has taken."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any, NamedTuple

from twolink.contact.states import ContactState
from twolink.integration.precisions import PRECISIONS, PrecisionName
from twolink.limits import Forecast, Limits
from twolink.simulation.hybrid import tolerances
from twolink.simulation.hybrid.arc import Arc
from twolink.simulation.hybrid.compiled import CompiledMode
from twolink.simulation.hybrid.kind import Kind

STEPS_OF_A_JUMP = 4
"""The steps that last as long as a jump, in quadruple precision."""

# In double and long double precision, work is counted in steps of about 0.1 ms. A jump takes as
# long as three, with a fourth of one for each contact element and a sixth for each mode that the
# selection tries: a hundred of them where several contacts are made at once. A mode whose
# conditions are zero is expanded in a power series: that takes as long as four.
_OF_A_JUMP, _OF_AN_ELEMENT, _OF_A_TRIAL, _OF_A_SERIES = 3, 1 / 4, 1 / 6, 4

# Only the first eight steps of an arc count: later ones are certified together, and take a fourth
# of the time.
_MOST_OF_AN_ARC = 8

# A compilation without and with optimisation. Some motions enter dozens of kinds of modes.
_OF_A_COMPILATION, _OF_AN_OPTIMISATION = 300, 1000

# Durations (s) of a short and of a long motion. Between them the limits of work grow.
_SHORT, _LONG = 3.0, 6.0

# The most work of a run in long doubles, and of those of a low order before it that were in vain,
# for a short and a long motion. A short one has some 5500 bounces of two steps, or half as many
# modes with more contacts; with the run that it measures, these take 6 to 10 s. Short motions with
# more bounces do not end in most cases: they accumulate while a load presses on. A long motion has
# 16,000 modes with any number of steps.
_MOST_WORK_OF_A_JUDGE = 35_000, 190_000

# The part of it that a run in double precision may take: the one that measures it in long doubles
# goes slightly beyond its end.
_OF_WORK_OF_A_JUDGE = 15 / 16

# The most steps of runs in quadruple precision. A step takes about a millisecond.
_MOST_WORK = 6_000, 9_000

# A step on a pressed stiff surface takes a quarter of a millisecond in long double precision. Runs
# with more of them are ended.
_MOST_SHORT_STEPS = 80_000

# Memory of an arc beside its steps, and how much of it is looked at together.
_BYTES_OF_AN_ARC, _MEMORY_WINDOW = 4000, 16e6


class Effort(NamedTuple):
    """The limit of work of a run: jumps and steps in all, and lossless bounces on a contact.

    `work` counts jumps, the first steps of arcs, and compilations, in steps. A run whose steps
    would exceed `steps` at their pace is ended early. Steps are short below `SHORT_STEPS` of the
    longest one. Bounces that do not end are omitted after `patience` of them. The run ends at
    `until` (s) at the latest.
    """

    jumps: float = tolerances.MOST_JUMPS
    work: float = math.inf
    steps: float = math.inf
    short_steps: float = math.inf
    patience: float = tolerances.PATIENCE
    until: float = math.inf


DEFAULT_EFFORT = Effort()
ANY_EFFORT = Effort(jumps=math.inf, patience=math.inf)


def effort_of(
    precision: PrecisionName, duration: float, limits: Limits, spent: float = 0.0
) -> Effort:
    """Return the work that a run of a motion of a duration (s) may take.

    Where the limits are lifted, it may take any. In double and long double precision it is what
    earlier runs, in vain, have not `spent`.
    """
    if limits.are_lifted:
        return ANY_EFFORT
    if precision == "quadruple":
        most = most_work(duration)
        return Effort(jumps=most // STEPS_OF_A_JUMP, steps=most)
    work = max(_grown(_MOST_WORK_OF_A_JUDGE, duration) - spent, 0.0)
    if precision == "double":
        return Effort(work=_OF_WORK_OF_A_JUDGE * work)
    return Effort(work=work, short_steps=_MOST_SHORT_STEPS)


def most_work(duration: float) -> int:
    """Return the most work in quadruple precision that a motion of a duration (s) may take.

    It is counted in steps. A run is omitted if it is expected to exceed the limit together with
    those before, and ends where it exceeds the limit alone.
    """
    return _grown(_MOST_WORK, duration)


def _grown(limits: tuple[int, int], duration: float) -> int:
    """Return the limit for a duration (s), between those for a short and a long motion."""
    few, many = limits
    share = min(max((duration - _SHORT) / (_LONG - _SHORT), 0.0), 1.0)
    return round(few + share * (many - few))


class Work:
    """The work that a run has taken so far, in `steps` alone and `in_steps`, and its memory."""

    def __init__(
        self, effort: Effort, limits: Limits, precision: PrecisionName, cap: float, duration: float
    ) -> None:
        """Begin a run of a longest step `cap` (s) in a scene of a duration (s)."""
        self._effort, self._limits = effort, limits
        self._worth_optimising = PRECISIONS[precision].steps_worth_optimising
        self._short = tolerances.SHORT_STEPS * float(cap)
        self._description = f"the motion over {duration:g} s"
        self._growth = Forecast(_MEMORY_WINDOW)
        self._steps_in: Counter[tuple[ContactState, ...]] = Counter()
        self._compiled: set[CompiledMode] = set()
        self._kinds: set[Kind] = set()
        self._arcs = self._short_steps = self._bytes = 0
        self.steps = 0
        self.in_steps = 0.0

    def add(self, arc: Arc, tried: int = 0, expanded: int = 0) -> None:
        """Add the steps of an arc, their memory, and the jump before it.

        The jump `tried` so many modes, and since the last arc so many were `expanded` in power
        series.
        """
        count = arc.step_count
        self._arcs += 1
        self.steps += count
        states = arc.mode.states
        self._steps_in[states] += count
        self.in_steps += (
            _OF_A_JUMP
            + _OF_AN_ELEMENT * len(states)
            + _OF_A_TRIAL * tried
            + _OF_A_SERIES * expanded
            + min(count, _MOST_OF_AN_ARC)
        )
        if arc.compiled not in self._compiled:
            self._compiled.add(arc.compiled)
            self._add_kind(arc.compiled.kind)
        if float(arc.end.t - arc.start.t) < count * self._short:
            self._short_steps += count
        for block in arc.blocks:
            self._bytes += block.coefficients.nbytes
        self._bytes += _BYTES_OF_AN_ARC

    def is_worth_optimising(self, states: tuple[ContactState, ...], share: float) -> bool:
        """Return whether a mode takes so many steps that optimised code pays.

        `share` is the part of the time that has passed.
        """
        return _exceeds(self._steps_in[states], self._worth_optimising, share)

    def is_too_much(self, share: float) -> bool:
        """Return whether a run exceeds its effort after a part of its time."""
        most = self._effort
        return (
            self._arcs > most.jumps
            or self.in_steps > most.work
            or _exceeds(self.steps, most.steps, share)
            or self._short_steps > most.short_steps
        )

    def _add_kind(self, kind: Kind) -> None:
        """Add the compilation of a kind of modes, once, whether or not it was found compiled."""
        if kind not in self._kinds:
            self._kinds.add(kind)
            self.in_steps += _OF_AN_OPTIMISATION if kind.optimised else _OF_A_COMPILATION

    def check_memory(self, share: float, size: Any) -> None:
        """Raise `TooMuchError` if the whole motion would take more memory than is allowed.

        `size` (bytes) is that of the arc in progress, after a part of the time.
        """
        self._limits.check_growth(self._description, self._growth, share, self._bytes + size)


def _exceeds(count: int, most: float, share: float) -> bool:
    """Return whether a number of steps so far exceeds another one, or soon will.

    Modes that follow each other in ever shorter times and then end have a pace that does not last,
    but they are few: a pace counts from a part of the number on.
    """
    if count <= tolerances.EARLY * most:
        return False
    return count > most or count > tolerances.CERTAINLY * most * share
