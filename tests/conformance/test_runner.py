"""Runs: marks of reading, questions that are not asked, and engines that keep failing."""

import warnings

import pytest

from tests.conformance.arm import Arm
from twolink.conformance.contract import ModelRefusedError
from twolink.conformance.runner import conform
from twolink.conformance.suites import suite
from twolink.engines.faults import EngineFault, FaultKind
from twolink.engines.in_process import InProcess
from twolink.engines.marks import Mark
from twolink.engines.messages import Understood
from twolink.engines.session import Session


def groups(*names):
    wanted = set(names)
    return {
        name: tuple(g for g in suite(name) if g.id.partition("/")[2] in wanted)
        for name in ("import", "evaluation")
    }


def run(engine, *names):
    found = conform("arm", lambda: InProcess(engine), groups(*names))
    return found, {result.id: result for result in found.results}


def test_questions_on_effects_that_an_engine_lacks_are_skipped():
    class Rigid(Arm):
        effects = ()

    found, results = run(Rigid(), "damped", "armature", "damping-and-friction")
    assert found.agrees
    for identity in (
        "evaluation/damped/forward-dynamics",
        "evaluation/armature/mass-matrix",
        "import/damping-and-friction/forward-dynamics",
    ):
        assert results[identity].mark is Mark.CANNOT
        assert "the engine does not have" in results[identity].said
    assert results["evaluation/damped/mass-matrix"].mark is Mark.PASS
    assert "evaluation/damped/inverse-dynamics" not in results


def test_models_that_an_engine_does_not_read():
    class Planar(Arm):
        reads = ("parameters",)

    found, results = run(Planar(), "plain", "bars")
    assert results["import/plain/read"].mark is Mark.CANNOT
    assert "import/plain/mass-matrix" not in results
    assert len(found.compared) == 12


def test_a_refusal_is_right_for_invalid_models_only():
    class Strict(Arm):
        def load(self, model):
            raise ModelRefusedError("I refuse everything")

    _, results = run(Strict(), "plain", "nan-mass", "three-joints")
    assert results["import/plain/read"].mark is Mark.REFUSED
    assert results["import/plain/read"].said == "I refuse everything"
    assert results["import/nan-mass/read"].mark is Mark.PASS
    assert results["import/three-joints/read"].mark is Mark.PASS


def test_invalid_models_that_are_accepted():
    class Lenient(Arm):
        def load(self, model):
            return None

    _, results = run(Lenient(), "nan-mass", "three-joints")
    assert results["import/nan-mass/read"].mark is Mark.SILENT
    assert results["import/nan-mass/read"].said == "it must be refused: NaN"
    assert results["import/three-joints/read"].mark is Mark.PASS


def test_a_warning_on_a_model_keeps_its_wrong_answers_from_being_silent():
    class Doubled(Arm):
        def mass_matrix(self, angles):
            return 2 * super().mass_matrix(angles)

    class Warned(Doubled):
        def load(self, model):
            warnings.warn("inertias are corrected", stacklevel=1)
            return super().load(model)

    _, results = run(Doubled(), "plain")
    assert results["import/plain/mass-matrix"].mark is Mark.SILENT
    _, results = run(Warned(), "plain")
    assert results["import/plain/mass-matrix"].mark is Mark.MISSED
    assert results["import/plain/mass-matrix"].warnings == ("UserWarning: inertias are corrected",)
    assert results["import/plain/gravity-terms"].mark is Mark.PASS
    assert results["import/plain/gravity-terms"].warnings == ()


def test_a_misunderstood_model_is_reported():
    class Weightless(Arm):
        def understood(self):
            return Understood(mass=(1.0, 0.0))

    _, results = run(Weightless(), "plain")
    read = results["import/plain/read"]
    assert read.mark is Mark.SILENT
    assert read.said == "mass of link 2 must be 1 kg; it understood 0"
    assert results["import/plain/mass-matrix"].mark is Mark.PASS


class Broken:
    """A transport that fails at every question but the first ones."""

    printed = (0, "")
    starts = 0

    def __init__(self):
        type(self).starts += 1
        self._inside = InProcess(Arm())

    def ask(self, request, seconds):
        if request.cmd == "ask":
            raise EngineFault(FaultKind.CRASH, "SIGSEGV", "core dumped")
        return self._inside.ask(request, seconds)

    def close(self):
        pass


def test_an_engine_is_not_asked_again_after_three_faults_on_a_model():
    Broken.starts = 0
    found = conform("broken", Broken, groups("plain", "general"))
    asked = [result for result in found.results if result.quantity != "read"]
    assert {result.mark for result in asked} == {Mark.CRASH}
    assert asked[0].output == "core dumped"
    # Three models are asked for three quantities each, and each fault but the last is followed by
    # another start.
    assert sum("not asked after 3 faults" in result.said for result in asked) == len(asked) - 9
    assert Broken.starts == 9


def test_a_model_is_loaded_again_after_a_fault():
    told = []

    class Watched(InProcess):
        def ask(self, request, seconds):
            told.append(request.cmd)
            if told.count("ask") == 1 and request.cmd == "ask":
                raise EngineFault(FaultKind.HANG, "no answer")
            return super().ask(request, seconds)

    group = groups("bars")["evaluation"][0]
    test = group.tests[0]
    with Session(lambda: Watched(Arm()), 1.0) as session:
        session.load(group.request(("parameters",)))
        with pytest.raises(EngineFault):
            session.ask(test.id, test.quantity, test.states)
        session.ask(test.id, test.quantity, test.states)
    assert told == ["start", "model", "ask", "start", "model", "ask"]
