"""The simulators of `twolink.engines` under test: forward dynamics, and motions by each method."""

from __future__ import annotations

import numpy as np

from twolink.chain import Chain
from twolink.conformance.contract import Array, CannotError, Engine, ModelRefusedError
from twolink.conformance.messages import Effect, Method, Model, Move, Moved
from twolink.coordinates import JointConvention
from twolink.effects import Gravity, JointDamping
from twolink.engines.registry import engine_named
from twolink.errors import EngineError, TwolinkError
from twolink.scene import Scene

_JOINTS = JointConvention()


class Simulator(Engine):
    """A simulator by its name in `twolink.engines.registry`, for chains from parameters.

    Its forward dynamics is without damping, friction and armature; its motions have damping where
    the simulator has it. Raises `EngineError` if its package is missing.
    """

    simulator: str
    reads = ("parameters",)

    def __init__(self) -> None:
        """Find the simulator."""
        self._engine = engine_named(self.simulator)
        missing = self._engine.missing()
        if missing:
            raise EngineError(missing)
        self.name, self.version = self._engine.name, self._engine.version()
        damped: tuple[Effect, ...] = ("joint_damping",)
        self.effects = damped if "damping" in self._engine.expresses else ()
        self.methods = tuple(
            Method(
                name=each.name,
                order=None if each.order is None else float(each.order),
                parameter=each.parameter,
            )
            for each in self._engine.methods
        )

    def load(self, model: Model) -> None:
        """Keep the chain, which each call builds anew."""
        given = model.parameters
        assert given is not None
        try:
            self._chain = Chain(given.mass, given.length, given.centre, given.inertia)
        except TwolinkError as error:
            raise ModelRefusedError(str(error)) from error
        self._gravity, self._damping = given.gravity, given.damping
        self._rigid = not any((*given.damping, *given.friction, *given.armature))

    def forward_dynamics(self, angles: Array, speeds: Array, torques: Array) -> Array:
        """Return the engine's own accelerations."""
        if not self._rigid:
            raise CannotError("accelerations are asked for without damping, friction and armature")
        return np.array(
            [self._accelerations(*s) for s in zip(angles, speeds, torques, strict=True)]
        )

    def move(self, request: Move) -> Moved:
        """Run a scene by one of the engine's methods."""
        damping = (JointDamping(self._damping),) if any(self._damping) else ()
        scene = Scene(
            chain=self._chain,
            q=_JOINTS.absolute_angles(request.angles),
            u=_JOINTS.absolute_speeds(request.speeds),
            duration=request.times[-1],
            effects=(Gravity(self._gravity), *damping),
        )
        run = self._engine.prepared(scene, request.method)
        found = run(request.parameter, np.array(request.times))
        angles = zip(*_JOINTS.joint_angles((found.q[0], found.q[1])), strict=True)
        speeds = zip(*_JOINTS.joint_speeds((found.u[0], found.u[1])), strict=True)
        return Moved(
            seq=request.seq,
            angles=tuple((float(one), float(two)) for one, two in angles),
            speeds=tuple((float(one), float(two)) for one, two in speeds),
            seconds=found.seconds,
            setup_seconds=found.setup_seconds,
            warnings=found.warnings,
        )

    def _accelerations(self, theta: Array, omega: Array, torque: Array) -> tuple[float, float]:
        du = self._engine.accelerations(
            self._chain,
            _JOINTS.absolute_angles((float(theta[0]), float(theta[1]))),
            _JOINTS.absolute_speeds((float(omega[0]), float(omega[1]))),
            gravity=(0.0, self._gravity),
            torque=(float(torque[0]), float(torque[1])),
        )
        first, second = _JOINTS.joint_speeds(du)
        return float(first), float(second)


class Heyoka(Simulator):
    """heyoka's own `lagrangian()`."""

    simulator = "heyoka"


class Scipy(Simulator):
    """SciPy over Pinocchio."""

    simulator = "SciPy over Pinocchio"


class Mujoco(Simulator):
    """MuJoCo."""

    simulator = "MuJoCo"


class Drake(Simulator):
    """Drake."""

    simulator = "Drake"


class Diffrax(Simulator):
    """diffrax."""

    simulator = "diffrax"


class Pybullet(Simulator):
    """PyBullet."""

    simulator = "PyBullet"


class Sympy(Simulator):
    """Code that SymPy generates."""

    simulator = "SymPy-generated code"
