"""Long-time energy drift of each method.

The energy error of a Runge–Kutta method grows linearly with time; that of a symplectic method stays
bounded; that of a Taylor series accurate to round-off is a random walk, which grows with the square
root of time. All methods run from the same initial states, and the exponents are measured.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

import numpy as np

from twolink import lagrange
from twolink.accuracy.divergence import Divergence, divergence
from twolink.accuracy.error_growth import Array, Binned, ErrorGrowth, binned, fit_growth
from twolink.accuracy.long_runs import LONG_METHODS, LongMethod, many_starts, prepared
from twolink.effects import ConservativeEffect, RotorEffect, potential_energy
from twolink.environment import package_versions, this_machine
from twolink.errors import SimulationError
from twolink.inputs import as_real, as_words
from twolink.integration.precisions import OPTIMISED
from twolink.limits import DEFAULT_LIMITS, Limits
from twolink.scene import Scene
from twolink.simulation.motion import check_run
from twolink.simulation.smooth.equations import MomentumEquations
from twolink.simulation.smooth.taylor import taylor_run
from twolink.text import choice

# Number of decades of time with measured errors; exponents are fitted over the last of them.
# Effects that conserve energy: those with a potential, and those that only add inertia.
CONSERVING = (ConservativeEffect, RotorEffect)

_DECADES, _FITTED_DECADES = 5, 3
_SAMPLES_A_DECADE = 80
_LEAST_SECONDS = 100.0
# The times of steps are numbers of float64.
_MOST_SECONDS = 1e12

# Before this number of radii of convergence, oscillating errors hide the secular ones.
_SETTLED = 100.0

# Implicit stages are solved when one more iteration changes no state by this many roundings.
_FINISHED = 1.0

# Measured exponents belong to the nearest of 0, ½ and 1, if the borders between these are this many
# standard errors away.
_HALF = 0.25
_BORDERS = (_HALF, 1 - _HALF)
_SIGMAS = 2.0

# Spread of the initial angles (rad), large enough that rounding differs from the first step.
_SPREAD, _SEED = 1e-3, 1937

# A step at full order is the radius of convergence over e² (Jorba and Zou, 2005, section 3.2).
_RADIUS_IN_STEPS = math.e**2
_VISITED = 256


@dataclass(frozen=True)
class Drift:
    """The energy error of one method over time.

    `errors` are its root mean square over the initial states, at `times` (s), relative to the
    greatest kinetic energy; both have shape (bins,). `step` is in s, the mean for Taylor series;
    `iterations` is the number of stage iterations per step, and one more would change no state by
    more than `unfinished` roundings. `growth` is the measured power of time, or None. `farthest` is
    the largest angle (rad), `seconds` the time of the run, and `failure` the reason why the result
    is not valid.
    """

    method: LongMethod
    measured: Binned
    growth: ErrorGrowth | None
    step: float
    iterations: int
    unfinished: float
    farthest: float
    seconds: float
    failure: str = ""

    @property
    def times(self) -> Array:
        """The times (s) of the bins."""
        return self.measured.times

    @property
    def errors(self) -> Array:
        """The root mean square of the energy errors, relative to the greatest kinetic energy."""
        return self.measured.rms

    @property
    def decided(self) -> bool:
        """Whether the measured exponent is nearest to one of 0, ½ and 1 beyond its uncertainty.

        The borders, ¼ and ¾, are at least two standard errors away.
        """
        if self.growth is None:
            return False
        margin = min(abs(self.growth.exponent - border) for border in _BORDERS)
        return margin >= _SIGMAS * self.growth.uncertainty

    @property
    def as_expected(self) -> bool:
        """Whether the measured exponent is nearest to the expected one, and this is decided."""
        return (
            self.decided
            and self.growth is not None
            and abs(self.growth.exponent - self.method.expected) < _HALF
        )


@dataclass(frozen=True)
class DriftStudy:
    """The energy errors of several methods on one scene, over `seconds` of its motion.

    `kinetic_energy` (J) is the maximum of the scene's own run, and `radius` (s) the mean radius of
    convergence of the motion's Taylor series; `divergence` states whether the motion is regular.
    """

    scene: Scene
    seconds: float
    kinetic_energy: float
    radius: float
    divergence: Divergence
    drifts: tuple[Drift, ...]

    @property
    def unexpected(self) -> tuple[str, ...]:
        """A sentence for each method whose exponent is not the expected one, or is undecided."""
        return tuple(_sentence(drift) for drift in self.drifts if not drift.as_expected)

    @property
    def farthest(self) -> float:
        """The largest angle (rad) in all runs."""
        return max((drift.farthest for drift in self.drifts), default=0.0)

    def document(self) -> dict[str, Any]:
        """Return the study as JSON-compatible data."""
        return {
            "scene": self.scene.title,
            "duration_s": self.seconds,
            "greatest_kinetic_energy_J": self.kinetic_energy,
            "radius_of_convergence_s": self.radius,
            "divergence_factor": self.divergence.factor,
            "divergence_seconds": self.divergence.seconds,
            "chaotic": self.divergence.chaotic,
            "starts": {"spread_rad": _SPREAD, "seed": _SEED},
            "energy_error": "root mean square over the starts, per greatest kinetic energy",
            "machine": this_machine(),
            "versions": package_versions("heyoka", "numpy", "scipy"),
            "methods": [_as_data(drift) for drift in self.drifts],
            "unexpected": list(self.unexpected),
        }

    def csv(self) -> str:
        """Return the errors as comma-separated values, one line per method and time."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(["method", "family", "order", "step_s", "time_s", "energy_error"])
        for drift in self.drifts:
            method = drift.method
            about = (method.name, method.family, method.order, drift.step)
            for time, error in zip(drift.times, drift.errors, strict=True):
                writer.writerow([*about, float(time), float(error)])
        return text.getvalue()


def _sentence(drift: Drift) -> str:
    name, expected = drift.method.name, drift.method.expected
    if drift.failure:
        return f"{name}: {drift.failure}."
    if drift.growth is None:
        return f"{name}: too few errors for fitting a power of time."
    measured = f"{drift.growth.rounded} ± {drift.growth.uncertainty:.2f} was measured"
    if not drift.decided:
        return (
            f"{name}: a power of {expected:g} is expected; {measured}, which is too uncertain to "
            "tell the powers 0, 0.5 and 1 apart (raise --seconds)."
        )
    return f"{name}: a power of {expected:g} is expected and {measured}."


def _as_data(drift: Drift) -> dict[str, Any]:
    method, found = drift.method, drift.growth
    return {
        "method": method.name,
        "family": method.family,
        "order": method.order,
        "step_s": drift.step,
        "iterations": drift.iterations,
        "largest_angle_rad": drift.farthest,
        "roundings_by_one_more_iteration": drift.unfinished,
        "starts": drift.measured.squares.shape[1],
        "expected_exponent": method.expected,
        "exponent": found and found.exponent,
        "exponent_uncertainty": found and found.uncertainty,
        "fitted_from_s": found and found.start,
        "fitted_to_s": found and found.end,
        "decided": drift.decided,
        "as_expected": drift.as_expected,
        "failure": drift.failure,
        "seconds": drift.seconds,
        "times_s": drift.times.tolist(),
        "energy_errors": drift.errors.tolist(),
    }


def energy_drift(
    scene: Scene,
    *,
    seconds: float = 1e5,
    methods: tuple[str, ...] = (),
    progress: Callable[[str, float], None] | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> DriftStudy:
    """Return the energy errors of the named methods (default: all) over a long time (s).

    Raises `SimulationError` for a scene that does not conserve energy, for a method that is not in
    `LONG_METHODS`, and for too short a time, and `TooMuchError` if all together would exceed the
    `limits`.
    """
    check_run(scene, progress, limits)
    chosen = _chosen(as_words("methods", methods))
    seconds = as_real("seconds", seconds)
    _check(scene, seconds)
    asked = _Asked.of(scene, seconds, limits)
    drifts = []
    for index, method in enumerate(chosen):

        def report(share: float, index: int = index, name: str = method.name) -> None:
            if progress is not None:
                progress(name, (index + share) / len(chosen))

        report(0.0)
        share_of_limits = replace(limits, seconds=limits.seconds / len(chosen))
        named = f"{seconds:g} s by {method.name}"
        if len(chosen) > 1:
            named += f", one of {len(chosen)} methods,"
        timed = share_of_limits.timed(named, report)
        drifts.append(_drift(asked, method, timed))
    found = divergence(scene, asked.radius)
    return DriftStudy(scene, seconds, asked.kinetic_energy, asked.radius, found, tuple(drifts))


@dataclass(frozen=True)
class _Asked:
    """Data shared by all methods: the scene, the duration (s), scales, and visited states."""

    scene: Scene
    seconds: float
    radius: float
    kinetic_energy: float
    visited: Array

    @classmethod
    def of(cls, scene: Scene, seconds: float, limits: Limits) -> _Asked:
        """Return the data of a scene, whose motion is computed once for them."""
        own = taylor_run(
            scene,
            np.linspace(0, scene.duration, _VISITED),
            formulation="momenta",
            code=OPTIMISED,
            progress=limits.timed(f"the motion over {scene.duration:g} s"),
        )
        equations, chain = MomentumEquations(), scene.moving_chain.convert(float)
        visited = np.array([*own.q, *equations.from_speeds(chain, tuple(own.q), tuple(own.u))])
        kinetic = float(np.max(lagrange.kinetic_energy(chain, tuple(own.q), tuple(own.u))))
        if kinetic == 0:
            raise SimulationError("the chain must move; it stays at rest in this scene")
        radius = _RADIUS_IN_STEPS * scene.duration / own.steps
        return cls(scene, seconds, radius, kinetic, visited)

    @property
    def times(self) -> Array:
        """The times (s) at which errors are measured."""
        count = _SAMPLES_A_DECADE * _DECADES + 1
        return self.seconds * np.logspace(-_DECADES, 0, count)


def _chosen(names: tuple[str, ...]) -> tuple[LongMethod, ...]:
    known = {method.name: method for method in LONG_METHODS}
    for name in names:
        if name not in known:
            raise SimulationError(choice("method", name, known))
    return tuple(known[name] for name in names) if names else LONG_METHODS


def _check(scene: Scene, seconds: float) -> None:
    if not _LEAST_SECONDS <= seconds <= _MOST_SECONDS:
        raise SimulationError(
            f"the time must be {_LEAST_SECONDS:g} s to {_MOST_SECONDS:g} s; got {seconds:g} s"
        )
    wrong = [
        type(effect).__name__ for effect in scene.effects if not isinstance(effect, CONSERVING)
    ]
    if wrong:
        raise SimulationError(
            "the scene must conserve energy, with no effects except gravity, joint_spring and "
            f"motor_inertia; got {' and '.join(wrong)}"
        )


def total_energy(scene: Scene, states: Array) -> Any:
    """Return T + V (J) of states (q1, q2, p1, p2), shape (4, n), in long double.

    The chain's parameters are the exact float64 numbers of the runs.
    """
    chain = scene.moving_chain.convert(float).convert(np.longdouble)
    q1, q2, p1, p2 = states.astype(np.longdouble)
    u = MomentumEquations().to_speeds(chain, (q1, q2), (p1, p2))
    T = lagrange.kinetic_energy(chain, (q1, q2), u)
    return T + potential_energy(scene.effects, chain, (q1, q2))


def _drift(asked: _Asked, method: LongMethod, report: Callable[[float], None]) -> Drift:
    starts = many_starts(asked.scene, method.starts, spread=_SPREAD, seed=_SEED)
    try:
        states = np.concatenate([starts, asked.visited], axis=1)
        run = prepared(method, asked.scene, asked.radius, states)
    except SimulationError as error:
        nothing = Binned(np.empty(0), np.empty((0, method.starts)))
        return Drift(method, nothing, None, math.nan, 0, math.inf, 0.0, 0.0, str(error))
    begin = perf_counter()
    first = total_energy(asked.scene, starts)
    seen: list[float] = []
    errors: list[Array] = []
    failure, farthest = "", 0.0
    for time, states in run.stream(asked.times, lambda time: report(time / asked.seconds)):
        if not np.isfinite(states).all():
            failure = f"its state is not finite before {time:.3g} s"
            break
        seen.append(time)
        errors.append(np.asarray(total_energy(asked.scene, states) - first, dtype=float))
        farthest = max(farthest, float(np.abs(states[:2]).max()))
        report(min(1.0, time / asked.seconds))
    seconds = perf_counter() - begin
    unfinished = math.inf if failure else run.unfinished(states)
    if not failure and unfinished > _FINISHED:
        failure = f"its stages are unconverged by {unfinished:.2g} roundings at the end"
    shares = np.array(errors).reshape(-1, method.starts) / asked.kinetic_energy
    measured = binned(np.array(seen), shares)
    start = max(asked.seconds / 10**_FITTED_DECADES, _SETTLED * asked.radius)
    return Drift(
        method=method,
        measured=measured,
        growth=None if failure else fit_growth(measured, start=start),
        step=run.step(),
        iterations=run.iterations,
        unfinished=unfinished,
        farthest=farthest,
        seconds=seconds,
        failure=failure,
    )
