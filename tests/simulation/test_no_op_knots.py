"""A sampled torque of zero changes nothing, wherever its knots are beside events."""

import math

import numpy as np
import pytest

from twolink.chain import Chain
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.joint_friction import JointFriction
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


@pytest.mark.parametrize("law", ["hertz", "hunt-crossley"])
@pytest.mark.parametrize("speed", [1.0, 1e-4])
@pytest.mark.parametrize("after", [1e-12, 1e-9, 1e-6, 1e-4])
def test_a_knot_shortly_after_a_point_meets_a_soft_surface(law, speed, after):
    """The depth of B is sin q1, and its root, by which time passes, begins with zero."""
    loss = {} if law == "hertz" else {"loss": 0.2}
    soft = CompliantSurface((0.0, 0.0), (0.0, -1.0), law, stiffness=2000.0, on=("B",), **loss)
    begin = -0.2 * speed

    def moved(*more):
        return simulate(Scene(ALONE, (begin, 0.0), (speed, 0.0), 1.0, (soft, *more)))

    free = moved()
    meets = free.events[1].time
    assert meets == pytest.approx(0.2, abs=1e-12)
    knotted = moved(held((0.0, meets + after), (0.0, 0.0)))
    assert knotted.met
    assert np.abs(knotted.q - free.q).max() <= knotted.error + free.error


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


@pytest.mark.parametrize("knot", [None, 0.2, 0.3, 0.6, 0.8, 0.95])
@pytest.mark.parametrize("spin", [0.0, 1.0])
def test_two_static_frictions_hold_a_link_together_while_the_other_turns(knot, spin):
    """A holds 2 N m, and B, pressed with N, 0.6 N sin 45° more; while they slide it is half.

    A torque that grows moves link 1 at 1 s, when it exceeds the moment of N and both static limits,
    and no knot before makes it slide against kinetic friction. Link 2 turns by itself.
    """
    depth, stiffness, lever = 1e-3, 4000.0, math.sqrt(0.5)
    push = stiffness * depth
    soft = CompliantSurface(
        (0.0, lever - depth), (0.0, -1.0), "kelvin-voigt", stiffness=stiffness, on=("B",),
        friction=0.3, static=0.6,
    )  # fmt: skip
    hold = 2.0 + 0.6 * push * lever
    # The push turns link 1 backward.
    most = hold + push * lever
    torque = SampledTorque((0.0, 2.0), (0.0, 2 * most), (0.0, 0.0), "linear")
    effects = (JointFriction((1.0, 0.0), (2.0, 0.0)), soft, torque)
    if knot is not None:
        effects = (*effects, held((0.0, knot), (0.0, 0.0)))
    found = simulate(Scene(ALONE, (math.pi / 4, 0.0), (0.0, spin), 1.5, effects))
    assert found.met
    assert np.all(found.u[0, found.t < 1.0] == 0)
    assert found.u[0].max() > 0.01
    # Kinetic friction would not hold the link against the push alone.
    assert found.notes[0].startswith("At 0 s the laws of contact leave a choice: A sticks, B on")
    slides = [event.time for event in found.events if "A slips" in str(event.mode)]
    assert slides[0] == pytest.approx(1.0, abs=1e-9)
