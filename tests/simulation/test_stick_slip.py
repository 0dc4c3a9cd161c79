"""Coulomb friction in the joints: stick and slip are modes, with exact times between them."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linprog

from tests.campaign.checks import violations
from tests.verification.chains import GENERAL
from twolink.chain import Chain
from twolink.coordinates import JointConvention
from twolink.data import data_path
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.effects.sampled_torque import SampledTorque
from twolink.effects.surface import Surface
from twolink.engines.pinocchio_chain import PinocchioChain
from twolink.errors import ParameterError, SimulationError
from twolink.kinematics import position
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.hybrid.run import hybrid_run
from twolink.urdf import parse_planar_urdf

BALANCED = Chain((1.0, 1.0), (1.0, 1.0), ((0.0, 0.0), (0.0, 0.0)), (2.0, 0.5))
"""Both mass centres on the joints: each link turns on its own, and M = diag(3, 0.5)."""


def directions(event):
    """+1, −1 or 0 for each joint with friction."""
    return tuple(state.direction for state in event.mode.states)


STICK_SLIP = Scene.load(data_path("scenes") / "stick_slip.toml")


def scene(friction, *effects, chain=BALANCED, q=(0.0, 0.0), u=(0.0, 0.0), duration=5.0):
    return Scene(
        chain=chain, q=q, u=u, duration=duration, effects=(*effects, friction), accuracy=1e-12
    )


def test_a_joint_stops_at_the_computed_instant_and_then_stays_exactly():
    """3 du/dt = −1.5 from 2 rad/s: at rest after 4 s and 4 rad."""
    trajectory = simulate(scene(JointFriction((1.5, 0.0)), u=(2.0, 0.0)))
    assert [str(event.mode) for event in trajectory.events] == ["A slips forward", "A sticks"]
    assert trajectory.events[1].time == pytest.approx(4.0, abs=1e-14)
    moving = trajectory.t < 4.0
    t = trajectory.t[moving]
    assert trajectory.q[0, moving] == pytest.approx(2 * t - t * t / 4, abs=1e-13)
    assert np.all(trajectory.u[0, ~moving] == 0)
    assert np.all(trajectory.q[0, ~moving] == trajectory.q[0, -1])
    assert trajectory.q[0, -1] == pytest.approx(4.0, abs=1e-13)


# The weight of the bars, held out horizontally, asks for these torques at A and at B.
HELD = (9.81 * 2.0, 9.81 * 0.5)


@pytest.mark.parametrize(
    ("at_A", "at_B", "mode"),
    [
        (1.01, 1.01, (0, 0)),
        (0.99, 1.01, (1, 0)),
        (1.01, 0.99, (0, 1)),
    ],
)
def test_the_threshold_of_sticking(at_A, at_B, mode):
    friction = JointFriction((at_A * HELD[0], at_B * HELD[1]))
    start = scene(friction, Gravity(), chain=Chain.uniform_bars(), duration=0.2)
    trajectory = simulate(start)
    assert directions(trajectory.events[0]) == mode
    speeds = (trajectory.u[0], trajectory.u[1] - trajectory.u[0])
    for speed, direction in zip(speeds, mode, strict=True):
        assert np.all(speed[1:] > 0) if direction else np.all(speed == 0)


def test_static_friction_holds_more_than_kinetic():
    slow_push = JointTorque(amplitude=(6.0, 0.0), frequency=(0.5, 0.0))
    for static, start in ((3.0, 1 / 2), (4.5, 3 / 4)):
        friction = JointFriction((3.0, 1.0), (static, 1.0))
        trajectory = simulate(scene(friction, slow_push, duration=3.0))
        assert [directions(event)[0] for event in trajectory.events[:2]] == [0, 1]
        assert trajectory.events[1].time == pytest.approx(2 * math.asin(start), abs=1e-12)


@pytest.mark.slow
def test_a_chain_at_rest_stays_exactly_at_rest():
    trajectory = simulate(STICK_SLIP)
    assert directions(trajectory.events[-1]) == (0, 0)
    after = trajectory.t > trajectory.events[-1].time
    assert np.all(trajectory.u[:, after] == 0)
    assert np.all(trajectory.q[:, after] == trajectory.q[:, -1:])


def test_a_stuck_elbow_stays_bent_exactly():
    trajectory = simulate(STICK_SLIP)
    starts = [event.time for event in trajectory.events] + [trajectory.t[-1]]
    for event, start, end in zip(trajectory.events, starts[:-1], starts[1:], strict=True):
        inside = (trajectory.t > start) & (trajectory.t < end)
        q, u = trajectory.q[:, inside], trajectory.u[:, inside]
        if directions(event)[0] == 0:
            assert np.all(u[0] == 0)
        if directions(event)[1] == 0:
            assert np.all(u[0] == u[1])
            elbow = q[1] - q[0]
            assert np.ptp(elbow) < 1e-14 if elbow.size else True


def test_the_works_close_the_balance_and_friction_dissipates():
    trajectory = simulate(STICK_SLIP)
    works, T = trajectory.work(), trajectory.kinetic_energy
    assert sum(works.values()) == pytest.approx(T - T[0], abs=1e-10)
    assert np.all(np.diff(works["JointFriction"]) <= 1e-15)


def test_pinocchio_finds_the_laws_of_friction_along_the_trajectory():
    """RNEA at our accelerations: −σ kinetic where a joint slips, at most static where it sticks."""
    trajectory = simulate(STICK_SLIP, samples=400)
    friction = STICK_SLIP.effects[1]
    engine = PinocchioChain(parse_planar_urdf(STICK_SLIP.chain.to_urdf()))
    joints = JointConvention()
    torques = engine.inverse_dynamics(
        np.array(joints.joint_angles(tuple(trajectory.q))),
        np.array(joints.joint_speeds(tuple(trajectory.u))),
        np.array(
            joints.joint_speeds(tuple(trajectory.mode_forces.accelerations(trajectory.samples)))
        ),
    )
    times = [event.time for event in trajectory.events]
    for number, t in enumerate(trajectory.t):
        event = trajectory.events[int(np.searchsorted(times, t, side="right")) - 1]
        for joint, direction in enumerate(directions(event)):
            if direction == 0:
                assert abs(torques[joint, number]) <= friction.holding[joint] * (1 + 1e-12)
            else:
                expected = -direction * friction.kinetic[joint]
                assert torques[joint, number] == pytest.approx(expected, abs=1e-11)


@pytest.mark.slow
@pytest.mark.parametrize("accuracy", [1e-6, 1e-10, 1e-14])
def test_accuracy_is_honoured_across_events(accuracy):
    trajectory = simulate(STICK_SLIP, accuracy=accuracy, samples=101)
    exact = hybrid_run(STICK_SLIP, trajectory.t, precision="quadruple")
    assert np.abs(trajectory.q - exact.q.astype(float)).max() <= accuracy
    assert np.abs(trajectory.u - exact.u.astype(float)).max() <= accuracy
    assert len(trajectory.events) == len(exact.events)
    for found, true in zip(trajectory.events, exact.events, strict=True):
        assert found.mode == true.mode
        assert found.time == pytest.approx(true.time, abs=accuracy)


def test_dense_output_reaches_over_events():
    trajectory = simulate(STICK_SLIP)
    times = np.sort(np.concatenate([np.linspace(0, 10, 77), [e.time for e in trajectory.events]]))
    exact = hybrid_run(STICK_SLIP, times, precision="long double")
    q, u = trajectory.at(times)
    assert np.abs(q - exact.q.astype(float)).max() < 1e-12
    assert np.abs(u - exact.u.astype(float)).max() < 1e-12


@pytest.mark.slow
def test_a_general_chain_comes_to_rest(random):
    for _ in range(3):
        q, u = random.uniform(-3, 3, (2, 2)).tolist()
        start = scene(
            JointFriction((1.0, 0.5), (1.2, 0.6)),
            Gravity(),
            chain=GENERAL,
            q=tuple(q),
            u=tuple(u),
            duration=40.0,
        )
        trajectory = simulate(start, accuracy=1e-8)
        assert trajectory.met
        assert directions(trajectory.events[-1]) == (0, 0)


def test_methods_without_events_are_refused():
    with pytest.raises(SimulationError, match=r"method must be taylor.*; got 'DOP853'"):
        simulate(STICK_SLIP, method="DOP853")


@pytest.mark.slow
def test_kanes_equations_find_the_same_modes():
    ours = simulate(STICK_SLIP, formulation="kane", accuracy=1e-9)
    lagranges = simulate(STICK_SLIP, accuracy=1e-9)
    assert ours.formulation == "kane"
    assert np.abs(ours.q - lagranges.q).max() < 2e-9
    assert [event.mode for event in ours.events] == [event.mode for event in lagranges.events]


def test_two_frictions_are_refused():
    twice = replace(STICK_SLIP, effects=(JointFriction((1.0, 1.0)), JointFriction((1.0, 1.0))))
    with pytest.raises(SimulationError, match="A has dry friction twice"):
        simulate(twice)


@pytest.mark.parametrize(
    ("kinetic", "static", "words"),
    [
        ((-1.0, 0.0), None, "joint friction at A must be zero or .*; got -1.0"),
        ((1.0, math.nan), None, "joint friction at B must be zero .*; got nan"),
        ((1.0, 1.0), (0.5, 1.0), "static joint friction at A must be .* 1.0 N m; got 0.5"),
        ((1.0, 1.0), (1.0, math.inf), "static joint friction at B must be finite .*; got inf"),
    ],
)
def test_bad_friction_is_refused(kinetic, static, words):
    with pytest.raises(ParameterError, match=words):
        JointFriction(kinetic, static)


def test_a_load_between_kinetic_and_static_friction_leaves_no_choice():
    """A joint at rest stays at rest until the static limit: no note mentions other modes."""
    scene = Scene(
        Chain.uniform_bars(),
        (0.3, -0.4),
        (0.0, 0.0),
        1.0,
        (Gravity(9.81), JointFriction((15.0, 3.8), (18.6, 4.6))),
    )
    trajectory = simulate(scene, samples=3)
    assert trajectory.notes == ()
    assert np.array_equal(trajectory.q[:, -1], scene.q)


@pytest.mark.parametrize("spin", [0.0, 1.0])
def test_a_link_that_stops_is_held_by_all_of_its_frictions(spin):
    """Link 1 alone: it stops, and slides again when its torque exceeds the sum of static limits.

    With link 2 at rest, its speeds after the stop were 1e-20 rad/s, and all slides but one went on:
    the link broke loose 0.23 s too early against kinetic friction.
    """
    alone = Chain((1.0, 0.5), (1.0, 1.0), ((0.0, 0.0), (0.0, 0.0)), (0.5, 1.0))
    surfaces = (
        CompliantSurface(
            (0.9821586056848767, -0.1608676269157735), (-0.887966081215816, 0.4599089459993433),
            "kelvin-voigt", 295.7869, on=("B",), friction=0.567, static=1.1476, name="s0",
        ),
        CompliantSurface(
            (0.9860828359186364, -0.15819382705060045), (-0.10312003446385626, 0.9946689190339533),
            "kelvin-voigt", 127.9026, on=("B",), friction=0.5387, static=1.2946, name="s1",
        ),
    )  # fmt: skip
    slope = 12.9894 / 1.2
    torque = SampledTorque((0.0, 0.4, 1.6), (0.0, 0.0, 1.2 * slope), (0.0, 0.0, 0.0), "linear")
    friction = JointFriction((1.3249, 0.0), (3.6493, 0.0))
    start = Scene(alone, (-0.1639, -0.6591), (0.0179, spin), 1.6, (friction, *surfaces, torque))
    run = simulate(start)
    assert run.met
    stop, *later = run.events[1:]
    assert not any(state.slips for state in stop.mode.states)
    slide = next(event for event in later if any(state.slips for state in event.mode.states))
    q, u = run.at([stop.time])
    assert u[0, 0] == 0
    angle = float(q[0, 0])
    along = np.array([-math.sin(angle), math.cos(angle)])
    push, limit = 0.0, 3.6493
    for surface in surfaces:
        normal = np.array(surface.normal)
        depth = normal @ (np.array(surface.point) - [math.cos(angle), math.sin(angle)])
        push += surface.stiffness * depth * (normal @ along)
        across = np.array([-normal[1], normal[0]]) @ along
        limit += surface.static * surface.stiffness * depth * abs(across)
    assert slide.time == pytest.approx(0.4 + (limit - push) / slope, abs=1e-12)


@pytest.mark.slow
def test_the_element_that_breaks_loose_does_not_depend_on_shares_that_the_laws_leave_open():
    """Both joints and a soft surface on link 2 hold the chain: three forces, of which two count.

    In the mirror image, the other sign of the saturated friction came with another share of the
    others, and at 0.8958 s another of them broke loose, without a note: 190 rad/s apart at 0.897 s.
    """

    def motion(sign):
        effects = (
            Gravity(9.81, direction=(0.0, sign)),
            JointFriction(
                (2.200161989849138, 5.260902844956132e-07),
                (3.272274305948788, 8.53978183894946e-07),
            ),
            CompliantSurface(
                (0.9001, sign * 0.2999), (0.0, -sign), "hertz", 5644.004556466354, on=("C2",),
                friction=0.3, static=0.7831015247644362,
            ),
            SampledTorque(
                (0.4375, 0.625, 0.75, 1.75, 1.8125, 1.9375),
                tuple(sign * x for x in (
                    -2.855067962061626, -0.7594715254169732, -0.8303797455778626,
                    1.8232751496577657, 9.58568559331836, 1.206121313473319,
                )),
                tuple(sign * x for x in (
                    -1.4391613240134553e-06, 9.437145344367243e-07, -9.146196002131838e-07,
                    5.182435075752898e-07, 4.985255812339275e-06, -1.8523303558347102e-06,
                )),
                interpolation="cubic",
            ),
        )  # fmt: skip
        centre = (0.5, 0.0), (0.3, sign * 0.1)
        chain = Chain((1.0, 1e-6), (1.0, 0.7), centre, (0.1, 1e-8))
        return simulate(Scene(chain, (0.0, sign * math.pi / 2), (0.0, 0.0), 0.92, effects))

    one, other = motion(1), motion(-1)
    assert one.met
    assert other.met
    times = np.linspace(0.0, 0.92, 200)
    first, second = (np.concatenate(run.at(times)) for run in (one, other))
    assert np.abs(first + second).max() <= one.error + other.error
    assert np.abs(first[2:]).max() > 50
    assert "the laws of contact leave a choice" in one.notes[0]
    # It counts the choice at 0.8958 s as well.
    assert "until 0.89" in one.notes[0]


REST_IN_ROOM = {
    # The angles, the friction of the wall and of the joints, the torques at 1 s, and the normal.
    "a floor": ((0.8, 2.2), 0.4, (1.4, 3.7), (-23.0, -16.0), (0.0, -1.0), 0.873337),
    "a ceiling": ((2.0, -1.3), 0.6, (7.7, 2.6), (10.0, 2.0), (0.0, 1.0), math.inf),
}


def rest_is_possible(q, friction, joints, torques, normal):
    """Return whether forces within the laws balance bars of 1 kg and 1 m whose D touches a wall."""
    (c1, c2), (s1, s2) = np.cos(q), np.sin(q)
    loads = np.array([1.5 * 9.81 * c1 + torques[0] - torques[1], 0.5 * 9.81 * c2 + torques[1]])
    end = np.array([[-s1, -s2], [c1, c2]])
    push, slide = np.array(normal) @ end, np.array([-normal[1], normal[0]]) @ end
    # Torques of friction in A and B, the normal force, and the tangential one, at most the other.
    found = linprog(
        np.zeros(4),
        A_eq=np.column_stack([[1.0, 0.0], [-1.0, 1.0], push, slide]),
        b_eq=-loads,
        A_ub=[[0, 0, -friction, 1], [0, 0, -friction, -1]],
        b_ub=[0, 0],
        bounds=[(-joints[0], joints[0]), (-joints[1], joints[1]), (0, None), (None, None)],
    )
    return found.status == 0


@pytest.mark.parametrize("name", REST_IN_ROOM)
def test_a_chain_rests_until_no_forces_can_hold_it(name):
    """Frictions in both joints and a rough wall, under torques that rise from zero.

    At 0.586 s and 0.644 s the mode in which the chain is held ended, and one that begins a slide
    without an acceleration was taken for rest, though other forces hold the chain.
    """
    q, friction, joints, torques, normal, until = REST_IN_ROOM[name]
    chain = Chain.uniform_bars()
    at = tuple(map(float, position(chain, q, chain.D)))
    effects = (
        Gravity(9.81),
        SampledTorque((0.0, 1.0), (0.0, torques[0]), (0.0, torques[1]), "linear"),
        JointFriction(joints),
        Surface(at, normal, ("D",), friction=friction, name="wall"),
    )
    found = simulate(Scene(chain, q, (0.0, 0.0), 1.0, effects))
    assert found.met
    departs = min((e.time for e in found.events if "slips" in e.description), default=math.inf)
    assert departs == pytest.approx(until, abs=1e-6)
    for t in np.linspace(0.01, 0.99, 99):
        possible = rest_is_possible(q, friction, joints, np.array(torques) * t, normal)
        assert possible == (t < departs)
        assert possible == (np.abs(found.at([t])[1]).max() == 0)
    assert "the laws of contact leave a choice" in found.notes[0]


def departures(found):
    """Return the times (s) from which a chain moves that was at rest, after 0 s."""
    times = [event.time for event in found.events[1:] if event.time + 1e-3 < found.t[-1]]
    before = [np.abs(found.at([t], side="left")[1]).max() for t in times]
    after = [np.abs(found.at([t + 1e-3])[1]).max() for t in times]
    pairs = zip(times, before, after, strict=True)
    return [t for t, one, other in pairs if one == 0 and other > 0]


def test_a_mode_in_which_a_contact_opens_by_a_higher_derivative_is_no_rest():
    """At 0.0703 s friction in A holds the chain without D for an instant, and with D for longer.

    From 0.08264 s on no forces can hold it: a linear program finds that as well.
    """
    chain = Chain(
        (0.414030855675315, 0.8833500675981099),
        (0.6519527724251217, 0.9061079154462136),
        (
            (0.461428968082033, -0.060356403445920664),
            (0.2991529203958608, -0.0041551163031094684),
        ),
        (0.008799033790228446, 0.03626291395548524),
    )
    effects = (
        Gravity(9.81),
        JointTorque(
            (-4.643383343573073, -2.784280993619375), (2.01813072629303, -5.277492896641737),
            (2.3955539433509374, 3.516546222827984), (1.8877143245204273, -0.9813314788677712),
        ),
        JointFriction((0.37634206046561136, 0.0)),
        Surface(
            (0.053723635980086226, -0.29422600177197267), (0.17373214092317826, 0.9847929443341118),
            friction=0.21799756681799343, name="s0",
        ),
    )  # fmt: skip
    found = simulate(
        Scene(chain, (1.0849366115075734, -1.8511522145111667), (0.0, 0.0), 0.2, effects)
    )
    assert found.met
    assert departures(found)[0] == pytest.approx(0.082642, abs=1e-6)
    assert "At 0.0702552901 s the laws of contact leave a choice" in found.notes[0]


@pytest.mark.slow
def test_a_stop_that_has_opened_at_rest_may_hold_the_chain_again():
    """Friction in B takes over from its stop at 0.727 s, and cannot hold from 0.805 s on."""
    chain = Chain(
        (0.5762253150161091, 1.246123550851881),
        (0.5159201404393323, 0.570494211360163),
        ((0.25796007021966616, 0.0), (0.2852471056800815, 0.0)),
        (0.012781330125176307, 0.033797326102013026),
    )
    effects = (
        Gravity(9.81),
        JointTorque(
            (0.327986279270101, -0.8958902041355079), (-15.406995688611557, -2.3165722315172985),
            (5.816558747592004, 2.935961073770847), (2.2548635963553725, -0.7686052165613861),
        ),
        JointFriction((0.22553314098436633, 4.011146237165521)),
        Surface(
            (0.010689590636844548, -0.8332990474412028), (0.0, -1.0), restitution=0.0,
            friction=0.389486299915669, name="s0",
        ),
        JointStop("B", upper=-1.3951510460229395, restitution=0.0),
    )  # fmt: skip
    q, u = (-0.8183152495240416, -2.213466295546981), (0.6069698477647867, 1.218969254238131)
    found = simulate(Scene(chain, q, u, 1.0, effects))
    assert found.met
    assert departures(found) == []
    assert np.abs(found.u[:, 1:]).max() == 0


def test_a_joint_that_stops_may_turn_around_or_be_held_while_the_other_begins_to_slide():
    """Both limits are exceeded, by one factor, if both are held: a rounding decides nothing."""
    friction = JointFriction((2.0, 0.5), (2.5, 0.625))
    found = []
    for at_B in (0.75, math.nextafter(0.75, 1)):
        start = {"q": (0.0, 0.25), "u": (0.0, -0.1), "duration": 0.5}
        torque = JointTorque((3.0, at_B))
        found.append(simulate(scene(friction, torque, chain=Chain.uniform_bars(), **start)))
        choice = "leave a choice: A slips forward, B sticks is taken; or A sticks, B slips forward."
        assert choice in found[-1].notes[0]
    assert found[0].q == pytest.approx(found[1].q, abs=1e-12)


@pytest.mark.parametrize("mass", [1.0, 1.01, 1.02, 1.03, 1.04, 1.05])
def test_a_joint_does_not_slide_into_a_stop_that_loses_its_force(mass):
    """Its friction holds it from then on, at the static limit: there is no other motion."""
    chain = Chain.uniform_bars((mass, 1.7))
    fading = SampledTorque((0.0, 1.0), (0.3, 0.3), (-6.0, 0.0), "linear")
    friction, stop = JointFriction((0.0, 1.0), (0.0, 1.5)), JointStop("B", 0.5)
    pressed = scene(friction, stop, fading, chain=chain, q=(0.0, 0.5), u=(0.5, 0.5), duration=1.0)
    found = simulate(pressed)
    assert [event.description for event in found.events][1:] == ["B sticks"]
    assert found.notes == ()


def test_a_corner_whose_frictions_push_along_one_line():
    """With a coefficient of 1 the forces of two slides in a right-angled corner are parallel."""
    chain, q = Chain.uniform_bars(), (0.8217701239287258, -1.3812797174167781)
    at = tuple(map(float, position(chain, q, chain.D)))
    for turned, torques in ((1.879621435201635, (-27.5, -29.0)), (0.0, (-40.0, 10.0))):
        walls = [
            Surface(at, (math.cos(a), math.sin(a)), friction=1.0, name=f"wall {k}")
            for k, a in enumerate((turned, turned + math.pi / 2))
        ]
        effects = (Gravity(9.81), JointTorque(torques), *walls)
        found = simulate(Scene(chain, q, (0.0, 0.0), 0.3, effects))
        assert found.met
        assert not violations(found)
