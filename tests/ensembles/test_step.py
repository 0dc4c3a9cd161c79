import math
from fractions import Fraction

import numpy as np
import pytest

from tests.ensembles.falls import FALL
from twolink.chain import Chain
from twolink.effects import Effect, JointDamping, JointSpring, JointTorque
from twolink.ensembles import step as step_module
from twolink.ensembles.compiled import System
from twolink.ensembles.deviations import UNKNOWN
from twolink.ensembles.lane_rows import LAST, LEFT, ROWS, Rows
from twolink.ensembles.step import ORDER, compiled_step, has_step
from twolink.optional import heyoka
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.smooth.equations import EQUATIONS

SYSTEM = System(FALL.moving_chain, FALL.effects, ())
MOMENTA = EQUATIONS["momenta"]
Q, U = (0.4, -1.1), (0.8, -0.3)
LONG = 1e9


def started(left, q=Q, u=U, frequency=1.0):
    """Return the rows of one run at its start."""
    found = np.zeros((ROWS, 1))
    rows = Rows.of(found)
    rows.state[:, 0] = [*q, *MOMENTA.from_speeds(FALL.chain, q, u)]
    rows.left[:], rows.frequency[:] = left, frequency
    return found


def taken(function, rows, tolerance=1e-12, cap=LONG, time=0.0):
    return function(rows, pars=np.array([[tolerance], [cap], *[[0.0]] * 4]), time=np.array([time]))


def truth(duration, q=Q, u=U):
    """Return q and p at a time."""
    run = simulate(Scene(FALL.chain, q, u, duration, FALL.effects), accuracy=1e-15, samples=2)
    p = MOMENTA.from_speeds(FALL.chain, run.q[:, -1], run.u[:, -1])
    return np.array([*run.q[:, -1], *p], float)


def test_a_step_moves_the_state_and_keeps_the_time_exactly():
    function = compiled_step(SYSTEM)
    rows, left = started(0.7), Fraction(0.7)
    while rows[LEFT] > 0:
        rows = taken(function, rows)
        left -= Fraction(float(rows[LAST, 0]))
        assert left == Fraction(float(rows[LEFT, 0]))
    found = Rows.of(taken(function, rows))
    assert found.last == 0
    assert found.steps > 3
    expected = truth(0.7)
    assert found.state[:, 0] - found.centre[:, 0] == pytest.approx(expected, abs=1e-14)
    # After a step of length 0 the rates are those in the state.
    rates = MOMENTA.rates(FALL.chain, FALL.effects, *found.state[:, 0].reshape(2, 2), 0.0)
    assert found.rates[:, 0] == pytest.approx(np.concatenate(rates), rel=1e-13)


def test_the_centre_is_the_truncation_error(monkeypatch):
    monkeypatch.setattr(step_module, "ORDER", 8)
    monkeypatch.setattr(step_module, "_MOST", 1.0)
    step_module._compiled_step.cache_clear()
    function = compiled_step(SYSTEM)
    step_module._compiled_step.cache_clear()
    rows = started(0.12, frequency=0.0)
    while rows[LEFT] > 0 or rows[LAST] > 0:
        rows = taken(function, rows, tolerance=1e-5)
    found = Rows.of(rows)
    error = found.state[:, 0] - truth(0.12)
    assert found.steps[0] < 8
    assert np.abs(error).max() > 1e-10
    assert found.centre[:, 0] == pytest.approx(error, abs=UNKNOWN * np.abs(error).max())
    assert np.abs(found.centre[:, 0] - error).max() < found.spread[0]


@pytest.mark.parametrize(
    ("changed", "length"),
    [({"cap": 0.01}, 0.01), ({"frequency": 200.0}, 1 / 200), ({"left": 0.004}, 0.004)],
)
def test_the_length_of_a_step_is_bounded(changed, length):
    rows = started(changed.get("left", 1.0), frequency=changed.get("frequency", 1.0))
    after = taken(compiled_step(SYSTEM), rows, cap=changed.get("cap", LONG))
    assert after[LAST, 0] == pytest.approx(length, rel=1e-12)


def test_a_smaller_tolerance_gives_shorter_steps_unless_errors_are_larger():
    function = compiled_step(SYSTEM)

    def length(tolerance, spread=0.0):
        rows = started(1.0)
        Rows.of(rows).spread[:] = spread
        return taken(function, rows, tolerance=tolerance)[LAST, 0]

    # The last terms have the powers ORDER − 1 and ORDER − 2 of the length.
    assert length(1e-12) / length(1e-14) == pytest.approx(100 ** (1 / (ORDER - 2)), rel=0.01)
    assert length(1e-15, spread=1e-8) > length(1e-12)
    assert length(1e-15, spread=np.nan) == length(1e-15)


def test_loads_depend_on_the_time():
    effects = (JointTorque((0.0, 0.0), (1.0, 0.5), (2.0, 3.0)),)
    function = compiled_step(System(FALL.moving_chain, effects, ()))
    rows = started(0.0)
    for time in (0.0, 0.4):
        rates = MOMENTA.rates(FALL.chain, effects, *Rows.of(rows).state[:, 0].reshape(2, 2), time)
        found = Rows.of(taken(function, rows, time=time)).rates[:, 0]
        assert found == pytest.approx(np.concatenate(rates), rel=1e-13)


@pytest.mark.parametrize(
    ("angle", "speed"), [(2e9, 0.0), (-1e15, 0.0), (0.3, 1e200), (math.nan, 0)]
)
def test_a_step_through_huge_angles_loses_the_run(angle, speed):
    found = taken(compiled_step(SYSTEM), started(1.0, (angle, 0.2), (speed, 0.0)), cap=0.1)
    assert math.isnan(found[LEFT, 0])


def test_a_swing_through_huge_angles_and_back_loses_the_run():
    """Link 1 of an uncoupled chain on a spring: within a few long steps it is back at 0 rad."""
    chain = Chain((1.0, 1.0), (1.0, 1.0), ((0.5, 0.0), (0.0, 0.0)), (1 / 12, 0.5))
    system = System(chain, (JointSpring((40.0, 0.0)),), ())
    rows, function = started(1.0, (0.0, 0.0), (1e11, 0.0)), compiled_step(system)
    reached = []
    for _ in range(12):
        rows = taken(function, rows, tolerance=1.0)
        reached.append(math.isnan(rows[LEFT, 0]))
    assert any(reached)


class Own(Effect):
    def loads(self, chain, q, u, t=0.0):
        return ()


def test_effects_of_ones_own_have_no_step():
    assert not has_step(System(FALL.moving_chain, (Own(),), ()))


def test_whether_there_is_a_step_is_known_without_compiling_it(monkeypatch):
    def refused(*given, **more):
        raise AssertionError

    monkeypatch.setattr(heyoka(), "cfunc", refused)
    assert has_step(System(FALL.moving_chain, (*FALL.effects, JointDamping((0.1, 0.2))), ()))
