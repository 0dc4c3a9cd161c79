"""Contacts that are approached, and the slides after their impacts."""

from dataclasses import replace

from tests.simulation.hybrid import BALANCED, state_of, system_of
from twolink import lagrange
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.simulation.hybrid.collision import direction_of, nearby, sliding_after
from twolink.simulation.hybrid.dynamics import Pose

ONTO = JointTorque((-6.0, 0.0))
"""Link 1 turns to the stop with −2 rad/s²."""


def stopped_chain(*more, restitution=0.5, **options):
    stop = JointStop("A", lower=0.0, restitution=restitution)
    return system_of(ONTO, stop, *more, chain=BALANCED, **options)


def test_contacts_are_nearby_within_the_rounding_of_their_place():
    system = stopped_chain(JointStop("B", upper=1.0))
    state = state_of(system, (0.5, 0.5))
    assert nearby(system, state) == []
    assert nearby(system, replace(state, gaps=(1e-15, 0.5))) == [0]
    assert nearby(system, replace(state, gaps=(1e-15, -1e-15))) == [0, 1]
    assert nearby(system, replace(state, gaps=(1e-13, 0.5))) == []


def test_the_direction_of_a_slide_is_the_sign_of_its_speed_beyond_rounding():
    system = system_of(JointFriction((1.0, 1.0)))
    pose = Pose(system.chain, lagrange, (0.3, 0.2))
    assert sliding_after(system, pose, (5.0, 5.0), (1.0, 3.0)) == (1, 1)
    assert sliding_after(system, pose, (5.0, 5.0), (-1.0, -3.0)) == (-1, -1)
    assert sliding_after(system, pose, (5.0, 5.0), (1.0, 1.0 + 4e-16)) == (1, 0)
    assert direction_of(system, (1.0, 0.0), (5.0, 0.0), (1e-16, 0.0)) == 0
    assert direction_of(system, (1.0, 0.0), (1e-9, 0.0), (1e-16, 0.0)) == 1
