"""Docstrings, which are plain text with `code` in backticks, as reStructuredText."""

from __future__ import annotations

import re
from typing import Any

from sphinx.application import Sphinx

# Text in backticks stays; a single one before it would change its role.
_CODE = re.compile(r"(``.*?``|`[^`]*`)")
_MARKUP = re.compile(r"([\\*|]|(?<=\w)_(?=\W|$))")


def escaped(text: str) -> str:
    """Return a docstring with its signs of markup outside of backticks escaped."""
    parts = _CODE.split(text.replace("**i**", "i").replace("**j**", "j"))
    return "".join(
        # Code in single backticks may end in a backslash or underscore, and touch letters.
        f"{_space(parts, number)}``{part.strip('`')}``{_after(parts, number)}"
        if number % 2
        else _MARKUP.sub(r"\\\1", part)
        for number, part in enumerate(parts)
    )


def _space(parts: list[str], number: int) -> str:
    before = parts[number - 1]
    return "\\ " if before and re.match(r"\w", before[-1]) else ""


def _after(parts: list[str], number: int) -> str:
    after = parts[number + 1]
    return "\\ " if after and re.match(r"\w", after[0]) else ""


def _as_restructured_text(
    app: Sphinx, what: str, name: str, obj: Any, options: Any, lines: list[str]
) -> None:
    lines[:] = escaped("\n".join(lines)).splitlines()


def setup(app: Sphinx) -> dict[str, Any]:
    """Convert every docstring that autodoc reads."""
    app.connect("autodoc-process-docstring", _as_restructured_text)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
