"""Pictures of results from Python: plots, films, pages, and the displays of notebooks.

`twolink` calls these functions through `twolink.optional.display`.
"""

from __future__ import annotations

import html
import importlib
import io
import sys
import tempfile
import webbrowser
from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from twolink.chain import Chain
from twolink.errors import ParameterError
from twolink.inputs import (
    as_count,
    as_number,
    as_pair,
    as_path,
    as_real,
    as_words,
    check_instance,
    nearest_float,
)
from twolink.scene import Scene
from twolink.simulation import Trajectory
from twolink.text import distinct_names
from twolink.viz.film import Film
from twolink.viz.page import player_page
from twolink.viz.plots.kinds import plot_of
from twolink.viz.plots.style import write_to
from twolink.viz.recording import record as record_film
from twolink.viz.run import Run
from twolink.viz.schematic import schematic
from twolink.viz.themes import theme_named

# Frames of a page in a notebook: a longer motion has fewer a second.
_MOST_FRAMES, _FPS = 400, 30.0

# The height of a player in a notebook's cell (pixels).
_HEIGHT = 460


def plot(
    kind: str,
    trajectories: Sequence[Trajectory],
    *,
    theme: str = "light",
    names: Sequence[str] = (),
) -> Figure:
    """Return a plot of trajectories, the first in full: a matplotlib figure.

    `names` are those of the further ones, by default their titles; those that come again have a
    number. Raises `PictureError` for an unknown kind or theme, and for a kind that does not suit so
    many trajectories, and `ParameterError` for more names than further trajectories.
    """
    for each in trajectories:
        check_instance("a motion", each, Trajectory)
    first, *others = trajectories
    named = distinct_names(_names(others, as_words("names", names)))
    return plot_of(kind, first, theme, dict(zip(named, others, strict=True)))


def film(
    trajectory: Trajectory,
    *ghosts: Trajectory,
    fps: float = _FPS,
    speed: float = 1.0,
    theme: str = "light",
) -> Film:
    """Return the film of a trajectory, with others as ghosts.

    `fps` is in frames per second and `speed` in seconds of motion per second of film.
    """
    for each in ghosts:
        check_instance("a ghost", each, Trajectory)
    runs = tuple(Run(each.scene.title, each) for each in (trajectory, *ghosts))
    frames, pace = nearest_float(as_number("fps", fps)), nearest_float(as_number("speed", speed))
    return Film(runs, fps=frames, speed=pace, theme=theme_named(theme))


def record(
    trajectory: Trajectory,
    path: str | PathLike[str],
    *ghosts: Trajectory,
    size: tuple[int, int] = (1280, 720),
    at: float | None = None,
    **options: Any,
) -> None:
    """Record the film of a trajectory to a .mp4, .webm, .gif, .png or .html file.

    `size` is in pixels, `at` the time of a .png (s); `options` are those of `film`. Raises
    `PictureError` for options out of range, and for an `at` with any other file.
    """
    file = as_path("path", path)
    width, height = (as_count("size", length) for length in as_pair("size", size))
    if file.suffix == ".gif":
        options.setdefault("fps", 25.0)
    still = None if at is None else as_real("at", at)
    record_film(film(trajectory, *ghosts, **options), file, size=(width, height), at=still)


def page(trajectory: Trajectory) -> str:
    """Return a page (HTML) that plays a trajectory offline."""
    duration = float(trajectory.t[-1] - trajectory.t[0])
    fps = min(_FPS, _MOST_FRAMES / duration) if duration > 0 else _FPS
    return player_page(film(trajectory, fps=max(fps, 0.01)))


def player(trajectory: Trajectory) -> str:
    """Return a frame (HTML) for a notebook's cell, with a page of its own that plays the motion."""
    content = html.escape(page(trajectory), quote=True)
    title = html.escape(trajectory.scene.title, quote=True)
    return (
        f'<iframe title="Motion: {title}" srcdoc="{content}" width="100%" height="{_HEIGHT}" '
        'style="border: 0" allowfullscreen></iframe>'
    )


def show(trajectory: Trajectory) -> None:
    """Show a trajectory in a notebook's cell, or in the browser as a page in a temporary file."""
    shell = sys.modules.get("IPython")
    if shell is not None and getattr(shell.get_ipython(), "kernel", None) is not None:
        cell: Any = importlib.import_module("IPython.display")
        # IPython warns of a bare iframe, and recommends its own class.
        cell.display(cell.HTML(f"<div>{player(trajectory)}</div>"))
        return
    with tempfile.NamedTemporaryFile(
        "w", suffix=".html", prefix="twolink-", delete=False, encoding="utf-8"
    ) as file:
        file.write(page(trajectory))
    webbrowser.open(Path(file.name).as_uri())


def drawing(thing: Scene | Chain) -> str:
    """Return a drawing (SVG) of a chain with its symbols, of a scene at its start."""
    made = schematic(thing) if isinstance(thing, Chain) else schematic(thing.chain, thing.q)
    buffer = io.BytesIO()
    write_to(made, buffer, ".svg")
    text = buffer.getvalue().decode()
    return text[text.index("<svg") :]


def _names(others: Sequence[Trajectory], names: Sequence[str]) -> list[str]:
    """Return the names of trajectories: the given ones first, and the titles of the others."""
    if len(names) > len(others):
        raise ParameterError(
            f"names must be at most {len(others)}, one for each further motion; got {len(names)}"
        )
    return [*names, *(other.scene.title for other in others[len(names) :])]
