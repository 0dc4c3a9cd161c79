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
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass, field, replace
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from twolink.errors import TooMuchError
from twolink.formulations import FORMULATIONS
from twolink.integration.precisions import PrecisionName
from twolink.interruptible import side_by_side
from twolink.limits import DEFAULT_LIMITS, LIFTED, Limits
from twolink.names import EquationsName, FormulationName
from twolink.scene import Scene
from twolink.simulation.hybrid.ahead import Ahead
from twolink.simulation.hybrid.configurations import BEST_ORDER, Configuration, Seen, configurations
from twolink.simulation.hybrid.doubts import reason_of
from twolink.simulation.hybrid.effort import effort_of, most_work
from twolink.simulation.hybrid.judged import JudgedRun, best_of, work_of
from twolink.simulation.hybrid.kind import Target
from twolink.simulation.hybrid.run import HybridRun, hybrid_run
from twolink.simulation.hybrid.tolerances import BEYOND
from twolink.simulation.run import ENDS_EARLY
from twolink.simulation.shortened import (
    MOST_STEPS_TO_RESOLVE,
    CheckedRun,
    UnseenError,
    shortened_run,
    unseen_change,
)
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.simulation.smooth.longest_step import default_longest_step

Array = NDArray[np.float64]
Progress = Callable[[str], Callable[[float], None] | None]

# Steps above which orders below the best one lose accuracy.
_MANY_STEPS_OF_A_LOW_ORDER = 3000

# Memory of a run, its polynomials, and the measuring run with numbers twice as long.
_RUNS_AT_ONCE = 4

# Factor on the number of bounces that the measuring run resolves before it omits endless ones.
_MORE_PATIENCE = 2


STOPS_SHORT = (
    f"Runs in 113 bits, which may meet the accuracy, would exceed the limit of work{LIFTED}."
)
"""The note on a search that stops short."""


@dataclass(frozen=True)
class Measured:
    """The result, its largest error up to each time (rad, rad/s), its `judge`, and all runs.

    Beside the runs, `measuring_seconds` were spent on comparisons. The search is `limited` if a run
    in quadruple precision, which might have met the accuracy, was not made.
    """

    kept: HybridRun
    errors: Array
    judge: HybridRun
    runs: tuple[HybridRun, ...]
    measuring_seconds: float
    limited: bool = False

    def stops_short(self, *, met: bool) -> bool:
        """Return whether a run that was not made may meet the accuracy, which is not `met`."""
        return self.limited and not met and not self.kept.exhausted

    @property
    def why_unknown(self) -> str:
        """Why the error is infinite from a time on, where it is: a doubt, or the judge's end."""
        for run in (self.kept, self.judge):
            if run.unseen is not None:
                return unseen_change(run.unseen.length)
        if self.judge.reached < self.kept.reached:
            return ENDS_EARLY
        endless = [doubt for doubt in self.judge.doubts if doubt.may_be_endless]
        endless.sort(key=lambda doubt: (doubt.change < math.inf, doubt.within))
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
    best: JudgedRun | None = None
    measuring = 0.0
    with closing(Ahead()) as ahead:
        runs = _Runs(scene, times, EQUATIONS[formulation].in_speeds, progress, limits, ahead)
        search = _Search(runs, accuracy)
        for trial in search.trials():
            begun = perf_counter()
            best = best_of(best, trial, times)
            measuring += perf_counter() - begun + trial.seconds
            if trial.suffices or trial.is_exhausted:
                search.limited = trial.is_limited
                break
    assert best is not None
    kept = best.kept.decided(times, best.errors)
    made = tuple(runs.known.values())
    return Measured(kept, best.errors, best.judge, made, measuring, search.limited)


@dataclass
class _Search:
    """The runs that are measured, one after the other, for an accuracy (rad, rad/s).

    `seen` are the errors of the last one, `earlier` those of the one before. The search is
    `limited` if the limit of work in quadruple precision has ended it.
    """

    runs: _Runs
    accuracy: float
    limited: bool = False
    seen: Seen | None = None
    earlier: Seen | None = None

    def trials(self) -> Iterator[JudgedRun]:
        """Yield at least one run that is measured: those that may suffice, and the last.

        Raises `SimulationError` if not even the start can be integrated.
        """
        refused: TooMuchError | None = None
        too_long = False
        *_, last = every = list(configurations(self.accuracy))
        for pair in every:
            if self._is_hopeless(pair) and pair is not last:
                continue
            if too_long and not pair.shares_judge:
                self.limited = True
                return
            try:
                trial = self.runs.trial(pair, self.accuracy, is_last=pair is last)
            except _JudgeFailsError:
                continue
            except TooMuchError as error:
                if self.seen is not None:
                    return
                if not self.runs.is_made(pair):
                    raise
                # Once its error is of order one, the judge follows another motion, which may reach
                # speeds at which it takes more steps than the limits allow.
                refused = error
                continue
            if trial is None:
                continue
            yield self._with_shared(pair, trial)
            if self._is_of_start():
                return
            too_long = self._is_too_long(trial) or too_long
        if self.seen is None:
            assert refused is not None
            raise refused

    def _is_hopeless(self, pair: Configuration) -> bool:
        """Return whether a pair of runs is expected to miss the accuracy."""
        if self.seen is None:
            return pair.shares_judge
        return self.seen.expected(pair) > self.accuracy

    def _with_shared(self, pair: Configuration, trial: JudgedRun) -> JudgedRun:
        """Return a measured run with the error that it shares with its judge; others are kept."""
        if pair.shares_judge:
            assert self.seen is not None
            return trial.with_shared(self.seen.in_long_doubles)
        bounces = trial.kept.omits_bounces or trial.judge.omits_bounces
        found = Seen(pair, self.runs.times, trial.errors, trial.apart, bounces, trial.is_undecided)
        self.earlier, self.seen = self.seen, found
        return trial

    def _is_of_start(self) -> bool:
        """Return whether the change of the start causes the error, in every precision."""
        seen, earlier = self.seen, self.earlier
        if seen is None:
            return False
        stays = earlier is not None and seen.stays_as(earlier, self.accuracy)
        return seen.is_of_start or stays

    def _is_too_long(self, trial: JudgedRun) -> bool:
        """Return whether one more run in quadruple precision would exceed the limit of work.

        How much it takes is not known where the judge shows that the motion goes on.
        """
        if self.runs.limits.are_lifted:
            return False
        expected = trial.expected_work if trial.kept.reached >= trial.judge.reached else 0
        return self.runs.work + expected > most_work(self.runs.scene.duration)


class _JudgeFailsError(Exception):
    """The run that measures another one of its own precision ends before the motion does."""


_Key = tuple[PrecisionName, int, FormulationName]


@dataclass
class _Runs:
    """The runs of a scene by precision, order and formulation.

    Runs by the formulation `own` are results; the others measure them. No run goes on where it
    cannot be measured, or has nothing to measure. The modes of a judge are compiled `ahead`, beside
    the run that it measures. The `longest_step` (s) becomes shorter where one passed a change of
    the loads.
    """

    scene: Scene
    times: Array
    own: FormulationName
    progress: Progress
    limits: Limits
    ahead: Ahead = field(default_factory=Ahead)
    known: dict[_Key, HybridRun] = field(default_factory=dict)
    longest_step: float = field(init=False)

    def __post_init__(self) -> None:
        """Begin with the longest step of the scene."""
        self.longest_step = default_longest_step(self.scene)

    @property
    def work(self) -> int:
        """The work of all runs in quadruple precision, in steps."""
        return sum(work_of(run) for run in self.known.values() if run.precision == "quadruple")

    @property
    def _spent(self) -> float:
        """The work of runs that are no results."""
        every = self.known.items()
        return sum(run.work for (_, order, _), run in every if self._is_vain(order, run))

    def _is_vain(self, order: int, run: HybridRun) -> bool:
        """Return whether the requested order of a run is too low for its number of steps.

        Their truncation errors add up to more than the accuracy. Where the limit of work has ended
        the run, one of a higher order would not reach farther.
        """
        if order >= BEST_ORDER:
            return False
        most = effort_of("double", self.scene.duration, self.limits).work
        ended = bool(run.failure and run.exhausted) and run.work <= most
        return ended or run.steps > _MANY_STEPS_OF_A_LOW_ORDER

    def trial(
        self, configuration: Configuration, accuracy: float, *, is_last: bool = True
    ) -> JudgedRun | None:
        """Return a run and its errors, or None if its order is too low for its number of steps.

        Unless it is the last, raises `_JudgeFailsError` as soon as the judge of a run in its own
        precision ends before the motion does: no time is spent on the run.
        """
        if configuration.judge == "quadruple":
            # Both runs begin at once: neither has entered modes before the other.
            self.ahead.expect()
            self._make_both(configuration, measures=configuration.is_long and not is_last)
        else:
            self._expect(configuration)
        kept = self.kept(configuration)
        if self._is_vain(configuration.order, kept):
            return None
        self._expect(configuration)
        judge = self.judge(configuration, kept)
        return JudgedRun.of(kept, judge, self.times, accuracy)

    def _expect(self, configuration: Configuration) -> None:
        """Request modes for those of the two runs that have not been made."""
        keys = (
            (configuration.precision, configuration.order, self.own),
            (configuration.judge, configuration.judging_order, self._other),
        )
        coming = (key for key in keys if key not in self.known)
        self.ahead.expect(*(Target(by, precision, order) for precision, order, by in coming))

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
        """Return a run up to a time (s), or as far as it goes, whose steps pass no change of loads.

        It calls `go_on` now and then. Where no steps see the change, the last run is returned.
        """

        def made(longest: float) -> CheckedRun:
            self.longest_step = longest
            found = self._run_once(key, until, go_on)
            return CheckedRun(found, found.longest_resolving_step)

        run: HybridRun
        try:
            run = shortened_run(
                self.longest_step, self.scene.duration / MOST_STEPS_TO_RESOLVE, made
            )
        except UnseenError as error:
            run = error.run
        return run

    def _run_once(self, key: _Key, until: float, go_on: Callable[[], None]) -> HybridRun:
        precision, order, by = key
        report = self.progress(f"order {order}, {precision}") or (lambda share: None)

        def advance(share: float) -> None:
            go_on()
            report(share)

        low = by == self.own and order < BEST_ORDER
        effort = effort_of(precision, self.scene.duration, self.limits, self._spent)
        effort = effort._replace(until=until)
        if by != self.own:
            effort = effort._replace(patience=_MORE_PATIENCE * effort.patience)
        if low:
            effort = effort._replace(steps=_MANY_STEPS_OF_A_LOW_ORDER)
        return hybrid_run(
            self.scene, self.times, formulation=by, precision=precision, order=order,
            longest_step=self.longest_step, partial=True, effort=effort, progress=advance,
            limits=replace(self.limits, memory=self.limits.memory / _RUNS_AT_ONCE),
            # The difference of the runs has the change of a start that is moved onto a contact.
            judges=by != self.own,
            compiled=self.ahead.compiled,
        )  # fmt: skip
