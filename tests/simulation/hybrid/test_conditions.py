"""The values of conditions, in closed form."""

import pytest

from tests.simulation.hybrid.test_complementarity import problem_of
from twolink.contact.states import ContactState as S
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_torque import JointTorque
from twolink.simulation.hybrid.complementarity import conditions
from twolink.simulation.hybrid.conditions import Condition, Law, value_of
from twolink.simulation.hybrid.dynamics import solve


def value_in(problem, solution, condition):
    """Return the value of a condition in a solved mode."""
    forces = solution.forces[condition.number]
    return value_of(problem.system, problem.equations, condition, solution.du, forces)


@pytest.mark.parametrize(("torque", "margins"), [(0.4, (1.6, 2.4)), (-2.5, (4.5, -0.5))])
def test_a_static_limit_is_violated_by_its_excess(torque, margins):
    """Held against a torque τ, friction of the limit 2 is −τ: the margins are 2 ∓ τ."""
    problem = problem_of(JointTorque((torque, 0.0)), JointFriction((1.0, 0.0), (2.0, 0.0)))
    solution = solve(problem.equations, problem.system.elements, (S.STICKS,))
    limits = list(conditions(problem, (S.STICKS,)))
    assert [limit.sense for limit in limits] == [1, -1]
    found = [value_in(problem, solution, limit) for limit in limits]
    assert found == pytest.approx(margins, rel=1e-14)


def test_an_element_that_begins_to_slide_is_judged_by_its_acceleration():
    """A torque of 3 N m against friction of 1 N m turns an inertia of 3 kg m²."""
    problem = problem_of(JointTorque((3.0, 0.0)), JointFriction((1.0, 0.0)))
    solution = solve(problem.equations, problem.system.elements, (S.FORWARD,))
    condition = Condition(Law.ACCELERATES, 0, 1)
    assert condition in list(conditions(problem, (S.FORWARD,)))
    value = value_in(problem, solution, condition)
    assert value == pytest.approx(2 / 3, rel=1e-14)
