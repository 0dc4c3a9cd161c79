"""When surfaces have recovered, and what they are then."""

import math

import pytest

from tests.simulation.hybrid import state_of, system_of
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.joint_stop import JointStop
from twolink.simulation.hybrid.recovery import next_recovery, recovered

# They recover at the rate of stiffness by loss, 25 1/s and 50 1/s.
SLOW = CompliantSurface((0.0, 9.0), (0.0, -1.0), "kelvin-voigt", 100.0, 4.0, name="slow")
FAST = CompliantSurface((0.0, 9.0), (0.0, -1.0), "kelvin-voigt", 200.0, 4.0, name="fast")


def dented(*depths):
    """Return a system of two surfaces and a stop, and its state with depths (m) that are left."""
    system = system_of(SLOW, JointStop("B", upper=3.0), FAST)
    state = state_of(system, (0.3, 0.2))._replace(t=2.0)
    assert state.compliant[1] is None
    own = [
        surface and surface._replace(residual_depth=depth)
        for surface, depth in zip(state.compliant, (depths[0], 0.0, depths[1]), strict=True)
    ]
    return system, state._replace(compliant=tuple(own))


def least_of(system, index):
    """Return the depth (m) below which a surface has recovered."""
    return system.scales.resolution * system.scales.sizes[index]


def test_the_next_surface_that_has_recovered_is_the_earliest():
    system, state = dented(1e-3, 1e-3)
    found = next_recovery(system, state, 9.0)
    assert found == pytest.approx(2 + math.log(2e-3 / least_of(system, 2)) / 50)
    system, state = dented(1e-3, 0.0)
    found = next_recovery(system, state, 9.0)
    assert found == pytest.approx(2 + math.log(2e-3 / least_of(system, 0)) / 25)


def test_without_a_dent_nothing_recovers():
    system, state = dented(0.0, 0.0)
    assert next_recovery(system, state, 9.0) == 9.0
    assert recovered(system, state) is state
    system = system_of(JointStop("B", upper=3.0))
    assert recovered(system, state_of(system, (0.3, 0.2))).compliant == (None,)


def test_a_surface_whose_dent_is_a_rounding_is_undeformed():
    system, state = dented(1e-3, 1e-30)
    found = recovered(system, state)
    assert found.compliant[0] == state.compliant[0]
    assert found.compliant[2].residual_depth == 0
    assert found._replace(compliant=()) == state._replace(compliant=())
