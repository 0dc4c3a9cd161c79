"""A hybrid run beside the one that measures it, and which of two such runs is the better result."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from twolink.arithmetic import exactly
from twolink.integration.precisions import PRECISIONS
from twolink.simulation.hybrid.differences import MARGIN_OF_EQUALS, differences
from twolink.simulation.hybrid.effort import STEPS_OF_A_JUMP
from twolink.simulation.hybrid.run import HybridRun
from twolink.simulation.hybrid.tolerances import SATURATED

Array = NDArray[np.float64]

# Allowance for the error of the measuring run: it is a thousandth, and stated as a tenth.
_MARGIN = 1.1

# Relative difference of the ends of two runs that reach equally far.
_DIGITS = 4


@dataclass(frozen=True)
class JudgedRun:
    """A run, the run that measures it, and its errors for an accuracy (rad, rad/s).

    Both are to reach the time `end` (s). The errors took `seconds`.
    """

    kept: HybridRun
    judge: HybridRun
    errors: Array
    accuracy: float
    end: float
    seconds: float = 0.0

    @classmethod
    def of(cls, kept: HybridRun, judge: HybridRun, times: Array, accuracy: float) -> JudgedRun:
        """Return a run with the errors that another one shows."""
        margin = _MARGIN if kept.precision != judge.precision else MARGIN_OF_EQUALS
        begun = perf_counter()
        errors = margin * differences(kept, judge, times, accuracy)
        for run in (kept, judge):
            if run.unseen is not None:
                errors = np.where(times[: len(errors)] < run.unseen.time, errors, math.inf)
        return cls(kept, judge, errors, accuracy, float(times[-1]), perf_counter() - begun)

    def judged_by(self, judge: HybridRun, times: Array) -> JudgedRun:
        """Return the run with the errors that a more precise one shows, as far as it reaches.

        A run that agreed with its own judge may differ from this one.
        """
        found = _MARGIN * differences(self.kept, judge, times, self.accuracy)
        reached = times[: len(found)] <= judge.reached
        return replace(self, errors=np.where(reached, np.maximum(self.errors, found), self.errors))

    def with_shared(self, shared: Array) -> JudgedRun:
        """Return the run with errors (rad, rad/s) added that it may share with its judge."""
        return replace(self, errors=self.errors + shared[: len(self.errors)])

    @property
    def apart(self) -> float:
        """The difference of the starts of two runs (rad, rad/s)."""
        starts = ([*run.start[0], *run.start[1]] for run in (self.kept, self.judge))
        number = PRECISIONS[self.judge.precision].number
        return max(abs(float(y - exactly(x, number))) for x, y in zip(*starts, strict=True))

    @property
    def is_undecided(self) -> bool:
        """Whether the error is unknown by a choice that the judge's own round-off leaves open."""
        open_ones = (d for d in self.judge.doubts if d.change == math.inf and not d.within)
        return self.worst == math.inf and any(d.time <= self.kept.reached for d in open_ones)

    @property
    def worst(self) -> float:
        """The largest error."""
        return float(self.errors.max(initial=0.0))

    @property
    def known_until(self) -> float:
        """The time (s) until which the run is a motion.

        Where the laws end the more precise run, the other one has continued by round-off.
        """
        ended = self.judge.failure and not self.judge.exhausted
        return min(self.kept.reached, self.judge.reached) if ended else self.kept.reached

    @property
    def rank(self) -> tuple[float, float, int, float]:
        """The larger, the better: first by the part of the time that is reached.

        Runs that follow another motion in the end are compared by how long they are accurate.
        """
        held = int((self.errors <= self.accuracy).sum())
        reached = round(self.known_until / self.end, _DIGITS)
        return reached, -min(self.worst, SATURATED), held, -self.worst

    @property
    def suffices(self) -> bool:
        """Whether the run is accurate enough, and reaches as far as the one that measures it."""
        accuracy, reached = self.accuracy, self.kept.reached
        whole = self.judge.reached - accuracy <= reached <= self.known_until + accuracy
        return self.worst <= accuracy and whole

    @property
    def is_perfect(self) -> bool:
        """Whether the run is accurate enough up to the end."""
        return self.suffices and self.rank[0] == 1.0

    @property
    def is_limited(self) -> bool:
        """Whether the limit of work has ended a run in quadruple precision."""
        both = self.kept, self.judge
        return any(run.precision == "quadruple" and run.exhausted and run.failure for run in both)

    @property
    def is_exhausted(self) -> bool:
        """Whether a run was ended by its effort: others would be too."""
        return bool(self.kept.exhausted or self.judge.exhausted)

    @property
    def expected_work(self) -> int:
        """The work of such a run in quadruple precision, in steps.

        The run whose error is of order one may have reached high speeds, and taken more of them.
        """
        return min(map(work_of, (self.kept, self.judge)))


def work_of(run: HybridRun) -> int:
    """Return the work of a run in quadruple precision, in steps."""
    return run.steps + STEPS_OF_A_JUMP * len(run.arcs)


def best_of(best: JudgedRun | None, trial: JudgedRun, times: Array) -> JudgedRun:
    """Return the run of the higher rank, after the judge of the new one has judged both."""
    if best is None or trial.is_perfect:
        return trial
    judged = best.judged_by(trial.judge, times)
    return trial if trial.rank > judged.rank else judged
