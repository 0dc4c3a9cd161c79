"""Contacts that are approached, and the slides after their impacts."""

import math
from fractions import Fraction

import pytest

from tests.simulation.hybrid import BALANCED, state_of, system_of
from twolink import lagrange
from twolink.chain import Chain
from twolink.contact.force_laws import Phase, PlasticState
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.effects.sampled_torque import SampledTorque
from twolink.effects.surface import Surface
from twolink.errors import IntegrationError
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.hybrid import collision
from twolink.simulation.hybrid.collision import (
    closed,
    collide,
    direction_of,
    nearby,
    place,
    sliding_after,
    still_sliding,
    surfaces_after,
)
from twolink.simulation.hybrid.pose import Pose
from twolink.simulation.hybrid.resolution import resolve

ONTO = JointTorque((-6.0, 0.0))
"""Link 1 turns to the stop with −2 rad/s²."""


EPSILON = 2.0**-52


def stopped_chain(*more, restitution=0.5, **options):
    stop = JointStop("A", lower=0.0, restitution=restitution)
    return system_of(ONTO, stop, *more, chain=BALANCED, **options)


def test_contacts_are_nearby_within_the_rounding_of_their_place():
    system = stopped_chain(JointStop("B", upper=1.0))
    state = state_of(system, (0.5, 0.5))
    assert nearby(system, state) == []
    assert nearby(system, state._replace(gaps=(1e-15, 0.5))) == [0]
    assert nearby(system, state._replace(gaps=(1e-15, -1e-15))) == [0, 1]
    assert nearby(system, state._replace(gaps=(1e-13, 0.5))) == []


def test_the_direction_of_a_slide_is_the_sign_of_its_speed_beyond_rounding():
    system = system_of(JointFriction((1.0, 1.0)))
    pose = Pose(system.chain, lagrange, (0.3, 0.2))
    assert sliding_after(system, pose, (5.0, 5.0), (1.0, 3.0), EPSILON) == (1, 1)
    assert sliding_after(system, pose, (5.0, 5.0), (-1.0, -3.0), EPSILON) == (-1, -1)
    assert sliding_after(system, pose, (5.0, 5.0), (1.0, 1.0 + 4e-16), EPSILON) == (1, 0)
    assert direction_of(system, (1.0, 0.0), (5.0, 0.0), (1e-16, 0.0), EPSILON) == 0
    assert direction_of(system, (1.0, 0.0), (1e-9, 0.0), (1e-16, 0.0), EPSILON) == 1


def test_the_sign_of_a_row_that_is_round_off_is_no_direction():
    """The tangent of a surface through A, in the pose in which a link lies on it."""
    system = stopped_chain()
    assert direction_of(system, (1.4e-17, 0.0), (-6.0, 1.0), (-6.0, 1.0), EPSILON) == 0
    assert direction_of(system, (1.4e-9, 0.0), (-6.0, 1.0), (-6.0, 1.0), EPSILON) == -1


def test_a_slide_without_a_speed_has_only_begun():
    system = system_of(JointFriction((1.0, 1.0)))
    pose = Pose(system.chain, lagrange, (0.3, 0.2))
    state = state_of(system, pose.q, (0.0, 3.0))._replace(sliding=(-1, 1))
    assert still_sliding(system, state, pose) == (0, 1)
    assert still_sliding(system, state._replace(sliding=(-1, 0)), pose) == (0, 0)


@pytest.mark.parametrize(
    ("speed", "root", "touches"), [(1.0, "zero", True), (0.0, "least", True), (-1.0, None, False)]
)
def test_a_press_that_an_impact_elsewhere_stops_begins_at_rest_or_ends(speed, root, touches):
    """B has just met a Hertz surface below it as link 2 strikes its stop."""
    surface = CompliantSurface((0.0, 0.0), (0.0, -1.0), "hertz", 100.0, on=("B",))
    system = system_of(surface, JointStop("B", upper=0.0), chain=BALANCED)
    state = state_of(system, (0.0, -1.0), (1.0, 0.0))
    (own, _) = state.compliant
    assert own.sqrt_depth == 0
    struck = surfaces_after(
        system, state._replace(u=(speed, 0.0)), Pose(system.chain, lagrange, (0.0, 0.0))
    )
    roots = {"zero": 0, "least": system.scales.least_root(0), None: None}
    assert struck.compliant[0].sqrt_depth == roots[root]
    assert struck.touching == ({0} if touches else frozenset())


@pytest.mark.parametrize(
    ("phase", "speed", "after"),
    [
        (Phase.DENTED, 1.0, Phase.DENTED),
        (Phase.DENTED, -1.0, Phase.DENTED),
        (Phase.FLOWS, 1.0, Phase.FLOWS),
        (Phase.FLOWS, -1.0, Phase.DENTED),
    ],
)
def test_an_impact_elsewhere_turns_compression_into_restitution(phase, speed, after):
    """B is pressed into steel by a positive speed of link 1."""
    steel = CompliantSurface(
        (0.0, 0.0), (0.0, -1.0), "elasto-plastic", on=("B",), radius=0.02,
        modulus=(2e11, 2e11), poisson=(0.3, 0.3), strength=(3e8, 3e8),
    )  # fmt: skip
    system = system_of(steel, chain=BALANCED)
    state = state_of(system, (1e-4, 0.0))
    own = state.compliant[0]
    dent = PlasticState(phase) if phase is Phase.FLOWS else PlasticState(phase, 1e9, 5e-5, 2e-4)
    own = own._replace(sqrt_depth=math.sqrt(1e-4 - dent.residual), plastic=dent)
    state = state._replace(u=(speed, 0.0), compliant=(own,), touching=frozenset({0}))
    struck = surfaces_after(system, state, system.pose(state.q))
    assert struck.compliant[0].plastic.phase is after
    depth = struck.compliant[0].sqrt_depth ** 2 + struck.compliant[0].plastic.residual
    assert depth == pytest.approx(1e-4)


@pytest.mark.parametrize("precision", ["double", "long double", "quadruple"])
def test_a_contact_is_struck_at_its_own_instant_unless_it_is_a_rounding_away(precision):
    """Both stops are within the rounding of their place, and link 1 moves to them."""
    system = stopped_chain(JointStop("B", upper=0.0), precision=precision)
    speed, instant = 1e-8, 2**10 * system.rounding * 3
    state = state_of(system, (0.5, 0.25))._replace(t=system.number(3), u=(-speed, 0.0))
    for share, expected in [(0.0, [0, 1]), (0.9, [0, 1]), (1.1, []), (100.0, [])]:
        gap = share * instant * speed
        assert nearby(system, state._replace(gaps=(gap, gap))) == [0, 1]
        found = state._replace(gaps=(gap, gap))
        assert closed(system, found, system.pose(found.q)) == expected
        assert bool(collide(system, found, system.pose(found.q)).strikes) == bool(expected)
    # One that is left is open, however near.
    left = state._replace(gaps=(1e-40, 0), u=(speed, 0.0))
    assert closed(system, left, system.pose(left.q)) == [1]


def test_points_that_move_along_one_line_are_struck_together():
    floor = Surface((0.0, 0.0), (0.0, -1.0), on=("B", "C1", "D"))
    system = system_of(floor)
    state = state_of(system, (-0.5, -0.5))._replace(q=(0.0, 0.0), u=(1e-8, 1e-8))
    found = state._replace(gaps=(0.0, 1e-15, 1e-15))
    assert [element.normal.point for element in system.elements] == ["B", "C1", "D"]
    assert closed(system, found, system.pose(found.q)) == [0, 1]


def bounces_from_rest(t):
    """Return the angle and the speed at t (s) under 1 rad/s² onto a stop at 1/2 rad, exactly.

    It is struck at 1 s with 1 rad/s, and its restitution is 1/2: the bounces end at 3 s.
    """
    since, v = t - 1, Fraction(1, 2)
    while since > 2 * v:
        since, v = since - 2 * v, v / 2
    return Fraction(1, 2) - v * since + since * since / 2, since - v


@pytest.mark.slow_but_first
@pytest.mark.parametrize("before", [1e-8, 3e-8, 8e-9])
def test_a_load_that_turns_while_bounces_die_away_does_not_strike_the_stop(before):
    """Link 1 is still 1e-18 to 1e-17 rad from its stop, and then either turns back or reaches it.

    The numbers are powers of two, so that the motion is known exactly.
    """
    turns = 3.0 - before
    angle, speed = bounces_from_rest(Fraction(turns))
    gap = Fraction(1, 2) - angle
    assert 0 < gap < 7e-18
    left, load = Fraction(1), Fraction(-2)
    # A root in float64 has an error of its square.
    discriminant = speed * speed + 2 * load * gap
    if speed > 0 and discriminant > 0:
        root = Fraction(math.sqrt(discriminant))
        root = (root + discriminant / root) / 2
        left, angle, speed = left - (root - speed) / load, Fraction(1, 2), -root / 2
    chain = Chain((0.25, 0.25), (1.0, 1.0), ((0.5, 0.0), (0.0, 0.0)), (0.6875, 1.0))
    torque = SampledTorque((0.0, turns), (1.0, -2.0), (0.0, 0.0), "hold")
    stop = JointStop("A", upper=0.5, restitution=0.5)
    found = simulate(Scene(chain, (0.0, 0.0), (0.0, 0.0), turns + 1, (stop, torque), 1e-12))
    left = Fraction(turns + 1) - Fraction(turns) - 1 + left
    exact = angle + speed * left + load / 2 * left * left, speed + load * left
    ends = found.q[0, -1], found.u[0, -1]
    off = max(abs(float(x - Fraction(float(y)))) for x, y in zip(exact, ends, strict=True))
    assert off <= found.error < 1e-12


@pytest.mark.parametrize("precision", ["double", "long double", "quadruple"])
def test_the_pose_of_a_contact_takes_the_gaps_and_depths_of_others_with_it(precision):
    """Link 1 is placed on a stop; B is pressed into a cushion, and D is above a floor."""
    cushion = CompliantSurface((0.0, 0.0), (0.0, -1.0), "hertz", 100.0, on=("B",))
    floor = Surface((0.0, 1.5), (0.0, -1.0), on=("D",))
    system = stopped_chain(cushion, floor, precision=precision)
    first, press, of_floor = range(3)
    assert [system.elements[i].rigid for i in (first, press, of_floor)] == [True, False, True]
    moved = system.number(2**16 * system.rounding)
    state = state_of(system, (0.0, 0.5))._replace(q=(moved, system.number(0.5)))
    _, own, _ = state.compliant
    depth = system.number(0.25)
    pressed = state._replace(
        t=system.number(1), compliant=(None, own._replace(sqrt_depth=depth), None)
    )
    placed, pose = place(system, pressed, system.pose(pressed.q), first)
    assert placed.q == pose.q
    assert placed.q[0] == 0
    L1 = float(system.scene_chain.L1)
    sinks = float(placed.compliant[press].sqrt_depth ** 2 - depth * depth)
    assert sinks == pytest.approx(-L1 * float(moved), rel=0.1)
    rises = float(placed.gaps[of_floor] - pressed.gaps[of_floor])
    assert rises == pytest.approx(L1 * float(moved), rel=0.1)
    # A gap within the rounding of a place is more accurate than the pose.
    near = pressed.with_gap(of_floor, moved / 2**20)
    again, _ = place(system, near, system.pose(near.q), first)
    assert again.gaps[of_floor] == near.gaps[of_floor]
    # So are those within the change.
    shallow = pressed._replace(
        compliant=(None, own._replace(sqrt_depth=moved**0.5 / 2), None)
    ).with_gap(of_floor, moved / 2)
    assert system.scales.places_of_rounding[of_floor] < moved / 2
    again, _ = place(system, shallow, system.pose(shallow.q), first)
    assert again.gaps[of_floor] == shallow.gaps[of_floor]
    assert again.compliant[press].sqrt_depth == shallow.compliant[press].sqrt_depth


@pytest.mark.parametrize("precision", ["double", "long double", "quadruple"])
def test_a_slide_that_an_impact_leaves_at_a_start_is_at_rest_within_the_rounding_of_float64(
    precision,
):
    """Link 1 is stopped without a rebound, and link 2, which turns on its own, goes on."""
    system = stopped_chain(JointFriction((0.0, 1.0)), restitution=0.0, precision=precision)
    for speed, slides in [(1e-15, 0), (1e-13, 1)]:
        start = state_of(system, (0.0, 0.25), (-1.0, speed))
        left = collide(system, start, system.pose(start.q))
        assert [float(x) for x in left.state.u] == [0.0, speed]
        assert left.state.sliding == (0, slides)
        assert left.doubts == ()
    later = collide(system, start._replace(t=system.number(3), u=(-1.0, 1e-15)), left.pose)
    assert later.state.sliding == (0, 0 if precision == "double" else 1)


@pytest.mark.parametrize("precision", ["double", "long double", "quadruple"])
def test_a_contact_that_an_impact_leaves_with_round_off_of_a_start_is_at_rest_with_a_doubt(
    precision,
):
    """Link 1 is stopped as link 2 is at its own stop, turning away at 1e-15 rad/s."""
    stops = JointStop("A", lower=0.0), JointStop("B", lower=0.0)
    system = system_of(*stops, chain=BALANCED, precision=precision)
    start = state_of(system, (0.0, 0.0), (-1.0, 1e-15))
    left = collide(system, start, system.pose(start.q))
    assert left.state.touching == {0, 1}
    assert left.state.u == (0, 0)
    sizes = [doubt.change for doubt in left.doubts]
    assert sizes == ([] if precision == "double" else [pytest.approx(1e-15)])


def test_impacts_that_only_the_rounding_of_float64_keeps_in_range_leave_the_error_unknown(
    monkeypatch,
):
    def resolved(impacts, *given):
        if impacts.rounding < EPSILON:
            raise IntegrationError("beyond the range of its law")
        return resolve(impacts, *given)

    monkeypatch.setattr(collision, "resolve", resolved)
    system = stopped_chain(precision="long double")
    start = state_of(system, (0.0, 0.25), (-1.0, 0.0))
    (doubt,) = collide(system, start, system.pose(start.q)).doubts
    assert (doubt.speed, doubt.change) == (math.inf, math.inf)
