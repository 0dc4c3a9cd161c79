"""Starts in balance: how fast they leave it, and motions that grow from round-off."""

import math
from dataclasses import replace

import numpy as np
import pytest
import scipy

from tests.simulation.smooth.test_measure import assert_measured
from twolink.chain import Chain
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.ensembles.chunk import rows_of
from twolink.ensembles.file import ensemble_of
from twolink.scene import Scene
from twolink.simulation.smooth.balance import rates_of_balance
from twolink.simulation.smooth.longest_step import default_longest_step, pace_of
from twolink.simulation.smooth.taylor import taylor_run

HALF = math.pi / 2
UPRIGHT = Scene(Chain.uniform_bars(), (-HALF, -HALF), (0.0, 0.0), 4.0, (Gravity(9.81),))


def test_the_rate_is_that_of_the_linearized_motion():
    """M q″ = diag(3/2, 1/2) m g L q upright, with M = m L² ((4/3, 1/2), (1/2, 1/3))."""
    M, K = np.array([[4 / 3, 1 / 2], [1 / 2, 1 / 3]]), np.diag([1.5, 0.5]) * 9.81
    exact = math.sqrt(scipy.linalg.eigvalsh(K, M).max())
    chain, effects = UPRIGHT.moving_chain, UPRIGHT.effects
    found = rates_of_balance(chain, effects, UPRIGHT.q, UPRIGHT.u, 4.0)
    assert float(found) == pytest.approx(exact, rel=1e-6)
    assert default_longest_step(UPRIGHT) == pytest.approx(1 / exact, rel=1e-6)


@pytest.mark.parametrize("g", [1e300, 1e308])
def test_loads_that_leave_float64_have_no_rate_and_no_warning(g):
    """Warnings are errors in tests."""
    chain = UPRIGHT.moving_chain
    assert not rates_of_balance(chain, (Gravity(g),), (0.3, 0.2), (0.0, 0.0), 1.0)


@pytest.mark.parametrize(
    ("q", "u", "effects", "balanced"),
    [
        ((-HALF, -HALF), (0.0, 0.0), (Gravity(9.81),), True),
        ((-HALF, HALF), (1e-9, 0.0), (Gravity(9.81),), True),
        ((-HALF + 1e-7, -HALF), (0.0, 0.0), (Gravity(9.81), JointDamping((0.1, 0.1))), True),
        ((HALF, HALF), (0.0, 0.0), (Gravity(9.81),), False),
        ((-HALF + 0.1, -HALF), (0.0, 0.0), (Gravity(9.81),), False),
        ((-HALF, -HALF), (0.5, 0.0), (Gravity(9.81),), False),
        ((0.3, -0.2), (0.0, 0.0), (), False),
    ],
)
def test_balance(q, u, effects, balanced):
    """A chain that hangs, moves, or has no loads is not in balance."""
    scene = replace(UPRIGHT, q=q, u=u, effects=effects)
    assert (pace_of(scene).leaving > 0) == balanced
    lanes = (np.full(3, x) for x in (*q, *u))
    q1, q2, u1, u2 = lanes
    rates = rates_of_balance(scene.moving_chain, effects, (q1, q2), (u1, u2), scene.duration)
    assert rates.shape == (3,)
    assert ((rates > 0) == balanced).all()


def test_a_short_motion_does_not_leave_the_balance():
    assert pace_of(replace(UPRIGHT, duration=0.1)).leaving == 0


@pytest.mark.parametrize("accuracy", [1e-2, 1e-4, 1e-6])
@pytest.mark.parametrize(
    ("mass", "length", "duration"),
    [((1.0, 1.0), (1.0, 1.0), 4.0), ((0.263, 0.428), (1.516, 1.12), 5.0)],
)
def test_a_chain_that_stands_upright_falls_by_round_off(mass, length, duration, accuracy):
    """Runs of all orders in one precision round its pose alike: their difference says nothing."""
    chain = Chain.uniform_bars(mass, length)
    scene = replace(UPRIGHT, chain=chain, duration=duration)
    times = np.linspace(0.0, duration, 33)
    exact = taylor_run(scene, times, formulation="kane", precision="quadruple")
    assert_measured(scene, accuracy, times, exact)


def test_sweeps_make_runs_in_balance_by_themselves():
    tables = {
        "scene": {
            "chain": {"mass": [1.0, 1.0], "length": [1.0, 1.0]},
            "start": {"q": [-HALF, -HALF]},
            "run": {"duration": 4.0, "accuracy": 1e-4},
            "effects": {"gravity": {}},
        },
        "axes": [{"parameter": "start.q.0", "values": [-HALF, -HALF + 1e-12, -HALF + 0.2]}],
        "keep": {"final": True},
    }
    rows = rows_of(ensemble_of(tables, "<dict>", None), 0, 3).arrays
    for place, q1 in enumerate((-HALF, -HALF + 1e-12, -HALF + 0.2)):
        scene = replace(UPRIGHT, q=(q1, -HALF))
        exact = taylor_run(scene, [0.0, 4.0], formulation="kane", precision="quadruple")
        true = np.concatenate([exact.q, exact.u])[:, -1].astype(float)
        kept = np.concatenate([rows["q"][place], rows["u"][place]])
        assert np.abs(kept - true).max() <= rows["error"][place] <= 1e-4
