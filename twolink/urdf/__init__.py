"""URDF to the planar two-link chain and back.

`read_planar_urdf` finds the chain in any URDF that describes one; `write_planar_urdf` writes a
URDF that reads back to the same bits and that Pinocchio, MuJoCo, Drake and PyBullet load.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from twolink.urdf.link_parameters import LinkParameters
    from twolink.urdf.planar import PlanarUrdf, parse_planar_urdf, read_planar_urdf
    from twolink.urdf.writing import JointProperties, write_planar_urdf

# Public names and their modules, imported on first use: most scenes have no URDF.
_HOMES = {
    "JointProperties": "twolink.urdf.writing",
    "LinkParameters": "twolink.urdf.link_parameters",
    "PlanarUrdf": "twolink.urdf.planar",
    "parse_planar_urdf": "twolink.urdf.planar",
    "read_planar_urdf": "twolink.urdf.planar",
    "write_planar_urdf": "twolink.urdf.writing",
}

__all__ = [
    "JointProperties",
    "LinkParameters",
    "PlanarUrdf",
    "parse_planar_urdf",
    "read_planar_urdf",
    "write_planar_urdf",
]


def __getattr__(name: str) -> Any:
    """Return a public name from its module."""
    if name not in _HOMES:
        raise AttributeError(f"module 'twolink.urdf' has no attribute {name!r}")
    return getattr(importlib.import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    """Return the names, including those not imported yet."""
    return sorted({*globals(), *__all__})
