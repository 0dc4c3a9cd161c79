"""URDF to MJCF by MuJoCo's own writer, and to SDF; each checked by reading it back."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from twolink.chain import Chain
from twolink.engines.contract import Array
from twolink.errors import EngineError
from twolink.lagrange import mass_matrix
from twolink.urdf import PlanarUrdf
from twolink.urdf.sdf import sdf_of

_STATES = 20


@dataclass(frozen=True)
class Conversion:
    """A converted text, the engine that read it back, and the largest relative difference of M."""

    text: str
    engine: str
    difference: float
    tolerance: float


def convert(read: PlanarUrdf, to: str) -> Conversion:
    """Return a URDF in another format, "mjcf" or "sdf", after a check in an engine that reads it.

    The mass matrix over joint angles is compared at random states: for MJCF in MuJoCo, whose
    writer keeps six digits, for SDF in Drake. Raises `EngineError` if the engine is missing,
    refuses the file, or disagrees.
    """
    made = _CONVERSIONS[to](read)
    if not made.difference <= made.tolerance:
        raise EngineError(
            f"{read.path}: {made.engine} must find the same mass matrix in the {to.upper()};"
            f" got a relative difference of {made.difference:.2g}"
        )
    return made


def _to_mjcf(read: PlanarUrdf) -> Conversion:
    try:
        import mujoco
    except ImportError as error:
        raise EngineError(_missing("MuJoCo", "mujoco")) from error
    engine: Any = mujoco
    try:
        spec = engine.MjSpec.from_string(read.xml)
        spec.compile()
        text = spec.to_xml()
        model = engine.MjModel.from_xml_string(text)
    except ValueError as error:
        raise EngineError(_refused(read, "MuJoCo", error)) from error
    data = engine.MjData(model)
    joints = [model.joint(name) for name in read.joint_names]
    order = [joint.dofadr[0] for joint in joints]

    def matrix(theta: Array) -> Array:
        data.qpos[[joint.qposadr[0] for joint in joints]] = theta
        engine.mj_forward(model, data)
        M = np.zeros((model.nv, model.nv))
        engine.mj_fullM(model, data, M)
        return M[np.ix_(order, order)]

    return Conversion(text, f"MuJoCo {engine.__version__}", _difference(read, matrix), 1e-4)


def _to_sdf(read: PlanarUrdf) -> Conversion:
    text = sdf_of(read.xml, source=read.path)
    try:
        from pydrake.multibody.parsing import Parser
        from pydrake.multibody.plant import MultibodyPlant
    except ImportError as error:
        raise EngineError(_missing("Drake", "drake")) from error
    plant: Any = MultibodyPlant(0.0)
    try:
        Parser(plant).AddModelsFromString(text, "sdf")
        plant.Finalize()
    except RuntimeError as error:
        raise EngineError(_refused(read, "Drake", error)) from error
    context = plant.CreateDefaultContext()
    joints = [plant.GetJointByName(name) for name in read.joint_names]
    order = [joint.velocity_start() for joint in joints]

    def matrix(theta: Array) -> Array:
        for joint, angle in zip(joints, theta, strict=True):
            joint.set_angle(context, angle)
        return plant.CalcMassMatrix(context)[np.ix_(order, order)]

    return Conversion(text, "Drake", _difference(read, matrix), 1e-12)


_CONVERSIONS: dict[str, Callable[[PlanarUrdf], Conversion]] = {"mjcf": _to_mjcf, "sdf": _to_sdf}

FORMATS = tuple(_CONVERSIONS)


def _difference(read: PlanarUrdf, matrix: Callable[[Array], Array]) -> float:
    """Return the largest difference of M at random joint angles, relative to its largest entry."""
    chain = Chain.from_links(read.links)
    worst = 0.0
    for theta in np.random.default_rng(1).uniform(-np.pi, np.pi, (_STATES, 2)):
        q = read.joints.absolute_angles((theta[0], theta[1]))
        ours = np.array(read.joints.joint_matrix(mass_matrix(chain, q)), dtype=float)
        worst = max(worst, float(np.abs(matrix(theta) - ours).max() / np.abs(ours).max()))
    return worst


def _missing(name: str, package: str) -> str:
    return f"{name} is not installed, and must be to check the file: pip install {package}"


def _refused(read: PlanarUrdf, name: str, error: Exception) -> str:
    reason = " ".join(str(error).split())
    return f"{read.path}: {name} refuses it ({reason}); see `twolink urdf repair`"
