"""The mass matrix that other engines make of a URDF, each by its own reader."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from twolink.engines import registry
from twolink.engines.messages import Model

Array = NDArray[np.float64]
ENGINES = {
    engine.name.casefold(): engine
    for engine in registry.ENGINES
    if engine.name in ("Pinocchio", "MuJoCo", "Drake", "PyBullet")
}


def mass_matrices(engine: str, text: str, states: tuple[tuple[float, float], ...]) -> Array:
    """Return M at joint angles. Raises `EngineError` for a file that the engine refuses."""
    gravity, joints = (0.0, 0.0, -9.81), ("shoulder", "elbow")
    ENGINES[engine].load(Model(id=engine, urdf=text, gravity=gravity, joints=joints))
    return ENGINES[engine].evaluate("mass_matrix", {"angles": np.array(states)})
