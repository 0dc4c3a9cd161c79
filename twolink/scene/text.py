"""The text of a scene file, from the file to TOML's tables: in bounded time and memory."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

from twolink.errors import FileError, SceneError
from twolink.files import check_no_mark, read_bytes
from twolink.text import one_line

LARGEST_FILE = 4 * 2**20
"""Bytes of the largest scene file read: a hundred thousand samples of a torque are fewer."""

# A table of effects, a list of tables, one table, a list, a list in it.
_DEEPEST = 10

# A key of fifty names with dots between; tomllib takes memory by the square of their number.
_LONG_KEY = re.compile(r"""(?<![\w-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')\s*+\.\s*+){50}""")

# The root of a URDF.
_URDF = re.compile(r"<robot[\s>]")
_FOR_A_URDF = (
    "which has no motion: name it in a scene file as urdf in [chain], or use twolink verify --urdf "
    "or twolink urdf show"
)

_TOO_DEEP = "tables must not be nested deeper than those of a scene file"


def read_text(file: Path) -> str:
    """Return the text of a file, or raise `SceneError`."""
    try:
        content = read_bytes(file, LARGEST_FILE)
        check_no_mark(content)
        # Line ends as Python reads them from text.
        return content.decode("utf-8").replace("\r\n", "\n")
    except FileError as error:
        raise SceneError(f"{one_line(file, 300)}: {error}") from error
    except UnicodeDecodeError as error:
        raise SceneError(
            f"{one_line(file, 300)}: byte {error.start} is not UTF-8; must be a TOML file in UTF-8"
        ) from error


def tables(text: str, source: str) -> dict[str, Any]:
    """Return the tables of a TOML text; `SceneError` names the `source` where it is none."""
    try:
        if _LONG_KEY.search(text):
            raise RecursionError
        found = tomllib.loads(text)
    except RecursionError as error:
        raise SceneError(f"{source}: {_TOO_DEEP}") from error
    except ValueError as error:
        if _URDF.search(text):
            raise SceneError(
                f"{source}: a scene file must be TOML; got a URDF, {_FOR_A_URDF}"
            ) from (error)
        # Python's int() refuses thousands of digits with an error that is not TOML's.
        reason = " ".join(str(error).split())
        raise SceneError(
            f"{source}: a scene file must be TOML; got another text ({reason})"
        ) from error
    return found


def check_tables(table: Any, source: str) -> None:
    """Raise `SceneError` unless it is a table, nested no deeper than a scene."""
    if not isinstance(table, dict):
        raise SceneError(f"{source}: a scene must be a dict; got {type(table).__name__}")
    if _is_deep(table):
        raise SceneError(f"{source}: {_TOO_DEEP}")


def _is_deep(value: Any) -> bool:
    """Return whether tables and lists are nested deeper than any scene's; without recursion."""
    level = [value]
    for _ in range(_DEEPEST):
        inner = [list(x.values()) if isinstance(x, dict) else x for x in level]
        level = [x for entries in inner for x in entries if isinstance(x, (dict, list))]
        if not level:
            return False
    return True
