"""Contacts that are approached, and the slides after their impacts."""

import math

import pytest

from tests.simulation.hybrid import BALANCED, state_of, system_of
from twolink import lagrange
from twolink.contact.force_laws import Phase, PlasticState
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.simulation.hybrid.collision import (
    direction_of,
    nearby,
    sliding_after,
    surfaces_after,
)
from twolink.simulation.hybrid.pose import Pose

ONTO = JointTorque((-6.0, 0.0))
"""Link 1 turns to the stop with −2 rad/s²."""


def stopped_chain(*more, restitution=0.5, **options):
    stop = JointStop("A", lower=0.0, restitution=restitution)
    return system_of(ONTO, stop, *more, chain=BALANCED, **options)


def test_contacts_are_nearby_within_the_rounding_of_their_place():
    system = stopped_chain(JointStop("B", upper=1.0))
    state = state_of(system, (0.5, 0.5))
    assert nearby(system, state) == []
    assert nearby(system, state._replace(gaps=(1e-15, 0.5))) == [0]
    assert nearby(system, state._replace(gaps=(1e-15, -1e-15))) == [0, 1]
    assert nearby(system, state._replace(gaps=(1e-13, 0.5))) == []


def test_the_direction_of_a_slide_is_the_sign_of_its_speed_beyond_rounding():
    system = system_of(JointFriction((1.0, 1.0)))
    pose = Pose(system.chain, lagrange, (0.3, 0.2))
    assert sliding_after(system, pose, (5.0, 5.0), (1.0, 3.0)) == (1, 1)
    assert sliding_after(system, pose, (5.0, 5.0), (-1.0, -3.0)) == (-1, -1)
    assert sliding_after(system, pose, (5.0, 5.0), (1.0, 1.0 + 4e-16)) == (1, 0)
    assert direction_of(system, (1.0, 0.0), (5.0, 0.0), (1e-16, 0.0)) == 0
    assert direction_of(system, (1.0, 0.0), (1e-9, 0.0), (1e-16, 0.0)) == 1


@pytest.mark.parametrize(
    ("speed", "root", "touches"), [(1.0, "zero", True), (0.0, "least", True), (-1.0, None, False)]
)
def test_a_press_that_an_impact_elsewhere_stops_begins_at_rest_or_ends(speed, root, touches):
    """B has just met a Hertz surface below it as link 2 strikes its stop."""
    surface = CompliantSurface((0.0, 0.0), (0.0, -1.0), "hertz", 100.0, on=("B",))
    system = system_of(surface, JointStop("B", upper=0.0), chain=BALANCED)
    state = state_of(system, (0.0, -1.0), (1.0, 0.0))
    (own, _) = state.compliant
    assert own.sqrt_depth == 0
    struck = surfaces_after(
        system, state._replace(u=(speed, 0.0)), Pose(system.chain, lagrange, (0.0, 0.0))
    )
    roots = {"zero": 0, "least": system.least_root, None: None}
    assert struck.compliant[0].sqrt_depth == roots[root]
    assert struck.touching == ({0} if touches else frozenset())


@pytest.mark.parametrize(
    ("phase", "speed", "after"),
    [
        (Phase.DENTED, 1.0, Phase.DENTED),
        (Phase.DENTED, -1.0, Phase.DENTED),
        (Phase.FLOWS, 1.0, Phase.FLOWS),
        (Phase.FLOWS, -1.0, Phase.DENTED),
    ],
)
def test_an_impact_elsewhere_turns_compression_into_restitution(phase, speed, after):
    """B is pressed into steel by a positive speed of link 1."""
    steel = CompliantSurface(
        (0.0, 0.0), (0.0, -1.0), "elasto-plastic", on=("B",), radius=0.02,
        modulus=(2e11, 2e11), poisson=(0.3, 0.3), strength=(3e8, 3e8),
    )  # fmt: skip
    system = system_of(steel, chain=BALANCED)
    state = state_of(system, (1e-4, 0.0))
    own = state.compliant[0]
    dent = PlasticState(phase) if phase is Phase.FLOWS else PlasticState(phase, 1e9, 5e-5, 2e-4)
    own = own._replace(sqrt_depth=math.sqrt(1e-4 - dent.residual), plastic=dent)
    state = state._replace(u=(speed, 0.0), compliant=(own,), touching=frozenset({0}))
    struck = surfaces_after(system, state, system.pose(state.q))
    assert struck.compliant[0].plastic.phase is after
    depth = struck.compliant[0].sqrt_depth ** 2 + struck.compliant[0].plastic.residual
    assert depth == pytest.approx(1e-4)
