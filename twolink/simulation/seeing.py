"""Motions by single runs whose steps pass no change of the loads."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from twolink.errors import IntegrationError
from twolink.integration.precisions import PrecisionName
from twolink.limits import DEFAULT_LIMITS, Limits
from twolink.names import EquationsName
from twolink.scene import Scene
from twolink.simulation.motion import has_events, motion_run
from twolink.simulation.run import MotionRun
from twolink.simulation.shortened import MOST_STEPS_TO_SEE, Looked, UnseenError, shortened_run
from twolink.simulation.smooth.longest_step import default_longest_step
from twolink.simulation.smooth.residuals import residuals_of


def seeing_run(
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

    Raises `IntegrationError` where even short steps do, beside the errors of `motion_run`.
    """
    longest, shortest = default_longest_step(scene), scene.duration / MOST_STEPS_TO_SEE

    def made(longest: float) -> Looked:
        residuals = None if has_events(scene) else residuals_of(scene, formulation)
        run = motion_run(
            scene,
            times,
            formulation=formulation,
            precision=precision,
            order=order,
            longest_step=longest,
            observe=residuals,
            progress=progress,
            limits=limits,
        )
        return Looked(run, run.longest_that_sees if residuals is None else residuals.longest_step)

    return seen(lambda: shortened_run(longest, shortest, made))


def seen(run: Callable[[], Any]) -> Any:
    """Return a run. Raises `IntegrationError` where its steps pass a change of the loads."""
    try:
        return run()
    except UnseenError as error:
        raise IntegrationError(f"the motion cannot be followed: {error}") from error
