"""The command `twolink scoreboard`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from twolink.cli.terminal import check_folder, console, print_table, say, write_json
from twolink.files import new_folder

if TYPE_CHECKING:
    from twolink.conformance.scoreboard import Scoreboard

_PAGE, _DOCUMENT = "index.html", "scoreboard.json"


def scoreboard(
    verdicts: Annotated[
        list[Path], typer.Argument(metavar="VERDICT", help="Files of twolink conform --json.")
    ],
    out: Annotated[
        Path, typer.Option(help="The folder for index.html and scoreboard.json.")
    ] = Path("scoreboard"),
) -> None:
    """Merge the verdicts on many engines into one page.

    The page and a JSON document have marks, correct digits, versions, settings and causes. Exit
    code 0: written. 2: a file was refused.
    """
    check_folder("--out", out, names=[_PAGE, _DOCUMENT], inputs=verdicts)
    from twolink.conformance.scoreboard import read_scoreboard
    from twolink.conformance.scoreboard_tables import summary_table

    board = read_scoreboard(verdicts)
    _write(board, out)
    print_table(console(), summary_table(board), split=True)
    say(out / _PAGE)


def _write(board: Scoreboard, out: Path) -> None:
    from twolink.conformance.scoreboard import document
    from twolink.viz.report.conformance import scoreboard_page
    from twolink.viz.report.page import write

    command = " ".join(["twolink", *sys.argv[1:]])
    page = scoreboard_page(board, command)
    with new_folder(out):
        write(out / _PAGE, page)
        write_json(out / _DOCUMENT, document(board))
