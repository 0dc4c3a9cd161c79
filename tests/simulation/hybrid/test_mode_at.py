import pytest

from tests.simulation.hybrid import BARS, mode_of, state_of, system_of
from twolink.contact.states import ContactState as S
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.formulations import FORMULATIONS
from twolink.loads import Torque
from twolink.simulation.hybrid.mode_at import solution_at

FRICTION = JointFriction((2.0, 0.0))
Q, U = (0.3, -0.2), (1.5, -0.5)


def test_friction_and_accelerations_are_those_of_the_mode():
    system = system_of(Gravity(9.81), FRICTION)
    state = state_of(system, Q, U)
    mode = mode_of(system, S.FORWARD)
    found = solution_at(system, system.pose(state.q), state, mode)
    assert found.forces[0].tangential == pytest.approx(-2.0)
    loads = (*Gravity(9.81).loads(BARS, Q, U), Torque(1, -2.0))
    expected = FORMULATIONS["kane"].equations.forward_dynamics(BARS, Q, U, loads)
    assert found.du == pytest.approx(expected, rel=1e-12)


def test_a_press_has_the_depth_of_the_state():
    """The position is 0.1 m above the floor; √δ of the state is 0.2 m^½."""
    floor = CompliantSurface((0.0, 0.2), (0.0, -1.0), "hertz", stiffness=1e4)
    system = system_of(floor)
    state = state_of(system, (0.0, 0.1))
    (own,) = state.compliant
    pressed = state._replace(compliant=(own._replace(sqrt_depth=0.2),), touching=frozenset({0}))
    mode = mode_of(system, S.CLOSED)
    found = solution_at(system, system.pose(state.q), pressed, mode)
    assert found.forces[0].normal == pytest.approx(1e4 * 0.2**3)
