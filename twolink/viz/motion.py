"""States of a trajectory at any time, by dense output or by interpolated samples."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from twolink.errors import PictureError, SimulationError
from twolink.simulation import Trajectory
from twolink.viz.shapes import Array

# Largest rotation of a link between two samples (rad). The error of a cubic Hermite interpolant is
# then at most about 1e-4 rad, which is invisible.
_LARGEST_TURN = 0.5

States = Callable[[Array], tuple[Array, Array]]


def resolution(trajectory: Trajectory) -> float:
    """Return the error of its states between samples (rad); 0 with dense output.

    For a smooth motion, cubics over every second sample have sixteen times the error of cubics over
    all samples.
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
    """Return a function of times (s) for q (rad) and u (rad/s), each of shape (2, n).

    It evaluates the dense output if there is one. A trajectory with samples only is interpolated by
    cubics between samples and impacts. Raises `PictureError` if the samples are too far apart.
    """
    if _is_dense(trajectory):
        return trajectory.at
    turn = float(np.abs(np.diff(trajectory.q)).max(initial=0.0))
    if len(trajectory.t) < 2 or not turn <= _LARGEST_TURN:
        raise PictureError(
            f"'{trajectory.scene.title}' has {len(trajectory.t)} samples; between them a link must "
            f"turn by at most {_LARGEST_TURN:g} rad; got {turn:.2g} rad: simulate it "
            "with more --samples"
        )
    return _cubics(trajectory)


def _is_dense(trajectory: Trajectory) -> bool:
    """Return whether a trajectory has dense output."""
    try:
        trajectory.at(trajectory.t[:1])
    except SimulationError:
        return False
    return True


def _cubics(trajectory: Trajectory) -> States:
    """Return cubic Hermite interpolants between samples and impacts."""
    t, q, before, after = _with_impacts(trajectory)

    def at(times: Array) -> tuple[Array, Array]:
        index = np.clip(np.searchsorted(t, times, side="right") - 1, 0, len(t) - 2)
        start, h = t[index], np.diff(t)[index]
        s = (np.asarray(times) - start) / h
        q0, q1 = q[:, index], q[:, index + 1]
        # A piece starts with the speeds after its first knot and ends with those before its last
        # one.
        d0, d1 = after[:, index] * h, before[:, index + 1] * h
        rise = q1 - q0
        square, cube = 3 * rise - 2 * d0 - d1, d0 + d1 - 2 * rise
        angles = q0 + s * (d0 + s * (square + s * cube))
        return angles, (d0 + s * (2 * square + 3 * s * cube)) / h

    return at


def _with_impacts(trajectory: Trajectory) -> tuple[Array, Array, Array, Array]:
    """Return times, angles, and speeds before and after, at samples and impacts."""
    struck: dict[float, list[Array]] = {}
    for impact in trajectory.impacts:
        before, after = (np.array(speeds) for speeds in impact.u)
        # Of simultaneous impacts, the first has the speed before and the last the speed after.
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
