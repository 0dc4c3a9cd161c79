"""From a URDF file to its text: a plain file of bounded size, in an encoding that is known."""

from __future__ import annotations

import codecs
import re
from os import PathLike
from pathlib import Path

from twolink import files
from twolink.errors import FileError, UrdfError

LARGEST_FILE = 16 * 2**20
"""Bytes of the largest file read; a URDF carries no meshes, so more than this is a mistake."""

# UTF-32 first: its mark begins with that of UTF-16.
_MARKS = (
    (codecs.BOM_UTF32_LE, "UTF-32"),
    (codecs.BOM_UTF32_BE, "UTF-32"),
    (codecs.BOM_UTF16_LE, "UTF-16"),
    (codecs.BOM_UTF16_BE, "UTF-16"),
)

_DECLARED = re.compile(rb"""\s*<\?xml[^>]{0,200}?\sencoding\s*=\s*["']([A-Za-z0-9._-]{1,40})["']""")
# In these encodings a byte is a character, and ASCII keeps its place.
_ONE_BYTE = re.compile(r"(?:iso-?8859-?\d{1,2}|windows-?125\d|cp125\d|latin-?1)", re.IGNORECASE)


def read_text(path: str | PathLike[str]) -> str:
    """Return the text of a file.

    The encoding is UTF-8, with or without a byte order mark, or the one-byte encoding that the XML
    declaration names. Raises `UrdfError` for anything but a readable plain file of at most 16 MB in
    such an encoding.
    """
    return decoded(read_bytes(path))


def read_bytes(path: str | PathLike[str]) -> bytes:
    """Return the bytes of a plain file of at most 16 MB, or raise `UrdfError`."""
    try:
        return files.read_bytes(Path(path), LARGEST_FILE)
    except FileError as error:
        raise UrdfError(str(error)) from error


def check_size(size: int) -> None:
    """Raise `UrdfError` for more bytes or characters than `LARGEST_FILE`."""
    if size > LARGEST_FILE:
        raise UrdfError(f"must be at most {LARGEST_FILE // 2**20} MB; got a larger file")


def decoded(content: bytes) -> str:
    """Return the text of a file's bytes, without a byte order mark; see `read_text`."""
    for mark, name in _MARKS:
        if content.startswith(mark):
            raise UrdfError(f"must be UTF-8 text; got {name}, by its byte order mark")
    if b"\0" in content:
        raise UrdfError(f"must be text; got a NUL byte at position {content.index(0)}")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        declared = _DECLARED.match(content)
        encoding = declared[1].decode("ascii") if declared else ""
        if _ONE_BYTE.fullmatch(encoding):
            return _by_declaration(content, encoding)
        line = content.count(b"\n", 0, error.start) + 1
        raise UrdfError(
            "must be UTF-8 text, or in the one-byte encoding that its XML declaration names; got"
            f" byte {content[error.start]:#04x} at position {error.start} in line {line}"
        ) from error


def _by_declaration(content: bytes, encoding: str) -> str:
    try:
        return content.decode(encoding)
    except (LookupError, UnicodeDecodeError) as error:
        raise UrdfError(
            f"must be text in the encoding {encoding} that its XML declaration names; got bytes"
            " that are not"
        ) from error


def decoded_leniently(content: bytes) -> tuple[str, tuple[str, ...]]:
    """Return the text of a file's bytes in any encoding that it shows, and the changes to UTF-8.

    Bytes that are not UTF-8, in a file that names no one-byte encoding, are read as Windows-1252.
    """
    for mark, name in _MARKS:
        if content.startswith(mark):
            try:
                return content.decode(name), (f"rewrote {name} as UTF-8",)
            except UnicodeDecodeError as error:
                raise UrdfError(f"must be text; got {name} that is damaged") from error
    if content.startswith(codecs.BOM_UTF8):
        return decoded(content), ("removed the byte order mark",)
    try:
        text = decoded(content)
    except UrdfError:
        declared = _DECLARED.match(content)
        if b"\0" in content or (declared and _ONE_BYTE.fullmatch(declared[1].decode("ascii"))):
            raise
        return content.decode("cp1252", errors="replace"), ("rewrote Windows-1252 as UTF-8",)
    if content.isascii() or content == text.encode("utf-8"):
        return text, ()
    return text, ("rewrote a one-byte encoding as UTF-8",)
