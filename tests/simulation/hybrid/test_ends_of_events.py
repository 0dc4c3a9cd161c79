import math

import pytest

from tests.simulation.hybrid.stopping_slides import first_arc
from twolink.contact.states import EventKind
from twolink.simulation.hybrid.ends_of_events import Ends
from twolink.simulation.hybrid.mode import Trigger

A, B = Trigger(EventKind.STOPS, 0, -1), Trigger(EventKind.STOPS, 1, 1)


def test_events_at_one_instant_come_without_an_error():
    ends = Ends(*first_arc())
    assert ends.triggers == (A, B)
    assert ends.within(B, A) == 0.0


@pytest.mark.parametrize("later", [1e-6, 1.5e-4, 3e-4])
def test_an_event_comes_as_well_by_an_error_of_both_speeds_and_of_the_end(later):
    """An error e of both speeds changes that of the elbow by 2 e, and the end by e/4."""
    ends = Ends(*first_arc(later))
    assert ends.uncertainty(A) == pytest.approx(1 / 4, rel=1e-9)
    assert ends.within(B, None) == pytest.approx(later / 2, rel=1e-9)
    assert ends.within(B, A) == pytest.approx(later / (2 + 5.5 / 4), rel=1e-9)


def test_an_event_far_from_the_end_is_not_the_next():
    ends = Ends(*first_arc(0.2))
    assert ends.within(B, A) == math.inf


def test_an_event_may_be_later_than_a_jump_of_the_loads():
    ends = Ends(*first_arc())
    assert ends.within_time(A, 0.0) == 0.0
    assert ends.within_time(A, 1e-5) == pytest.approx(4e-5, rel=1e-9)
    assert ends.within_time(A, 1.0) == math.inf
