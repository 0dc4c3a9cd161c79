"""Registry of the engines that come with this library.

    for engine in SIMULATORS:
        if not engine.missing() and not engine.unsupported(scene):
            run = engine.prepared(scene, engine.methods[0].name)
            motion = run(1e-3, times)

An engine's package is imported on first use.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TypeVar

from twolink.engines.contract import Engine
from twolink.engines.diffrax_engine import Diffrax
from twolink.engines.drake_engine import Drake
from twolink.engines.heyoka_lagrangian import HeyokaLagrangian
from twolink.engines.mujoco_engine import Mujoco
from twolink.engines.pinocchio_engine import PinocchioEngine
from twolink.engines.pybullet_engine import Pybullet
from twolink.engines.scipy_pinocchio import ScipyOverPinocchio
from twolink.engines.simulation_engine import SimulationEngine
from twolink.engines.sympy_code import SympyCode
from twolink.errors import EngineError
from twolink.text import choice

ENGINES: tuple[Engine, ...] = (
    PinocchioEngine(),
    HeyokaLagrangian(),
    ScipyOverPinocchio(),
    Mujoco(),
    Drake(),
    Diffrax(),
    Pybullet(),
    SympyCode(),
)

SIMULATORS = tuple(engine for engine in ENGINES if isinstance(engine, SimulationEngine))
"""The engines that simulate scenes."""

_Named = TypeVar("_Named")


def by_name(name: str, known: Mapping[str, _Named]) -> _Named:
    """Return an entry by its name, ignoring case, or by the unique beginning of one of its words.

    Raises `EngineError` with the known names.
    """
    wanted = name.casefold()
    exact = [each for whole, each in known.items() if whole.casefold() == wanted]
    begins = re.compile(rf"\b{re.escape(wanted)}")
    alike = [each for whole, each in known.items() if wanted and begins.search(whole.casefold())]
    if not exact and len(alike) != 1:
        raise EngineError(choice("engine", name, known))
    return (exact or alike)[0]
