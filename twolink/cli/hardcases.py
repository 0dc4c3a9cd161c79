"""The command `twolink hardcases`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from twolink.cli.options import check_unused
from twolink.cli.progress import progress_bar
from twolink.cli.terminal import (
    FAILED,
    WIDE,
    check_target,
    console,
    print_table,
    refuse,
    write_json,
)
from twolink.names import EQUATIONS_NAMES

if TYPE_CHECKING:
    from twolink.hardcases import Case, Column, Outcome

# Columns of letters that all engines' columns take, side by side.
_WIDE = 124

_FAIR = (
    "External engines run with their best method at a fine setting; their bound is 1e-6 or the "
    "growth of their tolerance; --json saves their messages and calls."
)

_Case = Annotated[
    list[str] | None,
    typer.Option("--case", metavar="NAME", help="Run only this case. May be repeated."),
]
_Engine = Annotated[
    list[str] | None,
    typer.Option(
        "--engine",
        metavar="NAME",
        help=f"Run only this column: {', '.join(EQUATIONS_NAMES)}, or an engine by the beginning "
        "of its name. May be repeated. Default: all that are installed.",
    ),
]
_Ours = Annotated[bool, typer.Option("--ours", help="Only the columns of this library.")]
_Explain = Annotated[
    str | None,
    typer.Option(
        "--explain", help="Print a description of this case alone, in Markdown; or 'all'."
    ),
]
_JsonFile = Annotated[
    Path | None, typer.Option("--json", help="Write the scoreboard to this file as JSON.")
]


def hardcases(
    context: typer.Context,
    case: _Case = None,
    engine: _Engine = None,
    ours: _Ours = False,
    explain: _Explain = None,
    json_file: _JsonFile = None,
) -> None:
    """Run the hard cases on this library and on external engines.

    Rows are cases, columns are engines. Exit code 0: this library passes all. 1: it does not.
    2: the input was refused.
    """
    check_target("--json", json_file)
    from twolink.hardcases.catalogue import CASES, case_named, explained
    from twolink.hardcases.run import OURS, columns, document, failed_by_us

    if explain is not None:
        check_unused(context, "--explain", "case", "engine", "ours", "json_file")
        chosen = CASES if explain == "all" else (case_named(explain),)
        page = console()
        for one in chosen:
            page.print(explained(one), soft_wrap=True)
        return
    if ours and engine:
        refuse("both --ours and --engine are given; must be one of them")
    cases = CASES if case is None else tuple(case_named(name) for name in case)
    chosen_columns = OURS if ours else columns(engine)
    board = _run(cases, chosen_columns)
    _print_board(cases, chosen_columns, board)
    if json_file is not None:
        write_json(json_file, document(board, cases))
    if failed_by_us(board):
        raise typer.Exit(FAILED)


def _run(cases: tuple[Case, ...], chosen: tuple[Column, ...]) -> dict[str, dict[str, Outcome]]:
    """Run all cases under a progress bar that names the running ones."""
    from twolink.hardcases.parallel import parallel_scoreboard
    from twolink.hardcases.run import scoreboard

    with progress_bar() as bar:
        task = bar.add_task("hard cases", total=len(cases))

        def update(done: int, running: tuple[str, ...]) -> None:
            bar.update(task, description=", ".join(running), completed=done)

        if len(cases) > 1:
            return parallel_scoreboard(cases, chosen, update)
        update(0, (cases[0].name,))
        return scoreboard(cases, chosen)


def _print_board(
    cases: tuple[Case, ...], chosen: tuple[Column, ...], board: dict[str, dict[str, Outcome]]
) -> None:
    """Print the scoreboard, and why this library fails where it does."""
    from twolink.engines.marks import Mark
    from twolink.hardcases.run import OURS, counts, failed_by_us, verdict
    from twolink.hardcases.tables import group_table

    page = console(_WIDE if len(chosen) > len(OURS) else WIDE)
    for group in dict.fromkeys(one.group for one in cases):
        print_table(page, group_table(group, cases, chosen, board), split=True)
    met = {found.mark for row in board.values() for found in row.values()}
    for mark in (mark for mark in Mark if mark in met):
        page.print(f"{mark.short}: {mark.means}", style="dim", soft_wrap=True)
    if len(chosen) > len(OURS):
        page.print(_FAIR, style="dim", soft_wrap=True)
    page.print()
    for column in chosen:
        totals = (f"{count} {mark.value}" for mark, count in counts(board, column.name).items())
        page.print(f"{column.name}: {', '.join(totals)}", soft_wrap=True)
    for name, formulation in failed_by_us(board):
        failed = board[name][formulation]
        page.print(
            f"{name}, {formulation}: {failed.words}; {failed.said}",
            style="bold red",
            soft_wrap=True,
        )
    passed, sentence = verdict(board)
    page.print(f"\n{sentence}", style="bold green" if passed else "bold red", soft_wrap=True)
