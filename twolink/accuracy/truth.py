"""What is true of a scene's motion: a run so precise that it can judge all others."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from twolink.scene import Scene
from twolink.simulation.hybrid.mode import Event, Impact
from twolink.simulation.motion import has_modes, motion_run

# Where error grows, it is largest at the end; and what stands between two steps is, for most
# methods, an interpolant of lower order than theirs. So a smooth motion is judged at its end.
_SAMPLES_WITH_MODES = 101


@dataclass(frozen=True)
class Truth:
    """The states at some times (s), q (rad) and u (rad/s) of shape (2, n), and the events.

    `source` says by what computation.
    """

    times: Any
    q: Any
    u: Any
    events: tuple[Event, ...]
    impacts: tuple[Impact, ...]
    source: str


def judging_times(scene: Scene) -> Any:
    """Return the times (s) at which runs are judged: the end, or samples where there are modes."""
    count = _SAMPLES_WITH_MODES if has_modes(scene) else 2
    return np.linspace(0.0, scene.duration, count)


def truth(scene: Scene, times: Any) -> Truth:
    """Return a scene's motion in quadruple precision (113 bits), by Kane's equations.

    The ways in quadruple precision are written with others, so that no run judges itself.
    """
    run = motion_run(scene, times, formulation="kane", precision="quadruple")
    return Truth(times, run.q, run.u, run.events, run.log, "113-bit Taylor series, order 41")


def largest_difference(truth: Truth, q: Any, u: Any) -> float:
    """Return the largest error of any angle or speed (rad, rad/s); NaN if any is not finite."""
    kind = type(truth.q.flat[0])
    exact = np.concatenate([truth.q, truth.u])
    found = np.vectorize(kind, otypes=[exact.dtype])(np.concatenate([q, u]))
    errors = np.abs(found - exact).astype(float)
    return float(np.max(errors))
