"""The contribution of each effect to the cost of a step, measured by omitting it."""

from __future__ import annotations

import statistics
from dataclasses import dataclass, replace

from twolink.effects import names_of
from twolink.limits import DEFAULT_LIMITS, Limits
from twolink.names import EquationsName
from twolink.scene import Scene
from twolink.simulation.motion import check_run, motion_run
from twolink.simulation.smooth.longest_step import default_longest_step
from twolink.tables import Column, Table, table

_REPEATS = 9


@dataclass(frozen=True)
class StepCost:
    """A step of the compiled integrator: operations for a term of the series, and time (s).

    `seconds` is the median of repeated runs, and `spread` their shortest and longest time.
    """

    operations: int
    seconds: float
    spread: tuple[float, float]


@dataclass(frozen=True)
class EffectsCost:
    """The cost of a step of a scene, and of the same scene without each of its effects."""

    whole: StepCost
    without: dict[str, StepCost]

    def table(self) -> Table:
        """Return the operations with all effects and without each, and the times."""
        columns = (
            "",
            Column("operations per term", number=True),
            Column("cost of this effect", number=True),
            Column("time per step (ns), median (range)", number=True, spare=1),
        )
        rows = [("all effects", str(self.whole.operations), "", _nanoseconds(self.whole))]
        for name, step in self.without.items():
            added = f"{self.whole.operations - step.operations} operations"
            rows.append((f"without {name}", str(step.operations), added, _nanoseconds(step)))
        return table("Cost of the effects", columns, rows)


def effects_cost(
    scene: Scene, *, formulation: EquationsName = "momenta", limits: Limits = DEFAULT_LIMITS
) -> EffectsCost:
    """Return the cost of a step with all effects, and with each one omitted.

    Operations are counted in the compiled code; times are medians of several interleaved runs.
    Raises `TooMuchError` if all of them together would exceed the `limits`.
    """
    check_run(scene, None, limits)
    scenes = {"": scene}
    for number, name in enumerate(names_of(scene.effects)):
        others = (*scene.effects[:number], *scene.effects[number + 1 :])
        scenes[name] = replace(scene, effects=others)
    ends = (0.0, scene.duration)
    times: dict[str, list[float]] = {name: [] for name in scenes}
    operations: dict[str, int] = {}
    each = replace(limits, seconds=limits.seconds / (_REPEATS * len(scenes)))
    for _ in range(_REPEATS):
        for name, variant in scenes.items():
            # The same cap for all, so that steps of equal length are compared if it is active.
            run = motion_run(
                variant,
                ends,
                formulation=formulation,
                longest_step=default_longest_step(scene),
                limits=each,
            )
            times[name].append(run.run_seconds / run.steps)
            operations[name] = run.operations
    costs = {
        name: StepCost(operations[name], statistics.median(taken), (min(taken), max(taken)))
        for name, taken in times.items()
    }
    return EffectsCost(whole=costs.pop(""), without=costs)


def _nanoseconds(cost: StepCost) -> str:
    """Return a time with its range: differences within the range mean nothing."""
    least, most = cost.spread
    return f"{cost.seconds * 1e9:.0f} ({least * 1e9:.0f} to {most * 1e9:.0f})"
