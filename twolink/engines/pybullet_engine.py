"""PyBullet: `stepSimulation` on the URDF that the library writes.

PyBullet's defaults are made for games: a joint motor that brakes, damping of all motion, speeds
clipped at 100 rad/s. They are switched off here, as is usual for mechanics.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from time import perf_counter
from typing import Any

import numpy as np

from twolink.engines.approximation import ApproximateModel, Plane, approximate_model
from twolink.engines.contract import Array
from twolink.engines.faults import CannotError, ModelRefusedError
from twolink.engines.joint_model import JOINTS
from twolink.engines.messages import Method, Model
from twolink.engines.simulation_engine import (
    ApproximatingEngine,
    EngineRun,
    Prepared,
    stretches,
)
from twolink.engines.urdf_reading import UrdfReadingEngine, check_joints, each
from twolink.errors import EngineError
from twolink.files import scratch_folder
from twolink.scene import Scene

_REASONS = {
    "joint_friction": "its joints have no dry friction but a motor that brakes step by step",
    "joint_stop": "its joint limits have no rebound",
    "surface": "its velocity solver resolves impacts with one law for all contacts",
    "compliant_surface": "its velocity solver resolves contacts without a force law",
    "end_force": "it has friction only in contacts",
    "armature": "its joints have no armature",
    "drive": "its damping cannot be negative",
}
_EXPRESSES = frozenset({"torque", "stiffness", "damping", "waves", "samples", "push"})
_FASTEST = 1e12
_CHANGES = {
    "joint_friction": "a PyBullet motor that holds the joint up to the kinetic torque",
    "joint_stop": "PyBullet's joint limits, without rebound",
    "surface": "PyBullet's contacts, with its law of restitution and its own solver",
}
# The radius (m) of the balls that represent contact points: friction acts so far from the points.
_BALL = 1e-6


class Pybullet(UrdfReadingEngine, ApproximatingEngine):
    """PyBullet; see `SimulationEngine`.

    Springs and torques are set before every step, as is usual; damping is PyBullet's.
    """

    name = "PyBullet"
    methods = (Method(name="stepSimulation", order=1, parameter="step"),)
    packages = (("pybullet", "pybullet"),)
    expresses = _EXPRESSES
    reasons = _REASONS
    changes = _CHANGES

    def _prepared(self, scene: Scene, method: str) -> Prepared:
        """Return a function that runs a scene in a new world for each run."""
        model = approximate_model(scene)

        def run(step: float, times: Array) -> EngineRun:
            begin = perf_counter()
            with _client() as client:
                world = _World(client, model)
                plan = list(stretches(times, step))
                found = np.empty((len(times), 4))
                found[0] = world.state()
                setup = perf_counter() - begin
                begin, now = perf_counter(), 0.0
                for index, (count, size) in enumerate(plan, start=1):
                    world.advance(now, count, size)
                    found[index], now = world.state(), float(times[index])
                seconds = perf_counter() - begin
            steps = sum(count for count, _ in plan)
            q = np.array(JOINTS.absolute_angles((found[:, 0], found[:, 1])))
            u = np.array(JOINTS.absolute_speeds((found[:, 2], found[:, 3])))
            return EngineRun(q, u, seconds, setup, steps, steps)

        return run

    def _read(self, model: Model) -> _ReadChain:
        """Return the chain of a URDF, by `loadURDF`."""
        return _ReadChain(model)


class _ReadChain:
    """A URDF, loaded for each question; see `twolink.engines.urdf_reading.ReadChain`."""

    def __init__(self, model: Model) -> None:
        """Load a URDF. Raises `ModelRefusedError`."""
        self._model = model
        with self._loaded() as (ask, joints):
            names = check_joints(model, len(joints), joints)
            self._order = [list(joints).index(name) for name in names]
            self._resists = any(joints.values())
            try:
                # `loadURDF` takes any numbers; the first call of a dynamics function checks them.
                self._matrix(ask, np.zeros(2))
            except EngineError as error:
                raise ModelRefusedError(str(error)) from error

    def mass_matrix(self, angles: Array) -> Array:
        """Return `calculateMassMatrix`."""
        with self._loaded() as (ask, _):
            return each(lambda theta: self._matrix(ask, theta), angles)

    def forward_dynamics(self, angles: Array, speeds: Array, torques: Array) -> Array:
        """Return M⁻¹ (τ − `calculateInverseDynamics` at zero acceleration)."""
        if self._resists:
            raise CannotError("its functions leave out the damping and friction of a file")

        def accelerations(theta: Array, omega: Array, torque: Array) -> Array:
            given = self._sorted(theta), self._sorted(omega), [0.0, 0.0]
            terms = np.array(ask("calculateInverseDynamics", *given))[self._order]
            return np.linalg.solve(self._matrix(ask, theta), torque - terms)

        with self._loaded() as (ask, _):
            return each(accelerations, angles, speeds, torques)

    def _matrix(self, ask: Any, angles: Array) -> Array:
        try:
            M = np.array(ask("calculateMassMatrix", self._sorted(angles)))
        except SystemError as error:
            raise EngineError("calculateMassMatrix fails") from error
        return M[np.ix_(self._order, self._order)]

    def _sorted(self, row: Array) -> list[float]:
        """Return numbers of both joints in PyBullet's order."""
        return [float(row[self._order.index(place)]) for place in (0, 1)]

    @contextmanager
    def _loaded(self) -> Iterator[tuple[Ask, dict[str, float]]]:
        """Yield a call of functions on the body, and the resistance of each joint that moves."""
        with _client() as client:
            ask = partial(_ask, client)
            ask("setGravity", *(self._model.gravity or ()))
            body = _load(ask, self._model.urdf or "")
            every = [ask("getJointInfo", body, index) for index in range(ask("getNumJoints", body))]
            # The third entry is the kind of a joint, 4 for one that is fixed.
            joints = {info[1].decode(): info[6] + info[7] for info in every if info[2] != 4}
            yield lambda function, *given: ask(function, body, *given), joints


Ask = Callable[..., Any]


@contextmanager
def _client() -> Iterator[int]:
    """Yield a client with a world of its own. PyBullet's errors are refusals."""
    import pybullet

    client = pybullet.connect(pybullet.DIRECT)
    try:
        yield client
    except pybullet.error as error:
        raise ModelRefusedError(f"PyBullet rejects the chain: {error}") from error
    finally:
        pybullet.disconnect(client)


def _ask(client: int, function: str, *given: Any, **named: Any) -> Any:
    """Call a PyBullet function in the world of a client."""
    import pybullet

    return getattr(pybullet, function)(*given, physicsClientId=client, **named)


def _load(ask: Ask, text: str) -> Any:
    """Return the body of a URDF."""
    import pybullet

    with scratch_folder("engine") as folder:
        file = folder / "chain.urdf"
        file.write_text(text, encoding="utf-8")
        # Without the flag PyBullet computes inertias from the shapes.
        flags = pybullet.URDF_USE_INERTIA_FROM_FILE
        return ask("loadURDF", str(file), useFixedBase=True, flags=flags)


def _urdf(whole: ApproximateModel) -> str:
    """Return the chain's URDF, with limits for stops and balls at contact points."""
    text = whole.smooth.chain.to_urdf()
    for stop in whole.stops:
        joint = f'<joint name="joint{stop.joint + 1}" type='
        lower, upper = max(stop.lower, -1e9), min(stop.upper, 1e9)
        limit = f'<limit lower="{lower!r}" upper="{upper!r}" effort="1e12" velocity="{_FASTEST}"/>'
        text = text.replace(f'{joint}"continuous">', f'{joint}"revolute">{limit}')
    for name in {name for plane in whole.planes for name in plane.on}:
        ball = f'<collision><geometry><sphere radius="{_BALL}"/></geometry></collision>'
        text = text.replace(f'<link name="{name}">', f'<link name="{name}">{ball}')
    return text


class _World:
    """A PyBullet world with a chain at its initial state."""

    def __init__(self, client: int, whole: ApproximateModel) -> None:
        import pybullet

        self._bullet: Any = pybullet
        self._client, self.ask = client, partial(_ask, client)
        self._whole, self._model = whole, whole.smooth
        self._sampled = whole.smooth.sampled()
        model = self._model
        self.body = _load(self.ask, _urdf(whole))
        self.ask("setGravity", *model.gravity_in_space)
        count = self.ask("getNumJoints", self.body)
        names = {self.ask("getJointInfo", self.body, i)[1].decode(): i for i in range(count)}
        self.joints, self._links = [names["joint1"], names["joint2"]], names
        for link in range(-1, count):
            self.ask(
                "changeDynamics",
                self.body,
                link,
                linearDamping=0.0,
                angularDamping=0.0,
                jointDamping=0.0,
                maxJointVelocity=_FASTEST,
            )
            self.ask("setCollisionFilterGroupMask", self.body, link, 0, 0)
        for joint, angle, speed, damping in zip(
            self.joints, model.theta, model.theta_speed, model.damping, strict=True
        ):
            self.ask("changeDynamics", self.body, joint, jointDamping=damping)
            self.ask("resetJointState", self.body, joint, angle, speed)
        for index, plane in enumerate(self._whole.planes):
            self._add_plane(plane, 1 << index)
        for name in {name for plane in self._whole.planes for name in plane.on}:
            self._let_touch(name)

    def _add_plane(self, plane: Plane, group: int) -> None:
        """Add a plane, offset by a ball's radius, so that it limits the balls' centres."""
        (x, y), (nx, ny) = plane.point, plane.normal
        up = [nx, 0.0, -ny]
        place = [x - _BALL * up[0], 0.0, -y - _BALL * up[2]]
        shape = self.ask("createCollisionShape", self._bullet.GEOM_PLANE, planeNormal=up)
        ground = self.ask("createMultiBody", 0.0, shape, basePosition=place)
        # Bullet multiplies friction and restitution of both bodies: those of balls are 1.
        law = {"lateralFriction": plane.friction, "restitution": plane.restitution}
        self.ask("changeDynamics", ground, -1, **law)
        self.ask("setCollisionFilterGroupMask", ground, -1, group, group)

    def _let_touch(self, name: str) -> None:
        """Enable collisions of a point's ball with all planes that limit it."""
        groups = sum(1 << i for i, plane in enumerate(self._whole.planes) if name in plane.on)
        link = self._links[f"{name}_frame"]
        self.ask("changeDynamics", self.body, link, lateralFriction=1.0, restitution=1.0)
        self.ask("setCollisionFilterGroupMask", self.body, link, groups, groups)

    def state(self) -> list[float]:
        """Return the joint angles (rad) and speeds (rad/s)."""
        first, second = self.ask("getJointStates", self.body, self.joints)
        return [first[0], second[0], first[1], second[1]]

    def advance(self, time: float, count: int, size: float) -> None:
        """Take `count` steps of a size (s) from a time (s)."""
        step, client = self._bullet.stepSimulation, self._client
        self.ask("setTimeStep", size)
        # Every joint has a motor that holds it still. The most it may give is kept as an impulse
        # of the step that is set at the time.
        mode, brakes = self._bullet.VELOCITY_CONTROL, list(self._whole.friction)
        self.ask("setJointMotorControlArray", self.body, self.joints, mode, forces=brakes)
        if not self._model.uses - {"damping"}:
            for _ in range(count):
                step(physicsClientId=client)
            return
        for index in range(count):
            self._set_torques(time + index * size)
            step(physicsClientId=client)

    def _set_torques(self, time: float) -> None:
        """Set the torques of springs and motors at a time (s), for one step."""
        model = self._model
        theta1, theta2, _, _ = self.state()
        forces = [
            tau - k * (angle - rest)
            for tau, k, rest, angle in zip(
                model.torque, model.stiffness, model.rest, (theta1, theta2), strict=True
            )
        ]
        for wave in model.waves:
            forces[wave.joint] += wave.amplitude * np.sin(wave.frequency * time + wave.phase)
        if model.samples:
            forces = (np.array(forces) + self._sampled(time)).tolist()
        mode = self._bullet.TORQUE_CONTROL
        self.ask("setJointMotorControlArray", self.body, self.joints, mode, forces=forces)
