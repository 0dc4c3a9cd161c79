"""A sampled torque of zero changes nothing, wherever its knots are beside events."""

import numpy as np
import pytest

from twolink.chain import Chain
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.joint_stop import JointStop
from twolink.effects.sampled_torque import SampledTorque
from twolink.scene import Scene
from twolink.simulation.simulate import simulate

# The mass centre of link 2 is in B: link 1 turns alone, with an inertia of 1 kg m².
ALONE = Chain((1.0, 0.5), (1.0, 1.0), ((0.0, 0.0), (0.0, 0.0)), (0.5, 1.0))


def held(times, torques):
    """Return torques at A that are constant from each time to the next."""
    return SampledTorque(tuple(times), tuple(torques), (0.0,) * len(times), "hold")


@pytest.mark.parametrize("law", ["hertz", "hunt-crossley"])
@pytest.mark.parametrize("before", [1e-9, 1e-6, 5e-5, 1e-3])
def test_a_knot_shortly_before_a_point_leaves_a_soft_surface(law, before):
    """The depth of B is sin q1; its root falls below zero on the last step, where time turns back.

    The point leaves at the speed that the energy gives: 1 rad/s without a loss.
    """
    loss = {} if law == "hertz" else {"loss": 0.2}
    soft = CompliantSurface((0.0, 0.0), (0.0, -1.0), law, stiffness=2000.0, on=("B",), **loss)

    def moved(*more):
        return simulate(Scene(ALONE, (0.0, 0.0), (1.0, 0.0), 1.0, (soft, *more)))

    free = moved()
    leaves = free.events[1].time
    if law == "hertz":
        assert free.q[0, -1] == pytest.approx(-(1.0 - leaves), abs=1e-12)
    knotted = moved(held((0.0, leaves - before), (0.0, 0.0)))
    assert knotted.met
    assert np.abs(knotted.q - free.q).max() <= knotted.error + free.error
    (at_knot, _), (before_it, _) = (
        knotted.at(leaves - before, side=side) for side in ("right", "left")
    )
    assert at_knot[0] == pytest.approx(before_it[0], abs=1e-15)


@pytest.mark.parametrize("after", [0.0, 1e-12, 1e-11, 1e-10, 1e-9])
def test_a_knot_within_round_off_of_an_impact(after):
    """Half the speed v until h before 1 s, then a torque a: the stop is struck at 1 s, with v.

    The next impact follows after 2 e v / a, whatever the gap of the knot after the first.
    """
    a, v, e = 64.0, 2.0**-20, 0.5
    h = v / 2 / a
    begins = -(v / 2 * (1 - h) + v / 2 * h + a * h * h / 2)
    flight = 2 * e * v / a
    end = 1 + flight * 1.25 * 0.95
    knots = held((0.0, 1 - h, 1 + after), (0.0, a, a)) if after else held((0.0, 1 - h), (0.0, a))
    stop = JointStop("A", None, 0.0, restitution=e)
    found = simulate(Scene(ALONE, (begins, 0.0), (v / 2, 0.0), end, (stop, knots)))
    first, second = found.impacts[:2]
    assert second.time - first.time == pytest.approx(flight, abs=1e-15)
    exact = -e * e * v + a * (end - 1 - flight)
    assert abs(found.u[0, -1] - exact) <= found.error
