"""Bounds on the change of u by impacts and presses that a run may have missed."""

import math

import pytest

from tests.simulation.hybrid import BARS
from tests.simulation.hybrid.test_impact import AT_B, EPSILON, UP, floor, impacts_of
from twolink import lagrange
from twolink.chain import Chain
from twolink.contact.coordinates import PointCoordinate
from twolink.contact.elements import RigidContact
from twolink.contact.impact_laws import LAWS
from twolink.simulation.hybrid.impact import Impacts
from twolink.simulation.hybrid.missed_change import (
    change_by_impact,
    change_by_press,
    usual_change,
)
from twolink.simulation.hybrid.pose import Pose


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("mu", [0.0, 0.3])
def test_no_impact_changes_more_than_the_bound_says(law, mu, random):
    """In poses down to 1e-9 rad from the one in which B cannot move along the normal."""
    for _ in range(60):
        q = (math.pi / 2 - 10 ** random.uniform(-9, 0), random.uniform(-3, 3))
        point = "B" if random.integers(2) else "D"
        tangent = PointCoordinate(point, (1.0, 0.0)) if mu else None
        contact = RigidContact(
            "floor", PointCoordinate(point, (0.0, -1.0)), -1.0, restitution=0.5, tangent=tangent,
            kinetic=mu, static=mu, law=law,
        )  # fmt: skip
        impacts = Impacts(Pose(BARS, lagrange, q), [contact], 0.0, EPSILON)
        u = tuple(random.normal(size=2).tolist())
        row = impacts.row(0)
        speed = row[0] * u[0] + row[1] * u[1]
        if speed > 0:
            u, speed = (-u[0], -u[1]), -speed
        after = impacts.impact(0, u).u[1]
        changed = max(abs(after[0] - u[0]), abs(after[1] - u[1]))
        assert changed <= change_by_impact(impacts, 0, -speed, u) * (1 + 1e-9)


def test_no_bound_is_below_that_of_usual_poses_and_newtons_rule_has_no_limit_of_energy():
    impacts = impacts_of(floor(0.5, 0.3, "newton"))
    assert change_by_impact(impacts, 0, 0.25, (0.0, 0.0)) >= usual_change(UP, BARS, 0.25) == 0.5
    assert change_by_impact(impacts, 0, math.inf, (0.1, 0.1)) == math.inf
    lower = impacts_of(floor(0.5, 0.0), q=(math.pi / 2, math.pi / 2))
    assert change_by_impact(lower, 0, 1e-9, (0.0, 0.0)) == usual_change(UP, BARS, 1e-9)


@pytest.mark.parametrize("along", [1.0, 0.05])
def test_a_soft_surface_changes_u_by_no_more_than_a_lossless_push(along):
    """A point near the axis turns its link fast, however slowly it meets the surface."""
    chain = Chain((1.0, 1.0), (1.0, 1.0), ((along, 0.0), (0.5, 0.0)), (1e-3, 1e-3))
    pose, speed = Pose(chain, lagrange, (0.4, -1.2)), 0.25
    point = PointCoordinate("C1", (0.0, -1.0))
    x, y = pose.row(point)
    u = -speed / x, 0.3
    x_response, y_response = pose.impulse_response((x, y))
    push = 2 * speed / (x * x_response + y * y_response)
    energy = Impacts(pose, [], 0.0, EPSILON).energy(u)
    most = change_by_press(pose, point, speed, energy)
    assert most >= push * max(abs(x_response), abs(y_response)) * (1 - 1e-12)
    assert most >= usual_change(point, chain, speed)
    assert most < 100.0
    # A point that cannot be pushed away leaves its energy alone.
    lying = Pose(chain, lagrange, (math.pi / 2, -1.2))
    assert change_by_press(lying, point, 0.0, energy) < math.inf


def test_a_link_without_length_has_a_usual_change():
    """The longest links are shorter than 1 m: the other one counts."""
    chain = Chain((1.0, 1.0), (0.5, 0.0), ((0.2, 0.0), (0.1, 0.0)), (0.1, 0.1))
    assert usual_change(UP, chain, 1.0) == 4.0


@pytest.mark.parametrize("metre", [2.0**-10, 1.0, 2.0**10])
def test_a_usual_change_does_not_depend_on_the_unit_of_length(metre):
    chain = Chain.uniform_bars((1.0, 1.0), (0.75 * metre, 0.25 * metre))
    assert usual_change(UP, chain, metre) == 8.0
    assert usual_change(AT_B, chain, 1.0) == 8.0
