"""The contract of an engine: its capabilities follow from its methods."""

import inspect
from fractions import Fraction

import numpy as np
import pytest

from tests.conformance.arm import Arm
from twolink.engines.contract import Engine
from twolink.engines.faults import CannotError
from twolink.engines.messages import Move
from twolink.engines.quantities import QUANTITIES
from twolink.errors import EngineError

ANGLES = np.zeros((1, 2))


class Weighing(Engine):
    name = "weighing"

    def load(self, model):
        return None

    def gravity_terms(self, angles):
        return np.zeros_like(angles)


@pytest.mark.parametrize("quantity", QUANTITIES.values(), ids=lambda quantity: quantity.name)
def test_a_method_has_the_inputs_of_its_quantity(quantity):
    parameters = tuple(inspect.signature(getattr(Arm, quantity.name)).parameters)
    assert parameters[1:] == quantity.inputs


def test_an_engine_answers_the_quantities_of_its_methods():
    assert Weighing().answers == ("gravity_terms",)
    states = {"angles": ANGLES, "speeds": ANGLES}
    assert Weighing().evaluate("gravity_terms", states).shape == (1, 2)
    for quantity in ("kinetic_energy", "load", "phase_of_the_moon"):
        with pytest.raises(CannotError, match=f"weighing does not answer {quantity}"):
            Weighing().evaluate(quantity, states)


@pytest.mark.parametrize(
    ("values", "got"),
    [
        (np.array([[1 + 1j, 2]]), "complex128"),
        (np.array([["1", "2"]]), "str"),
        (np.array([[True, False]]), "bool"),
        (np.array([[None, 1.0]]), "NoneType"),
        (np.array([[1.0, "2"]], dtype=object), "str"),
        (np.ma.array([[1.0, 2.0]], mask=[[True, False]]), "masked ones"),
        (None, "NoneType"),
    ],
    ids=lambda value: str(value)[:12],
)
def test_values_that_are_no_real_numbers_are_refused(values, got):
    class Wrong(Weighing):
        def gravity_terms(self, angles):
            return values

    said = f"values of gravity_terms must be real numbers; got {got}"
    with pytest.raises(EngineError, match=f"^{said}"):
        Wrong().evaluate("gravity_terms", {"angles": ANGLES})


@pytest.mark.parametrize(
    "values", [[[1, 2]], np.array([[1.0, 2.0]], np.float32), [[Fraction(1), 2.0]]], ids=str
)
def test_real_numbers_of_any_type_are_taken(values):
    class Right(Weighing):
        def gravity_terms(self, angles):
            return values

    found = Right().evaluate("gravity_terms", {"angles": ANGLES})
    assert found.dtype == float
    assert found.tolist() == [[1.0, 2.0]]


def test_an_engine_without_a_package_is_installed_and_has_no_version():
    assert Weighing().missing() is None
    assert Weighing().version == ""


def test_an_engine_without_move_refuses_to_simulate():
    move = Move(
        seq=1, test="", angles=(0, 0), speeds=(0, 0), method="", parameter=1.0, times=(0.0,)
    )
    with pytest.raises(CannotError, match="weighing does not simulate"):
        Weighing().move(move)
