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

STEPS_OF_A_JUMP = 4
"""The steps that last as long as a jump."""

# The steps that last as long as the compilation of a kind of modes. Some motions enter dozens of
# kinds. In quadruple precision a step takes ten times as long.
_STEPS_OF_A_COMPILATION: dict[PrecisionName, int] = {
    "double": 200,
    "long double": 200,
    "quadruple": 20,
}

# Durations (s) of a short and of a long motion. Between them the limits of work grow: a short one
# is given up after about 10 s.
_SHORT, _LONG = 3.0, 6.0

# The most work of a run in long doubles, in steps, for a short and a long motion: some 6000 and
# 12000 bounces. A step takes a tenth of a millisecond, with those of the run that it measures a
# fifth. Short motions with more of them do not end in most cases: bounces accumulate while a load
# presses on.
_MOST_WORK_OF_A_JUDGE = 30_000, 60_000

# The part of it that a run in double precision may take: the one that measures it in long doubles
# goes slightly beyond its end.
_OF_WORK_OF_A_JUDGE = 15 / 16

# The most work of runs in quadruple precision. A step takes about a millisecond.
_MOST_WORK = 6_000, 9_000

# A step on a pressed stiff surface takes a quarter of a millisecond in long double precision. Runs
# with more of them are ended.
_MOST_SHORT_STEPS = 80_000

# Memory of an arc beside its steps, and how much of it is looked at together.
_BYTES_OF_AN_ARC, _MEMORY_WINDOW = 4000, 16e6


class Effort(NamedTuple):
    """The limit of work of a run: jumps and steps in all, and lossless bounces on a contact.

    Its `work` is counted in steps: those of the run, of its jumps, and of the compilation of its
    modes. A run whose steps would exceed `steps` at their pace is ended early. Steps are short
    below `SHORT_STEPS` of the longest one. Bounces that do not end are omitted after `patience` of
    them. The run ends at `until` (s) at the latest.
    """

    jumps: float = tolerances.MOST_JUMPS
    work: float = math.inf
    steps: float = math.inf
    short_steps: float = math.inf
    patience: float = tolerances.PATIENCE
    until: float = math.inf


DEFAULT_EFFORT = Effort()
ANY_EFFORT = Effort(jumps=math.inf, patience=math.inf)


def effort_of(precision: PrecisionName, duration: float, limits: Limits) -> Effort:
    """Return the work that a run of a motion of a duration (s) may take.

    Where the limits are lifted, it may take any.
    """
    if limits.are_lifted:
        return ANY_EFFORT
    if precision == "quadruple":
        work = most_work(duration)
        return Effort(work=work, steps=work)
    work = _grown(_MOST_WORK_OF_A_JUDGE, duration)
    if precision == "double":
        return Effort(work=int(_OF_WORK_OF_A_JUDGE * work))
    return Effort(work=work, short_steps=_MOST_SHORT_STEPS)


def most_work(duration: float) -> int:
    """Return the most work in quadruple precision that a motion of a duration (s) may take.

    It is counted in steps. No run is attempted that is expected to exceed it together with those
    before, and one is ended if it exceeds it alone.
    """
    return _grown(_MOST_WORK, duration)


def _grown(limits: tuple[int, int], duration: float) -> int:
    """Return the limit for a motion of a duration (s), of those for a short and a long one."""
    few, many = limits
    share = min(max((duration - _SHORT) / (_LONG - _SHORT), 0.0), 1.0)
    return round(few + share * (many - few))


class Work:
    """The steps and the memory that a run has taken so far."""

    def __init__(
        self, effort: Effort, limits: Limits, precision: PrecisionName, cap: float, duration: float
    ) -> None:
        """Begin a run of a longest step `cap` (s) in a scene of a duration (s)."""
        self._effort, self._limits = effort, limits
        self._compilation = _STEPS_OF_A_COMPILATION[precision]
        self._worth_optimising = PRECISIONS[precision].steps_worth_optimising
        self._short = tolerances.SHORT_STEPS * float(cap)
        self._description = f"the motion over {duration:g} s"
        self._growth = Forecast(_MEMORY_WINDOW)
        self._steps_in: Counter[tuple[ContactState, ...]] = Counter()
        self._kinds: set[int] = set()
        self._arcs = self._short_steps = self._bytes = 0
        self.steps = 0

    def add(self, arc: Arc) -> None:
        """Add the steps of an arc, and their memory."""
        count = arc.step_count
        self._arcs += 1
        self.steps += count
        self._steps_in[arc.mode.states] += count
        # Modes of one kind share a pool of integrators.
        self._kinds.add(id(arc.compiled.pool))
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
            or self._in_steps > most.work
            or _exceeds(self.steps, most.steps, share)
            or self._short_steps > most.short_steps
        )

    @property
    def _in_steps(self) -> int:
        """The work so far, in steps."""
        jumps, compilations = STEPS_OF_A_JUMP * self._arcs, self._compilation * len(self._kinds)
        return self.steps + jumps + compilations

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
