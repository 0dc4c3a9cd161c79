"""High-precision reference trajectory against which errors are measured."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from twolink.limits import UNLIMITED, Limits
from twolink.scene import Scene
from twolink.simulation.hybrid.mode import Event, Impact
from twolink.simulation.motion import has_modes
from twolink.simulation.resolved import resolved_run

# Growing errors are largest at the end, and between two steps most methods have only an
# interpolant of lower order than their own. A smooth motion is therefore compared at its end.
_SAMPLES_WITH_MODES = 101


@dataclass(frozen=True)
class ReferenceTrajectory:
    """The states at some times (s), q (rad) and u (rad/s) of shape (2, n), and the events.

    `source` describes the computation. `notes` are sentences on what is not simulated, and on
    choices that the laws of contact leave.
    """

    times: Any
    q: Any
    u: Any
    events: tuple[Event, ...]
    impacts: tuple[Impact, ...]
    source: str
    notes: tuple[str, ...] = ()


def comparison_times(scene: Scene) -> Any:
    """Return the times (s) at which errors are measured: the end, or samples if there are modes."""
    count = _SAMPLES_WITH_MODES if has_modes(scene) else 2
    return np.linspace(0.0, scene.duration, count)


def reference_trajectory(
    scene: Scene, times: Any, *, limits: Limits = UNLIMITED
) -> ReferenceTrajectory:
    """Return a scene's motion in quadruple precision (113 bits), by Kane's equations.

    Configurations in quadruple precision use other equations, so that each comparison is
    independent. Raises `TooMuchError` if the run would exceed the `limits`, and
    `IntegrationError` if its steps pass a change of the loads.
    """
    run = resolved_run(scene, times, formulation="kane", precision="quadruple", limits=limits)
    # Other runs judge the events that round-off might decide.
    notes = (*scene.notes, *run.decided(times, np.zeros(len(times))).notes)
    source = "113-bit Taylor series, order 41"
    return ReferenceTrajectory(times, run.q, run.u, run.events, run.log, source, notes)


def largest_difference(reference: ReferenceTrajectory, q: Any, u: Any) -> float:
    """Return the largest error of any angle or speed (rad, rad/s); NaN if any is not finite."""
    kind = type(reference.q.flat[0])
    exact = np.concatenate([reference.q, reference.u])
    found = np.vectorize(kind, otypes=[exact.dtype])(np.concatenate([q, u]))
    errors = np.abs(found - exact).astype(float)
    return float(np.max(errors))
