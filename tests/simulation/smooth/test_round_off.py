"""Round-off that runs of one precision share."""

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest

from twolink.chain import Chain
from twolink.effects import Effect
from twolink.effects.gravity import Gravity
from twolink.effects.joint_torque import JointTorque
from twolink.loads import motor_loads
from twolink.scene import Scene
from twolink.simulation.smooth.round_off import (
    LoadsAlong,
    conversions,
    rounding,
    rounding_until,
    sums,
    sums_at_most,
)
from twolink.simulation.smooth.taylor import taylor_run

TIMES = np.linspace(0.0, 3.0, 1001)
GROWN = np.ones(len(TIMES))


@dataclass(frozen=True)
class Burst(Effect):
    """A torque of 0, whose terms are as large as a bell in time."""

    size: float
    centre: float
    width: float

    def loads(self, chain, q, u, t=0.0):
        x = (t - self.centre) / self.width
        term = self.size / (1 + x * x) ** 8
        return motor_loads(term - term, 0.0)


def errors_of(*effects):
    scene = Scene(Chain.uniform_bars(), (0.3, -0.2), (0.1, 0.4), 3.0, effects)
    run = taylor_run(scene, TIMES, formulation="momenta", order=15, visit=TIMES)
    return run, LoadsAlong.along(run).errors(run, TIMES, GROWN)


def test_loads_that_do_not_cancel_have_no_more_than_the_state():
    _, errors = errors_of(Gravity())
    assert not errors.any()


def test_loads_that_cancel_have_the_round_off_of_their_terms():
    torque = JointTorque((1e8, 0.0), (1e8, 0.0), (1e-4, 0.0), (-math.pi / 2, 0.0))
    _, errors = errors_of(torque)
    # An acceleration of 1e8 roundings, for 3 s.
    assert 1e-9 < errors[-1] < 1e-5
    assert np.all(np.diff(errors) >= 0)


@pytest.mark.parametrize("formulation", ["momenta", "lagrange"])
@pytest.mark.parametrize("size", [0.0, 3e3, 1e8])
def test_bounds_exceed_the_round_off_of_sums_and_loads(size, formulation):
    """By a few powers of ten at most, so that they are negligible beside loose accuracies."""
    torque = JointTorque((size, 0.0), (size, 0.0), (1e-4, 0.0), (-math.pi / 2, 0.0))
    scene = Scene(Chain.uniform_bars(), (0.3, -0.2), (0.1, 0.4), 3.0, (Gravity(), torque))
    run = taylor_run(scene, TIMES, formulation=formulation, order=15, visit=TIMES)
    loads = LoadsAlong.along(run)
    for grown in (1.0, 1e5):
        of_loads = loads.errors(run, TIMES, grown * GROWN)[-1]
        at_most = loads.errors_at_most(run, TIMES[-1], grown)
        assert of_loads <= at_most <= 1e4 * of_loads + 1e-10 * grown
    of_sums = (sums(run, TIMES) + rounding_until(run, TIMES))[-1]
    assert of_sums <= sums_at_most(run, TIMES[-1]) <= 100 * of_sums


def test_a_short_burst_of_terms_that_cancel_is_seen():
    """It lies between two of the few times that serve for built-in loads."""
    _, errors = errors_of(Burst(1e10, 1.5 + 3.0 / 128, 3e-3))
    assert errors[200] < 1e-3 * errors[-1]
    assert errors[-1] > 1e-12


def test_sums_are_rounded_once_for_each_step():
    run, _ = errors_of(Gravity())
    least = np.finfo(float).eps / 2 * run.steps * np.abs(run.q).max()
    assert sums(run, TIMES)[-1] > conversions(run, TIMES)[-1] + least
    assert sums(run, TIMES)[0] < sums(run, TIMES)[-1]


def test_values_are_rounded_by_the_largest_so_far():
    run, _ = errors_of(Gravity())
    sizes = np.abs(np.concatenate([run.q, run.u])).max(axis=0)
    assert np.array_equal(rounding(run), np.finfo(float).eps * np.maximum.accumulate(sizes))


def test_values_between_the_times_count_as_well():
    """They may be larger: here the chain turns back between the only two samples."""
    run, _ = errors_of(Gravity())
    two = replace(run, q=run.q[:, [0, -1]], u=run.u[:, [0, -1]])
    ends = TIMES[[0, -1]]
    assert np.array_equal(rounding_until(two, ends)[-1], rounding_until(run, TIMES)[-1])
    assert rounding_until(two, ends)[-1] > rounding(two)[-1]
    assert np.all(rounding_until(run, TIMES) >= rounding(run))
    for bound in (conversions, sums):
        assert bound(two, ends)[-1] == pytest.approx(bound(run, TIMES)[-1], rel=1e-12)
