"""The order of events at one instant: longer precisions decide it, or the error is unknown.

The mass centres are on the joints or at rest, so that all accelerations are constant, and the
motions are known by rational arithmetic.
"""

import math
from fractions import Fraction

import numpy as np
import pytest

from twolink.chain import Chain
from twolink.effects.end_force import EndForce
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.effects.sampled_torque import SampledTorque
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.hybrid import event_order
from twolink.simulation.hybrid.run import hybrid_run


def scene(inertias, kinetic, static, u, torque, duration):
    """Return a scene in which M = diag(I1 + 5/16, I2)."""
    chain = Chain((0.25, 0.25), (1.0, 1.0), ((0.5, 0.0), (0.0, 0.0)), inertias)
    return Scene(chain, (0.0, 0.0), u, duration, (JointFriction(kinetic, static), torque))


def constant(*torques):
    return SampledTorque((0.0,), *((torque,) for torque in torques), "hold")


def held(times, first, second):
    return SampledTorque(times, first, second, "hold")


def ramp(first, last, second):
    return SampledTorque((0.0, 4.0), (first, last), (second, second), "linear")


ONE_TORQUE = constant(0.3643039261721617, 2.103159965779626)

# A scene and its exact end: q and u.
STOPS_1E_17_APART = (
    scene(
        (1.1528923110718075 - 5 / 16, 2.8343526264919108),
        (0.5957596114850359, 0.3164147796656527), (1.7256410568386347, 0.5771970365144685),
        (1.1631143367019774, -0.4317989690059643), ONE_TORQUE, 4.0,
    ),
    (-4.0831733992859585, 3.739095765065482, -2.5055020573678846, 2.2026928891254065),
)  # fmt: skip
BREAKS_5E_17_BEFORE_A_STOP = (
    scene(
        (2.627126553676231, 2.93959300899294),
        (0.2002260791142027, 0.5088672130685871), (1.6269363991315362, 2.478796541903703),
        (0.0, -0.26860531752560146), ramp(-0.5260966973829528, -1.9124094811392627,
        0.21274617105428723), 1.5,
    ),
    (-0.010531162271037228, -0.15748530805034042, -0.05352128253024021, -0.05352128253024021),
)  # fmt: skip
STOPS_WHERE_LOADS_JUMP = (
    scene(
        (0.9375, 2.5), (0.5, 0.75), (2.25, 2.25), (-0.75, 1.75),
        held((0.0, 1.0, 3.0454545454545454), (-1.5, -1.5, 1.0), (2.0, -2.0, -1.0)), 4.0,
    ),
    (-3.911577626918536, 4.361880165289256, 0.12727272727272732, 0.12727272727272732),
)  # fmt: skip
STOPS_BETWEEN_TWO_JUMPS = (
    scene(
        (2.4375, 3.0), (1.5, 0.0), (1.75, 1.0), (-1.5, -1.25),
        held(
            (0.0, 0.9428571428571427, 0.9428571428571428, 1.1928571428571428),
            (-1.25, -1.25, -2.75, -2.5), (-0.25, -0.25, -0.25, 1.5),
        ), 4.0,
    ),
    (-9.243501855287569, -3.368318452380952, -3.9714285714285715, 0.054166666666666675),
)  # fmt: skip

NEEDED = Fraction(296613368189613915508104307519, 2**98)
"""The least torque that moves B, to 30 digits, by quadruple precision."""


@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    ("scene", "end"),
    [
        STOPS_1E_17_APART,
        BREAKS_5E_17_BEFORE_A_STOP,
        STOPS_WHERE_LOADS_JUMP,
        STOPS_BETWEEN_TWO_JUMPS,
    ],
)
def test_longer_precisions_decide_which_of_two_events_is_the_first(scene, end):
    """The motion depends on it: the error was below 1e-14, and the true one 0.05 to 4."""
    found = simulate(scene)
    assert found.met
    assert np.abs([*found.q[:, -1], *found.u[:, -1]] - np.array(end)).max() <= found.error + 1e-15


@pytest.mark.slow_but_first
@pytest.mark.parametrize("apart", [1e-15, 1e-14])
def test_stops_that_a_precision_resolves_are_in_their_order(apart):
    """A later pulse shortens the longest step, which does not blur slides that come to rest."""
    chain = STOPS_1E_17_APART[0].chain
    u = (1.1631143367019774, float(Fraction(-0.4317989690059643) - 2 * Fraction(apart)))
    torque = held((0.0, 0.95, 0.950001), (0.3643039261721617, 1e4, 0.3643039261721617),
        (2.103159965779626,) * 3)  # fmt: skip
    frictions = STOPS_1E_17_APART[0].effects[0]
    found = simulate(Scene(chain, (0.0, 0.0), u, 1.0, (frictions, torque)))
    assert found.met
    # A slides backward from its stop on, as B was still sliding.
    assert found.at(0.9)[1][0] < -0.1


def at_once(kinetic=(2.0, 0.5), static=(3.5, 1.5)):
    """Return a scene whose slides both come to rest at 1 s, if A has 2 N m and B 1/2 N m."""
    return scene((0.6875, 1.0), kinetic, static, (-4.0, 1.5), constant(0.5, -1.0), 2.0)


@pytest.mark.slow
def test_stops_at_one_instant_leave_the_motion_open_if_it_depends_on_their_order():
    found = simulate(at_once())
    assert found.error == math.inf
    assert found.holds_until == found.t[found.t < 1.0][-1]
    assert "round-off decides at 1 s whether a slide comes to rest" in found.notes[0]
    assert found.notes[1].startswith("At 1 s the error of the run decides whether a slide comes")


def test_stops_at_one_instant_are_no_doubt_if_static_friction_is_the_kinetic_one():
    found = simulate(at_once(static=(2.0, 0.5)))
    assert found.met
    assert found.notes == ()


def test_stops_at_one_instant_are_no_doubt_if_every_order_leads_to_rest():
    run = hybrid_run(at_once(static=(9.0, 9.0)), [0.0, 2.0])
    assert run.doubts == ()
    assert run.arcs[-1].end.u == (0.0, 0.0)


def test_slides_of_a_chain_with_one_degree_of_freedom_stop_as_one_event():
    """B is pressed on its stop, so that the slides in A and of D come to rest together.

    Either of them, held by its static friction alone, would have been another motion.
    """
    effects = (
        JointFriction((0.36, 0.0), (2.98, 0.0)),
        EndForce(2.52, 0.17, static=0.68),
        JointStop("B", upper=0.5),
        JointTorque((-0.71, 2.0)),
    )
    start = Scene(Chain.uniform_bars(), (0.3, 0.8), (1.0, 1.0), 2.0, effects)
    run = hybrid_run(start, [0.0, 2.0])
    assert run.doubts == ()
    assert run.arcs[-1].end.u == (0.0, 0.0)


def test_an_order_is_replayed_where_an_error_may_swap_events(monkeypatch):
    """Events 1e-4 s apart are followed once; their doubt says whether it matters when asked."""
    replayed = []
    monkeypatch.setattr(event_order, "followed", lambda instant, order: replayed.append(order))
    close = scene((0.6875, 1.0), (2.0, 0.5), (3.5, 1.5), (-4.0, 1.50015), constant(0.5, -1.0), 2.0)
    (doubt,) = hybrid_run(close, [0.0, 2.0], judges=True).doubts
    assert 0 < doubt.within < 1e-3
    assert not replayed
    monkeypatch.undo()
    assert doubt.matters()


@pytest.mark.slow_but_first
@pytest.mark.parametrize("excess", [1e-25, -1e-25])
def test_a_limit_that_is_reached_by_less_than_any_error_where_loads_jump_is_decided(excess):
    """The torque has its peak at 2 s, and B breaks loose there if it is above `NEEDED`.

    The error was 1e-15, and the true one 0.37.
    """
    peak = NEEDED + Fraction(excess)
    torque = SampledTorque((0.0, 1.5, 2.0, 2.5), (0,) * 4, (0, 0, peak, 0), "linear")
    effects = Gravity(9.81), JointFriction((50.0, 0.5), (60.0, 2.0)), torque
    scene = Scene(Chain.uniform_bars(), (0.2, 1.4), (0.0, 2.0), 3.0, effects)
    found = simulate(scene)
    assert found.met
    assert any(1.5 < event.time < 2.2 for event in found.events) == (excess > 0)


@pytest.mark.slow
def test_a_note_on_a_choice_ends_where_a_longer_run_has_decided_it():
    """The run in double precision does not know the order, and its judge does."""
    one, _ = BREAKS_5E_17_BEFORE_A_STOP
    assert any("the error of the run decides" in note for note in hybrid_run(one, [0, 1.5]).notes)
    assert simulate(one).notes == ()
