"""Lanes of one motion side by side, whose steps have different lengths."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from twolink import lagrange
from twolink.arithmetic import cos, sin
from twolink.chain import Chain
from twolink.effects import Effect
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.errors import IntegrationError
from twolink.loads import motor_loads
from twolink.scene import Scene
from twolink.simulation.smooth.bundles import BUNDLES, FIRST, LONGEST, MOVED, RATIOS, SECOND
from twolink.simulation.smooth.longest_step import default_longest_step
from twolink.simulation.smooth.taylor import taylor_run
from twolink.values import Content

GENERAL = Chain((1.3, 0.8), (1.1, 0.7), ((0.6, 0.1), (0.3, -0.08)), (0.12, 0.03))
GRID = np.linspace(0.0, 4.0, 101)
SCENE = Scene(GENERAL, (0.6, 0.2), (0.4, -1.0), 4.0, (Gravity(),))


def bundle_of(scene, order, formulation="momenta"):
    return BUNDLES(Content((scene.moving_chain,)), Content(scene.effects), formulation, order)


def followed(scene, order, size, formulation="momenta", grid=GRID, **options):
    cap = default_longest_step(scene)
    return bundle_of(scene, order, formulation).follow(scene, grid, size, cap, **options)


@pytest.mark.parametrize("formulation", ["momenta", "kane", "lagrange"])
def test_all_lanes_have_the_same_motion(formulation):
    exact = taylor_run(SCENE, GRID, formulation="kane", precision="long double")
    found = followed(SCENE, 19, 100.0, formulation)
    assert found.motions.shape == (len(RATIOS), 4, len(GRID))
    for lane in found.motions:
        assert np.abs(lane - np.concatenate([exact.q, exact.u]).astype(float)).max() < 1e-9


@pytest.mark.parametrize("order", [9, 13])
def test_errors_and_steps_of_lanes_have_their_ratios(order):
    exact = taylor_run(SCENE, GRID, formulation="kane", precision="long double")
    states = np.concatenate([exact.q, exact.u]).astype(float)
    found = followed(SCENE, order, 20.0 if order == 9 else 200.0)
    errors = np.abs(found.motions - states).max(axis=(1, 2))
    assert 1e-12 < errors[FIRST] < errors[SECOND] < errors[LONGEST] < 0.1
    assert np.all(errors / errors[FIRST] > RATIOS / 100)
    assert np.all(errors / errors[FIRST] < RATIOS * 100)
    expected = RATIOS ** (1 / order)
    assert np.allclose(found.steps[0] / np.array(found.steps), expected, rtol=0.1)


def test_a_step_is_longer_at_a_larger_size():
    """In proportion to the root of the order."""
    small, large = (followed(SCENE, 11, size) for size in (50.0, 5000.0))
    assert small.steps[0] / large.steps[0] == pytest.approx(100 ** (1 / 11), rel=0.05)


def test_steps_that_are_capped_keep_their_ratios():
    """A chain without loads turns by a series that ends after a term: only the cap limits steps."""
    steady = Scene(Chain.uniform_bars(), (0.2, 0.2), (1e-3, 1e-3), 4.0, ())
    cap = 0.05
    found = bundle_of(steady, 9).follow(steady, GRID, 10.0, cap)
    lengths = 4.0 / np.array(found.steps)
    assert lengths[LONGEST] == pytest.approx(cap, rel=0.02)
    expected = (RATIOS[LONGEST] / RATIOS) ** (1 / 9)
    assert np.allclose(lengths[LONGEST] / lengths, expected, rtol=0.05)


def test_the_last_two_lanes_may_start_elsewhere():
    usual = followed(SCENE, 13, 100.0)
    moved = (SCENE.q[0] + 1e-3, SCENE.q[1]), (SCENE.u[0], SCENE.u[1] - 1e-3)
    third = (SCENE.q[0], SCENE.q[1] + 1e-3), SCENE.u
    found = followed(SCENE, 13, 100.0, moved=(third, moved))
    assert np.array_equal(found.motions[:LONGEST], usual.motions[:LONGEST])
    assert found.motions[LONGEST, :, 0] == pytest.approx([*third[0], *third[1]], abs=1e-14)
    assert np.array_equal(usual.motions[MOVED], usual.motions[FIRST])
    assert found.motions[MOVED, :, 0] == pytest.approx([*moved[0], *moved[1]], abs=1e-14)
    exact = followed(replace(SCENE, q=moved[0], u=moved[1]), 13, 100.0)
    assert np.array_equal(found.motions[MOVED], exact.motions[FIRST])


def test_short_motions_have_several_steps():
    """Within the first step all lanes have the same polynomial, and no difference."""
    short = Scene(GENERAL, (1.5, -0.8), (0.4, -1.0), 1e-3, (Gravity(),))
    found = followed(short, 9, 10.0, grid=np.linspace(0.0, 1e-3, 5))
    assert min(found.steps) >= 8


@dataclass(frozen=True)
class Swinging(Effect):
    """A torque that depends on time."""

    def loads(self, chain, q, u, t=0.0):
        s = chain.scalar
        return motor_loads(s(2.0) * sin(s(3.0) * t), s(0.5) * cos(s(5.0) * t))


def test_loads_that_depend_on_time_are_those_of_each_lane():
    effects = (Gravity(), JointDamping((0.2, 0.1)), Swinging())
    driven = Scene(GENERAL, (0.3, 0.1), (0.0, 0.0), 4.0, effects)
    exact = taylor_run(driven, GRID, formulation="kane", precision="long double")
    found = followed(driven, 15, 1e3)
    states = np.concatenate([exact.q, exact.u]).astype(float)
    assert np.abs(found.motions[0] - states).max() < 1e-8


def test_the_largest_variable_is_an_angle_or_a_momentum_of_any_time():
    found = followed(SCENE, 15, 100.0)
    momenta = [
        lagrange.momenta(GENERAL, tuple(each[:2]), tuple(each[2:])) for each in found.motions
    ]
    angles = np.abs(found.motions[:, :2]).max()
    assert found.largest == pytest.approx(max(angles, np.abs(momenta).max()), rel=1e-9)


def test_steps_do_not_depend_on_the_times_that_are_visited():
    """They end at the ends of parts of long motions, which are the same for all grids."""
    long = Scene(GENERAL, (0.6, 0.2), (0.4, -1.0), 300.0, (Gravity(),))
    shares = []
    grid = np.linspace(0.0, 300.0, 1001)
    found = followed(long, 13, 20.0, grid=grid, progress=shares.append)
    few = followed(long, 13, 20.0, grid=grid[::100])
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    assert len(shares) > 1
    assert found.steps == few.steps
    assert found.motions.shape[-1] == len(grid)
    assert np.array_equal(found.motions[:, :, ::100], few.motions)


def test_the_ends_of_the_steps_of_all_lanes_are_noted():
    found = followed(SCENE, 11, 100.0, grid=np.array([0.0, 4.0]))
    for ends, steps in zip(found.ends, found.steps, strict=True):
        assert np.all(np.diff(ends[:steps]) > 0)
        # A lane that arrives early waits for the others.
        assert np.all(ends[steps - 1 :] == 4.0)
        assert np.diff(ends).max() <= default_longest_step(SCENE)
    assert found.ends.shape[1] == max(found.steps)


def test_a_motion_that_ends_early_is_an_error():
    driven = Scene(Chain.uniform_bars(), (0.0, 0.0), (1e200, -1e200), 4.0, (Gravity(),))
    with pytest.raises(IntegrationError, match="lanes side by side"):
        bundle_of(driven, 9).follow(driven, GRID, 10.0, 0.5)


def test_code_is_shared_by_starts_of_a_scene():
    other = Scene(GENERAL, (0.1, 0.2), (0.0, 0.0), 2.0, (Gravity(),))
    assert bundle_of(SCENE, 11) is bundle_of(other, 11)
    assert bundle_of(SCENE, 11) is not bundle_of(SCENE, 13)
