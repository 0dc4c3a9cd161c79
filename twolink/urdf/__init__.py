"""URDF to the planar two-link chain and back.

`read_planar_urdf` finds the chain in any URDF that describes one; `write_planar_urdf` writes a
URDF that reads back to the same bits and that Pinocchio, MuJoCo, Drake and PyBullet load.
"""

from twolink.urdf.planar import (
    LinkParameters,
    PlanarUrdf,
    parse_planar_urdf,
    read_planar_urdf,
)
from twolink.urdf.writing import JointProperties, write_planar_urdf

__all__ = [
    "JointProperties",
    "LinkParameters",
    "PlanarUrdf",
    "parse_planar_urdf",
    "read_planar_urdf",
    "write_planar_urdf",
]
