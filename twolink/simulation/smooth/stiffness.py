"""The number of steps that Taylor series need for a stiff motion, from a run by another method."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from twolink.effects import pieces_at
from twolink.scene import Scene
from twolink.simulation.run import Array
from twolink.simulation.smooth.rates import jacobians_of


def steps_of_series(scene: Scene, times: Array, run: Any) -> float:
    """Return an estimate of the number of steps along a run, which has q and u at times (s).

    A step is about as long as the time in which a link turns by a radian, or a small deviation
    changes by e: the inverse of the largest eigenvalue of the linearized motion. The loads are
    those of the first pieces of effects.
    """
    smooth = replace(scene, effects=pieces_at(scene.effects, 0.0))
    states = np.concatenate([run.q, run.u]).astype(float)
    if not np.isfinite(states).all():
        return np.inf
    jacobians = jacobians_of(smooth, "lagrange")(states, times).transpose(2, 0, 1)
    if not np.isfinite(jacobians).all():
        return np.inf
    fastest = np.abs(np.linalg.eigvals(jacobians)).max(axis=1)
    paces = np.maximum(fastest, np.abs(states[2:]).max(axis=0))
    return float((np.diff(times) * np.maximum(paces[1:], paces[:-1])).sum())
