"""Reactions, friction and contact forces satisfy Newton's and Euler's equations."""

import math
from dataclasses import replace

import numpy as np
import pinocchio
import pytest

from tests.verification.chains import GENERAL
from twolink.chain import Chain
from twolink.data import data_path
from twolink.effects.end_force import EndForce
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.effects.sampled_torque import SampledTorque
from twolink.effects.surface import Surface
from twolink.kinematics import velocity
from twolink.scene import Scene
from twolink.simulation import Trajectory, simulate

G = 9.81
SCENE = Scene(
    chain=GENERAL, q=(0.3, -0.4), u=(1.1, -0.7), duration=2.0, effects=(Gravity(),), accuracy=1e-11
)


@pytest.fixture(scope="module")
def run():
    """Return a shipped scene's trajectory, simulated once."""
    known = {}

    def of(name):
        if name not in known:
            scene = Scene.load(data_path(f"scenes/{name}.toml"))
            known[name] = simulate(scene, accuracy=1e-9, samples=51)
        return known[name]

    return of


def moment_of_momentum(trajectory, times):
    """Return that about A (kg m²/s) of the shipped scenes' bars, of 1 kg and 1 m each."""
    (q1, q2), (u1, u2) = trajectory.at(times)
    first = u1 / 3
    x = np.cos(q1) + np.cos(q2) / 2
    y = np.sin(q1) + np.sin(q2) / 2
    vx = -np.sin(q1) * u1 - np.sin(q2) * u2 / 2
    vy = np.cos(q1) * u1 + np.cos(q2) * u2 / 2
    return first + x * vy - y * vx + u2 / 12


def moment_of_weights(q):
    return G * (np.cos(q[0]) / 2 + np.cos(q[0]) + np.cos(q[1]) / 2)


def turned(trajectory, start, end, moment):
    """Return the integral of a moment (N m) and the change of angular momentum, by Gauss's rule.

    The nodes are dense where the force of a compliant contact has a root, at the ends.
    """
    nodes, weights = np.polynomial.legendre.leggauss(60)
    x, weights = (1 + nodes) / 2, weights / 2
    times = start + (end - start) * x * x * (3 - 2 * x)
    q, _ = trajectory.at(times)
    rate = moment_of_weights(q) + moment(times, q)
    before, after = moment_of_momentum(trajectory, np.nextafter([start, end], [end, start]))
    return (end - start) * float((weights * 6 * x * (1 - x)) @ rate), after - before


@pytest.mark.slow_but_first
@pytest.mark.parametrize("name", ["slide_and_stop", "bounce_to_rest", "hertz_bounce"])
def test_the_floors_force_turns_the_chain(run, name):
    """About A it is the floor and the weights alone that turn the chain."""
    trajectory = run(name)
    entered = [event.entered for event in trajectory.events] + [trajectory.t[-1]]
    spans = list(zip(entered[:-1], entered[1:], trajectory.events, strict=True))
    touching = [span for span in spans if span[2].description != "moves freely"][:6]
    assert touching

    def moment(times, q):
        (floor,) = trajectory.contact_forces(times)
        # The normal is upward, −y; the tangent a quarter turn from it, along x.
        x, y = np.cos(q[0]) + np.cos(q[1]), np.sin(q[0]) + np.sin(q[1])
        return -x * floor.normal - y * floor.tangential

    for start, end, _ in touching:
        given, changed = turned(trajectory, start, end, moment)
        assert given == pytest.approx(changed, abs=1e-8)


def test_coulombs_law_holds_all_along(run):
    trajectory = run("slide_and_stop")
    ends = [*(event.entered for event in trajectory.events[1:]), trajectory.t[-1]]
    assert trajectory.events[0].description == "D on floor slips backward"
    for event, end in zip(trajectory.events, ends, strict=True):
        (floor,) = trajectory.contact_forces(np.linspace(event.entered, np.nextafter(end, 0), 9))
        assert floor.name == "D on floor"
        assert floor.unit == "N"
        assert np.all(floor.normal > 0)
        if "slips" in event.description:
            way = -1 if "forward" in event.description else 1
            assert floor.tangential == pytest.approx(way * 0.6 * floor.normal)
        else:
            assert np.all(np.abs(floor.tangential) < 0.7 * floor.normal)


def test_friction_in_a_joint_is_a_torque(run):
    trajectory = run("stick_slip")
    at_A, at_B = trajectory.contact_forces()
    assert [at_A.name, at_B.name] == ["A", "B"]
    assert [at_A.unit, at_B.unit] == ["N m", "N m"]
    assert at_A.tangential is None
    for force, kinetic, static in ((at_A, 2.5, 3.0), (at_B, 0.6, 0.8)):
        assert np.all(np.abs(force.normal) <= static)
        assert np.any(np.abs(force.normal) == kinetic)
        assert np.any(np.abs(np.abs(force.normal) - kinetic) > 1e-3)
    first, second = (event.entered for event in trajectory.events[:2])
    given, changed = turned(
        trajectory, first, second, lambda times, q: trajectory.contact_forces(times)[0].normal
    )
    assert given == pytest.approx(changed, abs=1e-9)


def test_an_open_contact_has_no_force(run):
    trajectory = run("bounce_to_rest")
    (floor,) = trajectory.contact_forces()
    free = np.array([t < trajectory.impacts[0].time for t in trajectory.t])
    assert free.any()
    assert np.all(floor.normal[free] == 0)
    assert np.all(floor.tangential[free] == 0)
    assert floor.normal[-1] > 0


def test_a_smooth_scene_has_no_contact_forces(run):
    assert run("free_fall").contact_forces() == ()


def test_contact_forces_of_a_loaded_trajectory_are_those_that_were_saved(run, tmp_path):
    trajectory = run("slide_and_stop")
    trajectory.save(tmp_path / "slide.npz")
    read = Trajectory.load(tmp_path / "slide.npz")
    for ours, theirs in zip(read.contact_forces(), trajectory.contact_forces(), strict=True):
        assert np.array_equal(ours.normal, theirs.normal)
    between = [0.01, 0.4]
    for ours, theirs in zip(
        read.contact_forces(between), trajectory.contact_forces(between), strict=True
    ):
        assert np.array_equal(ours.normal, theirs.normal)


def test_a_load_that_jumps_at_the_end_acts_afterwards():
    """At the last sample the torque still presses the link against its stop."""
    presses = SampledTorque(
        (0.0, 1.0, 1.5), A=(5.0, -5.0, -5.0), B=(0.0, 0.0, 0.0), interpolation="hold"
    )
    scene = Scene(
        chain=GENERAL, q=(0.0, 0.0), u=(0.0, 0.0), duration=1.0,
        effects=(presses, JointStop("A", upper=0.0), JointStop("B", lower=0.0)),
    )  # fmt: skip
    pressed = simulate(scene, samples=11)
    force = pressed.contact_forces()[0].normal
    assert force == pytest.approx(np.full(11, 5.0))


def test_a_load_that_jumps_where_a_motion_is_not_followed_further_acts_afterwards():
    """At 1/4 s a torque wedges a stretched chain, which friction of 0.5 N m has held at B."""
    knots = (0.0, 0.25, 0.5)
    torque = SampledTorque(knots, (1.0, 0.0, 0.0), (-1.0, 10.0, 10.0), "hold")
    scene = Scene(
        Chain.uniform_bars((0.5, 1.0), (0.5, 1.0)), (0.0, 0.0), (0.0, 0.0), 1.0,
        (
            Gravity(), torque, JointFriction((5.0, 0.5)),
            Surface((0.25, 0.0), (1.0, 0.0), ("C2", "C1"), restitution=1.0, name="s0"),
            Surface((1.0, 0.0), (0.0, -1.0), ("C2",), friction=1.0, name="s1"),
        ),
    )  # fmt: skip
    run = simulate(scene)
    assert run.failure
    assert run.t[-1] == 0.25
    friction = next(force for force in run.contact_forces([0.1, 0.25]) if force.name == "B")
    assert friction.normal[1] == pytest.approx(friction.normal[0])


def test_a_hanging_chain_is_held_by_its_weight():
    down = (math.pi / 2, math.pi / 2)
    chain = Chain.uniform_bars((1.3, 0.7))
    trajectory = simulate(replace(SCENE, chain=chain, q=down, u=(0.0, 0.0), duration=0.1))
    at_A, at_B = trajectory.reactions()
    assert at_A[0] == pytest.approx(0, abs=1e-12)
    assert at_A[1] == pytest.approx(-9.81 * 2.0)
    assert at_B[1] == pytest.approx(-9.81 * 0.7)


def test_reactions_are_pinocchios_joint_forces():
    trajectory = simulate(SCENE, samples=9)
    at_A, at_B = trajectory.reactions()
    model = pinocchio.buildModelFromXML(
        GENERAL.to_urdf().replace('"continuous">', '"revolute"><limit effort="1" velocity="1"/>')
    )
    data = model.createData()
    for k, (q, u) in enumerate(zip(trajectory.q.T, trajectory.u.T, strict=True)):
        theta, speed = (np.array([pair[0], pair[1] - pair[0]]) for pair in (q, u))
        acceleration = pinocchio.aba(model, data, theta, speed, np.zeros(2))
        pinocchio.rnea(model, data, theta, speed, acceleration)
        pinocchio.forwardKinematics(model, data, theta)
        for joint, force in ((1, at_A), (2, at_B)):
            x, _, z = data.oMi[joint].rotation @ data.f[joint].linear
            assert (x, -z) == pytest.approx(tuple(force[:, k]), abs=1e-10)


def test_reactions_answer_to_forces_on_the_end():
    """The whole chain: m a = F_A + weights + force on D."""
    end = EndForce(-3.0, 0.4, sliding=1)
    trajectory = simulate(replace(SCENE, effects=(Gravity(), end)))
    at_A, _ = trajectory.reactions()
    momentum = sum(
        mass * np.array(velocity(GENERAL, tuple(trajectory.q), tuple(trajectory.u), centre))
        for mass, centre in ((GENERAL.m1, GENERAL.C1), (GENERAL.m2, GENERAL.C2))
    )
    change = momentum[:, -1] - momentum[:, 0]
    outer = np.array([[-1.2], [-3.0 + 9.81 * sum(GENERAL.mass)]])
    impulse = np.trapezoid(at_A + outer, trajectory.t)
    assert change == pytest.approx(impulse, abs=1e-3)
