"""The contract of an engine: its capabilities follow from what it overrides."""

import inspect

import numpy as np
import pytest

from twolink.engines.contract import CannotError, Engine
from twolink.engines.messages import Move
from twolink.engines.quantities import QUANTITIES

ANGLES = np.zeros((1, 2))


class Weighing(Engine):
    name = "weighing"

    def load(self, model):
        return None

    def gravity_terms(self, angles):
        return np.zeros_like(angles)


@pytest.mark.parametrize("quantity", QUANTITIES.values(), ids=lambda quantity: quantity.name)
def test_the_contract_has_every_quantity_with_its_inputs(quantity):
    parameters = inspect.signature(getattr(Engine, quantity.name)).parameters
    assert tuple(parameters)[1:] == quantity.inputs
    if quantity.name not in Weighing().answers:
        inputs = [ANGLES] * len(quantity.inputs)
        with pytest.raises(CannotError, match=f"weighing does not answer {quantity.name}"):
            getattr(Weighing(), quantity.name)(*inputs)


def test_an_engine_answers_the_quantities_that_it_overrides():
    assert Weighing().answers == ("gravity_terms",)


def test_an_engine_without_a_package_is_installed_and_has_no_version():
    assert Weighing().missing() is None
    assert Weighing().version == ""


def test_an_engine_does_not_simulate_unless_it_says_so():
    move = Move(
        seq=1, test="", angles=(0, 0), speeds=(0, 0), method="", parameter=1.0, times=(0.0,)
    )
    with pytest.raises(CannotError, match="weighing does not simulate"):
        Weighing().move(move)
