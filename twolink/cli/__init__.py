"""The command `twolink`: words in, words out; the only place that prints. One command a file."""

from __future__ import annotations

import functools
import importlib
import os
import signal
import sys
import warnings
from typing import Annotated, Any

import typer

from twolink.cli.importing import begin_command, own_process
from twolink.cli.plain_signs import use_plain_signs
from twolink.cli.program import Program
from twolink.cli.terminal import FAILED, say, warn
from twolink.files import remove_interrupted
from twolink.interruptible import end_process

COMMANDS = (
    "report",
    "verify",
    "conform",
    "harness",
    "golden",
    "scoreboard",
    "simulate",
    "sweep",
    "sensitivity",
    "accuracy",
    "drift",
    "hardcases",
    "reference",
    "plot",
    "view",
    "record",
    "scenes",
)
"""The commands: each is a function in the module of its name."""

GROUPS = ("urdf",)
"""The groups of commands: each is an `app` in the module of its name."""


@functools.cache
def app_of(names: tuple[str, ...] = (*COMMANDS, *GROUPS)) -> typer.Typer:
    """Return the program with some of its commands; no other one is imported."""
    made = typer.Typer(
        cls=Program,
        help="The reference suite for the planar two-link chain (double pendulum).",
        add_completion=False,
        rich_markup_mode=None,
        pretty_exceptions_enable=False,
    )
    made.callback()(_options)
    for name in names:
        module = importlib.import_module(f"twolink.cli.{name}")
        if name in GROUPS:
            made.add_typer(module.app, name=name)
        else:
            made.command()(getattr(module, name))
    return made


def __getattr__(name: str) -> Any:
    """Return the whole program, `app`, when it is asked for."""
    if name == "app":
        return app_of()
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def _print_version(asked: bool) -> None:
    if asked:
        from importlib.metadata import version

        say(f"twolink {version('twolink')}")
        raise typer.Exit


def _options(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version, and exit."
        ),
    ] = False,
) -> None:
    """Take the options of the program itself; a command follows."""
    begin_command()


def main() -> None:
    """Run the command line, and end the process."""
    with own_process():
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
    use_plain_signs()
    # Numbers near the limits of float64 overflow on the way; results are looked at, and refused.
    warnings.filterwarnings("ignore", r".* encountered in ", RuntimeWarning)
    if "stdout" in closed:
        warn("twolink: the standard output is closed")
        sys.exit(FAILED)
    first = sys.argv[1:2]
    # One command needs no other; the help, the version and a wrong word import all.
    known = first and first[0] in (*COMMANDS, *GROUPS)
    (app_of(tuple(first)) if known else app_of())()


def _open_closed_streams() -> list[str]:
    """Connect closed streams to os.devnull, so that no file opened later takes their place."""
    closed = [name for name in ("stdin", "stdout", "stderr") if getattr(sys, name) is None]
    for name in closed:
        stream = open(os.devnull, "r" if name == "stdin" else "w", encoding="utf-8")  # noqa: SIM115
        setattr(sys, name, stream)
    return closed
