import json
import math

import pytest
from typer.testing import CliRunner

from twolink.cli import app
from twolink.errors import EngineError, ParameterError
from twolink.hardcases.catalogue import CASES, case_named, explained
from twolink.hardcases.record import FORMULATIONS, GROUPS, Finding, Mark
from twolink.hardcases.run import OURS, columns, failed_by_us, scoreboard
from twolink.hardcases.spreading import spread_scoreboard

QUICK = [case for case in CASES if case.group in ("evaluation", "friction")]


@pytest.mark.parametrize("case", QUICK, ids=lambda case: case.name)
def test_this_library_passes_with_every_formulation(case):
    board = scoreboard([case], OURS)
    assert failed_by_us(board) == [], board


@pytest.mark.slow
def test_this_library_passes_every_case_with_every_formulation():
    board = spread_scoreboard(CASES, OURS)
    assert set(board) == {case.name for case in CASES}
    assert failed_by_us(board) == [], [board[name] for name, _ in failed_by_us(board)]


def test_names_are_names_and_every_group_has_cases():
    names = [case.name for case in CASES]
    assert len(set(names)) == len(names)
    assert {case.group for case in CASES} == set(GROUPS)
    assert tuple(column.name for column in OURS) == FORMULATIONS


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_every_record_says_what_why_and_from_where(case):
    page = explained(case)
    for part in ("What is hard", "Expected", "Reference", "Bound"):
        assert f"**{part}.**" in page
    assert min(len(text) for text in (case.hard, case.expected, case.reference, case.bound)) > 10


@pytest.mark.parametrize(
    ("finding", "mark"),
    [
        (Finding(1.0), Mark.PASS),
        (Finding(1.01), Mark.MISSED),
        (Finding(10.1), Mark.SILENT),
        (Finding(10.1, warned=True), Mark.MISSED),
        (Finding(math.inf, finite=False), Mark.MISSED),
        (Finding(math.nan), Mark.MISSED),
    ],
)
def test_marks(finding, mark):
    assert finding.mark is mark


def test_the_command_prints_and_writes_what_became_of_a_case(tmp_path):
    file = tmp_path / "board.json"
    name = QUICK[0].name
    arguments = ["hardcases", "--case", name, "--ours", "--json", str(file)]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0, result.output
    assert name in result.stdout
    assert name in json.dumps(json.loads(file.read_text()))


def test_a_case_is_explained():
    result = CliRunner().invoke(app, ["hardcases", "--explain", QUICK[0].name])
    assert result.exit_code == 0
    assert result.stdout == explained(QUICK[0])


def test_names_that_are_none_are_refused():
    with pytest.raises(ParameterError, match="case is 'zen'; allowed are"):
        case_named("zen")
    with pytest.raises(EngineError, match="engine is 'Ouroboros'; allowed are momenta"):
        columns(["Ouroboros"])
    result = CliRunner().invoke(app, ["hardcases", "--case", "nothing-like-it"])
    assert result.exit_code == 2
    assert "Traceback" not in result.output
