"""The scoreboard's data: verdicts read back, their counts, and refused files."""

import json

import pytest

from tests.conformance.board import RIGHT, WRONG, loaded, result, verdict_file
from twolink.conformance.convergence import Limit
from twolink.conformance.scoreboard import document, read_entry, read_scoreboard, tally
from twolink.engines.marks import Mark
from twolink.errors import ParameterError


def test_a_verdict_is_read_back_as_it_was(tmp_path):
    release, entry = read_entry(verdict_file(tmp_path))
    assert release == "2026.11"
    assert entry.title == "right 1.0"
    assert entry.attachment == "cmd: right"
    assert (entry.seconds, entry.memory) == (60.0, 2**31)
    assert [each.id for each in entry.results] == [each.id for each in RIGHT]
    assert [each.mark for each in entry.results] == [each.mark for each in RIGHT]
    assert entry.results[1].digits == 15.5
    assert entry.results[3].curve.points == ((0.01, 1e-3), (0.005, 6e-5))
    assert entry.results[3].curve.verdict.limit is Limit.TRUTH
    assert entry.failed == ()
    assert "agrees" in entry.verdict


def test_counts_are_of_tests_that_were_put_to_the_engine():
    found = tally(WRONG)
    assert (found.passed, found.put) == (0, 3)
    assert found.others == ((Mark.SILENT, 2), (Mark.REFUSED, 1))
    assert found.digits == 0.0
    assert found.share == 0.0
    assert tally(RIGHT).digits == 14.25
    nothing = tally([result("import/plain/read", Mark.CANNOT)])
    assert (nothing.put, nothing.share, nothing.digits) == (0, 0.0, None)


def test_the_largest_share_of_passed_tests_stands_first(tmp_path):
    files = [verdict_file(tmp_path, "wrong", WRONG), verdict_file(tmp_path)]
    board = read_scoreboard(files)
    assert [entry.engine.name for entry in board.entries] == ["right", "wrong"]
    assert board.suites == ("import", "evaluation", "motion")


def test_the_document_has_marks_digits_settings_and_causes(tmp_path):
    board = read_scoreboard([verdict_file(tmp_path), verdict_file(tmp_path, "wrong", WRONG)])
    found = json.loads(json.dumps(document(board), allow_nan=False))
    assert found["vectors"] == "2026.11"
    assert "twolink is the reference" in found["reference"]
    right, wrong = found["engines"]
    assert right["engine"]["version"] == "1.0"
    assert right["attachment"] == "cmd: right"
    assert right["engine"]["methods"][0]["order"] == 4.0
    assert right["suites"]["import"]["digits"] == 15.5
    assert right["failures"] == []
    matrix = wrong["suites"]["evaluation"]["quantities"]["mass_matrix"]
    assert matrix == {"passed": 0, "put": 2, "marks": {"silently wrong": 2}, "digits": 0.0}
    causes = {failure["id"]: failure["sentence"] for failure in wrong["failures"]}
    assert causes["evaluation/bars/mass-matrix"] == "gravity acts in the opposite direction"


@pytest.mark.parametrize(
    "content",
    ["", "no JSON", "[]", "{}", '{"protocol": 1}', "\ufeff{}", '{"results": [{"id": 3}]}'],
)
def test_a_file_that_is_no_verdict_is_refused_in_one_sentence(content, tmp_path):
    path = tmp_path / "a.json"
    path.write_text(content)
    with pytest.raises(ParameterError, match="must be a verdict of twolink conform") as caught:
        read_scoreboard([path])
    assert "\n" not in str(caught.value)


def test_an_unknown_mark_is_refused(tmp_path):
    path = verdict_file(tmp_path)
    found = loaded(path)
    found["results"][0]["mark"] = "splendid"
    path.write_text(json.dumps(found))
    with pytest.raises(ParameterError, match=r"right\.json must be a verdict .*splendid"):
        read_scoreboard([path])


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("errors", [1.0], "an error for each setting"),
        ("limit", "nowhere", "nowhere"),
        ("parameter", "colour", "parameter"),
    ],
)
def test_a_wrong_convergence_is_refused(key, value, said, tmp_path):
    path = verdict_file(tmp_path)
    found = loaded(path)
    found["results"][3]["convergence"][key] = value
    path.write_text(json.dumps(found))
    with pytest.raises(ParameterError, match=rf"must be a verdict .*{said}"):
        read_scoreboard([path])


def test_a_verdict_without_curves_is_read(tmp_path):
    path = verdict_file(tmp_path)
    found = loaded(path)
    for each in found["results"]:
        del each["convergence"]
    path.write_text(json.dumps(found))
    assert {result.curve for result in read_entry(path)[1].results} == {None}


def test_a_file_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(ParameterError, match="there is no file of this name"):
        read_scoreboard([tmp_path / "a.json"])


def test_verdicts_on_other_vectors_are_refused(tmp_path):
    files = [verdict_file(tmp_path), verdict_file(tmp_path, "old", vectors="2025.01")]
    with pytest.raises(ParameterError, match=r"the same vectors; .*'2026.11', .*'2025.01'"):
        read_scoreboard(files)


def test_a_second_verdict_on_one_engine_is_refused(tmp_path):
    path = verdict_file(tmp_path)
    with pytest.raises(ParameterError, match=r"second verdict on right 1\.0"):
        read_scoreboard([path, path])
    other = verdict_file(tmp_path, version="2.0")
    assert len(read_scoreboard([path, other]).entries) == 2


def test_a_scoreboard_without_verdicts_is_refused():
    with pytest.raises(ParameterError, match="a verdict or more; got none"):
        read_scoreboard([])
