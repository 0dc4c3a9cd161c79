"""The round-off of conditions: by the forces that act, and by the pose."""

import math
from dataclasses import replace

import pytest

from tests.simulation.hybrid import BALANCED, BARS, system_of
from tests.simulation.hybrid.test_complementarity import problem_of
from tests.simulation.hybrid.test_conditions import value_in
from twolink.contact.states import ContactState as S
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.simulation.hybrid import tolerances
from twolink.simulation.hybrid.complementarity import conditions
from twolink.simulation.hybrid.conditions import Condition, Law
from twolink.simulation.hybrid.dynamics import solve
from twolink.simulation.hybrid.noise import Noise, known_at, vanishes


def rounding_of_a_limit(torque, precision, t):
    """Return the round-off of the static limit of a joint under a torque."""
    problem = problem_of(JointTorque((torque, 0.0)), JointFriction((1.0, 0.0)), precision=precision)
    solution = solve(problem.equations, problem.system.elements, (S.STICKS,))
    noise = Noise(problem.system, problem.equations, (0.0, 0.0), t)
    return noise.of(Condition(Law.WITHIN_LIMIT, 0, 1), solution.du)


def test_the_rounding_of_a_condition_grows_with_the_forces_and_shrinks_with_the_precision():
    small = rounding_of_a_limit(1.0, "double", 3.0)
    assert rounding_of_a_limit(1000.0, "double", 3.0) == pytest.approx(1000 * small)
    assert rounding_of_a_limit(1.0, "long double", 3.0) < small < 1e-6


@pytest.mark.parametrize("precision", ["long double", "quadruple"])
def test_a_start_has_the_rounding_of_float64_in_every_precision(precision):
    at_start, later = (rounding_of_a_limit(1.0, precision, t) for t in (0.0, 3.0))
    assert at_start == max(later, tolerances.ROUNDED_PLACE * 2.0**-52)
    assert known_at(0.0, 2.0**-112) == 2.0**-52
    assert known_at(1e-300, 2.0**-112) == 2.0**-112


@pytest.mark.parametrize(
    ("effects", "u"),
    [((), (0.0, 3.0)), ((Gravity(9.81),), (0.0, 0.0)), ((Gravity(9.81),), (0.0, 3.0))],
    ids=["inertia", "weight", "both"],
)
@pytest.mark.parametrize("turn", [1e-16, -3e-15])
def test_forces_that_vanish_in_a_pose_keep_the_round_off_of_its_angles(effects, u, turn):
    """Link 1 hangs on a stop and link 2 hangs almost straight: all that is left is round-off."""
    stop = JointStop("A", lower=math.pi / 2)
    q = (math.pi / 2, math.pi / 2 + turn)
    problem = problem_of(*effects, stop, q=q, u=u, chain=BARS)
    for states, law in (((S.CLOSED,), Law.PUSHES), ((S.OPEN,), Law.SEPARATES)):
        solution = solve(problem.equations, problem.system.elements, states)
        condition = Condition(law, 0)
        value = float(value_in(problem, solution, condition))
        assert 10 * abs(value) < problem.noise.of(condition, solution.du) < 1e-6


def test_forces_that_cancel_keep_the_round_off_of_each():
    """A motor at A holds the weight, 14.715 N m about A: the round-off is that of both."""
    problem = problem_of(
        Gravity(9.81), JointTorque((-14.715, 0.0)), JointFriction((1.0, 0.0)), chain=BARS
    )
    condition = next(iter(conditions(problem, (S.STICKS,))))
    solution = solve(problem.equations, problem.system.elements, (S.STICKS,))
    unsure = tolerances.UNDECIDED * problem.system.scales.resolution
    assert problem.noise.of(condition, solution.du) > 2 * 14.715 * unsure


def test_a_row_of_round_off_counts_as_zero():
    system = system_of(chain=BALANCED)
    assert vanishes(system, (1e-16, -1e-15))
    assert not vanishes(system, (1e-12, 0.0))


def test_the_force_along_a_row_of_zero_has_no_bound_on_its_round_off():
    problem = problem_of(JointStop("A", lower=0.0))
    row = problem.equations.terms[0].normal._replace(row=(0.0, 0.0))
    terms = (problem.equations.terms[0]._replace(normal=row),)
    noise = Noise(problem.system, problem.equations._replace(terms=terms), (0.0, 0.0), 1.0)
    assert noise.of(Condition(Law.PUSHES, 0), (0.0, 0.0)) == math.inf


@pytest.mark.parametrize(("pose", "acts"), [(0.0, False), (0.3, True)])
def test_a_value_is_certain_where_no_force_acts_along_it(pose, acts):
    """A chain that stands on A by gravity along −x has no moment about A, with q = 0 exactly."""
    problem = problem_of(Gravity(9.81, (-1.0, 0.0)), JointStop("A", lower=pose), q=(pose, pose))
    solution = solve(problem.equations, problem.system.elements, (S.CLOSED,))
    condition = Condition(Law.PUSHES, 0)
    zero = problem.noise.zero(condition, (pose, pose), solution.du, 0.0)
    assert (zero.excess > 0) == acts
    assert zero.size > 1e3 * zero.error
    assert zero.obeys


def test_a_value_obeys_its_law_beyond_its_round_off_or_by_all_digits():
    """A motor of 1 N m drives a joint at its limit; the state is known within its truncation."""
    given = JointTorque((1.0, 0.0)), JointFriction((1.0, 0.0))
    problem = problem_of(*given, precision="quadruple")
    system = replace(problem.system, order=25)
    condition = Condition(Law.WITHIN_LIMIT, 0, 1)
    du = solve(problem.equations, problem.system.elements, (S.STICKS,)).du
    noise = Noise(system, problem.equations, (0.0, 0.0), 1.0)
    found = noise.zero(condition, (0.0, 0.0), du, 0.0)
    assert found.rounding == pytest.approx(64 * system.rounding)
    assert found.error == pytest.approx(64 * system.scales.resolution)
    assert found.obeys
    for value, obeys in ((found.error / 2, False), (2 * found.error, True), (-1e-18, False)):
        assert noise.zero(condition, (0.0, 0.0), du, value).obeys == obeys
    # A start is exact.
    start = Noise(system, problem.equations, (0.0, 0.0), 0.0)
    assert start.zero(condition, (0.0, 0.0), du, 0.0).error == found.rounding
