"""A simulator of this library as the subject of trials: each call in a sandbox."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from twolink.chain import Chain
from twolink.engines.contract import Array
from twolink.files import scratch_folder
from twolink.hardcases.hostile_urdf import URDFS
from twolink.scene import Scene

if TYPE_CHECKING:
    from twolink.engines.messages import Method
    from twolink.engines.sandbox import TaskResult
    from twolink.engines.simulation_engine import SimulationEngine

Numbers = tuple[float, float]


class Sandboxed:
    """A simulator, started anew for each call; see `twolink.hardcases.record.Subject`."""

    def __init__(self, engine: SimulationEngine) -> None:
        """Take an engine."""
        self._engine = engine

    @property
    def name(self) -> str:
        """The engine's name."""
        return self._engine.name

    @property
    def methods(self) -> tuple[Method, ...]:
        """The engine's methods."""
        return self._engine.methods

    @property
    def reads_urdf(self) -> bool:
        """Whether the engine has a reader of URDF."""
        return self.name in READERS

    def unsupported(self, scene: Scene) -> str | None:
        """Return why the engine cannot express a scene, or None if it can."""
        return self._engine.unsupported(scene)

    def accelerations(
        self, chain: Chain, q: Numbers, u: Numbers, g: float, torque: Numbers, seconds: float
    ) -> TaskResult:
        """Return the engine's du (rad/s²)."""
        return self._run(_accelerations, chain, q, u, (0.0, g), torque, seconds=seconds)

    def motions(
        self,
        scene: Scene,
        method: str,
        parameters: tuple[float, ...],
        times: Array,
        seconds: float,
    ) -> TaskResult:
        """Return the engine's q, u and warnings for each parameter value."""
        return self._run(_motions, scene, method, parameters, times, seconds=seconds)

    def reading(self, urdf: str, seconds: float) -> TaskResult:
        """Return numbers of the engine for a text of `URDFS` that it has loaded."""
        return self._run(_read, urdf, seconds=seconds)

    def _run(self, task: Callable[..., Any], *arguments: Any, seconds: float) -> TaskResult:
        from twolink.engines.sandbox import run_sandboxed

        return run_sandboxed(task, self.name, *arguments, seconds=seconds)


def _accelerations(
    name: str, chain: Chain, q: Numbers, u: Numbers, gravity: Numbers, torque: Numbers
) -> Numbers:
    from twolink.engines.registry import simulator_named

    du1, du2 = simulator_named(name).accelerations(chain, q, u, gravity=gravity, torque=torque)
    return float(du1), float(du2)


def _motions(
    name: str, scene: Scene, method: str, parameters: tuple[float, ...], times: Array
) -> list[tuple[Array, Array, tuple[str, ...]]]:
    from twolink.engines.registry import simulator_named

    run = simulator_named(name).prepared(scene, method)
    found = []
    for parameter in parameters:
        motion = run(parameter, times)
        found.append((np.asarray(motion.q), np.asarray(motion.u), motion.warnings))
    return found


def _read(name: str, urdf: str) -> list[float]:
    """Return an engine's accelerations (PyBullet: torques) for a URDF."""
    return READERS[name](URDFS[urdf]())


def _pinocchio(text: str) -> list[float]:
    import numpy as np
    import pinocchio

    model = pinocchio.buildModelFromXML(text)
    q = pinocchio.neutral(model)
    v = np.full(model.nv, 0.1)
    found = pinocchio.aba(model, model.createData(), q, v, 0 * v)
    return [float(x) for x in found]


def _mujoco(text: str) -> list[float]:
    import mujoco

    model: Any = mujoco.MjModel.from_xml_string(text)
    data: Any = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return [float(x) for x in data.qacc]


def _drake(text: str) -> list[float]:
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import MultibodyPlant

    plant = MultibodyPlant(0.0)
    Parser(plant).AddModelsFromString(text, "urdf")
    plant.Finalize()
    context = plant.CreateDefaultContext()
    rates = plant.EvalTimeDerivatives(context).CopyToVector()
    return [float(x) for x in rates[plant.num_positions() :]]


def _pybullet(text: str) -> list[float]:
    import pybullet

    with scratch_folder("input") as folder:
        file = folder / "robot.urdf"
        file.write_text(text, encoding="utf-8")
        client = pybullet.connect(pybullet.DIRECT)
        robot = pybullet.loadURDF(str(file), useFixedBase=True)
        joints = range(pybullet.getNumJoints(robot))
        free = [j for j in joints if pybullet.getJointInfo(robot, j)[2] != pybullet.JOINT_FIXED]
        zeros = [0.0] * len(free)
        found = pybullet.calculateInverseDynamics(robot, zeros, zeros, zeros)
        pybullet.disconnect(client)
        return [float(x) for x in found]


READERS: dict[str, Callable[[str], list[float]]] = {
    "SciPy over Pinocchio": _pinocchio,
    "MuJoCo": _mujoco,
    "Drake": _drake,
    "PyBullet": _pybullet,
}
