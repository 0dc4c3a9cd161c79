"""Contact elements, state by state: constraints, known forces, forces and events, by hand."""

import math

import pytest

from twolink.contact.coordinates import JointCoordinate, PointCoordinate
from twolink.contact.elastoplastic import ElastoPlastic, Material
from twolink.contact.elements import (
    CompliantContact,
    Constraint,
    ContactForces,
    DryFriction,
    ElementTerms,
    RigidContact,
    Terms,
)
from twolink.contact.force_laws import Hertz, KelvinVoigt, Phase, PlasticState
from twolink.contact.states import ContactState as S
from twolink.contact.states import EventKind as E

UP, ALONG = PointCoordinate("D", (0.0, -1.0)), PointCoordinate("D", (1.0, 0.0))
AT_B = JointCoordinate("B")

DRY = DryFriction("B", AT_B, 2.0, 3.0)
SMOOTH = RigidContact("D on floor", UP, 0.5, restitution=0.4)
ROUGH = RigidContact("D on floor", UP, 0.5, 0.4, tangent=ALONG, kinetic=0.25, static=0.5)
CUSHION = CompliantContact("D on cushion", UP, 0.5, KelvinVoigt(100.0))
GRIPPING = CompliantContact("D on cushion", UP, 0.5, Hertz(100.0), ALONG, 0.25, 0.5)
MATERIAL = Material(modulus=2e11, radius=0.01, strength=1e9, poisson=0.3)
YIELDING = CompliantContact(
    "D on steel", UP, 0.5, Hertz(MATERIAL.stiffness), memory=ElastoPlastic(MATERIAL)
)

NORMAL, TANGENT = Terms((3.0, 5.0), 7.0), Terms((-2.0, 11.0), 13.0)
OF_DRY = ElementTerms(None, TANGENT, 0)
OF_SMOOTH, OF_ROUGH = ElementTerms(NORMAL, None, 0), ElementTerms(NORMAL, TANGENT, 0)
PRESSED_SMOOTH, PRESSED_ROUGH = ElementTerms(NORMAL, None, 8.0), ElementTerms(NORMAL, TANGENT, 8.0)

AT_REST = (S.STICKS, S.FORWARD, S.BACKWARD, S.PRESSED_FORWARD, S.PRESSED_BACKWARD)
NORMAL_HELD = Constraint((3.0, 5.0), 7.0, (3.0, 5.0))
TANGENT_HELD = Constraint((-2.0, 11.0), 13.0, (-2.0, 11.0))


@pytest.mark.parametrize(
    ("element", "terms", "state", "constraints", "applied"),
    [
        (DRY, OF_DRY, S.STICKS, (TANGENT_HELD,), ()),
        (DRY, OF_DRY, S.FORWARD, (), ((4.0, -22.0),)),
        (DRY, OF_DRY, S.BACKWARD, (), ((-4.0, 22.0),)),
        (DRY, OF_DRY, S.PRESSED_FORWARD, (), ((6.0, -33.0),)),
        (DRY, OF_DRY, S.PRESSED_BACKWARD, (), ((-6.0, 33.0),)),
        (SMOOTH, OF_SMOOTH, S.OPEN, (), ()),
        (SMOOTH, OF_SMOOTH, S.CLOSED, (NORMAL_HELD,), ()),
        (ROUGH, OF_ROUGH, S.OPEN, (), ()),
        (ROUGH, OF_ROUGH, S.CLOSED, (NORMAL_HELD,), ()),
        (ROUGH, OF_ROUGH, S.STICKS, (NORMAL_HELD, TANGENT_HELD), ()),
        # A slide forward: the force along n has −μ of it along t.
        (ROUGH, OF_ROUGH, S.FORWARD, (Constraint((3.0, 5.0), 7.0, (3.5, 2.25)),), ()),
        (ROUGH, OF_ROUGH, S.BACKWARD, (Constraint((3.0, 5.0), 7.0, (2.5, 7.75)),), ()),
        (ROUGH, OF_ROUGH, S.PRESSED_FORWARD, (Constraint((3.0, 5.0), 7.0, (4.0, -0.5)),), ()),
        (CUSHION, PRESSED_SMOOTH, S.OPEN, (), ()),
        (CUSHION, PRESSED_SMOOTH, S.CLOSED, (), ((24.0, 40.0),)),
        (GRIPPING, PRESSED_ROUGH, S.STICKS, (TANGENT_HELD,), ((24.0, 40.0),)),
        (GRIPPING, PRESSED_ROUGH, S.FORWARD, (), ((24.0, 40.0), (4.0, -22.0))),
        (GRIPPING, PRESSED_ROUGH, S.PRESSED_BACKWARD, (), ((24.0, 40.0), (-8.0, 44.0))),
        (GRIPPING, PRESSED_ROUGH, S.CLOSED, (), ((24.0, 40.0),)),
    ],
)
def test_a_state_has_its_constraints_and_known_forces(element, terms, state, constraints, applied):
    assert element.constraints(state, terms) == constraints
    assert element.applied(state, terms) == applied


@pytest.mark.parametrize(
    ("element", "terms", "state", "multipliers", "forces"),
    [
        (DRY, OF_DRY, S.STICKS, (1.5,), (0, 1.5)),
        (DRY, OF_DRY, S.FORWARD, (), (0, -2.0)),
        (DRY, OF_DRY, S.BACKWARD, (), (0, 2.0)),
        (DRY, OF_DRY, S.PRESSED_FORWARD, (), (0, -3.0)),
        (SMOOTH, OF_SMOOTH, S.OPEN, (), (0, 0)),
        (SMOOTH, OF_SMOOTH, S.CLOSED, (6.0,), (6.0, 0)),
        (ROUGH, OF_ROUGH, S.STICKS, (6.0, 2.0), (6.0, 2.0)),
        (ROUGH, OF_ROUGH, S.FORWARD, (6.0,), (6.0, -1.5)),
        (ROUGH, OF_ROUGH, S.PRESSED_BACKWARD, (6.0,), (6.0, 3.0)),
        (CUSHION, PRESSED_SMOOTH, S.CLOSED, (), (8.0, 0)),
        (GRIPPING, PRESSED_ROUGH, S.OPEN, (), (0, 0)),
        (GRIPPING, PRESSED_ROUGH, S.STICKS, (3.5,), (8.0, 3.5)),
        (GRIPPING, PRESSED_ROUGH, S.BACKWARD, (), (8.0, 2.0)),
    ],
)
def test_a_state_has_its_forces(element, terms, state, multipliers, forces):
    assert element.forces(state, terms, multipliers) == ContactForces(*forces)


@pytest.mark.parametrize(
    ("element", "state", "held"),
    [
        (DRY, S.STICKS, (AT_B,)),
        (DRY, S.FORWARD, ()),
        (DRY, S.PRESSED_FORWARD, ()),
        (SMOOTH, S.CLOSED, (UP,)),
        (SMOOTH, S.OPEN, ()),
        (ROUGH, S.STICKS, (UP, ALONG)),
        (ROUGH, S.FORWARD, (UP,)),
        (ROUGH, S.PRESSED_BACKWARD, (UP,)),
        (CUSHION, S.CLOSED, ()),
        (GRIPPING, S.STICKS, (ALONG,)),
        (GRIPPING, S.FORWARD, ()),
    ],
)
def test_a_state_holds_the_coordinates_that_it_constrains(element, state, held):
    assert element.holds(state) == held


@pytest.mark.parametrize(
    ("element", "touching", "direction", "options"),
    [
        (DRY, False, 0, AT_REST),
        (DRY, False, 1, (S.FORWARD,)),
        (DRY, False, -1, (S.BACKWARD,)),
        (SMOOTH, False, 0, (S.OPEN,)),
        (SMOOTH, True, 0, (S.CLOSED, S.OPEN)),
        (ROUGH, False, 1, (S.OPEN,)),
        (ROUGH, True, 1, (S.FORWARD, S.OPEN)),
        (ROUGH, True, -1, (S.BACKWARD, S.OPEN)),
        (ROUGH, True, 0, (*AT_REST, S.CLOSED, S.OPEN)),
        (CUSHION, False, 0, (S.OPEN,)),
        (CUSHION, True, 0, (S.CLOSED,)),
        (GRIPPING, True, -1, (S.BACKWARD,)),
        (GRIPPING, True, 0, (*AT_REST, S.CLOSED)),
    ],
)
def test_the_possible_states_are_those_that_touch_and_slide_so(
    element, touching, direction, options
):
    assert element.options(touching, direction) == options


BREAKS = [(E.BREAKS, 1), (E.BREAKS, -1)]


@pytest.mark.parametrize(
    ("element", "state", "events"),
    [
        (DRY, S.STICKS, BREAKS),
        (DRY, S.FORWARD, [(E.STOPS, 1)]),
        (DRY, S.BACKWARD, [(E.STOPS, -1)]),
        (DRY, S.PRESSED_FORWARD, []),
        (SMOOTH, S.OPEN, [(E.HITS, 0)]),
        (SMOOTH, S.CLOSED, [(E.LEAVES, 0)]),
        (ROUGH, S.STICKS, [(E.LEAVES, 0), *BREAKS]),
        (ROUGH, S.BACKWARD, [(E.LEAVES, 0), (E.STOPS, -1), (E.JAMS, 0)]),
        (ROUGH, S.PRESSED_FORWARD, [(E.LEAVES, 0)]),
        (CUSHION, S.OPEN, [(E.HITS, 0)]),
        (CUSHION, S.CLOSED, [(E.LEAVES, 0)]),
        (GRIPPING, S.FORWARD, [(E.LEAVES, 0), (E.STOPS, 1)]),
        (GRIPPING, S.STICKS, [(E.LEAVES, 0), *BREAKS]),
    ],
)
def test_a_state_ends_by_its_events(element, state, events):
    assert sorted(element.events(state), key=str) == sorted(events, key=str)


KEPT = (MATERIAL.stiffness, 1e-6, 1e-5)


@pytest.mark.parametrize(
    ("state", "plastic", "events"),
    [
        (S.OPEN, PlasticState(Phase.WHOLE), [(E.HITS, 0)]),
        (S.OPEN, PlasticState(Phase.DENTED, *KEPT), [(E.HITS, 0), (E.CLEARS, 0)]),
        (S.CLOSED, PlasticState(Phase.WHOLE), [(E.LEAVES, 0), (E.REACHES, 0)]),
        (S.CLOSED, PlasticState(Phase.YIELDS), [(E.LEAVES, 0), (E.REACHES, 0), (E.TURNS, 1)]),
        (S.CLOSED, PlasticState(Phase.FLOWS), [(E.LEAVES, 0), (E.REACHES, 0), (E.TURNS, 1)]),
        (S.CLOSED, PlasticState(Phase.DENTED, *KEPT), [(E.LEAVES, 0), (E.REACHES, 0)]),
    ],
)
def test_a_surface_that_yields_ends_its_branches_by_events(state, plastic, events):
    assert sorted(YIELDING.events(state, plastic), key=str) == sorted(events, key=str)


def test_only_a_higher_static_limit_is_hysteretic():
    assert DRY.hysteretic
    assert ROUGH.hysteretic
    assert not DryFriction("A", JointCoordinate("A"), 2.0, 2.0).hysteretic
    assert not SMOOTH.hysteretic


def test_limits_are_constants_of_dry_friction_and_coulombs_of_contacts():
    assert DRY.limits(40.0) == (2.0, 3.0)
    assert ROUGH.limits(40.0) == (10.0, 20.0)
    assert GRIPPING.limits(40.0) == (10.0, 20.0)
    assert SMOOTH.limits(40.0) == (0, 0)


def test_an_element_is_named_by_its_normal_or_else_by_its_tangent():
    assert DRY.principal is AT_B
    assert ROUGH.principal is UP
    assert [e.rough for e in (DRY, SMOOTH, ROUGH, CUSHION, GRIPPING)] == [1, 0, 1, 0, 1]
    assert [e.rigid for e in (DRY, SMOOTH, ROUGH, CUSHION, GRIPPING)] == [0, 1, 1, 0, 0]


def test_only_compliant_contacts_have_a_law():
    assert DRY.compliant is SMOOTH.compliant is None
    assert CUSHION.compliant == KelvinVoigt(100.0)
    assert CUSHION.hysteresis is None
    assert YIELDING.hysteresis is not None


def test_the_branch_of_a_law_without_memory_is_the_law():
    assert CUSHION.branch(None).law == KelvinVoigt(100.0)
    dent = PlasticState(Phase.DENTED, 5.0, 0.1, 0.3)
    branch = YIELDING.branch(dent)
    assert (branch.law, branch.residual, branch.turning) == (Hertz(5.0), 0.1, 0)
    assert branch.reach == math.sqrt(0.3 - 0.1)
