"""Registry of the external engines that can simulate scenes.

    for engine in ENGINES:
        if not engine.missing() and not engine.unsupported(scene):
            run = engine.prepared(scene, engine.methods[0].name)
            motion = run(1e-3, times)

An engine's package is imported on first use.
"""

from __future__ import annotations

from twolink.engines.diffrax_engine import Diffrax
from twolink.engines.drake_engine import Drake
from twolink.engines.heyoka_lagrangian import HeyokaLagrangian
from twolink.engines.mujoco_engine import Mujoco
from twolink.engines.pybullet_engine import Pybullet
from twolink.engines.scipy_pinocchio import ScipyOverPinocchio
from twolink.engines.simulation_engine import (
    ApproximatingEngine,
    EngineMethod,
    EngineRun,
    Prepared,
    SimulationEngine,
)
from twolink.engines.sympy_code import SympyCode
from twolink.errors import EngineError

__all__ = [
    "ENGINES",
    "ApproximatingEngine",
    "EngineMethod",
    "EngineRun",
    "Prepared",
    "SimulationEngine",
    "engine_named",
]

ENGINES: tuple[SimulationEngine, ...] = (
    HeyokaLagrangian(),
    ScipyOverPinocchio(),
    Mujoco(),
    Drake(),
    Diffrax(),
    Pybullet(),
    SympyCode(),
)


def engine_named(name: str) -> SimulationEngine:
    """Return an engine by name, ignoring case. Raises `EngineError` with the known names."""
    for engine in ENGINES:
        if engine.name.casefold() == name.casefold():
            return engine
    allowed = ", ".join(engine.name for engine in ENGINES)
    raise EngineError(f"engine must be one of {allowed}; got '{name}'")
