"""A hybrid run whose global error is measured by an independent run of a longer precision.

The second run shares neither round-off nor equations with the first: it uses the next precision,
the other formulation and a higher order. Their difference is the error of the first run, provided
that the second is more accurate, which the sequence of precisions and orders ensures. Of two runs
in the longest precision the second has the lower order: their difference is its error, which is
the larger one. Of two in long doubles the second has measured a run in double precision before,
and a part of the error of that is added for what both may leave out.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from twolink.errors import TooMuchError
from twolink.formulations import FORMULATIONS
from twolink.integration.precisions import PrecisionName
from twolink.interruptible import side_by_side
from twolink.limits import DEFAULT_LIMITS, Limits
from twolink.names import EquationsName, FormulationName
from twolink.scene import Scene
from twolink.simulation.hybrid.configurations import BEST_ORDER, Configuration, Seen, configurations
from twolink.simulation.hybrid.differences import MARGIN_OF_EQUALS, differences
from twolink.simulation.hybrid.doubts import reason_of
from twolink.simulation.hybrid.effort import Effort
from twolink.simulation.hybrid.run import HybridRun, hybrid_run
from twolink.simulation.hybrid.tolerances import BEYOND, PATIENCE
from twolink.simulation.run import ENDS_EARLY
from twolink.simulation.smooth.equations import EQUATIONS

Array = NDArray[np.float64]
Progress = Callable[[str], Callable[[float], None] | None]

# Allowance for the error of the measuring run: it is a thousandth, and stated as a tenth.
_MARGIN = 1.1

# A step in quadruple precision takes about a millisecond, and a jump as long as several steps.
# Longer runs are not attempted in it, and runs that exceed the limit are ended.
_MOST_WORK = 8_000
_STEPS_OF_A_JUMP = 4
_MOST_JUMPS: dict[PrecisionName, int] = {
    "quadruple": _MOST_WORK // _STEPS_OF_A_JUMP,
    "long double": 12_000,
}
# Jumps in long double precision that a second of motion may take, and those of any motion. A jump
# takes half a millisecond, and motions with more of them in a short time do not end in most cases:
# bounces accumulate while a load presses on.
_JUMPS_OF_A_SECOND, _JUMPS_OF_ANY = 2_000, 6_000

# The part of these jumps that a run in double precision may take: the one that measures it in long
# doubles goes slightly beyond its end.
_OF_JUMPS_OF_A_JUDGE = 15 / 16

# A step on a pressed stiff surface takes a quarter of a millisecond in long double precision. Runs
# with more of them are ended.
_MOST_SHORT_STEPS: dict[PrecisionName, int] = {"long double": 80_000}

# Steps above which orders below the best one lose accuracy.
_MANY_STEPS_OF_A_LOW_ORDER = 3000

# Relative difference of the ends of two runs that reach equally far.
_DIGITS = 4

# Memory of a run, its polynomials, and the measuring run with numbers twice as long.
_RUNS_AT_ONCE = 4

# Factor on the number of bounces that the measuring run resolves before it omits endless ones.
_MORE_PATIENCE = 2


@dataclass(frozen=True)
class Measured:
    """The result, its largest error up to each time (rad, rad/s), its `judge`, and all runs.

    Beside the runs, `measuring_seconds` were spent on comparisons.
    """

    kept: HybridRun
    errors: Array
    judge: HybridRun
    runs: tuple[HybridRun, ...]
    measuring_seconds: float

    @property
    def why_unknown(self) -> str:
        """Why the error is infinite from a time on, where it is: a doubt, or the judge's end."""
        if self.judge.reached < self.kept.reached:
            return ENDS_EARLY
        endless = [doubt for doubt in self.judge.doubts if doubt.change == math.inf]
        endless.sort(key=lambda doubt: doubt.within)
        return reason_of(endless[0], self.judge.arcs[0].mode.names) if endless else ENDS_EARLY


def measured_run(
    scene: Scene,
    times: Array,
    accuracy: float,
    formulation: EquationsName,
    progress: Progress,
    limits: Limits = DEFAULT_LIMITS,
) -> Measured:
    """Return a run that meets an accuracy, or the most accurate one.

    `progress` maps the name of a run to a function that receives its completed share. Raises
    `SimulationError` if not even the start can be integrated.
    """
    runs = _Runs(scene, times, EQUATIONS[formulation].in_speeds, progress, limits)
    best: _Trial | None = None
    refused: TooMuchError | None = None
    measuring = 0.0
    too_long = False
    seen: Seen | None = None
    every = list(configurations(accuracy))
    for configuration in every:
        hopeless = seen.expected(configuration) > accuracy if seen else configuration.beside
        is_last = configuration is every[-1]
        if hopeless and not is_last:
            continue
        if too_long and not configuration.beside:
            break
        try:
            trial = runs.trial(configuration, accuracy, is_last=is_last)
        except _JudgeFailsError:
            continue
        except TooMuchError as error:
            if best is not None:
                break
            if not runs.is_made(configuration):
                raise
            # Once its error is of order one, the judge follows another motion, which may reach
            # speeds at which it takes more steps than the limits allow.
            refused = error
            continue
        if trial is None:
            continue
        if not configuration.beside:
            bounces = trial.kept.omits_bounces or trial.judge.omits_bounces
            seen = Seen(configuration, times, trial.errors, trial.apart, bounces)
        elif seen is not None:
            trial = trial.beside(seen.in_long_doubles)
        begun = perf_counter()
        best = _best_of(best, trial, times)
        measuring += perf_counter() - begun + trial.seconds
        if trial.suffices or trial.is_exhausted or (seen is not None and seen.is_of_start):
            break
        too_long = too_long or trial.is_too_long
    if best is None:
        assert refused is not None
        raise refused
    kept = best.kept.decided(times, best.errors)
    return Measured(kept, best.errors, best.judge, tuple(runs.known.values()), measuring)


class _JudgeFailsError(Exception):
    """The run that measures another one of its own precision ends before the motion does."""


_Key = tuple[PrecisionName, int, FormulationName]


@dataclass(frozen=True)
class _Runs:
    """The runs of a scene by precision, order and formulation.

    Runs by the formulation `own` are results; the others measure them. No run goes on where it
    cannot be measured, or has nothing to measure.
    """

    scene: Scene
    times: Array
    own: FormulationName
    progress: Progress
    limits: Limits
    known: dict[_Key, HybridRun] = field(default_factory=dict)

    def trial(
        self, configuration: Configuration, accuracy: float, *, is_last: bool = True
    ) -> _Trial | None:
        """Return a run and its errors, or None if its order is too low for its number of steps.

        Unless it is the last, raises `_JudgeFailsError` as soon as the judge of a run in its own
        precision ends before the motion does: no time is spent on the run.
        """
        if configuration.is_long:
            self._make_both(configuration, measures=not is_last)
        kept = self.kept(configuration)
        many = kept.steps > _MANY_STEPS_OF_A_LOW_ORDER or (kept.failure and kept.exhausted)
        if configuration.order < BEST_ORDER and many:
            # The truncation errors of many steps add up to more than the accuracy.
            return None
        judge = self.judge(configuration, kept)
        margin = _MARGIN if configuration.precision != configuration.judge else MARGIN_OF_EQUALS
        begun = perf_counter()
        errors = margin * differences(kept, judge, self.times, accuracy)
        spent = perf_counter() - begun
        return _Trial(kept, judge, errors, accuracy, float(self.times[-1]), spent)

    def _make_both(self, configuration: Configuration, *, measures: bool) -> None:
        """Make the runs of a configuration, each in a thread: their steps need no interpreter.

        With `measures` raises `_JudgeFailsError` if the laws end the judge before the motion ends.
        """
        own = configuration.precision, configuration.order, self.own
        other = configuration.judge, configuration.judging_order, self._other
        missing = [key for key in (own, other) if key not in self.known]

        def checked(key: _Key, run: HybridRun) -> HybridRun:
            if measures and key == other and run.failure and not run.exhausted:
                self.known[key] = run
                raise _JudgeFailsError
            return run

        def made(key: _Key) -> Callable[[Callable[[], None]], HybridRun]:
            return lambda go_on: checked(key, self._run(key, self.scene.duration, go_on))

        if other in self.known:
            checked(other, self.known[other])
        self.known.update(zip(missing, side_by_side(*map(made, missing)), strict=True))

    def is_made(self, configuration: Configuration) -> bool:
        """Return whether the run of a configuration is there, with or without its judge."""
        return (configuration.precision, configuration.order, self.own) in self.known

    def kept(self, configuration: Configuration) -> HybridRun:
        """Return the run of a configuration, as far as it goes and can be measured."""
        if configuration.precision == "double":
            return self._made(
                configuration.precision, configuration.order, self.own, self.scene.duration
            )
        # Here the run that measures is short of work before this one is.
        judge = self._judge(configuration, self.scene.duration)
        if not (judge.failure and judge.exhausted):
            return self._made(
                configuration.precision, configuration.order, self.own, self.scene.duration
            )
        made = self._made(configuration.precision, configuration.order, self.own, judge.reached)
        if made.reached > judge.reached:
            made = made.until(self.times, judge.reached)
        return made if made.failure else replace(made, failure=judge.failure, exhausted=True)

    def judge(self, configuration: Configuration, kept: HybridRun) -> HybridRun:
        """Return the run that measures one of a configuration, slightly beyond the end of it."""
        beyond = kept.reached + BEYOND * self.scene.duration if kept.failure else math.inf
        return self._judge(configuration, min(beyond, self.scene.duration))

    def _judge(self, configuration: Configuration, until: float) -> HybridRun:
        return self._made(configuration.judge, configuration.judging_order, self._other, until)

    @property
    def _other(self) -> FormulationName:
        """The formulation of the judges."""
        return next(name for name in FORMULATIONS if name != self.own)

    def _made(
        self, precision: PrecisionName, order: int, by: FormulationName, until: float
    ) -> HybridRun:
        """Return a run up to a time (s), or as far as it goes; it is made once."""
        key = precision, order, by
        known = self.known.get(key)
        if known is None or (known.reached < until and not known.failure):
            self.known[key] = self._run(key, until)
        return self.known[key]

    def _run(self, key: _Key, until: float, go_on: Callable[[], None] = lambda: None) -> HybridRun:
        """Return a run up to a time (s), or as far as it goes; it calls `go_on` now and then."""
        precision, order, by = key
        report = self.progress(f"order {order}, {precision}") or (lambda share: None)

        def advance(share: float) -> None:
            go_on()
            report(share)

        low = by == self.own and order < BEST_ORDER
        effort = Effort(
            jumps=_most_jumps(precision, self.scene.duration),
            steps=_MANY_STEPS_OF_A_LOW_ORDER if low else math.inf,
            short_steps=_MOST_SHORT_STEPS.get(precision, math.inf),
            patience=PATIENCE if by == self.own else _MORE_PATIENCE * PATIENCE,
            until=until,
        )
        return hybrid_run(
            self.scene, self.times, formulation=by, precision=precision, order=order,
            partial=True, effort=effort, progress=advance,
            limits=replace(self.limits, memory=self.limits.memory / _RUNS_AT_ONCE),
            # The difference of the runs has the change of a start that is moved onto a contact.
            judges=by != self.own,
        )  # fmt: skip


def _most_jumps(precision: PrecisionName, duration: float) -> int:
    """Return the number of jumps after which a run of a motion (s) is ended."""
    if precision == "quadruple":
        return _MOST_JUMPS[precision]
    of_time = max(_JUMPS_OF_ANY, math.ceil(_JUMPS_OF_A_SECOND * duration))
    of_judge = min(_MOST_JUMPS["long double"], of_time)
    return of_judge if precision == "long double" else int(_OF_JUMPS_OF_A_JUDGE * of_judge)


@dataclass(frozen=True)
class _Trial:
    """A run, the run that measures it, and its errors for an accuracy (rad, rad/s).

    Both are to reach the time `end` (s). The errors took `seconds`.
    """

    kept: HybridRun
    judge: HybridRun
    errors: Array
    accuracy: float
    end: float
    seconds: float = 0.0

    def judged_by(self, judge: HybridRun, times: Array) -> _Trial:
        """Return the trial with the errors that a more precise run shows, as far as it reaches.

        A run that agreed with its own judge may differ from this one.
        """
        found = _MARGIN * differences(self.kept, judge, times, self.accuracy)
        reached = times[: len(found)] <= judge.reached
        return replace(self, errors=np.where(reached, np.maximum(self.errors, found), self.errors))

    def beside(self, shared: Array) -> _Trial:
        """Return the trial with errors (rad, rad/s) that its two runs may share."""
        return replace(self, errors=self.errors + shared[: len(self.errors)])

    @property
    def apart(self) -> float:
        """The difference of the starts of two runs of one precision (rad, rad/s)."""
        if self.kept.precision != self.judge.precision:
            return 0.0
        starts = ([*run.start[0], *run.start[1]] for run in (self.kept, self.judge))
        return max(abs(float(y - x)) for x, y in zip(*starts, strict=True))

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
    def rank(self) -> tuple[float, float]:
        """The larger, the better: first by the part of the time that is reached."""
        return round(self.known_until / self.end, _DIGITS), -self.worst

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
    def is_exhausted(self) -> bool:
        """Whether a run was ended by its effort: others would be too."""
        return bool(self.kept.exhausted or self.judge.exhausted)

    @property
    def is_too_long(self) -> bool:
        """Whether the longest precision would take too long."""
        # The run whose error is of order one may have reached high speeds, and taken more steps.
        both = self.kept, self.judge
        work = min(run.steps + _STEPS_OF_A_JUMP * len(run.arcs) for run in both)
        return work > _MOST_WORK and self.kept.reached >= self.judge.reached


def _best_of(best: _Trial | None, trial: _Trial, times: Array) -> _Trial:
    """Return the trial of the higher rank, after the new one's judge has judged both."""
    if best is None or trial.is_perfect:
        return trial
    judged = best.judged_by(trial.judge, times)
    return trial if trial.rank > judged.rank else judged
