"""Compliant surfaces: their laws, the first touch, and the rigid impact as their limit."""

import math
from fractions import Fraction

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from twolink.arithmetic import fraction_in
from twolink.chain import Chain
from twolink.contact.states import ContactState
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.gravity import Gravity
from twolink.effects.surface import Surface
from twolink.errors import ParameterError
from twolink.integration.precisions import PRECISIONS
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.hybrid.run import hybrid_run

BARS = Chain.uniform_bars()
Q = (0.3, 1.1)
HEIGHT = math.sin(Q[0]) + math.sin(Q[1])
CASES = [
    ("kelvin-voigt", 1e4, 0.0), ("kelvin-voigt", 1e4, 20.0), ("hertz", 1e5, 0.0),
    ("hunt-crossley", 1e6, 0.2),
]  # fmt: skip


def floor(law, stiffness, loss=0.0, **options) -> CompliantSurface:
    height = options.pop("height", HEIGHT)
    return CompliantSurface(
        (0.0, height), (0.0, -1.0), law, stiffness, loss, name="floor", **options
    )


def scene(*effects, q=Q, u=(0.0, 0.0), duration=1.5, accuracy=1e-9) -> Scene:
    return Scene(chain=BARS, q=q, u=u, duration=duration, effects=effects, accuracy=accuracy)


@pytest.mark.slow
@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize(("law", "stiffness", "loss"), CASES)
def test_accuracy_is_honoured_through_contact(law, stiffness, loss, friction):
    """Samples inside of contacts, too, against a run of 113 bits."""
    fall = floor(law, stiffness, loss, friction=friction, height=1.2)
    start = scene(Gravity(), fall, q=(0.3, -0.2))
    trajectory = simulate(start, samples=3001)
    assert len(trajectory.events) >= 3
    exact = hybrid_run(start, trajectory.t, precision="quadruple")
    assert trajectory.error <= 1e-9
    assert np.abs(trajectory.q - exact.q.astype(float)).max() <= 1e-9
    assert np.abs(trajectory.u - exact.u.astype(float)).max() <= 1e-9
    touches = trajectory.position(BARS.D)[1] > 1.2
    assert touches.sum() > 10


@pytest.mark.slow_but_first
@pytest.mark.parametrize("law", ["hertz", "hunt-crossley"])
@pytest.mark.parametrize("order", [13, 17, 21])
def test_the_order_is_kept_at_first_touch(law, order):
    """A root in the force costs no digits: each order errs as much as it does in free flight."""
    start = scene(Gravity(), floor(law, 1e5, height=1.2), q=(0.3, -0.2), duration=0.6)
    times = np.array([0.0, 0.41, 0.42, 0.421, 0.425, 0.43, 0.434, 0.436, 0.5, 0.6])
    run = hybrid_run(start, times, order=order)
    exact = hybrid_run(start, times, precision="quadruple")
    errors = np.abs(run.u - exact.u.astype(float)).max(axis=0)
    assert errors.max() <= max(10 * 2.2e-16 * 100, 1e3 * math.exp(-2 * (order + 1)))
    for ours, theirs in zip(run.events, exact.events, strict=True):
        assert ours.time == pytest.approx(theirs.time, abs=1e-13)


def test_without_loss_and_friction_energy_is_kept():
    for law, stiffness in (("kelvin-voigt", 1e5), ("hertz", 1e6)):
        trajectory = simulate(
            scene(Gravity(), floor(law, stiffness, height=1.2), q=(0.3, -0.2), accuracy=1e-11)
        )
        free = trajectory.position(BARS.D)[1] < 1.2
        energy = trajectory.energy[free]
        assert energy == pytest.approx(energy[0], abs=1e-8)


def rebound(surface, speed=-1.0, sliding=0.0):
    """D's speeds along the normal and along the floor just after it has come off."""
    J = np.array([[-math.cos(q) for q in Q], [-math.sin(q) for q in Q]])
    u = np.linalg.solve(J, [speed, sliding])
    trajectory = simulate(scene(surface, u=tuple(u.tolist()), duration=0.3, accuracy=1e-10))
    if isinstance(surface, Surface):
        end = trajectory.impacts[0].u[1]
        return J @ end
    leaves = next(event.time for event in trajectory.events if str(event.mode) == "moves freely")
    q, w = trajectory.at(leaves)
    J = np.array([[-math.cos(x) for x in q[:, 0]], [-math.sin(x) for x in q[:, 0]]])
    return J @ w[:, 0]


@pytest.mark.slow_but_first
@pytest.mark.parametrize("law", ["kelvin-voigt", "hertz"])
def test_a_contact_that_sticks_from_touch_to_release_loses_no_energy(law):
    """D comes in along the normal and sticks, until hardly anything presses it any more."""
    surface = floor(law, 1e7, friction=2.0)
    J = np.array([[math.cos(q) for q in Q], [-math.sin(q) for q in Q]])
    u = np.linalg.solve(J, [1.0, 0.0]).tolist()
    trajectory = simulate(scene(surface, u=(u[0], u[1]), duration=0.05, accuracy=1e-10))
    assert "D on floor sticks" in [str(event.mode) for event in trajectory.events]
    assert str(trajectory.events[-1].mode) == "moves freely"
    assert trajectory.velocity(BARS.D)[1, -1] < -0.5
    T = trajectory.kinetic_energy
    assert T[-1] == pytest.approx(T[0], rel=1e-6)


def test_a_point_that_returns_meets_the_relaxed_surface_of_a_damper():
    """A point mass bounces on a Kelvin-Voigt floor, ever lower: by SciPy in one dimension."""
    k, c, g, v = 2e3, 20.0, 9.81, 2.0
    point = Chain(
        mass=(1e-12, 1.0), length=(1.0, 1.0), centre=((0.5, 0.0), (1.0, 0.0)),
        inertia=(1e-14, 1e-14),
    )  # fmt: skip
    J = np.array([[math.cos(q) for q in Q], [-math.sin(q) for q in Q]])
    u = np.linalg.solve(J, [v, 0.0]).tolist()
    start = Scene(
        chain=point, q=Q, u=(u[0], u[1]), duration=0.6, accuracy=1e-11,
        effects=(Gravity(), floor("kelvin-voigt", k, c)),
    )  # fmt: skip
    trajectory = simulate(start, samples=601)
    depths, sunk = np.full(601, np.nan), []
    t, y, pressed = 0.0, [0.0, v, 0.0], True

    def presses(t, y):
        return k * y[0] + c * y[1]

    def meets(t, y):
        return y[0] - y[2] + 1e-18

    presses.terminal = meets.terminal = True
    presses.direction, meets.direction = -1, 1
    while t < 0.6:
        run = solve_ivp(
            (lambda t, y: [y[1], g - presses(t, y), 0.0])
            if pressed
            else (lambda t, y: [y[1], g, -k / c * y[2]]),
            (t, 0.6), y, events=presses if pressed else meets, rtol=1e-13, atol=1e-16,
            method="DOP853", dense_output=True,
        )  # fmt: skip
        inside = (trajectory.t >= t) & (trajectory.t <= run.t[-1])
        depths[inside] = run.sol(trajectory.t[inside])[0]
        t, y = run.t[-1], run.y[:, -1].tolist()
        if not run.t_events[0].size:
            break
        if pressed:
            # A nudge past the instant at which both move alike.
            y[2] = y[0]
            t, y = t + 1e-7, [y[0] + 1e-7 * y[1], y[1] + 1e-7 * g, y[2] * math.exp(-k / c * 1e-7)]
        else:
            sunk.append(y[2])
        pressed = not pressed
    ours = trajectory.position(point.D)[1] - HEIGHT
    assert np.abs(ours - depths).max() <= 1e-9
    # At the last bounces the floor had not sprung back.
    assert len(sunk) >= 2
    assert sunk[-1] > 1e-6


def hunt_crossleys_restitution(av: float) -> float:
    """e of m dv/dt = −K δ^{3/2} (1 + a v), from ∫ v dv/(1 + a v) over both phases."""
    return brentq(
        lambda e: math.log1p(av) - av - (math.log1p(-av * e) + av * e), 1e-9, min(1, 1 / av) - 1e-12
    )


@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    ("law", "loss", "restitution", "rate"),
    [
        ("kelvin-voigt", 0.0, 1.0, 1 / 2),
        ("hertz", 0.0, 1.0, 2 / 5),
        ("hunt-crossley", 0.3, hunt_crossleys_restitution(0.3), 2 / 5),
    ],
)
@pytest.mark.parametrize("friction", [0.0, 0.1])
def test_rigid_is_the_limit_of_compliant(law, loss, restitution, rate, friction):
    """Over decades of stiffness the rebound goes to the rigid law's, as the time of contact."""
    rigid = rebound(
        Surface((0.0, HEIGHT), (0.0, -1.0), restitution=restitution, friction=friction), sliding=3.0
    )
    stiffness = np.array([1e6, 1e8, 1e10])
    misses = np.array(
        [
            np.abs(rebound(floor(law, k, loss, friction=friction), sliding=3.0) - rigid).max()
            for k in stiffness
        ]
    )
    slopes = -np.diff(np.log(misses)) / np.diff(np.log(stiffness))
    # Were the limit another, the slope would flatten out.
    assert slopes == pytest.approx([rate, rate], abs=0.1)


def test_a_damper_has_the_restitution_of_its_equation():
    """m δ'' + c δ' + k δ = 0 until the force is zero, with the m that D has along the normal."""
    from twolink import lagrange

    J = np.array([-math.cos(Q[0]), -math.cos(Q[1])])
    m = 1 / (J @ np.linalg.solve(np.array(lagrange.mass_matrix(BARS, Q)), J))
    k, ratio = 1e10, 0.2
    c = 2 * ratio * math.sqrt(k * m)
    omega = math.sqrt(1 - ratio**2)
    phase = math.atan2(2 * ratio * omega, 2 * ratio**2 - 1)
    expected = math.exp(-ratio / omega * phase)
    normal, _ = rebound(floor("kelvin-voigt", k, c))
    assert normal == pytest.approx(expected, abs=1e-3)


@pytest.mark.parametrize("law", ["hertz", "hunt-crossley"])
def test_a_ball_has_hertzs_stiffness(law):
    steel = CompliantSurface(
        (0.0, 1.0), (0.0, -1.0), law, radius=0.01, modulus=(2.1e11, 2.1e11), poisson=(0.3, 0.3)
    )
    (cushion,) = steel.contact_elements(BARS)
    assert cushion.law.stiffness == pytest.approx(4 / 3 * 0.1 * 2.1e11 / (2 * 0.91), rel=1e-14)


@pytest.mark.parametrize("law", ["hertz", "hunt-crossley"])
def test_a_balls_stiffness_is_that_of_each_precision(law):
    """Its rounding to float64 was shared by all runs: 2 rad wrong after 18 s, 1e-10 reported."""
    modulus, poisson = (2.1e11, 9.5e10), (0.3, 0.28)
    ball = CompliantSurface(
        (0.0, 1.45), (0.0, -1.0), law, radius=0.0625, modulus=modulus, poisson=poisson
    )
    flexible = sum(
        (1 - Fraction(nu) ** 2) / Fraction(E) for E, nu in zip(modulus, poisson, strict=True)
    )
    stiffness = Fraction(4, 3) / flexible / 4
    for own in PRECISIONS.values():
        (element,) = ball.contact_elements(BARS.convert(own.number))
        exact = fraction_in(stiffness, own.number(0))
        assert abs(float((element.law.stiffness - exact) / exact)) <= 4 * own.rounding


def test_a_motion_on_a_ball_is_that_on_its_exact_stiffness():
    modulus, poisson = (2.1e11, 9.5e10), (0.3, 0.28)
    flexible = sum(
        (1 - Fraction(nu) ** 2) / Fraction(E) for E, nu in zip(modulus, poisson, strict=True)
    )
    surfaces = (
        CompliantSurface(
            (0.0, 1.45), (0.0, -1.0), "hertz", radius=0.0625, modulus=modulus, poisson=poisson
        ),
        CompliantSurface((0.0, 1.45), (0.0, -1.0), "hertz", Fraction(4, 3) / flexible / 4),
    )
    first, second = (
        simulate(scene(Gravity(), surface, q=(-0.9, -0.5), duration=6.0, accuracy=1e-13))
        for surface in surfaces
    )
    assert first.error < 1e-13
    assert np.abs(first.u - second.u).max() <= first.error + second.error


def test_a_point_released_on_the_surface_sinks_in():
    """D released on a Hertz floor, touching: it starts from no depth and no speed."""
    trajectory = simulate(scene(Gravity(), floor("hertz", 1e5), duration=0.05, accuracy=1e-8))
    depth = trajectory.position(BARS.D)[1] - HEIGHT
    assert depth[1:20].min() > 0


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"stiffness": 0.0}, "stiffness must be a positive finite number; got 0.0"),
        ({"stiffness": -1.0}, "stiffness must be a positive finite number; got -1.0"),
        ({"loss": -0.1}, "loss must be zero or positive and finite; got -0.1"),
        ({"law": "hertz", "loss": 0.1}, "loss must be zero; got 0.1"),
        ({"law": "rubber"}, "law must be one of kelvin-voigt, .*; got 'rubber'"),
        ({"normal": (0.0, 0.0)}, "normal must be two numbers, not both zero"),
        ({"friction": -0.1}, "friction must be zero or positive and finite; got -0.1"),
        (
            {"friction": 0.3, "static": 0.2},
            "static must be finite and not below the friction 0.3; got 0.2",
        ),
        ({"on": ("A",)}, "on must be one or more of B, C1, C2, D, each once; got .'A'"),
    ],
)
def test_bad_cushions_are_refused(options, words):
    values = {"point": (0.0, 1.0), "normal": (0.0, -1.0), "law": "kelvin-voigt", "stiffness": 1.0}
    with pytest.raises(ParameterError, match=words):
        CompliantSurface(**{**values, **options})


@pytest.mark.slow_but_first
@pytest.mark.parametrize(("law", "stiffness", "loss"), CASES)
def test_works_close_the_balance_through_contact(law, stiffness, loss):
    start = scene(Gravity(), floor(law, stiffness, loss, friction=0.3, height=1.2), q=(0.3, -0.2))
    trajectory = simulate(start)
    works, T = trajectory.work(), trajectory.kinetic_energy
    # Hunt and Crossley's force also has the rate as a factor, and a kink in its slope at the end.
    allowed = 1e-6 if law == "hunt-crossley" else 1e-10
    assert sum(works.values()) == pytest.approx(T - T[0], abs=allowed)


@pytest.mark.slow
def test_a_surface_that_springs_back_at_once_does_not_shorten_the_flight():
    """Left while sunk in, it is back in 1e-8 s; the flight after it lasts for half a second."""
    surface = floor("kelvin-voigt", 1e9, 0.1, friction=0.3, height=1.2)
    start = scene(Gravity(), surface, q=(0.3, -0.2))
    trajectory = simulate(start)
    assert len(trajectory.events) > 4
    assert trajectory.statistics.steps < 1000
    exact = hybrid_run(start, trajectory.t, precision="quadruple", formulation="kane")
    assert np.abs(trajectory.q - exact.q.astype(float)).max() <= 1e-9
    assert np.abs(trajectory.u - exact.u.astype(float)).max() <= 1e-9


@pytest.mark.parametrize(("precision", "order"), [("double", 15), ("quadruple", 25)])
def test_a_surface_recovers_within_the_error_of_a_run_of_low_order(precision, order):
    """The truncation error of its depth is above round-off, within which it never recovers."""
    start = scene(
        Gravity(), floor("kelvin-voigt", 1e9, 0.1, friction=0.3, height=1.2), q=(0.3, -0.2)
    )
    run = hybrid_run(start, np.linspace(0.0, 0.5, 11), precision=precision, order=order)
    assert len(run.arcs) <= 8


def test_the_shortest_flights_end_where_they_began():
    """Pressed from rest, and hardly damped, a stiff cushion lets go for a microsecond at a time."""
    start = scene(Gravity(), floor("kelvin-voigt", 1e9, 0.1, friction=0.3), duration=0.016)
    run = hybrid_run(start, np.linspace(0.0, 0.016, 401))
    first = next(event.time for event in run.events if event.mode.states[0] is ContactState.OPEN)
    assert any(
        event.mode.states[0] is not ContactState.OPEN for event in run.events if event.time > first
    )
    q1, q2 = run.q
    assert (np.sin(q1) + np.sin(q2)).max() < HEIGHT + 1e-7


@pytest.mark.slow_but_first
@pytest.mark.parametrize(("stiffness", "drop"), [(1e8, 0.0), (3e9, 0.0), (1e10, 0.0), (1e10, 1e-4)])
def test_two_points_in_one_place_move_as_one_on_twice_the_stiffness(stiffness, drop):
    """They come out at one instant, dozens of times if they start at rest on the surface."""
    chain = Chain((1.0, 1.0), (1.0, 1.0), ((0.5, 0.0), (1.0, 0.0)), (0.1, 0.1))
    times, q = np.linspace(0.0, 0.03, 31), (0.3, 1.1)
    runs = []
    for on, share in ((("C2", "D"), 1), (("D",), 2)):
        surface = floor("hertz", share * stiffness, height=HEIGHT + drop, on=on)
        effects = (Gravity(), surface)
        start = Scene(chain=chain, q=q, u=(0.0, 0.0), duration=0.03, effects=effects)
        runs.append(hybrid_run(start, times))
    two, one = runs
    assert two.q == pytest.approx(one.q, abs=1e-11)
    assert two.u == pytest.approx(one.u, abs=1e-11)
    assert len(two.arcs) < 2 * len(one.arcs)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("order", [15, 21])
@pytest.mark.parametrize("count", [3, 4])
def test_many_surfaces_in_one_place_act_as_one_of_their_stiffness(count, order):
    """All begin at no depth, where dt/ds, the product of so many roots, is smallest."""
    times = np.linspace(0.0, 0.02, 21)

    def pressed(number, stiffness):
        surfaces = (
            CompliantSurface((0.0, HEIGHT), (0.0, -1.0), "hertz", stiffness, name=f"s{i}")
            for i in range(number)
        )
        return hybrid_run(scene(Gravity(), *surfaces, duration=0.02), times, order=order)

    many, one = pressed(count, 1e8), pressed(1, count * 1e8)
    assert many.q == pytest.approx(one.q, abs=1e-11)
    assert many.u == pytest.approx(one.u, abs=1e-11)


def test_two_points_in_one_place_leave_a_damped_surface_together():
    """The force of both falls to zero at one instant; one damper has the loss of two."""
    chain = Chain((1.0, 1.0), (1.0, 1.0), ((0.5, 0.0), (1.0, 0.0)), (0.1, 0.1))
    times, runs = np.linspace(0.0, 0.05, 51), []
    for on, share in ((("C2", "D"), 1), (("D",), 2)):
        surface = floor("kelvin-voigt", share * 1e9, share * 50.0, height=HEIGHT + 1e-3, on=on)
        effects = (Gravity(), surface)
        start = Scene(chain=chain, q=Q, u=(0.0, 0.0), duration=0.05, effects=effects)
        runs.append(hybrid_run(start, times, order=15))
    two, one = runs
    assert two.u == pytest.approx(one.u, abs=1e-11)
    assert len(two.arcs) < 2 * len(one.arcs)
