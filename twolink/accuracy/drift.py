"""What becomes of a conserved quantity over a long time: energy errors of each method.

A Runge–Kutta method loses or gains energy at a steady rate; a symplectic one keeps it within
bounds; a Taylor series whose steps go to rounding leaves it to chance, so that its error grows
with the square root of time. All are run from the same starts, and the powers of time measured.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np

from twolink import lagrange
from twolink.accuracy.growth import Array, Binned, Growth, binned, growth
from twolink.accuracy.long_runs import LONG_METHODS, LongMethod, many_starts, prepared
from twolink.accuracy.parting import Parting, parting
from twolink.errors import SimulationError
from twolink.provenance import package_versions, this_machine
from twolink.scene import Scene
from twolink.simulation.smooth.equations import MomentumEquations
from twolink.simulation.smooth.taylor import taylor_run

# Errors are looked at over so many decades of time, and powers fitted over the last of them.
_DECADES, _FITTED_DECADES = 5, 3
_SAMPLES_A_DECADE = 80
_LEAST_SECONDS = 100.0

# Before so many radii of convergence, errors that swing to and fro hide those that last.
_SETTLED = 100.0

# Implicit stages are solved when one more iteration moves no state by so many roundings.
_FINISHED = 1.0

# Angles of neighbouring starts (rad): so far apart that their rounding differs from the first step.
_SPREAD, _SEED = 1e-3, 1937

# A step at full order is the radius of convergence over e² (Jorba and Zou, 2005, section 3.2).
_RADIUS_IN_STEPS = math.e**2
_VISITED = 256


@dataclass(frozen=True)
class Drift:
    """The energy error of one method over time.

    `errors` are its root mean square over the starts, at `times` (s), as a share of the greatest
    kinetic energy; both are of shape (bins,). `step` is in s, the mean one for Taylor series;
    `iterations` are those of implicit equations in each step, and one more would move no state by
    more than `unfinished`, in roundings. `growth` is the power of time that was measured, None
    where there is none. `farthest` is the largest angle seen (rad), the run itself took `seconds`,
    and `failure` says why it is not to be trusted.
    """

    method: LongMethod
    measured: Binned
    growth: Growth | None
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
        """The root mean square of the energy errors, as shares of the greatest kinetic energy."""
        return self.measured.rms

    @property
    def as_expected(self) -> bool:
        """Whether the measured power is nearer to what is expected than to the next of 0, ½, 1."""
        return self.growth is not None and abs(self.growth.exponent - self.method.expected) < 0.25


@dataclass(frozen=True)
class DriftStudy:
    """The energy errors of several methods on one scene, over `seconds` of its motion.

    `kinetic_energy` (J) is the greatest of the scene's own run, and `radius` (s) that at which the
    series of the motion converges, on the mean; `parting` tells whether the motion is regular.
    """

    scene: Scene
    seconds: float
    kinetic_energy: float
    radius: float
    parting: Parting
    drifts: tuple[Drift, ...]

    @property
    def unexpected(self) -> tuple[str, ...]:
        """A sentence for each method that does not do what is expected of it."""
        return tuple(_sentence(drift) for drift in self.drifts if not drift.as_expected)

    @property
    def farthest(self) -> float:
        """The largest angle (rad) of all runs."""
        return max((drift.farthest for drift in self.drifts), default=0.0)

    def document(self) -> dict[str, Any]:
        """Return all of it as plain data, for other programs."""
        return {
            "scene": self.scene.title,
            "duration_s": self.seconds,
            "greatest_kinetic_energy_J": self.kinetic_energy,
            "radius_of_convergence_s": self.radius,
            "neighbours_part_by": self.parting.factor,
            "neighbours_part_in_s": self.parting.seconds,
            "chaotic": self.parting.chaotic,
            "starts": {"spread_rad": _SPREAD, "seed": _SEED},
            "energy_error": "root mean square over the starts, per greatest kinetic energy",
            "machine": this_machine(),
            "versions": package_versions("heyoka", "numpy", "scipy"),
            "methods": [_as_data(drift) for drift in self.drifts],
            "unexpected": list(self.unexpected),
        }

    def csv(self) -> str:
        """Return the errors as comma-separated values, a line for each method and time."""
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
        return f"{name}: too few of its errors were seen for a power of time to be fitted."
    return (
        f"{name}: a power of {expected:g} is expected and {drift.growth.rounded} ± "
        f"{drift.growth.uncertainty:.2f} was measured."
    )


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
) -> DriftStudy:
    """Return the energy errors of the named methods (all, if none is named) over a long time (s).

    Raises `SimulationError` for a scene in which energy is not conserved, for a method that is
    none of `LONG_METHODS`, and for too short a time.
    """
    chosen = _chosen(methods)
    _check(scene, seconds)
    own = taylor_run(
        scene, np.linspace(0, scene.duration, _VISITED), formulation="momenta", optimised=True
    )
    equations, chain = MomentumEquations(), scene.equipped.convert(float)
    visited = np.array([*own.q, *equations.from_speeds(chain, tuple(own.q), tuple(own.u))])
    kinetic = float(np.max(lagrange.kinetic_energy(chain, tuple(own.q), tuple(own.u))))
    if kinetic == 0:
        raise SimulationError("the chain stays at rest; allowed is a scene in which it moves")
    radius = _RADIUS_IN_STEPS * scene.duration / own.steps
    asked = _Asked(scene, seconds, radius, kinetic, visited)
    drifts = []
    for index, method in enumerate(chosen):

        def told(share: float, index: int = index, name: str = method.name) -> None:
            if progress is not None:
                progress(name, (index + share) / len(chosen))

        told(0.0)
        drifts.append(_drift(asked, method, told))
    return DriftStudy(scene, seconds, kinetic, radius, parting(scene, radius), tuple(drifts))


@dataclass(frozen=True)
class _Asked:
    """What all methods share: the scene, how long (s), its scales, and states that it visits."""

    scene: Scene
    seconds: float
    radius: float
    kinetic_energy: float
    visited: Array

    @property
    def times(self) -> Array:
        """The times (s) at which errors are looked at."""
        count = _SAMPLES_A_DECADE * _DECADES + 1
        return self.seconds * np.logspace(-_DECADES, 0, count)


def _chosen(names: tuple[str, ...]) -> tuple[LongMethod, ...]:
    known = {method.name: method for method in LONG_METHODS}
    for name in names:
        if name not in known:
            raise SimulationError(f"method is '{name}'; allowed are {', '.join(known)}")
    return tuple(known[name] for name in names) if names else LONG_METHODS


def _check(scene: Scene, seconds: float) -> None:
    if not _LEAST_SECONDS <= seconds < math.inf:
        raise SimulationError(
            f"the time is {seconds:g} s; allowed are {_LEAST_SECONDS:g} s or more"
        )
    wrong = [type(effect).__name__ for effect in scene.effects if not _keeps_energy(effect)]
    if wrong:
        raise SimulationError(
            f"the scene has {' and '.join(wrong)}; allowed are scenes that conserve energy, whose "
            "effects are all gravity, joint_spring or motor_inertia"
        )


def _keeps_energy(effect: Any) -> bool:
    """Return whether an effect has a potential energy, or only adds to what moves."""
    smooth = not hasattr(effect, "nonsmooth") and not hasattr(effect, "breaks")
    return smooth and (hasattr(effect, "potential_energy") or hasattr(effect, "equipped"))


def total_energy(scene: Scene, states: Array) -> Any:
    """Return T + V (J) of states (q1, q2, p1, p2), shape (4, n), in long double.

    The chain is that of the runs: its float64 numbers, exactly.
    """
    chain = scene.equipped.convert(float).convert(np.longdouble)
    q1, q2, p1, p2 = states.astype(np.longdouble)
    u = MomentumEquations().to_speeds(chain, (q1, q2), (p1, p2))
    energy = lagrange.kinetic_energy(chain, (q1, q2), u)
    for effect in scene.effects:
        if hasattr(effect, "potential_energy"):
            energy = energy + effect.potential_energy(chain, (q1, q2))
    return energy


def _drift(asked: _Asked, method: LongMethod, told: Callable[[float], None]) -> Drift:
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
    for time, states in run.stream(asked.times):
        if not np.isfinite(states).all():
            failure = f"it leaves the numbers before {time:.3g} s"
            break
        seen.append(time)
        errors.append(np.asarray(total_energy(asked.scene, states) - first, dtype=float))
        farthest = max(farthest, float(np.abs(states[:2]).max()))
        told(min(1.0, time / asked.seconds))
    seconds = perf_counter() - begin
    unfinished = math.inf if failure else run.unfinished(states)
    if not failure and unfinished > _FINISHED:
        failure = f"its stages are {unfinished:.2g} roundings from being solved at the end"
    shares = np.array(errors).reshape(-1, method.starts) / asked.kinetic_energy
    measured = binned(np.array(seen), shares)
    start = max(asked.seconds / 10**_FITTED_DECADES, _SETTLED * asked.radius)
    return Drift(
        method=method,
        measured=measured,
        growth=None if failure else growth(measured, start=start),
        step=run.step(),
        iterations=run.iterations,
        unfinished=unfinished,
        farthest=farthest,
        seconds=seconds,
        failure=failure,
    )
