"""From a scene to a trajectory whose global error was measured.

Accuracy is the largest error of q (rad) and u (rad/s) over the whole run, not a tolerance for a
step. It is found by running again: in the same precision with shorter steps, which changes both
truncation and rounding, and where that comes near to what is allowed, in a longer precision,
which is as good as the truth. When double precision cannot deliver, the longer one does.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twolink.errors import SimulationError
from twolink.scene import METHODS, Scene
from twolink.simulation.equations import EQUATIONS
from twolink.simulation.motion import has_modes, motion_run
from twolink.simulation.numeric import SCIPY, NumericRun, numeric_run
from twolink.simulation.run import MotionRun
from twolink.simulation.taylor import PRECISIONS, heyoka_is_here
from twolink.simulation.trajectory import Array, Statistics, Trajectory

# Two runs of one precision may err alike by chance. Their difference times the first number
# stands for the error, and only where it is that far below what is allowed; else a longer
# precision judges.
_CAUTION = 10.0

# A fixed step is halved until it has become as short as this many to the run.
_MOST_STEPS = 200_000

# The least tolerance that SciPy accepts is near 2.3e-14.
_FINEST_TOLERANCE = 1e-13


def simulate(
    scene: Scene,
    *,
    accuracy: float | None = None,
    method: str | None = None,
    formulation: str = "momenta",
    samples: int = 501,
) -> Trajectory:
    """Return a scene's trajectory at evenly spaced samples, with its measured global error.

    `accuracy` (rad and rad/s) and `method` are the scene's unless given. Raises
    `SimulationError`, in one sentence, for what cannot be simulated as asked.
    """
    accuracy = scene.accuracy if accuracy is None else accuracy
    method = scene.method if method is None else method
    _check(scene, accuracy, method, formulation, samples)
    times = np.linspace(0.0, scene.duration, samples)
    asked = _Asked(scene, accuracy, formulation, times)
    if method == "taylor":
        if heyoka_is_here():
            return _by_taylor(asked)
        stand_in = simulate(
            scene, accuracy=accuracy, method="DOP853", formulation=formulation, samples=samples
        )
        note = "heyoka is not installed here, so SciPy's DOP853 took the place of Taylor series."
        return replace(stand_in, notes=(note, *stand_in.notes))
    if method in SCIPY:
        return _by_refining(asked, method, first=min(1e-3, accuracy), least=_FINEST_TOLERANCE)
    between_samples = scene.duration / (samples - 1)
    first = min(between_samples, scene.duration / 200)
    return _by_refining(asked, method, first=first, least=scene.duration / _MOST_STEPS)


@dataclass(frozen=True)
class _Asked:
    """What is to be simulated, and how well."""

    scene: Scene
    accuracy: float
    formulation: str
    times: Array


def _check(scene: Scene, accuracy: float, method: str, formulation: str, samples: int) -> None:
    if not 0 < accuracy < float("inf"):
        raise SimulationError(f"accuracy is {accuracy!r}; allowed is a positive number")
    if method not in METHODS:
        raise SimulationError(f"method is '{method}'; allowed are {', '.join(METHODS)}")
    if formulation not in EQUATIONS:
        raise SimulationError(f"formulation is '{formulation}'; allowed are {', '.join(EQUATIONS)}")
    if samples < 2:
        raise SimulationError(f"samples is {samples}; allowed is 2 or more")
    if has_modes(scene.effects):
        if method != "taylor":
            raise SimulationError(
                f"method is '{method}' and joints may stick; allowed is taylor, which finds when"
            )
        if formulation == "kane":
            raise SimulationError(
                "formulation is 'kane' and joints may stick; allowed is lagrange, in which the "
                "modes are written"
            )
    for effect in scene.effects:
        if getattr(effect, "may_stick", False):
            raise SimulationError(
                "the end force has friction and D may stop; allowed is friction with sliding = 1 "
                "or -1, for a motion in which D slides one way"
            )


def _by_taylor(asked: _Asked) -> Trajectory:
    """Go up the precisions until one meets what was asked."""
    runs: list[MotionRun] = []

    def run(precision: str, longest_step: float | None = None) -> MotionRun:
        runs.append(
            motion_run(
                asked.scene,
                asked.times,
                formulation=asked.formulation,
                precision=precision,
                longest_step=longest_step,
            )
        )
        return runs[-1]

    errors: NDArray[Any] = np.zeros_like(asked.times)
    kept = run(PRECISIONS[0])
    for longer in (*PRECISIONS[1:], None):
        again = run(kept.precision, 0.6 * asked.scene.duration / kept.steps)
        errors = _CAUTION * _difference(kept, again)
        if errors.max() <= asked.accuracy / _CAUTION or longer is None:
            break
        judge = run(longer)
        errors = _difference(kept, judge)
        if errors.max() <= asked.accuracy:
            break
        kept = judge
    return _trajectory(asked, kept, errors, runs)


def _difference(first: MotionRun | NumericRun, second: MotionRun | NumericRun) -> Array:
    """Return the largest difference so far of any angle or speed (rad, rad/s), shape (n,)."""
    earlier, later = np.concatenate([first.q, first.u]), np.concatenate([second.q, second.u])
    if earlier.dtype != later.dtype:
        # NumPy does not mix long doubles with heyoka's quadruple numbers.
        earlier = np.vectorize(type(later.flat[0]), otypes=[later.dtype])(earlier)
    return np.maximum.accumulate(np.abs(later - earlier).max(axis=0).astype(float))


def _by_refining(asked: _Asked, method: str, *, first: float, least: float) -> Trajectory:
    """Refine the tolerance, or the step, until it changes less than is allowed."""
    factor = 0.1 if method in SCIPY else 0.5
    fineness, runs = first, [_numeric(asked, method, first)]
    errors = np.full_like(asked.times, np.inf)
    while fineness * factor >= least:
        fineness *= factor
        runs.append(_numeric(asked, method, fineness))
        # The finer run is kept, and the change stands for the error of the coarser one.
        errors = _difference(runs[-2], runs[-1])
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
    return _made(asked, kept.q, kept.u, errors, method, "double", statistics)


def _numeric(asked: _Asked, method: str, fineness: float) -> NumericRun:
    return numeric_run(
        asked.scene, asked.times, method=method, formulation=asked.formulation, fineness=fineness
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
    return replace(made, events=kept.events, formulation=kept.formulation)


def _made(
    asked: _Asked,
    q: Any,
    u: Any,
    errors: Array,
    method: str,
    precision: str,
    statistics: Statistics,
    dense: Callable[[], Any] | None = None,
) -> Trajectory:
    q, u = np.array(q, dtype=float), np.array(u, dtype=float)
    # What is kept is rounded to float64, whatever it was computed in.
    errors = errors + np.spacing(max(np.abs(q).max(), np.abs(u).max())) / 2
    met = errors <= asked.accuracy
    holds_until = float(
        asked.times[-1] if met.all() else asked.times[max(int(met.argmin()) - 1, 0)]
    )
    notes: list[str] = []
    if not met.all():
        notes.append(
            f"The accuracy {asked.accuracy:.1e} holds until {holds_until:.6g} s; at "
            f"{asked.times[-1]:.6g} s the error is {errors[-1]:.1e}."
        )
    return Trajectory(
        scene=asked.scene,
        t=asked.times,
        q=q,
        u=u,
        accuracy=asked.accuracy,
        error=float(errors.max()),
        holds_until=holds_until,
        method=method,
        formulation=asked.formulation,
        precision=precision,
        statistics=statistics,
        notes=tuple(notes),
        _dense=dense,
    )
