import numpy as np
import pytest

from twolink.chain import Chain
from twolink.effects import Gravity, JointTorque
from twolink.ensembles.compiled import FORMULATION, LANES, System
from twolink.ensembles.numbers import numbers_in
from twolink.errors import SimulationError
from twolink.simulation.smooth.equations import EQUATIONS

CHAIN = Chain.uniform_bars((1.0, 2.0), (0.5, 0.7))
EFFECTS = (Gravity(3.7),)
# Which numbers: the second mass, and g.
MASS, G = 1, 10


def test_parameters_are_the_numbers_in_their_places():
    assert numbers_in((CHAIN, EFFECTS))[0][MASS] == 2.0
    assert numbers_in((CHAIN, EFFECTS))[0][G] == 3.7


def test_rates_in_lanes_are_those_of_each_chain(random):
    system = System(CHAIN, EFFECTS, (MASS, G))
    masses, gs = random.uniform(0.5, 3, LANES), random.uniform(1, 10, LANES)
    q, x = random.normal(size=(2, LANES)), random.normal(size=(2, LANES))
    lanes = system.lanes(np.array([masses, gs]), q, x, 1.0)
    equations = EQUATIONS[FORMULATION]
    found = equations.rates(lanes.chain, lanes.effects, tuple(q), tuple(x), 0.0)
    for k in range(0, LANES, 5):
        chain = Chain((1.0, masses[k]), CHAIN.length, CHAIN.centre, CHAIN.inertia)
        own = equations.rates(chain, (Gravity(gs[k]),), tuple(q[:, k]), tuple(x[:, k]), 0.0)
        for pair, exact in zip(found, own, strict=True):
            assert np.array([row[k] for row in pair]) == pytest.approx(exact, rel=1e-14)


@pytest.mark.slow
def test_an_integrator_is_compiled_once_for_all_runs():
    system = System(CHAIN, EFFECTS, (MASS,))
    again = System(Chain.uniform_bars((1.0, 2.0), (0.5, 0.7)), (Gravity(3.7),), (MASS,))
    assert system.integrator(9) is again.integrator(9)
    assert system.integrator(9) is not system.integrator(11)
    assert system.integrator(9).original.state.shape == (4, LANES)


def test_equations_that_need_numbers_are_refused():
    direction = numbers_in((CHAIN, EFFECTS))[0].index(0.0, G)
    system = System(CHAIN, EFFECTS, (direction,))
    with pytest.raises(SimulationError, match="the equations have no form with parameters"):
        system.check()


def test_rates_that_depend_on_time():
    driven = JointTorque((0.0, 0.0), (1.0, 0.0), (2.0, 0.0))
    assert System(CHAIN, (*EFFECTS, driven), ()).depends_on_time
    assert not System(CHAIN, EFFECTS, (MASS, G)).depends_on_time
