"""The state at the start of a run: gaps, touched contacts, pressed surfaces, slides."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.simulation.hybrid import BALANCED, BARS, state_of, system_of
from twolink.chain import Chain
from twolink.contact.force_laws import Phase
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.end_force import EndForce
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.effects.surface import Surface
from twolink.errors import SimulationError
from twolink.kinematics import position
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.hybrid.jump import settle
from twolink.simulation.hybrid.start import start_state, through_start

Q = (0.3, 1.2)
HEIGHT = math.sin(0.3) + math.sin(1.2)


def floor(depth=0.0, **more):
    """Return a floor that D is `depth` below."""
    return Surface((0.0, HEIGHT - depth), (0.0, -1.0), **more)


def cushion(depth=0.0, law="kelvin-voigt", stiffness=100.0, **more):
    return CompliantSurface((0.0, HEIGHT - depth), (0.0, -1.0), law, stiffness, **more)


def start(*effects, q=Q, u=(0.0, 0.0), **more):
    return state_of(system_of(*effects, **more), q, u)


def test_gaps_are_distances_and_friction_has_none():
    state = start(JointFriction((1.0, 0.0)), floor(-0.25), JointStop("A", upper=1.0))
    assert state.gaps[0] is None
    assert state.gaps[1:] == pytest.approx((0.25, 0.7), abs=1e-15)
    assert state.touching == frozenset()
    assert (state.t, state.q, state.u) == (0.0, Q, (0.0, 0.0))


def test_a_point_at_rest_on_a_surface_touches_it():
    """Also if the place is rounded: a scene's numbers are float64."""
    for error in (0.0, 1e-16, -1e-15):
        state = start(floor(error))
        assert state.touching == {0}
        assert state.gaps == (0.0,)


@pytest.mark.parametrize(
    ("u", "touching"),
    [
        ((0.0, 0.0), {0}),
        ((1.0, -2.0), set()),
        # Towards the stop: an impact comes first, and nothing rests before it.
        ((-1.0, 2.0), set()),
        ((0.0, 2.0), {0}),
    ],
)
def test_a_contact_is_touched_only_without_speed_along_it(u, touching):
    state = start(JointStop("A", lower=0.0), q=(0.0, 0.7), u=u, chain=BALANCED)
    assert state.touching == touching
    assert state.gaps == (0.0,)


def test_a_start_inside_a_rigid_contact_is_refused():
    with pytest.raises(SimulationError, match=r"D on surface: .*; got a start 0\.01 m inside"):
        start(floor(0.01))


def test_a_start_in_a_compliant_surface_is_pressed():
    state = start(cushion(0.02), cushion(0.02, "hertz"))
    assert state.touching == {0, 1}
    damped, ball = state.compliant
    assert damped.sqrt_depth is None
    assert ball.sqrt_depth == pytest.approx(math.sqrt(0.02), rel=1e-13)


def test_a_start_that_moves_out_faster_than_the_surface_leaves_it_behind():
    """k δ + c dδ/dt = 2 − 4 v N: zero at 0.5 m/s."""
    for speed, touching in [(0.4, {0}), (0.6, set())]:
        u = (-speed / math.cos(0.3), 0.0)
        state = start(cushion(0.02, loss=4.0), u=u)
        assert state.touching == touching
        residual = state.compliant[0].residual_depth
        assert residual == (0 if touching else pytest.approx(0.02, rel=1e-12))


@pytest.mark.parametrize(("speed", "touching"), [(1.0, {0}), (0.0, {0}), (-1.0, set())])
def test_a_point_on_a_compliant_surface_presses_unless_it_recedes(speed, touching):
    state = start(cushion(0.0, "hertz"), u=(0.0, speed))
    assert state.touching == touching
    root = state.compliant[0].sqrt_depth
    if speed > 0:
        assert root == 0
    elif speed == 0:
        # Its root must be able to grow.
        assert 0 < root < 1e-7
    else:
        assert root is None


@pytest.mark.parametrize(
    ("u", "sliding"),
    [
        ((0.0, 0.0), (0, 0, 0)),
        ((1.0, 1.0), (1, 0, -1)),
        ((-1.0, 2.0), (-1, 1, -1)),
        ((0.0, -1.0), (0, -1, 1)),
    ],
)
def test_elements_slide_as_their_coordinates_move(u, sliding):
    """q1, q2 − q1, and the end along x: −sin(q1) u1 − sin(q2) u2."""
    expected = (np.sign(u[0]), np.sign(u[1] - u[0]), np.sign(-np.sin(Q) @ u))
    assert sliding == expected
    assert start(JointFriction((1.0, 1.0)), EndForce(1.0, 0.5), u=u).sliding == sliding


def test_a_speed_of_round_off_does_not_slide():
    u = (0.3, 0.1 + 0.2)
    assert u[1] != u[0]
    assert start(JointFriction((0.0, 1.0)), u=u).sliding == (0,)


@pytest.mark.parametrize("precision", ["long double", "quadruple"])
def test_a_start_is_in_the_numbers_of_the_precision(precision):
    system = system_of(floor(-0.5), precision=precision)
    state = state_of(system, Q, (0.5, 0.25))
    numbers = [state.t, *state.q, *state.u, *state.gaps]
    assert {type(number) for number in numbers} == {system.number}
    assert [float(x) for x in state.q] == list(Q)


@pytest.mark.parametrize("precision", ["double", "long double", "quadruple"])
def test_elements_along_one_line_slide_or_rest_together_in_every_precision(precision):
    """The tip of a folded chain rests but for the rounding of float64, which is a speed beside it.

    If its friction on a surface slid while that of the end force stuck, no mode would have both.
    """
    bars = Chain.uniform_bars(length=(1.0, 0.7))
    for angle in (-2.5, 0.37, 1.13, 2.9):
        q, u = (angle, angle + math.pi), (1.1, 1.1 / 0.7)
        tip = tuple(position(bars, q, bars.D))
        surface = CompliantSurface(tip, (0.0, -1.0), "kelvin-voigt", 1e4, friction=0.5)
        system = system_of(EndForce(5.0, 0.3), surface, chain=bars, precision=precision)
        state = state_of(system, q, u)
        assert state.touching == {1}
        assert state.sliding == (0, 0)


def test_a_start_on_a_stiff_surface_is_placed_on_it_in_every_precision():
    """A float64 pose misses the surface by rounding, and 1e12 N/m make 1e-4 N of that."""
    for precision in ("double", "long double", "quadruple"):
        system = system_of(cushion(0.0, stiffness=1e12), precision=precision)
        state = state_of(system, Q)
        assert state.touching == {0}
        element = system.elements[0]
        gap = element.normal.coordinate(system.chain, state.q) - element.bound
        assert abs(float(gap)) <= 4 * system.rounding


@pytest.mark.parametrize("precision", ["long double", "quadruple"])
def test_a_start_on_a_surface_that_recedes_is_placed_on_it_too(precision):
    """Its gap is zero, and so it is where it comes back."""
    surface = cushion(0.0, stiffness=1e12)
    state = state_of(system := system_of(surface, precision=precision), Q, (-1.0, 0.0))
    assert state.touching == frozenset()
    element = system.elements[0]
    gap = element.normal.coordinate(system.chain, state.q) - element.bound
    assert state.gaps[0] == 0
    assert abs(float(gap)) <= 4 * system.rounding


@pytest.mark.parametrize(("speed", "slack"), [(0.4, False), (0.6, True)])
def test_a_start_in_a_hunt_crossley_surface_never_pulls(speed, slack):
    """The force k δ (1 + a dδ/dt) is zero at 1/a = 0.5 m/s, and there is none beyond."""
    u = (-speed / math.cos(0.3), 0.0)
    system = system_of(cushion(0.02, "hunt-crossley", loss=2.0))
    state = state_of(system, Q, u)
    assert state.touching == {0}
    own = state.compliant[0]
    assert own.residual_depth == 0
    assert (own.plastic is not None and own.plastic.phase is Phase.SLACK) == slack


@pytest.mark.parametrize("precision", ["double", "long double", "quadruple"])
def test_a_start_on_rigid_surfaces_is_exact_in_every_precision(precision):
    """B and D rest on two surfaces, as exactly as float64 can say it; C1 is above the first."""
    q = (0.3, 1.2)
    heights = math.sin(q[0]), math.sin(q[0]) + math.sin(q[1])
    floors = [
        Surface((0.0, heights[0]), (0.0, -1.0), on=("B", "C1"), name="first"),
        Surface((0.0, heights[1]), (0.0, -1.0), on=("D",), name="second"),
    ]
    system = system_of(*floors, precision=precision)
    state = state_of(system, q)
    assert {system.names[i] for i in state.touching} == {"B on first", "D on second"}
    for element, gap in zip(system.elements, state.gaps, strict=True):
        exact = element.normal.coordinate(system.chain, state.q) - element.bound
        assert abs(exact - gap) <= 8 * system.rounding


@pytest.mark.parametrize("precision", ["double", "long double", "quadruple"])
def test_a_speed_of_rounding_along_a_rigid_surface_is_removed(precision):
    q, u1 = (0.3, 1.2), 0.7
    u2 = -u1 * math.cos(q[0]) / math.cos(q[1])
    floor = Surface((0.0, math.sin(q[0]) + math.sin(q[1])), (0.0, -1.0))
    system = system_of(floor, precision=precision)
    state = state_of(system, q, (u1, u2))
    speed = system.elements[0].normal.speed(system.chain, state.q, state.u)
    assert state.touching == {0}
    assert abs(speed) <= 8 * system.rounding


@pytest.mark.parametrize("error", [0.0, 1e-16, -1e-16])
@pytest.mark.parametrize("precision", ["long double", "quadruple"])
def test_gaps_agree_with_the_pose_that_lies_on_an_approached_contact(precision, error):
    """It lies on the floor by float64's rounding only; the wall's gap follows from its pose."""
    wall = Surface((-1.0, 0.0), (1.0, 0.0), on=("D",), name="wall")
    system = system_of(floor(error), wall, precision=precision)
    state = state_of(system, Q, (1.0, 1.0))
    assert state.touching == frozenset()
    assert state.gaps[0] == 0
    for element, gap in zip(system.elements, state.gaps, strict=True):
        distance = element.normal.coordinate(system.chain, state.q) - element.bound
        assert abs(float(distance - gap)) < 16 * system.rounding


@pytest.mark.parametrize("precision", ["long double", "quadruple"])
@pytest.mark.parametrize("rigid_first", [True, False])
@pytest.mark.parametrize("u", [(0.0, 0.0), (1.0, 0.5), (-1.0, -0.5)])
def test_a_depth_is_that_of_the_pose_on_the_other_contacts(precision, rigid_first, u):
    """The stop at A moves the pose by round-off of float64, which is a force of a stiff surface."""
    stiff = cushion(1e-6, law="hertz", stiffness=1e10)
    stop = JointStop("A", upper=Q[0] * (1 + 2.0**-51))
    effects = (stop, stiff) if rigid_first else (stiff, stop)
    system = system_of(*effects, chain=BALANCED, precision=precision)
    state = state_of(system, Q, u)
    element = system.elements[rigid_first]
    gap = element.normal.coordinate(system.chain, state.q) - element.bound
    root = state.compliant[rigid_first].sqrt_depth
    assert float(root * root + gap) == pytest.approx(0, abs=20 * system.rounding)
    assert state.q[0] != system.number(Q[0])


@pytest.mark.parametrize("precision", ["long double", "quadruple"])
def test_a_start_on_a_rigid_and_a_compliant_surface_is_on_both(precision):
    stop = JointStop("A", upper=Q[0] * (1 + 2.0**-51))
    system = system_of(cushion(1e-16), stop, chain=BALANCED, precision=precision)
    state = state_of(system, Q, (-1.0, 0.5))
    for element in system.elements:
        gap = element.normal.coordinate(system.chain, state.q) - element.bound
        assert abs(float(gap)) <= 10 * system.rounding


@pytest.mark.parametrize("precision", ["double", "long double", "quadruple"])
def test_a_placement_near_a_singular_pose_closes_a_stop_without_an_error(precision):
    """D is put on the floor by turning A onto its stop, which was open by 5e-11 rad."""
    q1 = math.pi / 2 - 1e-4
    stop = JointStop("A", upper=q1 + 5e-11)
    ground = Surface((0.0, 2 * math.sin(q1) + 2e-14), (0.0, -1.0))
    state = start(ground, stop, q=(q1, q1), precision=precision)
    assert min(float(gap) for gap in state.gaps) >= 0


@pytest.mark.parametrize("precision", ["double", "long double", "quadruple"])
def test_a_contact_that_cannot_move_leaves_the_placement_to_others(precision):
    """The chain is stretched along the normal of the ground."""
    wall = CompliantSurface((1e-15, 0.0), (-1.0, 0.0), "kelvin-voigt", 1e9)
    ground = Surface((0.0, 2.0), (0.0, -1.0))
    system = system_of(ground, wall, chain=BALANCED, precision=precision)
    state = state_of(system, (math.pi / 2, math.pi / 2))
    gap = system.elements[1].normal.coordinate(system.chain, state.q) - system.elements[1].bound
    assert abs(float(gap)) <= 2 * system.rounding


@pytest.mark.parametrize(("speed", "phase"), [(-0.4, "DENTED"), (0.0, "FLOWS"), (0.4, "FLOWS")])
def test_a_start_in_a_yielding_surface_that_moves_out_is_on_the_curve_of_restitution(speed, phase):
    """Also beside a surface on which the point slides, which has its own normal."""
    ball = CompliantSurface(
        (0.0, HEIGHT - 1e-4), (0.0, -1.0), "elasto-plastic", radius=0.02, modulus=(2e11, 2e11),
        poisson=(0.3, 0.3), strength=(1e9, 1e9),
    )  # fmt: skip
    wall = Surface((math.cos(0.3) + math.cos(1.2), 0.0), (-1.0, 0.0))
    # D moves along the wall, down into the surface or out of it.
    J = np.array([[-math.sin(0.3), -math.sin(1.2)], [math.cos(0.3), math.cos(1.2)]])
    u = tuple(np.linalg.solve(J, [0.0, speed]).tolist())
    system = system_of(ball, wall)
    state = state_of(system, Q, u)
    own = state.compliant[0].plastic
    assert own.phase is Phase[phase]
    if speed < 0:
        assert own.deepest == pytest.approx(1e-4, rel=1e-9)
        after = settle(system, state, {}).state
        assert after.u == pytest.approx(u, rel=1e-9)


NEARLY_STRAIGHT = (math.pi / 2 - 1e-4, math.pi / 2 + 1e-4)
LOWEST = math.sin(NEARLY_STRAIGHT[0]) + math.sin(NEARLY_STRAIGHT[1])


def above(gap, normal=(0.0, -1.0)):
    """Return a floor that D is above by a gap (m) where it is nearly at its lowest place."""
    return Surface((0.0, LOWEST + gap), normal, restitution=0.5)


@pytest.mark.parametrize("precision", ["double", "long double", "quadruple"])
def test_a_gap_beyond_the_rounding_of_a_place_is_open(precision):
    """Its closing would move the pose by 7e-11 rad."""
    system = system_of(above(1.3e-14), precision=precision)
    state = state_of(system, NEARLY_STRAIGHT)
    assert [float(x) for x in state.q] == list(NEARLY_STRAIGHT)
    assert not state.touching
    assert float(state.gaps[0]) == pytest.approx(1.3e-14, rel=0.1)
    # Far from the singular pose it is open as well.
    assert not start(floor(-1.3e-14), precision=precision).touching
    assert start(floor(-1e-15), precision=precision).touching == {0}
    assert start(floor(1.3e-14), precision=precision).touching == {0}


def test_a_gap_of_the_rounding_of_large_angles_is_closed():
    q = 2 * math.pi * 5 + 0.3, 2 * math.pi * 7 + 1.2
    gap = 2.0**-47
    height = math.sin(q[0]) + math.sin(q[1]) + gap
    for turned, touching in ((q, {0}), (Q, set())):
        assert start(Surface((0.0, height), (0.0, -1.0)), q=turned).touching == touching


@pytest.mark.parametrize("gap", [1.3e-14, 2e-14])
def test_a_stop_that_is_open_by_more_than_a_rounding_is_struck(gap):
    """A strong torque turns link 1 to it from rest, and it strikes it with √(2 a gap)."""
    stop = JointStop("A", upper=0.5 + gap, restitution=1.0)
    torque = JointTorque((3e8, 0.0))
    scene = Scene(BALANCED, (0.5, 0.5), (0.0, 0.0), 1e-8, (stop, torque), 1e-9)
    found = simulate(scene)
    assert found.impacts[0].speeds[0] == pytest.approx(-math.sqrt(2e8 * (stop.upper - 0.5)))


@pytest.mark.parametrize("gap", [0.0, 4e-16, -4e-16, -1.3e-14])
def test_a_gap_of_the_rounding_of_a_place_is_closed_in_every_pose(gap):
    state = start(above(gap), q=NEARLY_STRAIGHT)
    assert state.touching == {0}
    assert state.gaps == (0,)


@pytest.mark.slow
def test_the_change_of_a_start_is_part_of_the_error_from_the_start_on():
    """All runs share it, as all start on the contact."""
    for gap in (1.3e-14, -1.3e-14):
        scene = Scene(BARS, NEARLY_STRAIGHT, (0.0, 0.0), 0.1, (Gravity(), above(gap)), 1e-9)
        found = simulate(scene)
        changed = np.abs(found.q[:, 0] - NEARLY_STRAIGHT).max()
        assert (changed > 1e-11) == (gap < 0)
        assert changed <= found.error < 1e-9
        assert found.met


@pytest.mark.slow_but_first
@pytest.mark.parametrize("accuracy", [1e-6, 1e-9])
@pytest.mark.parametrize("u", [(2.0, 9.0), (-7.0, 4.0), (4.0, 7.0), (1.0, 4.0)])
@pytest.mark.parametrize("duration", [6.0, 1.0, 3.0])
def test_the_change_of_a_start_grows_with_the_motion(duration, u, accuracy):
    """D leaves the floor at its lowest place: up to the next impact the floor does nothing."""
    free = Scene(BARS, NEARLY_STRAIGHT, u, duration, (Gravity(),), 1e-10)
    exact = simulate(free)
    found = simulate(replace(free, effects=(Gravity(), above(-1.3e-14)), accuracy=accuracy))
    until = np.flatnonzero(found.t < min((impact.time for impact in found.impacts), default=9.0))
    q, u = (np.abs(a[:, until] - b[:, until]) for a, b in ((found.q, exact.q), (found.u, exact.u)))
    assert 1e-10 < max(q.max(), u.max()) <= found.error


def assert_bounded(scene, effects, *, accuracy=1e-14, beside=()):
    """The error bounds the distance from the motion under other effects, beside some times (s)."""
    exact, found = simulate(replace(scene, effects=effects, accuracy=accuracy)), simulate(scene)
    clear = np.all([abs(found.t - t) > 2e-3 for t in beside] or [found.t >= 0], axis=0)
    q, u = (abs(a - b)[:, clear].max() for a, b in ((found.q, exact.q), (found.u, exact.u)))
    assert max(q, u) <= found.error
    return found


@pytest.mark.parametrize(
    ("q", "u", "duration", "gravity"),
    [
        ((1.7e-15, -2.5939690536211275), (5.971731803367533, 3.78795869899978), 2.13, Gravity()),
        # Both links hang upward: the motion begins by the change.
        ((1.7e-15, 0.0), (1e-8, 0.0), 2.0, Gravity(9.81, (-1.0, 0.0))),
    ],
)
def test_the_change_of_a_start_grows_in_its_own_direction(q, u, duration, gravity):
    """Link 1 leaves its stop at once, so that the stop does nothing."""
    stop = JointStop("A", lower=0.0)
    assert_bounded(Scene(BARS, q, u, duration, (gravity, stop), 1e-10), (gravity,))


def test_a_static_limit_that_the_change_of_a_start_decides_is_in_the_error():
    """The moved start sticks, that of the scene slips."""
    static = 18.425887372281743
    rest = Gravity(), JointFriction((static / 2, 0.0), (static, 0.0))
    scene = Scene(BARS, NEARLY_STRAIGHT, (0.0, 7.0), 0.4, (*rest, above(3.2e-15)), 1e-10)
    assert not assert_bounded(scene, rest, accuracy=1e-12).met


def test_an_order_of_impacts_that_the_change_of_a_start_decides_is_in_the_error():
    chain = Chain((1.0, 0.5), (1.0, 1.0), ((0.5, 0.0), (0.0, 0.0)), (0.25, 0.1))
    q1, q2 = NEARLY_STRAIGHT
    stops = (
        JointStop("A", upper=q1 + 0.5, restitution=0.3),
        JointStop("B", upper=q2 - q1 + 0.5 + 6e-11, restitution=0.6),
    )
    scene = Scene(chain, NEARLY_STRAIGHT, (1.0, 2.0), 0.8, (above(-1.3e-14), *stops), 1e-9)
    assert not assert_bounded(scene, stops, accuracy=1e-12, beside=(0.5,)).met


@pytest.mark.parametrize("share", [0.25, 0.75])
def test_a_graze_that_the_change_of_a_start_decides_is_in_the_error(share):
    """A wall between the places that the moved start and that of the scene reach farthest."""
    u, normal = (2.0, 9.0), (1.0, 0.0)
    free = Scene(BARS, NEARLY_STRAIGHT, u, 0.6, (Gravity(),), 1e-13)

    def farthest(run):
        """Return the time (s) and the least x (m) of D."""
        t = np.linspace(0.05, 0.55, 2001)
        for _ in range(5):
            x = position(BARS, run.at(t)[0], BARS.D)[0]
            k = int(np.clip(x.argmin(), 1, len(t) - 2))
            t = np.linspace(t[k - 1], t[k + 1], 201)
        return t[100], x.min()

    (_, one), (at, two) = (
        farthest(simulate(replace(free, effects=(Gravity(), *more))))
        for more in ((), (above(-1.3e-14),))
    )
    assert abs(one - two) > 1e-13
    wall = Surface((one + share * (two - one), 0.0), normal, restitution=0.5, name="wall")
    scene = replace(free, effects=(Gravity(), above(-1.3e-14), wall), accuracy=1e-8)
    assert_bounded(scene, (Gravity(), wall), accuracy=1e-13, beside=(at,))


@pytest.mark.parametrize("precision", ["double", "long double", "quadruple"])
@pytest.mark.parametrize("gap", [1e-16, -1e-16])
def test_contacts_that_are_moved_to_the_start_leave_the_pose_as_it_is(precision, gap):
    """D is beside the floor by a rounding, on a wall within one, and 0.25 m above a ledge."""
    wall = Surface((math.cos(0.3) + math.cos(1.2), 0.0), (-1.0, 0.0))
    system = system_of(
        floor(-gap), wall, floor(-0.25), JointFriction((1.0, 0.0)), precision=precision
    )
    scene = Scene(BARS, Q, (0.0, 0.0), 1.0, system.effects)
    moved = through_start(system, scene)
    state = start_state(moved, scene)
    assert tuple(map(float, state.q)) == Q
    assert state.touching == {0, 1}
    assert state.gaps[:2] == (0, 0)
    assert float(state.gaps[2]) == pytest.approx(0.25, abs=1e-15)
    for before, after in zip(system.elements, moved.elements, strict=True):
        assert abs(after.bound - before.bound) < 1e-15
    assert moved.elements[2:] == system.elements[2:]
    assert moved.with_effects(system.effects).places == moved.places
    assert moved.in_double.places == pytest.approx(system.in_double.places, abs=1e-15)


def test_a_surface_that_a_point_cannot_get_beyond_is_not_touched():
    """The chain hangs down to a floor at exactly its length, and another one 1e-9 m below that."""
    for depth, touching in ((2.0, set()), (2.0 - 1e-9, {0})):
        below = Surface((0.0, depth), (0.0, -1.0), name="floor")
        turned = 0.0 if depth == 2.0 else math.acos(1 - 1e-9)
        state = start(below, q=(math.pi / 2 + turned, math.pi / 2))
        assert state.touching == touching
        assert state.gaps == (0,)


@pytest.mark.parametrize("q", [(-0.84, -0.93), (-1.21, 0.4), (-0.3, 2.0)])
def test_a_chain_without_loads_stays_at_rest_on_a_rough_surface(q):
    """The judge held B on the surface as it is given, beside the pose, and pulled B to it."""
    chain = Chain((2.5, 0.19), (0.52, 0.21), ((0.26, 0.0), (0.105, 0.0)), (0.01, 0.001))
    surface = Surface(
        position(chain, q, chain.B), (0.0, -1.0), on=("B",), restitution=0.84, law="newton-routh",
        friction=2.8, static=4.0, name="s",
    )  # fmt: skip
    run = simulate(Scene(chain, q, (0.0, 0.0), 2.7, (surface,)))
    assert run.met
    assert np.all(run.u == 0)
    assert [str(event.mode) for event in run.events] == ["B on s rests"]


@pytest.mark.parametrize(("size", "touching"), [(1.0, {0}), (1e-4, set())])
def test_a_gap_is_closed_within_the_rounding_of_the_size_of_the_chain(size, touching):
    """A chain of a tenth of a millimetre is 1e-15 m above a floor, which is round-off of 1 m."""
    chain = Chain.uniform_bars((1.0, 1.0), (size, size))
    height = size * (math.sin(Q[0]) + math.sin(Q[1])) + 1e-15
    system = system_of(Surface((0.0, height), (0.0, -1.0), on=("D",)), chain=chain)
    scene = Scene(chain, Q, (0.0, 0.0), 1.0, system.effects)
    assert start_state(system, scene).touching == touching
