import csv
import io
import math
from dataclasses import replace

import numpy as np
import pytest

from tests.ensembles.cases import UNCOUPLED
from tests.simulation.smooth.test_taylor import ENDING
from twolink import kane
from twolink.chain import Chain
from twolink.compilation import Compiled
from twolink.effects import Gravity, JointDamping, smooth_loads
from twolink.errors import IntegrationError, ParameterError, SimulationError, TooMuchError
from twolink.limits import Limits
from twolink.scene import Scene
from twolink.variations.spectrum import Spectrum, lyapunov

J1 = 1.0 / 12 + 0.25 + 1.0


def uncoupled(**effects):
    return Scene.from_dict({**UNCOUPLED, "effects": effects})


@pytest.fixture(scope="module")
def chaotic():
    return lyapunov(Scene.load("general"), 200.0)


@pytest.mark.slow
def test_exponents_of_a_conservative_motion_sum_to_zero_and_come_in_pairs(chaotic):
    # Liouville's theorem holds for each block; sums of logarithms round.
    assert np.abs(chaotic.blocks.sum(axis=1)).max() < 1e-8
    first, second, third, fourth = chaotic.exponents
    assert first > second > third > fourth
    assert abs(first + fourth) < chaotic.resolution
    assert abs(second + third) < chaotic.resolution
    assert chaotic.chaotic
    assert chaotic.verdict.startswith("The motion is chaotic: the largest exponent is ")
    # 1.03 1/s by SciPy over 400 s; the standard error over 200 s is 0.09 1/s.
    assert first == pytest.approx(1.03, abs=0.27)


def test_a_spring_that_pushes_has_the_exponents_of_its_equation():
    # J q1″ = +k q1 at the equilibrium, and a free link 2: ±√(k/J), and 0 twice.
    k = 3.0
    still = {"joint_spring": {"stiffness": [-k, 0.0]}}
    found = lyapunov(replace(uncoupled(**still), q=(0.0, 0.0), u=(0.0, 0.0)), 100.0)
    rate = np.sqrt(k / J1)
    # The block before the first, of 5 s, leaves the directions so far from those of the exponents.
    off = np.exp(-2 * rate * 5.0)
    assert found.exponents[[0, 3]] == pytest.approx([rate, -rate], rel=off)
    assert np.abs(found.exponents[1:3]).max() < found.resolution
    assert found.spread[[0, 3]].max() < off


def test_a_damper_s_exponent_is_the_sum_of_all():
    # J u1′ = −c u1, and the other three directions neither grow nor shrink.
    c = 0.4
    scene = uncoupled(joint_damping={"coefficient": [c, 0.0]})
    found = lyapunov(replace(scene, u=(1.0, 0.3)), 200.0)
    assert found.total == pytest.approx(-c / J1, rel=1e-10)
    assert found.exponents[3] == pytest.approx(-c / J1, rel=1e-6)
    assert np.abs(found.exponents[:3]).max() < found.resolution


@pytest.mark.slow
def test_a_start_at_an_unstable_equilibrium_keeps_the_sum():
    """Directions are made orthonormal in time, although nothing moves at first."""
    scene = Scene(Chain.point_masses(), (-np.pi / 2, np.pi / 2), (0.0, 0.0), 1.0, (Gravity(),))
    found = lyapunov(scene, 60.0)
    assert np.abs(found.blocks.sum(axis=1)).max() < 1e-8


def test_no_chaos_is_seen_in_small_swings():
    found = lyapunov(Scene.load("small_swings"), 500.0)
    assert found.chaotic is False
    assert found.verdict.startswith("No chaos is seen: the largest exponent is ")
    assert "a separation linear in time gives" in found.verdict


def test_a_short_run_says_nothing():
    found = lyapunov(Scene.load("general"), 10.0, blocks=3)
    assert found.chaotic is None
    assert found.verdict.startswith("The run is too short to tell")


def test_the_result_as_text_data_and_table(chaotic):
    rows = list(csv.reader(io.StringIO(chaotic.csv())))
    assert rows[0] == ["block", "lambda1", "lambda2", "lambda3", "lambda4"]
    assert float(rows[20][1]) == chaotic.blocks[19, 0]
    document = chaotic.document()
    assert document["exponents"] == chaotic.exponents.tolist()
    assert document["sum"] == chaotic.total
    assert [row[0].text for row in chaotic.summary().rows] == ["λ1", "λ2", "λ3", "λ4", "sum"]


@pytest.mark.parametrize(
    ("scene", "seconds", "options", "error", "sentence"),
    [
        ("drop", 10.0, {}, SimulationError, "a scene must be smooth"),
        ("general", 0.0, {}, ParameterError, "seconds must be"),
        ("general", 1.0, {}, ParameterError, "seconds must be .* or more for 20 blocks of this mo"),
        ("general", 9.0, {"blocks": 1}, ParameterError, "blocks must be"),
    ],
)
def test_what_has_no_exponents_is_refused(scene, seconds, options, error, sentence):
    with pytest.raises(error, match=sentence):
        lyapunov(Scene.load(scene), seconds, **options)


@pytest.mark.slow
def test_a_motion_that_ends_is_an_error_with_the_time_reached():
    with pytest.raises(
        IntegrationError, match=r"could not be integrated beyond 0\.19\d+ s \(the st"
    ):
        lyapunov(ENDING, 5.0)


@pytest.mark.slow
def test_a_run_that_takes_too_long_ends_early():
    with pytest.raises(TooMuchError, match="the exponents over 1e\\+09 s would take"):
        lyapunov(Scene.load("general"), 1e9, limits=Limits(seconds=1.0))


def test_a_scene_must_be_a_scene():
    with pytest.raises(ParameterError, match="scene must be a Scene; got 'general'"):
        lyapunov("general", 10.0)


def separation_rate(scene, seconds, apart=1e-8, every=0.5):
    """Return the mean rate (1/s) at which two motions separate, by Kane's equations and SciPy.

    Their distance is made small again after each interval (Benettin, Galgani and Strelcyn, 1976).
    """
    from scipy.integrate import solve_ivp

    def formula(q, u, time):
        loads = smooth_loads(scene.effects, scene.chain, q, u, time[0])
        return u, kane.forward_dynamics(scene.chain, q, u, loads)

    compiled = Compiled(formula)

    def rates(t, x):
        q1, q2, u1, u2 = x.tolist()
        velocities, accelerations = compiled((q1, q2), (u1, u2), (t, 0.0))
        return [*velocities, *accelerations]

    def follow(x):
        return solve_ivp(rates, (0.0, every), x, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]

    x = np.array([*scene.q, *scene.u], dtype=float)
    y = x + apart * np.array([0.5, 0.5, 0.5, 0.5])
    logarithms = []
    for _ in range(int(seconds / every)):
        x, y = follow(x), follow(y)
        distance = np.linalg.norm(y - x)
        logarithms.append(np.log(distance / apart))
        y = x + (y - x) * (apart / distance)
    blocks = np.array(logarithms).reshape(20, -1).mean(axis=1) / every
    return blocks.mean(), blocks.std(ddof=1) / np.sqrt(len(blocks))


@pytest.mark.long
@pytest.mark.slow
def test_the_largest_exponent_is_the_rate_at_which_two_motions_separate():
    scene = Scene.load("general")
    rate, spread = separation_rate(scene, 400.0)
    found = lyapunov(scene, 2000.0)
    allowed = 3 * np.hypot(spread, found.spread[0])
    assert abs(found.exponents[0] - rate) < allowed
    assert allowed < 0.2 * rate


# "Double Pendulum" of the site "Lyapunov spectrum" (sites.google.com/view/lyapunov-spectrum): point
# masses 0.2 and 0.1 kg, lengths 0.1 and 0.08 m, g = 9.8; Runge and Kutta's method at 0.001 s.
PUBLISHED = 2.4638, 0.0007, -0.0009, -2.4636


@pytest.mark.long
@pytest.mark.slow
def test_the_published_spectrum_is_that_of_a_natural_start():
    """The source states no start, on whose energy the exponents depend.

    Link 2 hangs. With link 1 released level the exponents are the published ones or a little
    larger, and released 0.3 rad below they are smaller.
    """
    chain = Chain.point_masses((0.2, 0.1), (0.1, 0.08))
    level, below = (
        lyapunov(Scene(chain, (angle, np.pi / 2), (0.0, 0.0), 1.0, (Gravity(9.8),)), 3_000.0)
        for angle in (0.0, 0.3)
    )
    for found in (level, below):
        assert np.abs(found.exponents[1:3]).max() < 2 * found.resolution
        assert abs(found.total) < 1e-8
    for place, sign in ((0, 1), (3, -1)):
        published = sign * PUBLISHED[place]
        assert sign * below.exponents[place] + 3 * below.spread[place] < published
        assert published < sign * level.exponents[place] + 3 * level.spread[place]
    assert level.spread[0] < 0.1


@pytest.mark.slow
def test_damping_makes_volumes_shrink():
    scene = Scene.load("general")
    damped = replace(scene, effects=(*scene.effects, JointDamping((0.01, 0.01))))
    assert lyapunov(damped, 50.0).total < 0


def test_correlated_blocks_have_the_error_of_merged_ones(random):
    draws = random.normal(size=(5, 4))
    blocks = np.repeat(draws, 4, axis=0)
    found = Spectrum(Scene.load("general"), 100.0, blocks, 0.01)
    assert found.spread == pytest.approx(draws.std(axis=0, ddof=1) / np.sqrt(5))
    few = Spectrum(Scene.load("general"), 100.0, draws, 0.01)
    assert few.spread == pytest.approx(draws.std(axis=0, ddof=1) / np.sqrt(5))


@pytest.mark.parametrize(("pose", "unstable"), [(0.0, True), (math.pi, False)])
def test_a_chain_at_rest_is_not_chaotic(pose, unstable):
    """Gravity along −x: at q = 0 the chain stands exactly upright, and does not move."""
    upright = Scene(
        Chain.uniform_bars(), (pose, pose), (0.0, 0.0), 10.0, (Gravity(9.81, (-1.0, 0.0)),)
    )
    found = lyapunov(upright, 100.0)
    assert (found.exponents[0] > 5) == unstable
    assert found.chaotic is False
    if unstable:
        assert found.at_rest
        assert found.verdict.startswith("The chain is at rest; of small deviations from it")


def test_a_chain_that_hardly_moves_is_not_at_rest():
    scene = Scene(Chain.uniform_bars(), (1.5707, 1.5707), (0.0, 0.0), 10.0, (Gravity(9.81),))
    assert not lyapunov(scene, 100.0).at_rest


@pytest.mark.parametrize("damping", [(0.5, 0.2), (0.3, 0.2), (0.05, 0.4)])
def test_oscillations_in_step_with_the_blocks_are_in_the_standard_errors(damping):
    """At rest the exponents are those of the linear equation; blocks alone missed some by 6 σ."""
    hanging = (math.pi / 2, math.pi / 2)
    effects = (Gravity(), JointDamping(damping))
    scene = Scene(Chain.uniform_bars(), hanging, (0.0, 0.0), 1.0, effects)
    found = lyapunov(scene, 100.0, blocks=5)
    c1, c2 = damping
    M = np.array([[4 / 3, 1 / 2], [1 / 2, 1 / 3]])
    K, C = 9.81 * np.diag([1.5, 0.5]), np.array([[c1 + c2, -c2], [-c2, c2]])
    by_state = np.eye(4, k=2)
    by_state[2:] = -np.linalg.solve(M, np.hstack([K, C]))
    exact = np.sort(np.linalg.eigvals(by_state).real)[::-1]
    assert np.abs(found.exponents - exact).max() > 1e-4
    assert (np.abs(found.exponents - exact) < 1.5 * found.spread).all()
