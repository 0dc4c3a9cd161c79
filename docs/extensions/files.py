"""Files of a build."""

from pathlib import Path


def write_if_new(file: Path, text: str) -> None:
    """Write a file unless it has this text, so that Sphinx reads only pages that changed."""
    if not file.exists() or file.read_text(encoding="utf-8") != text:
        file.write_text(text, encoding="utf-8")
