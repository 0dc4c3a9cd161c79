"""URDF files: read as a planar two-link chain, and written from its parameters."""

from twolink.urdf.planar import LinkParameters, PlanarUrdf, parse_planar_urdf, read_planar_urdf
from twolink.urdf.writing import write_planar_urdf

__all__ = [
    "LinkParameters",
    "PlanarUrdf",
    "parse_planar_urdf",
    "read_planar_urdf",
    "write_planar_urdf",
]
