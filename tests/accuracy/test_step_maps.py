"""Compiled steps against SciPy's steps and against steps in Python."""

import numpy as np
import pytest
from scipy.integrate import DOP853, RK45

from twolink.accuracy.long_runs import many_starts
from twolink.accuracy.step_maps import (
    SemiImplicitEuler,
    StageIteration,
    scipy_tableau,
    step_map,
)
from twolink.data import data_path
from twolink.errors import SimulationError
from twolink.integration.methods import NUMERIC_METHODS
from twolink.integration.tableaus import GAUSS_LEGENDRE, RK4
from twolink.scene import Scene
from twolink.simulation.smooth.numeric import _formula, _rates

SWINGS = Scene.load(data_path("scenes") / "small_swings.toml")
STATES = many_starts(SWINGS, 5, spread=0.3, seed=7)
STATES[2:] += 0.2
IMPLICIT = {
    "semi-implicit-euler": SemiImplicitEuler(),
    "implicit-midpoint": GAUSS_LEGENDRE[2],
    "gauss-legendre-4": GAUSS_LEGENDRE[4],
    "gauss-legendre-6": GAUSS_LEGENDRE[6],
}
H = 0.02
ROUNDING = np.spacing(1.0)


def stepped(steps: int, step) -> np.ndarray:
    """Return the states after a number of steps, one start after the other."""
    rates = _rates(_formula(SWINGS.moving_chain, SWINGS.effects, "momenta"))
    found = []
    for start in STATES.T:
        x = start
        for _ in range(steps):
            x = step(rates, x)
        found.append(x)
    return np.array(found).T


@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    "name", [name for name, method in NUMERIC_METHODS.items() if method.parameter == "step"]
)
def test_a_map_is_the_step_that_python_takes(name):
    method = IMPLICIT.get(name, RK4)
    iterations = StageIteration(SWINGS, method, H).needed(STATES) if name in IMPLICIT else 0
    steps = step_map(SWINGS, method, H, iterations=iterations)
    ours = steps.advance(STATES, 3)
    theirs = stepped(3 * steps.steps, lambda f, x: NUMERIC_METHODS[name].step(f, 0.0, x, H))
    assert np.abs(ours - STATES).max() > 0.01
    # A rounding or two of each step, and the motion is regular.
    assert np.abs(ours - theirs).max() < 4 * ROUNDING * 3 * steps.steps


@pytest.mark.slow_but_first
@pytest.mark.parametrize("solver", [RK45, DOP853])
def test_a_map_is_scipys_own_step(solver):
    steps = step_map(SWINGS, scipy_tableau(solver.__name__), H)

    def by_scipy(rates, x):
        # At so loose a tolerance SciPy takes the step that it is given.
        one = solver(rates, 0.0, x, H, first_step=H, rtol=1e3, atol=1e3)
        one.step()
        assert one.t == H
        return one.y

    ours, theirs = steps.advance(STATES, 1), stepped(steps.steps, by_scipy)
    assert np.abs(ours - theirs).max() < 4 * ROUNDING * steps.steps


@pytest.mark.slow_but_first
@pytest.mark.parametrize("name", IMPLICIT)
def test_the_needed_iterations_are_sufficient_and_half_of_them_are_not(name):
    stages = StageIteration(SWINGS, IMPLICIT[name], H)
    enough = stages.needed(STATES)
    assert stages.change(STATES, enough) < 1
    assert stages.change(STATES, enough // 2) > 10
    few, same, more = (
        step_map(SWINGS, IMPLICIT[name], H, iterations=n, steps=1).advance(STATES, 1)
        for n in (enough // 2, enough, enough + 1)
    )
    assert np.abs(more - same).max() <= 2 * ROUNDING
    assert np.abs(few - same).max() > 10 * ROUNDING


def test_a_step_that_is_too_long_is_refused():
    with pytest.raises(SimulationError, match=r"0\.8 s does not converge in 60 iterations"):
        StageIteration(SWINGS, GAUSS_LEGENDRE[2], 0.8).needed(STATES)


def test_the_tableaus_are_consistent_and_of_their_order():
    """Conditions on the weights: Σ b c^k = 1/(k+1) up to the order."""
    known = [(RK4, 4), *((tableau, order) for order, tableau in GAUSS_LEGENDRE.items())]
    known += [(scipy_tableau("RK45"), 5), (scipy_tableau("DOP853"), 8)]
    for tableau, order in known:
        b, c = np.array(tableau.b), np.array(tableau.c)
        for k in range(order):
            assert b @ c**k == pytest.approx(1 / (k + 1), abs=1e-14)
        assert abs(b @ c**order - 1 / (order + 1)) > 1e-5
    assert RK4.explicit
    assert not GAUSS_LEGENDRE[2].explicit
