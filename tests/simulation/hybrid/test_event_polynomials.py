"""Event functions as polynomials of steps: of variables, of integrals, and of either sign."""

import pytest

from tests.simulation.hybrid.test_certificate import (
    HITS,
    LEAVES,
    MODE,
    SYSTEM,
    block_of,
    compiled_of,
)
from twolink.contact.states import EventKind as E
from twolink.simulation.hybrid.event_polynomials import EventPolynomials
from twolink.simulation.hybrid.mode import Trigger


def functions_of(*triggers, **more):
    return EventPolynomials(SYSTEM, compiled_of(*triggers, **more), MODE)


def test_polynomials_are_those_of_time_on_each_step_scaled_to_one():
    block = block_of([[(1, -2, 3)], [(5, 6)]], (0.5, 0.25))
    found = functions_of(HITS).on(block)
    assert found[:, 0, :3].tolist() == [[1, -1, 0.75], [5, 1.5, 0]]


def test_an_event_function_known_by_its_integral_is_the_rate():
    """f = 1 − 4 t from t − 2 t²."""
    found = functions_of(LEAVES, integral=True).on(block_of([[(0, 1, -2)]]))
    assert found[0, 0, :3].tolist() == [1, -2, 0]


def test_a_branch_ends_at_its_reach_minus_the_root():
    """√(0.61 − 0.25) = 0.6, and the root is 0.5 + 0.4 t."""
    found = functions_of(Trigger(E.REACHES, 3)).on(block_of([[(0.5, 0.4)]]))
    assert found[0, 0, :2].tolist() == pytest.approx([0.1, -0.2], rel=1e-14)


@pytest.mark.parametrize("integral", [False, True])
def test_a_function_that_is_turned_has_the_opposite_sign_and_others_keep_theirs(integral):
    functions = functions_of(Trigger(E.JAMS, 0), LEAVES, integral=integral)
    block = block_of([[(0, 1, -2), (0, 3, 4)]])
    before = functions.on(block)
    functions.turn(0)
    after = functions.on(block)
    assert after[:, 0].tolist() == (-before[:, 0]).tolist()
    assert after[:, 1].tolist() == before[:, 1].tolist()
    functions.turn(0)
    assert functions.on(block).tolist() == before.tolist()
