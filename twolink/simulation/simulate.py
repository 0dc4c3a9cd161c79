"""Simulation of a scene, with a measured global error.

Accuracy is the largest error of any angle (rad) and speed (rad/s) over the whole run, not a
tolerance for a step: of q and u, and of those of the joints where a chain has a convention for
them. It is measured by runs side by side with other steps, and near round-off by the defect of the
run's own steps (`smooth.measure`); with events, by an independent run (`hybrid.measure`). If double
precision is insufficient, a longer precision gives the result.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from twolink.effects import is_built_in
from twolink.errors import IntegrationError, SimulationError
from twolink.inputs import check_instance
from twolink.integration.method import Method
from twolink.integration.methods import (
    METHODS,
    NUMERIC_METHODS,
    MethodName,
    NumericName,
)
from twolink.integration.precisions import PrecisionName
from twolink.limits import DEFAULT_LIMITS, Budget, Limits
from twolink.names import EquationsName
from twolink.scene import Scene
from twolink.simulation.motion import has_events, has_modes
from twolink.simulation.options import RunOptions
from twolink.simulation.run import ENDS_EARLY, Array, MotionRun, Statistics
from twolink.simulation.smooth.integrators import heyoka_is_here
from twolink.simulation.smooth.judging import MARGIN_OF_LIKE_PRECISIONS, difference
from twolink.simulation.smooth.longest_step import intervals_to_check, pace_of
from twolink.simulation.smooth.measure import measured_run
from twolink.simulation.smooth.round_off import rounding
from twolink.simulation.trajectory import Trajectory
from twolink.times import merged

if TYPE_CHECKING:
    from twolink.simulation.smooth.numeric import NumericRun

# The least number of times at which smooth runs are looked at, in all and between two samples.
_CHECKED_IN_ALL, _CHECKED = 256, 2

# The method that takes the place of Taylor series where heyoka is not installed.
_STAND_IN: NumericName = "DOP853"

# The methods that suit stiff motions.
_FOR_STIFF: tuple[NumericName, NumericName] = ("Radau", "LSODA")

_ESTIMATED = (
    "The error is an estimate: the difference of two runs of one method, which may share it, as no "
    "Taylor series measures it."
)

# The most steps of Taylor series that measure another method.
_MOST_STEPS = 1e6

# The part of the accuracy for the error of the Taylor series that measure another method, and the
# least error that is asked of them.
_OF_REFERENCE, _FINEST_REFERENCE = 0.1, 1e-13


def simulate(
    scene: Scene,
    *,
    accuracy: float | None = None,
    method: MethodName | None = None,
    formulation: EquationsName = "momenta",
    samples: int = 501,
    progress: Callable[[str, float], None] | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> Trajectory:
    """Return the trajectory of a scene at evenly spaced samples, with its measured global error.

    `RunOptions` describes the options. Runs that would exceed the limits of time or memory raise
    `TooMuchError`. Raises `SimulationError`, in one sentence, if the scene cannot be simulated as
    requested, and `ParameterError` for invalid arguments.
    """
    return simulate_with(
        scene,
        RunOptions(
            accuracy=accuracy,
            method=method,
            formulation=formulation,
            samples=samples,
            progress=progress,
            limits=limits,
        ),
    )


def simulate_with(scene: Scene, options: RunOptions) -> Trajectory:
    """Return the trajectory of a scene, as `simulate` does, with the options as one value."""
    check_instance("scene", scene, Scene)
    if scene.may_change:
        # The trajectory is that of the effects as they are now.
        scene = replace(scene)
    method = scene.method if options.method is None else options.method
    _check(scene, METHODS[method], options)
    asked = _Asked(
        scene,
        options,
        accuracy=scene.accuracy if options.accuracy is None else options.accuracy,
        times=np.linspace(0.0, scene.duration, options.samples),
        budget=Budget(options.limits, f"the motion over {scene.duration:g} s"),
    )
    if method in NUMERIC_METHODS:
        return _by_refining(asked, method)
    if heyoka_is_here():
        return _by_taylor(asked)
    return _by_stand_in(asked)


@dataclass(frozen=True)
class _Asked:
    """The request: a scene, options, and the accuracy (rad, rad/s) and times (s) that follow.

    All runs have one `budget`.
    """

    scene: Scene
    options: RunOptions
    accuracy: float
    times: Array
    budget: Budget

    @property
    def share(self) -> float:
        """The factor from the error of q and u to that of all angles and speeds.

        An angle of the joint between two links is a difference, with up to twice the error.
        """
        return 1.0 if self.scene.joints is None else 2.0

    def checked(self, longest_step: float) -> Array:
        """Return the times (s) at which smooth runs are looked at, beside the ends of their steps.

        They are the samples, and, for effects that are not built in, some between: their loads may
        change unseen. `longest_step` (s) is the time in which the motion changes.
        """
        if all(map(is_built_in, self.scene.effects)):
            return self.times
        between = _CHECKED * (len(self.times) - 1)
        changes = intervals_to_check(self.scene.duration, longest_step)
        count = max(_CHECKED_IN_ALL, between, changes)
        return merged(self.times, np.linspace(0.0, self.scene.duration, count + 1))

    def report(self, name: str) -> Callable[[float], None]:
        """Return a function that takes the completed share of a run and enforces limits."""
        progress = self.options.progress
        named = None if progress is None else lambda share: progress(name, share)
        return self.budget.timed(named)


def _check(scene: Scene, method: Method, options: RunOptions) -> None:
    """Raise `SimulationError` if a method cannot simulate a scene, or the samples are too many."""
    if has_modes(scene) and not method.locates_events:
        able = " or ".join(name for name, each in METHODS.items() if each.locates_events)
        raise SimulationError(
            f"method must be {able}, which locates events, for a scene with dry friction or "
            f"contact; got '{options.method or scene.method}'"
        )
    samples = options.samples
    options.limits.check_memory(f"{samples} samples", samples * method.bytes_of_a_sample)


def _by_stand_in(asked: _Asked) -> Trajectory:
    """Return the trajectory of a smooth scene without heyoka, by another method."""
    if has_modes(asked.scene) and not METHODS[_STAND_IN].locates_events:
        raise SimulationError(
            "heyoka is not installed, which a scene with dry friction or contact needs; install "
            "version 7.10 or later (pip install heyoka)"
        )
    note = f"heyoka is not installed here, so SciPy's {_STAND_IN} took the place of Taylor series."
    found = _by_refining(asked, _STAND_IN)
    return replace(found, notes=(note, *found.notes))


def _by_taylor(asked: _Asked) -> Trajectory:
    """Return the trajectory of a scene by the cheapest run that meets the accuracy."""
    if has_events(asked.scene):
        return _through_events(asked)
    begun = perf_counter()
    pace = pace_of(asked.scene)
    checked = asked.checked(pace.longest_step)
    found = measured_run(
        asked.scene,
        checked,
        asked.accuracy / asked.share,
        asked.options.formulation,
        asked.report,
        correct=True,
        pace=pace,
    )
    place = np.searchsorted(checked, asked.times)
    kept = replace(found.kept, q=found.kept.q[:, place], u=found.kept.u[:, place])
    errors = asked.share * found.errors[place]
    spent = _Spent(found.compile_seconds, perf_counter() - begun - found.compile_seconds)
    return _trajectory(asked, kept, errors, found.runs, spent, found.why_unknown)


def _through_events(asked: _Asked) -> Trajectory:
    """Return the trajectory of a scene with events, as far as it can be integrated."""
    from twolink.simulation.hybrid.measure import STOPS_SHORT
    from twolink.simulation.hybrid.measure import measured_run as through_events

    found = through_events(
        asked.scene,
        asked.times,
        asked.accuracy / asked.share,
        asked.options.formulation,
        asked.report,
        asked.options.limits,
    )
    kept = found.kept
    errors = asked.share * (found.errors + rounding(kept))
    # The runs may go on at the same time.
    spent = _Spent(
        sum(run.compile_seconds for run in found.runs),
        sum(run.run_seconds for run in found.runs) + found.measuring_seconds,
    )
    made = _trajectory(asked, kept, errors, found.runs, spent, found.why_unknown)
    notes = made.notes
    if found.stops_short(met=made.met):
        notes += (STOPS_SHORT,)
    if kept.failure:
        notes += (f"{kept.failure[0].upper()}{kept.failure[1:]}; the trajectory ends there.",)
    return replace(made, failure=kept.failure, notes=notes)


def _by_refining(asked: _Asked, name: NumericName) -> Trajectory:
    """Refine the tolerance, or the step, until the error of the result is within the accuracy.

    It is the distance from Taylor series, whose error is added. Where there are none, it is
    estimated by the change of the result, which two runs of one method may not show. A run that
    fails is refined like one of a large error. Raises `IntegrationError` if all fail.
    """
    method, duration = NUMERIC_METHODS[name], asked.scene.duration
    runs: list[NumericRun] = []
    errors: list[Array] = []
    reference, failure = None, None
    for setting in method.settings(asked.accuracy, duration, duration / (len(asked.times) - 1)):
        try:
            runs.append(_numeric(asked, name, setting))
        except IntegrationError as error:
            failure = error
            continue
        if len(runs) == 1:
            reference = _reference(asked, runs[0])
        errors.append(_errors(asked, runs, reference))
        if errors[-1].max() <= asked.accuracy:
            break
    if not runs:
        unit = " s" if method.parameter == "step" else ""
        other = next(each for each in _FOR_STIFF if each != name)
        raise IntegrationError(
            f"{name} fails with every {method.parameter} down to {setting:.3g}{unit} ({failure}):"
            f" the motion must stay finite, and a stiff one needs a method such as {other}"
        ) from failure
    best = min(range(len(runs)), key=lambda k: float(errors[k].max()))
    kept, others = runs[best], () if reference is None else (reference.statistics,)
    statistics = Statistics(
        steps=kept.steps,
        evaluations=sum(run.evaluations for run in runs),
        runs=len(runs) + sum(other.runs for other in others),
        compile_seconds=sum(other.compile_seconds for other in others),
        run_seconds=sum(run.run_seconds for run in (*runs, *others)),
    )
    made = _made(asked, kept.q, kept.u, errors[best], name, "double", statistics)
    return made if others else replace(made, notes=(*made.notes, _ESTIMATED))


def _reference(asked: _Asked, run: NumericRun) -> Trajectory | None:
    """Return the trajectory by Taylor series that measures those of other methods, if there is.

    There is none for motions that are too stiff for Taylor series, as a run shows, and for effects
    that cannot be written as heyoka's expressions.
    """
    if not heyoka_is_here():
        return None
    from twolink.simulation.smooth.stiffness import steps_of_series

    accuracy = max(_OF_REFERENCE * asked.accuracy, _FINEST_REFERENCE)
    try:
        if steps_of_series(asked.scene, asked.times, run) > _MOST_STEPS:
            return None
        return _by_taylor(replace(asked, accuracy=accuracy))
    except (SimulationError, TypeError, ValueError, AttributeError):
        return None


def _errors(asked: _Asked, runs: Sequence[NumericRun], reference: Trajectory | None) -> Array:
    """Return the error of the last run (rad, rad/s) up to each sample."""
    last = runs[-1]
    if reference is not None:
        apart = difference(last, reference) + reference.error
        return np.asarray(asked.share * apart + rounding(last))
    if len(runs) == 1:
        return np.full_like(asked.times, np.inf)
    # The finer run is returned; the change is an estimate of the error of the coarser one.
    apart = MARGIN_OF_LIKE_PRECISIONS * difference(runs[-2], last)
    return np.asarray(asked.share * apart + rounding(last))


def _numeric(asked: _Asked, method: NumericName, setting: float) -> NumericRun:
    from twolink.simulation.smooth.numeric import numeric_run

    return numeric_run(
        asked.scene,
        asked.times,
        method=method,
        formulation=asked.options.formulation,
        setting=setting,
        progress=asked.report(f"{method} at {setting:.3g}"),
    )


class _Spent(NamedTuple):
    """The time (s) of compilation, and that of all runs and the measurement of their errors."""

    compiling: float
    running: float


def _trajectory(
    asked: _Asked,
    kept: MotionRun,
    errors: Array,
    runs: Sequence[MotionRun],
    spent: _Spent,
    why_unknown: str = ENDS_EARLY,
) -> Trajectory:
    statistics = Statistics(
        steps=kept.steps,
        evaluations=sum(run.evaluations for run in runs),
        runs=len(runs),
        compile_seconds=spent.compiling,
        run_seconds=spent.running,
    )
    made = _made(
        asked, kept.q, kept.u, errors, "taylor", kept.precision, statistics, dense=kept.dense,
        why_unknown=why_unknown,
    )  # fmt: skip
    return replace(
        made,
        events=kept.events,
        impacts=kept.log,
        formulation=kept.formulation,
        notes=(*made.notes, *kept.notes),
        recipe=kept.recipe,
        _knots=kept.step_times,
    )


def _made(
    asked: _Asked,
    q: Any,
    u: Any,
    errors: Array,
    method: MethodName,
    precision: PrecisionName,
    statistics: Statistics,
    dense: Callable[[], Any] | None = None,
    why_unknown: str = ENDS_EARLY,
) -> Trajectory:
    q, u = np.array(q, dtype=float), np.array(u, dtype=float)
    times = asked.times[: q.shape[1]]
    met = errors <= asked.accuracy
    holds_until = float(times[-1] if met.all() else times[max(int(met.argmin()) - 1, 0)])
    notes = list(asked.scene.notes)
    if not met.all():
        rest = f"at {times[-1]:.6g} s the error is {errors[-1]:.1e}"
        if not np.isfinite(errors[-1]):
            rest = f"the error after that is unknown, as {why_unknown}"
        notes.append(f"The accuracy {asked.accuracy:.1e} holds until {holds_until:.6g} s; {rest}.")
    return Trajectory(
        scene=asked.scene,
        t=times,
        q=q,
        u=u,
        accuracy=asked.accuracy,
        error=float(errors.max()),
        holds_until=holds_until,
        method=method,
        formulation=asked.options.formulation,
        precision=precision,
        statistics=statistics,
        notes=tuple(notes),
        _dense=dense,
    )
