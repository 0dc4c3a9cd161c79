"""Joint stops: rebounds, accumulation of bounces, rest, and leaving again at the exact instant."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.verification.chains import GENERAL
from twolink.chain import Chain
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.errors import ParameterError, SimulationError
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.hybrid.run import hybrid_run

BALANCED = Chain((1.0, 1.0), (1.0, 1.0), ((0.0, 0.0), (0.0, 0.0)), (2.0, 0.5))
"""Both mass centres on the joints: each link turns on its own, and M = diag(3, 0.5)."""


def scene(*effects, chain=BALANCED, q=(0.0, 0.0), u=(0.0, 0.0), duration=2.0):
    return Scene(chain=chain, q=q, u=u, duration=duration, effects=effects, accuracy=1e-11)


def test_a_free_link_rebounds_with_the_restitution():
    """At 2 rad/s the stop at 1 rad is met after 0.5 s; it goes back at 0.8 · 2 rad/s."""
    trajectory = simulate(scene(JointStop("A", upper=1.0, restitution=0.8), u=(2.0, 0.0)))
    (impact,) = trajectory.impacts
    assert impact.time == pytest.approx(0.5, abs=1e-15)
    assert impact.name == "A on its upper stop"
    assert impact.u == ((2.0, 0.0), (pytest.approx(-1.6, abs=1e-15), 0.0))
    assert impact.normal_impulse == pytest.approx(3 * 3.6, abs=1e-14)
    assert impact.energy_change == pytest.approx(-(1 - 0.64) * 6, abs=1e-14)
    after = trajectory.t > 0.5
    expected = 1 - 1.6 * (trajectory.t[after] - 0.5)
    assert trajectory.q[0, after] == pytest.approx(expected, abs=1e-14)


def test_a_link_bounces_between_two_elastic_stops_at_equal_intervals():
    stops = JointStop("A", lower=-1.0, upper=1.0, restitution=1.0)
    trajectory = simulate(scene(stops, u=(3.0, 0.0), duration=20.0))
    times = [impact.time for impact in trajectory.impacts]
    assert times == pytest.approx([(1 + 2 * k) / 3 for k in range(30)], abs=1e-12)
    assert trajectory.kinetic_energy == pytest.approx(13.5, abs=1e-12)


def test_the_elbows_stop_counts_the_angle_between_the_links():
    """Only the relative speed is reversed; A's momentum about the pivot stays: 3 u1 + 0.5 u2."""
    trajectory = simulate(scene(JointStop("B", upper=1.0, restitution=0.5), u=(0.0, 2.0)))
    (impact,) = trajectory.impacts
    (u1, u2), (w1, w2) = impact.u
    assert w2 - w1 == pytest.approx(-0.5 * (u2 - u1), abs=1e-15)
    assert 3 * w1 + 0.5 * w2 == pytest.approx(3 * u1 + 0.5 * u2, abs=1e-14)


@pytest.mark.slow
@pytest.mark.parametrize("restitution", [0.0, 0.3, 0.7, 0.9])
def test_bounces_accumulate_and_then_it_rests(restitution):
    """A torque of 3 N m drives 3 kg m² against a stop: with e the bounces last 2 v/(1 − e)."""
    effects = JointStop("A", upper=0.5, restitution=restitution), JointTorque((3.0, 0.0))
    trajectory = simulate(scene(*effects, duration=25.0))
    v = 1.0  # from rest over 0.5 rad at 1 rad/s²
    last = 1.0 + 2 * v * restitution / (1 - restitution)
    rest = trajectory.events[-1]
    assert str(rest.mode) == "A on its upper stop rests"
    assert rest.time == pytest.approx(last, abs=1e-9)
    after = trajectory.t > rest.time
    assert np.all(trajectory.q[0, after] == 0.5)
    assert np.all(trajectory.u[0, after] == 0.0)
    assert np.all(trajectory.q[0] <= 0.5)
    bounces = [impact.speeds for impact in trajectory.impacts if impact.speeds[0] < 0]
    for before, after_it in bounces:
        assert after_it == pytest.approx(-restitution * before, rel=1e-12, abs=-1e-15 * before)
    last_seen = [impact.regime for impact in trajectory.impacts].count("bounces die away")
    assert last_seen == (1 if restitution else 0)


def test_the_elbow_never_passes_its_stops_between_samples():
    effects = JointStop("B", lower=-0.3, upper=0.4, restitution=0.6), Gravity()
    trajectory = simulate(scene(*effects, chain=GENERAL, q=(0.2, 0.1), duration=5.0))
    assert len(trajectory.impacts) > 20
    q, _ = trajectory.at(np.linspace(0, 5, 20_000))
    elbow = q[1] - q[0]
    assert elbow.min() >= -0.3 - 1e-14
    assert elbow.max() <= 0.4 + 1e-14


def test_the_joint_leaves_its_stop_when_the_torque_changes_sign():
    """A sine pushes into the stop for half a period: it leaves exactly when the sine turns."""
    sine = JointTorque(amplitude=(2.0, 0.0), frequency=(1.0, 0.0))
    trajectory = simulate(scene(JointStop("A", upper=0.0), sine, duration=6.0))
    first, second = trajectory.events
    assert str(first.mode) == "A on its upper stop rests"
    assert second.time == pytest.approx(math.pi, abs=1e-12)
    after = trajectory.t > math.pi
    t = trajectory.t[after] - math.pi
    assert trajectory.q[0, after] == pytest.approx(-2 / 3 * (t - np.sin(t)), abs=1e-12)


@pytest.mark.parametrize("share", [0.99, 1.01])
def test_friction_and_a_stop_at_one_joint(share):
    """A push into the stop is borne by friction first; away from it friction alone holds."""
    friction = JointFriction((1.0, 0.0))
    away = JointTorque((-share, 0.0))
    trajectory = simulate(scene(JointStop("A", upper=0.0), friction, away))
    moved = trajectory.q[0, -1]
    assert moved == (0.0 if share < 1 else pytest.approx(-0.5 * 0.01 / 3 * 4, rel=1e-9))
    into = simulate(scene(JointStop("A", upper=0.0), friction, JointTorque((5.0, 0.0))))
    assert np.all(into.q[0] == 0.0)
    assert np.all(into.u[0] == 0.0)


def test_two_stops_at_once_never_give_energy(random):
    """Both joints meet their stops at one instant, from many directions."""
    for _ in range(20):
        # In eighths, so that both arrive at 1/8 s in every precision.
        u = random.integers(4, 24, 2) / 8
        e = random.uniform(0, 1, 2).tolist()
        effects = (
            JointStop("A", upper=float(u[0]) / 8, restitution=e[0]),
            JointStop("B", upper=float(u[1] - u[0]) / 8, restitution=e[1]),
        )
        if u[1] <= u[0]:
            continue
        start = scene(*effects, chain=BALANCED, u=tuple(u.tolist()), duration=0.2)
        trajectory = simulate(start)
        T = trajectory.kinetic_energy
        assert np.all(np.diff(T) <= 1e-12 * T[0])
        assert len(trajectory.impacts) >= 2
        assert {impact.index for impact in trajectory.impacts} == {0, 1}
        assert trajectory.q[0, -1] <= float(u[0]) / 8
        assert trajectory.q[1, -1] - trajectory.q[0, -1] <= float(u[1] - u[0]) / 8 + 1e-15


def test_a_stop_met_at_no_speed_is_neither_missed_nor_doubled():
    """Decelerated to a halt exactly at the stop, it turns there: no impact that takes energy."""
    for gap in (-1e-9, 1e-9):
        effects = JointStop("A", upper=0.5 + gap, restitution=0.5), JointTorque((-3.0, 0.0))
        trajectory = simulate(scene(*effects, u=(1.0, 0.0), duration=1.5))
        assert len(trajectory.impacts) == (1 if gap < 0 else 0)
        if gap < 0:
            (impact,) = trajectory.impacts
            assert impact.speeds[0] == pytest.approx(-math.sqrt(2e-9), rel=1e-5)
    effects = JointStop("A", upper=0.5, restitution=0.5), JointTorque((-3.0, 0.0))
    trajectory = simulate(scene(*effects, u=(1.0, 0.0), duration=1.5))
    assert len(trajectory.impacts) <= 1
    assert trajectory.q[0] == pytest.approx(trajectory.t - trajectory.t**2 / 2, abs=1e-11)


@pytest.mark.slow
def test_works_close_the_balance_across_impacts():
    effects = (
        Gravity(),
        JointStop("A", upper=2.0, restitution=0.5),
        JointStop("B", lower=-0.5, upper=0.5, restitution=0.7),
        JointFriction((0.3, 0.1)),
    )
    trajectory = simulate(scene(*effects, chain=GENERAL, duration=4.0))
    assert len(trajectory.impacts) > 3
    works, T = trajectory.work(), trajectory.kinetic_energy
    assert sum(works.values()) == pytest.approx(T - T[0], abs=1e-9)
    for name in ("JointStop A", "JointStop B", "JointFriction"):
        assert np.all(np.diff(works[name]) <= 1e-12)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("formulation", ["lagrange", "kane"])
@pytest.mark.parametrize("accuracy", [1e-6, 1e-11])
def test_accuracy_is_honoured_across_impacts(formulation, accuracy):
    effects = Gravity(), JointStop("B", lower=-0.6, upper=0.5, restitution=0.6)
    start = scene(*effects, chain=GENERAL, q=(0.2, 0.1), duration=2.0)
    trajectory = simulate(start, accuracy=accuracy, samples=101, formulation=formulation)
    exact = hybrid_run(start, trajectory.t, precision="quadruple")
    assert trajectory.error <= accuracy
    assert np.abs(trajectory.q - exact.q.astype(float)).max() <= accuracy
    assert np.abs(trajectory.u - exact.u.astype(float)).max() <= accuracy
    for ours, theirs in zip(trajectory.impacts[:5], exact.log[:5], strict=True):
        assert ours.time == pytest.approx(theirs.time, abs=accuracy)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"joint": "C", "lower": 0.0}, "joint must be 'A' or 'B'; got 'C'"),
        ({"joint": "A"}, "joint stop at A must have lower, upper, or both; got no angle"),
        ({"joint": "A", "lower": math.nan}, "lower must be a finite angle; got nan rad"),
        (
            {"joint": "B", "lower": 1.0, "upper": 1.0},
            "lower must be below upper; got lower 1.0 and upper 1.0 rad",
        ),
        ({"joint": "B", "lower": 1.0, "restitution": 1.1}, "restitution must be 0 to 1; got 1.1"),
        (
            {"joint": "B", "lower": 1.0, "restitution": math.nan},
            "restitution must be 0 to 1; got nan",
        ),
    ],
)
def test_bad_stops_are_refused(options, words):
    with pytest.raises(ParameterError, match=words):
        JointStop(**options)


def test_a_start_beyond_a_stop_is_refused():
    with pytest.raises(SimulationError, match=r"upper stop: .*; got a start 0.2 rad inside"):
        simulate(scene(JointStop("A", upper=0.3), q=(0.5, 0.0)))


def test_a_start_on_a_stop_is_allowed():
    for speed, count in ((1.0, 1), (0.0, 0), (-1.0, 0)):
        start = scene(JointStop("A", upper=0.5, restitution=0.5), q=(0.5, 0.0), u=(speed, 0.0))
        assert len(simulate(start).impacts) == count
    below = replace(start, u=(0.0, 0.0), effects=(*start.effects, JointTorque((1.0, 0.0))))
    assert str(simulate(below).events[0].mode) == "A on its upper stop rests"
