"""A self-contained HTML page without network requests, for screens, phones and print."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from matplotlib.figure import Figure

from twolink.files import atomic_write
from twolink.text import printable
from viz.plots.style import write_to

_STYLE = """
:root { color-scheme: light dark; --paper: #ffffff; --ink: #1c1e21; --soft: #5d6670;
  --line: #dfe3e8; --panel: #f6f7f9; --good: #00714f; --bad: #b3261e; --accent: #0072b2; }
@media (prefers-color-scheme: dark) { :root { --paper: #14171c; --ink: #e6e6e6; --soft: #a3adb8;
  --line: #333a44; --panel: #1c2128; --good: #3cc99a; --bad: #ff8a80; --accent: #56b4e9; } }
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; }
body { margin: 0 auto; padding: 1.5rem 1rem 4rem; max-width: 62rem; background: var(--paper);
  color: var(--ink); font: 16px/1.55 system-ui, -apple-system, "Segoe UI", Roboto, sans-serif; }
h1 { font-size: 1.9rem; line-height: 1.2; margin: .5rem 0 .25rem; }
td:first-child { white-space: nowrap; }
h2 { font-size: 1.3rem; margin: 2.6rem 0 .6rem; padding-top: .8rem;
  border-top: 1px solid var(--line); }
h3 { font-size: 1.05rem; margin: 1.6rem 0 .4rem; }
p { margin: .5rem 0 .8rem; }
.lead { color: var(--soft); }
.verdict { padding: .8rem 1rem; border-left: 4px solid var(--good); background: var(--panel);
  font-weight: 600; }
.verdict.bad { border-color: var(--bad); }
.good { color: var(--good); } .bad { color: var(--bad); } .soft { color: var(--soft); }
details { margin: .3rem 0; } summary { cursor: pointer; } summary::marker { color: var(--soft); }
a { color: var(--accent); }
nav { margin: 1rem 0 0; font-size: .92rem; }
nav a { margin-right: 1rem; white-space: nowrap; }
.scroll { overflow-x: auto; margin: .8rem 0; }
table { border-collapse: collapse; width: 100%; font-size: .88rem; }
caption { text-align: left; font-weight: 600; padding: .3rem 0; }
th, td { padding: .28rem .6rem; border-bottom: 1px solid var(--line); text-align: left;
  vertical-align: baseline; }
th { font-weight: 600; color: var(--soft); }
td.number, th.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
table.board { table-layout: fixed; min-width: 58rem; font-size: .8rem; }
.board th, .board td { padding: .2rem .25rem; white-space: nowrap; }
.board th { white-space: normal; vertical-align: bottom; font-size: .72rem; }
.board th:first-child { width: 14rem; }
figure { margin: 1rem 0; overflow-x: auto; }
figure img { display: block; width: 100%; min-width: 36rem; height: auto; border-radius: 4px; }
figcaption { position: sticky; left: 0; }
figcaption, .note { color: var(--soft); font-size: .88rem; margin-top: .4rem; }
code, pre { font-family: ui-monospace, SFMono-Regular, Menlo, Consolas, monospace;
  font-size: .88em; }
pre { padding: .7rem .9rem; background: var(--panel); overflow-x: auto; }
@media print { body { max-width: none; font-size: 10pt; padding: 0; }
  nav, .twolink-player { display: none !important; }
  h2, h3, p, caption { break-after: avoid; } figure, tr, summary { break-inside: avoid; }
  figure, .scroll { overflow: visible; } figure { text-align: center; }
  figure img { display: inline; width: auto; min-width: 0; max-width: 100%; max-height: 9.5cm; } }
"""


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
        f"<title>{text(title)}</title>\n<style>{_STYLE}</style>\n{head}</head>\n<body>\n"
        f"<header><h1>{text(title)}</h1>\n{lead}\n<nav>{links}</nav></header>\n"
        f"<main>\n{bodies}\n</main>\n</body>\n</html>\n"
    )


def text(words: object) -> str:
    """Return text escaped for HTML."""
    return html.escape(printable(words))


def heading(words: str) -> str:
    """Return a heading inside a section."""
    return f"<h3>{text(words)}</h3>"


def paragraph(words: str, kind: str = "") -> str:
    """Return a paragraph, with an optional CSS class."""
    return f'<p class="{kind}">{text(words)}</p>' if kind else f"<p>{text(words)}</p>"


def table(
    heads: Sequence[str],
    rows: Iterable[Sequence[str]],
    *,
    numbers: Sequence[int] = (),
    caption: str = "",
    kind: str = "",
) -> str:
    """Return a table; cells are HTML, and the columns in `numbers` are right-aligned.

    `kind` is an optional CSS class.
    """

    def cells(tag: str, row: Sequence[str]) -> str:
        right = ' class="number"'
        return "".join(
            f"<{tag}{right if index in numbers else ''}>{cell}</{tag}>"
            for index, cell in enumerate(row)
        )

    above = f"<caption>{text(caption)}</caption>" if caption else ""
    of_kind = f' class="{kind}"' if kind else ""
    body = "\n".join(f"<tr>{cells('td', row)}</tr>" for row in rows)
    return (
        f'<div class="scroll"><table{of_kind}>{above}<thead><tr>{cells("th", heads)}</tr></thead>\n'
        f"<tbody>{body}</tbody></table></div>"
    )


def picture(draw: Callable[[str], Figure], alt: str) -> str:
    """Return a figure as embedded images in the light and the dark theme.

    The page shows the one of the reader's colour scheme, and prints the light one. The SVGs are
    separate images, since inline SVGs of matplotlib would share ids.
    """
    dark, light = (_as_url(draw(theme)) for theme in ("dark", "light"))
    return (
        f'<figure><picture><source media="screen and (prefers-color-scheme: dark)" srcset="{dark}">'
        f'<img alt="{text(alt)}" src="{light}"></picture>'
        f"<figcaption>{text(alt)}</figcaption></figure>"
    )


def _as_url(figure: Figure) -> str:
    buffer = io.BytesIO()
    write_to(figure, buffer, ".svg")
    data = base64.b64encode(buffer.getvalue()).decode("ascii")
    return f"data:image/svg+xml;base64,{data}"


def write(path: Path, document: str) -> None:
    """Write the page atomically."""
    with atomic_write(path) as file:
        file.write_text(document, encoding="utf-8")
