"""Simulation of a scene, with a measured global error.

Accuracy is the largest error of q (rad) and u (rad/s) over the whole run, not a tolerance for a
step. It is measured by two runs: at an order of the Taylor series whose truncation error is well
above round-off, and at a higher one. Their difference is the error of the coarser run and bounds
that of the finer one, which is returned. If round-off is significant, a run in longer precision
measures the error; if double precision is insufficient, the longer precision gives the result.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from twolink.errors import SimulationError
from twolink.formulations import EquationsName
from twolink.inputs import check_instance
from twolink.integration.method import Method
from twolink.integration.methods import (
    METHODS,
    NUMERIC_METHODS,
    MethodName,
    NumericName,
)
from twolink.integration.precisions import PRECISIONS, PrecisionName
from twolink.limits import DEFAULT_LIMITS, Limits
from twolink.scene import Scene
from twolink.simulation.motion import has_events, has_modes, motion_run
from twolink.simulation.options import RunOptions
from twolink.simulation.run import Array, MotionRun, Recipe, Statistics
from twolink.simulation.smooth.numeric import NumericRun, numeric_run
from twolink.simulation.smooth.taylor import default_longest_step, heyoka_is_here
from twolink.simulation.trajectory import Trajectory

_LOWEST_ORDER = 7

# Number of places between two samples at which smooth runs are compared.
_CHECKED = 8

# Safety factor on a difference, as the measuring run has an error as well: a small one in a longer
# precision, equal round-off in the same one.
_MARGIN = 1.1
_MARGIN_OF_LIKE_PRECISIONS = 3.0

# Largest assumed growth of the truncation error of a step over a run, before a retry.
_GROWTH = 1e3

# The method that takes the place of Taylor series where heyoka is not installed.
_STAND_IN: NumericName = "DOP853"


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

    `RunOptions` describes the options. A run that would exceed its limits of time or memory raises
    `TooMuchError`. Raises `SimulationError`, in one sentence, if
    the scene cannot be simulated as requested, and `ParameterError` for invalid arguments.
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
    )
    if method in NUMERIC_METHODS:
        return _by_refining(asked, method)
    if heyoka_is_here():
        return _by_taylor(asked)
    note = f"heyoka is not installed here, so SciPy's {_STAND_IN} took the place of Taylor series."
    found = _by_refining(asked, _STAND_IN)
    return replace(found, notes=(note, *found.notes))


@dataclass(frozen=True)
class _Asked:
    """The request: a scene, options, and the accuracy (rad, rad/s) and times (s) that follow."""

    scene: Scene
    options: RunOptions
    accuracy: float
    times: Array

    @property
    def checked(self) -> Array:
        """The times (s) at which smooth runs are compared: the samples, and some between them."""
        count = _CHECKED * (len(self.times) - 1) + 1
        return np.union1d(self.times, np.linspace(0.0, self.scene.duration, count))

    def report(self, name: str) -> Callable[[float], None]:
        """Return a function that takes the completed share of a run and enforces limits."""
        progress = self.options.progress
        named = None if progress is None else lambda share: progress(name, share)
        return self.options.limits.timed(f"the motion over {self.scene.duration:g} s", named)


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


def _by_taylor(asked: _Asked) -> Trajectory:
    """Increase the order, and then the precision, until the accuracy is met."""
    if has_events(asked.scene):
        return _through_events(asked)
    runs: list[MotionRun] = []
    checked = asked.checked
    cap = default_longest_step(asked.scene)

    def run(precision: PrecisionName, order: int) -> MotionRun:
        runs.append(
            motion_run(
                asked.scene,
                checked,
                formulation=asked.options.formulation,
                precision=precision,
                order=order,
                longest_step=cap,
                progress=asked.report(f"order {order}, {precision}"),
            )
        )
        return runs[-1]

    def ended(kept: MotionRun, errors: Array) -> Trajectory:
        place = np.searchsorted(checked, asked.times)
        at_samples = replace(kept, q=kept.q[:, place], u=kept.u[:, place])
        return _trajectory(asked, at_samples, errors[place], runs)

    kept, errors, growth = _by_orders(asked, run)
    if kept is not None and errors.max() <= asked.accuracy:
        return ended(kept, errors)
    if kept is None or kept.order < PRECISIONS["double"].full_order:
        kept = run("double", PRECISIONS["double"].full_order)
    for longer in tuple(PRECISIONS)[1:]:
        full = PRECISIONS[longer].full_order
        judge = run(longer, _judging_order(asked, growth, kept.precision, full))
        errors = _difference(kept, judge, asked)
        if errors.max() <= asked.accuracy:
            return ended(kept, errors)
        kept = judge if judge.order == full else run(longer, full)
        truncated = PRECISIONS[longer].truncated_order
        errors = _difference(run(longer, truncated), kept, asked)
        if errors.max() <= asked.accuracy:
            return ended(kept, errors)
        growth = float(errors.max()) / _truncation(truncated)
    return ended(kept, errors)


def _through_events(asked: _Asked) -> Trajectory:
    """Return the trajectory of a scene with events, as far as it can be integrated."""
    from twolink.simulation.hybrid.measure import measured_run

    found = measured_run(
        asked.scene,
        asked.times,
        asked.accuracy,
        asked.options.formulation,
        asked.report,
        asked.options.limits,
    )
    kept = found.kept
    made = _trajectory(asked, kept, found.errors, list(found.runs))
    if not kept.failure:
        return made
    note = f"{kept.failure[0].upper()}{kept.failure[1:]}; the trajectory ends there."
    return replace(made, failure=kept.failure, notes=(*made.notes, note))


def _by_orders(
    asked: _Asked, run: Callable[[PrecisionName, int], MotionRun]
) -> tuple[MotionRun | None, Array, float]:
    """Return the best run in double precision, if any, and bounds on its errors.

    The third value is the growth of the truncation error of a step over the run, infinity if
    unknown.
    """
    errors: Array = np.full_like(asked.checked, np.inf)
    growth = np.inf
    order = _order_for(asked.accuracy / _GROWTH)
    highest = PRECISIONS["double"].truncated_order
    fine: MotionRun | None = None
    while order <= highest:
        coarse = fine if fine is not None and fine.order == order else run("double", order)
        fine = run("double", order + 2)
        errors = _difference(coarse, fine, asked)
        worst = float(errors.max())
        if worst < np.inf:
            growth = worst / _truncation(order)
        if worst <= asked.accuracy or order == highest:
            break
        wanted = _order_for(asked.accuracy / growth) if growth < np.inf else order + 2
        order = max(order + 2, min(wanted, highest))
    return fine, errors, growth


def _judging_order(asked: _Asked, growth: float, precision: PrecisionName, full: int) -> int:
    """Return the order at which a run in longer precision measures one in this precision.

    It is the full order, unless the run is sufficient and a lower order has a far smaller error:
    errors align with the divergence of the motion, so two errors of similar size may cancel in the
    difference.
    """
    # The error of a step is about a quarter of the round-off of a sum.
    will_do = growth * PRECISIONS[precision].rounding / 4 < asked.accuracy
    return min(full, _order_for(asked.accuracy / 100 / growth)) if will_do else full


def _truncation(order: int) -> float:
    return math.exp(-2 * (order + 1))


def _order_for(truncation: float) -> int:
    """Return the lowest order with exp(−2 (p + 1)) below a truncation."""
    return max(_LOWEST_ORDER, _odd(-math.log(truncation) / 2 - 1))


def _odd(order: float) -> int:
    """Return the next odd number."""
    return 2 * math.ceil((order - 1) / 2) + 1


def _difference(
    first: MotionRun | NumericRun, second: MotionRun | NumericRun, asked: _Asked
) -> Array:
    """Return the largest difference so far of any angle or speed (rad, rad/s), shape (n,)."""
    earlier, later = np.concatenate([first.q, first.u]), np.concatenate([second.q, second.u])
    if earlier.dtype != later.dtype:
        # NumPy does not convert between long double and heyoka's quadruple numbers.
        earlier = np.vectorize(type(later.flat[0]), otypes=[later.dtype])(earlier)
    errors = np.abs(later - earlier).max(axis=0).astype(float)
    margin = _MARGIN_OF_LIKE_PRECISIONS if first.precision == second.precision else _MARGIN
    return np.asarray(np.maximum.accumulate(margin * errors))


def _by_refining(asked: _Asked, name: NumericName) -> Trajectory:
    """Refine the tolerance, or the step, until the change of the result is within the accuracy."""
    method, duration = NUMERIC_METHODS[name], asked.scene.duration
    fineness = method.coarsest(asked.accuracy, duration, duration / (len(asked.times) - 1))
    runs = [_numeric(asked, name, fineness)]
    errors = np.full_like(asked.times, np.inf)
    while fineness * method.refinement >= method.finest(duration):
        fineness *= method.refinement
        runs.append(_numeric(asked, name, fineness))
        # The finer run is returned; the change is an estimate of the error of the coarser one.
        errors = _difference(runs[-2], runs[-1], asked)
        if errors.max() <= asked.accuracy:
            break
    kept = runs[-1]
    statistics = Statistics(
        steps=kept.steps,
        evaluations=sum(run.evaluations for run in runs),
        runs=len(runs),
        compile_seconds=0.0,
        run_seconds=sum(run.run_seconds for run in runs),
    )
    return _made(asked, kept.q, kept.u, errors, name, "double", statistics)


def _numeric(asked: _Asked, method: NumericName, fineness: float) -> NumericRun:
    return numeric_run(
        asked.scene,
        asked.times,
        method=method,
        formulation=asked.options.formulation,
        fineness=fineness,
        progress=asked.report(f"{method} at {fineness:.3g}"),
    )


def _trajectory(
    asked: _Asked,
    kept: MotionRun,
    errors: Array,
    runs: list[MotionRun],
) -> Trajectory:
    statistics = Statistics(
        steps=kept.steps,
        evaluations=sum(run.steps * run.order * run.operations for run in runs),
        runs=len(runs),
        compile_seconds=sum(run.compile_seconds for run in runs),
        run_seconds=sum(run.run_seconds for run in runs),
    )
    made = _made(
        asked, kept.q, kept.u, errors, "taylor", kept.precision, statistics, dense=kept.dense
    )
    return replace(
        made,
        events=kept.events,
        impacts=kept.log,
        formulation=kept.formulation,
        notes=(*made.notes, *kept.notes),
        recipe=Recipe(kept.order, float(kept.longest_step)),
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
) -> Trajectory:
    q, u = np.array(q, dtype=float), np.array(u, dtype=float)
    # The result is rounded to float64 from any precision.
    errors = errors + np.spacing(max(np.abs(q).max(), np.abs(u).max())) / 2
    times = asked.times[: q.shape[1]]
    met = errors <= asked.accuracy
    holds_until = float(times[-1] if met.all() else times[max(int(met.argmin()) - 1, 0)])
    notes = list(asked.scene.notes)
    if not met.all():
        rest = f"at {times[-1]:.6g} s the error is {errors[-1]:.1e}"
        if not np.isfinite(errors[-1]):
            rest = "the error after that is unknown, as the run that measures it ends early"
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
