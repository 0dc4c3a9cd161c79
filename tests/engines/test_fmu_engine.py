"""FMUs as engines: the example agrees, a wrong sign is named, and a crash ends only the FMU."""

import pytest

from tests.engines.fmus import DESCRIPTION, SOURCE, built
from twolink.conformance.harness_check import check_harness
from twolink.conformance.runner import conform
from twolink.conformance.suites import suite
from twolink.engines.attach import attach
from twolink.engines.fmu_engine import FmuEngine
from twolink.engines.marks import Mark
from twolink.errors import EngineError

pytestmark = pytest.mark.engines

EVALUATION = {"evaluation": suite("evaluation")}
ONE_MOTION = {"motion": suite("motion")[1:2]}


def report(path, suites, *, in_process=True):
    name = f"fmu:{path}"
    return conform(name, attach(name, in_process=in_process), suites, seconds=60.0)


def wrong(old, new, source=SOURCE):
    assert old in source
    return source.replace(old, new)


def without(name, description=DESCRIPTION):
    """The description with a variable under a name that nothing knows."""
    return wrong(f'name="{name}"', f'name="other.{name}"', description)


@pytest.fixture(scope="module", params=["FMI 2.0", "FMI 3.0"])
def example(request, tmp_path_factory):
    return built(tmp_path_factory.mktemp("fmu"), fmi3=request.param == "FMI 3.0")


def test_the_example_agrees_with_the_vectors(example):
    found = report(example, EVALUATION | ONE_MOTION, in_process=False)
    assert found.agrees, [(result.id, result.said) for result in found.failed]
    asked = {result.quantity for result in found.compared}
    assert asked >= {"forward_dynamics", "kinetic_energy", "position", "motion: co-simulation"}
    (motion,) = (result for result in found.results if result.quantity.startswith("motion: "))
    assert "converges to the truth, order 4" in motion.said


def test_the_example_keeps_to_the_protocol(example):
    checks = check_harness(attach(f"fmu:{example}"), 30.0)
    assert [(check.name, check.said) for check in checks if not check.passed] == []


def test_a_wrong_sign_of_gravity_is_named(tmp_path):
    path = built(tmp_path, wrong("-v[GRAVITY]", "v[GRAVITY]"))
    found = report(path, EVALUATION | ONE_MOTION)
    assert set(found.causes()) == {"gravity-sign"}
    rates = [each for each in found.failed if each.quantity == "forward_dynamics"]
    assert len(rates) > 5
    assert {each.cause for each in rates} == {"gravity-sign"}
    (motion,) = (each for each in found.results if each.quantity.startswith("motion: "))
    assert motion.mark is Mark.SILENT
    assert "converges to another model" in motion.said


@pytest.mark.parametrize(
    "rates", ["-x[2], dx[1] = x[3]", "x[3], dx[1] = x[2]", "NAN, dx[1] = x[3]"]
)
def test_rates_of_the_angles_that_are_not_the_speeds_are_reported(tmp_path, rates):
    source = wrong("dx[0] = x[2], dx[1] = x[3]", f"dx[0] = {rates}")
    path = built(
        tmp_path,
        source,
        wrong("  <CoSimulation", "  <!-- ", DESCRIPTION).replace(
            'canHandleVariableCommunicationStepSize="true"/>', "-->"
        ),
    )
    found = report(path, EVALUATION)
    asked = [each for each in found.failed if each.quantity == "forward_dynamics"]
    assert len(asked) > 5
    for each in asked:
        assert each.said.startswith(
            "the derivatives of angle1 and angle2 must be speed1 and speed2"
        )


def test_a_chain_that_it_cannot_express_is_skipped_with_the_reason(tmp_path):
    path = built(tmp_path, description=without("centre_across2", without("centre_across1")))
    found = report(path, EVALUATION)
    assert found.agrees
    said = {each.said for each in found.results if each.quantity == "forward_dynamics"}
    assert any(
        "closed form in an FMU has no centre_across1; the chain's is" in each for each in said
    )


def test_an_fmu_without_torques_skips_states_with_torques(tmp_path):
    engine = FmuEngine(built(tmp_path, description=without("torque1")))
    found = conform_in_process(engine)
    assert {each.said for each in found if each.quantity == "forward_dynamics"} >= {
        "closed form in an FMU has no inputs torque1 and torque2"
    }


def conform_in_process(engine):
    from twolink.engines.in_process import InProcess

    return conform("fmu", lambda: InProcess(engine), EVALUATION).results


def test_an_effect_is_there_with_all_of_its_parameters(tmp_path):
    engine = FmuEngine(built(tmp_path, description=without("damping2")))
    assert engine.effects == ("armature",)


@pytest.mark.parametrize(
    ("kind", "answers", "methods"),
    [("ModelExchange", 5, 0), ("CoSimulation", 0, 1)],
)
def test_capabilities_are_those_of_the_kind(tmp_path, kind, answers, methods):
    other = {"ModelExchange": "CoSimulation", "CoSimulation": "ModelExchange"}[kind]
    engine = FmuEngine(built(tmp_path, description=wrong(f"<{other} ", "<Absent ", DESCRIPTION)))
    assert (len(engine.answers), len(engine.methods)) == (answers, methods)


def test_steps_of_one_size_for_an_fmu_that_has_one(tmp_path):
    text = wrong(' canHandleVariableCommunicationStepSize="true"', "", DESCRIPTION)
    found = report(built(tmp_path, description=text), {"motion": suite("motion")[:2]})
    assert found.agrees


def test_a_crash_ends_only_the_fmu(tmp_path):
    source = wrong(
        "static void step(double *v, double h) {",
        "static void step(double *v, double h) {\n    abort();",
    )
    found = report(built(tmp_path, source), EVALUATION | ONE_MOTION, in_process=False)
    marks = {each.mark for each in found.results if each.quantity == "forward_dynamics"}
    assert marks == {Mark.PASS, Mark.CANNOT}
    (motion,) = (each for each in found.results if each.quantity.startswith("motion: "))
    assert motion.mark is Mark.CRASH
    assert "SIGABRT" in motion.said


@pytest.mark.parametrize("in_process", [True, False])
@pytest.mark.parametrize(
    ("source", "words"),
    [
        (wrong("NOT_OFFERED(fmi2GetInteger)", ""), "undefined symbol: fmi2GetInteger"),
        (wrong("kind == 0;", "kind == 0;\n    free(c), c = NULL;"), "Failed to instantiate model"),
    ],
)
def test_a_binary_that_cannot_be_used_does_not_start(tmp_path, source, words, in_process):
    path = built(tmp_path, source)
    with pytest.raises(EngineError) as error:
        report(path, EVALUATION, in_process=in_process)
    assert f"{path}: its binary must load, and make an instance; " in str(error.value)
    assert words in str(error.value)


def test_a_model_that_the_fmu_rejects_is_refused(tmp_path):
    source = wrong("m[0] > 0 && m[1] > 0 ? OK : ERROR", "m[0] < 0 ? OK : ERROR")
    found = report(built(tmp_path, source), EVALUATION)
    (said,) = {each.said for each in found.failed}
    assert "closed form in an FMU does not start: fmi2ExitInitializationMode failed" in said
    assert {each.mark for each in found.failed} == {Mark.REFUSED}


def test_a_missing_package_is_named_with_the_extra(tmp_path, monkeypatch):
    monkeypatch.setattr(FmuEngine, "packages", (("FMPy", "no_such_package"),))
    with pytest.raises(EngineError, match=r"needs FMPy, .*pip install 'twolink\[fmi\]'"):
        attach(f"fmu:{tmp_path}/chain.fmu")
