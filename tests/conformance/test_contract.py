"""The contract of Python engines: capabilities, answers, and exceptions as answers."""

import warnings

import numpy as np
import pytest

from tests.conformance.arm import Arm
from twolink.conformance.contract import CannotError, Engine, ModelRefusedError, about, answer
from twolink.conformance.quantities import QUANTITIES
from twolink.engines.messages import (
    Ask,
    Errored,
    Loaded,
    Model,
    Move,
    Refused,
    Skipped,
    Start,
    Started,
    States,
    Values,
)


class Small(Engine):
    name = "small"

    def load(self, model):
        if model.id == "refused":
            raise ModelRefusedError("it is crooked")
        if model.id == "broken":
            raise KeyError("links")

    def mass_matrix(self, angles):
        warnings.warn("nearly singular", stacklevel=1)
        return np.zeros((len(angles), 2, 2))

    def kinetic_energy(self, angles, speeds):
        return np.full(len(angles), np.nan)

    def gravity_terms(self, angles):
        raise ZeroDivisionError("no mass")

    def position(self, angles):
        raise CannotError("no frames yet")


def ask(quantity):
    states = States(angles=((0.0, 0.0),), speeds=((1.0, 1.0),))
    return answer(Small(), Ask(seq=3, test="t", quantity=quantity, states=states))


def test_capabilities_follow_from_the_methods():
    assert about(Small()).answers == ("mass_matrix", "gravity_terms", "kinetic_energy", "position")
    assert about(Arm()).answers == tuple(QUANTITIES)
    started = answer(Small(), Start())
    assert isinstance(started, Started)
    assert started.engine.language == "python"


def test_values_come_with_warnings():
    found = ask("mass_matrix")
    assert isinstance(found, Values)
    assert found.values == [[[0.0, 0.0], [0.0, 0.0]]]
    assert found.warnings == ("UserWarning: nearly singular",)


def test_numbers_that_are_not_finite_are_words():
    assert ask("kinetic_energy").values == ["nan"]


@pytest.mark.parametrize("quantity", ["position", "velocity", "load", "unknown"])
def test_what_an_engine_cannot(quantity):
    assert isinstance(ask(quantity), Skipped)


def test_an_exception_is_an_answer():
    found = ask("gravity_terms")
    assert isinstance(found, Errored)
    assert found.message == "ZeroDivisionError: no mass"
    assert "gravity_terms" in found.context["traceback"]


def test_a_motion_is_skipped():
    move = Move(
        seq=1,
        test="t",
        angles=(0.0, 0.0),
        speeds=(0.0, 0.0),
        method="",
        parameter=1.0,
        times=(0.0,),
    )
    assert isinstance(answer(Small(), move), Skipped)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("sound", Loaded()),
        ("refused", Refused(refused="it is crooked")),
        ("broken", Refused(refused="KeyError: 'links'")),
    ],
)
def test_models(name, expected):
    assert answer(Small(), Model(id=name, urdf="")) == expected
