"""The scoreboard's tables: cells, their tones, and results without a table."""

import pytest

from tests.conformance.board import RIGHT, WRONG, result, verdict_file
from twolink.conformance.scoreboard import read_scoreboard
from twolink.conformance.scoreboard_tables import (
    failures,
    motion_table,
    settings_table,
    suite_table,
    summary_table,
)
from twolink.engines.marks import Mark
from twolink.tables import Tone


@pytest.fixture
def board(tmp_path):
    return read_scoreboard([verdict_file(tmp_path), verdict_file(tmp_path, "wrong", WRONG)])


def texts(table):
    return [[cell.text for cell in row] for row in table.rows]


def tones(table):
    return [[cell.tone for cell in row] for row in table.rows]


def test_the_summary_has_passed_tests_and_the_worst_digits(board):
    found = summary_table(board)
    assert [column.name for column in found.columns][3:] == [
        "all",
        "import",
        "evaluation",
        "motion",
    ]
    assert texts(found) == [
        ["right", "1.0", "binary64", "4/4\n14.2", "2/2\n15.5", "1/1\n14.2", "1/1"],
        ["wrong", "1.0", "binary64", "0/3\n0.0", "0/1", "0/2\n0.0", "–"],
    ]
    assert found.rows[1][0].link == "#engine-2"


def test_refused_and_silently_wrong_cells_have_different_tones(board):
    right, wrong = tones(summary_table(board))
    assert set(right[3:]) == {Tone.GOOD}
    assert wrong[3:] == [Tone.BAD, Tone.WARN, Tone.BAD, Tone.SOFT]


def test_a_suite_has_a_column_for_each_quantity(board):
    found = suite_table(board, "import")
    assert [column.name for column in found.columns] == ["engine", "read", "mass\nmatrix"]
    assert texts(found) == [["right", "1/1", "1/1\n15.5"], ["wrong", "0/1", "–"]]
    assert suite_table(board, "motion") is None


def test_engines_without_tests_in_a_suite_have_no_row(tmp_path):
    reads = [verdict_file(tmp_path), verdict_file(tmp_path, "other", RIGHT[2:3])]
    found = suite_table(read_scoreboard(reads), "import")
    assert [row[0] for row in texts(found)] == ["right"]


def test_a_method_without_motions_has_its_mark(tmp_path):
    refused = result("motion/general/motion/rk4", Mark.REFUSED, quantity="motion: rk4")
    found = motion_table(read_scoreboard([verdict_file(tmp_path, "a", [refused])]))
    assert texts(found) == [["a", "rk4", "refused"]]
    assert found.rows[0][2].tone is Tone.WARN


def test_motions_have_a_row_for_each_method(board):
    found = motion_table(board)
    assert [column.name for column in found.columns] == ["engine", "method", "general"]
    assert texts(found) == [["right", "rk4", "truth\n6.0e-05"]]
    assert found.rows[0][2].tone is Tone.GOOD


def test_a_board_without_motions_has_no_table_of_them(tmp_path):
    assert motion_table(read_scoreboard([verdict_file(tmp_path, "a", RIGHT[:3])])) is None


def test_settings_are_named(board):
    assert texts(settings_table(board))[0] == [
        "right 1.0",
        "cmd: right",
        "urdf",
        "–",
        "rk4 (step, order 4)",
        "60 s, 2 GB",
    ]


def test_failures_of_one_reason_stand_together(tmp_path):
    more = result("evaluation/damped/mass-matrix", Mark.SILENT, digits=2.0, factor=2e8, said="far")
    board = read_scoreboard([verdict_file(tmp_path, "wrong", (*WRONG, more))])
    found = {reason: [r.id for r in each] for reason, each in failures(board.entries[0]).items()}
    assert found == {
        "silently wrong: the values are wrong, for a reason that is not known": [
            "evaluation/general/mass-matrix",
            "evaluation/damped/mass-matrix",
        ],
        "refused: no <b>axis</b>": ["import/plain/read"],
        "silently wrong: gravity acts in the opposite direction": ["evaluation/bars/mass-matrix"],
    }
