"""Base classes of external engines that simulate a chain with their own integrators.

States are passed and returned in absolute angles. Coordinates and equations inside the engine are
its own.
"""

from __future__ import annotations

import warnings
from abc import abstractmethod
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import pairwise
from types import MappingProxyType

import numpy as np

from twolink.arithmetic import Pair
from twolink.engines.approximation import changed, smooth_part
from twolink.engines.contract import Array, Engine
from twolink.engines.faults import CannotError, ModelRefusedError
from twolink.engines.joint_model import JOINTS, JointModel, at_state, why_not
from twolink.engines.messages import Effect, Model, Move, Moved, Parameters, Reads
from twolink.engines.scenes import chain_of, joint_state, scene_of
from twolink.errors import EngineError, TwolinkError
from twolink.scene import Scene


@dataclass(frozen=True)
class EngineRun:
    """A motion at the requested times, and its cost.

    `q` (rad) and `u` (rad/s) are absolute, shape (2, n). `seconds` is the time of the run without
    set-up; `setup_seconds` that of building models, tracing and compiling. `evaluations` of the
    rates and `steps` are None if the engine does not report them. `warnings` are the engine's.
    """

    q: Array
    u: Array
    seconds: float
    setup_seconds: float
    evaluations: int | None = None
    steps: int | None = None
    warnings: tuple[str, ...] = ()


Prepared = Callable[[float, Array], EngineRun]
"""Runs a scene, given the parameter's value and increasing times (s) that start with 0."""


class SimulationEngine(Engine):
    """An external engine with its own integrators, for chains from parameters and for scenes.

    `methods` are its integrators. `expresses` are the fields of a `JointModel` that it supports;
    `reasons` explain the missing ones, by the name of an effect or a field. Its forward dynamics is
    that of rigid links; its motions have damping and springs.
    """

    extra: str | None = "engines"
    reads: tuple[Reads, ...] = ("parameters", "scene")
    effects: tuple[Effect, ...] = ("joint_damping", "joint_spring")
    expresses: frozenset[str] = frozenset()
    reasons: Mapping[str, str] = MappingProxyType({})

    def unsupported(self, scene: Scene) -> str | None:
        """Return why the engine cannot express a scene, or None if it can."""
        return why_not(scene, self.name, self.expresses, self.reasons)

    def prepared(self, scene: Scene, method: str) -> Prepared:
        """Return a function that runs a scene by a method, with the set-up done.

        Raises `EngineError` for a scene that the engine cannot express or rejects; the returned
        function raises it if the engine fails.
        """
        self._check(scene, method)
        return self._prepared(scene, method)

    def _check(self, scene: Scene, method: str) -> None:
        """Raise `EngineError` for a missing package, an unknown method or an unsupported scene."""
        self.check_installed()
        if method not in {each.name for each in self.methods}:
            allowed = ", ".join(each.name for each in self.methods)
            raise EngineError(f"{self.name}: method must be one of {allowed}; got '{method}'")
        sentence = self.unsupported(scene)
        if sentence:
            raise EngineError(sentence)

    def load(self, model: Model) -> None:
        """Keep the chain or the scene, which each call builds anew."""
        self._given: Parameters | None = model.parameters
        try:
            if model.parameters is not None:
                self._chain = chain_of(model.parameters)
            else:
                self._scene = Scene.parse(model.scene or "")
        except TwolinkError as error:
            raise ModelRefusedError(str(error)) from error

    def move(self, request: Move) -> Moved:
        """Run a scene by one of the engine's methods.

        A scene is run as it is, or not at all; parameters also by the engine's own laws.
        """
        if self._given is not None:
            scene = scene_of(self._given, request.angles, request.speeds, request.times[-1])
            run, changes = self._for_motion(scene, request.method)
        elif sentence := self.unsupported(self._scene):
            raise CannotError(sentence)
        else:
            run, changes = self.prepared(self._from(request), request.method), ()
        found = run(request.parameter, np.array(request.times))
        return Moved(
            seq=request.seq,
            angles=_pairs(JOINTS.joint_angles((found.q[0], found.q[1]))),
            speeds=_pairs(JOINTS.joint_speeds((found.u[0], found.u[1]))),
            seconds=found.seconds,
            setup_seconds=found.setup_seconds,
            warnings=(*found.warnings, *changes),
        )

    def _for_motion(self, scene: Scene, method: str) -> tuple[Prepared, tuple[str, ...]]:
        """Return a function that runs a scene, and the changes that the engine makes to it."""
        return self.prepared(scene, method), ()

    def _from(self, request: Move) -> Scene:
        """Return the scene from a state; that of its start is not rounded."""
        if (request.angles, request.speeds) == joint_state(self._scene):
            return self._scene
        q, u = JOINTS.absolute_angles(request.angles), JOINTS.absolute_speeds(request.speeds)
        return replace(self._scene, q=q, u=u)

    @abstractmethod
    def _prepared(self, scene: Scene, method: str) -> Prepared:
        """Return a function that runs a supported scene."""

    def _gravity(self) -> float:
        """Return gravity (m/s²) of the parameters. Raises `CannotError` for a scene."""
        if self._given is None:
            raise CannotError("quantities are asked for of parameters, not of a scene")
        return self._given.gravity

    def _check_rigid(self) -> None:
        """Raise `CannotError` for joints that resist."""
        given = self._given
        if given and any((*given.damping, *given.friction, *given.armature)):
            raise CannotError("accelerations are asked for without damping, friction and armature")


class EquationsEngine(SimulationEngine):
    """A simulator that evaluates equations of its own, for a chain in a state."""

    def forward_dynamics(self, angles: Array, speeds: Array, torques: Array) -> Array:
        """Return the engine's own accelerations. Raises `CannotError` for joints that resist."""
        self._check_rigid()
        gravity = (0.0, self._gravity())

        def accelerations(theta: Pair, omega: Pair, torque: Pair) -> Pair:
            q, u = JOINTS.absolute_angles(theta), JOINTS.absolute_speeds(omega)
            model = at_state(self._chain, q, u, gravity, torque)
            return JOINTS.joint_speeds(self._accelerations(model))

        states = zip(angles.tolist(), speeds.tolist(), torques.tolist(), strict=True)
        return np.array([accelerations(*state) for state in states])

    @abstractmethod
    def _accelerations(self, model: JointModel) -> Pair:
        """Return du (rad/s²) at the start of a model."""


class ApproximatingEngine(SimulationEngine):
    """An engine that approximates friction, stops and surfaces by its own laws.

    `changes` are these laws, by the name of the effect.
    """

    effects = (*SimulationEngine.effects, "joint_friction", "joint_stop", "surface")
    changes: Mapping[str, str]

    def changed(self, scene: Scene) -> tuple[str, ...]:
        """Return descriptions of the changes that the approximation makes to a scene."""
        return changed(scene, self.changes)

    def prepared(self, scene: Scene, method: str, *, approximate: bool = False) -> Prepared:
        """Return a function that runs a scene; with `approximate`, also an approximated one."""
        self._check(smooth_part(scene) if approximate else scene, method)
        return self._prepared(scene, method)

    def _for_motion(self, scene: Scene, method: str) -> tuple[Prepared, tuple[str, ...]]:
        """Return a function that runs a scene by the engine's own laws, and their description."""
        return self.prepared(scene, method, approximate=True), self.changed(scene)


def _pairs(rows: Pair) -> tuple[tuple[float, float], ...]:
    """Return two rows of numbers as pairs."""
    return tuple((float(first), float(second)) for first, second in zip(*rows, strict=True))


def stretches(times: Array, longest: float) -> Iterator[tuple[int, float]]:
    """Yield the number of equal steps between successive times (s) and their size (s)."""
    for earlier, later in pairwise(times.tolist()):
        count = max(1, int(np.ceil((later - earlier) / longest * (1 - 1e-12))))
        yield count, (later - earlier) / count


@contextmanager
def captured_warnings() -> Iterator[list[str]]:
    """Collect the Python warnings issued in the block, without duplicates."""
    found: list[str] = []
    with warnings.catch_warnings(record=True) as given:
        warnings.simplefilter("always")
        try:
            yield found
        finally:
            found += dict.fromkeys(str(warning.message) for warning in given)
