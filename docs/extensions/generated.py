"""Pages that are written from the code before a build: commands, scene keys, messages, gallery."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx

from extensions.commands import commands_page
from extensions.files import write_if_new
from extensions.gallery import gallery_page
from extensions.messages import messages_page
from extensions.scene_keys import scene_keys_page

FOLDER = "generated"


def pages(folder: Path) -> Iterator[tuple[str, str]]:
    """Yield names and texts of all generated pages; pictures and films go into `folder`."""
    yield "commands", commands_page()
    yield "scene_keys", scene_keys_page(folder)
    yield "messages", messages_page(folder)
    yield "gallery", gallery_page(folder)


def _write(app: Sphinx, *_: Any) -> None:
    folder = Path(app.srcdir) / FOLDER
    folder.mkdir(exist_ok=True)
    for name, text in pages(folder):
        write_if_new(folder / f"{name}.md", text)


def setup(app: Sphinx) -> dict[str, Any]:
    """Write the pages before Sphinx looks for pages."""
    app.connect("config-inited", _write)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
