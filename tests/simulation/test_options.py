"""The options of a simulation as one value."""

import inspect
from dataclasses import fields
from decimal import Decimal

import pytest
import sympy

from twolink.chain import Chain
from twolink.errors import ParameterError, SimulationError
from twolink.scene import Scene
from twolink.simulation import RunOptions, simulate, simulate_with

SCENE = Scene(Chain.uniform_bars(), (0.3, 0.5), (0.0, 0.0), 0.2, accuracy=1e-6)


def test_simulate_takes_every_option_with_its_default():
    keywords = {
        name: parameter.default
        for name, parameter in inspect.signature(simulate).parameters.items()
        if parameter.kind is parameter.KEYWORD_ONLY
    }
    assert keywords == {field.name: field.default for field in fields(RunOptions)}


def test_options_as_one_value_give_the_same_trajectory():
    given = {"accuracy": 1e-5, "method": "rk4", "formulation": "kane", "samples": 5}
    assert simulate_with(SCENE, RunOptions(**given)) == simulate(SCENE, **given)


@pytest.mark.parametrize(
    ("given", "error", "words"),
    [
        ({"accuracy": 0.0}, SimulationError, "accuracy must be positive and finite; got 0.0"),
        ({"accuracy": Decimal("NaN")}, SimulationError, "positive and finite; got nan"),
        ({"accuracy": sympy.Symbol("x")}, SimulationError, "positive and finite; got x"),
        ({"accuracy": "fine"}, ParameterError, "accuracy must be a number; got 'fine'"),
        ({"method": "rk5"}, SimulationError, "got 'rk5' (did you mean 'rk4'"),
        ({"formulation": "kanes"}, SimulationError, "got 'kanes' (did you mean 'kane'?)"),
        ({"samples": 1}, ParameterError, "samples must be a whole number of 2 or more; got 1"),
        ({"limits": 3}, ParameterError, "limits must be a Limits; got 3"),
    ],
)
def test_wrong_options_are_refused_before_there_is_a_scene(given, error, words):
    with pytest.raises(error) as caught:
        RunOptions(**given)
    assert words in str(caught.value)
