"""Motion by methods that evaluate only rates."""

from dataclasses import dataclass

import numpy as np
import pytest

from twolink.chain import Chain
from twolink.effects import Effect
from twolink.errors import IntegrationError, SimulationError
from twolink.integration.methods import NUMERIC_METHODS
from twolink.loads import Torque
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.smooth.numeric import numeric_run


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


@dataclass(frozen=True)
class _EndsAtHalfASecond(Effect):
    def loads(self, chain, q, u, t=0.0):
        return (Torque(1, 1 / (t - 0.5)),)


def test_a_motion_that_ends_is_told_without_the_error_of_its_code():
    effects = (_EndsAtHalfASecond(),)
    scene = Scene(Chain.uniform_bars(), (0.3, 0.1), (1.0, 0.0), 1.0, effects=effects)
    sentence = r"^the motion could not be integrated beyond 0\.5 s, where its rates are not finite$"
    times = np.array([0.0, 1.0])
    with pytest.raises(IntegrationError, match=sentence):
        numeric_run(scene, times, method="rk4", formulation="momenta", setting=0.25)
