"""Numbers of impacts: of bounces in closed form, and of chains without contacts."""

import math

import numpy as np

from tests.ensembles.cases import UNCOUPLED, axis, ensemble, starts
from twolink.ensembles.blocks import Ends, Impacts, Lanes
from twolink.ensembles.chunk import rows_of
from twolink.ensembles.impact_counts import AGREED, ENDLESS, UNDECIDED, ImpactCounts

# Link 1 is a bar with the mass of link 2 at its end.
INERTIA = 1 / 12 + 1 / 4 + 1


def bounces(*heights, restitution):
    """Return an ensemble of bounces on a stop at A, from heights (rad) and under -1 N m."""
    scene = {
        **UNCOUPLED,
        "start": {"q": [0.1, 0.0], "u": [0.0, 0.0]},
        "effects": {
            "joint_torque": {"torque": [-1.0, 0.0]},
            "joint_stop": {"joint": "A", "lower": 0.0, "restitution": restitution},
        },
    }
    return ensemble(scene=scene, axes=[axis("start.q.0", *heights)], keep={"impacts": True})


def test_bounces_without_loss_are_counted():
    """From a height h the first is after √(2 h I) s, and the others after twice that each."""
    heights = (0.1, 0.25, 0.7, 4.0)
    rows = rows_of(bounces(*heights, restitution=1.0), 0, 4).arrays
    falls = [math.sqrt(2 * h * INERTIA) for h in heights]
    assert rows["impacts"].tolist() == [(4.0 + fall) // (2 * fall) for fall in falls]
    assert rows["impacts"].tolist()[-1] == 1
    assert (rows["impacts_verdict"] == AGREED).all()


def test_bounces_that_die_away_have_no_number():
    rows = rows_of(bounces(0.1, 4.0, restitution=0.5), 0, 2).arrays
    assert rows["impacts"][0] > 10
    assert rows["impacts_verdict"].tolist() == [ENDLESS, AGREED]
    assert rows["impacts"][1] == 1


def test_scenes_without_contacts_have_none():
    rows = rows_of(starts(2, keep={"impacts": True}), 0, 4).arrays
    assert np.array_equal(rows["impacts"], np.zeros(4))
    assert (rows["impacts_verdict"] == AGREED).all()


def test_a_number_that_an_independent_run_does_not_have_is_undecided():
    lanes = Lanes(None, (), np.zeros((2, 3)), np.zeros((2, 3)), 1.0)
    counts = Impacts(np.array([2, 2, 2]), np.array([2, 3, 3]), np.array([False, False, True]))
    ends = Ends(np.zeros((2, 3)), np.zeros((2, 3)), np.zeros(3), counts)
    found = ImpactCounts().accumulator(lanes).values(ends)
    assert found["impacts"].tolist() == [2, 2, 2]
    assert found["impacts_verdict"].tolist() == [AGREED, UNDECIDED, ENDLESS]
