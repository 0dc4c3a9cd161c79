"""Doubts of touches and of shallow falls, on steps whose polynomials are written by hand."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.simulation.hybrid import BALANCED, BARS, mode_of, state_of, system_of
from tests.simulation.hybrid.test_certificate import HITS, SYSTEM, block_of, certificate_of, first
from twolink.chain import Chain
from twolink.contact.force_laws import Phase, PlasticState
from twolink.contact.states import ContactState as S
from twolink.contact.states import EventKind as E
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_spring import JointSpring
from twolink.effects.joint_torque import JointTorque
from twolink.effects.sampled_torque import SampledTorque
from twolink.effects.surface import Surface
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.hybrid.block import Block
from twolink.simulation.hybrid.certificate import Certificate
from twolink.simulation.hybrid.compiled import CompiledMode, Watched
from twolink.simulation.hybrid.doubts import may_jump, remarks_of, undecided_at
from twolink.simulation.hybrid.mode import Doubt, Trigger
from twolink.simulation.hybrid.run import hybrid_run
from twolink.simulation.pool import IntegratorPool


def test_a_gap_that_touches_zero_leaves_a_doubt_of_a_slow_impact():
    """(t − 1/4)²: an impact that was passed over would have been of rounding size only."""
    finding, (doubt,) = first(HITS, (1 / 16, -1 / 2, 1))
    assert finding is None
    assert doubt.trigger == HITS
    assert 0 < doubt.speed < 1e-6


def test_a_doubt_beside_a_clock_has_the_time_and_the_speed_of_the_motion():
    """(s − 1/4)² on the second step, on which t = 2 + 3/4 + 4 s."""
    steps = [[(1, 0.1), (0, 1.5)], [(1 / 16, -1 / 2, 1), (0.75, 4)]]
    state = state_of(SYSTEM, (-0.3, -0.2))._replace(t=2.0)
    found = certificate_of(HITS, clock=1, span=9.0, state=state)
    _, (doubt,) = found.first_event(block_of(steps, (0.5, 0.5)), False)
    _, (in_time,) = first(HITS, (1 / 16, -1 / 2, 1))
    assert doubt.time == pytest.approx(3.75, rel=1e-6)
    assert doubt.time < doubt.until == pytest.approx(3.75, rel=1e-12)
    assert doubt.speed == pytest.approx(in_time.speed / 4, rel=1e-6)


@pytest.mark.parametrize("rate", [0.5, 0.5 + 1e-9])
def test_a_gap_that_is_least_where_the_clock_stands_has_not_grazed(rate):
    """(s − 1/4)², and t = rate s − s² beside it: the press ends at s = 1/4."""
    block = block_of([[(1 / 16, -1 / 2, 1), (0, rate, -1)]])
    assert certificate_of(HITS, clock=1, span=9.0).first_event(block, False)[1] == ()


def test_a_limit_that_is_touched_leaves_the_motion_open_if_static_friction_is_higher():
    """Joint A may break loose, and would then slide with less friction; in B both are one."""
    touching = (1 / 16, -1 / 2, 1)
    _, (doubt,) = first(Trigger(E.BREAKS, 1, 1), touching)
    assert doubt.speed == math.inf
    assert doubt.time < doubt.until
    assert (doubt.time, doubt.until) == pytest.approx((0.25, 0.25), abs=1e-6)
    assert first(Trigger(E.BREAKS, 2, 1), touching) == (None, ())


def ramp(after):
    """Return a scene whose torque reaches the static limit of A at 1 s, and is `after` at 2 s."""
    torque = SampledTorque((0.0, 1.0, 2.0), (0.0, 1.5, after), (0.0, 0.0, 0.0), "linear")
    friction = JointFriction((1.0, 0.0), (1.5, 0.0))
    return Scene(BALANCED, (0.0, 0.0), (0.0, 0.0), 2.0, (torque, friction))


def test_a_limit_that_is_reached_where_the_torque_has_a_corner_is_decided_there():
    """Beyond the corner the torque exceeds the limit: A breaks loose at 1 s."""
    found = simulate(ramp(3.0))
    assert found.met
    assert found.notes == ()
    assert [event.time for event in found.events] == [0.0, 1.0]


def test_a_limit_that_a_torque_touches_where_it_turns_back_leaves_the_motion_open_from_there_on():
    """Coulomb's law admits that A sticks and that it slips."""
    found = simulate(ramp(0.0))
    assert found.holds_until == found.t[found.t < 1.0][-1]
    assert found.error == math.inf
    assert found.notes[0].endswith(
        "the error after that is unknown, as round-off decides at 1 s whether a static friction "
        "limit is reached (A)."
    )
    assert found.notes[1].startswith("At 1 s the error of the run decides")


@pytest.mark.slow_but_first
@pytest.mark.parametrize("accuracy", [1e-9, 1e-6, 1e-4])
def test_a_static_limit_within_the_error_of_the_judge_is_a_doubt(accuracy):
    """Link 2 falls from nearly upright, and loads the friction of A up to a peak.

    The limit is above the peak by 1e-12 N m in the run and its judge, which stick, and below it in
    113 bits.
    """
    static = 27.57014597655747
    torque = JointTorque((0.0, 0.0), (6.0, 0.0), (3.0, 1.0), (0.3, 0.0))
    effects = Gravity(), torque, JointFriction((static / 2, 0.0), (static, 0.0))
    scene = Scene(BARS, (math.pi / 2, -math.pi / 2 - 1e-8), (0.0, 0.0), 6.5, effects, accuracy)
    found, exact = simulate(scene), simulate(scene, accuracy=1e-13)
    q, u = (abs(a - b).max() for a, b in ((found.q, exact.q), (found.u, exact.u)))
    assert max(q, u) <= found.error
    assert found.met


@pytest.mark.parametrize(("kinetic", "doubted"), [(1.0, True), (1.5, False)])
def test_a_limit_that_is_nearly_reached_leaves_a_doubt_for_errors_as_large(kinetic, doubted):
    """The torque at A comes to 1e-5 N m from the static limit; the motion is known if it is alike.

    Where the limit is the kinetic one as well, a slide would begin without an acceleration.
    """
    torque = JointTorque((0.0, 0.0), (1.5 - 1e-5, 0.0), (1.0, 1.0))
    friction = JointFriction((kinetic, 0.0), (1.5, 0.0))
    run = hybrid_run(Scene(BALANCED, (0.0, 0.0), (0.0, 0.0), 2.0, (torque, friction)), [0.0, 2.0])
    assert len(run.doubts) == doubted
    assert run.remarks == ()
    for doubt in run.doubts:
        assert (doubt.trigger.kind, doubt.change) == (E.BREAKS, math.inf)
        assert doubt.time < doubt.until == pytest.approx(math.pi / 2, abs=1e-6)
        # The limit depends on neither angle nor speed.
        assert doubt.within > 1


@pytest.mark.parametrize("precision", ["double", "long double", "quadruple"])
@pytest.mark.parametrize("stiffness", [1.0, 1e4, 1e8])
def test_a_doubt_on_a_limit_counts_for_errors_that_bridge_the_distance(stiffness, precision):
    """A spring of k N m/rad at A takes 1e-5 N m at an angle of 1e-5/k."""
    effects = (
        JointSpring((stiffness, 0.0)),
        JointTorque((0.0, 0.0), (1.5 - 1e-5, 0.0), (1.0, 1.0)),
        JointFriction((1.0, 0.0), (1.5, 0.0)),
    )
    scene = Scene(BALANCED, (0.0, 0.0), (0.0, 0.0), 2.0, effects)
    (doubt,) = hybrid_run(scene, [0.0, 2.0], precision=precision).doubts
    assert doubt.within == pytest.approx(1e-5 / stiffness, rel=1e-3)


def test_a_limit_that_is_reached_at_the_end_of_a_motion_leaves_no_doubt():
    found = simulate(replace(ramp(3.0), duration=1.0))
    assert found.met
    assert found.notes == ()


def test_only_doubts_on_a_limit_that_last_until_the_end_are_decided_there():
    breaks = Trigger(E.BREAKS, 1, 1)
    lasts, ends = (Doubt(0.5, breaks, math.inf, math.inf, until) for until in (1.0, 0.6))
    hits = Doubt(0.5, HITS, 1e-9, 2.0, 1.0)
    assert undecided_at((lasts, ends, hits), 1.0) == ([ends, hits], [lasts])


@pytest.mark.parametrize(("least", "doubted"), [(1e-14, True), (1e-9, False)])
def test_a_flight_just_above_zero_leaves_a_doubt_of_a_slow_impact(least, doubted):
    """(t − 1/4)² and a gap that the error of a run may have made."""
    found, doubts = first(HITS, (1 / 16 + least, -1 / 2, 1))
    assert found is None
    assert [doubt.trigger for doubt in doubts] == [HITS] * doubted
    assert all(1e-7 < doubt.speed < 1e-5 for doubt in doubts)


@pytest.mark.parametrize(("depth", "doubted"), [(1e-14, True), (1e-9, False)])
def test_a_fall_just_below_zero_leaves_a_doubt_of_a_slow_impact(depth, doubted):
    """(t − 1/4)² less a depth that the error of a run may have made."""
    found, doubts = first(HITS, (1 / 16 - depth, -1 / 2, 1))
    assert found.trigger == HITS
    assert [doubt.trigger for doubt in doubts] == [HITS] * doubted
    assert all(1e-8 < doubt.speed < 1e-5 for doubt in doubts)
    assert all(0 < doubt.change < 1e-5 for doubt in doubts)


def test_a_touch_at_the_end_of_the_reach_leaves_the_motion_in_doubt():
    """B over a floor at its lowest place: any impact reverses u1, however slow it is."""
    floor = Surface((0.0, 1.0), (0.0, -1.0), on=("B",))
    system = system_of(Gravity(), floor, chain=BARS)
    series = [math.pi / 2 - 0.25, 1.0]
    gap = [1 - math.sin(math.pi / 2 - 0.25), -math.cos(math.pi / 2 - 0.25)]
    for k in range(2, 20):
        gap.append(-((-1) ** (k // 2)) * (math.sin, math.cos)[k % 2](series[0]) / math.factorial(k))
    row = [series, [0.3], [1.0], [0.0], gap]
    rows = np.array([[[*each, *[0.0] * (20 - len(each))] for each in row]])
    block = Block(np.array([0.0]), np.array([0.5]), rows)
    compiled = CompiledMode(
        pool=IntegratorPool(None), operations=0, numbers=0,
        watched=(Watched(Trigger(E.HITS, 0), 4, 1.0, False),), gaps=(0,), recovering=(),
        roots=(), moving=(), clock=None, integrals=slice(0, 0), number=float, kind=None,
    )  # fmt: skip
    _, doubts = Certificate(system, compiled, mode_of(system, S.OPEN), 1.0).first_event(block, True)
    (doubt,) = doubts
    assert doubt.speed < 1e-5
    assert 0.5 < doubt.change < 10


def test_a_bounce_below_the_round_off_of_the_gap_leaves_no_doubt():
    found, doubts = first(HITS, (0, 1e-15, -1.5e-15))
    assert found is None
    assert doubts == ()


def test_a_doubt_that_changes_the_motion_is_noted():
    large = Doubt(0.5, Trigger(E.HITS, 1), 1e-9, 2.0, 0.5)
    small = Doubt(0.6, HITS, 1e-9, 1e-8, 0.6)
    (remark,) = remarks_of([small, large], ("A", "B on floor"))
    assert remark.time == 0.5
    assert remark.sentence == (
        "At 0.5 s the error of the run decides whether a contact is made (B on floor)."
    )


def test_a_touch_that_a_run_cannot_decide_is_named_and_decided_in_longer_numbers():
    """A floor one rounding above the lowest place of B is hit, 1.5e-8 rad before it."""
    chain = Chain.uniform_bars()
    floor = Surface((0.0, float(np.nextafter(1.0, 0.0))), (0.0, -1.0), on=("B",))
    scene = Scene(chain, (0.3, -0.2), (0.0, 0.0), 1.0, (Gravity(), floor))
    short = hybrid_run(scene, np.array([0.0, 1.0]))
    assert any("decides whether a contact is made (B on surface" in note for note in short.notes)
    found = simulate(scene)
    assert found.met
    assert len(found.impacts) == 1
    q, _ = found.at(found.impacts[0].time)
    assert q[0, 0] == pytest.approx(math.pi / 2 - math.sqrt(2.0**-52), abs=1e-9)
    assert not found.notes


def cushioned(speed, torque, height, radius, poisson, strength, duration):
    """Return a scene in which D falls onto a yielding floor."""
    law = {"radius": radius, "modulus": (2e11, 2e11), "poisson": (poisson,) * 2}
    floor = CompliantSurface(
        (0.0, height), (0.0, -1.0), "elasto-plastic", strength=(strength,) * 2, **law
    )
    effects = (Gravity(9.81), floor, JointTorque((torque, 0.0)))
    return Scene(BARS, (0.9, 0.8), (speed, 0.0), duration, effects)


@pytest.mark.slow
def test_the_edge_of_a_dent_that_is_almost_reached_is_decided_in_longer_numbers():
    """Beyond the edge the floor is undamaged: a torque of 1e-16 N m changes u by 4e-3 rad/s."""
    scene = cushioned(0.8339019463785469, -9.35554504394531e-16, 1.51, 0.05, 0.3, 2e7, 0.04)
    motion = simulate(scene, accuracy=1e-9)
    assert (motion.met, motion.precision) == (True, "quadruple")
    clear = simulate(replace(scene, u=(0.7, 0.0)), accuracy=1e-9)
    assert clear.met
    assert not clear.notes


@pytest.mark.parametrize(("slower", "within"), [(1e-8, 2.7736e-12), (1e-4, 2.773e-8)])
def test_the_edge_of_a_dent_leaves_a_doubt_for_errors_that_bridge_the_distance(slower, within):
    """Which is in proportion to the speed that D lacks."""
    scene = cushioned(0.8339019463785469 - slower, 0.0, 1.51, 0.05, 0.3, 2e7, 0.04)
    run = hybrid_run(scene, np.linspace(0.0, 0.04, 3), order=15)
    found = [doubt for doubt in run.doubts if doubt.trigger.kind is E.CLEARS]
    assert found[0].within == pytest.approx(within, rel=1e-3)
    assert found[0].change == math.inf


@pytest.mark.slow
def test_the_end_of_a_branch_that_is_almost_reached_is_decided_in_longer_numbers():
    """There the force of the published fits jumps by 7.5 % without Poisson's ratio."""
    scene = cushioned(0.958825191525093, -1.05854524e-14, 1.51, 0.05, 0.0, 1e9, 0.03)
    motion = simulate(replace(scene, q=(0.903, 0.8)), accuracy=1e-8)
    assert (motion.met, motion.precision) == (True, "quadruple")


@pytest.mark.parametrize(
    ("phase", "deepest", "jumps"),
    [
        (Phase.WHOLE, 0.0, False),
        (Phase.YIELDS, 0.0, True),
        (Phase.FLOWS, 0.0, True),
        (Phase.DENTED, 0.9, False),
        (Phase.DENTED, 1 - 1e-12, True),
        (Phase.DENTED, 1.0, False),
        (Phase.DENTED, 2.0, False),
    ],
)
def test_dents_that_end_just_above_a_jump_of_the_force_leave_doubts(phase, deepest, jumps):
    """`deepest` is in the depth of that jump, where compression no longer follows Hertz's law."""
    system = system_of(*cushioned(0.0, 0.0, 1.51, 0.05, 0.3, 2e7, 1.0).effects)
    flows = system.elements[0].hysteresis.material.flow_depth
    dent = PlasticState(phase, 1e9, 0.1 * flows * deepest, flows * deepest)
    mode = mode_of(system, S.CLOSED, dents=[dent])
    assert may_jump(system, mode, Trigger(E.REACHES, 0, 0)) == jumps


@pytest.mark.slow
def test_the_largest_depth_of_a_dent_leaves_no_doubt():
    """B and the end of a folded chain bounce in their dents; the force has no jump there.

    The error over some bounces was that of a run in long doubles, and over many it was unknown.
    """
    floor = CompliantSurface(
        (-0.46520471695263305, -0.4185556300164357), (0.6688511730248831, -0.7433963332861132),
        "elasto-plastic", on=("B", "C2"), friction=1.304683752485035, radius=0.010078204277057452,
        modulus=(2.1e11, 7e10), poisson=(0.3, 0.33),
        strength=(660470869.3076054, 101986411.6066507),
    )  # fmt: skip
    lengths = 0.6257829049226535, 1.22441618620137
    centres = tuple((length, 0.0) for length in lengths)
    masses = 0.34579971173516305, 0.15227623390623207
    chain = Chain(masses, lengths, centres, (0.0, 0.0))
    effects = Gravity(), JointFriction((0.09352985442716065, 0.0)), floor
    start = -2.4089303187697926, 0.7326623348200005
    scene = Scene(chain, start, (0.0, 0.0), 0.02, effects)
    motion = simulate(scene, accuracy=1e-9)
    assert (motion.met, motion.precision, motion.notes) == (True, "double", ())
    assert len([event for event in motion.events if "is in its dent" in str(event.mode)]) > 10
    exact = hybrid_run(scene, motion.t, formulation="kane", precision="quadruple")
    off = np.abs(np.concatenate([motion.q - exact.q, motion.u - exact.u])).max()
    assert float(off) <= motion.error
