"""The scoreboard as tables."""

from tests.test_tables import printed
from twolink.engines.marks import Mark
from twolink.hardcases.catalogue import CASES
from twolink.hardcases.record import Column, Outcome
from twolink.hardcases.tables import counts_table, group_table
from twolink.tables import length


def test_every_engine_is_shown_in_80_columns():
    columns = tuple(
        Column(name) for name in ("kane", "MuJoCo", *(f"engine-{n}" for n in range(14)))
    )
    board = {
        case.name: {
            column.name: Outcome(Mark.MISSED, 12.5) if n else Outcome(Mark.PASS)
            for n, column in enumerate(columns)
        }
        for case in CASES
    }
    text = printed(group_table("contact", CASES, columns, board), 80, split=True)
    assert max(length(line.rstrip()) for line in text.splitlines()) <= 80
    cases = sum(case.group == "contact" for case in CASES)
    assert text.count("× 12.5") == cases * 15
    counted = counts_table(columns, board)
    assert counted.rows[0][1].text == str(len(CASES))
