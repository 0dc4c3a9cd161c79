"""Motion by Taylor series, with events where the scene calls for them and without where not."""

from __future__ import annotations

from typing import Any

from twolink.effects import Effect
from twolink.scene import Scene
from twolink.simulation.run import MotionRun
from twolink.simulation.taylor import taylor_run


def has_modes(effects: tuple[Effect, ...]) -> bool:
    """Return whether any effect makes joints stick and slip."""
    return any(getattr(effect, "has_modes", False) for effect in effects)


def motion_run(
    scene: Scene,
    times: Any,
    *,
    formulation: str,
    precision: str = "double",
    longest_step: float | None = None,
) -> MotionRun:
    """Return a scene's motion at increasing times (s), the first of them 0.

    With stick and slip the modes are written with Lagrange's equations, whatever the formulation.
    """
    if has_modes(scene.effects):
        # What a scene does not call for is not even imported.
        from twolink.simulation.events import event_run

        return event_run(scene, times, precision=precision, longest_step=longest_step)
    return taylor_run(
        scene, times, formulation=formulation, precision=precision, longest_step=longest_step
    )
