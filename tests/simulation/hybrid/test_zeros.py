"""Event functions that are zero since the start of an arc, until they have grown."""

import numpy as np
import pytest

from tests.simulation.hybrid import state_of
from tests.simulation.hybrid.test_certificate import HITS, LEAVES, SYSTEM, compiled_of
from twolink.simulation.hybrid.zeros import Zeros

SIZE = 1e-12
TOUCHING = state_of(SYSTEM, (-0.3, 0.2))._replace(touching=frozenset({0}))
NOTHING, REST, RISES, FALLS = (0.0, 0.0), (1e-17, -1e-18), (1e-17, 1e-6), (1e-17, -1e-6)
DIPS, SINKS = (1e-17, -1e-6, 2e-6), (0.0, -SIZE / 2, 0.0)
NEVER = 99, 0.0


def block_of(*steps):
    """Return the polynomials of one event function on some steps: c_0 + c_1 x + c_2 x²."""
    return np.array([[*own, 0.0][:3] for own in steps])[:, None]


def zeros_of(*steps, trigger=HITS, state=TOUCHING):
    """Return the event functions of an arc, of which one is zero, and on how many steps it is."""
    zeros = Zeros(compiled_of(trigger), state)
    zeros.add(0, SIZE)
    return zeros, zeros.steps(block_of(*steps))


@pytest.mark.parametrize(
    ("steps", "count"),
    [((NOTHING, REST), 2), ((RISES, REST), 1), ((REST, REST, RISES), 3)],
)
def test_a_function_is_zero_up_to_the_step_at_whose_end_it_is_not(steps, count):
    zeros, found = zeros_of(*steps)
    assert found == {0: count}
    left = {0: 1} if count == len(steps) and steps[-1] is not RISES else {}
    assert zeros.steps(block_of(REST)) == left
    assert zeros.fallen is None


def test_a_function_that_falls_is_an_event_where_it_leaves_round_off():
    """At the end of its step it would come late, and the same for every run of such steps."""
    zeros, _ = zeros_of(REST, FALLS, REST)
    place, x, number = zeros.fallen
    assert (place, number) == (1, 0)
    assert x == pytest.approx(SIZE / 1e-6, rel=1e-3)
    zeros.steps(block_of(REST))
    assert zeros.fallen is None


def test_a_function_that_falls_and_rises_on_one_step_is_an_event():
    zeros, _ = zeros_of(REST, DIPS)
    assert zeros.fallen[:2] == (1, pytest.approx(SIZE / 1e-6, rel=1e-3))
    at_once, _ = zeros_of((-2 * SIZE, 1e-6))
    assert at_once.fallen == (0, 0.0, 0)


def test_the_lowest_value_of_a_function_is_known_as_long_as_it_is_zero():
    zeros, _ = zeros_of(REST, SINKS, REST)
    assert zeros.lowest(1) == {0: pytest.approx(0.0, abs=1e-17)}
    assert zeros.lowest(2)[0] == pytest.approx(-SIZE / 2)
    zeros.steps(block_of(REST, FALLS))
    assert zeros.lowest(1)[0] == pytest.approx(-SIZE / 2)
    assert zeros.lowest(2)[0] == -SIZE
    risen, _ = zeros_of(RISES, FALLS)
    assert risen.lowest(2)[0] == 0.0


@pytest.mark.parametrize(
    ("steps", "event", "departed"),
    [
        # So far, and by an event after, on and before the step on which it rises.
        ((REST, RISES), NEVER, {0}),
        ((REST, RISES, RISES), (2, 0.5), {0}),
        ((REST, RISES), (1, 0.5), {0}),
        ((REST, RISES), (1, 1e-9), set()),
        ((REST, RISES), (0, 0.5), set()),
        # It stays zero, or is pressed.
        ((REST, REST), NEVER, set()),
        ((REST, FALLS), NEVER, set()),
        ((REST, FALLS), (1, 0.5), set()),
    ],
)
def test_a_contact_without_force_departs_as_its_gap_rises(steps, event, departed):
    zeros, _ = zeros_of(*steps)
    assert zeros.departed(*event) == departed


def test_a_contact_that_has_departed_stays_apart_in_later_blocks():
    zeros, _ = zeros_of(REST, RISES)
    zeros.steps(block_of(RISES))
    assert zeros.departed(0, 0.0) == {0}


def test_a_gap_that_opens_at_once_departs_at_once():
    assert Zeros(compiled_of(HITS), TOUCHING).departed(*NEVER) == {0}


def test_other_event_functions_and_contacts_that_do_not_touch_do_not_depart():
    apart = TOUCHING._replace(touching=frozenset())
    for trigger, state in ((LEAVES, TOUCHING), (HITS, apart), (HITS, None)):
        zeros, _ = zeros_of(RISES, trigger=trigger, state=state)
        assert zeros.departed(*NEVER) == frozenset()
