"""Event functions: those of each mode, and their values, by hand."""

import math

import numpy as np
import pytest

from tests.simulation.hybrid import BARS, mode_of, system_of
from twolink import lagrange
from twolink.contact.coordinates import JointCoordinate, PointCoordinate
from twolink.contact.elastoplastic import ElastoPlastic, Material
from twolink.contact.elements import CompliantContact, ContactForces, DryFriction, RigidContact
from twolink.contact.force_laws import Hertz, Phase, PlasticState
from twolink.contact.states import ContactState as S
from twolink.contact.states import EventKind as E
from twolink.simulation.hybrid.dynamics import Solution
from twolink.simulation.hybrid.event_functions import (
    Surfaces,
    response_to_push,
    triggers,
    value,
)
from twolink.simulation.hybrid.mode import Trigger
from twolink.simulation.hybrid.pose import Pose

UP, ALONG = PointCoordinate("D", (0.0, -1.0)), PointCoordinate("D", (1.0, 0.0))
MATERIAL = Material(1e11, 0.01, 1e9, 0.3)
ELEMENTS = (
    DryFriction("B", JointCoordinate("B"), 2.0, 3.0),
    RigidContact("D on floor", UP, -1.0, 0.0, ALONG, kinetic=0.25, static=0.5),
    CompliantContact(
        "D on steel", UP, -1.0, Hertz(MATERIAL.stiffness), memory=ElastoPlastic(MATERIAL)
    ),
)
SYSTEM = system_of(elements=ELEMENTS)
DENT = PlasticState(Phase.DENTED, 7.0, 0.25, 0.5)
Q, U = (0.7, -0.4), (1.1, -0.6)
POSE = Pose(BARS, lagrange, Q)
SURFACES = Surfaces({1: 0.125, 2: -0.5}, {2: 0.375})
FORCES = ContactForces(0, -1.25), ContactForces(8.0, 3.0), ContactForces(4.0, 0)


def value_of(kind, index, sense=0, states=(S.STICKS, S.FORWARD, S.CLOSED), surfaces=SURFACES):
    mode = mode_of(SYSTEM, *states, dents=(None, None, DENT))
    trigger = Trigger(kind, index, sense)
    return value(trigger, SYSTEM, mode, POSE, U, Solution((0, 0), FORCES), surfaces)


def test_the_triggers_of_a_mode_are_those_of_its_elements():
    mode = mode_of(SYSTEM, S.BACKWARD, S.OPEN, S.CLOSED, dents=(None, None, DENT))
    assert set(triggers(SYSTEM, mode)) == {
        Trigger(E.STOPS, 0, -1),
        Trigger(E.HITS, 1),
        Trigger(E.LEAVES, 2),
        Trigger(E.REACHES, 2),
    }


@pytest.mark.parametrize(
    ("kind", "index", "sense", "expected"),
    [
        (E.HITS, 1, 0, 0.125),
        # A dent of 0.25 m is cleared where the gap below the whole surface ends.
        (E.CLEARS, 2, 0, 0.25 + 0.5),
        (E.REACHES, 2, 0, math.sqrt(0.5 - 0.25) - 0.375),
        # The limit 3 N m, less the load in either direction.
        (E.BREAKS, 0, 1, 3.0 - 1.25),
        (E.BREAKS, 0, -1, 3.0 + 1.25),
        # μ N = 4 N of which 3 N are used up.
        (E.BREAKS, 1, 1, 4.0 + 3.0),
        (E.BREAKS, 1, -1, 4.0 - 3.0),
        (E.LEAVES, 1, 0, 8.0),
        (E.LEAVES, 2, 0, 0.375),
        # Sliding speeds: u2 − u1 of B, and of D along x.
        (E.STOPS, 0, -1, 1.7),
        (E.STOPS, 1, 1, -1.1 * math.sin(0.7) - 0.6 * math.sin(0.4)),
        # The rate of the depth while it is pressed.
        (E.TURNS, 2, 1, 1.1 * math.cos(0.7) - 0.6 * math.cos(0.4)),
        (E.TURNS, 2, -1, -1.1 * math.cos(0.7) + 0.6 * math.cos(0.4)),
    ],
)
def test_values_of_event_functions_are_those_computed_by_hand(kind, index, sense, expected):
    assert value_of(kind, index, sense) == pytest.approx(expected, rel=1e-14)


def test_a_surface_without_a_root_leaves_where_its_force_falls_to_zero():
    assert value_of(E.LEAVES, 2, surfaces=Surfaces({}, {})) == 4.0


@pytest.mark.parametrize(("state", "s"), [(S.FORWARD, -0.25), (S.BACKWARD, 0.25)])
def test_a_slide_locks_where_its_normal_no_longer_answers_its_push(state, s):
    """n · M⁻¹ (n + s t), with NumPy."""
    c = math.cos(Q[1] - Q[0])
    M = np.array([[4 / 3, c / 2], [c / 2, 1 / 3]])
    n, t = -np.cos(Q), -np.sin(Q)
    expected = n @ np.linalg.solve(M, n + s * t)
    states = (S.STICKS, state, S.CLOSED)
    assert value_of(E.JAMS, 1, states=states) == pytest.approx(expected, rel=1e-13)
    mode = mode_of(SYSTEM, *states, dents=(None, None, DENT))
    assert response_to_push(SYSTEM, mode, POSE, 1) == pytest.approx(expected, rel=1e-13)
