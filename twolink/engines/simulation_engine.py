"""Base classes of external engines that simulate a chain with their own integrators.

States are passed and returned in absolute angles. Coordinates and equations inside the engine are
its own.
"""

from __future__ import annotations

import warnings
from abc import abstractmethod
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from types import MappingProxyType

import numpy as np

from twolink.arithmetic import Pair
from twolink.chain import Chain
from twolink.engines.approximation import changed, smooth_part
from twolink.engines.contract import Array, CannotError, Engine, ModelRefusedError
from twolink.engines.joint_model import JOINTS, JointModel, at_state, why_not
from twolink.engines.messages import Effect, Model, Move, Moved
from twolink.engines.scenes import chain_of, scene_of
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
    """An external engine with its own integrators, for chains from parameters.

    `methods` are its integrators. `expresses` are the fields of a `JointModel` that it supports;
    `reasons` explain the missing ones, by the name of an effect or a field. Its forward dynamics is
    that of rigid links; its motions have damping and springs.
    """

    extra: str | None = "engines"
    reads = ("parameters",)
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

    def accelerations(
        self,
        chain: Chain,
        q: Pair,
        u: Pair,
        *,
        gravity: Pair = (0.0, 9.81),
        torque: Pair = (0.0, 0.0),
    ) -> Pair:
        """Return du (rad/s²) at a state, by the engine's own forward dynamics.

        `gravity` (m/s²) is along x and y, `torque` (N m) that of the motors at A and B. Raises
        `EngineError` if the engine rejects the chain.
        """
        self.check_installed()
        return self._accelerations(at_state(chain, q, u, gravity, torque))

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
        """Keep the chain, which each call builds anew."""
        given = model.parameters
        assert given is not None
        try:
            self._chain = chain_of(given)
        except TwolinkError as error:
            raise ModelRefusedError(str(error)) from error
        self._given = given

    def forward_dynamics(self, angles: Array, speeds: Array, torques: Array) -> Array:
        """Return the engine's own accelerations. Raises `CannotError` for joints that resist."""
        given = self._given
        if any((*given.damping, *given.friction, *given.armature)):
            raise CannotError("accelerations are asked for without damping, friction and armature")
        states = zip(angles.tolist(), speeds.tolist(), torques.tolist(), strict=True)
        return np.array([self._joint_accelerations(*state) for state in states])

    def move(self, request: Move) -> Moved:
        """Run a scene by one of the engine's methods."""
        scene = scene_of(self._given, request.angles, request.speeds, request.times[-1])
        run, changes = self._for_motion(scene, request.method)
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

    def _joint_accelerations(self, theta: Pair, omega: Pair, torque: Pair) -> Pair:
        q, u = JOINTS.absolute_angles(theta), JOINTS.absolute_speeds(omega)
        gravity = (0.0, self._given.gravity)
        return JOINTS.joint_speeds(
            self.accelerations(self._chain, q, u, gravity=gravity, torque=torque)
        )

    @abstractmethod
    def _prepared(self, scene: Scene, method: str) -> Prepared:
        """Return a function that runs a supported scene."""

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
