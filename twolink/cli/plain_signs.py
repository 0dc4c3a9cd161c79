"""Letters and signs for terminals whose encoding lacks them: a minus sign must not become "?"."""

from __future__ import annotations

import codecs
import sys
import unicodedata
from io import TextIOWrapper

_NAME = "twolink-plain"

_SIGNS = {
    "−": "-", "–": "-", "—": "-", "·": "*", "×": "x", "÷": "/", "±": "+-", "≤": "<=", "≥": ">=",
    "≠": "!=", "≈": "~", "→": "->", "←": "<-", "…": "...", "°": " deg", "²": "^2", "³": "^3",
    "⁻": "^-", "∞": "inf", "√": "sqrt", "∂": "d", "µ": "mu", "‘": "'", "’": "'", "“": '"',
    "”": '"', "′": "'",
}  # fmt: skip

_GREEK = ("GREEK SMALL LETTER ", "GREEK CAPITAL LETTER ")


def use_plain_signs() -> None:
    """Write letters and signs that the encoding of a standard stream lacks by others."""
    codecs.register_error(_NAME, _replaced)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors=_NAME)


def plain(text: str) -> str:
    """Return text in ASCII: Greek letters by their names, and "?" for others without a likeness."""
    return "".join(map(_plain, text))


def _replaced(error: UnicodeError) -> tuple[str, int]:
    assert isinstance(error, UnicodeEncodeError)
    return plain(error.object[error.start : error.end]), error.end


def _plain(letter: str) -> str:
    if letter.isascii():
        return letter
    if letter in _SIGNS:
        return _SIGNS[letter]
    name = unicodedata.name(letter, "")
    for capital, start in enumerate(_GREEK):
        if name.startswith(start):
            word = name.removeprefix(start).lower()
            return word.capitalize() if capital else word
    likeness = unicodedata.normalize("NFKD", letter).encode("ascii", "ignore").decode()
    return likeness or "?"
