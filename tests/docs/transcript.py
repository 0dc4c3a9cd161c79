"""Pages as scripts: run every code block of a page in order, and compare its output.

- `console`: each line after `$ ` is a command for the shell, the lines below it are its output.
- `python`: executed, in one namespace for all blocks of a page.
- A block of any language whose first line is a comment with a file name, such as `# wind.py`, is
  written to this file. `# wind.py; run by: COMMAND` runs the command, too.
- `text` right below a Python block or a file with a command is its output.

A line `…` stands for any number of lines.
"""

from __future__ import annotations

import contextlib
import io
import math
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).parent.parent.parent

_FENCE = re.compile(r"^```(\{?[\w-]*\}?)[^\n]*\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_FILE = re.compile(r"^(?:#|//) ([\w.-]+\.\w+)(?:; run by: (.+))?$")
_UV = re.compile(r"\buv run (?:--(?:extra|group) \w+ )*")
_NUMBER = re.compile(r"[-+−]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
# Parts of the output that differ from run to run and between machines: times, sizes of files, units
# in the last place, and numbers of steps, which vector instructions may change by one.
_VARIES = re.compile(
    r"\d[\d.e+-]* (?:ms|µs|ns|kB|MB|min)\b"
    r"|<?\d[\d.]*/\d+\b"
    r"|\d+ kept\b"
    r"|× ?\d[\d.]*"
    r"|\d[\d.]*% of its tolerance \([^)]*\)"
)

# Numbers agree to this relative difference, and those below the second size are errors.
_CLOSE, _ROUNDING = 1e-6, 1e-5


class Block(NamedTuple):
    """A code block: its language, the line that it begins on, and its text."""

    language: str
    line: int
    text: str


class Output(NamedTuple):
    """A command or a block, the output that the page shows, and its actual output."""

    line: int
    source: str
    shown: list[str]
    printed: list[str]

    @property
    def agrees(self) -> bool:
        """Whether the output is that of the page."""
        return agree(self.shown, self.printed)


def blocks(page: str) -> list[Block]:
    """Return the code blocks of a page, without directives."""
    found = (
        Block(match[1], page.count("\n", 0, match.start()) + 1, match[2])
        for match in _FENCE.finditer(page)
    )
    return [block for block in found if not block.language.startswith("{")]


def follow(page: str, folder: Path) -> Iterator[Output]:
    """Run the blocks of a page in a folder, the current one, and yield each output."""
    namespace: dict[str, Any] = {"__name__": "page"}
    every = blocks(page)
    for number, block in enumerate(every):
        below = every[number + 1] if number + 1 < len(every) else None
        shown = below.text.splitlines() if below and _touch(page, block, below) else []
        named = _FILE.match(block.text.partition("\n")[0])
        if named and block.language != "console":
            (folder / named[1]).write_text(block.text, encoding="utf-8")
            if named[2]:
                yield Output(block.line, named[2], shown, _shell(named[2], folder))
        elif block.language == "console":
            for command, expected in commands(block.text):
                yield Output(block.line, command, expected, _shell(command, folder))
        elif block.language == "python":
            yield Output(block.line, block.text, shown, _python(block.text, namespace))


def commands(console: str) -> list[tuple[str, list[str]]]:
    """Return the commands of a console block, each with the lines below it."""
    found: list[tuple[str, list[str]]] = []
    for line in console.splitlines():
        if line.startswith("$ "):
            found.append((line.removeprefix("$ "), []))
        else:
            found[-1][1].append(line)
    return found


def agree(shown: list[str], printed: list[str]) -> bool:
    """Return whether lines are those that a page shows, whose `…` stand for any lines."""
    shown, printed = _words(shown), _words(printed)
    parts: list[list[str]] = [[]]
    for line in shown:
        if line == "…":
            parts.append([])
        else:
            parts[-1].append(line)
    return _match(parts, printed)


def _match(parts: list[list[str]], printed: list[str]) -> bool:
    """Return whether the first part begins the lines, the last ends them, others are between."""
    first, *rest = parts
    if not _same(first, printed[: len(first)]):
        return False
    printed = printed[len(first) :]
    if not rest:
        return not printed
    for part in rest[:-1]:
        places = range(len(printed) - len(part) + 1)
        at = next((i for i in places if _same(part, printed[i : i + len(part)])), None)
        if at is None:
            return False
        printed = printed[at + len(part) :]
    last = rest[-1]
    return len(last) <= len(printed) and _same(last, printed[len(printed) - len(last) :])


def _same(shown: list[str], printed: list[str]) -> bool:
    return len(shown) == len(printed) and all(map(_same_line, shown, printed))


def _same_line(shown: str, printed: str) -> bool:
    shown, printed = _VARIES.sub("…", shown), _VARIES.sub("…", printed)
    if _NUMBER.sub("#", shown) != _NUMBER.sub("#", printed):
        return False
    return all(map(_same_number, _NUMBER.findall(shown), _NUMBER.findall(printed)))


def _same_number(shown: str, printed: str) -> bool:
    first, second = (float(text.replace("−", "-")) for text in (shown, printed))
    return math.isclose(first, second, rel_tol=_CLOSE) or max(abs(first), abs(second)) < _ROUNDING


def _words(lines: list[str]) -> list[str]:
    """Return lines with single spaces, without empty ones."""
    return [" ".join(line.split()) for line in lines if line.split()]


def _touch(page: str, block: Block, below: Block) -> bool:
    """Return whether a block of text is right below another block."""
    first = block.line + block.text.count("\n") + 1
    between = page.splitlines()[first : below.line - 1]
    return below.language == "text" and not "".join(between).strip()


def _python(code: str, namespace: dict[str, Any]) -> list[str]:
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(code, "page", "exec"), namespace)
    return printed.getvalue().splitlines()


def _shell(command: str, folder: Path) -> list[str]:
    """Run a command as in a terminal, and return its lines. Raises an error if it fails."""
    environment = {
        **os.environ,
        "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
        "PYTHONPATH": f"{ROOT}{os.pathsep}{folder}",
    }
    done = subprocess.run(
        _UV.sub("", command),
        shell=True,
        cwd=folder,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    if done.returncode:
        raise AssertionError(f"{command}: exit code {done.returncode}\n{done.stdout}")
    return done.stdout.splitlines()
