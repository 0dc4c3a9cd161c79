"""Work against precision: what each way costs at each of its settings, measured side by side."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable
from dataclasses import dataclass, field
from time import perf_counter
from typing import Any

import numpy as np

from twolink.accuracy.across_events import EventErrors, event_errors
from twolink.accuracy.truth import Truth, judging_times, largest_difference, truth
from twolink.accuracy.ways import Way
from twolink.scene import Scene
from twolink.simulation.motion import has_modes

# Every point is timed so often, if the budget allows.
_ROUNDS = 5

# The share of the budget for climbing the ladders; the rest is for timing again.
_CLIMBING = 0.6

# A timing whose slowest repeat takes this many times its fastest is not to be trusted.
UNREPEATABLE = 2.0

# The knob has run into rounding when so many finer settings in a row were no better; an error of
# a good part of a radian is no sign of it, only of a setting that is far too coarse.
_NO_BETTER = 2
_RESOLVED = 0.1


@dataclass(frozen=True)
class Point:
    """One way at one setting: how far it errs, and what that costs.

    `error` is the global error (rad, rad/s), `seconds` the median of the repeated runs and
    `spread` the slowest of them over the fastest, both without `compile_seconds`. `events` has the
    errors of events apart, where there are any. Where the way `failed`, that is the sentence, and
    error and time are NaN.
    """

    engine: str
    way: str
    method: str
    equations: str
    precision: str
    order: int | None
    knob: str
    setting: float
    error: float
    seconds: float
    spread: float
    repeats: int
    compile_seconds: float
    steps: int | None
    evaluations: int | None
    operations: int | None
    events: EventErrors | None = None
    failed: str = ""
    warnings: tuple[str, ...] = ()

    @property
    def repeatable(self) -> bool:
        """Whether the time can be trusted."""
        return self.repeats > 1 and self.spread < UNREPEATABLE


@dataclass(frozen=True)
class WorkPrecision:
    """All points of a scene, what judged them, and what was not tried and why."""

    scene: Scene
    points: tuple[Point, ...]
    truth: Truth
    judged_at: str
    left_out: tuple[str, ...] = ()


@dataclass
class _Rung:
    """A setting of a way while it is measured."""

    way: Way
    setting: float
    error: float = math.nan
    compile_seconds: float = 0.0
    spent: float = 0.0
    seconds: list[float] = field(default_factory=list)
    steps: int | None = None
    evaluations: int | None = None
    operations: int | None = None
    events: EventErrors | None = None
    failed: str = ""
    warnings: tuple[str, ...] = ()

    def run(self, times: Any, exact: Truth) -> None:
        """Run once more; what the first run tells is kept, and a failure too."""
        start = perf_counter()
        try:
            with np.errstate(all="ignore"):
                outcome = self.way.run(self.setting, times)
            error = largest_difference(exact, outcome.q, outcome.u)
        except Exception as problem:  # whatever others' engines raise is a result
            self.failed = f"{type(problem).__name__}: {problem}".splitlines()[0]
            self.spent += perf_counter() - start
            return
        self.spent += perf_counter() - start - outcome.compile_seconds
        if not math.isfinite(error):
            self.failed = "left the numbers: a state is not finite"
            return
        self.error, self.steps, self.evaluations = error, outcome.steps, outcome.evaluations
        self.operations, self.warnings = outcome.operations, outcome.warnings
        if exact.events or exact.impacts:
            self.events = event_errors(exact, outcome)
        self.compile_seconds = max(self.compile_seconds, outcome.compile_seconds)
        self.seconds.append(outcome.seconds)

    def point(self) -> Point:
        way, taken = self.way, self.seconds
        fine = not self.failed
        return Point(
            engine=way.engine,
            way=way.name,
            method=way.method,
            equations=way.equations,
            precision=way.precision,
            order=way.order,
            knob=way.knob,
            setting=self.setting,
            error=self.error if fine else math.nan,
            seconds=statistics.median(taken) if fine else math.nan,
            spread=max(taken) / min(taken) if fine else math.nan,
            repeats=len(taken),
            compile_seconds=self.compile_seconds,
            steps=self.steps,
            evaluations=self.evaluations,
            operations=self.operations,
            events=self.events,
            failed=self.failed,
            warnings=self.warnings,
        )


def work_precision(
    scene: Scene,
    ways: tuple[Way, ...],
    *,
    budget: float = 20.0,
    left_out: tuple[str, ...] = (),
    progress: Callable[[str, float], None] | None = None,
) -> WorkPrecision:
    """Return error and cost of every way at its settings, from coarse to fine.

    Each way climbs until finer settings are no better, until it has failed twice in a row, or until
    its share of `budget` (s) is spent. Then all points are timed again in turn, so that whatever
    else the machine does hits all alike. `progress` is told what goes on and which share is done.
    """
    times = judging_times(scene)
    tell = progress or (lambda what, share: None)
    tell("the reference", 0.0)
    exact = truth(scene, times)
    rungs: list[_Rung] = []
    stopped = list(left_out)
    left = _CLIMBING * budget
    for number, way in enumerate(ways):
        tell(way.name, _CLIMBING * number / len(ways))
        # What one way does not use is there for those that follow.
        climbed, ended_early = _climb(way, times, exact, left / (len(ways) - number))
        left -= sum(rung.spent for rung in climbed)
        rungs.extend(climbed)
        if ended_early:
            stopped.append(ended_early)
    _repeat(rungs, times, exact, (1 - _CLIMBING) * budget, tell)
    return WorkPrecision(
        scene=scene,
        points=tuple(rung.point() for rung in rungs),
        truth=exact,
        judged_at=f"{len(times)} samples" if has_modes(scene) else "the end",
        left_out=tuple(stopped),
    )


def _climb(way: Way, times: Any, exact: Truth, seconds: float) -> tuple[list[_Rung], str]:
    """Return the settings that were reached, and why finer ones were not, if time ran out."""
    rungs: list[_Rung] = []
    # What a way needs once, imports and models, is not charged to its first setting.
    _Rung(way, way.ladder[0]).run(times, exact)
    for setting in way.ladder:
        spent = sum(rung.spent for rung in rungs)
        if rungs and spent + 2 * rungs[-1].spent > seconds:
            return rungs, (
                f"{way.name}: the budget ended at {way.knob} {rungs[-1].setting:.3g}; finer ones "
                "were not tried"
            )
        rung = _Rung(way, setting)
        # The first run warms up: caches, and what is compiled for this setting.
        rung.run(times, exact)
        if not rung.failed and rung.seconds[0] < seconds / 20:
            rung.seconds.clear()
            rung.run(times, exact)
        rungs.append(rung)
        if _at_its_best(rungs):
            break
    return rungs, ""


def _at_its_best(rungs: list[_Rung]) -> bool:
    """Return whether finer settings are of no use: no better for long, or failures alone."""
    before, late = rungs[:-_NO_BETTER], rungs[-_NO_BETTER:]
    best = min((rung.error for rung in before if not rung.failed), default=math.inf)
    return best < _RESOLVED and all(rung.failed or rung.error >= best for rung in late)


def _repeat(
    rungs: list[_Rung],
    times: Any,
    exact: Truth,
    budget: float,
    tell: Callable[[str, float], None],
) -> None:
    """Time all points again in turn, those first that take least, as long as the budget lasts."""
    start = perf_counter()
    timed = sorted((rung for rung in rungs if not rung.failed), key=lambda rung: rung.seconds[0])
    for repeat in range(1, _ROUNDS):
        for rung in timed:
            spent = perf_counter() - start
            if spent + rung.seconds[0] > budget * repeat / (_ROUNDS - 1):
                break
            done = _CLIMBING + (1 - _CLIMBING) * spent / budget
            tell(f"timing again, {repeat} of {_ROUNDS - 1}", done)
            rung.run(times, exact)
