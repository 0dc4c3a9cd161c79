"""Certificates of arcs whose event functions are written down as polynomials."""

import math

import numpy as np
import pytest

from tests.simulation.hybrid import mode_of, state_of, system_of
from twolink.contact.coordinates import JointCoordinate, PointCoordinate
from twolink.contact.elastoplastic import ElastoPlastic, Material
from twolink.contact.elements import CompliantContact, DryFriction, RigidContact
from twolink.contact.force_laws import Hertz, Phase, PlasticState
from twolink.contact.states import ContactState as S
from twolink.contact.states import EventKind as E
from twolink.simulation.hybrid.block import Block
from twolink.simulation.hybrid.certificate import Certificate
from twolink.simulation.hybrid.compiled import CompiledMode, Watched
from twolink.simulation.hybrid.mode import Trigger
from twolink.simulation.pool import IntegratorPool

UP, ALONG = PointCoordinate("D", (0.0, -1.0)), PointCoordinate("D", (1.0, 0.0))
MATERIAL = Material(1e11, 0.01, 1e9, 0.3)
ELEMENTS = (
    RigidContact("D on floor", UP, 0.0, 0.0, ALONG, 0.5, 0.5),
    DryFriction("A", JointCoordinate("A"), 1.0, 2.0),
    DryFriction("B", JointCoordinate("B"), 1.0, 1.0),
    CompliantContact("steel", UP, 0.0, Hertz(1.0), memory=ElastoPlastic(MATERIAL)),
)
SYSTEM = system_of(elements=ELEMENTS, longest_step=0.5)
DENT = PlasticState(Phase.DENTED, 7.0, 0.25, 0.25 + 0.36)
MODE = mode_of(SYSTEM, S.OPEN, S.STICKS, S.STICKS, S.CLOSED, dents=(None, None, None, DENT))

HITS, LEAVES = Trigger(E.HITS, 0), Trigger(E.LEAVES, 0)
TERMS = 8


def series(*coefficients, kind=float):
    padded = [*coefficients, *[0] * (TERMS - len(coefficients))]
    return [kind(c) for c in padded]


# The variables of each step before those that are given, q and u.
STATE = [(-0.3,), (-0.2,), (1.0,), (0.5,)]


def block_of(steps, lengths=(0.5,), start=0.0, kind=float):
    """Return steps, each a list of the series of its variables after q and u."""
    starts = start + np.concatenate([[0], np.cumsum(lengths)[:-1]])
    rows = np.array([[series(*v, kind=kind) for v in (*STATE, *step)] for step in steps])
    return Block(np.array(starts, dtype=rows.dtype), np.array(lengths, dtype=rows.dtype), rows)


def compiled_of(*triggers, clock=None, integral=False, system=SYSTEM):
    """Return a mode whose variables 0, 1, … are each an event function or its integral."""
    downwards = (E.CLEARS, E.REACHES)
    watched = tuple(
        Watched(trigger, 4 + number, -1.0 if trigger.kind in downwards else 1.0, integral)
        for number, trigger in enumerate(triggers)
    )
    return CompiledMode(
        pool=IntegratorPool(None), operations=0, numbers=0, watched=watched, gaps=(), recovering=(),
        roots=(), moving=(), clock=clock if clock is None else 4 + clock, integrals=slice(0, 0),
        number=system.number, kind=None,
    )  # fmt: skip


def certificate_of(*triggers, span=1.0, system=SYSTEM, state=None, **more):
    """Return the certificate of variables 0, 1, …, each an event function or its integral."""
    compiled = compiled_of(*triggers, system=system, **more)
    return Certificate(system, compiled, MODE, system.number(span), state=state)


def first(trigger, *steps, lengths=(0.5,), at_start=True, **more):
    """Return the first event of one variable and its doubts."""
    block = block_of([[step] for step in steps], lengths)
    return certificate_of(trigger, **more).first_event(block, at_start)


def test_an_event_function_known_by_its_integral_is_an_event_where_its_rate_falls():
    """f = 1 − 4 t from t − 2 t²."""
    finding, _ = first(LEAVES, (0, 1, -2), integral=True)
    assert finding.x == pytest.approx(0.5, rel=1e-15)


def test_a_function_that_stays_positive_is_no_event():
    assert first(HITS, (1, -1.9)) == (None, ())


def test_the_first_fall_is_found_on_its_step():
    """1 − 3 t² falls at 1/√3, on the second half of the first second."""
    steps = (1, 0, -3), (0.25, -3, -3)
    (place, x, trigger, _), doubts = first(HITS, *steps, lengths=(0.5, 0.5))
    assert (place, trigger, doubts) == (1, HITS, ())
    assert 0.5 + 0.5 * x == pytest.approx(1 / math.sqrt(3), rel=1e-15)


def test_of_two_events_on_a_step_the_earlier_one_is_found():
    other = Trigger(E.BREAKS, 1, 1)
    block = block_of([[(1, -4), (1, -5)]])
    finding, _ = certificate_of(HITS, other).first_event(block, True)
    assert finding.trigger == other
    assert finding.x == pytest.approx(0.4, rel=1e-15)


# Event functions that start at zero.


@pytest.mark.parametrize("gap", [(0, 1), (0, 1, -1.9), (0, 0, 1), (0, 0, 0, 1e-3)])
def test_a_gap_that_starts_at_zero_and_grows_is_no_event(gap):
    assert first(HITS, gap) == (None, ())


@pytest.mark.parametrize("gap", [(0, -1), (0, 0, -1, 5), (0, 0, 0, -1e-3), (0, -1e-3, 1)])
def test_a_gap_that_starts_at_zero_and_shrinks_is_an_event_at_once(gap):
    finding, _ = first(HITS, gap)
    assert (finding.place, finding.x, finding.trigger) == (0, 0.0, HITS)


@pytest.mark.parametrize("flight", [0.3, 1e-5, 1e-9])
def test_a_flight_from_zero_back_to_zero_ends_when_it_does(flight):
    """4.9 t (T − t): up at 4.9 T."""
    finding, _ = first(HITS, (0, 4.9 * flight, -4.9))
    assert finding.x * 0.5 == pytest.approx(flight, rel=1e-14)


def test_a_gap_held_at_zero_by_other_contacts_is_no_event():
    """All zeros: on this step and on those that follow in the arc."""
    certificate = certificate_of(HITS)
    assert certificate.first_event(block_of([[()]]), True) == (None, ())
    assert certificate.first_event(block_of([[()]], start=0.5), False) == (None, ())


def test_a_friction_limit_that_is_reached_at_the_start_ends_the_arc_or_recedes():
    breaks = Trigger(E.BREAKS, 2, 1)
    assert first(breaks, (0, 1, 1))[0] is None
    assert first(breaks, (1e-17, 1, 1))[0] is None
    assert first(breaks, (0, -1))[0].x == 0
    # Round-off of a value that starts at zero: its slope shows that it grows.
    assert first(breaks, (-1e-17, 1))[0] is None


def test_a_slide_that_starts_from_rest_goes_on_until_it_stops():
    """3 t − 8 t²: it stops after 3/8 s."""
    finding, _ = first(Trigger(E.STOPS, 2, 1), (0, 3, -8))
    assert finding.x * 0.5 == pytest.approx(3 / 8, rel=1e-14)


def test_a_function_that_is_below_zero_later_in_an_arc_falls_at_once():
    finding, _ = first(HITS, (-0.1, 1), at_start=False)
    assert (finding.place, finding.x) == (0, 0)


def test_a_slide_locked_at_the_start_ends_as_its_response_rises_through_zero():
    """The response of the normal rises through zero at 1/4 s."""
    finding, _ = first(Trigger(E.JAMS, 0), (-1, 4))
    assert finding.x == pytest.approx(0.5)
    assert first(Trigger(E.JAMS, 0), (-1, 1))[0] is None


# Surfaces that yield: distances from the ends of branches.


def test_a_branch_ends_where_its_root_reaches_the_deepest():
    """√(0.61 − 0.25) = 0.6, and the root is 0.5 + 0.4 t."""
    finding, _ = first(Trigger(E.REACHES, 3), (0.5, 0.4))
    assert finding.x * 0.5 == pytest.approx(0.25, rel=1e-14)


def test_a_dent_is_cleared_where_the_gap_is_as_wide_as_it_is_deep():
    finding, _ = first(Trigger(E.CLEARS, 3), (0.15, 0.4))
    assert finding.x * 0.5 == pytest.approx(0.25, rel=1e-14)


# Touches.


# Arcs whose variable is not time.


def clock_case(span, gap=(1, 0.1)):
    """Return the event of a gap beside a clock t = s + s² on steps of 1/2."""
    steps = [[gap, (0, 1, 1)], [gap, (0.75, 2, 1)]]
    # The integrator stops when the clock is at the end of the arc.
    count = 1 if span <= 0.75 else 2
    block = block_of(steps[:count], (0.5, 0.5)[:count])
    return certificate_of(HITS, clock=1, span=span).first_event(block, True)[0]


@pytest.mark.parametrize(("span", "place"), [(0.5, 0), (0.75, 0), (1.2, 1)])
def test_an_arc_ends_where_its_clock_says(span, place):
    """s + s² = T at s = (√(1 + 4 T) − 1)/2."""
    finding = clock_case(span)
    assert finding.trigger is None
    assert finding.place == place
    s = (math.sqrt(1 + 4 * span) - 1) / 2
    assert 0.5 * (place + finding.x) == pytest.approx(s, rel=1e-14)


def test_an_arc_continues_before_the_end_of_its_clock():
    assert clock_case(3.0) is None


def test_the_earlier_of_clock_and_event_ends_an_arc():
    falls = (0.3, -1)
    assert clock_case(0.5, falls).trigger == HITS
    assert clock_case(0.5, falls).x == pytest.approx(0.6)
    assert clock_case(0.2, falls).trigger is None


def test_a_mode_without_event_functions_ends_by_its_clock_only():
    certificate = certificate_of(clock=0, span=0.25)
    finding, _ = certificate.first_event(block_of([[(0, 1)]]), True)
    assert finding.x == pytest.approx(0.5)
    assert certificate_of().first_event(block_of([[(0, 1)]]), True) == (None, ())


# Other precisions.


@pytest.mark.parametrize("precision", ["long double", "quadruple"])
def test_events_are_found_to_the_digits_of_the_precision(precision):
    """1 − 3 t falls at 1/3."""
    system = system_of(elements=ELEMENTS, precision=precision)
    number = system.number
    block = block_of([[(1, -3)]], (number(0.5),), start=number(0), kind=number)
    finding, _ = certificate_of(HITS, system=system).first_event(block, True)
    miss = finding.x * number(0.5) - number(1) / number(3)
    assert abs(miss) < 4 * system.rounding


STOPS = Trigger(E.STOPS, 0, 1)


def test_a_speed_of_rounding_that_grows_later_in_an_arc_is_monitored_from_there():
    """A point that starts at a dead point of its link slides so slowly that its sign is open."""
    tiny = (0, 1e-18)
    steps = [tiny, tiny, (1e-18, 1e-6), (5e-7, -4e-6)]
    found, _ = first(STOPS, *steps, lengths=(0.5,) * 4)
    assert found.place == 3
    assert found.x == pytest.approx(0.25)


def test_a_speed_of_rounding_that_grows_the_other_way_is_an_event():
    found, _ = first(STOPS, (0, 1e-18), (1e-18, -1e-6), (-5e-7, -1e-6), lengths=(0.5,) * 3)
    assert (found.place, found.x) == (1, pytest.approx(0.0, abs=1e-4))
    assert found.x > 0


def test_a_speed_that_stays_rounding_is_no_event():
    found, _ = first(STOPS, *[(0, (-1) ** n * 1e-18) for n in range(9)], lengths=(0.5,) * 9)
    assert found is None


def test_a_speed_of_rounding_is_remembered_over_the_blocks_of_an_arc():
    certificate = certificate_of(STOPS)
    quiet = block_of([[(0, 1e-18)], [(0, 1e-18)]], (0.5, 0.5))
    assert certificate.first_event(quiet, at_start=True)[0] is None
    assert certificate.first_event(quiet, at_start=False)[0] is None
    loud = block_of([[(1e-18, 1e-6)], [(5e-7, -4e-6)]], (0.5, 0.5), start=1.0)
    found, _ = certificate.first_event(loud, at_start=False)
    assert (found.place, found.x) == (1, pytest.approx(0.25))


def test_a_slow_speed_along_a_short_row_may_exceed_round_off():
    """Near a folded pose an end at 1e-16 m/s may slide on: its row is short, the links are slow."""
    slide = [(1e-16, -3e-16)]
    assert first(STOPS, *slide)[0] is None
    near = state_of(SYSTEM, (-1e-11, math.pi), (1e-5, 1e-5))
    found, _ = first(STOPS, *slide, state=near)
    assert found.x == pytest.approx(2 / 3)
    # Elsewhere such a speed is rounding.
    apart = near._replace(q=(0.3, 1.0))
    assert first(STOPS, *slide, state=apart)[0] is None


def test_a_slide_takes_its_time_to_come_to_rest_however_slow_it_is():
    """At 1e-16 m/s and −1e-9 m/s² it lasts for 1e-7 s."""
    found, _ = first(STOPS, (1e-16, -1e-9))
    assert found.x * 0.5 == pytest.approx(1e-7)


@pytest.mark.parametrize("touching", [frozenset(), frozenset({0})])
def test_a_gap_that_is_zero_on_a_first_short_step_is_watched_from_there(touching):
    """On the first step it falls by less than round-off, and early on the second one by more."""
    state = state_of(SYSTEM, (-0.3, 0.2))._replace(touching=touching)
    steps, lengths = ((0, -1e-16), (-1e-16, -1e-7), (-1e-7, -1e-3)), (0.5, 0.5, 0.5)
    found, _ = first(HITS, *steps, lengths=lengths, state=state)
    assert (found.place, found.trigger) == (1, HITS)
    assert 0 < found.x < 1e-3


def test_a_contact_that_has_departed_stays_apart_in_later_blocks():
    state = state_of(SYSTEM, (-0.3, 0.2))._replace(touching=frozenset({0}))
    certificate = Certificate(SYSTEM, compiled_of(HITS), MODE, 9.0, state=state)
    certificate.first_event(block_of([[(1e-17, 1e-6)]]), at_start=True)
    back = block_of([[(1e-6, -4e-6)]], start=0.5)
    found, _ = certificate.first_event(back, at_start=False)
    assert found.trigger == HITS
    assert certificate.departed(found) == {0}


@pytest.mark.parametrize(("place", "count"), [(0.25, 1), (0.75, 0)])
@pytest.mark.parametrize("steep", [True, False])
def test_a_touch_leaves_a_doubt_only_before_the_event(place, count, steep):
    """Whichever of the two functions is searched first."""
    touching = [place**2, -2 * place, 1.0]
    falling = [1.0, -2.0] if steep else [1.0, 0.0, 0.0, 0.0, -16.0]
    steps = block_of([[touching, falling]], lengths=(1.0,))
    other = Trigger(E.BREAKS, 1, 1)
    found, doubts = certificate_of(HITS, other).first_event(steps, at_start=True)
    assert (found.trigger, float(found.x)) == (other, 0.5)
    assert len(doubts) == count


def test_a_near_touch_inside_a_step_leaves_a_doubt_although_the_function_is_proven_positive():
    """A static limit above the kinetic one is nearly reached: 0.05 is left after 0.25 s."""
    breaks = Trigger(E.BREAKS, 1, 1)
    dip = (0.3, -2.0, 4.0)
    found, doubts = first(breaks, dip, at_start=False)
    assert found is None
    (doubt,) = doubts
    assert doubt.trigger is breaks
    assert 0 < doubt.time < 0.25
    assert doubt.until == pytest.approx(0.25)
    # Farther away, and where it falls up to the end of the step, it does not touch.
    assert first(breaks, (1.25, -2.0, 4.0), at_start=False) == (None, ())
    assert first(breaks, (0.26, -0.4), at_start=False) == (None, ())
    # The limit of B is not above the kinetic one.
    assert first(Trigger(E.BREAKS, 2, 1), dip, at_start=False) == (None, ())


def test_a_function_divided_by_time_is_searched_although_its_series_is_positive():
    """Its last terms, which estimate the truncation error, may make it fall."""
    grows = (0.0, 1.0, -1.5, 0, 0, 0, 19.2)
    certificate = certificate_of(HITS)
    block = block_of([[grows]])
    (suspect,) = certificate._suspects(block, at_start=True)
    assert not suspect.whole
    assert not suspect.proven
    assert min(suspect.bernstein) > 0


def test_a_jam_that_is_monitored_with_the_opposite_sign_keeps_it_in_all_blocks():
    jams = Trigger(E.JAMS, 0, 1)
    certificate = certificate_of(jams)
    first_block = block_of([[(-1.0, 0.5)]])
    assert certificate.first_event(first_block, at_start=True) == (None, ())
    second = block_of([[(-0.75, 2.0)]], start=0.5)
    finding, _ = certificate.first_event(second, at_start=False)
    assert (finding.trigger, finding.x) == (jams, pytest.approx(0.75))


def test_a_force_that_sinks_within_round_off_has_its_lowest_value():
    """It is given in N m, and no longer counts once it has grown."""
    breaks = Trigger(E.BREAKS, 1, 1)
    certificate = certificate_of(breaks)
    quiet = block_of([[(0, -1e-15)], [(-5e-16, 1e-15)]], (0.5, 0.5))
    assert certificate.first_event(quiet, at_start=True) == (None, ())
    expected = -5e-16 / SYSTEM.scales.force(1)
    assert certificate.lowest(None) == {breaks: pytest.approx(expected)}
    falls = block_of([[(0, -1e-6)]], start=1.0)
    found, _ = certificate.first_event(falls, at_start=False)
    assert (found.place, found.trigger) == (0, breaks)
    assert certificate.lowest(found)[breaks] < 2 * expected
    # Gaps are places, and no forces.
    gaps = certificate_of(HITS)
    gaps.first_event(block_of([[(0, -1e-16)]]), at_start=True)
    assert gaps.lowest(None) == {}


def test_of_two_events_on_a_step_one_may_be_that_of_a_force_that_was_zero():
    breaks = Trigger(E.BREAKS, 1, 1)
    for gap, expected in (((1.0, -1000.0), HITS), ((1.0, -4.0), breaks)):
        certificate = certificate_of(HITS, breaks)
        quiet = block_of([[(1.0,), (0, -1e-16)]], (0.5,))
        certificate.first_event(quiet, at_start=True)
        block = block_of([[gap, (0.0, 0.0, 0.0, -1e-6)]], (0.5,), start=0.5)
        found, _ = certificate.first_event(block, at_start=False)
        assert found.trigger == expected
