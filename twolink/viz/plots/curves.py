"""Motions side by side: their names, their lines, and whether one axis suits all."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from twolink.simulation import Trajectory
from twolink.viz.plots.moments import Array, Moments, moments
from twolink.viz.plots.style import Palette, stroke

Others = Mapping[str, Trajectory]
"""Further motions in a plot, by their names."""

# A curve that takes less than this part of a common axis is flat on it.
_FLAT = 0.12

# Lines of further motions are thinner, and each motion has its own dashes.
_THINNER = 0.75


def motions(trajectory: Trajectory, others: Others) -> Iterator[tuple[int, str, Moments]]:
    """Return each motion with its number, the end of its labels, and its moments."""
    yield 0, "", moments(trajectory)
    for number, (name, other) in enumerate(others.items(), start=1):
        yield number, f", {name}", moments(other)


def line_style(palette: Palette, curve: int, motion: int) -> dict[str, Any]:
    """Return the style of a curve of a motion: one colour a curve, other dashes for each motion."""
    style = stroke(palette, curve)
    if motion:
        style["linestyle"] = stroke(palette, motion + 2)["linestyle"]
        style["linewidth"] *= _THINNER
    return style


def flat(curves: Iterable[Array], every: bool = False) -> bool:
    """Return whether curves would be flat on an axis that has all of them.

    That is whether one that changes is, or with `every` whether all are.
    """
    finite = [values[np.isfinite(values)] for values in curves]
    finite = [values for values in finite if len(values)]
    if len(finite) < 2:
        return False
    spans = [float(np.ptp(values)) for values in finite]
    least = _FLAT * float(np.ptp(np.concatenate(finite)))
    return max(spans) < least if every else any(0 < span < least for span in spans)


def at_moments(trajectory: Trajectory) -> Trajectory:
    """Return a trajectory whose samples are the moments that are drawn."""
    shown = moments(trajectory)
    return replace(trajectory, t=shown.t, q=shown.q, u=shown.u)
