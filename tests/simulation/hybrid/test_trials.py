"""The trial of modes: as if each were solved by itself."""

import random
from functools import partial
from itertools import product

import pytest

from tests.campaign.draw import draw_scene
from tests.simulation.hybrid import BALANCED, state_of, system_of
from tests.simulation.hybrid.test_complementarity import problem_of
from tests.simulation.hybrid.test_conditions import value_in
from twolink.contact.states import ContactState as S
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_torque import JointTorque
from twolink.simulation.hybrid import complementarity, trials
from twolink.simulation.hybrid.complementarity import (
    conceivable,
    conditions,
    is_solvable,
    problem_at,
)
from twolink.simulation.hybrid.dynamics import accelerated, is_fixed, solve
from twolink.simulation.hybrid.pose import Pose
from twolink.simulation.hybrid.trials import Trials


def by_definition(problem, with_pressed):
    """Return the modes that violate no condition, each solved and checked by itself."""
    found = {}
    for mode in conceivable(problem, with_pressed):
        if not is_solvable(problem, mode.states):
            continue
        solution = solve(problem.equations, problem.system.elements, mode.states)
        every = {c: float(value_in(problem, solution, c)) for c in conditions(problem, mode.states)}
        noise = {c: problem.noise.of(c, solution.du) for c in every}
        if all(value >= -noise[c] for c, value in every.items()):
            decided = tuple(c for c, value in every.items() if value > noise[c])
            found[mode.states] = solution, decided
    return found


def problems(seed):
    """Yield problems of the elements of random scenes, at random states in contact."""
    dice = random.Random(seed)
    for index in range(100):
        scene = draw_scene(seed, index)
        system = system_of(*scene.effects, chain=scene.moving_chain)
        count = len(system.elements)
        if not 1 < count < 7:
            continue
        state = state_of(system, scene.q, scene.u)
        touching = frozenset(
            i for i, each in enumerate(system.elements) if each.rigid and dice.random() < 0.7
        )
        sliding = tuple(dice.choice((-1, 0, 1)) if each.rough else 0 for each in system.elements)
        state = state._replace(touching=touching, sliding=sliding)
        options = tuple(
            each.options(i in touching, sliding[i]) for i, each in enumerate(system.elements)
        )
        pose = Pose(system.chain, system.formulation, state.q)
        yield problem_at(system, state, pose, options)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_the_candidates_are_the_modes_that_violate_no_condition(seed):
    tried = several = 0
    for problem in problems(seed):
        shared = Trials(problem)
        for with_pressed in (False, True):
            expected = by_definition(problem, with_pressed)
            found = list(shared.candidates(with_pressed, sticking_first=False))
            assert [c.states for c in found] == list(expected)
            for candidate in found:
                solution, decided = expected[candidate.states]
                assert candidate.solution == solution
                assert candidate.decided == decided
            tried += len(conceivable(problem, with_pressed))
            several += len(expected) > 0
    assert tried > 300
    assert several > 20


@pytest.mark.slow
def test_the_conceivable_modes_are_those_whose_slides_are_free_and_constraints_few():
    """The elements' holds are chosen first, and the states after them; here all states at once."""
    count = 0
    for problem in problems(3):
        found = [mode.states for flag in (False, True) for mode in conceivable(problem, flag)]
        assert len(found) == len(set(found))
        assert set(found) == set(filter(partial(_is_free, problem), product(*problem.options)))
        count += len(found)
    assert count > 300


def _is_free(problem, states):
    elements, chain = problem.system.elements, problem.system.scene_chain
    held = [c for e, own in zip(elements, states, strict=True) for c in e.holds(own)]
    rests = (S.PRESSED_FORWARD, S.PRESSED_BACKWARD, S.CLOSED)
    return len(held) <= 2 and all(
        own.slips != is_fixed(element.tangent, held, chain)
        for element, own in zip(elements, states, strict=True)
        if element.tangent is not None and (own.slips or own in rests)
    )


def test_a_mode_is_solved_once(monkeypatch):
    """The passes with and without the preference for sticking have the same modes."""
    solved = []

    def counted(equations, shares):
        solved.append(shares)
        return accelerated(equations, shares)

    monkeypatch.setattr(trials, "accelerated", counted)
    problem = problem_of(JointFriction((1.0, 2.0)), JointTorque((1.5, 0.5)))
    shared = Trials(problem)
    passes = [[c.states for c in shared.candidates(False, first)] for first in (True, False)]
    assert 0 < len(solved) <= len(conceivable(problem, False)) == shared.count
    assert passes[1] == list(by_definition(problem, False))


def test_an_element_that_could_stick_does_not_begin_to_slide_unless_asked():
    """1.5 N m are below the static limit of 2 N m, and above the kinetic friction of 1 N m."""
    torque, friction = JointTorque((1.5, 0.0)), JointFriction((1.0, 0.0), (2.0, 0.0))
    shared = Trials(problem_of(torque, friction, chain=BALANCED))
    assert [c.states for c in shared.candidates(False)] == [(S.STICKS,)]
    modes = [c.states for c in shared.candidates(False, sticking_first=False)]
    assert modes == [(S.STICKS,), (S.FORWARD,)]
    still = [c.states for c in shared.candidates(False, sticking_first=False, beginning=False)]
    assert still == [(S.STICKS,)]


def test_modes_with_the_same_constraints_are_checked_for_independence_once(monkeypatch):
    asked = []
    whole = complementarity.is_independent

    def is_independent(problem, shares):
        asked.append(shares)
        return whole(problem, shares)

    monkeypatch.setattr(trials, "is_independent", is_independent)
    problem = problem_of(JointFriction((1.0, 1.0)), JointTorque((0.5, 0.2)))
    list(Trials(problem).candidates(False, sticking_first=False))
    assert len(conceivable(problem, False)) == 9
    # None, one of two joints, or both are held.
    assert len(asked) == 4
