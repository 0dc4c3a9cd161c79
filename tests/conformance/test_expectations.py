"""Known failures: ids, flags, versions, strictness, and files that are none."""

import pytest

from twolink.conformance.expectations import Expectation, read_expectations, with_expectations
from twolink.conformance.results import Report, TestResult
from twolink.engines.marks import Mark
from twolink.engines.messages import About
from twolink.errors import ParameterError


def result(name, mark, *flags):
    return TestResult(f"import/{name}/read", "import", f"import/{name}", "read", flags, mark)


def report(*results, version="1.8.2"):
    engine = About(name="mine", version=version, reads=("urdf",))
    return Report(engine, "mine", ("import",), 1.0, 1, results)


def expect(**entry):
    return [Expectation(**{"reason": "known", **entry})]


FAILS = result("plain", Mark.REFUSED, "Plain")
PASSES = result("general", Mark.PASS, "Plain")
CANNOT = result("limits", Mark.CANNOT, "Limits")


def test_a_known_failure_does_not_count_as_a_failure():
    entry = expect(test="import/plain/read", link="https://e.org/1")
    found = with_expectations(report(FAILS, PASSES), entry)
    assert found.agrees
    assert found.results[0].expected == "known (https://e.org/1)"
    assert found.sentence == "mine agrees in all 2 tests but 1 known failure."


def test_an_unexpected_pass_is_a_failure():
    found = with_expectations(report(FAILS, PASSES), expect(test="import/*"))
    assert [each.id for each in found.failed] == [PASSES.id]
    assert found.failed[0].verdict == "unexpected pass"
    assert "it passes, and is expected to fail: known" in found.failed[0].said


def test_an_expectation_of_a_flag_holds_for_its_tests():
    found = with_expectations(report(FAILS, CANNOT), expect(flag="Plain"))
    assert found.agrees
    skipped = with_expectations(report(PASSES, CANNOT), expect(flag="Limits"))
    assert skipped.agrees


@pytest.mark.parametrize(
    ("versions", "version", "holds"),
    [
        ("", "1.8.2", True),
        (">=1.8, <2", "1.8.2", True),
        (">=1.8, <2", "1.8", True),
        (">=1.8, <2", "2.0", False),
        ("<1.10", "1.9", True),
        ("==1.8", "1.8.0", True),
        ("!=1.8", "1.8.0", False),
        (">1", "v1.0.1-rc2", True),
    ],
)
def test_an_expectation_holds_for_its_range_of_versions(versions, version, holds):
    entry = expect(test="import/plain/read", versions=versions)
    assert entry[0].holds_for(version) is holds
    found = with_expectations(report(FAILS, PASSES, version=version), entry)
    assert found.agrees is holds


def test_an_expectation_without_a_test_is_refused():
    for entry in (expect(test="import/plane/read"), expect(flag="Plane")):
        with pytest.raises(ParameterError, match="an expectation must be about a test; got"):
            with_expectations(report(FAILS), entry)
    # Of a suite that is not run, or another version, nothing can be said.
    others = expect(test="evaluation/bars/read") + expect(flag="Plane", versions=">2")
    assert with_expectations(report(PASSES), others).agrees


def test_a_file_of_expectations_is_read(tmp_path):
    file = tmp_path / "twolink-expect.toml"
    file.write_text('[[expect]]\ntest = "import/plain/read"\nreason = "known"\nversions = "<2"\n')
    assert read_expectations(file) == (
        Expectation(test="import/plain/read", reason="known", versions="<2"),
    )


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[[expect]]\n", "expect 1: reason: Field required"),
        ('[[expect]]\nreason = "x"\n', "expect 1: it must have one of test and flag"),
        ('[[expect]]\nreason = "x"\ntest = "a"\nflag = "b"\n', "one of test and flag"),
        ('[[expect]]\nreason = "x"\ntest = "a"\nversions = "1.8"\n', "versions must be such as"),
        ('[[expect]]\nreason = "x"\ntest = "a"\nbecause = "y"\n', "because: Extra inputs"),
        ('[expect]\nreason = "x"\n', r"must have tables \[\[expect\]\] only"),
        ("[[skip]]\n", r"must have tables \[\[expect\]\] only"),
        ("[[", "twolink-expect.toml: a file of expectations must be TOML; got another text"),
        ("x = " + "[" * 3000 + "]" * 3000, "toml: tables must not be nested deeper than those of"),
        ("x = " + "9" * 5000, r"must be TOML; got another text \(Exceeds the limit"),
        (f"{'.'.join('a' * 50_000)} = 1", "tables must not be nested deeper"),
    ],
)
def test_files_that_are_refused(text, words, tmp_path):
    file = tmp_path / "twolink-expect.toml"
    file.write_text(text)
    with pytest.raises(ParameterError, match=words):
        read_expectations(file)


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(ParameterError, match="there is no file of this name"):
        read_expectations(tmp_path / "none.toml")
