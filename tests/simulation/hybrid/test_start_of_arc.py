"""Zeros of event functions at the start of an arc: by the selection, by a speed, by round-off."""

import math

import numpy as np
import pytest

from tests.simulation.hybrid import state_of, system_of
from twolink.contact.coordinates import PointCoordinate
from twolink.contact.elastoplastic import ElastoPlastic, Material
from twolink.contact.elements import CompliantContact, RigidContact
from twolink.contact.force_laws import Hertz, Phase, PlasticState
from twolink.contact.states import ContactState, EventKind
from twolink.simulation.hybrid.block import Block
from twolink.simulation.hybrid.compiled import CompiledMode
from twolink.simulation.hybrid.compliant_state import CompliantState
from twolink.simulation.hybrid.mode import Trigger
from twolink.simulation.hybrid.noise import Zero
from twolink.simulation.hybrid.start_of_arc import StartOfArc
from twolink.simulation.pool import IntegratorPool

UP = PointCoordinate("D", (0.0, -1.0))
SYSTEM = system_of(elements=(RigidContact("D on floor", UP, 0.0, 0.0),), longest_step=0.5)
MODE = SYSTEM.mode((ContactState.OPEN,))
HITS = Trigger(EventKind.HITS, 0)

GAP = [0.0, 1e-24, -1e-22, 1e-25, 0.0, 0.0]
"""A gap whose changes are all below the round-off of a place."""

CLOCK = [0.0, 1e-24, 1e-20, 0.0, 0.0, 0.0]


def order(polynomial, *, orders=None, clock=1, recovering=(), state=None):
    """Return the order of a gap in a mode in which time is a variable, if there is a clock."""
    compiled = compiled_with(clock=clock, recovering=recovering)
    rows = np.array([[polynomial, CLOCK]])
    start = StartOfArc(SYSTEM, compiled, MODE, orders or {}, state)
    return start.order(HITS, polynomial, Block(np.zeros(1), np.ones(1), rows))


def compiled_with(*, clock, recovering=()):
    """Return a compiled mode without code."""
    return CompiledMode(
        pool=IntegratorPool(None), operations=0, numbers=0, watched=(), gaps=(0,),
        recovering=recovering, roots=(), moving=(), clock=clock, integrals=slice(0, 0),
        number=float, kind=None,
    )  # fmt: skip


def moving(speed):
    """Return a state in which D moves at a speed (m/s) away from the floor."""
    state = state_of(SYSTEM, (-0.3, -0.2))
    row = np.array([UP.speed(SYSTEM.chain, state.q, u) for u in ((1.0, 0.0), (0.0, 1.0))])
    return state._replace(u=tuple((speed * row / (row @ row)).tolist()))


def test_a_gap_that_opens_at_a_speed_grows_from_its_first_coefficient():
    """In the powers of a variable in which time starts slowly all of them are below round-off."""
    assert order(GAP, state=moving(2.0)) == 1


@pytest.mark.parametrize("speed", [0.0, -2.0])
def test_a_gap_without_a_speed_that_opens_it_is_left_to_round_off(speed):
    assert order(GAP, state=moving(speed)) != 1


def test_a_surface_that_recovers_has_another_speed_than_its_point():
    assert order(GAP, state=moving(2.0), recovering=(0,)) != 1


def test_a_coefficient_that_contradicts_the_speed_is_not_taken_for_growth():
    falling = [0.0, -1e-24, *GAP[2:]]
    assert order(falling, state=moving(2.0)) != 1


def test_the_order_of_the_selection_counts_in_powers_of_time():
    """Time starts as the first power of the variable, so that an order of two stays two."""
    grows = [0.0, 0.0, 1e-3, 0.0, 0.0, 0.0]
    assert order(grows, orders={HITS: 2}) == 2
    assert order(grows, orders={HITS: 2}, clock=None) == 2


def test_a_gap_in_powers_of_time_is_known_within_round_off():
    assert order([1.0, -0.5, 0.0, 0.0, 0.0, 0.0], clock=None) == 0
    assert order([0.0, 1.0, 0.0, 0.0, 0.0, 0.0], clock=None) == 1
    assert order([0.0] * 6, clock=None) is None


@pytest.mark.parametrize(("speed", "expected"), [(1e-13, 1), (0.0, 2), (-1e-13, 2)])
def test_a_gap_that_opens_slowly_under_a_large_force_grows_from_its_first_coefficient(
    speed, expected
):
    """Beside a change of 0.5 m in the step the round-off of the gap hides 1e-13 m."""
    gap = [0.0, 1e-13, -0.5, 0.0, 0.0, 0.0]
    assert order(gap, clock=None, state=moving(speed)) == expected


def test_a_gap_of_zero_counts_as_zero_within_the_round_off_of_its_place():
    """It is watched once it has grown, also where the contact touches without a force."""
    state = state_of(SYSTEM, (-0.3, -0.2))
    compiled = CompiledMode(
        pool=IntegratorPool(None), operations=0, numbers=0, watched=(), gaps=(0,), recovering=(),
        roots=(), moving=(), clock=None, integrals=slice(0, 0), number=float, kind=None,
    )  # fmt: skip
    block = Block(np.zeros(1), np.ones(1), np.array([[GAP, CLOCK]]))
    touches, opens = (state._replace(touching=frozenset(own)) for own in ({0}, ()))
    sizes = [
        StartOfArc(SYSTEM, compiled, MODE, orders, own).zero_size(HITS, GAP, block)
        for orders, own in (({}, touches), ({}, opens), ({HITS: Zero(1e-9)}, touches))
    ]
    assert sizes == [SYSTEM.scales.places_of_rounding[0]] * 3


@pytest.mark.parametrize(
    ("size", "value", "expected"),
    [(1e-8, -1e-9, None), (1e-8, 1e-9, 0), (math.inf, -1e-9, 0), (0.0, -1e-9, 0)],
)
def test_a_force_that_is_zero_by_the_selection_does_not_fall_at_once(size, value, expected):
    """Its own coefficients are above the round-off of the event function, not of all forces."""
    compiled = compiled_with(clock=None)
    polynomial = [value, 0.0, 0.0, 0.0, 0.0, 0.0]
    block = Block(np.zeros(1), np.ones(1), np.array([[polynomial, CLOCK, CLOCK, CLOCK]]))
    leaves = Trigger(EventKind.LEAVES, 0)
    start = StartOfArc(SYSTEM, compiled, MODE, {leaves: Zero(size)}, None)
    assert start.order(leaves, polynomial, block) == expected
    kept = start.zero_size(leaves, polynomial, block)
    assert kept == (pytest.approx(1e-8 * SYSTEM.scales.force(0)) if size == 1e-8 else kept)
    assert math.isfinite(kept)


@pytest.mark.parametrize("residue", [-1e-15, 0.0, 1e-15])
@pytest.mark.parametrize("sense", [1, -1])
def test_the_largest_depth_of_a_turn_is_left_by_an_acceleration_alone(residue, sense):
    """The root is the largest one within round-off, and the speed zero within that of u."""
    material = Material(modulus=2e11, radius=0.01, strength=1e9, poisson=0.3)
    steel = CompliantContact(
        "D", UP, 0.0, Hertz(material.stiffness), memory=ElastoPlastic(material)
    )
    system = system_of(elements=(steel,), longest_step=0.5)
    root, step = 1e-3, 0.1
    dent = PlasticState(Phase.DENTED, material.stiffness, 1e-7, 1e-7 + root**2)
    state = state_of(system, (-0.3, -0.2), (0.4, 0.7))
    state = state._replace(compliant=(CompliantState(root, 0, dent),))
    # dt/ds is the root. An outward acceleration lowers it, and an inward one raises it.
    dt = root * step
    changes, clock = [0.4, 1e-5, *[0.0] * 4], [0.0, dt, *[0.0] * 4]
    rows = np.array([[[0.0] * 6, [0.0] * 6, changes, changes, clock]])
    compiled = compiled_with(clock=4)
    mode = system.mode((ContactState.CLOSED,), (dent,))
    block = Block(np.zeros(1), np.ones(1), rows)
    polynomial = [residue * root, residue * dt / (2 * root), sense * 1e-5 * dt / (4 * root)]
    start = StartOfArc(system, compiled, mode, {}, state)
    assert start.order(Trigger(EventKind.REACHES, 0), [*polynomial, 0.0, 0.0, 0.0], block) == 2
