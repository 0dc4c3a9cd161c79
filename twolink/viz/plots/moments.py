"""The times at which a trajectory is drawn: samples, events and times between them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from twolink.errors import SimulationError
from twolink.simulation import Trajectory
from twolink.simulation.hybrid.mode import Mode
from twolink.viz.plots.style import Palette

Array = NDArray[np.float64]

# A rest from within this part of the run on is not drawn, but for this part of the time before.
_EARLY, _AFTER = 0.5, 0.1
# The margin before an impact at the start, relative to the axis.
_MARGIN = 0.02

# Minimum number of points between two breaks, unless there are very many breaks.
_POINTS, _MOST_POINTS = 40, 4000


@dataclass(frozen=True)
class Moments:
    """Times t (s), angles q (rad) and speeds u (rad/s), each q and u of shape (2, n).

    `known_between` states whether the trajectory has dense output.
    """

    t: Array
    q: Array
    u: Array
    known_between: bool


@dataclass(frozen=True)
class Span:
    """A mode, with the times (s) of its start and end."""

    start: float
    end: float
    mode: Mode


def spans(trajectory: Trajectory) -> list[Span]:
    """Return the modes of a motion in order; empty if it is smooth."""
    entered = [event.entered for event in trajectory.events]
    left = [*entered[1:], float(trajectory.t[-1])]
    events = zip(entered, left, trajectory.events, strict=True)
    return [Span(start, end, event.mode) for start, end, event in events]


def moments(trajectory: Trajectory) -> Moments:
    """Return the times to draw: the samples, and both sides of each event and impact.

    Each interval between two events has points, however short it is. A trajectory without dense
    output has only its samples.
    """
    start, end = float(trajectory.t[0]), float(trajectory.t[-1])
    breaks = {e.entered for e in trajectory.events} | {i.time for i in trajectory.impacts}
    edges = [start, *sorted(b for b in breaks if start < b < end), end]
    points = int(np.clip(_MOST_POINTS // len(edges), 2, _POINTS))
    pieces = [
        np.append(np.linspace(a, b, points)[:-1], np.nextafter(b, a)) for a, b in pairwise(edges)
    ]
    times = np.union1d(trajectory.t, np.concatenate(pieces)) if breaks else trajectory.t
    try:
        q, u = trajectory.at(times)
    except SimulationError:
        return Moments(trajectory.t, trajectory.q, trajectory.u, known_between=False)
    at_samples = np.searchsorted(times, trajectory.t)
    q[:, at_samples], u[:, at_samples] = trajectory.q, trajectory.u
    return Moments(times, q, u, known_between=True)


def time_limits(trajectory: Trajectory) -> tuple[float, float]:
    """Return the times (s) between which a motion is drawn.

    A motion that comes to rest early ends a little after that. Where something happens at the
    start there is a margin before it, or the axis would hide it.
    """
    start, end = float(trajectory.t[0]), float(trajectory.t[-1])
    rest = at_rest_from(trajectory)
    if rest is not None and start < rest < start + _EARLY * (end - start):
        end = start + (1 + _AFTER) * (rest - start)
    happens = [*(impact.time for impact in trajectory.impacts)]
    if any(time < start + _MARGIN * (end - start) for time in happens):
        start -= _MARGIN * (end - start)
    return start, end


def at_rest_from(trajectory: Trajectory) -> float | None:
    """Return the time (s) from which the chain is at rest to the end, or None."""
    if not trajectory.events or np.any(trajectory.u[:, -1]) or trajectory.failure:
        return None
    moving = np.flatnonzero(np.any(trajectory.u != 0, axis=0))
    last = float(trajectory.t[moving[-1]]) if len(moving) else float(trajectory.t[0])
    entered = [event.entered for event in trajectory.events if event.entered >= last]
    return entered[0] if entered else None


def time_axis(axes: list[Axes], trajectory: Trajectory, palette: Palette) -> None:
    """Set the common time axis of stacked axes, with a label at the lowest.

    If the requested accuracy does not hold to the end, a mark shows the time from which on.
    """
    start, end = time_limits(trajectory)
    for each in axes:
        each.set_xlim(start, end)
        if not trajectory.met:
            each.axvline(trajectory.holds_until, color=palette.ink, linewidth=0.8)
    if not trajectory.met:
        axes[0].annotate(
            f"accurate to {trajectory.accuracy:.0e} until here",
            xy=(trajectory.holds_until, 1.0),
            xycoords=axes[0].get_xaxis_transform(),
            xytext=(3, -3),
            textcoords="offset points",
            va="top",
            color=palette.ink,
            fontsize=8,
        )
    rest = at_rest_from(trajectory) if end < float(trajectory.t[-1]) else None
    ending = "" if rest is None else f", at rest from {rest:.4g} s to {trajectory.t[-1]:g} s"
    axes[-1].set_xlabel(f"time (s){ending}")
