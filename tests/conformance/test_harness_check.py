"""Checks of adapters: a right one passes all, and each fault fails its check."""

import sys

import numpy as np
import pytest

from tests.conformance.arm import Arm
from tests.engines.test_process import PYTHON, ROGUE, answers  # noqa: F401
from twolink.conformance.harness_check import check_harness
from twolink.engines.in_process import InProcess
from twolink.engines.messages import Values
from twolink.engines.process import ProcessTransport


def failed(transport, seconds=8.0):
    return {c.name: c.said for c in check_harness(transport, seconds) if not c.passed}


def in_process(engine):
    return lambda: InProcess(engine)


@pytest.mark.parametrize("form", ["urdf", "parameters"])
def test_a_right_adapter_passes(form):
    class OfForm(Arm):
        reads = (form,)

    checks = check_harness(in_process(OfForm()), 8.0)
    assert [check.said for check in checks if not check.passed] == []
    assert len(checks) == 21


@pytest.mark.slow
def test_an_engine_in_a_child_process_passes():
    served = [sys.executable, "-m", "twolink.engines.serve", "tests.conformance.arm:Arm"]
    assert failed(lambda: ProcessTransport(served), 60.0) == {}


class Forgetful(Arm):
    """The first model stays."""

    def load(self, model):
        if hasattr(self, "m"):
            return self.understood()
        return super().load(model)


class Careless(Arm):
    reads = ("parameters",)

    def load(self, model):
        mass = tuple(abs(m) for m in model.parameters.mass)
        changed = model.parameters.model_copy(update={"mass": mass})
        return super().load(model.model_copy(update={"parameters": changed}))


class Restless(Arm):
    count = 0

    def mass_matrix(self, angles):
        self.count += 1
        return super().mass_matrix(angles) + self.count


class Averaging(Arm):
    def mass_matrix(self, angles):
        found = super().mass_matrix(angles)
        return found - found.mean(axis=0)


class Short(Arm):
    def mass_matrix(self, angles):
        return super().mass_matrix(angles)[:10]


class NotFinite(Arm):
    def gravity_terms(self, angles):
        return super().gravity_terms(angles) * np.nan


class Raising(Arm):
    def jacobian(self, angles):
        raise ValueError("not yet")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "name", "words"),
    [
        (Forgetful, "another model", "they did not change"),
        (Careless, "a broken model", "it must be refused; it was loaded"),
        (Restless, "the same question twice", "answers must be equal"),
        (Averaging, "one state", "a state alone must have the value"),
        (Short, "many states", "must be 1000 × 2 × 2 numbers; got 10"),
        (NotFinite, "ask gravity_terms", "values must be finite"),
        (Raising, "ask jacobian", "got ValueError: not yet"),
    ],
)
def test_each_fault_fails_its_check(kind, name, words):
    assert words in failed(in_process(kind()))[name]


def test_values_of_an_unknown_quantity_fail_a_check():
    class Guessing(InProcess):
        def ask(self, request, seconds):
            if getattr(request, "quantity", "") == "phase_of_the_moon":
                return Values(seq=request.seq, values=[0.0] * 6)
            return super().ask(request, seconds)

    assert failed(lambda: Guessing(Arm())) == {
        "a quantity that no engine has": "it must be skipped; got values"
    }


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mode", "name", "words"),
    [
        ("start", "start", "no display"),
        ("crash", "ask mass_matrix", "SIGSEGV"),
        ("banner", "ask mass_matrix", "must be one JSON object"),
        ("length", "ask mass_matrix", "wrong length"),
    ],
)
def test_faults_of_a_child(mode, name, words, answers):  # noqa: F811
    command = [*PYTHON, str(ROGUE), mode, str(answers)]
    assert words in failed(lambda: ProcessTransport(command))[name]


def test_a_child_that_ignores_stop_fails_a_check(answers):  # noqa: F811
    """It ignores `stop`, and ends only at the end of its input."""
    code = ROGUE.read_text().replace("        break\n", "        sys.exit(4)\n")
    command = [sys.executable, "-I", "-S", "-c", code, "lie", str(answers)]
    assert "exit code 0" in failed(lambda: ProcessTransport(command))["stop"]
