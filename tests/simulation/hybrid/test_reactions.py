"""The reaction to each kind of event."""

import math

import pytest

from tests.simulation.hybrid import (
    BALANCED,
    STOP,
    hitting,
    mode_of,
    state_of,
    stopped_chain,
    system_of,
)
from twolink import Chain, lagrange
from twolink.contact.force_laws import Phase, PlasticState
from twolink.contact.states import ContactState as S
from twolink.contact.states import EventKind as E
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.effects.sampled_torque import SampledTorque
from twolink.effects.surface import Surface
from twolink.errors import IntegrationError
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.hybrid.compliant_state import CompliantState
from twolink.simulation.hybrid.jump import jump
from twolink.simulation.hybrid.mode import Trigger
from twolink.simulation.hybrid.pose import Pose
from twolink.simulation.hybrid.reactions import REACTIONS, press
from twolink.simulation.hybrid.run import hybrid_run


def test_a_contact_that_is_hit_rebounds():
    system = stopped_chain()
    after = jump(system, hitting(system, -2.0), mode_of(system, S.OPEN), Trigger(E.HITS, 0))
    assert after.state.u == (1.0, 0.0)
    assert after.mode.states == (S.OPEN,)
    assert after.state.touching == frozenset()
    assert after.state.gaps == (0.0,)
    (strike,) = after.strikes
    assert strike.speeds == (-2.0, 1.0)
    assert strike.impulse.normal == pytest.approx(3 * 3.0)
    assert strike.time == 2.0


def test_a_contact_without_restitution_rests_after_an_impact():
    system = stopped_chain(restitution=0.0)
    after = jump(system, hitting(system, -2.0), mode_of(system, S.OPEN), Trigger(E.HITS, 0))
    assert after.state.u == (0.0, 0.0)
    assert after.mode.states == (S.CLOSED,)
    assert after.state.touching == {0}
    assert after.delay == 0


def test_a_contact_that_is_reached_without_speed_is_not_struck():
    system = stopped_chain()
    after = jump(system, hitting(system, 0.0), mode_of(system, S.OPEN), Trigger(E.HITS, 0))
    assert after.strikes == ()
    assert after.mode.states == (S.CLOSED,)


@pytest.mark.parametrize(("u1", "touching"), [(1.64, {1}), (0.0, {0, 1})])
def test_a_point_at_its_farthest_place_touches_alone_while_its_link_turns(u1, touching):
    """B cannot move along the normal there; A is at its stop, and leaves it at u1."""
    beyond = Surface((1.0, 1.0), (0.0, 1.0), on=("B",))
    system = system_of(JointStop("A", lower=math.pi / 2), beyond)
    state = state_of(system, (math.pi / 2, 0.0), (u1, 2.0))
    state = state._replace(gaps=(0.0, 0.0), touching=frozenset())
    hits = REACTIONS[E.HITS](system, state, mode_of(system, S.OPEN, S.OPEN), Trigger(E.HITS, 1))
    assert hits.state.touching == touching


def test_a_compliant_contact_that_is_hit_begins_to_press():
    ball = CompliantSurface((0.0, 0.0), (0.0, -1.0), "hertz", 1e6)
    system = system_of(ball)
    state = state_of(system, (-0.5, -0.5))._replace(q=(0.0, 0.0), u=(0.5, 0.5), gaps=(0.0,))
    after = jump(system, state, mode_of(system, S.OPEN), Trigger(E.HITS, 0))
    assert after.mode.states == (S.CLOSED,)
    assert after.state.compliant[0].sqrt_depth == 0
    assert after.state.u == (0.5, 0.5)
    assert after.strikes == ()


def test_a_press_without_speed_starts_at_the_least_depth():
    ball = CompliantSurface((0.0, 0.0), (0.0, -1.0), "hertz", 1e6)
    system = system_of(ball)
    state = state_of(system, (-0.5, -0.5))
    pose = Pose(system.chain, lagrange, (0.0, 0.0))
    for u, least in [((0.0, 0.0), 2.0**-26), ((1.0, 0.0), 0.0)]:
        slow = u == (0.0, 0.0)
        pressed = press(system, state._replace(q=(0.0, 0.0), u=u), pose, 0, slow)
        assert pressed.compliant[0].sqrt_depth == pytest.approx(least, rel=1e-15)
        assert pressed.touching == {0}


@pytest.mark.parametrize(
    ("q", "u"),
    [
        # The row of B's height is 6e-17 m in its lowest place.
        ((-math.pi / 2, 0.0), (-3.0, 0.0)),
        # Round-off of the speed of the other link.
        ((-1.0, 0.0), (-1e-23, 5.0)),
    ],
)
def test_a_press_whose_speed_is_round_off_starts_at_the_least_depth(q, u):
    """From a depth of zero √depth would grow with that speed, and time with √depth: both stood."""
    below = math.sin(q[0])
    surface = CompliantSurface((0.0, below), (0.0, 1.0), "hertz", 1e6, on=("B",))
    system = system_of(surface, chain=BALANCED)
    state = state_of(system, (0.5, 0.0), u)._replace(q=q, gaps=(0.0,), t=2.0)
    after, _, _ = REACTIONS[E.HITS](system, state, mode_of(system, S.OPEN), Trigger(E.HITS, 0))
    assert after.compliant[0].sqrt_depth == system.scales.least_root(0)


def test_a_contact_that_no_longer_pushes_opens():
    system = system_of(JointTorque((1e-9, 0.0)), STOP, chain=BALANCED)
    state = state_of(system, (0.0, 0.0))
    assert state.touching == {0}
    after = jump(system, state, mode_of(system, S.CLOSED), Trigger(E.LEAVES, 0))
    assert after.mode.states == (S.OPEN,)
    assert after.state.touching == frozenset()
    assert after.state.gaps == (0.0,)


def test_a_released_damper_keeps_the_depth_of_zero_force():
    """The force is zero at a depth of c v/k = 0.04 · 0.5 m."""
    cushion = CompliantSurface((0.0, 0.0), (0.0, -1.0), "kelvin-voigt", 100.0, 4.0)
    system = system_of(cushion)
    angle = math.asin(0.01)
    v = 0.5 / (2 * math.cos(angle))
    state = state_of(system, (angle, angle))
    state = state._replace(u=(-v, -v), touching=frozenset({0}))
    after = jump(system, state, mode_of(system, S.CLOSED), Trigger(E.LEAVES, 0))
    assert after.mode.states == (S.OPEN,)
    assert after.state.compliant[0].residual_depth == pytest.approx(0.02)
    assert after.state.gaps == (0.0,)


@pytest.mark.parametrize(
    ("torque", "expected"), [(0.4, S.STICKS), (0.9, S.STICKS), (1.1, S.FORWARD), (-1.1, S.BACKWARD)]
)
def test_a_joint_that_stops_sticks_or_turns_around(torque, expected):
    """Kinetic 0.5 and static 1 N m."""
    system = system_of(
        JointTorque((torque, 0.0)), JointFriction((0.5, 0.0), (1.0, 0.0)), chain=BALANCED
    )
    state = state_of(system, (0.3, 0.0))._replace(u=(1e-17, 0.5), sliding=(1,))
    after = jump(system, state, mode_of(system, S.FORWARD), Trigger(E.STOPS, 0, 1))
    assert after.state.u == (0.0, 0.5)
    assert after.state.sliding == (0,)
    assert after.mode.states == (expected,)


@pytest.mark.parametrize(("sense", "expected"), [(1, S.FORWARD), (-1, S.BACKWARD)])
def test_a_joint_whose_limit_is_reached_begins_to_slide(sense, expected):
    system = system_of(
        JointTorque((sense * 1.0, 0.0)), JointFriction((0.5, 0.0), (1.0, 0.0)), chain=BALANCED
    )
    state = state_of(system, (0.3, 0.0))
    after = jump(system, state, mode_of(system, S.STICKS), Trigger(E.BREAKS, 0, sense))
    assert after.mode.states == (expected,)
    assert after.state.u == (0.0, 0.0)


def test_a_joint_that_a_stop_holds_does_not_slide_at_its_limit():
    system = system_of(
        JointTorque((-3.0, 0.0)), JointFriction((1.0, 0.0), (3.0, 0.0)), STOP, chain=BALANCED
    )
    state = state_of(system, (0.0, 0.0))
    mode = mode_of(system, S.STICKS, S.OPEN)
    after = jump(system, state, mode, Trigger(E.BREAKS, 0, -1))
    assert after.mode.states == (S.PRESSED_BACKWARD, S.CLOSED)


TWIN = Chain((1.0, 1.0), (1.0, 1.0), ((0.5, 0.0), (1.0, 0.0)), (0.1, 0.1))
"""The centre of link 2 is at its end: C2 and D are one place."""


@pytest.mark.parametrize(
    ("depth", "u", "left"),
    [
        (1e-39, (-1.0, -1.0), (S.OPEN, S.OPEN)),
        (1e-39, (1.0, 1.0), (S.OPEN, S.CLOSED)),
        (1e-6, (-1.0, -1.0), (S.OPEN, S.CLOSED)),
    ],
)
def test_points_that_come_out_at_one_instant_leave_together(depth, u, left):
    """The other one has no depth and comes out; it has none and goes in; it is deeper."""
    ground = CompliantSurface((0.0, 0.0), (0.0, -1.0), "hertz", 1e9, on=("C2", "D"))
    system = system_of(ground, chain=TWIN)
    own = tuple(CompliantState(root) for root in (0.0, -math.sqrt(depth)))
    state = state_of(system, (-0.5, -0.5))._replace(
        q=(0.0, 0.0), u=u, gaps=(0.0, 0.0), touching=frozenset({0, 1}), compliant=own
    )
    after = jump(system, state, mode_of(system, S.CLOSED, S.CLOSED), Trigger(E.LEAVES, 0))
    assert after.mode.states == left
    assert after.state.touching == frozenset(i for i in range(2) if left[i] is S.CLOSED)


@pytest.mark.parametrize(
    ("gap", "u", "met"),
    [
        (0.0, (1.0, 1.0), (S.CLOSED, S.CLOSED)),
        (1e-15, (1.0, 1.0), (S.CLOSED, S.CLOSED)),
        (1e-9, (1.0, 1.0), (S.CLOSED, S.OPEN)),
    ],
)
def test_points_that_arrive_at_one_instant_press_together(gap, u, met):
    """The second one starts at the least root, as time would stand still at two that are zero."""
    ground = CompliantSurface((0.0, 0.0), (0.0, -1.0), "hertz", 1e9, on=("C2", "D"))
    system = system_of(ground, chain=TWIN)
    state = state_of(system, (-0.5, -0.5))._replace(q=(0.0, 0.0), u=u, gaps=(0.0, gap))
    after = jump(system, state, mode_of(system, S.OPEN, S.OPEN), Trigger(E.HITS, 0))
    assert after.mode.states == met
    roots = [own.sqrt_depth for own in after.state.compliant]
    assert roots == [0.0, system.scales.least_root(1) if met[1] is S.CLOSED else None]
    assert after.state.u == u


STEEL = CompliantSurface(
    (0.0, 0.0), (0.0, -1.0), "elasto-plastic", radius=0.02, modulus=(2e11, 2e11),
    poisson=(0.3, 0.3), strength=(1e9, 1e9),
)  # fmt: skip


def pressed_steel(share, phase, u=(0.0, 0.0), dent=None):
    """Return a system and a state pressed to a share of the depth of yield."""
    system = system_of(STEEL)
    material = system.elements[0].hysteresis.material
    depth = share * material.yield_depth
    angle = math.asin(depth / 2)
    state = state_of(system, (-0.5, -0.5))
    own = CompliantState(math.sqrt(depth), 0, dent or PlasticState(phase))
    state = state._replace(
        q=(angle, angle), u=u, gaps=(0.0,), touching=frozenset({0}), compliant=(own,)
    )
    return system, state, material


def phase_after(system, state, kind, sense=0):
    dents = (state.compliant[0].plastic,)
    mode = mode_of(system, S.CLOSED, dents=dents)
    return jump(system, state, mode, Trigger(kind, 0, sense))


@pytest.mark.parametrize(
    ("share", "before", "after"),
    [(1.0, Phase.WHOLE, Phase.YIELDS), (1.9, Phase.YIELDS, Phase.FLOWS)],
)
def test_a_surface_that_is_pressed_deeper_yields_and_then_flows(share, before, after):
    system, state, _ = pressed_steel(share, before, u=(0.1, 0.1))
    found = phase_after(system, state, E.REACHES)
    assert found.state.compliant[0].plastic == PlasticState(after)
    assert found.state.compliant[0].sqrt_depth == state.compliant[0].sqrt_depth
    assert found.mode.dents == (PlasticState(after),)
    assert found.mode.states == (S.CLOSED,)


def test_a_surface_that_is_turned_keeps_a_dent():
    system, state, material = pressed_steel(5.0, Phase.FLOWS)
    found = phase_after(system, state, E.TURNS, 1)
    dent = found.state.compliant[0].plastic
    assert dent.phase is Phase.DENTED
    depth = 5 * material.yield_depth
    assert dent.deepest == pytest.approx(depth)
    assert dent.residual == pytest.approx(float(material.residual(depth)))
    assert found.mode.dents == (dent,)


def test_a_dent_that_is_left_behind_is_forgotten():
    system, state, _ = pressed_steel(5.0, Phase.FLOWS)
    dent = PlasticState(Phase.DENTED, 1e9, 1e-6, 2e-6)
    own = CompliantState(None, 0, dent)
    state = state._replace(touching=frozenset(), compliant=(own,), u=(-0.1, -0.1))
    mode = mode_of(system, S.OPEN, dents=(dent,))
    after = jump(system, state, mode, Trigger(E.CLEARS, 0))
    assert after.state.compliant[0].plastic == PlasticState(Phase.WHOLE)
    assert after.state.gaps == (0.0,)
    assert after.mode.states == (S.OPEN,)


@pytest.mark.parametrize(
    ("below", "u", "left"),
    [(0.0, -1.0, True), (1e-15, -1.0, True), (-1e-15, -1.0, True), (1e-9, -1.0, False),
     (0.0, 1.0, False)],
)  # fmt: skip
def test_an_impact_at_the_edge_of_a_dent_ends_it(below, u, left):
    """Link 1 moves up against its stop as D, which moves with it, comes to the edge of its dent."""
    stop = JointStop("A", lower=0.0, restitution=0.5)
    system = system_of(stop, STEEL)
    dent = PlasticState(Phase.DENTED, 1e9, 1e-6, 2e-6)
    state = state_of(system, (0.0, -0.5))
    state = state._replace(
        q=(0.0, 0.0), u=(u, u), gaps=(0.0, 1e-6 - below), touching=frozenset(),
        compliant=(None, CompliantState(None, 0, dent)),
    )  # fmt: skip
    after = REACTIONS[E.HITS](
        system, state, mode_of(system, S.OPEN, S.OPEN, dents=(None, dent)), Trigger(E.HITS, 0)
    ).state
    assert after.compliant[1].plastic == (PlasticState(Phase.WHOLE) if left else dent)
    assert after.gaps[1] == (0.0 if left else 1e-6 - below)


@pytest.mark.parametrize("u2", [1.0, 0.0])
@pytest.mark.parametrize(("q1", "u1", "sliding"), [(0.0, 2.0, (1, 0)), (0.5, 1e-17, (0, 0))])
def test_a_joint_turns_on_where_a_point_of_its_link_passes_a_dead_point(q1, u1, sliding, u2):
    """B slides along x with −sin(q1) u1: it stops at q1 = 0 while link 1 turns on, or with it."""
    floor = CompliantSurface(
        (0.0, math.sin(q1) - 0.1), (0.0, -1.0), "kelvin-voigt", 100.0, friction=0.5, on=("B",)
    )
    system = system_of(JointFriction((1.0, 0.0)), floor)
    state = state_of(system, (q1, 0.7), (u1, u2))._replace(sliding=(1, 1))
    mode = mode_of(system, S.FORWARD, S.FORWARD)
    after = REACTIONS[E.STOPS](system, state, mode, Trigger(E.STOPS, 1, 1)).state
    assert after.sliding == sliding
    assert after.u == (u1 if sliding[0] else 0.0, u2)


TWO_POINTS = Chain((1.0, 1.0), (1.0, 1.0), ((1.0, 0.0), (0.5, 0.0)), (0.05, 1 / 12))
"""The mass centre of link 1 is at B: C1 and B are two points in one place."""


def above_B(angle, **more):
    """Return a rough surface that B reaches from below at an angle of link 1 (rad)."""
    return Surface((0.0, math.sin(angle)), (0.0, -1.0), friction=3.0, name="floor", **more)


@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    ("order", "formulation"), [(15, "lagrange"), (15, "kane"), (21, "lagrange")]
)
def test_points_in_one_place_leave_a_surface_together(order, formulation):
    """Link 2 draws B off a floor, at whose other point in this place friction would wedge link 1.

    One point leaves at N = 0, and so do two: round-off does not let the other one take the force.
    """
    chain = Chain.point_masses(
        (1.129647152228803, 1.6993542656375757), (0.429344931103363, 0.4676012464868387)
    )
    q, u = (-1.0019654260616537, -3.032177219010494), (-3.673530533968469, 0.5303063909223725)
    found = []
    for on in (("B",), ("B", "C1")):
        floor = Surface(
            (0.20077902173794937, -0.44777262892200326), (0.3339970391961674, 0.9425741232434688),
            on=on, restitution=0.0, friction=2.6556837304320173, static=4.309445435926503,
            law="poisson",
        )  # fmt: skip
        effects = Gravity(9.81), JointDamping((0.06535580164220163, 0.1876561265801057)), floor
        scene = Scene(chain, q, u, 0.87, effects)
        run = hybrid_run(scene, [0.0, 0.87], formulation=formulation, order=order)
        assert any(own is S.CLOSED for arc in run.arcs for own in arc.mode.states)
        assert str(run.arcs[-1].mode) == "moves freely"
        found.append(tuple(map(float, run.u[:, -1])))
    one, two = found
    assert abs(one[0]) > 1
    assert two == pytest.approx(one, rel=1e-11)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("friction", [(0.0, 0.0), (0.0, 1.0)])
@pytest.mark.parametrize("turns", ["at once", "in a jump", "in a ramp"])
def test_a_wedged_link_stays_at_rest_however_its_load_turns_with_a_note(turns, friction):
    """The normal force of B has the arm cos q1, its friction up to 3 sin q1: it may hold any load.

    Link 2 has no load. As the floor only pushes, the laws admit that link 1 leaves as well.
    """
    torque = {
        "at once": JointTorque((-8.0, 0.0)),
        "in a jump": SampledTorque((0.0, 0.2), (3.0, -8.0), (0.0, 0.0), "hold"),
        "in a ramp": SampledTorque((0.0, 0.2, 0.4), (3.0, 3.0, -8.0), (0.0, 0.0, 0.0), "linear"),
    }[turns]
    effects = torque, JointFriction(friction), above_B(0.9, on=("B",))
    found = simulate(Scene(TWO_POINTS, (0.9, 0.3), (0.0, 0.0), 0.5, effects, 1e-9))
    assert tuple(found.u[:, -1]) == (0.0, 0.0)
    assert found.error < 1e-14
    (note,) = found.notes
    assert "the laws of contact leave a choice" in note
    assert "is pressed forward is taken; or" in note
    assert found.events[-1].mode["B on floor"] is S.PRESSED_FORWARD


def test_a_wedged_link_rests_on_its_normal_force_where_its_load_turns_back():
    torque = SampledTorque((0.0, 0.1, 0.3), (-8.0, -8.0, 3.0), (0.0, 0.0, 0.0), "linear")
    found = simulate(
        Scene(TWO_POINTS, (0.9, 0.3), (0.0, 0.0), 0.4, (torque, above_B(0.9, on=("B",))), 1e-9)
    )
    assert tuple(found.u[:, -1]) == (0.0, 0.0)
    assert [event.mode["B on floor"] for event in found.events] == [S.PRESSED_FORWARD, S.CLOSED]


def test_links_that_turn_are_not_stopped_with_a_slide():
    """B rests on its stop, and D slides on: an end of its slide would stop both links."""
    system = system_of(JointStop("B", lower=0.5), Surface((0.0, 1.5), (0.0, -1.0), friction=0.3))
    state = state_of(system, (0.3, 0.8))._replace(
        u=(0.2, 0.2), touching=frozenset({0, 1}), sliding=(0, 1)
    )
    mode = mode_of(system, S.CLOSED, S.FORWARD)
    with pytest.raises(IntegrationError, match=r"whether the links do: they turn at 0\.2 rad/s"):
        REACTIONS[E.STOPS](system, state, mode, Trigger(E.STOPS, 1, 1))
