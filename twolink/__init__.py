"""twolink: the reference suite for the planar two-link chain.

Parameters are in `twolink.chain`, the equations of motion in `twolink.kane` and
`twolink.lagrange`, and comparisons with engines in `twolink.verification`.
"""

import importlib
import sys
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    __version__: str
    from twolink.accuracy.enclosure import enclosure
    from twolink.accuracy.reference import reference
    from twolink.chain import Chain, Point
    from twolink.compilation import Compiled
    from twolink.ensembles.results import Results
    from twolink.ensembles.run import sweep
    from twolink.errors import (
        EngineError,
        ParameterError,
        SceneError,
        SimulationError,
        TwolinkError,
        UrdfError,
    )
    from twolink.scene import Scene
    from twolink.simulation.simulate import simulate
    from twolink.simulation.trajectory import Trajectory
    from twolink.variations.sensitivity import Sensitivity, sensitivity
    from twolink.variations.spectrum import lyapunov
    from twolink.verification.verify import verify

# Public names and their modules, imported on first use: `twolink --help` needs none.
_HOMES = {
    "Chain": "twolink.chain",
    "Compiled": "twolink.compilation",
    "EngineError": "twolink.errors",
    "ParameterError": "twolink.errors",
    "Point": "twolink.chain",
    "Results": "twolink.ensembles.results",
    "Scene": "twolink.scene",
    "SceneError": "twolink.errors",
    "Sensitivity": "twolink.variations.sensitivity",
    "SimulationError": "twolink.errors",
    "Trajectory": "twolink.simulation",
    "TwolinkError": "twolink.errors",
    "UrdfError": "twolink.errors",
    "enclosure": "twolink.accuracy.enclosure",
    "lyapunov": "twolink.variations.spectrum",
    "reference": "twolink.accuracy.reference",
    "sensitivity": "twolink.variations.sensitivity",
    "simulate": "twolink.simulation",
    "sweep": "twolink.ensembles.run",
    "verify": "twolink.verification",
}

__all__ = [
    "Chain",
    "Compiled",
    "EngineError",
    "ParameterError",
    "Point",
    "Results",
    "Scene",
    "SceneError",
    "Sensitivity",
    "SimulationError",
    "Trajectory",
    "TwolinkError",
    "UrdfError",
    "__version__",
    "enclosure",
    "lyapunov",
    "reference",
    "sensitivity",
    "simulate",
    "sweep",
    "verify",
]


def __getattr__(name: str) -> Any:
    """Return a public name from its module."""
    if name == "__version__":
        from importlib.metadata import version

        return version("twolink")
    if name not in _HOMES:
        raise AttributeError(f"module 'twolink' has no attribute {name!r}")
    return getattr(importlib.import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    """Return the public names, with those that are not imported yet, and imported modules."""
    modules = (name for name in globals() if f"{__name__}.{name}" in sys.modules)
    return sorted({*modules, *__all__})
