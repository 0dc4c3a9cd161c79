"""The complementarity problem: which modes can be solved, its conditions, and their rounding."""

import itertools
import math

import pytest

from tests.simulation.hybrid import BALANCED, BARS, state_of, system_of
from twolink.chain import Chain
from twolink.contact.states import ContactState as S
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.effects.surface import Surface
from twolink.simulation.hybrid import tolerances
from twolink.simulation.hybrid.complementarity import (
    Condition,
    Law,
    Noise,
    conceivable,
    conditions,
    is_solvable,
    problem_at,
    value_of,
    vanishes,
)
from twolink.simulation.hybrid.dynamics import solve
from twolink.simulation.hybrid.pose import Pose


def problem_of(*effects, q=(0.0, 0.0), u=(0.0, 0.0), chain=BALANCED, **more):
    system = system_of(*effects, chain=chain, **more)
    state = state_of(system, q, u)
    pose = Pose(system.chain, system.formulation, state.q)
    options = tuple(
        element.options(i in state.touching, state.sliding[i])
        for i, element in enumerate(system.elements)
    )
    return problem_at(system, state, pose, options)


def value_in(problem, solution, condition):
    """Return the value of a condition in a solved mode."""
    forces = solution.forces[condition.number]
    return value_of(problem.system, problem.equations, condition, solution.du, forces)


def test_a_stop_and_the_friction_of_its_joint_cannot_both_hold_it():
    problem = problem_of(JointStop("A", lower=0.0), JointFriction((1.0, 0.0)))
    by_name = dict(enumerate(element.name for element in problem.system.elements))
    held = {(S.CLOSED, S.STICKS), (S.STICKS, S.CLOSED)}
    assert len(by_name) == 2
    for states in ((S.CLOSED, S.STICKS), (S.OPEN, S.STICKS)):
        ordered = states if problem.system.elements[0].rigid else states[::-1]
        assert is_solvable(problem, ordered) == (states not in held)


def test_an_element_held_by_others_does_not_begin_to_slide():
    problem = problem_of(JointFriction((1.0, 0.0)), JointStop("A", lower=0.0))
    friction = next(i for i, e in enumerate(problem.system.elements) if not e.rigid)
    states = [S.CLOSED, S.CLOSED]
    states[friction] = S.FORWARD
    assert not is_solvable(problem, tuple(states))
    states[friction] = S.PRESSED_FORWARD
    assert is_solvable(problem, tuple(states))


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


def test_the_rounding_of_a_condition_grows_with_the_forces_and_shrinks_with_the_precision():
    condition = Condition(Law.WITHIN_LIMIT, 0, 1)
    found = {}
    for precision in ("double", "long double"):
        for torque in (1.0, 1000.0):
            problem = problem_of(
                JointTorque((torque, 0.0)), JointFriction((1.0, 0.0)), precision=precision
            )
            solution = solve(problem.equations, problem.system.elements, (S.STICKS,))
            found[precision, torque] = problem.noise.of(condition, solution.du)
    assert found["double", 1000.0] == pytest.approx(1000 * found["double", 1.0])
    assert found["long double", 1.0] < found["double", 1.0] < 1e-6


def test_a_contact_that_opens_beside_one_of_the_same_point_has_no_condition():
    """The mass centre of link 2 is at D: while one of them slides, the other does not move away."""
    floor = Surface((0.0, 0.0), (0.0, -1.0), on=("C2", "D", "B"), friction=0.3)
    chain = Chain.point_masses((1.0, 1.0), (1.0, 1.0))
    problem = problem_of(Gravity(9.81), floor, u=(0.0, 0.0), chain=chain)
    slides = (S.FORWARD, S.OPEN, S.OPEN)
    laws = [(c.law, c.number) for c in conditions(problem, slides)]
    assert (Law.SEPARATES, 2) in laws
    assert (Law.SEPARATES, 1) not in laws
    # At rest no contact separates.
    assert all(c.law is not Law.SEPARATES for c in conditions(problem, (S.STICKS, S.OPEN, S.OPEN)))


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
    unsure = tolerances.UNDECIDED * problem.system.resolution
    assert problem.noise.of(condition, solution.du) > 2 * 14.715 * unsure


def test_a_row_of_round_off_counts_as_zero():
    system = system_of(chain=BALANCED)
    assert vanishes(system, (1e-16, -1e-15))
    assert not vanishes(system, (1e-12, 0.0))


def test_modes_are_split_by_saturated_friction_and_know_their_conditions():
    problem = problem_of(JointFriction((1.0, 1.0)), JointStop("A", lower=0.0))
    pressed = [mode for mode in conceivable(problem, True)]
    others = [mode for mode in conceivable(problem, False)]
    assert pressed
    assert others
    assert all(any(state.pressed for state in mode.states) for mode in pressed)
    assert not any(any(state.pressed for state in mode.states) for mode in others)
    for mode in (*pressed, *others):
        taken = [own[place] for own, place in zip(problem.options, mode.places, strict=True)]
        assert mode.states == tuple(taken)
        assert mode.conditions == tuple(conditions(problem, mode.states))
        held = [len(e.holds(s)) for e, s in zip(problem.system.elements, mode.states, strict=True)]
        assert [b - a for a, b in itertools.pairwise(mode.firsts)] == held
        assert [index for index, _ in mode.bound] == [i for i, count in enumerate(held) if count]


def test_no_force_known_leaves_a_row_of_zero_without_a_bound_on_its_round_off():
    problem = problem_of(JointStop("A", lower=0.0))
    row = problem.equations.terms[0].normal._replace(row=(0.0, 0.0))
    terms = (problem.equations.terms[0]._replace(normal=row),)
    noise = Noise(problem.system, problem.equations._replace(terms=terms), (0.0, 0.0))
    assert noise.of(Condition(Law.PUSHES, 0), (0.0, 0.0)) == math.inf
