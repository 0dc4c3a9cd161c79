"""Forces of stops, surfaces and friction are the residual of Pinocchio's RNEA at all times."""

import numpy as np
import pytest

from tests.verification.chains import GENERAL
from twolink import kane
from twolink.coordinates import JointConvention
from twolink.effects.end_force import EndForce
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.effects.sampled_torque import SampledTorque
from twolink.effects.surface import Surface
from twolink.engines.pinocchio_chain import PinocchioChain
from twolink.loads import Force
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.urdf import parse_planar_urdf

CASES = {
    "stops": (JointStop("A", upper=0.9, restitution=0.4), JointStop("B", lower=-0.9, upper=0.5)),
    "end force that sticks": (EndForce(-6.0, 0.5),),
    "rough floor": (Surface((0.0, 0.9), (0.0, -1.0), friction=0.3, restitution=0.3),),
    "smooth wall on both": (Surface((-0.1, 0.0), (1.0, 0.0), on=("B", "D"), restitution=0.2),),
    "friction and a stop": (JointFriction((0.8, 0.3)), JointStop("B", upper=0.5)),
    "samples": (SampledTorque((0.0, 0.5, 1.1), (1.0, -2.0, 0.5), (0.2, 0.3, -0.4), "hold"),),
}


@pytest.mark.slow
@pytest.mark.parametrize("formulation", ["lagrange", "kane"])
@pytest.mark.parametrize("name", CASES)
def test_inverse_dynamics_of_pinocchio_are_the_sum_of_all_loads(name, formulation):
    """RNEA at our accelerations is the sum of all loads, each through Pinocchio's own Jacobian."""
    scene = Scene(
        chain=GENERAL, q=(0.1, 0.3), u=(0.4, -0.2), duration=3.0,
        effects=(Gravity(), *CASES[name]), accuracy=1e-10,
    )  # fmt: skip
    trajectory = simulate(scene, formulation=formulation, samples=301)
    if name != "samples":
        assert len(trajectory.events) > 1
    engine = PinocchioChain(parse_planar_urdf(GENERAL.to_urdf(), gravity=(0.0, 0.0, 0.0)))
    joints = JointConvention()
    for now, loads, du in trajectory.mode_forces.by_mode(trajectory.samples):
        q, u = tuple(trajectory.q[:, now]), tuple(trajectory.u[:, now])
        angles, speeds, rates = (
            np.array(pair)
            for pair in (
                joints.joint_angles(q), joints.joint_speeds(u), joints.joint_speeds(tuple(du))
            )
        )  # fmt: skip
        wanted = np.zeros_like(angles)
        torques = tuple(load for load in loads if not isinstance(load, Force))
        moments = kane.generalized_active_force(GENERAL, q, torques)
        wanted += np.array(np.broadcast_arrays(*joints.joint_forces(moments), angles[0])[:2])
        for force in (load for load in loads if isinstance(load, Force)):
            components = np.array(np.broadcast_arrays(*force.components, angles[0])[:2])
            if force.point == GENERAL.B:
                wanted[0] += components[1] * GENERAL.L1 * np.cos(q[0])
                wanted[0] -= components[0] * GENERAL.L1 * np.sin(q[0])
                continue
            point = {GENERAL.C1: "C1", GENERAL.C2: "C2", GENERAL.D: "D"}[force.point]
            wanted += np.einsum("pcn,pn->cn", engine.jacobian(point, angles), components)
        found = engine.inverse_dynamics(angles, speeds, rates, np.zeros_like(angles))
        size = 1 + np.abs(wanted).max()
        assert np.abs(found - wanted).max() <= 1e-11 * size
