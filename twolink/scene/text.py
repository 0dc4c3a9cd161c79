"""The text of a scene file, from the file to TOML's tables: in bounded time and memory."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from twolink import toml
from twolink.errors import FileError, SceneError
from twolink.text import one_line

LARGEST_FILE = 4 * 2**20
"""Bytes of the largest scene file read: a hundred thousand samples of a torque are fewer."""

# A table of effects, a list of tables, one table, a list, a list in it.
_DEEPEST = 10

# The root of a URDF.
_URDF = re.compile(r"<robot[\s>]")
_FOR_A_URDF = (
    "which has no motion: name it in a scene file as urdf in [chain], or use twolink verify --urdf "
    "or twolink urdf show"
)


def read_text(file: Path) -> str:
    """Return the text of a file, or raise `SceneError`."""
    try:
        return toml.read_text(file, LARGEST_FILE)
    except FileError as error:
        raise SceneError(f"{one_line(file, 300)}: {error}") from error


def tables(text: str, source: str, kind: str = "scene") -> dict[str, Any]:
    """Return the tables of a TOML text; `SceneError` names the `source` where it is none.

    The `kind` of file, a scene or a sweep, is named in messages.
    """
    # No TOML begins so.
    if text.lstrip().startswith("<") and _URDF.search(text):
        raise SceneError(f"{source}: a {kind} file must be TOML; got a URDF, {_FOR_A_URDF}")
    try:
        return toml.tables(text, f"a {kind} file")
    except FileError as error:
        raise SceneError(f"{source}: {error}") from error


def check_tables(table: Any, source: str, kind: str = "scene") -> None:
    """Raise `SceneError` unless it is a table, nested no deeper than a scene or a sweep."""
    if not isinstance(table, dict):
        raise SceneError(f"{source}: a {kind} must be a dict; got {type(table).__name__}")
    if _is_deep(table):
        raise SceneError(f"{source}: {toml.too_deep(f'a {kind} file')}")


def _is_deep(value: Any) -> bool:
    """Return whether tables and lists are nested deeper than any scene's; without recursion."""
    level = [value]
    for _ in range(_DEEPEST):
        inner = [list(x.values()) if isinstance(x, dict) else x for x in level]
        level = [x for entries in inner for x in entries if isinstance(x, (dict, list))]
        if not level:
            return False
    return True
