"""States of a trajectory at any time, for pictures: a run's own polynomials, or its samples."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from twolink.errors import PictureError, SimulationError
from twolink.simulation import Trajectory
from viz.shapes import Array

# Between two samples a link may turn by this much (rad). A cubic through both ends with their
# speeds is then off by some 1e-4 rad at most, which no picture shows.
_LARGEST_TURN = 0.5

States = Callable[[Array], tuple[Array, Array]]


def resolution(trajectory: Trajectory) -> float:
    """Return how far its states between samples may be off (rad); 0 with dense output.

    Cubics over every second sample miss those in between by sixteen times as much as cubics over
    all of them, where the motion is smooth.
    """
    if _is_dense(trajectory):
        return 0.0
    if len(trajectory.t) < 5:
        return math.inf
    coarse = replace(
        trajectory,
        t=trajectory.t[::2].copy(),
        q=trajectory.q[:, ::2].copy(),
        u=trajectory.u[:, ::2].copy(),
    )
    left_out = trajectory.t[1 : (len(trajectory.t) - 1) // 2 * 2 : 2]
    q, _ = _cubics(coarse)(left_out)
    return float(np.abs(q - trajectory.q[:, 1 : 2 * len(left_out) : 2]).max()) / 16


def states_of(trajectory: Trajectory) -> States:
    """Return what gives q (rad) and u (rad/s), each of shape (2, n), at times (s) within the run.

    They are those of the dense output where there is one. A trajectory that is known at its
    samples alone is continued by cubics between them, and impacts in between are respected. Raises
    `PictureError` where the samples are too far apart for that.
    """
    if _is_dense(trajectory):
        return trajectory.at
    turn = float(np.abs(np.diff(trajectory.q)).max(initial=0.0))
    if len(trajectory.t) < 2 or not turn <= _LARGEST_TURN:
        raise PictureError(
            f"'{trajectory.scene.title}' is known at {len(trajectory.t)} samples, between which a "
            f"link turns by up to {turn:.2g} rad; allowed is {_LARGEST_TURN:g} rad: simulate it "
            "with more --samples"
        )
    return _cubics(trajectory)


def _is_dense(trajectory: Trajectory) -> bool:
    """Return whether a trajectory is known between its samples."""
    try:
        trajectory.at(trajectory.t[:1])
    except SimulationError:
        return False
    return True


def _cubics(trajectory: Trajectory) -> States:
    """Return cubics between samples and impacts, which take their ends' angles and speeds."""
    t, q, before, after = _with_impacts(trajectory)

    def at(times: Array) -> tuple[Array, Array]:
        index = np.clip(np.searchsorted(t, times, side="right") - 1, 0, len(t) - 2)
        start, h = t[index], np.diff(t)[index]
        s = (np.asarray(times) - start) / h
        q0, q1 = q[:, index], q[:, index + 1]
        # Speeds leave a knot as they are after it, and arrive as they are before.
        d0, d1 = after[:, index] * h, before[:, index + 1] * h
        rise = q1 - q0
        square, cube = 3 * rise - 2 * d0 - d1, d0 + d1 - 2 * rise
        angles = q0 + s * (d0 + s * (square + s * cube))
        return angles, (d0 + s * (2 * square + 3 * s * cube)) / h

    return at


def _with_impacts(trajectory: Trajectory) -> tuple[Array, Array, Array, Array]:
    """Return times, angles, and speeds before and after, at samples and at impacts between."""
    struck: dict[float, list[Array]] = {}
    for impact in trajectory.impacts:
        before, after = (np.array(speeds) for speeds in impact.u)
        # Of several at one instant, the first is met and the last is left.
        struck.setdefault(impact.time, [before, after])[1] = after
    samples = {float(time): k for k, time in enumerate(trajectory.t)}
    inside = (time for time in struck if trajectory.t[0] < time < trajectory.t[-1])
    times = np.array(sorted({*samples, *inside}))
    q, before, after = (np.empty((2, len(times))) for _ in range(3))
    for k, time in enumerate(times):
        if time in samples:
            q[:, k] = trajectory.q[:, samples[time]]
            before[:, k] = after[:, k] = trajectory.u[:, samples[time]]
        if time in struck:
            before[:, k], after[:, k] = struck[time]
        if time not in samples:
            q[:, k] = q[:, k - 1] + (time - times[k - 1]) * (after[:, k - 1] + before[:, k]) / 2
    return times, q, before, after
