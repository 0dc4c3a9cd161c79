"""Method configurations of external engines: each method with its own parameter."""

from __future__ import annotations

from typing import Any

from twolink.accuracy.method_configurations import (
    STEPS,
    TOLERANCES,
    MeasuredRun,
    MethodConfiguration,
)
from twolink.engines.messages import Method
from twolink.engines.registry import SIMULATORS
from twolink.engines.simulation_engine import Prepared, SimulationEngine
from twolink.scene import Scene


def engine_configurations(scene: Scene) -> tuple[tuple[MethodConfiguration, ...], tuple[str, ...]]:
    """Return configurations of the engines that support a scene, and reasons for the others."""
    configurations: list[MethodConfiguration] = []
    left_out: list[str] = []
    for engine in SIMULATORS:
        reason = engine.missing() or engine.unsupported(scene)
        if reason:
            left_out.append(f"{engine.name}: {reason}")
        else:
            configurations.extend(
                _configuration(scene, engine, method) for method in engine.methods
            )
    return tuple(configurations), tuple(left_out)


def _configuration(scene: Scene, engine: SimulationEngine, method: Method) -> MethodConfiguration:
    ready: list[Prepared] = []

    def run(value: float, times: Any) -> MeasuredRun:
        if not ready:
            # Each engine is built when it is first used.
            ready.append(engine.prepared(scene, method.name))
        found = ready[0](value, times)
        cost = (found.seconds, found.setup_seconds, found.steps, found.evaluations)
        return MeasuredRun(found.q, found.u, *cost, warnings=found.warnings)

    sweep = TOLERANCES if method.parameter == "tolerance" else STEPS
    order = None if method.order is None else int(method.order)
    return MethodConfiguration(
        engine.name, method.name, "", "double", order, method.parameter, sweep, run
    )
