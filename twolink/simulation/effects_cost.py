"""What each effect of a scene adds to the cost of a step, by leaving it out in turn."""

from __future__ import annotations

import statistics
from dataclasses import dataclass, replace

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
    """The cost of a scene's step, and of the same scene without each of its effects."""

    whole: StepCost
    without: dict[str, StepCost]


def effects_cost(scene: Scene, *, formulation: str = "momenta") -> EffectsCost:
    """Return what a step costs with all effects, and with each left out in turn.

    Operations are counted in the compiled code; times are medians of several runs in turn.
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
            # The same cap for all, since it may bind: steps of one length are compared.
            run = motion_run(
                variant, ends, formulation=formulation, longest_step=default_longest_step(scene)
            )
            times[name].append(run.run_seconds / run.steps)
            operations[name] = run.operations
    costs = {
        name: StepCost(operations[name], statistics.median(taken)) for name, taken in times.items()
    }
    return EffectsCost(whole=costs.pop(""), without=costs)
