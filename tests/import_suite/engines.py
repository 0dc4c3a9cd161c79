"""The mass matrix that other engines make of a URDF, each by its own reader."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
JOINTS = ("shoulder", "elbow")


class RefusedError(Exception):
    """The engine does not read the file, or reads another number of joints."""


def pinocchio(text: str, states: tuple[tuple[float, float], ...]) -> list[Array]:
    """Return M at joint angles, by `buildModelFromXML` and `crba`."""
    import pinocchio as engine

    try:
        model = engine.buildModelFromXML(text)
    except ValueError as error:
        raise RefusedError(str(error)) from error
    if model.nv != 2 or not all(model.existJointName(name) for name in JOINTS):
        raise RefusedError(f"{model.nv} degrees of freedom")
    joints = [model.getJointId(name) for name in JOINTS]
    order, found = [model.idx_vs[joint] for joint in joints], []
    for theta in states:
        q = engine.neutral(model)
        for joint, angle in zip(joints, theta, strict=True):
            start, width = model.idx_qs[joint], model.nqs[joint]
            q[start : start + width] = [angle] if width == 1 else [np.cos(angle), np.sin(angle)]
        M = np.triu(engine.crba(model, model.createData(), q))
        found.append((M + np.triu(M, 1).T)[np.ix_(order, order)])
    return found


def mujoco(text: str, states: tuple[tuple[float, float], ...]) -> list[Array]:
    """Return M at joint angles, by MuJoCo's compiler and `mj_fullM`."""
    import mujoco as engine

    try:
        model = engine.MjModel.from_xml_string(text)
    except ValueError as error:
        raise RefusedError(str(error)) from error
    if model.nv != 2:
        raise RefusedError(f"{model.nv} degrees of freedom")
    data, found = engine.MjData(model), []
    order = [model.joint(name).dofadr[0] for name in JOINTS]
    for theta in states:
        data.qpos[[model.joint(name).qposadr[0] for name in JOINTS]] = theta
        engine.mj_forward(model, data)
        M = np.zeros((2, 2))
        engine.mj_fullM(model, data, M)
        found.append(M[np.ix_(order, order)])
    return found


def drake(text: str, states: tuple[tuple[float, float], ...]) -> list[Array]:
    """Return M at joint angles, by Drake's parser and `CalcMassMatrix`."""
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import MultibodyPlant

    plant: Any = MultibodyPlant(0.0)
    try:
        (model,) = Parser(plant).AddModelsFromString(text, "urdf")
        bodies = [plant.get_body(i) for i in plant.GetBodyIndices(model)]
        children = {plant.get_joint(i).child_body().name() for i in plant.GetJointIndices(model)}
        for body in bodies:
            if body.name() not in children:
                plant.WeldFrames(plant.world_frame(), body.body_frame())
        plant.Finalize()
    except RuntimeError as error:
        raise RefusedError(str(error)) from error
    if plant.num_velocities() != 2:
        raise RefusedError(f"{plant.num_velocities()} degrees of freedom")
    context, found = plant.CreateDefaultContext(), []
    joints = [plant.GetJointByName(name) for name in JOINTS]
    order = [joint.velocity_start() for joint in joints]
    for theta in states:
        for joint, angle in zip(joints, theta, strict=True):
            joint.set_angle(context, angle)
        found.append(plant.CalcMassMatrix(context)[np.ix_(order, order)])
    return found


def pybullet(text: str, states: tuple[tuple[float, float], ...]) -> list[Array]:
    """Return M at joint angles, by `calculateMassMatrix`, with the inertias of the file."""
    import pybullet as engine

    client = engine.connect(engine.DIRECT)
    try:
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "robot.urdf"
            file.write_text(text, encoding="utf-8")
            try:
                body = engine.loadURDF(
                    str(file),
                    useFixedBase=True,
                    flags=engine.URDF_USE_INERTIA_FROM_FILE,
                    physicsClientId=client,
                )
            except engine.error as error:
                raise RefusedError(str(error)) from error
        return [_pybullet_matrix(engine, client, body, theta) for theta in states]
    finally:
        engine.disconnect(client)


def _pybullet_matrix(engine: Any, client: int, body: int, theta: tuple[float, float]) -> Array:
    found = {}
    for index in range(engine.getNumJoints(body, physicsClientId=client)):
        joint = engine.getJointInfo(body, index, physicsClientId=client)
        if joint[2] != engine.JOINT_FIXED:
            found[joint[1].decode()] = len(found)
    if set(found) != set(JOINTS):
        raise RefusedError(f"the joints that move are {sorted(found)}")
    order = [found[name] for name in JOINTS]
    angles = [0.0, 0.0]
    for place, angle in zip(order, theta, strict=True):
        angles[place] = angle
    try:
        M = np.array(engine.calculateMassMatrix(body, angles, physicsClientId=client))
    except SystemError as error:
        raise RefusedError("calculateMassMatrix fails") from error
    return np.asarray(M[np.ix_(order, order)])


ENGINES: dict[str, Callable[[str, tuple[tuple[float, float], ...]], list[Array]]] = {
    "pinocchio": pinocchio,
    "mujoco": mujoco,
    "drake": drake,
    "pybullet": pybullet,
}
