"""A surface that yields: a point mass and chains on it, against quadrature and other integrators.

A chain whose mass is all in D is a point mass: its motion down a straight line is
computed here again in one dimension, by SciPy, with a law that is written out again.
"""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

from twolink.chain import Chain
from twolink.contact.force_laws import Phase
from twolink.contact.states import ContactState
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_stop import JointStop
from twolink.effects.sampled_torque import SampledTorque
from twolink.errors import ParameterError, SceneError, SimulationError
from twolink.scene import Scene
from twolink.simulation import Trajectory, simulate
from twolink.simulation.hybrid.run import hybrid_run

# But for 1e-12 kg all the mass is in D.
POINT = Chain(
    mass=(1e-12, 1.0), length=(1.0, 1.0), centre=((0.5, 0.0), (1.0, 0.0)), inertia=(1e-14, 1e-14)
)
BARS = Chain.uniform_bars()
Q = (0.3, 1.1)
HEIGHT = math.sin(Q[0]) + math.sin(Q[1])
SOFT = {"radius": 0.05, "modulus": (1e8, 2e11), "poisson": (0.3, 0.3), "strength": (1e6, 1e9)}

# The law of those numbers, written out again.
E_STAR = 1 / (0.91 / 1e8 + 0.91 / 2e11)
C = 1.295 * math.exp(0.736 * 0.3)
SLOPE = math.pi * C * 1e6 / (2 * E_STAR)
D_Y = SLOPE**2 * 0.05
P_Y = 4 / 3 * E_STAR * math.sqrt(0.05) * D_Y**1.5
B = 0.14 * math.exp(23 * 1e6 / E_STAR)


def compression(depth: float) -> float:
    x = depth / D_Y
    if x < 1.9:
        return P_Y * max(x, 0.0) ** 1.5
    a = SLOPE * math.sqrt(x * (x / 1.9) ** B)
    hardness = 2.84 - 0.92 * (1 - math.cos(math.pi * a))
    flow = 4 * hardness / C * (1 - math.exp(-(x ** (5 / 9)) / 25)) * x
    return P_Y * (math.exp(-0.25 * x ** (5 / 12)) * x**1.5 + flow)


def residual(deepest: float) -> float:
    x = deepest / D_Y
    return 1.02 * deepest * (1 - ((x + 5.9) / 6.9) ** -0.54) if x > 1 else 0.0


def compressed(depth: float) -> float:
    """The work (J) that compression takes."""
    edges = [0.0, *(d for d in (1.9 * D_Y,) if d < depth), depth]
    return sum(quad(compression, a, b, epsabs=0, epsrel=1e-13)[0] for a, b in pairwise(edges))


def given_back(deepest: float) -> float:
    return 2 / 5 * compression(deepest) * (deepest - residual(deepest))


def floor(height=HEIGHT, **options) -> CompliantSurface:
    values = {**SOFT, "name": "floor", **options}
    return CompliantSurface((0.0, height), (0.0, -1.0), "elasto-plastic", **values)


def speeds_of(normal: float, sliding: float = 0.0) -> tuple[float, float]:
    """The speeds u with which D moves into the floor (m/s) and along x."""
    J = np.array([[math.cos(q) for q in Q], [-math.sin(q) for q in Q]])
    u1, u2 = np.linalg.solve(J, [normal, sliding])
    return float(u1), float(u2)


def struck(v: float, *effects, sliding=0.0, duration=0.02, **options) -> Trajectory:
    """A point mass that strikes the floor at a speed (m/s)."""
    surface = floor(**options)
    start = Scene(
        chain=POINT, q=Q, u=speeds_of(v, sliding), duration=duration, effects=(*effects, surface),
        accuracy=1e-11,
    )  # fmt: skip
    return simulate(start, samples=401)


def dents(trajectory: Trajectory) -> list:
    """The dents, in the order of time."""
    return [dent for event in trajectory.events for dent in dents_of(event)]


def dents_of(event) -> list:
    """The dent of a mode, if there is one."""
    return [dent for dent in event.mode.dents if dent and dent.phase is Phase.DENTED]


@pytest.mark.slow_but_first
@pytest.mark.parametrize("v", [0.01, 0.02, 0.05, 0.3, 1.0, 3.0])
def test_the_rebound_of_a_point_mass_agrees_with_quadrature(v):
    """Restitution and permanent deformation to 1e-9, from the areas below both curves."""
    trajectory = struck(v)
    deepest = brentq(lambda d: compressed(d) - v * v / 2, 1e-9, 0.02, xtol=1e-18, rtol=1e-15)
    expected = math.sqrt(given_back(deepest) / (v * v / 2))
    rebound = -trajectory.velocity(POINT.D)[1, -1] / v
    assert rebound == pytest.approx(expected, rel=1e-9)
    found = dents(trajectory)
    if deepest < D_Y:
        assert rebound == pytest.approx(1.0, abs=1e-10)
        assert not found
    else:
        assert found[0].deepest == pytest.approx(deepest, rel=1e-9)
        assert found[0].residual == pytest.approx(residual(deepest), rel=1e-9)
        assert rebound < 1


def test_below_yield_the_motion_is_that_of_hertzs_law():
    stiffness = 4 / 3 * E_STAR * math.sqrt(0.05)
    hertz = CompliantSurface((0.0, HEIGHT), (0.0, -1.0), "hertz", stiffness, name="floor")
    for v in (0.001, 0.009):
        trajectory = struck(v)
        same = simulate(replace(trajectory.scene, effects=(hertz,)), samples=401)
        assert trajectory.q == pytest.approx(same.q, abs=1e-14)
        assert trajectory.u == pytest.approx(same.u, abs=1e-14)
        times = [[event.time for event in each.events] for each in (trajectory, same)]
        assert times[0] == pytest.approx(times[1], abs=1e-14)


def test_sliding_loses_mu_times_the_normal_impulse():
    trajectory = struck(0.5, sliding=2.0, friction=0.2)
    vx, vy = trajectory.velocity(POINT.D)[:, -1]
    assert 2.0 - vx == pytest.approx(0.2 * (0.5 - vy), rel=1e-10)


def in_one_dimension(v: float, gravity: float, times: np.ndarray) -> tuple[np.ndarray, int]:
    """The depths (m) of 1 kg that strikes at v, and how often it is pressed again in its dent."""
    stiff = {"rtol": 1e-13, "atol": 1e-17, "method": "DOP853", "max_step": 2e-4}

    def crossing(value, direction):
        event = lambda t, y: value(y)  # noqa: E731
        event.terminal, event.direction = True, direction
        return event

    t, y, deepest, again = 0.0, np.array([0.0, v]), 0.0, 0
    phase, depths = "compression", np.full_like(times, np.nan)
    while t < times[-1]:
        stays = residual(deepest)
        spring = compression(deepest) / (deepest - stays) ** 1.5 if deepest > D_Y else 0.0
        if phase == "compression":
            force = compression
            ends = [crossing(lambda y: y[1], -1), crossing(lambda y: y[0] - 1.9 * D_Y, 1)]
        elif phase == "in the dent":
            force = lambda d, s=spring, r=stays: s * max(d - r, 0.0) ** 1.5  # noqa: E731
            ends = [
                crossing(lambda y, d=deepest: y[0] - d, 1),
                crossing(lambda y: y[0], -1),
                crossing(lambda y, r=stays: y[0] - r, 1),
                crossing(lambda y, r=stays: y[0] - r, -1),
            ]
        else:
            force = lambda d: 0.0  # noqa: E731
            ends = [crossing(lambda y: y[0], 1)]
        if phase == "compression" and y[0] >= 1.9 * D_Y:
            ends.pop()
        run = solve_ivp(
            lambda t, y, f=force: [y[1], gravity - f(y[0])], (t, times[-1]), y, events=ends,
            dense_output=True, **stiff,
        )  # fmt: skip
        inside = (times >= t) & (times <= run.t[-1])
        depths[inside] = run.sol(times[inside])[0]
        t, y = run.t[-1], run.y[:, -1].copy()
        hit = next((number for number, found in enumerate(run.t_events) if len(found)), None)
        if hit is None:
            break
        if phase == "compression":
            if hit == 0:
                phase, deepest, y[1] = "in the dent", y[0], 0.0
            else:
                y[0] = 1.9 * D_Y
        elif phase == "in the dent":
            again += hit == 2
            phase = {0: "compression", 1: "free"}.get(hit, phase)
            y[0] += 1e-18 * {2: 1, 3: -1}.get(hit, 0)
        else:
            phase, deepest = "compression", 0.0
    return depths, again


@pytest.mark.slow_but_first
@pytest.mark.parametrize(("v", "gravity", "duration"), [(0.05, 30.0, 0.04), (0.3, 100.0, 0.0095)])
def test_a_dent_pressed_again_follows_the_curve_of_its_restitution(v, gravity, duration):
    """Held down by gravity D bounces in its dent: all of it by SciPy in one dimension."""
    trajectory = struck(v, Gravity(gravity), duration=duration)
    depths, again = in_one_dimension(v, gravity, trajectory.t)
    ours = trajectory.position(POINT.D)[1] - HEIGHT
    assert np.abs(ours - depths).max() <= 1e-9
    assert again >= 1
    modes = [event.mode for event in trajectory.events if dents_of(event)]
    presses = [mode for mode in modes if mode.states[0] is not ContactState.OPEN]
    assert len(presses) >= 2


def test_a_dent_pressed_deeper_continues_the_first_compression():
    """A push of 60 N while D lies in its dent: the loss is that of one deeper press."""
    push = 60 * math.cos(Q[1]), 60 * (math.cos(Q[0]) + math.cos(Q[1]))
    motors = SampledTorque((0.0, 0.006), (0.0, push[1]), (0.0, push[0]), "hold")
    trajectory = struck(0.05, Gravity(30.0), motors, duration=0.012)
    first, *_, last = (dent.deepest for dent in dents(trajectory))
    assert last > 1.1 * first
    lost = compressed(last) - given_back(last)
    depth = trajectory.position(POINT.D)[1] - HEIGHT
    lies = residual(last)
    stored = 2 / 5 * compression(last) / (last - lies) ** 1.5 * np.maximum(depth - lies, 0) ** 2.5
    after = trajectory.t > dents_at(trajectory, last)
    assert after.sum() > 30
    work = trajectory.work()["CompliantSurface"]
    assert work[after] == pytest.approx(-lost - stored[after], rel=1e-8)


def dents_at(trajectory: Trajectory, deepest: float) -> float:
    """The time (s) at which a dent of this depth is made."""
    return next(
        event.time
        for event in trajectory.events
        if event.mode.dents[0] and event.mode.dents[0].deepest == deepest
    )


def chain_on(surface, duration=1.0, accuracy=1e-10) -> Scene:
    return Scene(
        chain=BARS, q=(0.3, -0.2), u=(0.0, 0.0), duration=duration, effects=(Gravity(), surface),
        accuracy=accuracy,
    )  # fmt: skip


ONTO = {"q": Q, "u": speeds_of(1.0, -0.3), "duration": 0.1}


@pytest.mark.slow
def test_round_off_does_not_stop_a_contact_that_begins_to_slide(random):
    """It begins with no acceleration: static friction is no more than kinetic."""
    start = replace(chain_on(floor(friction=0.9)), **ONTO)
    for _ in range(60):
        u1, u2 = np.array(start.u) * (1 + 1e-6 * random.standard_normal(2))
        run = hybrid_run(replace(start, u=(float(u1), float(u2))), [0.0, 0.01])
        states = [event.mode.states[0] for event in run.events]
        place = states.index(ContactState.STICKS)
        assert states[place:] == [
            ContactState.STICKS,
            ContactState.STICKS,
            ContactState.FORWARD,
            ContactState.OPEN,
        ]


@pytest.mark.slow
@pytest.mark.parametrize("formulation", ["lagrange", "kane"])
def test_a_slide_turns_with_the_dent_where_a_stop_holds_the_elbow(formulation):
    """With one way to move left, all speeds pass through zero at one instant."""
    wall = CompliantSurface(
        (0.2090626016232561, 0.047536179108491984), (0.9751107242627869, 0.22171845982620197),
        "elasto-plastic", friction=0.32317261791220375, radius=0.05, modulus=(1e8, 2e11),
        poisson=(0.3, 0.3), strength=(1e6, 1e9),
    )  # fmt: skip
    stop = JointStop("B", lower=-0.07642036384251683, upper=1.0784734555021607)
    damping = JointDamping((0.007171976257913271, 0.29681786766275503))
    start = Scene(
        chain=BARS, q=(-1.131143576272992, -0.7556448010487355),
        u=(0.598770812544088, 0.890870326283979), duration=0.9,
        effects=(Gravity(), stop, wall, damping),
    )  # fmt: skip
    times = np.linspace(0.0, 0.9, 91)
    found = hybrid_run(start, times, formulation=formulation)
    exact = hybrid_run(start, times, formulation="lagrange", precision="quadruple")
    assert [event.mode.states for event in found.events] == [
        event.mode.states for event in exact.events
    ]
    assert np.abs(found.q - exact.q.astype(float)).max() < 1e-11


@pytest.mark.slow
@pytest.mark.parametrize(
    ("start", "sticking"),
    [
        (chain_on(floor(1.2)), False),
        (chain_on(floor(1.2, friction=0.3)), False),
        (replace(chain_on(floor(friction=0.9)), **ONTO), True),
        (replace(chain_on(floor(friction=0.5, static=0.9, poisson=(0.5, 0.3))), **ONTO), True),
    ],
)
def test_accuracy_is_honoured(start, sticking):
    """Samples inside of contacts, too, against a run of 113 bits."""
    trajectory = simulate(start, samples=2001)
    exact = hybrid_run(start, trajectory.t, precision="quadruple")
    assert trajectory.error <= 1e-10
    assert np.abs(trajectory.q - exact.q.astype(float)).max() <= 1e-10
    assert np.abs(trajectory.u - exact.u.astype(float)).max() <= 1e-10
    assert len(dents(trajectory)) >= (1 if sticking else 4)
    sticks = [event for event in trajectory.events if event.mode.states[0] is ContactState.STICKS]
    assert bool(sticks) == sticking
    for ours, theirs in zip(trajectory.events, exact.events, strict=True):
        assert ours.time == pytest.approx(theirs.time, abs=1e-10)
        assert ours.mode.kind == theirs.mode.kind


@pytest.mark.slow_but_first
@pytest.mark.parametrize("order", [13, 17, 21])
def test_the_order_is_kept_through_all_phases(order):
    """A touch, two yields, a turn and a release cost no digits, at any order.

    A press of a millisecond makes of an error in place one in speed that is a thousand times it.
    """
    start = chain_on(floor(1.2), duration=0.6)
    times = np.array([0.0, 0.41, 0.42, 0.4201, 0.4203, 0.421, 0.4213, 0.43, 0.5, 0.6])
    run = hybrid_run(start, times, order=order)
    exact = hybrid_run(start, times, precision="quadruple")
    errors = np.abs(run.u - exact.u.astype(float)).max(axis=0)
    assert errors.max() <= 1e4 * max(2.2e-16, math.exp(-2 * (order + 1)))


def test_the_energy_that_is_lost_is_the_area_between_both_curves():
    """Over many impacts of a chain: T + V at the end, and the work that the surface has done."""
    trajectory = simulate(chain_on(floor(1.2)), samples=1001)
    assert str(trajectory.events[-1].mode) == "moves freely"
    deepest = [dent.deepest for dent in dents(trajectory)]
    lost = sum(compressed(d) - given_back(d) for d in deepest)
    assert trajectory.energy[0] - trajectory.energy[-1] == pytest.approx(lost, rel=1e-9)
    work = trajectory.work()
    assert -work["CompliantSurface"][-1] == pytest.approx(lost, rel=1e-9)
    T = trajectory.kinetic_energy
    assert sum(work.values()) == pytest.approx(T - T[0], abs=1e-10)


def test_two_points_in_one_place_are_followed_through_their_vibration():
    """At rest on steel they come out after each swing, at the same instant."""
    chain = Chain((1.0, 1.0), (1.0, 1.0), ((0.5, 0.0), (1.0, 0.0)), (0.1, 0.1))
    steel = floor(
        on=("C2", "D"), radius=0.02, modulus=(2.1e11, 7e10), poisson=(0.3, 0.33),
        strength=(3e8, 1e9),
    )  # fmt: skip
    start = Scene(chain=chain, q=Q, u=(0.0, 0.0), duration=0.01, effects=(Gravity(), steel))
    trajectory = simulate(start, samples=11)
    assert trajectory.met, trajectory.failure
    for event in trajectory.events:
        first, second = event.mode.states
        assert first is second


@pytest.mark.slow
def test_energy_is_never_gained_and_friction_keeps_its_cone():
    rng = np.random.default_rng(4)
    for _ in range(6):
        friction = float(rng.uniform(0, 1.5))
        surface = floor(friction=friction, strength=(float(10 ** rng.uniform(5.5, 7)), 1e9))
        u = speeds_of(float(rng.uniform(0.1, 2)), float(rng.uniform(-2, 2)))
        start = Scene(chain=BARS, q=Q, u=u, duration=0.1, effects=(surface,), accuracy=1e-9)
        trajectory = simulate(start, samples=2001)
        free = np.ones(len(trajectory.t), dtype=bool)
        for now, mode in trajectory.mode_forces.modes_at(trajectory.t):
            free[now] = mode.states[0] is ContactState.OPEN
        # It starts on the floor, at no depth.
        free[0] = True
        energy = trajectory.energy[free]
        print(f"friction {friction:.3f}, energy {energy[0]:.6f} to {energy[-1]:.6f} J")
        assert np.diff(energy).max() <= 1e-10 * energy[0]
        assert energy[-1] < energy[0]


@pytest.mark.slow
def test_kanes_and_lagranges_equations_give_the_same_motion():
    start = chain_on(floor(1.2, friction=0.3))
    times = np.linspace(0.0, 1.0, 101)
    ours, theirs = (hybrid_run(start, times, formulation=name) for name in ("kane", "lagrange"))
    assert ours.q == pytest.approx(theirs.q, abs=1e-11)


def test_a_trajectory_with_dents_is_saved_and_loaded(tmp_path):
    trajectory = simulate(chain_on(floor(1.2, friction=0.3)), samples=201)
    trajectory.save(tmp_path / "run.npz")
    back = Trajectory.load(tmp_path / "run.npz")
    assert back.events == trajectory.events
    assert back.scene == trajectory.scene
    assert np.array_equal(back.reactions(), trajectory.reactions())


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"radius": 0.0}, "radius must be a positive finite number; got 0.0"),
        ({"radius": -1.0}, "radius must be a positive finite number; got -1.0"),
        ({"modulus": (0.0, 1.0)}, r"modulus must be two positive finite numbers; got \(0.0, 1.0\)"),
        ({"modulus": (1e9, -1.0)}, "modulus must be two positive finite numbers; got"),
        ({"strength": (1e6, 0.0)}, "strength must be two positive finite numbers; got"),
        ({"strength": (math.inf, 1e6)}, "strength must be two positive finite numbers; got"),
        ({"strength": (1e13, 1e13)}, r"strength must be at most 10 times the common modulus E\*"),
        ({"modulus": (1e-300, 1e6)}, r"strength must be at most 10 times .*, 1.1e-300 Pa, for the"),
        ({"modulus": (1e300, 1e300)}, "those of a surface that yields at a positive finite force"),
        ({"radius": 1e250}, "those of a surface that yields at a positive finite force"),
        ({"poisson": (0.3, 0.6)}, "poisson must be two numbers above -1 and up to 0.5; got"),
        ({"poisson": (-1.0, 0.3)}, "poisson must be two numbers above -1"),
        ({"poisson": (-0.2, 0.3)}, "poisson must be zero or positive for the body that yields"),
        ({"stiffness": 1e5}, "got 'stiffness and radius and modulus and poisson and strength'"),
        ({"strength": None}, "elasto-plastic must be radius, modulus, poisson, strength of"),
        ({"loss": 0.1}, "loss must be zero; got 0.1"),
        ({"law": "hertz"}, "the parameters of hertz must be stiffness, or radius, modulus, "),
        (
            {"law": "kelvin-voigt", "strength": None},
            "the parameters of kelvin-voigt must be stiffness; got",
        ),
    ],
)
def test_bad_materials_are_refused(options, words):
    values = {**SOFT, "law": "elasto-plastic", "point": (0.0, 1.0), "normal": (0.0, -1.0)}
    with pytest.raises(ParameterError, match=words):
        CompliantSurface(**{**values, **options})


def test_a_scene_file_without_a_parameter_of_the_ball_is_refused():
    start = chain_on(floor(1.2)).to_toml()
    assert Scene.parse(start).effects[1] == floor(1.2)
    without = "\n".join(line for line in start.splitlines() if "modulus" not in line)
    with pytest.raises(SceneError, match=r"of elasto-plastic must be .*; got 'radius and poisson"):
        Scene.parse(without)


def test_a_motion_ends_where_the_contact_is_as_wide_as_the_ball():
    """On the way in, and not only where the point turns; the depth by the formula again."""
    wide = brentq(lambda d: SLOPE * math.sqrt(d / D_Y * (d / D_Y / 1.9) ** B) - 1, D_Y, 1.0)
    fast = replace(chain_on(floor()), q=Q, u=speeds_of(60.0), duration=0.02)
    found = simulate(fast, samples=2001)
    assert "to the end of the range of the elasto-plastic law" in found.failure
    assert not found.met
    depth = found.position(fast.chain.D)[1, -1] - HEIGHT
    assert 0.9 * wide < depth < wide


def test_a_start_beyond_the_range_of_the_law_is_refused():
    deep = replace(chain_on(floor(HEIGHT - 0.02)), q=Q)
    with pytest.raises(SimulationError, match="to the end of the range of the elasto-plastic law"):
        simulate(deep)
