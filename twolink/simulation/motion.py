"""Motion by Taylor series, with events where the scene calls for them and without where not."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from twolink.effects import breaks, nonsmooth
from twolink.scene import Scene
from twolink.simulation.run import MotionRun
from twolink.simulation.smooth.taylor import taylor_run


def has_modes(scene: Scene) -> bool:
    """Return whether any effect of a scene makes modes: dry friction, or obstacles."""
    return bool(nonsmooth(scene.effects, scene.equipped))


def has_events(scene: Scene) -> bool:
    """Return whether a scene's motion is not smooth throughout: it has modes, or breaks."""
    return has_modes(scene) or bool(breaks(scene.effects))


def motion_run(
    scene: Scene,
    times: Any,
    *,
    formulation: str,
    precision: str = "double",
    order: int | None = None,
    longest_step: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> MotionRun:
    """Return a scene's motion at increasing times (s), the first of them 0.

    Modes are written with speeds: in place of momenta they take Lagrange's equations.
    """
    options: dict[str, Any] = {
        "formulation": formulation,
        "precision": precision,
        "order": order,
        "longest_step": longest_step,
        "progress": progress,
    }
    if has_events(scene):
        # What a scene does not call for is not even imported.
        from twolink.simulation.hybrid.run import hybrid_run

        return hybrid_run(scene, times, **options)
    return taylor_run(scene, times, **options)
