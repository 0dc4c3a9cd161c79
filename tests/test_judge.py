"""The judge of the fast simulator is right itself: closed forms, laws, and other derivations."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.judge import JudgeGivesUp, State, judge
from tests.judge.equations import Contact, Friction, System, dot
from tests.judge.impact import rough_impulse
from twolink import Scene, kane
from twolink.chain import Chain
from twolink.contact.impact_laws import Response
from twolink.contact.impact_laws import rough_impulse as library_impulse
from twolink.effects.end_force import EndForce
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_spring import JointSpring
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.effects.surface import Surface

BARS = Chain.uniform_bars()
BALANCED = Chain((1.0, 1.0), (1.0, 1.0), ((0.0, 0.0), (0.0, 0.0)), (2.0, 0.5))
"""Both mass centres on the joints: each link turns on its own, and M = diag(3, 0.5)."""
GENERAL = Chain((1.3, 0.7), (1.1, 0.8), ((0.45, 0.05), (0.5, -0.07)), (0.1, 0.05))
UP = (0.0, -1.0)


def scene(*effects, chain=BALANCED, q=(0.0, 0.0), u=(0.0, 0.0), duration=2.0):
    return Scene(chain=chain, q=q, u=u, duration=duration, effects=effects)


def run(start, samples=201):
    times = np.linspace(0, start.duration, samples)
    return times, judge(start, times)


def states(found, name):
    """The states of one element, where they change."""
    every = [(t, modes[name]) for t, modes in found.events]
    return [item for k, item in enumerate(every) if k == 0 or item[1] != every[k - 1][1]]


def kinetic_energy(system, q, u):
    M11, M12, M22 = system.mass_matrix(q)
    return (M11 * u[0] ** 2 + 2 * M12 * u[0] * u[1] + M22 * u[1] ** 2) / 2


# Equations of motion.


def test_the_equation_of_motion_is_that_of_the_readme(random):
    (m1, m2), (L1, _), (I1, I2) = GENERAL.mass, GENERAL.length, GENERAL.inertia
    (a1, b1), (a2, b2) = GENERAL.centre
    system = System(scene(Gravity(), chain=GENERAL))
    for q1, q2, u1, u2 in random.uniform(-3, 3, (50, 4)).tolist():
        d = q2 - q1
        M = (
            I1 + m1 * (a1**2 + b1**2) + m2 * L1**2,
            m2 * L1 * (a2 * math.cos(d) - b2 * math.sin(d)),
            I2 + m2 * (a2**2 + b2**2),
        )
        assert system.mass_matrix((q1, q2)) == pytest.approx(M, rel=1e-13, abs=1e-14)
        x_C1 = a1 * math.cos(q1) - b1 * math.sin(q1)
        x_C2_from_B = a2 * math.cos(q2) - b2 * math.sin(q2)
        C = m2 * L1 * (a2 * math.sin(d) + b2 * math.cos(d))
        r = (
            9.81 * (m1 * x_C1 + m2 * L1 * math.cos(q1)) + C * u2**2,
            9.81 * m2 * x_C2_from_B - C * u1**2,
        )
        found = system.smooth_forces(0.0, (q1, q2), (u1, u2))
        assert found == pytest.approx(r, rel=1e-12, abs=1e-12)


def test_all_loads_are_those_of_the_library(random):
    effects = (
        Gravity(7.0, (0.3, 0.9)),
        JointTorque((1.0, -2.0), (0.5, 3.0), (2.0, 5.0), (0.1, 0.7)),
        JointDamping((0.3, 0.4)),
        JointSpring((2.0, 5.0), (0.3, -0.4)),
        EndForce(-3.0, 0.4, sliding=1),
    )
    system = System(scene(*effects, chain=GENERAL))
    for q1, q2, u1, u2, t in random.uniform(-3, 3, (20, 5)).tolist():
        q, u = (q1, q2), (u1, u2)
        loads = sum((effect.loads(GENERAL, q, u, t) for effect in effects), ())
        Q = kane.generalized_active_force(GENERAL, q, loads)
        Cu = kane.velocity_terms(GENERAL, q, u)
        expected = Q[0] - Cu[0], Q[1] - Cu[1]
        assert system.smooth_forces(t, q, u) == pytest.approx(expected, rel=1e-11, abs=1e-11)


def test_rows_and_drifts_are_the_derivatives_of_coordinates(random):
    surface = Surface((0.1, 2.0), (0.3, -1.0), on=("B", "C1", "C2", "D"), friction=0.1)
    effects = surface, JointStop("B", -9.0, 9.0), JointFriction((1.0, 1.0)), EndForce(1.0, 1.0)
    system = System(scene(*effects, chain=GENERAL))
    directions = [element.direction for element in system.elements]
    directions += [e.tangent for e in system.elements if isinstance(e, Contact) and e.tangent]
    assert len(directions) == 4 + 2 + 2 + 1 + 4
    h = 1e-4
    for q1, q2, u1, u2 in random.uniform(-2, 2, (5, 4)).tolist():
        places = [(q1 + k * h * u1, q2 + k * h * u2) for k in (-1, 0, 1)]
        for direction in directions:
            low, middle, high = (direction.coordinate(q) for q in places)
            speed = dot(direction.row(places[1]), (u1, u2))
            assert (high - low) / (2 * h) == pytest.approx(speed, abs=1e-6)
            drift = direction.drift(places[1], (u1, u2))
            assert (high - 2 * middle + low) / h**2 == pytest.approx(drift, abs=1e-5)


# Friction.


@pytest.mark.slow
def test_a_joint_stops_after_the_computed_time():
    """3 du/dt = −1.5 from 2 rad/s: at rest after 4 s and 4 rad."""
    t, found = run(scene(JointFriction((1.5, 0.0)), u=(2.0, 0.0), duration=5.0))
    (_, first), (stop, second) = states(found, "A")
    assert (first, second) == (State.FORWARD, State.STICKS)
    assert stop == pytest.approx(4.0, abs=1e-12)
    expected = np.where(t < 4, 2 * t - t * t / 4, 4.0)
    assert np.abs(found.q[0] - expected).max() < 1e-12
    assert np.all(found.u[0][t > 4] == 0)


def test_static_friction_is_exceeded_at_the_computed_time():
    """A torque 6 sin(t/2) passes the static 4.5 N m at 2 asin(3/4), and 3 N m resist from then."""
    push = JointTorque(amplitude=(6.0, 0.0), frequency=(0.5, 0.0))
    t, found = run(scene(push, JointFriction((3.0, 0.0), (4.5, 0.0)), duration=3.0))
    (_, first), (begun, second) = states(found, "A")
    assert (first, second) == (State.STICKS, State.FORWARD)
    start = 2 * math.asin(3 / 4)
    assert begun == pytest.approx(start, abs=1e-9)
    late = t[t > start]
    speed = (12 * (math.cos(start / 2) - np.cos(late / 2)) - 3 * (late - start)) / 3
    assert np.abs(found.u[0][t > start] - speed).max() < 1e-9


@pytest.mark.parametrize(("rising", "begins"), [(1.0, True), (-1.0, False)])
def test_a_torque_at_the_static_limit_is_decided_by_its_rate(rising, begins):
    """A torque that is the limit exactly, and rises or falls."""
    push = JointTorque((2.0, 0.0), (rising, 0.0), (1.0, 0.0))
    _, found = run(scene(push, JointFriction((2.0, 0.0)), duration=0.5))
    assert found.events[0][1]["A"] is (State.FORWARD if begins else State.STICKS)


HELD = (9.81 * 2.0, 9.81 * 0.5)
"""The weight of the bars, held out horizontally, asks for these torques at A and at B (N m)."""


@pytest.mark.parametrize(
    ("at_A", "at_B", "mode"),
    [
        (1.01, 1.01, (State.STICKS, State.STICKS)),
        (0.99, 1.01, (State.FORWARD, State.STICKS)),
        (1.01, 0.99, (State.STICKS, State.FORWARD)),
    ],
)
def test_the_threshold_of_sticking(at_A, at_B, mode):
    friction = JointFriction((at_A * HELD[0], at_B * HELD[1]))
    _, found = run(scene(friction, Gravity(), chain=BARS, duration=0.1))
    assert tuple(found.events[0][1].values()) == mode


@pytest.mark.parametrize(
    ("static", "mode"),
    [
        # Held, A needs 0.95 and B 1.01 of its limit: B slips, which takes load off A.
        ((HELD[0] / 0.95, HELD[1] / 1.01), (State.STICKS, State.FORWARD)),
        ((HELD[0] / 1.01, HELD[1] / 0.5), (State.FORWARD, State.STICKS)),
        ((HELD[0] / 0.99, HELD[1] / 0.99), (State.STICKS, State.STICKS)),
    ],
)
def test_the_joint_beyond_its_static_limit_slips_and_the_other_sticks(static, mode):
    friction = JointFriction((0.2 * static[0], 0.9 * static[1]), static)
    _, found = run(scene(friction, Gravity(), chain=BARS, duration=0.05))
    assert tuple(found.events[0][1].values()) == mode


def test_a_chain_whose_joint_friction_is_exceeded_does_not_rest():
    """At A gravity asks for 5.50 N m, and the limit is 4 N m: a wrong mode would rest for ever."""
    friction = JointFriction((1.0, 1.0), (4.0, 5.0))
    start = scene(friction, Gravity(), chain=BARS, q=(1.2867, 1.2867))
    _, found = run(start)
    assert found.events[0][1] == {"A": State.FORWARD, "B": State.STICKS}


@pytest.mark.parametrize(("q", "way"), [((0.0, 0.0), -1), ((0.0, math.pi), 1)])
def test_a_chain_along_x_slides_in_the_direction_of_its_acceleration(q, way):
    """D cannot move along x at first: the motion is that with friction of the known direction."""
    _, found = run(scene(Gravity(), EndForce(-3.0, 0.2), q=q, chain=BARS, duration=0.1))
    _, known = run(
        scene(Gravity(), EndForce(-3.0, 0.2, sliding=way), q=q, chain=BARS, duration=0.1)
    )
    assert found.events[0][1]["D"] is (State.FORWARD if way > 0 else State.BACKWARD)
    assert np.abs(found.q - known.q).max() < 1e-11


@pytest.mark.slow
def test_friction_dissipates_energy_and_the_balance_closes():
    """The change of T is the work of friction and gravity, by Simpson's rule between samples."""
    start = scene(
        Gravity(), JointFriction((1.0, 0.5), (1.3, 0.8)), EndForce(-4.0, 0.3), chain=GENERAL,
        q=(0.3, -0.9), u=(2.0, -1.0), duration=2.0,
    )  # fmt: skip
    t, found = run(start, 40_001)
    system = System(start)
    limits = {e.name: e for e in system.elements if isinstance(e, Friction)}
    power = dot(system.smooth_forces(t, found.q, 0 * found.u), found.u)
    for element in limits.values():
        power = power - element.kinetic * np.abs(dot(element.direction.row(found.q), found.u))
    T = kinetic_energy(system, found.q, found.u)
    work = np.concatenate([[0], np.cumsum((power[1:] + power[:-1]) / 2 * np.diff(t))])
    assert np.abs(T - T[0] - work).max() < 1e-5
    assert len(found.events) > 5


# Stops.


def test_a_free_link_rebounds_with_the_restitution():
    t, found = run(scene(JointStop("A", upper=1.0, restitution=0.8), u=(2.0, 0.0)))
    (impact,) = found.impacts
    assert impact.time == pytest.approx(0.5, abs=1e-14)
    assert impact.after == (pytest.approx(-1.6, abs=1e-14), 0.0)
    late = t > 0.5
    assert np.abs(found.q[0][late] - (1 - 1.6 * (t[late] - 0.5))).max() < 1e-13


@pytest.mark.slow
@pytest.mark.parametrize("restitution", [0.0, 0.3, 0.7])
def test_bounces_accumulate_and_then_it_rests(restitution):
    """A torque of 3 N m drives 3 kg m² against a stop: with e the bounces last 2 v e/(1 − e)."""
    effects = JointStop("A", upper=0.5, restitution=restitution), JointTorque((3.0, 0.0))
    t, found = run(scene(*effects, duration=6.0))
    last = 1 + 2 * restitution / (1 - restitution)
    assert found.events[-1][1]["A on its upper stop"] is State.CLOSED
    assert found.events[-1][0] == pytest.approx(last, abs=1e-6)
    assert np.abs(found.q[0][t > last + 1e-6] - 0.5).max() < 1e-12
    times = [1 + 2 * sum(restitution**k for k in range(1, n)) for n in range(1, 6)]
    if restitution:
        assert [s.time for s in found.impacts[:5]] == pytest.approx(times, abs=1e-11)


@pytest.mark.slow
def test_the_joint_leaves_its_stop_when_the_torque_changes_sign():
    """A sine pushes into the stop for half a period: it leaves when the sine turns."""
    sine = JointTorque(amplitude=(2.0, 0.0), frequency=(1.0, 0.0))
    t, found = run(scene(JointStop("A", upper=0.0), sine, duration=6.0))
    (_, first), (left, second) = states(found, "A on its upper stop")
    assert (first, second) == (State.CLOSED, State.OPEN)
    assert left == pytest.approx(math.pi, abs=1e-9)
    late = t[t > math.pi] - math.pi
    assert np.abs(found.q[0][t > math.pi] + 2 / 3 * (late - np.sin(late))).max() < 1e-9


@pytest.mark.slow_but_first
@pytest.mark.parametrize("share", [0.99, 1.01])
def test_friction_and_a_stop_at_one_joint(share):
    """A push into the stop is borne by both; away from it friction alone holds."""
    stop, friction = JointStop("A", upper=0.0), JointFriction((1.0, 0.0))
    _, away = run(scene(stop, friction, JointTorque((-share, 0.0))))
    moved = 0.0 if share < 1 else -0.5 * 0.01 / 3 * 4
    assert away.q[0, -1] == pytest.approx(moved, rel=1e-9, abs=1e-15)
    _, into = run(scene(stop, friction, JointTorque((5.0, 0.0))))
    assert np.abs(into.q[0]).max() < 1e-15


@pytest.mark.parametrize("gap", [-1e-9, 1e-9])
def test_a_turn_at_a_stop_is_neither_missed_nor_doubled(gap):
    """From 1 rad/s at −1 rad/s² the angle turns at 0.5 rad."""
    effects = JointStop("A", upper=0.5 + gap, restitution=0.5), JointTorque((-3.0, 0.0))
    _, found = run(scene(*effects, u=(1.0, 0.0), duration=1.5))
    assert len(found.impacts) == (gap < 0)
    if gap < 0:
        assert found.impacts[0].before[0] == pytest.approx(math.sqrt(2e-9), rel=1e-6)


# Surfaces.


def floor(height, **options):
    return Surface((0.0, height), UP, name="floor", **options)


def held_ratio(q):
    """|T|/N at D when it is held at rest on a floor, from two equations of the whole chain."""
    Q = 9.81 * np.array([1.5 * math.cos(q[0]), 0.5 * math.cos(q[1])])
    J = np.array([[-math.sin(q[0]), -math.sin(q[1])], [math.cos(q[0]), math.cos(q[1])]])
    T, N = np.linalg.solve(J.T, -Q)
    return abs(T / N)


@pytest.mark.parametrize(("share", "sticks"), [(1.01, True), (0.99, False)])
@pytest.mark.parametrize("kinetic", [1.0, 0.5])
def test_the_threshold_of_sticking_on_a_floor(share, sticks, kinetic):
    q = (0.3, 1.1)
    mu = share * held_ratio(q)
    rough = floor(math.sin(q[0]) + math.sin(q[1]), friction=kinetic * mu, static=mu)
    _, found = run(scene(Gravity(), rough, chain=BARS, q=q, duration=0.1))
    assert (found.events[0][1]["D on floor"] is State.STICKS) == sticks
    assert (np.abs(found.u).max() == 0) == sticks


@pytest.mark.slow_but_first
@pytest.mark.parametrize("restitution", [0.0, 0.6])
def test_the_chain_comes_to_rest_on_a_floor_and_never_enters_it(restitution):
    start = scene(
        Gravity(), floor(1.2, restitution=restitution, friction=0.4), chain=BARS, q=(0.3, -0.2),
        duration=2.0,
    )  # fmt: skip
    _, found = run(start, 2001)
    assert (np.sin(found.q[0]) + np.sin(found.q[1])).max() < 1.2 + 1e-11
    assert found.impacts


@pytest.mark.slow
def test_both_points_come_to_rest_on_a_slope():
    """B and D bounce in turn, ever less; in the end both touch, and the chain is at rest."""
    chain = Chain(
        (2.744934737338625, 2.8826844074595144), (0.8427304811409924, 0.40869432808459827),
        ((0.249440557064739, -0.06800257829010209), (0.19077912354375043, 0.0036199200716608487)),
        (0.06924529544042445, 0.028683430793747335),
    )  # fmt: skip
    slope = Surface(
        (0.0, 0.8262267843739397), (0.20676583017252653, -1.0), on=("B", "D"),
        restitution=0.17058348475381316, law="poisson", friction=0.004, name="slope",
    )  # fmt: skip
    start = scene(
        Gravity(), slope, chain=chain, q=(0.01845964105345088, 1.0480663442247076), duration=3.0
    )
    t, found = run(start)
    assert np.all(found.u[:, t > found.events[-1][0]] == 0)
    system = System(start)
    for element in system.elements:
        assert np.min(element.gap(found.q)) > -1e-10
        assert abs(element.gap(found.q[:, -1])) < 1e-10


def test_the_elbow_is_struck_on_its_circle():
    """It moves along one line: with e = 0.5 and no friction it goes back at half the speed."""
    start = scene(Gravity(), floor(0.8, restitution=0.5, on=("B",)), chain=BARS, duration=0.8)
    _, found = run(start)
    first = found.impacts[0]
    assert first.after[0] == pytest.approx(-0.5 * first.before[0], rel=1e-12)


@pytest.mark.parametrize(("speed", "reason"), [(0.2, "painleve"), (6.0, "ambiguous")])
def test_the_judge_gives_up_in_painleves_cases(speed, reason):
    """A rough floor that wedges a link that leans into its slide; the other way is as ever."""
    q = (1.1, 1.3)
    J = np.array([[-math.cos(q[0]), -math.cos(q[1])], [-math.sin(q[0]), -math.sin(q[1])]])
    rough = floor(math.sin(q[0]) + math.sin(q[1]), friction=2.0)
    u = tuple(np.linalg.solve(J, [0.0, speed]).tolist())
    start = scene(Gravity(), rough, chain=BARS, q=q, u=u, duration=0.01)
    with pytest.raises(JudgeGivesUp, match=reason):
        run(start)
    _, found = run(replace(start, u=(-u[0], -u[1])))
    expected = State.BACKWARD if speed < 1 else State.OPEN
    assert found.events[0][1]["D on floor"] is expected


# Impacts.


@pytest.mark.parametrize("law", ["newton", "newton-routh", "poisson", "stronge"])
def test_laws_of_impact_are_those_of_the_library(law, random):
    """Two derivations, one by closed forms and one stretch by stretch, at random responses."""
    compared = 0
    for _ in range(500):
        nn, tt, v_t, mu, e = random.uniform([0.2, 0.2, -3, 0, 0], [3, 3, 3, 1, 1]).tolist()
        nt = float(random.uniform(-0.95, 0.95)) * math.sqrt(nn * tt)
        contact = Contact("", None, 0.0, e, kinetic=mu, law=law)
        try:
            found = rough_impulse(-1.0, v_t, (nn, nt, tt), contact)
        except JudgeGivesUp:
            continue
        expected = library_impulse(
            -1.0, v_t, Response(nn, nt, tt), friction=mu, restitution=e, law=law
        )
        assert found[:2] == pytest.approx((expected.normal, expected.tangential), rel=1e-9)
        compared += 1
    assert compared > 450


def test_stronges_impact_gives_back_the_energy_by_fine_steps():
    """Compression that begins with a slide, integrated in p with 10⁵ steps."""
    nn, nt, tt, mu, e = 1.0, 0.5, 1.2, 0.3, 0.6
    contact = Contact("", None, 0.0, e, kinetic=mu, law="stronge")
    p, p_t, v_n, v_t = rough_impulse(-1.0, 0.1, (nn, nt, tt), contact)
    h, x, y, work, gained, total, total_t = 1e-5, -1.0, 0.1, 0.0, 0.0, 0.0, 0.0
    while gained < e * e * -work or x < 0:
        s = -mu * np.sign(y) if abs(y) > h else float(np.clip(-nt / tt, -mu, mu))
        middle = x + (nn + s * nt) * h / 2
        work, gained = (work + middle * h, 0.0) if x < 0 else (work, gained + middle * h)
        x, y = x + (nn + s * nt) * h, y + (nt + s * tt) * h
        total, total_t = total + h, total_t + s * h
    assert (p, p_t, v_n, v_t) == pytest.approx((total, total_t, x, y), abs=1e-4)


def test_kane_and_levinsons_impact_sticks_in_the_cone():
    """Without sliding and coupling the impulse is normal; a slow slide is stopped."""
    contact = Contact("", None, 0.0, 0.5, kinetic=0.4, law="newton")
    assert rough_impulse(-2.0, 0.1, (1.0, 0.0, 1.0), contact) == (3.0, -0.1, 1.0, 0.0)
    fast = rough_impulse(-2.0, 2.0, (1.0, 0.0, 1.0), contact)
    assert fast == pytest.approx((3.0, -1.2, 1.0, 0.8))


@pytest.mark.parametrize(("friction", "rests"), [(0.1, True), (0.04, False)])
def test_friction_wedges_a_link_against_a_wall_that_it_would_leave(friction, rests):
    """B leaves the wall by 0.05 of its way; friction above tan 0.05 holds link 1 at rest."""
    wall = Surface((1.0, 0.0), (-np.cos(0.05), np.sin(0.05)), on=("B",), friction=friction)
    effects = (Gravity(), JointFriction((0.1, 0.5)), wall)
    scene = Scene(Chain.uniform_bars(), (0.0, np.pi / 2), (0.0, 0.0), 0.2, effects)
    run = judge(scene, np.linspace(0, 0.2, 3))
    assert bool(run.u[0, -1] == 0) is rests
    assert bool(run.u[0, -1] > 0.5) is not rests
