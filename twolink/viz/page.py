"""Pages that play a film: one self-contained file without network requests."""

from __future__ import annotations

import base64
import html
import io
import json
import struct
import zlib
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from twolink.text import printable
from twolink.viz.film import Film, Frame
from twolink.viz.plots.strip import strip
from twolink.viz.plots.style import write_to
from twolink.viz.themes import DARK, recoloured

Progress = Callable[[float], None]


def player_page(
    film: Film, *, bare: bool = False, dark: bool = False, progress: Progress | None = None
) -> str:
    """Return a page (HTML) that fills the window with a player of a film.

    It works offline and from a file. `bare` omits the buttons; with `dark` the page follows the
    reader's colour scheme. `progress` is called with the
    completed fraction.
    """
    kind = "alone bare" if bare else "alone"
    title = html.escape(str(film.about["title"]))
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        # Without an icon the browser would request one from the server.
        '<link rel="icon" href="data:,">\n'
        f"<title>{title}</title>\n<style>body {{ margin: 0; }}</style>\n{player_head()}</head>\n"
        f"<body>\n<main>{player_body(film, kind=kind, dark=dark, progress=progress)}</main>\n"
        "</body>\n</html>\n"
    )


def player_head() -> str:
    """Return the shared part of a page's head: viewer, player and style."""
    packed = base64.b64encode(zlib.compress(viewer_script().encode(), 9)).decode()
    return (
        f"<!--\n{licences()}\n-->\n<style>\n{part('player.css')}</style>\n"
        f'<script type="application/octet-stream" id="twolink-viewer">{packed}</script>\n'
        f"<script>\n{part('player.js')}</script>\n"
    )


def player_body(
    film: Film, *, kind: str = "", dark: bool = False, progress: Progress | None = None
) -> str:
    """Return the element of a player with its film, as wide as its container.

    With `dark` it follows the reader's colour scheme.
    """
    # The highest level takes seven times as long, for 5 % less.
    packed = base64.b64encode(zlib.compress(archive(film, dark, progress), 6)).decode()
    return (
        f'<div class="{f"twolink-player {kind}".strip()}" data-theme="{film.theme.name}">'
        f'<script type="application/x-twolink-film">{packed}</script>{still(film)}</div>\n'
    )


def still(film: Film) -> str:
    """Return an image of the first run at five times, for print and browsers without WebGL."""
    trajectory = film.runs[0].trajectory
    buffer = io.BytesIO()
    write_to(strip(trajectory, film.theme.name), buffer, ".svg")
    data = base64.b64encode(buffer.getvalue()).decode("ascii")
    title = html.escape(printable(trajectory.scene.title))
    return f'<img class="still" alt="{title} at five times" src="data:image/svg+xml;base64,{data}">'


def archive(film: Film, dark: bool = False, progress: Progress | None = None) -> bytes:
    """Return a film in the player's format: a JSON text with sizes, and the commands.

    With `dark` it includes the mapping of the film's colours to the dark theme.
    """
    frames = []
    for number in range(len(film.times)):
        frames.append(film.frame(number))
        if progress is not None:
            progress((number + 1) / len(film.times))
    head = {
        "about": about_of(film, dark),
        "setup": [len(command) for command in film.setup],
        "frames": [
            {"words": frame.words, "commands": [len(command) for command in frame.commands]}
            for frame in frames
        ],
    }
    commands = (*film.setup, *(command for frame in frames for command in frame.commands))
    return packed_message(head, commands)


def about_of(film: Film, dark: bool) -> dict[str, Any]:
    """Return a film's data for the page, with `dark` also its colours in the dark theme."""
    if not dark:
        return film.about
    colours = replace(film, theme=DARK).colours
    return {**film.about, "dark": {**colours, "recoloured": recoloured(film.theme, DARK)}}


def setup_message(film: Film, dark: bool = False) -> bytes:
    """Return the first message to a streamed page; with `dark` it follows its reader's scheme."""
    lengths = [len(command) for command in film.setup]
    return packed_message({"about": about_of(film, dark), "setup": lengths}, film.setup)


def frame_message(frame: Frame, state: dict[str, Any]) -> bytes:
    """Return a frame for a streamed page, with the playback state."""
    lengths = [len(command) for command in frame.commands]
    head = {"words": frame.words, "commands": lengths, "state": state}
    return packed_message(head, frame.commands)


def packed_message(head: dict[str, Any], commands: Iterable[bytes]) -> bytes:
    """Return the length of a JSON text in four bytes, the text, and the commands."""
    text = json.dumps(head, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    # Half a character, as of a file name that is not UTF-8, becomes JSON's escape for it.
    content = text.encode(errors="backslashreplace")
    return struct.pack("<I", len(content)) + content + b"".join(commands)


@cache
def viewer_script() -> str:
    """Return meshcat's viewer from its package (JavaScript)."""
    return (_viewer_folder() / "main.min.js").read_text(encoding="utf-8")


@cache
def licences() -> str:
    """Return the licences of meshcat's viewer and of its components."""
    folder = _viewer_folder()
    texts = [folder.parent / "LICENSE", folder / "main.min.js.LICENSE.txt"]
    found = "\n".join(text.read_text(encoding="utf-8") for text in texts if text.exists())
    # Sequences that end a comment of HTML or JavaScript are split.
    return "meshcat's viewer:\n" + found.replace("--", "- -").replace("*/", "* /")


def _viewer_folder() -> Path:
    from importlib.util import find_spec

    # meshcat is not imported, since it imports ZeroMQ and IPython.
    spec = find_spec("meshcat")
    assert spec is not None
    assert spec.origin is not None
    return Path(spec.origin).parent / "viewer" / "dist"


def part(name: str) -> str:
    """Return a file of the player."""
    return (files("twolink.viz") / "player" / name).read_text(encoding="utf-8")
