"""Mathematics as MathML, which browsers draw without scripts, fonts or a network.

MathJax would add megabytes of scripts and fonts to a site that must work offline, and pictures
cannot be searched, enlarged or read aloud. Chromium, Firefox and Safari draw MathML Core.
"""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx

_TAG = re.compile(r"\s*\\tag\{([^}]*)\}")
# MathML Core has no mathvariant but "normal": bold letters are a matter of style there.
_BOLD = re.compile(r'mathvariant="bold(-italic)?"')
_UPRIGHT = 'style="font-weight: bold; text-transform: none"'


def mathml(latex: str, display: str = "inline") -> str:
    """Return a formula as an element of MathML; `display` is "inline" or "block"."""
    return _BOLD.sub(_UPRIGHT, str(convert(latex, display=display)))


def tagged(latex: str) -> tuple[str, str]:
    r"""Return a formula without its `\tag`, and the equation number in it, or an empty one."""
    found = _TAG.search(latex)
    return (_TAG.sub("", latex), found[1]) if found else (latex, "")


def _inline(translator: Any, node: nodes.Element) -> None:
    translator.body.append(mathml(node.astext()))
    raise nodes.SkipNode


def _block(translator: Any, node: nodes.Element) -> None:
    latex, number = tagged(node.astext())
    place = f' id="equation-{number}"' if number else ""
    shown = f'<span class="number">({number})</span>' if number else ""
    name = f"equation {number}" if number else "equation"
    # A formula that is wider than the page scrolls, with the keyboard, too.
    translator.body.append(
        f'<div class="formula"{place} tabindex="0" role="group" aria-label="{name}">'
        f"{mathml(latex, 'block')}{shown}</div>\n"
    )
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the renderer `mathml`."""
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
