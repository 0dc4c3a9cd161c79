"""Terminal output, refusals, output targets and JSON of every command."""

from __future__ import annotations

import errno
import json
import math
import os
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import typer

from twolink import files
from twolink.errors import FileError, TwolinkError
from twolink.files import atomic_write, check_writable, is_same_file
from twolink.tables import Table, Tone
from twolink.text import one_line, printable

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions, RenderableType
    from rich.segment import Segment
    from rich.text import Text

FAILED, BAD_INPUT = 1, 2

# Columns that the widest table needs; so wide is the output to files, too.
WIDE = 104


def say(text: object, *, end: str = "\n") -> None:
    """Write text to the standard output, with escapes in place of control characters.

    Raises `FileError` where it cannot be written.
    """
    with _to_stdout():
        # Typer would write UTF-8 to a stream whose encoding is ASCII.
        print(printable(text), end=end, flush=True)


def warn(text: object) -> None:
    """Write one line to the standard error; where it is closed or full nothing can be said."""
    with suppress(OSError, ValueError):
        print(one_line(text, 2000), file=sys.stderr, flush=True)


def refuse(sentence: str) -> NoReturn:
    """Print the reason for a refused input in one sentence, and end with exit code 2."""
    warn(f"twolink: {one_line(sentence)}")
    raise typer.Exit(BAD_INPUT)


def fail(sentence: str) -> NoReturn:
    """Print the reason for the failure of a valid command in one sentence; end with exit code 1."""
    warn(f"twolink: {one_line(sentence)}")
    raise typer.Exit(FAILED)


@contextmanager
def _to_stdout() -> Iterator[None]:
    """Raise `FileError` where the standard output is closed or full."""
    try:
        yield
    except (OSError, ValueError) as error:
        reason = (isinstance(error, OSError) and error.strerror) or error
        raise FileError(f"the standard output cannot be written to ({reason})") from error


def flush() -> None:
    """Write out all that was printed; raises `FileError` where that is not possible."""
    with _to_stdout():
        sys.stdout.flush()


def check_target(
    option: str,
    path: Path | None,
    suffixes: tuple[str, ...] = (),
    *,
    inputs: Sequence[Path | None] = (),
    targets: Sequence[Path] = (),
) -> None:
    """Refuse a file that could not be written in the end, before any work is done.

    `inputs` are the files that the command reads, which it must not replace. `targets` are the
    files that it writes, where their names are derived from the path.
    """
    if path is None:
        return
    kind = f"a {' or '.join(suffixes)} file" if suffixes else "a file"
    if suffixes and path.suffix not in suffixes:
        refuse(f"{option} must be {kind}; got {one_line(path, 300)}")
    try:
        for target in targets or [path]:
            check_writable(target)
    except FileError as error:
        refuse(f"{option}: {error}")
    _check_no_input(option, path, targets or [path], inputs)


def check_folder(
    option: str,
    path: Path | None,
    *,
    names: Sequence[str] = (),
    inputs: Sequence[Path] = (),
) -> None:
    """Refuse a folder that could not be written to in the end, before any work is done.

    `names` are the files that the command writes in it, and `inputs` those that it reads, which it
    must not replace.
    """
    if path is None:
        return
    try:
        files.check_folder(path)
    except FileError:
        refuse(
            f"{option} must be a folder that can be written to or made; got {one_line(path, 300)}"
        )
    _check_no_input(option, path, [path / name for name in names], inputs)


def _check_no_input(
    option: str, path: Path, targets: Sequence[Path], inputs: Sequence[Path | None]
) -> None:
    """Refuse to replace a file that the command reads, also where a link leads to it.

    The files that a scene or a sweep names are read, too.
    """
    # Almost always nothing is replaced, and no input must be read for that.
    there = [target for target in targets if os.path.exists(target)]
    given = [file for file in inputs if there and file is not None]
    named = [other for file in given for other in _named_in(file)]
    for read in (*given, *named):
        if any(is_same_file(target, read) for target in there):
            name, got = one_line(read, 200), one_line(path, 200)
            refuse(f"{option} must not replace the input {name}; got {got}")


def _named_in(read: Path) -> tuple[Path, ...]:
    """Return the files that a scene or a sweep names, if it is one that can be read."""
    from twolink.scene.names import files_named_in, scene_file

    try:
        return files_named_in(scene_file(read))
    except TwolinkError:
        return ()


RENDERING = ("rich.console", "rich.table")
"""The modules that print tables, imported when there is something to print."""


def console(wide: int = WIDE) -> Console:
    """Return the console for tables: as wide as the terminal, or as `wide` as the widest table.

    It prints strings as they are: markup and names of emojis are not interpreted, and control
    characters are escaped. With `soft_wrap` a terminal gets lines that end between words,
    and a file whole lines.
    """
    return _page(width=None if sys.stdout.isatty() else wide)


def error_page() -> Console:
    """Return a console on the standard error."""
    return _page(stderr=True)


def _page(**options: Any) -> Console:
    from rich.console import Console
    from rich.segment import Segment

    class Page(Console):
        """A console that prints all text as it is."""

        def render_str(self, text: str, **how: Any) -> Text:
            return super().render_str(printable(text), **how)

        def render(
            self, renderable: RenderableType, options: ConsoleOptions | None = None
        ) -> Iterable[Segment]:
            for segment in super().render(renderable, options):
                if segment.control:
                    yield segment
                else:
                    yield Segment(printable(segment.text), segment.style)

        def print(self, *objects: Any, **how: Any) -> None:
            if self.is_terminal:
                # It would break long lines inside words.
                how["soft_wrap"] = False
            with _to_stdout():
                super().print(*objects, **how)

        def on_broken_pipe(self) -> None:
            raise BrokenPipeError(errno.EPIPE, os.strerror(errno.EPIPE))

    return Page(highlight=False, markup=False, emoji=False, **options)


_STYLES = {
    Tone.GOOD: "green",
    Tone.BAD: "bold red",
    Tone.WARN: "yellow",
    Tone.SOFT: "dim",
}


def print_table(page: Console, table: Table, *, split: bool = False) -> None:
    """Print a table that fits the page, without spare columns where it is too narrow.

    With `split` all columns are printed, in several tables. Numbers are never broken or cut: a page
    that is narrower still is exceeded.
    """
    for part in table.parts(page.width) if split else (table.within(page.width),):
        page.print(_in_rich(part, page.width), crop=False)


def _in_rich(table: Table, width: int) -> RenderableType:
    from rich import box
    from rich.table import Table as RichTable

    widths = table.widths(width)
    made = RichTable(
        title=table.title or None,
        title_justify="left",
        title_style="bold",
        box=box.SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
        pad_edge=False,
        show_header=any(column.name for column in table.columns),
        width=table.width_with(widths),
    )
    for column, wide in zip(table.columns, widths, strict=True):
        made.add_column(column.name, justify="right" if column.number else "left", width=wide)
    for row in table.rows:
        made.add_row(*(styled((cell.text, _STYLES.get(cell.tone, ""))) for cell in row))
    return made


def styled(*parts: str | tuple[str, str]) -> Text:
    """Return text of parts, each plain or with its style."""
    from rich.text import Text

    pairs = ((part, "") if isinstance(part, str) else part for part in parts)
    return Text.assemble(*((printable(words), style) for words, style in pairs))


def write_json(path: Path, document: Any) -> None:
    """Write a document whole or not at all; NaN and infinities become words."""
    text = json.dumps(as_json(document), indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    with atomic_write(path) as file:
        # Of a file name that is not UTF-8, an escape is left.
        file.write_text(text, encoding="utf-8", errors="backslashreplace")


def as_json(value: Any) -> Any:
    """Return a value with NaN and infinities as words, since JSON has no numbers for them."""
    if isinstance(value, dict):
        return {key: as_json(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [as_json(entry) for entry in value]
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value
