"""The contract of Python engines: capabilities, answers, and exceptions as answers."""

import warnings

import numpy as np
import pytest

from tests.conformance.arm import Arm
from twolink.conformance.quantities import QUANTITIES
from twolink.engines.answering import about, answer
from twolink.engines.contract import Engine
from twolink.engines.faults import CannotError, ModelRefusedError
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
from twolink.errors import EngineError


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

    def forward_dynamics(self, angles, speeds, torques):
        raise ModelRefusedError("M is singular")

    def jacobian(self, angles):
        raise NotImplementedError

    def position(self, angles):
        raise CannotError("no frames yet")


def ask(quantity):
    states = States(angles=((0.0, 0.0),), speeds=((1.0, 1.0),), torques=((0.0, 0.0),))
    return answer(Small(), Ask(seq=3, test="t", quantity=quantity, states=states))


def test_capabilities_follow_from_the_methods():
    names = "mass_matrix gravity_terms forward_dynamics kinetic_energy position jacobian"
    assert about(Small()).answers == tuple(names.split())
    assert about(Arm()).answers == tuple(QUANTITIES)
    started = answer(Small(), Start())
    assert isinstance(started, Started)
    assert started.engine.language == "python"


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"name": 5}, "name: input should be a valid string; got 5"),
        ({"reads": "parameters"}, "reads: input should be a valid tuple; got 'parameters'"),
        ({"precision": "double"}, "precision: input should be 'binary32', .*; got 'double'"),
    ],
)
def test_capabilities_of_a_wrong_type_are_one_sentence(wrong, said):
    engine = type("Wrong", (Small,), wrong)()
    with pytest.raises(EngineError, match=f"^Wrong: {said}$"):
        answer(engine, Start())


def test_an_answer_of_a_wrong_type_is_one_sentence():
    class Wrong(Small):
        def load(self, model):
            return 5

    said = "understood: input should be a valid dictionary or instance of Understood; got 5"
    assert answer(Wrong(), Model(id="sound", urdf="")) == Refused(refused=said)


def test_values_come_with_warnings():
    found = ask("mass_matrix")
    assert isinstance(found, Values)
    assert found.values == [[[0.0, 0.0], [0.0, 0.0]]]
    assert found.warnings == ("UserWarning: nearly singular",)


def test_numbers_that_are_not_finite_are_words():
    assert '"values": ["nan"]' in ask("kinetic_energy").line()


@pytest.mark.parametrize("quantity", ["position", "velocity", "load", "unknown"])
def test_unsupported_quantities_are_skipped(quantity):
    assert isinstance(ask(quantity), Skipped)


@pytest.mark.parametrize(
    ("quantity", "said"),
    [
        ("gravity_terms", "ZeroDivisionError: no mass"),
        ("forward_dynamics", "M is singular"),
        ("jacobian", "NotImplementedError"),
    ],
)
def test_an_exception_is_an_answer(quantity, said):
    found = ask(quantity)
    assert isinstance(found, Errored)
    assert found.message == said
    assert quantity in found.context["traceback"]


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
