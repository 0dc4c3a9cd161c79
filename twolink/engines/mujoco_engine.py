"""MuJoCo: `mj_step` with its own integrators, on the URDF that the library writes."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from time import perf_counter
from typing import Any

import numpy as np

from twolink.engines import mujoco_contact
from twolink.engines.approximation import ApproximateModel, approximate_model
from twolink.engines.contract import Array
from twolink.engines.faults import CannotError, ModelRefusedError
from twolink.engines.joint_model import JOINTS, JointModel
from twolink.engines.messages import Method, Model
from twolink.engines.simulation_engine import (
    ApproximatingEngine,
    EngineRun,
    Prepared,
    captured_warnings,
    stretches,
)
from twolink.engines.urdf_reading import UrdfReadingEngine, check_joints, each
from twolink.scene import Scene

_SOFT = "its constraints are soft, without a coefficient of restitution"
_HELD = "mj_step holds a torque over its step, which reduces the order of every method"
_REASONS = {
    "joint_friction": "its frictionloss is a soft constraint that creeps instead of sticking",
    "joint_stop": _SOFT,
    "surface": _SOFT,
    "compliant_surface": "its contact forces follow from an impedance, not from a force law",
    "end_force": "it has friction only in contacts, which creep under load",
    "waves": _HELD,
    "samples": _HELD,
}
_EXPRESSES = frozenset({"torque", "stiffness", "damping", "armature", "drive", "push"})
_INTEGRATORS = {
    "Euler": "mjINT_EULER",
    "implicit": "mjINT_IMPLICIT",
    "implicitfast": "mjINT_IMPLICITFAST",
    "discrete": "mjINT_DISCRETE",
    "RK4": "mjINT_RK4",
}
_STAGES = {"RK4": 4}


class Mujoco(UrdfReadingEngine, ApproximatingEngine):
    """MuJoCo; see `SimulationEngine`. Its Euler method takes damping implicitly."""

    name = "MuJoCo"
    methods = (
        Method(name="Euler", order=1, parameter="step"),
        Method(name="implicit", order=1, parameter="step"),
        Method(name="implicitfast", order=1, parameter="step"),
        Method(name="discrete", order=1, parameter="step"),
        Method(name="RK4", order=4, parameter="step"),
    )
    packages = (("mujoco", "mujoco"),)
    expresses = _EXPRESSES
    reasons = _REASONS
    changes = mujoco_contact.CHANGES

    def _prepared(self, scene: Scene, method: str) -> Prepared:
        """Return a function that runs a scene with one call of `mj_step` between samples."""
        import mujoco

        begin = perf_counter()
        whole = approximate_model(scene)
        model = whole.smooth
        with _listening(mujoco) as of_building:
            robot = robot_of(mujoco, whole)
        robot.opt.integrator = getattr(mujoco.mjtIntegrator, _INTEGRATORS[method])
        data = mujoco.MjData(robot)
        setup = perf_counter() - begin

        def run(step: float, times: Array) -> EngineRun:
            plan = list(stretches(times, step))
            found = np.empty((len(times), 4))
            _start(mujoco, robot, data, model)
            found[0] = *data.qpos, *data.qvel
            with _listening(mujoco) as of_running:
                begin = perf_counter()
                for index, (count, size) in enumerate(plan, start=1):
                    robot.opt.timestep = size
                    mujoco_contact.tune(robot, whole, size)
                    mujoco.mj_step(robot, data, count)
                    found[index, :2], found[index, 2:] = data.qpos, data.qvel
                seconds = perf_counter() - begin
            steps = sum(count for count, _ in plan)
            q = np.array(JOINTS.absolute_angles((found[:, 0], found[:, 1])))
            u = np.array(JOINTS.absolute_speeds((found[:, 2], found[:, 3])))
            evaluations = steps * _STAGES.get(method, 1)
            sentences = (*_warnings(mujoco, data), *of_building, *of_running)
            return EngineRun(q, u, seconds, setup, evaluations, steps, sentences)

        return run

    def _read(self, model: Model) -> _ReadChain:
        """Return the chain of a URDF, by MuJoCo's compiler."""
        return _ReadChain(model)


class _ReadChain:
    """A compiled URDF; see `twolink.engines.urdf_reading.ReadChain`."""

    def __init__(self, model: Model) -> None:
        """Compile a URDF. Raises `ModelRefusedError`."""
        import mujoco

        self._mujoco: Any = mujoco
        with _listening(mujoco) as said:
            try:
                self._robot: Any = mujoco.MjModel.from_xml_string(model.urdf)
            except ValueError as error:
                raise ModelRefusedError(str(error)) from error
        _issue(said)
        robot = self._robot
        names = [robot.joint(index).name for index in range(robot.njnt)]
        joints = [robot.joint(name) for name in check_joints(model, robot.nv, names)]
        self._places = [joint.qposadr[0] for joint in joints]
        self._order = [joint.dofadr[0] for joint in joints]
        robot.opt.gravity[:] = model.gravity
        off = mujoco.mjtDisableBit
        robot.opt.disableflags |= off.mjDSBL_LIMIT | off.mjDSBL_CONTACT
        self._data = mujoco.MjData(robot)

    def mass_matrix(self, angles: Array) -> Array:
        """Return `mj_fullM`."""
        return each(self._matrix, angles)

    def forward_dynamics(self, angles: Array, speeds: Array, torques: Array) -> Array:
        """Return `mj_forward`, with damping."""
        if self._robot.dof_frictionloss.any():
            raise CannotError(f"MuJoCo's friction: {_REASONS['joint_friction']}")
        return each(self._accelerations, angles, speeds, torques)

    def _matrix(self, angles: Array) -> Array:
        self._data.qpos[self._places] = angles
        self._forward()
        M = np.zeros((2, 2))
        self._mujoco.mj_fullM(self._robot, self._data, M)
        return M[np.ix_(self._order, self._order)]

    def _accelerations(self, angles: Array, speeds: Array, torques: Array) -> Array:
        data = self._data
        data.qpos[self._places], data.qvel[self._order] = angles, speeds
        data.qfrc_applied[self._order] = torques
        self._forward()
        return np.array(data.qacc[self._order])

    def _forward(self) -> None:
        with _listening(self._mujoco) as said:
            self._mujoco.mj_forward(self._robot, self._data)
        _issue(said)


def _issue(sentences: list[str]) -> None:
    for sentence in sentences:
        warnings.warn(sentence, stacklevel=3)


@contextmanager
def _listening(mujoco: Any) -> Iterator[list[str]]:
    """Collect MuJoCo's warnings in the block, without duplicates.

    Without a handler MuJoCo writes a file MUJOCO_LOG.TXT into the working directory.
    """
    found: list[str] = []
    said: dict[str, None] = {}
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(said.setdefault)
    try:
        with captured_warnings() as of_python:
            yield found
    finally:
        mujoco.set_mju_user_warning(before)
        found += dict.fromkeys([*said, *of_python])


def robot_of(mujoco: Any, whole: ApproximateModel) -> Any:
    """Return MuJoCo's model, with collisions only between the pairs of the scene."""
    robot, model = mujoco_contact.built(mujoco, whole), whole.smooth
    robot.opt.gravity[:] = model.gravity_in_space
    robot.dof_armature[:] = model.armature
    robot.dof_damping[:] = model.damping
    robot.jnt_stiffness[:] = model.stiffness
    robot.qpos_spring[:] = model.rest
    return robot


def _start(mujoco: Any, robot: Any, data: Any, model: JointModel) -> None:
    """Set the chain to its initial state."""
    mujoco.mj_resetData(robot, data)
    data.qpos[:], data.qvel[:] = model.theta, model.theta_speed
    data.qfrc_applied[:] = model.torque


def _warnings(mujoco: Any, data: Any) -> tuple[str, ...]:
    """Return MuJoCo's warning counters, such as a reset after a bad state."""
    counted = {kind: data.warning[kind].number for kind in range(mujoco.mjtWarning.mjNWARNING)}
    return tuple(
        f"{mujoco.mjtWarning(kind).name}: {number}" for kind, number in counted.items() if number
    )
