"""Motion by Taylor series, with event handling only for scenes that require it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from twolink.effects import contact_elements, discontinuities
from twolink.inputs import check_callback, check_instance
from twolink.integration.precisions import PrecisionName
from twolink.limits import DEFAULT_LIMITS, Limits
from twolink.names import EquationsName
from twolink.scene import Scene
from twolink.simulation.run import Lane, MotionRun
from twolink.simulation.smooth.steps import Observer
from twolink.simulation.smooth.taylor import taylor_run


def check_run(scene: Any, progress: Any, limits: Any) -> None:
    """Raise `ParameterError` for arguments that every run of a scene takes, and that are wrong."""
    check_instance("scene", scene, Scene)
    check_callback("progress", progress, ("name", "share"))
    check_instance("limits", limits, Limits)


def has_modes(scene: Scene) -> bool:
    """Return whether a scene has modes: whether an effect has dry friction or contact."""
    return bool(contact_elements(scene.effects, scene.moving_chain))


def has_events(scene: Scene) -> bool:
    """Return whether the motion is not smooth throughout: it has modes or discontinuities."""
    return has_modes(scene) or bool(discontinuities(scene.effects))


def motion_run(
    scene: Scene,
    times: Any,
    *,
    formulation: EquationsName,
    precision: PrecisionName = "double",
    order: int | None = None,
    longest_step: float | None = None,
    evaluated_in: PrecisionName | None = None,
    lane: Lane | None = None,
    observe: Observer | None = None,
    progress: Callable[[float], None] | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> MotionRun:
    """Return the motion of a scene at increasing times (s), the first of them 0.

    A smooth motion is corrected by the defects of its steps if these are to be `evaluated_in` a
    precision, and is that of a `lane` of a bundle if one is given.

    `observe` receives the steps of any other smooth motion.
    Modes are formulated in speeds: Lagrange's equations replace those in momenta. Raises
    `TooMuchError` if the run would exceed the `limits`.
    """
    options: dict[str, Any] = {
        "formulation": formulation,
        "precision": precision,
        "order": order,
        "longest_step": longest_step,
        "progress": limits.timed(_named(scene, precision), progress),
    }
    if has_events(scene):
        # The hybrid simulator is imported only for scenes that require it.
        from twolink.simulation.hybrid.run import hybrid_run

        return hybrid_run(scene, times, limits=limits, **options)
    if evaluated_in is not None:
        from twolink.simulation.smooth.corrected import corrected_taylor_run

        return corrected_taylor_run(scene, times, evaluated_in=evaluated_in, **options)
    if lane is not None:
        from twolink.simulation.smooth.lane_run import lanes

        del options["precision"]
        return lanes(scene, times, size=lane.size, **options).run(lane.number, times)
    return taylor_run(scene, times, observe=observe, **options)


def _named(scene: Scene, precision: PrecisionName) -> str:
    """Return a run in words, for messages."""
    finer = "" if precision == "double" else f" in {precision} precision"
    return f"the motion over {scene.duration:g} s{finer}"
