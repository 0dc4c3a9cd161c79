"""The complementarity problem: which modes can be solved, its conditions, and their rounding."""

import itertools

from tests.simulation.hybrid import BALANCED, state_of, system_of
from twolink.chain import Chain
from twolink.contact.states import ContactState as S
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.effects.surface import Surface
from twolink.simulation.hybrid.complementarity import (
    Law,
    conceivable,
    conditions,
    is_solvable,
    problem_at,
)
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


def test_no_element_slides_that_others_hold():
    """Link 1 rests on the stop, so that A does not turn, in whatever direction it did."""
    problem = problem_of(JointFriction((1.0, 0.0)), JointStop("A", lower=0.0), u=(1.0, 0.0))
    friction = next(i for i, e in enumerate(problem.system.elements) if not e.rigid)
    assert problem.directions[friction] == 1
    states = [S.CLOSED, S.CLOSED]
    states[friction] = S.FORWARD
    assert not is_solvable(problem, tuple(states))
    states[1 - friction] = S.OPEN
    assert is_solvable(problem, tuple(states))
