"""Proven runs with impacts: exact solutions, the simulator's runs, and ends before the time."""

import math
from dataclasses import replace
from fractions import Fraction

import flint
import numpy as np
import pytest

from tests.accuracy.bouncing import bouncing_scene
from twolink.accuracy import enclosed_run as module
from twolink.accuracy.enclosed_run import proven_run
from twolink.accuracy.enclosure import enclosure
from twolink.accuracy.reference import reference
from twolink.chain import Chain
from twolink.effects.gravity import Gravity
from twolink.effects.joint_stop import JointStop
from twolink.effects.surface import Surface
from twolink.errors import SimulationError
from twolink.scene import Scene
from twolink.simulation import simulate

DROP = Scene.load("drop")

# Link 2 is balanced on the elbow: without gravity both links turn evenly between impacts.
BALANCED = Chain((1.0, 2.0), (1.0, 0.5), ((0.5, 0.0), (0.0, 0.0)), (0.125, 0.25))
TURNING = Scene(
    BALANCED,
    (0.1, -0.2),
    (0.7, 3.3),
    3.0,
    (JointStop("B", lower=-0.5, upper=0.75, restitution=0.75),),
)


def exact_turning(scene, until):
    """Return the times of impacts and the state at a time, in rationals."""
    (stop,) = scene.effects
    q1, q2, u1, u2 = (Fraction(x) for x in (*scene.q, *scene.u))
    inertia = Fraction(0.125) + Fraction(1, 4) + 2, Fraction(0.25)
    now, times = Fraction(0), []
    while True:
        rate = u2 - u1
        angle = Fraction(stop.upper if rate > 0 else stop.lower)
        wait = (angle - (q2 - q1)) / rate
        if now + wait > until:
            rest = until - now
            return times, (q1 + u1 * rest, q2 + u2 * rest, u1, u2)
        q1, q2, now = q1 + u1 * wait, q2 + u2 * wait, now + wait
        impulse = -(1 + Fraction(stop.restitution)) * rate / (1 / inertia[0] + 1 / inertia[1])
        u1, u2 = u1 - impulse / inertia[0], u2 + impulse / inertia[1]
        times.append(now)


@pytest.mark.parametrize("restitution", [0.75, 0.4, Fraction(5, 7)])
def test_impacts_on_stops_contain_an_exact_solution(restitution):
    """Links that turn evenly between stops: all times and speeds are rational numbers.

    1 + 0.4 is rounded in float64.
    """
    stop = replace(TURNING.effects[0], restitution=restitution)
    scene = replace(TURNING, effects=(stop,))
    found, other = enclosure(scene, 40, (0.5, 3.0)), reference(scene, 28, (0.5, 3.0))
    for index, until in enumerate((Fraction(1, 2), Fraction(3))):
        times, state = exact_turning(scene, until)
        assert found.contains(index, state)
        for true, number in zip(state, other.states[index], strict=True):
            assert abs(Fraction(number) - true) <= Fraction(1, 10 ** other.digits[index])
    assert len(found.impacts) == len(times) > 1
    assert all(time in impact.time for time, impact in zip(times, found.impacts, strict=True))
    assert found.radius < 1e-40
    assert found.ended is None


@pytest.mark.slow_but_first
@pytest.mark.parametrize("by", range(4))
def test_errors_before_impacts_are_carried_through_them(by, monkeypatch):
    """An error of the approximate motion moves the impacts; the exact ones stay in the bounds."""
    right, start = module.precise_motion, [*TURNING.q, *TURNING.u]
    start[by] += 1e-12

    def wrong(scene, equations, digits):
        motion = right(scene, equations, digits)
        motion.restart("0", [f"{x:.17g}" for x in start])
        return motion

    monkeypatch.setattr(module, "precise_motion", wrong)
    found = enclosure(TURNING, 9)
    times, state = exact_turning(TURNING, Fraction(3))
    assert found.contains(0, state)
    assert all(time in impact.time for time, impact in zip(times, found.impacts, strict=True))
    off = [abs(x - Fraction(y.centre)) for x, y in zip(state, found.states[0], strict=True)]
    assert float(max(off)) > 1e-13
    # The bounds are tight.
    assert found.radius < 1e3 * float(max(off))


def test_a_wrong_state_after_an_impact_is_not_trusted(monkeypatch):
    """The state at which heyoka continues is not assumed to be right."""
    right, true = module.PreciseMotion.restart, reference(DROP, 24, (0.5,)).states[0]

    def wrong(motion, time, state):
        right(motion, time, [f"{float(state[0]) + 1e-11:.17g}", *state[1:]])

    monkeypatch.setattr(module.PreciseMotion, "restart", wrong)
    found = enclosure(DROP, 8, (0.5,))
    assert found.contains(0, true)
    assert found.radius > 1e-12


@pytest.mark.slow
def test_the_drop_agrees_with_the_reference_in_113_bits():
    times = (0.5, 0.7, 0.8)
    found, other = enclosure(DROP, 20, times), reference(DROP, 24, times)
    assert found.radius < 1e-20
    for index, digits in enumerate(other.digits):
        for interval, number in zip(found.states[index], other.states[index], strict=True):
            distance = abs(Fraction(number) - Fraction(interval.centre))
            assert distance <= Fraction(interval.radius) + Fraction(1, 10**digits)


def ball_of(interval):
    """Return a ball of python-flint with the numbers of an interval."""
    return flint.arb(interval.centre) + flint.arb(0, interval.radius)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("number", [float, lambda x: Fraction(x).limit_denominator(100)])
def test_the_gap_of_an_inclined_surface_is_zero_at_an_impact(number):
    """The normal has an irrational length, so that a unit vector of float64 is another normal."""
    point, normal = tuple(map(number, (0.1, 1.3))), tuple(map(number, (0.3, -1.0)))
    surface = Surface(point, normal, restitution=number(0.5), friction=number(0.2))
    scene = Scene(Chain.uniform_bars(), (0.0, 0.3), (0.0, 0.0), 0.6, (Gravity(), surface))
    found, other = enclosure(scene, 18, (0.6,)), reference(scene, 22, (0.6,))
    (impact,) = found.impacts
    with flint.ctx.workprec(200):
        (q1, q2), exact = map(ball_of, impact.q), [Fraction(x) for x in (*point, *normal)]
        X, Y, n_x, n_y = (flint.arb(x.numerator) / x.denominator for x in exact)
        gap = n_x * (q1.cos() + q2.cos() - X) + n_y * (q1.sin() + q2.sin() - Y)
        assert gap.contains(0)
        assert gap.rad() < 1e-18
    for interval, true in zip(found.states[0], other.states[0], strict=True):
        last = Fraction(1, 10 ** other.digits[0])
        assert abs(Fraction(true) - Fraction(interval.centre)) <= Fraction(interval.radius) + last


def agrees(scene, digits=12):
    """Compare a proof with a simulation until bounces die away; return the number of impacts."""
    found, run = enclosure(scene, digits), simulate(scene)
    alike = 0
    for impact, other in zip(found.impacts, run.impacts, strict=False):
        if other.regime == "bounces die away":
            break
        assert (impact.name, impact.regime) == (other.name, other.regime)
        pairs = [
            (impact.time, other.time),
            (impact.normal_impulse, other.normal_impulse),
            (impact.tangential_impulse, other.tangential_impulse),
            *zip(impact.u_after, other.u[1], strict=True),
            *zip(impact.kinetic_energy, other.kinetic_energy, strict=True),
        ]
        for interval, number in pairs:
            assert abs(float(interval.centre) - number) <= scene.accuracy
        alike += 1
    assert alike == len(run.impacts) or other.regime == "bounces die away" or found.ended
    return alike


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 11, 16, 35])
def test_random_scenes_agree_with_the_simulator(seed):
    assert agrees(bouncing_scene(seed)) > 0


@pytest.mark.long
@pytest.mark.slow
def test_many_random_scenes_agree_with_the_simulator():
    assert sum(agrees(bouncing_scene(seed)) for seed in range(25)) > 150


@pytest.mark.slow
def test_bounces_that_accumulate_end_the_proof():
    found = enclosure(DROP, 10)
    assert found.states == found.times == ()
    assert "bounces on D on floor follow each other within 1e-10 s and accumulate" in str(
        found.ended
    )
    assert not found.ended.undecided
    times = [Fraction(impact.time.centre) for impact in found.impacts]
    assert len(times) == 26
    assert times[-1] - times[-2] < 1e-10 < times[-2] - times[-3]
    # Friction does not act along the normal: each bounce has 0.4 of the speed of the one before.
    for impact in found.impacts:
        before, after = (Fraction(speed.centre) for speed in impact.normal_speed)
        assert math.isclose(-after / before, 0.4, rel_tol=0.02)


def test_a_contact_that_stays_closed_ends_the_proof():
    (floor,) = (effect for effect in DROP.effects if isinstance(effect, Surface))
    scene = replace(DROP, effects=(Gravity(), replace(floor, restitution=0.0)))
    found = enclosure(scene, 10)
    assert len(found.impacts) == 1
    assert found.ended.reason == "D on floor may stay closed after the impact"
    assert not found.ended.undecided


@pytest.mark.slow
def test_impacts_at_one_instant_are_undecided():
    """Two surfaces along the same line."""
    (floor,) = (effect for effect in DROP.effects if isinstance(effect, Surface))
    scene = replace(DROP, effects=(Gravity(), floor, replace(floor, name="carpet")))
    run = proven_run(scene, (0.5,), 30, 1e-9, lambda share: None)
    assert run.ended.undecided
    assert run.ended.reason == "impacts on D on carpet and D on floor may coincide"
    with pytest.raises(SimulationError, match="found no enclosure to 5 digits"):
        enclosure(scene, 5, (0.5,))


def test_grazing_is_undecided():
    """The tip of a stretched chain that turns evenly touches a line at its lowest point."""
    chain = Chain((1.0, 1.0), (1.0, 0.5), ((0.0, 0.0), (0.0, 0.0)), (0.125, 0.25))
    line = Surface((0.0, 1.5), (0.0, -1.0), restitution=0.5)
    scene = Scene(chain, (0.0, 0.0), (1.0, 1.0), 3.0, (line,))
    with pytest.raises(SimulationError, match="found no enclosure"):
        enclosure(scene, 5)
    near = replace(line, point=(0.0, 1.5 + 1e-6))
    assert enclosure(replace(scene, effects=(near,)), 5).impacts == ()
    beyond = replace(line, point=(0.0, 1.5 - 1e-6))
    assert len(enclosure(replace(scene, effects=(beyond,)), 5).impacts) == 1


def test_a_start_at_a_contact_is_refused():
    scene = replace(TURNING, q=(0.25, 1.0))
    with pytest.raises(SimulationError, match="must start away from all contacts; B on its upper"):
        enclosure(scene, 10)


def test_a_time_at_an_impact_is_undecided():
    """Whether the motion there is that before or after the impact cannot be said."""
    scene = replace(TURNING, q=(0.0, 0.0), u=(0.0, 1.5))
    run = proven_run(scene, (0.5,), 30, 1e-9, lambda share: None)
    assert run.states == ()
    assert run.ended.undecided


def test_the_precision_of_python_flint_is_restored():
    before = flint.ctx.prec, flint.ctx.cap
    with module.balls(flint, 300, 40):
        assert (flint.ctx.prec, flint.ctx.cap) == (300, 40)
    assert (flint.ctx.prec, flint.ctx.cap) == before


def test_radii_are_those_of_all_numbers():
    found = enclosure(DROP, 10, (0.5,))
    radii = [float(x.radius) for x in found.states[0]]
    assert found.radius == max(*radii, found.impacts[0].radius)
    assert np.all(np.array(radii) < 1e-10)
