"""What every command shares: refusals, exit codes, tables' widths, files written whole."""

from __future__ import annotations

import json
import math
import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import typer

from twolink.files import written_whole

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress

FAILED, BAD_INPUT = 1, 2

# Columns that the widest table needs; so wide is the output to files, too.
WIDE = 104


def refuse(sentence: str) -> NoReturn:
    """Say in one sentence what was received and what is allowed, and end with exit code 2."""
    typer.echo(f"twolink: {sentence}", err=True)
    raise typer.Exit(BAD_INPUT)


def fail(sentence: str) -> NoReturn:
    """Print in one sentence why a command that was called rightly failed, and exit with code 1."""
    typer.echo(f"twolink: {sentence}", err=True)
    raise typer.Exit(FAILED)


def check_target(option: str, path: Path | None, suffixes: tuple[str, ...] = ()) -> None:
    """Refuse a file that could not be written in the end, before any work is done."""
    if path is None:
        return
    kind = f"a {' or '.join(suffixes)} file" if suffixes else "a file"
    wrong_kind = bool(suffixes) and path.suffix not in suffixes
    if wrong_kind or path.is_dir() or not os.access(path.parent, os.W_OK):
        refuse(f"{option} is {path}; allowed is {kind} in a folder that can be written to")


def check_folder(option: str, path: Path | None) -> None:
    """Refuse a folder that could not be written to in the end, before any work is done."""
    if path is None:
        return
    nearest = next(place for place in (path, *path.absolute().parents) if place.exists())
    if not nearest.is_dir() or not os.access(nearest, os.W_OK):
        refuse(f"{option} is {path}; allowed is a folder that can be written to or made")


def console(wide: int = WIDE) -> Console:
    """Return where tables go: as wide as the terminal is, or as `wide` as the widest table."""
    from rich.console import Console

    return Console(width=None if sys.stdout.isatty() else wide, highlight=False)


@contextmanager
def progress_bar() -> Iterator[Progress]:
    """Show a bar on the terminal, if there is one, and leave nothing of it behind."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    errors = Console(stderr=True)
    # Without a terminal an empty line would be left.
    nobody = not errors.is_terminal
    with Progress(*columns, console=errors, transient=True, disable=nobody) as bar:
        yield bar


@contextmanager
def ended_by_signals() -> Iterator[None]:
    """Let SIGTERM end the work within as Ctrl-C does: with everything put away."""

    def end(number: int, frame: object) -> None:
        raise SystemExit(128 + number)

    before = signal.signal(signal.SIGTERM, end)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def write_json(path: Path, document: Any) -> None:
    """Write a document whole or not at all; NaN and infinities become words."""
    text = json.dumps(_as_json(document), indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    with written_whole(path) as file:
        file.write_text(text, encoding="utf-8")


def _as_json(value: Any) -> Any:
    """Return a value with NaN and infinities as words, since JSON has no numbers for them."""
    if isinstance(value, dict):
        return {key: _as_json(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_as_json(entry) for entry in value]
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value
