"""The command `twolink`: words in, words out; the only place that prints. One command a file."""

from __future__ import annotations

import os
import signal
import sys
from io import TextIOWrapper
from typing import Annotated, Any

import typer

from twolink.cli.accuracy import accuracy
from twolink.cli.conform import conform
from twolink.cli.drift import drift
from twolink.cli.golden import golden
from twolink.cli.hardcases import hardcases
from twolink.cli.harness import harness
from twolink.cli.plot import plot
from twolink.cli.program import Program
from twolink.cli.record import record
from twolink.cli.reference import reference
from twolink.cli.report import report
from twolink.cli.scenes import scenes
from twolink.cli.scoreboard import scoreboard
from twolink.cli.sensitivity import sensitivity
from twolink.cli.simulate import simulate
from twolink.cli.sweep import sweep
from twolink.cli.terminal import FAILED, say, warn
from twolink.cli.urdf import app as urdf
from twolink.cli.verify import verify
from twolink.cli.view import view
from twolink.files import remove_interrupted
from twolink.interruptible import end_process

app = typer.Typer(
    cls=Program,
    help="The reference suite for the planar two-link chain (double pendulum).",
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)

COMMANDS = (
    report,
    verify,
    conform,
    harness,
    golden,
    scoreboard,
    simulate,
    sweep,
    sensitivity,
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
app.add_typer(urdf, name="urdf")


def _print_version(asked: bool) -> None:
    if asked:
        from importlib.metadata import version

        say(f"twolink {version('twolink')}")
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version, and exit."
        ),
    ] = False,
) -> None:
    """Take the options of the program itself."""


def main() -> None:
    """Run the command line, and end the process."""
    code = _exit_code()
    # A command that runs inside another program leaves this to the end of that program.
    remove_interrupted()
    end_process(code)


def _exit_code() -> Any:
    """Run the command line; return its exit code."""
    try:
        _run()
    except KeyboardInterrupt:
        # Before a command has begun; `Program` handles later interrupts.
        return 128 + signal.SIGINT
    except SystemExit as end:
        return end.code
    return 0


def _run() -> None:
    closed = _open_closed_streams()
    for stream in (sys.stdout, sys.stderr):
        # A terminal without Greek letters shows question marks, not a traceback.
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="replace")
    if "stdout" in closed:
        warn("twolink: the standard output is closed")
        sys.exit(FAILED)
    app()


def _open_closed_streams() -> list[str]:
    """Connect closed streams to os.devnull, so that no file opened later takes their place."""
    closed = [name for name in ("stdin", "stdout", "stderr") if getattr(sys, name) is None]
    for name in closed:
        stream = open(os.devnull, "r" if name == "stdin" else "w", encoding="utf-8")  # noqa: SIM115
        setattr(sys, name, stream)
    return closed
