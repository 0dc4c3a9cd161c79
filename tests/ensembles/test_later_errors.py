"""The growth of errors of later steps in lanes, against that along single motions."""

import numpy as np
import pytest

from twolink.chain import Chain
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_spring import JointSpring
from twolink.effects.joint_torque import JointTorque
from twolink.ensembles.blocks import Lanes
from twolink.ensembles.compiled import FORMULATION
from twolink.ensembles.later_errors import LaterErrors
from twolink.scene import Scene
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.simulation.smooth.growth_along import growth_along
from twolink.simulation.smooth.taylor import taylor_run

CHAIN = Chain.uniform_bars((1.3, 0.7), (0.9, 1.1))
DRIVEN = (
    Gravity(),
    JointSpring((0.0, 2.0)),
    JointDamping((0.3, 0.5)),
    JointTorque(amplitude=(0.5, 0.2), frequency=(1.0, 0.7)),
)
STEPS, DURATION = 200, 4.0


def motions(effects, starts):
    """Return times (STEPS + 1,), and the variables of motions, shape (4, STEPS + 1, lanes)."""
    times, found = np.linspace(0.0, DURATION, STEPS + 1), []
    for q, u in starts:
        run = taylor_run(Scene(CHAIN, q, u, DURATION, effects), times, formulation="kane")
        second = EQUATIONS[FORMULATION].from_speeds(CHAIN, tuple(run.q), tuple(run.u))
        found.append(np.array([*run.q, *second]))
    return times, np.stack(found, axis=2)


STARTS = (((0.3, -0.4), (5.0, 4.0)), ((2.0, 1.0), (-6.0, 1.0)), ((0.0, 0.0), (4.0, -4.0)))


def lanes_of(effects, starts=STARTS):
    q, u = (np.array([start[k] for start in starts]).T for k in (0, 1))
    return Lanes(CHAIN, effects, q, u, DURATION)


def grown(effects, parts=1, starts=STARTS, moves=None):
    times, variables = motions(effects, starts)
    own = np.repeat(times[:, None], len(starts), axis=1)
    moving = np.ones((STEPS, len(starts)), bool) if moves is None else moves
    later, found = LaterErrors(lanes_of(effects, starts)), []
    for part in np.array_split(np.arange(STEPS), parts):
        ends = slice(part[0] + 1, part[-1] + 2)
        found.append(later.until(own[part[0] : part[-1] + 2], variables[:, ends], moving[part]))
    return np.concatenate(found)


def test_the_growth_is_that_along_each_motion():
    found = grown(DRIVEN)
    for lane, (q, u) in enumerate(STARTS):
        scene = Scene(CHAIN, q, u, DURATION, DRIVEN)
        times = np.linspace(0.0, DURATION, STEPS + 1)
        run = taylor_run(scene, times, formulation="momenta")
        states = np.concatenate([run.q, run.u])
        expected = growth_along(scene, "momenta", times, states)
        # There an error is as large as the largest state, before and after.
        assert expected[-1] / 3 < found[-1, lane] < 1.01 * expected[-1]
        assert np.all(np.diff(found[:, lane]) >= 0)
    assert found[-1].min() > 10.0


def test_parts_give_the_growth_of_the_whole():
    assert grown(DRIVEN, parts=7) == pytest.approx(grown(DRIVEN), rel=1e-8)


def test_the_growth_of_a_lane_does_not_depend_on_its_neighbours():
    wild = (STARTS[0], ((1.0, -2.0), (40.0, -60.0)))
    assert grown(DRIVEN)[:, 0].tolist() == grown(DRIVEN, starts=wild)[:, 0].tolist()


def test_a_run_that_has_ended_keeps_its_growth():
    moves = np.ones((STEPS, 3), bool)
    moves[120:, 1] = False
    found = grown(DRIVEN, parts=3, moves=moves)
    assert len(set(found[120:, 1].tolist())) == 1
    assert found[119, 1] == found[-1, 1]


def test_a_motion_that_is_not_finite_has_an_unknown_growth():
    later = LaterErrors(lanes_of(DRIVEN))
    variables = np.zeros((4, 2, 3))
    variables[0, 1, 2] = np.nan
    times = np.repeat(np.array([[0.0], [0.1], [0.2]]), 3, axis=1)
    found = later.until(times, variables, np.ones((2, 3), bool))
    assert np.isinf(found[1]).tolist() == [False, False, True]


def test_loads_of_the_pose_alone_have_no_other_growth():
    assert not grown((Gravity(),)).any()
