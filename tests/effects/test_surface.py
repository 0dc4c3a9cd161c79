"""Rigid surfaces: impacts, bounces that die away, sliding, sticking, leaving."""

import math
from dataclasses import replace

import mpmath
import numpy as np
import pytest

from tests.verification.chains import GENERAL
from twolink import kinematics
from twolink.chain import Chain
from twolink.data import data_path
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_torque import JointTorque
from twolink.effects.surface import Surface
from twolink.errors import ParameterError, SimulationError
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.hybrid.run import hybrid_run

BARS = Chain.uniform_bars()
DOWN = (0.0, -1.0)


def floor(height: float, **options) -> Surface:
    return Surface((0.0, height), DOWN, name="floor", **options)


def scene(*effects, chain=BARS, q=(0.3, -0.2), u=(0.0, 0.0), duration=6.0, accuracy=1e-9):
    return Scene(chain=chain, q=q, u=u, duration=duration, effects=effects, accuracy=accuracy)


def height_of_D(trajectory, times):
    q, _ = trajectory.at(times)
    return kinematics.position(trajectory.chain, tuple(q), trajectory.chain.D)[1]


@pytest.mark.slow_but_first
@pytest.mark.parametrize("restitution", [0.0, 0.5, 0.8])
@pytest.mark.parametrize("friction", [0.0, 0.2, 0.8])
def test_the_chain_bounces_to_rest_and_never_enters_the_floor(restitution, friction):
    trajectory = simulate(
        scene(Gravity(), floor(1.2, restitution=restitution, friction=friction), duration=10.0)
    )
    assert trajectory.met
    assert height_of_D(trajectory, np.linspace(0, 10, 20_001)).max() <= 1.2 + 5e-15
    assert "rests" in "".join(map(str, (e.mode for e in trajectory.events))) or friction
    works, T = trajectory.work(), trajectory.kinetic_energy
    assert sum(works.values()) == pytest.approx(T - T[0], abs=1e-10)
    assert np.all(np.diff(works["Surface"]) <= 1e-12)
    if friction:
        assert str(trajectory.events[-1].mode) == "D on floor sticks"
        late = trajectory.t > trajectory.events[-1].time
        assert np.all(trajectory.u[:, late] == 0)


@pytest.mark.slow
def test_long_contact_does_not_drift():
    """Pushed to and fro along the floor for 100 s, D stays on it to 1e-12 in place and speed."""
    effects = (
        Gravity(),
        floor(1.2, friction=0.02),
        JointTorque(amplitude=(3.0, 0.0), frequency=(4.0, 0.0)),
        JointDamping((0.1, 0.1)),
    )
    q1 = math.asin(0.6) + 0.3
    q = q1, math.asin(1.2 - math.sin(q1))
    start = scene(*effects, q=q, duration=100.0, accuracy=1e-6)
    trajectory = simulate(start)
    assert len(trajectory.events) > 50
    t = np.linspace(0, 100, 30_001)
    q, u = trajectory.at(t)
    on_the_floor = np.zeros(len(t), dtype=bool)
    for now, mode in trajectory.mode_forces.modes_at(t):
        on_the_floor[now] = str(mode) != "moves freely"
    assert on_the_floor.mean() > 0.9
    y = kinematics.position(BARS, tuple(q), BARS.D)[1][on_the_floor]
    v = kinematics.velocity(BARS, tuple(q), tuple(u), BARS.D)[1][on_the_floor]
    assert np.abs(y - 1.2).max() < 1e-12
    assert np.abs(v).max() < 1e-12


def held_ratio(q):
    """|T|/N at D when it is held at rest on a floor, from two equations of the whole chain."""
    Q = 9.81 * np.array([1.5 * math.cos(q[0]), 0.5 * math.cos(q[1])])
    J = np.array([[-math.sin(q[0]), -math.sin(q[1])], [math.cos(q[0]), math.cos(q[1])]])
    T, N = np.linalg.solve(J.T, -Q)
    return abs(T / N)


@pytest.mark.parametrize(("share", "sticks"), [(1.01, True), (0.99, False)])
def test_the_threshold_of_sticking(share, sticks):
    q = (0.3, 1.1)
    height = math.sin(q[0]) + math.sin(q[1])
    rough = floor(height, friction=share * held_ratio(q))
    trajectory = simulate(scene(Gravity(), rough, q=q, duration=0.5))
    assert ("sticks" in str(trajectory.events[0].mode)) == sticks
    assert (np.abs(trajectory.u).max() < 1e-14) == sticks


def test_static_friction_holds_more_than_kinetic():
    q = (0.3, 1.1)
    height = math.sin(q[0]) + math.sin(q[1])
    mu = held_ratio(q)
    held = floor(height, friction=0.5 * mu, static=1.01 * mu)
    assert str(simulate(scene(Gravity(), held, q=q, duration=0.5)).events[-1].mode).endswith(
        "sticks"
    )


@pytest.mark.slow
def test_the_end_leaves_at_the_instant_of_zero_contact_force():
    """Torque of a sine lifts D off: just before, N is small and positive, and 0 at the instant."""
    q = (math.asin(0.6), math.asin(0.6))
    lift = JointTorque(amplitude=(-25.0, 0.0), frequency=(1.0, 0.0))
    start = scene(Gravity(), floor(1.2), lift, q=q, duration=2.0, accuracy=1e-11)
    trajectory = simulate(start)
    leaving = next(e.time for e in trajectory.events if str(e.mode) == "moves freely")
    exact = hybrid_run(start, trajectory.t, precision="quadruple")
    true = next(e.time for e in exact.events if str(e.mode) == "moves freely")
    assert leaving == pytest.approx(true, abs=1e-11)
    # On the floor and free, D has the same acceleration there: none along the normal.
    from twolink import lagrange
    from twolink.effects import smooth_loads

    (q1,), (q2,) = trajectory.at(leaving)[0]
    (u1,), (u2,) = trajectory.at(leaving)[1]
    state = (float(q1), float(q2)), (float(u1), float(u2))
    loads = smooth_loads(start.effects, BARS, *state, leaving)
    du = lagrange.forward_dynamics(BARS, *state, loads)
    assert kinematics.acceleration(BARS, *state, du, BARS.D)[1] == pytest.approx(0, abs=1e-9)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("gap", [-1e-9, 1e-9])
def test_a_graze_is_found_exactly_once(gap):
    """A pendulum's lowest point passes a floor by a nanometre, above or below."""
    swing = scene(Gravity(), q=(0.4, 0.4), duration=2.0)
    t = np.linspace(0, 2, 200_001)
    lowest = height_of_D(simulate(swing), t).max()
    t_low = t[np.argmax(height_of_D(simulate(swing), t))]
    grazing = replace(swing, effects=(*swing.effects, floor(lowest + gap, restitution=0.5)))
    trajectory = simulate(replace(grazing, duration=float(t_low) + 0.05))
    struck = [impact for impact in trajectory.impacts if abs(impact.time - t_low) < 0.01]
    assert bool(struck) == (gap < 0)
    speeds = [impact.speeds[0] for impact in struck if impact.speeds[0] < 0]
    if gap < 0:
        assert all(abs(speed) < 1e-3 for speed in speeds)


def test_the_time_of_rest_does_not_depend_on_the_number_of_resolved_bounces():
    """Three precisions follow the bounces ever further down; the instant of rest is one."""
    start = scene(Gravity(), floor(1.2, restitution=0.6), duration=2.0)
    times, counts = [], []
    for precision in ("double", "long double", "quadruple"):
        run = hybrid_run(start, (0.0, 2.0), precision=precision)
        times.append(next(e.time for e in run.events if "rests" in str(e.mode)))
        counts.append(len(run.log))
    assert counts[0] < counts[1] < counts[2]
    assert times == pytest.approx([times[2]] * 3, abs=1e-11)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("formulation", ["lagrange", "kane"])
@pytest.mark.parametrize("law", ["newton", "newton-routh", "poisson", "stronge"])
def test_accuracy_is_honoured_across_impacts(formulation, law):
    rough = floor(1.2, restitution=0.7, friction=0.3, law=law)
    start = scene(Gravity(), rough, duration=1.5, accuracy=1e-10)
    trajectory = simulate(start, samples=61, formulation=formulation)
    assert trajectory.error <= 1e-10
    exact = hybrid_run(start, trajectory.t, precision="quadruple")
    apart = np.ones(61, dtype=bool)
    for impact in exact.log:
        apart &= np.abs(trajectory.t - impact.time) > 1e-9
    assert np.abs(trajectory.q - exact.q.astype(float))[:, apart].max() <= 1e-10
    assert np.abs(trajectory.u - exact.u.astype(float))[:, apart].max() <= 1e-10
    for ours, theirs in zip(trajectory.impacts[:8], exact.log[:8], strict=True):
        assert ours.time == pytest.approx(theirs.time, abs=1e-10)
        assert ours.regime == theirs.regime


@pytest.mark.slow
def test_elbow_and_tip_at_once_never_gain_energy(random):
    """Both points of a stretched chain meet a wall along it at one instant."""
    for _ in range(20):
        q1 = float(random.uniform(0.2, 1.4))
        u = tuple(random.uniform(-3, -0.5, 2).tolist())
        normal = (-math.sin(q1), math.cos(q1))
        wall = Surface(
            (0.0, 0.0), normal, on=("B", "D"), restitution=float(random.uniform(0, 1)),
            friction=float(random.uniform(0, 1)), name="wall",
        )  # fmt: skip
        trajectory = simulate(scene(wall, chain=GENERAL, q=(q1, q1), u=u, duration=0.2))
        T = trajectory.kinetic_energy
        assert np.all(np.diff(T) <= 1e-12 * T[0])
        first = [impact for impact in trajectory.impacts if impact.time == 0]
        assert {impact.name for impact in first} == {"B on wall", "D on wall"}


@pytest.mark.slow_but_first
@pytest.mark.parametrize("law", ["newton", "newton-routh", "poisson", "stronge"])
@pytest.mark.parametrize("friction", [0.2, 1.5])
def test_the_elbow_is_struck_on_its_circle(law, friction):
    """It moves along one line only: a force that slows it along the floor slows it across."""
    chain = Chain.point_masses((1.0, 0.6), (1.0, 0.9))
    surface = floor(0.8, restitution=0.5, friction=friction, law=law, on=("B",))
    trajectory = simulate(scene(Gravity(), surface, chain=chain, duration=2.0))
    assert trajectory.met
    first, lever = trajectory.impacts[0], math.tan(math.asin(0.8))
    assert abs(first.sliding[0] / first.speeds[0]) == pytest.approx(lever)
    if friction * lever >= 1:
        assert first.regime == "sticks"
        assert first.speeds[1] == 0
    else:
        assert first.regime == "slides back"
        assert abs(first.sliding[1] / first.speeds[1]) == pytest.approx(lever)
    works, T = trajectory.work(), trajectory.kinetic_energy
    assert sum(works.values()) == pytest.approx(T - T[0], abs=1e-8)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("formulation", ["lagrange", "kane"])
def test_a_chain_that_rests_on_two_points_stays_at_rest(formulation):
    """D slides when B is struck, and the rest of its speed is round-off: it does not fly off."""
    chain = Chain.point_masses((1.0, 0.9923371066338436), (1.0, 0.9431624080780688))
    surface = floor(-0.3196961928711095, friction=0.254, law="poisson", on=("B", "D"))
    start = scene(
        Gravity(), surface, chain=chain, q=(-0.509502839091557, 2.9624621216541893),
        u=(2.4982047300996104, 0.46106569038311296), duration=1.0, accuracy=1e-6,
    )  # fmt: skip
    trajectory = simulate(start, formulation=formulation)
    assert trajectory.met
    assert len(trajectory.events) == 2
    assert np.abs(trajectory.u[:, -1]).max() == 0


@pytest.mark.slow
def test_bounces_that_die_away_on_two_points_leave_no_speed():
    surface = floor(-0.7186599244635882, restitution=0.103, law="newton", on=("B", "D"))
    start = scene(
        Gravity(), surface, q=(-0.8018732314606898, -1.7320333536369614),
        u=(0.14073576648463604, -1.4761041016837626), duration=2.0, accuracy=1e-10,
    )  # fmt: skip
    trajectory = simulate(start)
    assert "B on floor rests, D on floor rests" in trajectory.events[-1].description
    assert np.abs(trajectory.u[:, -1]).max() == 0
    exact = hybrid_run(start, trajectory.t, precision="quadruple")
    assert np.abs(trajectory.q - exact.q.astype(float)).max() <= 1e-10


@pytest.mark.parametrize(("speed", "impacts"), [(0.0, 0), (0.4, 1), (-0.4, 0)])
def test_a_start_on_the_floor(speed, impacts):
    """At rest on it, moving into it, and away from it."""
    q = (math.asin(0.6), math.asin(0.6))
    start = scene(Gravity(), floor(1.2, restitution=0.5), q=q, u=(speed, 0.0), duration=0.05)
    trajectory = simulate(start)
    assert len([impact for impact in trajectory.impacts if impact.time == 0]) == impacts


def test_an_impact_that_gains_energy_by_newtons_law_is_reported():
    scene_file = data_path("scenes") / "published" / "kane_levinson_impact.toml"
    impact = simulate(Scene.load(scene_file)).impacts[0]
    assert impact.energy_change > 0
    assert "creates energy" in impact.description


def test_a_surface_never_touched_changes_nothing():
    start = scene(Gravity(), duration=3.0)
    free = simulate(start)
    far = simulate(replace(start, effects=(*start.effects, floor(5.0, friction=0.5))))
    assert far.impacts == ()
    assert far.q == pytest.approx(free.q, abs=2e-9)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"normal": (0.0, 0.0)}, r"normal must be two numbers, not both zero; got \(0\.0, 0\.0\)"),
        (
            {"normal": (0.0, math.nan)},
            r"must be finite numbers; got point .* and normal \(0\.0, nan\)",
        ),
        ({"restitution": 1.01}, "restitution must be 0 to 1; got 1.01"),
        ({"restitution": -0.1}, "restitution must be 0 to 1; got -0.1"),
        ({"friction": -0.5}, "friction must be zero or positive and finite; got -0.5"),
        (
            {"friction": 0.5, "static": 0.4},
            "static must be finite and not below the friction 0.5; got 0.4",
        ),
        ({"law": "moreau"}, "law must be one of newton, .*; got 'moreau'"),
        ({"on": ("E",)}, "on must be one or more of B, C1, C2, D, each once; got .'E'"),
        ({"on": ()}, r"on must be one or more of .*; got \(\)"),
    ],
)
def test_bad_surfaces_are_refused(options, words):
    with pytest.raises(ParameterError, match=words):
        Surface(**{"point": (0.0, 1.0), "normal": DOWN, **options})


def test_a_start_inside_is_refused():
    with pytest.raises(
        SimulationError, match=r"D on floor: the scene must start .*; got a start 0\.09\d* m inside"
    ):
        simulate(scene(Gravity(), floor(0.0), q=(0.1, 0.0)))


@pytest.mark.parametrize("bend", [1e-3, 1e-5, 1e-7])
@pytest.mark.parametrize("law", ["newton", "stronge"])
def test_an_impact_that_sticks_near_a_straight_pose(law, bend):
    """e = 0 and no sliding: both speeds of D are zero, so the chain is at rest."""
    q = (0.6, 0.6 + bend)
    height = math.sin(q[0]) + math.sin(q[1])
    rough = floor(height, friction=50.0, law=law)
    start = scene(rough, q=q, u=(0.4, 0.3), duration=0.01)
    impact = simulate(start, accuracy=1e-6).impacts[0]
    assert impact.regime.endswith("sticks")
    # Rounding of D's speed, through the short lever that is left of the bend.
    assert np.abs(impact.u[1]).max() <= 1e-14 / bend
    assert impact.energy_change < 0


@pytest.mark.parametrize(
    "surface",
    [Surface((0.1, 0.7), (3.0, -4.0)), CompliantSurface((0.1, 0.7), (3.0, -4.0), "hertz", 1e4)],
)
def test_a_tilted_surface_has_the_digits_of_the_chain(surface):
    """Its unit normal, and its place along it: 3/5 · 0.1 − 4/5 · 0.7."""
    with mpmath.workdps(60):
        (element,) = surface.contact_elements(GENERAL.convert(mpmath.mpf))
        bound = (3 * mpmath.mpf(0.1) - 4 * mpmath.mpf(0.7)) / 5
        assert abs(element.bound - bound) < mpmath.mpf(10) ** -58
        assert abs(element.normal.vector[0] - mpmath.mpf(3) / 5) < mpmath.mpf(10) ** -58
