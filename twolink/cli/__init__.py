"""The command `twolink`: words in, words out; the only place that prints. One command a file."""

from __future__ import annotations

import sys
from io import TextIOWrapper

import typer

from twolink.cli.accuracy import accuracy
from twolink.cli.drift import drift
from twolink.cli.hardcases import hardcases
from twolink.cli.plot import plot
from twolink.cli.record import record
from twolink.cli.reference import reference
from twolink.cli.report import report
from twolink.cli.scenes import scenes
from twolink.cli.simulate import simulate
from twolink.cli.verify import verify
from twolink.cli.view import view

app = typer.Typer(
    help="The reference suite for the planar two-link chain (double pendulum).",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)

COMMANDS = (
    report,
    verify,
    simulate,
    accuracy,
    drift,
    hardcases,
    reference,
    plot,
    view,
    record,
    scenes,
)

for command in COMMANDS:
    app.command()(command)


def main() -> None:
    """Run the command line."""
    for stream in (sys.stdout, sys.stderr):
        # A terminal without Greek letters shows question marks, not a traceback.
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="replace")
    app()
