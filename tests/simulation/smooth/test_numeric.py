"""Motion by methods that evaluate only rates."""

from dataclasses import dataclass

import pytest

from twolink.chain import Chain
from twolink.effects import Effect
from twolink.errors import SimulationError
from twolink.integration.methods import NUMERIC_METHODS
from twolink.loads import Torque
from twolink.scene import Scene
from twolink.simulation import simulate


@dataclass(frozen=True)
class _DividesByZero(Effect):
    def loads(self, chain, q, u, t=0.0):
        return (Torque(1, 1 / (0.0 * u[0])),)


@pytest.mark.parametrize("method", NUMERIC_METHODS)
def test_loads_that_are_nowhere_finite_are_one_sentence(method):
    effects = (_DividesByZero(),)
    scene = Scene(Chain.uniform_bars(), q=(0.3, 0.1), u=(1.0, 0.0), duration=1.0, effects=effects)
    with pytest.raises(SimulationError, match="the loads must be finite in some state"):
        simulate(scene, method=method)
