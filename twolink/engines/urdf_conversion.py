"""URDF to MJCF by MuJoCo's own writer, and to SDF; each checked by reading it back."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from twolink.chain import Chain
from twolink.effects.gravity import Gravity
from twolink.engines.contract import Array
from twolink.errors import EngineError
from twolink.lagrange import inverse_dynamics, mass_matrix
from twolink.urdf import PlanarUrdf
from twolink.urdf.sdf import sdf_of
from twolink.urdf.spatial import norm

_STATES = 20

# Of joint angles and speeds, M (kg m²) and the joint torques at rest in it: C u − Q (N m).
Dynamics = Callable[[Array, Array], tuple[Array, Array]]


@dataclass(frozen=True)
class Conversion:
    """A converted text, the engine that read it back, and the largest relative differences.

    `difference` is that of the mass matrix, relative to its largest entry, and `of_forces` that of
    the gravity and velocity terms, relative to their size in any pose.
    """

    text: str
    engine: str
    difference: float
    of_forces: float
    tolerance: float


def convert(read: PlanarUrdf, to: str) -> Conversion:
    """Return a URDF in another format, "mjcf" or "sdf", after a check in an engine that reads it.

    The mass matrix over joint angles, and the gravity and velocity terms, are compared at random
    states: for MJCF in MuJoCo, whose writer keeps six digits, for SDF in Drake. Raises
    `EngineError` if the engine is missing, refuses the file, or disagrees.
    """
    made = _CONVERSIONS[to](read)
    for what, difference in (
        ("mass matrix", made.difference),
        ("gravity and velocity terms", made.of_forces),
    ):
        if not difference <= made.tolerance:
            raise EngineError(
                f"{read.path}: {made.engine} must find the same {what} in the {to.upper()};"
                f" got a relative difference of {difference:.2g}"
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
    model.opt.gravity[:] = read.world_gravity
    data = engine.MjData(model)
    joints = [model.joint(name) for name in read.joint_names]
    order = [joint.dofadr[0] for joint in joints]

    def dynamics(theta: Array, omega: Array) -> tuple[Array, Array]:
        data.qpos[[joint.qposadr[0] for joint in joints]] = theta
        data.qvel[order] = omega
        engine.mj_forward(model, data)
        M = np.zeros((model.nv, model.nv))
        engine.mj_fullM(model, data, M)
        return M[np.ix_(order, order)], data.qfrc_bias[order]

    return Conversion(text, f"MuJoCo {engine.__version__}", *_differences(read, dynamics), 1e-4)


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
        plant.mutable_gravity_field().set_gravity_vector(read.world_gravity)
        plant.Finalize()
    except RuntimeError as error:
        raise EngineError(_refused(read, "Drake", error)) from error
    context = plant.CreateDefaultContext()
    joints = [plant.GetJointByName(name) for name in read.joint_names]
    order = [joint.velocity_start() for joint in joints]

    def dynamics(theta: Array, omega: Array) -> tuple[Array, Array]:
        for joint, angle, speed in zip(joints, theta, omega, strict=True):
            joint.set_angle(context, angle)
            joint.set_angular_rate(context, speed)
        M = plant.CalcMassMatrix(context)[np.ix_(order, order)]
        Q = plant.CalcGravityGeneralizedForces(context)
        return M, (plant.CalcBiasTerm(context) - Q)[order]

    return Conversion(text, "Drake", *_differences(read, dynamics), 1e-12)


_CONVERSIONS: dict[str, Callable[[PlanarUrdf], Conversion]] = {"mjcf": _to_mjcf, "sdf": _to_sdf}

FORMATS = tuple(_CONVERSIONS)


def _differences(read: PlanarUrdf, dynamics: Dynamics) -> tuple[float, float]:
    """Return the largest relative differences, of M and of C u − Q, at random states."""
    chain = Chain.from_links(read.links)
    worst = np.zeros(2)
    draw = np.random.default_rng(1)
    for theta in draw.uniform(-np.pi, np.pi, (_STATES, 2)):
        omega = draw.uniform(-1.0, 1.0, 2)
        M, forces = _ours(read, chain, theta, omega)
        found = dynamics(theta, omega)
        size = np.abs(M).max(), np.abs(M).max() + _weight(read)
        apart = np.abs(found[0] - M).max(), np.abs(found[1] - forces).max()
        worst = np.maximum(worst, np.array(apart) / size)
    return float(worst[0]), float(worst[1])


def _ours(read: PlanarUrdf, chain: Chain, theta: Array, omega: Array) -> tuple[Array, Array]:
    """Return M (kg m²) and C u − Q (N m) over joint angles, by Lagrange's equations."""
    q = read.joints.absolute_angles((theta[0], theta[1]))
    u = read.joints.absolute_speeds((omega[0], omega[1]))
    loads = Gravity(read.gravity).loads(chain, q, u)
    forces = inverse_dynamics(chain, q, u, (0.0, 0.0), loads)
    M = read.joints.joint_matrix(mass_matrix(chain, q))
    return np.array(M, dtype=float), np.array(read.joints.joint_forces(forces), dtype=float)


def _weight(read: PlanarUrdf) -> float:
    """Return the size of gravity's torque in any pose (N m), were all of it in the plane."""
    one, two = read.links
    arm1, arm2 = (float(np.hypot(*link.centre)) for link in (one, two))
    return norm(read.world_gravity) * (one.mass * arm1 + two.mass * (one.length + arm2))


def _missing(name: str, package: str) -> str:
    return f"{name} is not installed, and must be to check the file: pip install {package}"


def _refused(read: PlanarUrdf, name: str, error: Exception) -> str:
    reason = " ".join(str(error).split())
    return f"{read.path}: {name} refuses it ({reason}); see `twolink urdf repair`"
