"""Whether the motions of modes differ."""

import pytest

from tests.simulation.hybrid import BALANCED, state_of, system_of
from twolink.contact.states import ContactState as S
from twolink.contact.states import EventKind as E
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_torque import JointTorque
from twolink.effects.surface import Surface
from twolink.simulation.hybrid.complementarity import Candidate, problem_at
from twolink.simulation.hybrid.dynamics import solve
from twolink.simulation.hybrid.mode import Trigger
from twolink.simulation.hybrid.noise import Zero
from twolink.simulation.hybrid.other_motions import (
    accelerates,
    departs,
    departures,
    other_motions,
    other_slides,
    pairs_in_one_place,
)

STICKS, SLIPS = (S.STICKS, S.STICKS), (S.FORWARD, S.STICKS)
HITS, BREAKS = Trigger(E.HITS, 0), Trigger(E.BREAKS, 0, 1)


def problem_of(torque):
    """Return the problem of two brakes of 2 N m at rest under a torque at A."""
    system = system_of(JointFriction((2.0, 2.0)), JointTorque((torque, 0.0)), chain=BALANCED)
    state = state_of(system, (0.3, 0.7))
    return problem_at(system, state, system.pose(state.q), (STICKS, STICKS))


def candidate_of(problem, states):
    solution = solve(problem.equations, problem.system.elements, states)
    return Candidate(states, solution, (), ())


@pytest.mark.parametrize(("torque", "differs"), [(2.0, False), (2.0 + 1e-15, False), (3.0, True)])
def test_a_slide_differs_from_rest_if_its_friction_leaves_an_acceleration(torque, differs):
    problem = problem_of(torque)
    slide = candidate_of(problem, SLIPS)
    assert other_motions(problem, [slide], (0.0, 0.0)) == ((SLIPS,) if differs else ())
    assert accelerates(problem, slide.solution.du) == differs
    rest = candidate_of(problem, STICKS)
    assert other_motions(problem, [rest], (0.0, 0.0)) == ()
    assert not accelerates(problem, rest.solution.du)


def test_a_chain_departs_by_contacts_that_open_and_slides_that_begin():
    assert departs({HITS: 2})
    assert departs({Trigger(E.STOPS, 0, 1): 1})
    assert not departs({BREAKS: 1, Trigger(E.LEAVES, 0): 0})


@pytest.mark.parametrize(("order", "leaves"), [(4, True), (Zero(1e-9), False)])
def test_a_mode_departs_by_a_higher_derivative_unless_all_are_zero(order, leaves):
    problem = problem_of(0.0)
    rest = candidate_of(problem, STICKS)
    assert departures(problem, [rest], {STICKS: {HITS: order}}) == ((STICKS,) if leaves else ())


def surfaces(*frictions):
    """Return surfaces through B of a chain at angles of zero, with some friction."""
    return [
        Surface((1.0, 0.0), (0.0, -1.0), on=("B",), friction=own, name=str(place))
        for place, own in enumerate(frictions)
    ]


def test_contacts_in_one_place_are_alike_if_their_friction_is():
    system = system_of(*surfaces(0.3, 0.3, 0.5), chain=BALANCED)
    assert pairs_in_one_place(system, alike=True) == ((0, 1),)
    assert pairs_in_one_place(system, alike=False) == ((0, 2), (1, 2))


def test_another_contact_in_one_place_may_have_the_force_of_a_slide():
    system = system_of(*surfaces(0.3, 0.5), chain=BALANCED)
    state = state_of(system, (0.0, 0.0), (1.0, 0.0))
    state = state._replace(touching=frozenset({0, 1}), sliding=(1, 1))
    options = ((S.FORWARD, S.OPEN),) * 2
    problem = problem_at(system, state, system.pose(state.q), options)
    assert list(other_slides(problem, (S.FORWARD, S.OPEN))) == [(S.OPEN, S.FORWARD)]
    assert list(other_slides(problem, (S.OPEN, S.OPEN))) == []
