"""`assert_conforms`: an assertion for the tests of an engine."""

import pytest

from tests.conformance.arm import Arm
from tests.conformance.wrong import NoHalf
from twolink.errors import EngineError, ParameterError
from twolink.testing import assert_conforms

ONE = ("evaluation",)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("engine", [Arm, Arm()], ids=["class", "object"])
def test_a_right_engine_passes(engine):
    assert assert_conforms(engine, suites=ONE).sentence == "arm agrees in all 130 tests."


@pytest.mark.slow
def test_an_engine_is_given_by_its_name():
    assert assert_conforms("pinocchio", suites=ONE).engine.name == "Pinocchio"


@pytest.mark.slow
def test_a_wrong_engine_raises_an_assertion_error():
    with pytest.raises(AssertionError) as caught:
        assert_conforms(NoHalf, suites=ONE)
    lines = str(caught.value).splitlines()
    assert lines[0] == "factor-two disagrees in 11 of 130 tests."
    assert lines[1] == (
        "  evaluation/bars/kinetic-energy: silently wrong; the answer is twice the right one"
    )
    assert lines[-1] == "  and 1 more"


@pytest.mark.slow
def test_known_failures(tmp_path):
    file = tmp_path / "twolink-expect.toml"
    file.write_text('[[expect]]\ntest = "evaluation/*/kinetic-energy"\nreason = "known"\n')
    found = assert_conforms(NoHalf, suites=ONE, expect=file)
    assert found.sentence == "factor-two agrees in all 130 tests but 11 known failures."
    with pytest.raises(AssertionError, match="unexpected pass"):
        assert_conforms(Arm, suites=ONE, expect=file)


def test_unknown_engines_and_suites_are_refused():
    with pytest.raises(EngineError, match="did you mean"):
        assert_conforms("pinnochio", suites=ONE)
    with pytest.raises(ParameterError, match="suite must be one of"):
        assert_conforms(Arm, suites=("walks",))
