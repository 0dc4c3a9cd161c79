"""A page of a map of first times: a click on a pixel shows the motion of its run.

The motions are the kept samples; nothing is computed in the browser but the angles between them.
"""

from __future__ import annotations

import base64
import zlib
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from twolink.chain import Chain
from twolink.ensembles.family import Family
from twolink.ensembles.file import axes_of, ensemble_of
from twolink.ensembles.first_time import HAPPENS, NEVER
from twolink.ensembles.results import Results
from twolink.errors import PictureError, TwolinkError
from twolink.limits import in_bytes
from twolink.text import printable
from twolink.viz.page import packed_message
from twolink.viz.plots.ensemble import TimeMap, ensemble_plot, map_of
from twolink.viz.report.page import Section, page, paragraph, part, picture

# Memory of all motions, in the page and in the browser (bytes).
_MOST = 1e8

# Angles are whole numbers of this part of a turn, and samples differences from the one before.
_TURN = 2**16
_MOST_TURNS = 2**14


def map_page(found: Results) -> str:
    """Return a page (HTML), without network requests, of first times over two axes.

    Raises `PictureError` for results without first times over two axes or without samples, and for
    motions that need too much memory.
    """
    times = map_of(found)
    if times is None:
        raise PictureError("the page of a map must have first times over two axes; got others")
    if "q_samples" not in times.grid:
        raise PictureError(
            "the page of a map must have the motions of its runs (samples in [keep]); got none"
        )
    drawn = ensemble_plot(found)
    words = (
        "Click a pixel, or use the arrow keys, to see the motion of its run: its kept samples, "
        "with linear interpolation between them."
    )
    shown = picture(drawn, f"First times of {times.condition}")
    packed = base64.b64encode(zlib.compress(_message(found, times, drawn), 6)).decode()
    body = (
        f'<div class="explorer"><div class="chooser" tabindex="0" role="application" '
        f'aria-label="Map of first times; the arrow keys choose a run">{shown}'
        '<span class="mark" hidden></span></div>\n'
        f'<div class="motion">{part("map.html")}</div>\n'
        f'<script type="application/x-twolink-map">{packed}</script></div>'
    )
    head = f"<style>{part('map.css')}</style>\n<script>{part('map.js')}</script>\n"
    title = str(found.attributes["title"])
    return page(title, paragraph(words, "lead"), [Section("Map", body)], head)


def _message(found: Results, times: TimeMap, drawn: Figure) -> bytes:
    """Return the numbers of the page: a JSON text, and arrays with a row for each run."""
    samples = times.grid["q_samples"].transpose(times.y, times.x, "sample", "link").values
    runs = samples.reshape(-1, *samples.shape[2:])
    size = runs.size * np.dtype("<i4").itemsize
    if size > _MOST:
        raise PictureError(
            f"the motions of a map must take at most {in_bytes(_MOST)}; got {len(runs)} runs of "
            f"{runs.shape[1]} samples, {in_bytes(size)}"
        )
    axes = drawn.axes[0]
    box = axes.get_position()
    head = {
        "condition": times.condition,
        "names": [times.x, times.y],
        "units": list(times.units),
        "places": [place.tolist() for place in times.places],
        "box": [float(edge) for edge in (box.x0, box.x1, 1 - box.y1, 1 - box.y0)],
        "limits": [*map(float, axes.get_xlim()), *map(float, axes.get_ylim())],
        "duration": _duration(found),
        "samples": runs.shape[1],
        "turn": _TURN,
        "lengths": _lengths(found, times),
        "words": _words(times, _duration(found)),
    }
    return packed_message(head, [_differences(runs).astype("<i4").tobytes()])


def _duration(found: Results) -> float:
    """Return the duration of the runs (s)."""
    return float(found.attributes["sweep"]["scene"]["run"]["duration"])


def _differences(runs: Any) -> Any:
    """Return angles (rad), shape (runs, samples, 2), as differences in parts of a turn.

    Angles that are not known, after a failure, stay where they are. Differences too large for their
    numbers of 4 bytes lose whole turns.
    """
    parts = np.rint(np.nan_to_num(runs) * (_TURN / (2 * np.pi)))
    found: Any = np.diff(parts, axis=1, prepend=0.0)
    unknown = np.isnan(runs)
    found[unknown] = 0.0
    return np.fmod(found, _TURN * _MOST_TURNS)


def _lengths(found: Results, times: TimeMap) -> list[list[float]]:
    """Return L1 and L2 (m): of each run where they are different, else of all."""
    about = found.attributes
    axes = axes_of(about["sweep"])
    if not any(axis.keys[0] == "chain" for axis in axes):
        return [about["lengths"]]
    # A chain whose numbers change has no URDF: no file is read.
    family = ensemble_of(about["sweep"], str(found.path), found.path.parent).family
    like = times.grid["reason"]
    columns = [
        times.grid[axis.name].broadcast_like(like).transpose(times.y, times.x).values.ravel()
        for axis in axes
    ]
    chains = [_chain(family, values) for values in np.transpose(columns).tolist()]
    return [[0.0, 0.0] if chain is None else [float(chain.L1), float(chain.L2)] for chain in chains]


def _chain(family: Family, values: list[float]) -> Chain | None:
    """Return the chain of a run, or None where its values are refused."""
    try:
        return family.parts(values).chain
    except TwolinkError:
        return None


def _words(times: TimeMap, duration: float) -> list[str]:
    """Return the result of each run in words, and its notes."""
    bounds = times.grid[f"{times.condition}_bound"].transpose(times.y, times.x).values
    reasons = times.grid["reason"].transpose(times.y, times.x).values
    every = zip(
        times.times.ravel().tolist(), bounds.ravel().tolist(), times.verdicts.ravel().tolist(),
        reasons.ravel().tolist(), strict=True,
    )  # fmt: skip
    until = f"until {duration:g} s"
    results = [_result(times.condition, until, *one) for one in every]
    if "notes" not in times.grid:
        # Results of an older version.
        return results
    notes = times.grid["notes"].transpose(times.y, times.x).values.ravel().tolist()
    return [_noted(result, note) for result, note in zip(results, notes, strict=True)]


def _noted(result: str, notes: str) -> str:
    """Return the result of a run with its notes, one a line."""
    return ". ".join([result, *map(printable, notes.splitlines())])


def _result(
    condition: str, until: str, time: float, bound: float, verdict: int, reason: str
) -> str:
    if reason:
        return f"failed: {printable(reason)}"
    if verdict == HAPPENS:
        return f"{condition} at {time:.6f} s, within {bound:.1e} s"
    return f"no {condition} {until}" if verdict == NEVER else f"{condition}: undecided"
