"""TOML from files to tables: in bounded time and memory."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

from twolink.errors import FileError
from twolink.files import check_no_mark, read_bytes

# A key of fifty names with dots between; tomllib takes memory by the square of their number.
_LONG_KEY = re.compile(r"""(?<![\w-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')\s*+\.\s*+){50}""")


def read_text(file: Path, largest: int) -> str:
    """Return the text of a TOML file of at most `largest` bytes.

    Raises `FileError` whose sentence begins with the fault and leaves out the file's name.
    """
    content = read_bytes(file, largest)
    check_no_mark(content)
    try:
        # Line ends as Python reads them from text.
        return content.decode("utf-8").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        raise FileError(f"byte {error.start} is not UTF-8; must be a TOML file in UTF-8") from error


def tables(text: str, kind: str) -> dict[str, Any]:
    """Return the tables of a TOML text of a `kind`, such as "a scene file".

    Raises `FileError` whose sentence leaves out the file's name: for other texts, and for names,
    tables and lists that are nested too deep to be read.
    """
    try:
        if _LONG_KEY.search(text):
            raise RecursionError
        return tomllib.loads(text)
    except RecursionError as error:
        raise FileError(too_deep(kind)) from error
    except ValueError as error:
        # Python's int() refuses thousands of digits with an error that is not TOML's.
        reason = " ".join(str(error).split())
        raise FileError(f"{kind} must be TOML; got another text ({reason})") from error


def too_deep(kind: str) -> str:
    """Return the sentence that rejects tables that are nested deeper than those of a `kind`."""
    return f"tables must not be nested deeper than those of {kind}"
