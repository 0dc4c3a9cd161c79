"""Reports: the verdict, the JSON document, and JUnit's XML."""

import math
from dataclasses import replace
from xml.etree import ElementTree

from twolink.cli.terminal import as_json
from twolink.conformance.report import document, junit
from twolink.conformance.results import Report, TestResult, rows
from twolink.engines.marks import Mark
from twolink.engines.messages import About

ENGINE = About(name="mine", version="1.0", reads=("urdf",))


def result(name, mark, **more):
    return TestResult(f"import/plain/{name}", "import", "import/plain", name, (), mark, **more)


PASSED = result("mass_matrix", Mark.PASS, factor=0.1, digits=15.2)
WRONG = result("gravity_terms", Mark.SILENT, factor=1e9, digits=0.2, cause="gravity-sign")
CRASHED = result("jacobian", Mark.CRASH, said="crash: \x1b[31mSIGSEGV", output="core dumped")
SKIPPED = result("velocity", Mark.CANNOT, said="not yet", issue="https://e.org/1")


def report(*results):
    return Report(ENGINE, "mine:Engine", ("import",), 60.0, 2**32, results)


def test_the_verdict_counts_failed_and_skipped_tests():
    assert report(PASSED, SKIPPED).agrees
    assert report(PASSED, SKIPPED).sentence == "mine agrees in all 1 tests."
    assert report(PASSED, WRONG, CRASHED).sentence == "mine disagrees in 2 of 3 tests."
    assert not report(SKIPPED).agrees
    assert report(SKIPPED).sentence == "mine was not compared: it skips all tests."


def test_an_engine_that_answers_no_question_was_not_compared():
    """It has read a model, and skips all questions on it."""
    read = result("read", Mark.PASS)
    assert not report(read, SKIPPED).agrees
    sentence = "mine was not compared: it skips all tests beside reading 1 model."
    assert report(read, SKIPPED).sentence == sentence
    refused = replace(read, mark=Mark.REFUSED)
    assert report(refused, SKIPPED).sentence == "mine disagrees in 1 of 1 tests."


def test_an_expected_failure_is_no_failure():
    known = replace(WRONG, expected="known since 1.0")
    assert report(PASSED, known).agrees
    assert report(PASSED, known).causes() == {}


def test_causes_and_rows():
    other = replace(WRONG, id="import/general/gravity_terms")
    assert report(PASSED, WRONG, other).causes() == {"gravity-sign": (WRONG, other)}
    assert list(rows([PASSED, WRONG, other])) == [
        ("import", "mass_matrix"),
        ("import", "gravity_terms"),
    ]
    assert WRONG.reason == "gravity acts in the opposite direction"


def test_the_document_has_everything():
    table = as_json(document(report(PASSED, WRONG, CRASHED)))
    assert table["engine"]["name"] == "mine"
    assert table["agrees"] is False
    assert table["causes"]["gravity-sign"]["tests"] == [WRONG.id]
    assert [each["mark"] for each in table["results"]] == ["pass", "silently wrong", "crash"]
    assert table["results"][2]["factor"] == "nan"
    assert math.isclose(table["results"][1]["factor"], 1e9)


def test_junit():
    root = ElementTree.fromstring(junit(report(PASSED, WRONG, CRASHED, SKIPPED)))
    (suite,) = root
    assert suite.attrib["tests"] == "4"
    assert suite.attrib["failures"] == "2"
    assert suite.attrib["skipped"] == "1"
    cases = {case.attrib["name"]: case for case in suite}
    assert len(cases[PASSED.id]) == 0
    assert "opposite direction" in cases[WRONG.id].find("failure").attrib["message"]
    assert "\\x1b" in cases[CRASHED.id].find("failure").attrib["message"]
    assert "core dumped" in cases[CRASHED.id].find("failure").text
    assert cases[SKIPPED.id].find("skipped").attrib["message"] == "not yet"
