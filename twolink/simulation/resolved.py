"""Motions by single runs whose steps resolve all changes of the loads."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from twolink.integration.precisions import PrecisionName
from twolink.limits import DEFAULT_LIMITS, Limits
from twolink.names import EquationsName
from twolink.scene import Scene
from twolink.simulation.motion import has_events, motion_run
from twolink.simulation.run import MotionRun
from twolink.simulation.shortened import MOST_STEPS_TO_RESOLVE, CheckedRun, shortened_run
from twolink.simulation.smooth.longest_step import default_longest_step
from twolink.simulation.smooth.residuals import residuals_of


def resolved_run(
    scene: Scene,
    times: Any,
    *,
    formulation: EquationsName,
    precision: PrecisionName = "double",
    order: int | None = None,
    progress: Callable[[float], None] | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> MotionRun:
    """Return the `motion_run` of a scene, repeated until no step passes a change of the loads.

    Raises `UnseenError` where even short steps do, beside the errors of `motion_run`.
    """
    longest, shortest = default_longest_step(scene), scene.duration / MOST_STEPS_TO_RESOLVE

    def made(longest: float) -> CheckedRun:
        residuals = None if has_events(scene) else residuals_of(scene, formulation)
        look = None if residuals is None else residuals.until_passed(longest, shortest)
        run = motion_run(
            scene,
            times,
            formulation=formulation,
            precision=precision,
            order=order,
            longest_step=longest,
            observe=look,
            progress=progress,
            limits=limits,
        )
        needed = run.longest_resolving_step if residuals is None else residuals.longest_step
        return CheckedRun(run, needed)

    found: MotionRun = shortened_run(longest, shortest, made)
    return found
