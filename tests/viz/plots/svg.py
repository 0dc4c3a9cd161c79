"""Figures as SVG, and their comparison."""

import io
import re

from twolink.viz.plots.style import write_to


def as_svg(figure):
    buffer = io.BytesIO()
    write_to(figure, buffer, ".svg")
    return buffer.getvalue().decode("utf-8")


def without_ids(svg):
    """Return an SVG whose ids are numbered: matplotlib computes them from the colours, too."""
    ids = {name: f"id{k}" for k, name in enumerate(dict.fromkeys(re.findall(r'id="([^"]+)"', svg)))}
    return re.sub(r'(?<=["#])[\w.-]+(?=["\)])', lambda found: ids.get(found[0], found[0]), svg)
