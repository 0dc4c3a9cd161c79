"""The difference of two motions over time."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from twolink import kinematics
from twolink.errors import PictureError, SimulationError
from twolink.simulation import Trajectory
from twolink.viz.plots.curves import Others
from twolink.viz.plots.moments import Array, moments
from twolink.viz.plots.style import figure, label_lines, note, palette_of, stroke

_COUNTED = 1


def difference(
    trajectory: Trajectory, theme: str = "light", others: Others | None = None
) -> Figure:
    """Return the differences of another motion in q (rad), u (rad/s) and D (m) over time (s).

    They are absolute values on logarithmic axes, the larger of both links; zeros have no point.
    Raises `PictureError` unless there is exactly one other motion, for motions that do not
    overlap, and for samples at different times without dense output.
    """
    others = others or {}
    if len(others) != _COUNTED:
        raise PictureError(f"a difference must be that of 2 motions; got {len(others) + 1}")
    ((name, other),) = others.items()
    palette = palette_of(theme)
    times, first, second = _common(trajectory, other)
    made, axes = figure(
        palette, f"{trajectory.scene.title}: difference to {name}", rows=3, sharex=True
    )
    ends = [
        np.array(kinematics.position(run.chain, tuple(q), run.chain.D))
        for run, (q, _) in ((trajectory, first), (other, second))
    ]
    curves = {
        "difference of q (rad)": np.abs(first[0] - second[0]).max(axis=0),
        "difference of u (rad/s)": np.abs(first[1] - second[1]).max(axis=0),
        "distance of D (m)": np.hypot(*(ends[0] - ends[1])),
    }
    for number, (each, (label, values)) in enumerate(zip(axes, curves.items(), strict=True)):
        seen = np.where(values > 0, values, np.nan)
        each.set_yscale("log")
        each.plot(times, seen, label="_difference", **stroke(palette, number))
        each.set_ylabel(label)
        if not np.isfinite(seen).any():
            # A logarithmic axis needs a positive number.
            each.set_ylim(1e-17, 1e-15)
    axes[-1].set_xlabel("time (s)")
    axes[-1].set_xlim(float(times[0]), float(times[-1]))
    label_lines(*axes)
    largest = max(float(values.max()) for values in curves.values())
    note(made, palette, "Equal at all times." if largest == 0 else f"Largest: {largest:.2g}.")
    return made


def _common(
    one: Trajectory, other: Trajectory
) -> tuple[Array, tuple[Array, Array], tuple[Array, Array]]:
    """Return the times that two motions share, and q and u of each there."""
    end = min(float(one.t[-1]), float(other.t[-1]))
    start = max(float(one.t[0]), float(other.t[0]))
    if end <= start:
        raise PictureError("the motions must overlap in time")
    times = np.union1d(moments(one).t, moments(other).t)
    times = times[(times >= start) & (times <= end)]
    try:
        return times, one.at(times), other.at(times)
    except SimulationError:
        _, mine, theirs = np.intersect1d(one.t, other.t, return_indices=True)
    if len(mine) < 2:
        raise PictureError(
            "motions that are known only at their samples must have samples at the same times"
        )
    return one.t[mine], (one.q[:, mine], one.u[:, mine]), (other.q[:, theirs], other.u[:, theirs])
