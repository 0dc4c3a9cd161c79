"""A hybrid run whose global error is measured by an independent run of a longer precision.

The second run shares neither round-off nor equations with the first: it uses the next precision,
the other formulation and a higher order. Their difference is the error of the first run, provided
that the second is more accurate, which the sequence of precisions and orders ensures.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from twolink.contact.impact_laws import Regime
from twolink.errors import TooMuchError
from twolink.formulations import FORMULATIONS
from twolink.integration.precisions import PRECISIONS, PrecisionName
from twolink.limits import DEFAULT_LIMITS, Limits
from twolink.names import EquationsName, FormulationName
from twolink.scene import Scene
from twolink.simulation.hybrid.run import Effort, HybridRun, hybrid_run
from twolink.simulation.hybrid.tolerances import BEYOND, MOST_JUMPS, PATIENCE
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.times import merged

Array = NDArray[np.float64]
Progress = Callable[[str], Callable[[float], None] | None]

# The constraints of a mode hold to round-off at any accuracy.
_LOWEST_ORDER = 15

# Assumed growth of the errors of a step over a run, before a retry.
_GROWTH = 1e3

# Allowance for the error of the measuring run: it is a thousandth, and stated as a tenth.
_MARGIN = 1.1

# Two runs in the same precision may have equal errors.
_MARGIN_OF_EQUALS = 3.0

# Impacts of two runs that differ by less than this many times the accuracy (s) are identified.
_SAME_IMPACT = 1e3

# Units in the last place around the two instants of an impact.
_SLACK = 4

# A step in quadruple precision takes about a millisecond, and a jump as long as several steps.
# Longer runs are not attempted in it, and runs that exceed the limit are ended.
_MOST_WORK = 8_000
_STEPS_OF_A_JUMP = 4
_MOST_JUMPS: dict[PrecisionName, int] = {
    "quadruple": _MOST_WORK // _STEPS_OF_A_JUMP,
    "long double": 12_000,
}
# A step on a pressed stiff surface takes a quarter of a millisecond in long double precision. Runs
# with more of them are ended.
_MOST_SHORT_STEPS: dict[PrecisionName, int] = {"long double": 80_000}

# The order without truncation error in double precision, and the steps above which lower orders
# lose accuracy.
_BEST_ORDER = 21
_MANY_STEPS_OF_A_LOW_ORDER = 3000

# A higher order of the same precision gains less than this many times the accuracy.
_LOST = 1e4

# Relative difference of the ends of two runs that reach equally far.
_DIGITS = 4

# Memory of a run, its polynomials, and the measuring run with numbers twice as long.
_RUNS_AT_ONCE = 4

# Factor on the number of bounces that the measuring run resolves before it omits endless ones.
_MORE_PATIENCE = 2

# Places of each step at which runs are compared; its polynomial is least accurate near its end.
_PLACES = (0.25, 0.5, 0.75, 0.99)

# Number of steps above which runs are compared only in the middle of steps.
_MANY_STEPS = 20_000


class Configuration(NamedTuple):
    """A precision and an order, and those of the run that judges it."""

    precision: PrecisionName
    order: int
    judge: PrecisionName
    judging_order: int


@dataclass(frozen=True)
class Measured:
    """The result, its largest error up to each time (rad, rad/s), its `judge`, and all runs."""

    kept: HybridRun
    errors: Array
    judge: HybridRun
    runs: tuple[HybridRun, ...]


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
    for configuration in _configurations(accuracy):
        if (
            configuration.precision == "double"
            and best is not None
            and best.worst > _LOST * accuracy
        ):
            # A higher order does not gain that many digits.
            continue
        try:
            trial = runs.trial(configuration, accuracy)
        except TooMuchError:
            if best is None:
                raise
            break
        if trial is None:
            continue
        # A run that agreed with its judge may differ from a more precise one.
        if best is None or trial.rank > (best := best.judged_by(trial.judge, times)).rank:
            best = trial
        if trial.suffices or trial.ends_the_search:
            break
    assert best is not None
    return Measured(best.kept, best.errors, best.judge, tuple(runs.known.values()))


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
    known: dict[tuple[PrecisionName, int, FormulationName], HybridRun] = field(default_factory=dict)

    def trial(self, configuration: Configuration, accuracy: float) -> _Trial | None:
        """Return a run and its errors, or None if its order is too low for its number of steps."""
        kept = self.kept(configuration)
        many = kept.steps > _MANY_STEPS_OF_A_LOW_ORDER or (kept.failure and kept.exhausted)
        if configuration.order < _BEST_ORDER and many:
            # The truncation errors of many steps add up to more than the accuracy.
            return None
        judge = self.judge(configuration, kept)
        margin = _MARGIN if configuration.precision != configuration.judge else _MARGIN_OF_EQUALS
        errors = margin * differences(kept, judge, self.times, accuracy)
        return _Trial(kept, judge, errors, accuracy, float(self.times[-1]))

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
        return made if made.failure else replace(made, failure=judge.failure, exhausted=True)

    def judge(self, configuration: Configuration, kept: HybridRun) -> HybridRun:
        """Return the run that measures one of a configuration, slightly beyond the end of it."""
        beyond = kept.reached + BEYOND * self.scene.duration if kept.failure else math.inf
        return self._judge(configuration, min(beyond, self.scene.duration))

    def _judge(self, configuration: Configuration, until: float) -> HybridRun:
        other = next(name for name in FORMULATIONS if name != self.own)
        return self._made(configuration.judge, configuration.judging_order, other, until)

    def _made(
        self, precision: PrecisionName, order: int, by: FormulationName, until: float
    ) -> HybridRun:
        """Return a run up to a time (s), or as far as it goes; it is made once."""
        key = precision, order, by
        known = self.known.get(key)
        if known is None or (known.reached < until and not known.failure):
            low = by == self.own and order < _BEST_ORDER
            effort = Effort(
                jumps=_MOST_JUMPS.get(precision, MOST_JUMPS),
                steps=_MANY_STEPS_OF_A_LOW_ORDER if low else math.inf,
                short_steps=_MOST_SHORT_STEPS.get(precision, math.inf),
                patience=PATIENCE if by == self.own else _MORE_PATIENCE * PATIENCE,
                until=until,
            )
            self.known[key] = hybrid_run(
                self.scene, self.times, formulation=by, precision=precision, order=order,
                partial=True, effort=effort, progress=self.progress(f"order {order}, {precision}"),
                limits=replace(self.limits, memory=self.limits.memory / _RUNS_AT_ONCE),
            )  # fmt: skip
        return self.known[key]


@dataclass(frozen=True)
class _Trial:
    """A run, the run that measures it, and its errors for an accuracy (rad, rad/s).

    Both are to reach the time `end` (s).
    """

    kept: HybridRun
    judge: HybridRun
    errors: Array
    accuracy: float
    end: float

    def judged_by(self, judge: HybridRun, times: Array) -> _Trial:
        """Return the trial with the errors that a more precise run shows, as far as it reaches."""
        found = _MARGIN * differences(self.kept, judge, times, self.accuracy)
        reached = times[: len(found)] <= judge.reached
        return replace(self, errors=np.where(reached, np.maximum(self.errors, found), self.errors))

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
    def ends_the_search(self) -> bool:
        """Whether a longer precision would take too long."""
        judge = self.judge
        work = judge.steps + _STEPS_OF_A_JUMP * len(judge.arcs)
        too_much = work > _MOST_WORK and self.kept.reached >= judge.reached
        return bool(self.kept.exhausted or judge.exhausted or too_much)


def _configurations(accuracy: float) -> Iterator[Configuration]:
    """Yield the precisions and orders to try, the cheapest sufficient one first."""
    wanted = -math.log(accuracy / _GROWTH) / 2 - 1
    order = max(_LOWEST_ORDER, 2 * math.ceil((wanted - 1) / 2) + 3)
    if order <= 19:
        yield Configuration("double", order, "long double", min(order + 4, 23))
    if order <= _BEST_ORDER:
        yield Configuration("double", _BEST_ORDER, "long double", 23)
    yield Configuration("long double", 23, "quadruple", 31)
    # The run that measured the last one measures this one as well, if its error allows.
    yield Configuration("quadruple", 41, "quadruple", 31)
    yield Configuration("quadruple", 41, "quadruple", 35)


def differences(first: HybridRun, second: HybridRun, times: Array, accuracy: float) -> Array:
    """Return the largest difference of two runs up to each time (rad, rad/s), shape (n,).

    They are compared at the times, at several times within every step, and after each event.
    Between the two instants of the same impact speeds are not compared; the difference of the
    instants is used instead. A choice that `second` leaves undecided adds the difference that it
    could cause.
    """
    end = min(first.reached, second.reached)
    moments = _moments(first, second, times, end)
    ours, theirs = (np.concatenate(run.polynomials.at(moments)) for run in (first, second))
    if ours.dtype != theirs.dtype:
        ours = PRECISIONS[second.precision].lengthened(ours)
    found = np.abs(ours - theirs).max(axis=0).astype(float)
    # From a place in time on the difference is at least this.
    least = np.zeros(len(moments) + 1)
    starts, stops = _impacts_apart(first, second, accuracy)
    begins, afters = np.searchsorted(moments, starts), np.searchsorted(moments, stops, "right")
    apart = stops - starts
    for begin, after, size in zip(begins.tolist(), afters.tolist(), apart.tolist(), strict=True):
        found[begin:after] = np.minimum(found[begin:after], size)
    np.maximum.at(least, afters, apart)
    lever = max(1.0, 1 / float(first.scene.chain.L1), 1 / float(first.scene.chain.L2))
    for doubt in second.doubts:
        since = np.searchsorted(moments, doubt.time)
        least[since] = max(least[since], 2 * doubt.speed * lever)
    so_far = np.maximum.accumulate(np.maximum(found, least[:-1]))
    asked = times[times <= first.reached]
    place = np.searchsorted(moments, asked, side="right") - 1
    # The error is unknown beyond the end of the measuring run.
    return np.where(asked <= end, so_far[np.maximum(place, 0)], np.inf)


def _moments(first: HybridRun, second: HybridRun, times: Array, end: float) -> Array:
    """Return the times (s) at which runs are compared.

    An event has two instants, one in each run. Forces may jump there, so that the error is largest
    after the later one, and just before an impact that only the second run has. The instants of
    bounces that the first run omits are left out.
    """
    events = np.array([float(arc.start.t) for run in (first, second) for arc in run.arcs])
    after = events + 2 * _SLACK * np.spacing(events)
    others = np.concatenate([after, *_inside(second)])
    # Bounces that are omitted have a speed only until they would have ended.
    others = others[~_within(first, others)]
    every = merged(times, *_inside(first), others)
    return np.asarray(every[every <= end])


def _within(run: HybridRun, times: Array) -> Any:
    """Return which times (s) lie between the start of an arc and the beginning of its mode."""
    starts = np.array([-math.inf, *(float(arc.start.t) for arc in run.arcs)])
    rests = np.maximum.accumulate(np.array([-math.inf, *run.since]))
    return times <= rests[np.searchsorted(starts, times, side="right") - 1]


def _inside(run: HybridRun) -> list[Array]:
    """Return places (s) inside the steps of a run."""
    starts = run.polynomials.starts.astype(float)
    widths = np.diff(starts)
    places = _PLACES if len(starts) < _MANY_STEPS else (0.5,)
    return [starts[:-1] + place * widths for place in places]


def impacts_beside(
    first: HybridRun, second: HybridRun, accuracy: float
) -> tuple[Array, Array, Array]:
    """Return the impacts of a run, and bounds on the errors of their speeds by another run.

    These are the times (s), shape (k,), u before and after (rad/s), shape (k, 2, 2), and bounds
    (rad/s), shape (k,). Unlike `differences`, speeds are compared at the own instant of either
    impact. The bound is zero where `second` does not have an impact: `differences` shows that.
    """
    own, other = _Struck.of(first), _Struck.of(second)
    apart = np.zeros(len(own.times))
    for contact in np.unique(own.contacts):
        ours, theirs = (np.flatnonzero(run.contacts == contact) for run in (own, other))
        if not len(theirs):
            continue
        if len(ours) != len(theirs):
            theirs = theirs[_nearest(own.times[ours], other.times[theirs])]
        off = np.abs(own.speeds[ours] - other.speeds[theirs]).max(axis=2)
        # The last bounce that a run resolves is not that of another run.
        off[own.last[ours] | other.last[theirs], 1] = 0.0
        same = np.abs(own.times[ours] - other.times[theirs]) <= _SAME_IMPACT * accuracy
        apart[ours] = np.where(same, off.max(axis=1), 0.0)
    return own.times, own.speeds, _MARGIN_OF_EQUALS * apart


class _Struck(NamedTuple):
    """The impacts of a run: times (s), numbers of contacts, shape (k,), and u, (k, 2, 2).

    `last` are those of bounces that die away.
    """

    times: Array
    contacts: Any
    speeds: Array
    last: Any

    @classmethod
    def of(cls, run: HybridRun) -> _Struck:
        """Return the impacts of a run."""
        strikes = run.strikes
        last = [strike.impulse.regime is Regime.BOUNCES_DIE_AWAY for strike in strikes]
        return cls(
            np.array([strike.time for strike in strikes], dtype=float),
            np.array([strike.number for strike in strikes], dtype=int),
            np.array([strike.u for strike in strikes], dtype=float).reshape(-1, 2, 2),
            np.array(last, dtype=bool),
        )


def _nearest(ours: Array, theirs: Array) -> Any:
    """Return the places of the nearest of other times, which rise, to each of some times (s)."""
    after = np.clip(np.searchsorted(theirs, ours), 0, len(theirs) - 1)
    before = np.maximum(after - 1, 0)
    nearer = np.abs(theirs[after] - ours) < np.abs(theirs[before] - ours)
    return np.where(nearer, after, before)


def _impacts_apart(first: HybridRun, second: HybridRun, accuracy: float) -> tuple[Array, Array]:
    """Return the earlier and the later instant (s) of each impact that both runs have."""
    found = [np.zeros((2, 0))]
    own, other = _times_of_impacts(first), _times_of_impacts(second)
    for number in own.keys() & other.keys():
        ours, theirs = np.array(own[number]), np.array(other[number])
        both = np.array([ours, theirs[_nearest(ours, theirs)]])
        found.append(both[:, np.abs(both[0] - both[1]) <= _SAME_IMPACT * accuracy])
    instants = np.concatenate(found, axis=1)
    earlier, later = instants.min(axis=0), instants.max(axis=0)
    slack = _SLACK * np.spacing(np.maximum(later, 1e-300))
    return earlier - slack, later + slack


def _times_of_impacts(run: HybridRun) -> dict[int, list[float]]:
    """Return the times (s) of the impacts on each contact, by its number."""
    found: dict[int, list[float]] = {}
    for strike in run.strikes:
        found.setdefault(strike.number, []).append(strike.time)
    return found
