"""MuJoCo: `mj_step` with its own integrators, on the URDF that the library writes."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from time import perf_counter
from typing import Any

import numpy as np

from twolink.arithmetic import Pair
from twolink.engines import mujoco_contact
from twolink.engines.joint_model import JOINTS, JointModel
from twolink.engines.nearest import NearestModel, nearest_model
from twolink.engines.peer import (
    NearestPeer,
    PeerMethod,
    PeerRun,
    Prepared,
    heard,
    stretches,
)
from twolink.engines.protocol import Array
from twolink.scene import Scene

_SOFT = "its constraints are soft, and it has no coefficient of restitution"
_HELD = "mj_step holds a torque over its step, so that no method keeps its order"
_REASONS = {
    "joint_friction": "its frictionloss is a soft constraint that creeps, and does not stick",
    "joint_stop": _SOFT,
    "surface": _SOFT,
    "compliant_surface": "its contact forces follow from an impedance, and not from a force law",
    "end_force": "its friction is that of contacts, which creep under load",
    "waves": _HELD,
    "samples": _HELD,
}
_EXPRESSES = frozenset({"torque", "stiffness", "damping", "armature", "drive"})
_INTEGRATORS = {
    "Euler": "mjINT_EULER",
    "implicit": "mjINT_IMPLICIT",
    "implicitfast": "mjINT_IMPLICITFAST",
    "discrete": "mjINT_DISCRETE",
    "RK4": "mjINT_RK4",
}
_STAGES = {"RK4": 4}


class Mujoco(NearestPeer):
    """MuJoCo; see `twolink.engines.peer.Peer`. Its Euler method takes damping implicitly."""

    name = "MuJoCo"
    methods = (
        PeerMethod("Euler", 1, "step"),
        PeerMethod("implicit", 1, "step"),
        PeerMethod("implicitfast", 1, "step"),
        PeerMethod("discrete", 1, "step"),
        PeerMethod("RK4", 4, "step"),
    )
    packages = (("mujoco", "mujoco"),)
    expresses = _EXPRESSES
    reasons = _REASONS
    changes = mujoco_contact.CHANGES

    def _prepared(self, scene: Scene, method: str) -> Prepared:
        """Return what runs a scene; `mj_step` is called once between two samples."""
        import mujoco

        begin = perf_counter()
        whole = nearest_model(scene)
        model = whole.smooth
        with _listening(mujoco) as of_building:
            robot = _robot(mujoco, whole)
        robot.opt.integrator = getattr(mujoco.mjtIntegrator, _INTEGRATORS[method])
        data = mujoco.MjData(robot)
        setup = perf_counter() - begin

        def run(step: float, times: Array) -> PeerRun:
            plan = list(stretches(times, step))
            found = np.empty((len(times), 4))
            _start(mujoco, robot, data, model)
            found[0] = *data.qpos, *data.qvel
            with _listening(mujoco) as of_running:
                begin = perf_counter()
                for index, (count, size) in enumerate(plan, start=1):
                    robot.opt.timestep = size
                    mujoco_contact.tune(mujoco, robot, whole, size)
                    mujoco.mj_step(robot, data, count)
                    found[index, :2], found[index, 2:] = data.qpos, data.qvel
                seconds = perf_counter() - begin
            steps = sum(count for count, _ in plan)
            q = np.array(JOINTS.absolute_angles((found[:, 0], found[:, 1])))
            u = np.array(JOINTS.absolute_speeds((found[:, 2], found[:, 3])))
            evaluations = steps * _STAGES.get(method, 1)
            told = (*_warnings(mujoco, data), *of_building, *of_running)
            return PeerRun(q, u, seconds, setup, evaluations, steps, told)

        return run

    def _accelerations(self, model: JointModel) -> Pair:
        """Return du (rad/s²) at the start of a model, by `mj_forward`."""
        import mujoco

        with _listening(mujoco) as said:
            robot = _robot(mujoco, NearestModel(model))
            data = mujoco.MjData(robot)
            _start(mujoco, robot, data, model)
            mujoco.mj_forward(robot, data)
        for sentence in said:
            warnings.warn(sentence, stacklevel=2)
        du1, du2 = JOINTS.absolute_speeds((data.qacc[0], data.qacc[1]))
        return float(du1), float(du2)


@contextmanager
def _listening(mujoco: Any) -> Iterator[list[str]]:
    """Collect what MuJoCo warns of meanwhile, each once.

    Without a listener it writes a file MUJOCO_LOG.TXT wherever the caller happens to be.
    """
    found: list[str] = []
    said: dict[str, None] = {}
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(said.setdefault)
    try:
        with heard() as of_python:
            yield found
    finally:
        mujoco.set_mju_user_warning(before)
        found += dict.fromkeys([*said, *of_python])


def _robot(mujoco: Any, whole: NearestModel) -> Any:
    """Return MuJoCo's model, in which nothing collides but what the scene lets collide."""
    robot, model = mujoco_contact.built(mujoco, whole), whole.smooth
    robot.opt.gravity[:] = model.gravity_in_space
    robot.dof_armature[:] = model.armature
    robot.dof_damping[:] = model.damping
    robot.jnt_stiffness[:] = model.stiffness
    robot.qpos_spring[:] = model.rest
    return robot


def _start(mujoco: Any, robot: Any, data: Any, model: JointModel) -> None:
    """Put the chain to its start."""
    mujoco.mj_resetData(robot, data)
    data.qpos[:], data.qvel[:] = model.theta, model.theta_speed
    data.qfrc_applied[:] = model.torque


def _warnings(mujoco: Any, data: Any) -> tuple[str, ...]:
    """Return what MuJoCo counted of its own warnings, such as a reset after a bad state."""
    counted = {kind: data.warning[kind].number for kind in range(mujoco.mjtWarning.mjNWARNING)}
    return tuple(
        f"{mujoco.mjtWarning(kind).name}: {number}" for kind, number in counted.items() if number
    )
