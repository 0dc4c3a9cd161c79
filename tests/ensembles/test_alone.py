"""Runs that lanes would judge wrongly are made by themselves."""

import math

import numpy as np
import pytest

from tests.ensembles.cases import axis, ensemble
from twolink.chain import Chain
from twolink.effects import Gravity, JointSpring, JointTorque, PdControl
from twolink.ensembles.alone import round_off_of_loads, shares_round_off
from twolink.ensembles.blocks import ROUNDING, Lanes
from twolink.ensembles.chunk import rows_of
from twolink.scene import Scene
from twolink.simulation.smooth.taylor import taylor_run

HALF = math.pi / 2
BARS = Chain.uniform_bars()
RISING = JointTorque((1e8, 0.0), (1e8, 0.0), (1e-4, 0.0), (-HALF, 0.0))


def lanes(*effects, q1=(-HALF, 0.3, HALF), q2=(-HALF, -0.2, HALF)):
    starts = np.array([q1, q2])
    return Lanes(BARS, effects, starts, np.zeros_like(starts), 3.0)


@pytest.mark.parametrize(
    ("effects", "shared"),
    [
        ((Gravity(9.81),), [True, False, False]),
        ((Gravity(9.81, (0.6, 0.8)),), [False, False, False]),
        ((), [False, False, False]),
        ((RISING,), [True, True, True]),
        ((PdControl((1.0, 1.0), (40.0, 30.0), (4.0, 3.0)), Gravity(9.81)), [False] * 3),
    ],
    ids=["gravity", "tilted gravity", "no loads", "torques that cancel", "control"],
)
def test_starts_in_balance_and_loads_that_cancel(effects, shared):
    assert shares_round_off(lanes(*effects)).tolist() == shared


@pytest.mark.parametrize("accuracy", [1e-8, 1e-9])
def test_the_error_of_a_sweep_is_bounded_where_loads_cancel(accuracy):
    """Both runs of a pair in lanes round the torque alike, and differ by less than the error."""
    torque = {
        "torque": [1e8, 0.0], "amplitude": [1e8, 0.0], "frequency": [1e-4, 0.0],
        "phase": [-HALF, 0.0],
    }  # fmt: skip
    some = ensemble(
        scene={
            "chain": {"mass": [1.0, 1.0], "length": [1.0, 1.0]},
            "start": {"q": [0.3, -0.2]},
            "run": {"duration": 3.0, "accuracy": accuracy},
            "effects": {"joint_torque": torque},
        },
        axes=[axis("start.q.0", 0.3, 0.7)],
        keep={"final": True},
    )
    rows = rows_of(some, 0, 2).arrays
    for place, q1 in enumerate((0.3, 0.7)):
        scene = Scene(BARS, (q1, -0.2), (0.0, 0.0), 3.0, (RISING,))
        exact = taylor_run(scene, [0.0, 3.0], formulation="kane", precision="quadruple")
        true = np.concatenate([exact.q, exact.u])[:, -1].astype(float)
        kept = np.concatenate([rows["q"][place], rows["u"][place]])
        assert np.abs(kept - true).max() <= rows["error"][place] <= accuracy


def test_the_phase_of_a_torque_is_rounded_independently_which_steps_can_carry():
    q, u = np.array([[0.3], [-0.4]]), np.array([[1.0], [-2.0]])
    driven = JointTorque((0.1, 0.2), (2.0, 1.0), (3.0, 5.0))
    own = Lanes(BARS, (Gravity(), driven), q, u, 8.0)
    assert shares_round_off(own)
    assert not shares_round_off(own, carried=True)
    shared, independent = round_off_of_loads(own, of_time=True)
    # The largest phase, 40 rad, by the amplitude of 1 N m in both links.
    assert 20 * ROUNDING < independent.max() < 200 * ROUNDING
    assert shared.max() < 20 * ROUNDING
    assert round_off_of_loads(own, of_time=False)[1].max() < independent.max() / 5


def test_loads_that_cancel_elsewhere_than_at_the_start_are_found():
    """A spring and a control with opposite stiffnesses are both zero at the start."""
    spring = JointSpring((1e9, 3.0), (0.3, -0.5))
    control = PdControl((0.3, -0.5), (-1e9 + 1, 0.0), (0.0, 0.0))
    own = lanes(Gravity(), spring, control, q1=(0.3, 0.3), q2=(-0.2, -0.2))
    assert shares_round_off(own).tolist() == [True, True]
    shared, _ = round_off_of_loads(own, of_time=False)
    assert shared[0].min() > 1e8 * ROUNDING
    alone, _ = round_off_of_loads(lanes(Gravity(), spring), of_time=False)
    assert alone.max() < 100 * ROUNDING


@pytest.mark.parametrize("accuracy", [1e-6, 1e-10])
def test_the_error_of_a_sweep_is_bounded_where_loads_cancel_after_the_start(accuracy):
    spring, control = (
        {"stiffness": [1e7, 3.0], "rest": [0.3, -0.5]},
        {"target": [0.3, -0.5], "proportional": [-1e7 + 1, 0.0], "derivative": [0.0, 0.0]},
    )
    some = ensemble(
        scene={
            "chain": {"mass": [1.0, 1.0], "length": [1.0, 1.0]},
            "start": {"q": [0.3, -0.2]},
            "run": {"duration": 2.0, "accuracy": accuracy},
            "effects": {"gravity": {"g": 9.81}, "joint_spring": spring, "pd_control": control},
        },
        axes=[axis("start.u.0", 1.0, 1.25)],
        keep={"final": True},
    )
    rows = rows_of(some, 0, 2).arrays
    effects = (
        Gravity(9.81),
        JointSpring((1e7, 3.0), (0.3, -0.5)),
        PdControl((0.3, -0.5), (-1e7 + 1, 0.0), (0.0, 0.0)),
    )
    for place, u1 in enumerate((1.0, 1.25)):
        scene = Scene(BARS, (0.3, -0.2), (u1, 0.0), 2.0, effects)
        exact = taylor_run(scene, [0.0, 2.0], formulation="kane", precision="quadruple")
        true = np.concatenate([exact.q, exact.u])[:, -1].astype(float)
        kept = np.concatenate([rows["q"][place], rows["u"][place]])
        assert np.abs(kept - true).max() <= rows["error"][place] <= accuracy


@pytest.mark.parametrize(("mass", "duration"), [(1e-9, 0.01), (1e-8, 0.1), (1e-12, 1e-3)])
def test_a_sweep_of_a_chain_with_a_light_first_link_ends(mass, duration):
    """Rates that are computed in two ways differ by the round-off of a nearly singular matrix."""
    some = ensemble(
        scene={
            "chain": {
                "mass": [mass, 0.3], "length": [0.7, 1.1],
                "centre": [[0.7, 0.0], [1.1, 0.0]], "inertia": [0.0, 0.0],
            },
            "start": {"q": [0.0, 0.0]},
            "run": {"duration": duration, "accuracy": 1e-9},
            "effects": {"gravity": {"g": 9.81}},
        },
        axes=[axis("start.u.0", 0.0, 0.3)],
        keep={"final": True},
    )  # fmt: skip
    rows = rows_of(some, 0, 2).arrays
    light = Chain.point_masses((mass, 0.3), (0.7, 1.1))
    for place, u1 in enumerate((0.0, 0.3)):
        scene = Scene(light, (0.0, 0.0), (u1, 0.0), duration, (Gravity(9.81),))
        exact = taylor_run(
            scene, [0.0, duration], formulation="momenta", precision="quadruple",
            longest_step=duration / 200,
        )  # fmt: skip
        true = np.concatenate([exact.q, exact.u])[:, -1].astype(float)
        kept = np.concatenate([rows["q"][place], rows["u"][place]])
        assert np.abs(kept - true).max() <= rows["error"][place]
