"""The contribution of each effect to the cost of a step, measured by omitting it."""

from __future__ import annotations

import statistics
from dataclasses import dataclass, replace

from twolink.formulations import EquationsName
from twolink.scene import Scene
from twolink.simulation.motion import motion_run
from twolink.simulation.smooth.taylor import default_longest_step

_REPEATS = 9


@dataclass(frozen=True)
class StepCost:
    """A step of the compiled integrator: operations for a term of the series, and time (s)."""

    operations: int
    seconds: float


@dataclass(frozen=True)
class EffectsCost:
    """The cost of a step of a scene, and of the same scene without each of its effects."""

    whole: StepCost
    without: dict[str, StepCost]


def effects_cost(scene: Scene, *, formulation: EquationsName = "momenta") -> EffectsCost:
    """Return the cost of a step with all effects, and with each one omitted.

    Operations are counted in the compiled code; times are medians of several interleaved runs.
    """
    scenes = {"": scene}
    for number, effect in enumerate(scene.effects):
        name = type(effect).__name__
        others = (*scene.effects[:number], *scene.effects[number + 1 :])
        key = name if name not in scenes else f"{name} {number + 1}"
        scenes[key] = replace(scene, effects=others)
    ends = (0.0, scene.duration)
    times: dict[str, list[float]] = {name: [] for name in scenes}
    operations: dict[str, int] = {}
    for _ in range(_REPEATS):
        for name, variant in scenes.items():
            # The same cap for all, so that steps of equal length are compared if it is active.
            run = motion_run(
                variant, ends, formulation=formulation, longest_step=default_longest_step(scene)
            )
            times[name].append(run.run_seconds / run.steps)
            operations[name] = run.operations
    costs = {
        name: StepCost(operations[name], statistics.median(taken)) for name, taken in times.items()
    }
    return EffectsCost(whole=costs.pop(""), without=costs)
