"""A trial on a trajectory: a scene is simulated and compared at its samples.

This library promises a global error, so its bound is the requested accuracy. An external engine
promises at most a tolerance for each step. It runs its method of the highest order (an implicit
one if the scene requires it) with a fine setting (a tolerance of 1e-12, for heyoka its default of
round-off; steps of a hundredth of the time in which the chain turns through a radian) and the same
time limit as this library. Its bound is the largest of `ENGINE_ACCURACY`, our accuracy and a
thousand of its tolerances times the error growth, but at most `NO_ANSWER`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from twolink import lagrange
from twolink.effects import potential_energy
from twolink.engines.contract import Array, Engine
from twolink.engines.joint_model import JOINTS
from twolink.engines.marks import Result
from twolink.engines.messages import Method, Model, Move, Moved
from twolink.engines.remote_engine import RemoteEngine
from twolink.engines.scenes import joint_state, parameters_of
from twolink.errors import IntegrationError
from twolink.hardcases.reference_integrator import ReferenceMotion, ReferenceStates
from twolink.names import EquationsName
from twolink.scene import Scene
from twolink.simulation import Trajectory, simulate
from twolink.simulation.motion import has_modes
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.simulation.smooth.longest_step import default_longest_step
from twolink.verification.tolerance import EPSILON

ENGINE_ACCURACY, NO_ANSWER = 1e-6, 1e-2

_TOLERANCE = 1e-12
# heyoka's default is round-off; other engines do not reach it.
_TOLERANCES = {"heyoka": EPSILON}
_TOLERANCES_TOGETHER = 1e3
_LONGEST_STEP, _SHARE_OF_A_RADIAN = 1e-4, 1e-2


@dataclass(frozen=True)
class Answer:
    """A computed motion: times (s), q (rad) and u (rad/s), shape (2, n).

    `accuracy` is the error tolerance (rad, rad/s), and `growth` the amplification of local errors.
    This library's answers include their `trajectory`.
    """

    scene: Scene
    t: Array
    q: Array
    u: Array
    accuracy: float
    tolerance: float = 0.0
    trajectory: Trajectory | None = None

    @property
    def finite(self) -> bool:
        """Whether all values are finite and no sample is missing."""
        whole = self.q.shape == self.u.shape == (2, len(self.t))
        return whole and bool(np.isfinite(self.q).all() and np.isfinite(self.u).all())

    def bound(self, growth: float | Array = 1.0) -> Array:
        """Return the error tolerance at each time, shape (n,)."""
        together = _TOLERANCES_TOGETHER * self.tolerance
        grown = np.maximum(self.accuracy, np.asarray(growth) * together)
        most = max(NO_ANSWER, self.accuracy, together)
        return np.broadcast_to(np.minimum(grown, most), self.t.shape)


Judge = Callable[[Answer], Result]
"""Compares an answer with the reference."""

Check = Callable[[], None]


@dataclass(frozen=True)
class TrajectoryTrial:
    """A scene at evenly spaced samples, and the check of its result.

    `accuracies` are tried one after the other with this library (default: the scene's),
    `tolerances` with external engines (default: their fine setting); `also` is an additional check
    of each formulation, which need not simulate the scene.
    """

    scene: Scene
    judges: tuple[Judge, ...]
    samples: int = 11
    accuracies: tuple[float, ...] = ()
    tolerances: tuple[float, ...] = ()
    also: Callable[[EquationsName, Check], Iterable[Result]] | None = None
    _found: dict[str, Result] = field(default_factory=dict, repr=False, compare=False)

    def ours(self, formulation: EquationsName, check: Check) -> Result:
        """Return the worst result of one of the formulations.

        Modes use speeds: for them the library replaces momenta by Lagrange's equations, whose
        result is reused.
        """
        modal = has_modes(self.scene)
        text: EquationsName = EQUATIONS[formulation].in_speeds if modal else formulation
        if modal and text in self._found:
            return self._found[text]
        found: list[Result] = []
        for accuracy in self.accuracies or (self.scene.accuracy,):
            trajectory = simulate(
                self.scene,
                accuracy=accuracy,
                formulation=formulation,
                samples=self.samples,
                progress=lambda *_: check(),
            )
            if trajectory.failure:
                raise IntegrationError(trajectory.failure)
            answer = Answer(
                self.scene,
                trajectory.t,
                trajectory.q,
                trajectory.u,
                accuracy,
                trajectory=trajectory,
            )
            found.append(self._judged(answer, bool(trajectory.notes)))
        if self.also is not None:
            found += self.also(formulation, check)
        self._found[text] = worst(found)
        return self._found[text]

    def unsupported(self, engine: Engine) -> str | None:
        """Return why an engine cannot express the scene, or None if it can."""
        return engine.unsupported(self.scene)

    def call(self, engine: Engine) -> str:
        """Return the method and its parameters for an engine."""
        method = best_method(engine.methods, self.scene)
        values = ", ".join(f"{value:.3g}" for value in self._values(engine, method))
        return f"{engine.name}, {method.name}: prepared(scene)({method.parameter} {values})"

    def external(self, engine: RemoteEngine) -> Result:
        """Return the worst result of an engine's own method and integrator."""
        method = best_method(engine.methods, self.scene)
        times = np.linspace(0.0, self.scene.duration, self.samples)
        engine.load(_model(engine, self.scene))
        found = []
        for value in self._values(engine, method):
            moved = engine.move(_move(self.scene, method, value, times))
            tolerance = value if method.parameter == "tolerance" else 0.0
            accuracy = max(ENGINE_ACCURACY, self.scene.accuracy)
            answer = Answer(self.scene, times, *_absolute(moved), accuracy, tolerance)
            found.append(self._judged(answer, bool(moved.warnings)))
        return worst(found)

    def _values(self, engine: Engine, method: Method) -> tuple[float, ...]:
        """Return the values of a method's parameter, one for each motion."""
        if method.parameter == "step":
            return (self._step,)
        return self.tolerances or (_TOLERANCES.get(engine.name, _TOLERANCE),)

    @cached_property
    def _step(self) -> float:
        """The step (s) for an engine with fixed steps."""
        turning = default_longest_step(self.scene)
        return min(_LONGEST_STEP, _SHARE_OF_A_RADIAN * turning, self.scene.duration / 100)

    def _judged(self, answer: Answer, warned: bool) -> Result:
        if not answer.finite:
            return Result(math.inf, warned, "the answer is not finite or incomplete", finite=False)
        found = worst([judge(answer) for judge in self.judges])
        return Result(found.factor, warned, found.said)


def _model(engine: Engine, scene: Scene) -> Model:
    """Return the message that loads a scene, whole if an engine reads it, or its parameters."""
    if "scene" in engine.reads:
        return Model(id="scene", scene=scene.to_toml())
    return Model(id="scene", parameters=parameters_of(scene)[0])


def _move(scene: Scene, method: Method, value: float, times: Array) -> Move:
    angles, speeds = joint_state(scene)
    return Move(
        seq=0,
        test="scene",
        angles=angles,
        speeds=speeds,
        method=method.name,
        parameter=value,
        times=tuple(times.tolist()),
    )


def _absolute(moved: Moved) -> tuple[Array, Array]:
    """Return q (rad) and u (rad/s) of a motion, shape (2, n)."""
    theta, omega = (np.array(rows).T for rows in (moved.angles, moved.speeds))
    q, u = JOINTS.absolute_angles((*theta,)), JOINTS.absolute_speeds((*omega,))
    return np.array(q), np.array(u)


# Engines' methods for stiff problems, in order of preference.
_IMPLICIT = ("Radau", "Kvaerno5", "radau3", "radau1", "implicit_euler", "implicit")


def best_method(methods: tuple[Method, ...], scene: Scene) -> Method:
    """Return an engine's method of highest order, implicit if the scene requires it."""
    implicit = [m for name in _IMPLICIT for m in methods if m.name == name]
    if scene.method == "Radau" and implicit:
        return implicit[0]
    explicit = [m for m in methods if m not in implicit] or implicit
    controlled = [m for m in explicit if m.parameter == "tolerance"] or explicit
    varying = [m for m in controlled if m.order is None]
    return varying[0] if varying[:1] == controlled[:1] else max(controlled, key=_order)


def _order(method: Method) -> float:
    return method.order or 0


def worst(results: list[Result]) -> Result:
    """Return the result with the largest factor."""
    return max(results, key=lambda x: math.inf if math.isnan(x.factor) else x.factor)


def near(expected: Callable[[Array], ReferenceStates], growth: float | Array = 1.0) -> Judge:
    """Return a check of the largest error of q and u, in units of the bound at its time."""

    def judge(answer: Answer) -> Result:
        true = expected(answer.t)
        found = np.concatenate([answer.q, answer.u])
        right = np.concatenate([true.q, true.u])
        # Answer and reference are rounded to float64.
        error = np.maximum(np.abs(found - right) - np.spacing(np.abs(right)), 0.0).max(axis=0)
        bound = answer.bound(growth)
        place = int(np.argmax(error / bound))
        return Result(
            float(error[place] / bound[place]),
            said=f"at {answer.t[place]:.6g} s q or u is off by {error[place]:.2g}, "
            f"tolerance {bound[place]:.2g}",
        )

    return judge


def near_run(reference: ReferenceMotion, growth: float | Array = 1.0) -> Judge:
    """Return a check against a run of 113 bits, computed at first use."""
    kept: dict[tuple[float, ...], ReferenceStates] = {}

    def expected(times: Array) -> ReferenceStates:
        key = tuple(times.tolist())
        if key not in kept:
            kept[key] = reference.states(times)
        return kept[key]

    return near(expected, growth)


def keeps(
    name: str,
    quantity: Callable[[Answer], Array],
    size: Callable[[Answer], Array],
    roundings: float,
) -> Judge:
    """Return a check of a conserved quantity, which may change by `roundings` of its size.

    The tolerance of u is added: twice its ratio to the largest speed.
    """

    def judge(answer: Answer) -> Result:
        values, largest = quantity(answer), float(np.abs(size(answer)).max())
        fast = float(np.abs(answer.u).max())
        share = roundings * EPSILON + 2 * answer.accuracy / max(fast, answer.accuracy)
        off, bound = float(np.abs(values - values[0]).max()), largest * share
        return Result(off / bound, said=f"{name} changes by {off:.2g}, tolerance {bound:.2g}")

    return judge


def keeps_energy(roundings: float) -> Judge:
    """Return a check of T + V, which may change by `roundings` of the largest T."""
    return keeps("energy", energy, kinetic_energy, roundings)


def kinetic_energy(answer: Answer) -> Array:
    """Return T (J) at the samples."""
    chain = answer.scene.moving_chain
    return np.asarray(lagrange.kinetic_energy(chain, tuple(answer.q), tuple(answer.u)))


def energy(answer: Answer) -> Array:
    """Return T + V (J) at the samples, of the effects that have a potential."""
    scene, q = answer.scene, tuple(answer.q)
    V = potential_energy(scene.effects, scene.moving_chain, q)
    return np.asarray(kinetic_energy(answer) + V)


def momentum(answer: Answer) -> Array:
    """Return the angular momentum about A (kg m²/s) at the samples."""
    p1, p2 = lagrange.momenta(answer.scene.moving_chain, tuple(answer.q), tuple(answer.u))
    return np.asarray(p1 + p2)
