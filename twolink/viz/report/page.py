"""A self-contained HTML page without network requests, for screens, phones and print."""

from __future__ import annotations

import base64
import html
import io
import json
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

from matplotlib.figure import Figure

from twolink.files import atomic_write
from twolink.tables import Table, as_html
from twolink.text import printable
from twolink.viz.plots.style import svg_into, write_to


@dataclass(frozen=True)
class Section:
    """A heading and its HTML body."""

    heading: str
    body: str

    @property
    def anchor(self) -> str:
        """The identifier for links to the section."""
        return self.heading.lower().replace(" ", "-")


def page(title: str, lead: str, sections: Sequence[Section], head: str = "") -> str:
    """Return the whole page; `lead`, `head` and the sections' bodies are HTML."""
    links = " ".join(f'<a href="#{s.anchor}">{text(s.heading)}</a>' for s in sections)
    bodies = "\n".join(
        f'<section id="{s.anchor}"><h2>{text(s.heading)}</h2>\n{s.body}\n</section>'
        for s in sections
    )
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        # An empty icon, or the browser would request one.
        '<link rel="icon" href="data:,">\n'
        f"<title>{text(title)}</title>\n<style>{part('report.css')}</style>\n{head}"
        f"<script>{part('report.js')}</script></head>\n<body>\n"
        f"<header><h1>{text(title)}</h1>\n{lead}\n<nav>{links}</nav></header>\n"
        f"<main>\n{bodies}\n</main>\n</body>\n</html>\n"
    )


def part(name: str) -> str:
    """Return a file of the pages' scripts and styles."""
    return (files("twolink.viz") / "report" / name).read_text(encoding="utf-8")


def text(words: object) -> str:
    """Return text escaped for HTML."""
    return html.escape(printable(words))


def heading(words: str) -> str:
    """Return a heading inside a section."""
    return f"<h3>{text(words)}</h3>"


def paragraph(words: str, kind: str = "") -> str:
    """Return a paragraph, with an optional CSS class."""
    return f'<p class="{kind}">{as_html(words)}</p>' if kind else f"<p>{as_html(words)}</p>"


def table(found: Table, kind: str = "") -> str:
    """Return a table that scrolls inside itself, with an optional CSS class."""
    return f'<div class="scroll" tabindex="0">{found.html(kind)}</div>'


def folded(summary: str, body: str, *, opened: bool = False) -> str:
    """Return HTML that a click on the summary shows; it is printed in any case."""
    state = " open" if opened else ""
    return f'<details class="print"{state}><summary>{text(summary)}</summary>{body}</details>'


def download(name: str, kind: str, content: bytes) -> str:
    """Return a link that saves a file of a media type, whose content is in the page."""
    data = base64.b64encode(content).decode("ascii")
    return f'<a download="{text(name)}" href="data:{kind};base64,{data}">{text(name)}</a>'


def picture(figure: Figure, alt: str, limits: tuple[float, float] | None = None) -> str:
    """Return a figure of the light theme as embedded images in the light and the dark theme.

    The page shows the one of the reader's colour scheme, and prints the light one. The SVGs are
    separate images, since inline SVGs of matplotlib would share ids. Axes with these `limits` are
    those of time (s), in which a cursor shows the time of the film.
    """
    drawn = _as_svg(figure)
    # Drawing takes much longer than replacing colours.
    dark, light = _as_url(svg_into(drawn, "light", "dark")), _as_url(drawn)
    image = (
        f'<picture><source media="screen and (prefers-color-scheme: dark)" srcset="{dark}">'
        f'<img alt="{text(alt)}" src="{light}"></picture>'
    )
    axes = [] if limits is None else _time_axes(figure, limits)
    if axes:
        image = f'<div class="timed" data-axes="{json.dumps(axes)}">{image}</div>'
    return (
        f'<figure><div class="frame">{image}</div><figcaption>{text(alt)} '
        '<button class="enlarge" aria-pressed="false">Enlarge</button></figcaption></figure>'
    )


def _time_axes(figure: Figure, limits: tuple[float, float]) -> list[list[float]]:
    """Return the edges of the axes with these limits, and the limits.

    Edges are left, right, top and bottom, in parts of the figure.
    """
    found = []
    for axes in figure.axes:
        if axes.get_xlim() == limits:
            box = axes.get_position()
            edges = (box.x0, box.x1, 1 - box.y1, 1 - box.y0)
            found.append([round(float(edge), 5) for edge in edges] + list(limits))
    return found


def _as_svg(figure: Figure) -> str:
    buffer = io.BytesIO()
    write_to(figure, buffer, ".svg")
    return buffer.getvalue().decode("utf-8")


def _as_url(svg: str) -> str:
    return f"data:image/svg+xml;base64,{base64.b64encode(svg.encode('utf-8')).decode('ascii')}"


def write(path: Path, document: str) -> None:
    """Write the page atomically."""
    with atomic_write(path) as file:
        file.write_text(document, encoding="utf-8")
