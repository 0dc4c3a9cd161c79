"""Work-precision measurements: error and cost of each configuration at each setting."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable
from dataclasses import dataclass, field
from time import perf_counter
from typing import Any

import numpy as np

from twolink.accuracy.across_events import EventErrors, event_errors
from twolink.accuracy.method_configurations import MethodConfiguration
from twolink.accuracy.peak import peak_of_a_core
from twolink.accuracy.reference_trajectory import (
    ReferenceTrajectory,
    comparison_times,
    largest_difference,
    reference_trajectory,
)
from twolink.environment import Load, load_of_machine
from twolink.errors import TooMuchError
from twolink.integration.operations import Extent, Operations
from twolink.limits import DEFAULT_LIMITS, Limits, in_time
from twolink.scene import Scene
from twolink.simulation.motion import has_modes

# Number of timings of every point, if the budget allows.
_ROUNDS = 5

# The share of the budget for the sweeps; the rest is for repeated timing.
_SWEEPING = 0.6

# Largest ratio of slowest to fastest repeat for a reliable time.
UNREPEATABLE = 2.0

# The sweep ends after this number of finer settings without improvement (round-off); errors of a
# large part of a radian do not count, since they only show that a setting is too coarse.
_NO_BETTER = 2
RESOLVED = 0.1


@dataclass(frozen=True)
class Point:
    """Error and cost of one configuration at one setting.

    `error` is the global error (rad, rad/s), `seconds` the median of the repeated runs and
    `spread` the ratio of slowest to fastest, both without `compile_seconds`. `events` has the
    errors of events, if there are any. If the run failed, `failed` is the reason, and error and
    time are NaN. `arithmetic` is the number of floating-point operations of the run, `extent` says
    whether it is exact; None if there is neither a count nor an estimate.
    """

    engine: str
    configuration: str
    method: str
    equations: str
    precision: str
    order: int | None
    parameter: str
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
    arithmetic: float | None = None
    extent: Extent = Extent.COUNTED

    @property
    def repeatable(self) -> bool:
        """Whether the time is reproducible."""
        return self.repeats > 1 and self.spread < UNREPEATABLE


@dataclass(frozen=True)
class Stop:
    """The end of a configuration's sweep by its budget, after a setting of its parameter."""

    configuration: str
    parameter: str
    setting: float


@dataclass(frozen=True)
class WorkPrecision:
    """All points of a scene, and the reference of their errors.

    `left_out` are sentences on configurations that were not measured, and `stopped` those whose
    finer settings were not tried. `load` is the load of the machine at the start, and `peak` the
    operations a second of one core, by which those of other engines are estimated.
    """

    scene: Scene
    points: tuple[Point, ...]
    reference: ReferenceTrajectory
    judged_at: str
    left_out: tuple[str, ...] = ()
    stopped: tuple[Stop, ...] = ()
    load: Load | None = None
    peak: float | None = None

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on the motion, and on configurations that were not measured to the finest."""
        found = (*self.reference.notes, *self.left_out)
        if not self.stopped:
            return found
        stops = (f"{s.configuration} at {s.parameter} {s.setting:.3g}" for s in self.stopped)
        return (*found, f"Stopped by the time budget (--budget): {'; '.join(stops)}.")


@dataclass
class _Measurement:
    """A setting of a configuration during its measurement."""

    configuration: MethodConfiguration
    setting: float
    error: float = math.nan
    compile_seconds: float = 0.0
    spent: float = 0.0
    seconds: list[float] = field(default_factory=list)
    steps: int | None = None
    evaluations: int | None = None
    operations: int | None = None
    arithmetic: Operations | None = None
    events: EventErrors | None = None
    failed: str = ""
    warnings: tuple[str, ...] = ()

    def run(self, times: Any, exact: ReferenceTrajectory) -> None:
        """Run once more; error and cost of the first run, or its failure, are kept.

        Raises `TooMuchError` if the run would exceed the limits of its configuration.
        """
        start = perf_counter()
        try:
            with np.errstate(all="ignore"):
                result = self.configuration.run(self.setting, times)
            error = largest_difference(exact, result.q, result.u)
        except TooMuchError:
            raise
        except Exception as problem:  # any exception of an external engine is a result
            self.failed = f"{type(problem).__name__}: {problem}".splitlines()[0]
            self.spent += perf_counter() - start
            return
        self.spent += perf_counter() - start - result.compile_seconds
        if not math.isfinite(error):
            self.failed = "a state is not finite"
            return
        self.error, self.steps, self.evaluations = error, result.steps, result.evaluations
        self.operations, self.warnings = result.operations, result.warnings
        self.arithmetic = result.arithmetic
        if exact.events or exact.impacts:
            self.events = event_errors(exact, result)
        self.compile_seconds = max(self.compile_seconds, result.compile_seconds)
        self.seconds.append(result.seconds)

    def point(self, peak: float | None) -> Point:
        """Return the point; operations that were not counted are estimated by the peak rate."""
        configuration, taken = self.configuration, self.seconds
        fine = not self.failed
        seconds, arithmetic = statistics.median(taken) if fine else math.nan, self.arithmetic
        if fine and arithmetic is None and peak is not None:
            arithmetic = Operations(seconds * peak, Extent.AT_MOST)
        return Point(
            engine=configuration.engine,
            configuration=configuration.name,
            method=configuration.method,
            equations=configuration.equations,
            precision=configuration.precision,
            order=configuration.order,
            parameter=configuration.parameter,
            setting=self.setting,
            error=self.error if fine else math.nan,
            seconds=seconds,
            spread=max(taken) / min(taken) if fine else math.nan,
            repeats=len(taken),
            compile_seconds=self.compile_seconds,
            steps=self.steps,
            evaluations=self.evaluations,
            operations=self.operations,
            events=self.events,
            failed=self.failed,
            warnings=self.warnings,
            arithmetic=None if arithmetic is None else arithmetic.number,
            extent=Extent.COUNTED if arithmetic is None else arithmetic.extent,
        )


def work_precision(
    scene: Scene,
    configurations: tuple[MethodConfiguration, ...],
    *,
    budget: float = 20.0,
    left_out: tuple[str, ...] = (),
    progress: Callable[[str, float], None] | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> WorkPrecision:
    """Return error and cost of every configuration at its settings, from coarse to fine.

    The sweep of a configuration ends when finer settings are no better, after two failures in a
    row, or when its share of `budget` (s) is spent. Then all points are timed again in turn, so
    that other load affects all alike. `progress` is called with a description and the completed
    fraction. A configuration whose run raises `TooMuchError`, and those that have no time left of
    the `limits`, are left out; the error is raised by the reference run, and if none is left.
    """
    start, load = perf_counter(), load_of_machine()
    times = comparison_times(scene)
    report = progress or (lambda stage, share: None)
    report("the reference", 0.0)
    exact = reference_trajectory(scene, times, limits=limits)
    sweeps = _Sweeps(times, exact, left=_SWEEPING * budget)
    for number, configuration in enumerate(configurations):
        report(configuration.name, _SWEEPING * number / len(configurations))
        if perf_counter() - start > limits.seconds:
            sweeps.too_long.append(f"{configuration.name}: {in_time(limits.seconds)} are over")
            continue
        # Unused time is available to the configurations that follow.
        sweeps.measure(configuration, sweeps.left / (len(configurations) - number))
    if sweeps.too_long and not sweeps.measurements:
        raise TooMuchError(sweeps.too_long[-1])
    _repeat(sweeps.measurements, times, exact, (1 - _SWEEPING) * budget, report)
    counted = all(each.failed or each.arithmetic for each in sweeps.measurements)
    peak = None if counted else peak_of_a_core()
    return WorkPrecision(
        scene=scene,
        points=tuple(measurement.point(peak) for measurement in sweeps.measurements),
        reference=exact,
        judged_at=f"{len(times)} samples" if has_modes(scene) else "the end",
        left_out=(*left_out, *sweeps.too_long),
        stopped=tuple(sweeps.stopped),
        load=load,
        peak=peak,
    )


@dataclass
class _Sweeps:
    """The sweeps of all configurations within `left` (s) of time."""

    times: Any
    exact: ReferenceTrajectory
    left: float
    measurements: list[_Measurement] = field(default_factory=list)
    stopped: list[Stop] = field(default_factory=list)
    too_long: list[str] = field(default_factory=list)

    def measure(self, configuration: MethodConfiguration, seconds: float) -> None:
        """Sweep a configuration in a time (s), or note that it takes too long."""
        measured: list[_Measurement] = []
        try:
            ended_early = _sweep(measured, configuration, self.times, self.exact, seconds)
        except TooMuchError as error:
            self.too_long.append(f"{configuration.name}: {error}")
        else:
            self.stopped += [] if ended_early is None else [ended_early]
        self.left -= sum(measurement.spent for measurement in measured)
        self.measurements += measured


def _sweep(
    measurements: list[_Measurement],
    configuration: MethodConfiguration,
    times: Any,
    exact: ReferenceTrajectory,
    seconds: float,
) -> Stop | None:
    """Append the measured settings, and return where the sweep ended if time ran out."""
    # One-time costs, imports and models, are not charged to the first setting.
    _Measurement(configuration, configuration.sweep[0]).run(times, exact)
    for setting in configuration.sweep:
        spent = sum(measurement.spent for measurement in measurements)
        if measurements and spent + 2 * measurements[-1].spent > seconds:
            return Stop(configuration.name, configuration.parameter, measurements[-1].setting)
        measurement = _Measurement(configuration, setting)
        # The first run is a warm-up of caches and of code compiled for this setting.
        measurement.run(times, exact)
        if not measurement.failed and measurement.seconds[0] < seconds / 20:
            measurement.seconds.clear()
            measurement.run(times, exact)
        measurements.append(measurement)
        if _at_its_best(measurements):
            break
    return None


def _at_its_best(measurements: list[_Measurement]) -> bool:
    """Return whether finer settings no longer improve the error, or only fail."""
    before, late = measurements[:-_NO_BETTER], measurements[-_NO_BETTER:]
    best = min(
        (measurement.error for measurement in before if not measurement.failed), default=math.inf
    )
    return best < RESOLVED and all(
        measurement.failed or measurement.error >= best for measurement in late
    )


def _repeat(
    measurements: list[_Measurement],
    times: Any,
    exact: ReferenceTrajectory,
    budget: float,
    report: Callable[[str, float], None],
) -> None:
    """Repeat the timing of all points in turn, shortest first, until the budget is spent."""
    start = perf_counter()
    timed = sorted(
        (measurement for measurement in measurements if not measurement.failed),
        key=lambda measurement: measurement.seconds[0],
    )
    for repeat in range(1, _ROUNDS):
        for measurement in timed:
            spent = perf_counter() - start
            if spent + measurement.seconds[0] > budget * repeat / (_ROUNDS - 1):
                break
            done = _SWEEPING + (1 - _SWEEPING) * spent / budget
            report(f"timing again, {repeat} of {_ROUNDS - 1}", done)
            measurement.run(times, exact)
