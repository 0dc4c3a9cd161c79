"""The count of expanded modes."""

from twolink.simulation.hybrid.tally import Tally


def test_a_number_is_taken_once():
    tally = Tally()
    assert tally.take() == 0
    for _ in range(3):
        tally.add_one()
    assert tally.take() == 3
    assert tally.take() == 0
