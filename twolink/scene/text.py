"""The text of a scene file, from the file to TOML's tables: in bounded time and memory."""

from __future__ import annotations

import re
import reprlib
import tomllib
from pathlib import Path
from typing import Any

from twolink.errors import SceneError

LARGEST_FILE = 4 * 2**20
"""Bytes of the largest scene file read: a hundred thousand samples of a torque are fewer."""

# How much of a file's name is told.
_SHORT = reprlib.Repr()
_SHORT.maxstring = 100

# A table of effects, a list of tables, one table, a list, a list in it.
_DEEPEST = 10

# A key of fifty names with dots between; tomllib takes memory by the square of their number.
_LONG_KEY = re.compile(r"""(?<![\w-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')\s*+\.\s*+){50}""")


def read_text(file: Path) -> str:
    """Return the text of a file, or raise `SceneError`."""
    try:
        if not file.is_file():
            # Devices and pipes may have no end.
            what = "this is no plain file" if file.exists() else "there is no file of this name"
            raise SceneError(f"{_named(file)}: {what}; allowed is the path of a scene file")
        with file.open("rb") as stream:
            content = stream.read(LARGEST_FILE + 1)
        if len(content) > LARGEST_FILE:
            raise SceneError(
                f"{file}: is larger than {LARGEST_FILE // 2**20} MB; allowed is a smaller file"
            )
        # Line ends as Python reads them from text.
        return content.decode("utf-8").replace("\r\n", "\n")
    except (OSError, ValueError) as error:
        reason = (isinstance(error, OSError) and error.strerror) or error
        raise SceneError(
            f"{_named(file)}: cannot be read ({reason}); allowed is a TOML file in UTF-8"
        ) from error


def _named(file: Path) -> str:
    """Return a file's name for a sentence: as it is, unless it is long or cannot be printed."""
    name = str(file)
    return name if name.isprintable() and len(name) <= 300 else _SHORT.repr(name)


def tables(text: str, source: str) -> dict[str, Any]:
    """Return the tables of a TOML text; `SceneError` names the `source` where it is none."""
    try:
        if _LONG_KEY.search(text):
            raise RecursionError
        found = tomllib.loads(text)
    except RecursionError as error:
        raise SceneError(f"{source}: this is nested too deeply; allowed is a scene file") from error
    except ValueError as error:
        # Python's int() refuses thousands of digits with an error that is not TOML's.
        reason = " ".join(str(error).split())
        raise SceneError(
            f"{source}: this is not TOML ({reason}); allowed is a scene file"
        ) from error
    if _is_deep(found):
        raise SceneError(f"{source}: this is nested too deeply; allowed is a scene file")
    return found


def _is_deep(value: Any) -> bool:
    """Return whether tables and lists are nested deeper than any scene's; without recursion."""
    level = [value]
    for _ in range(_DEEPEST):
        inner = [list(x.values()) if isinstance(x, dict) else x for x in level]
        level = [x for entries in inner for x in entries if isinstance(x, (dict, list))]
        if not level:
            return False
    return True
