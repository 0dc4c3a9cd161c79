"""twolink: the reference suite for the planar two-link chain.

Parameters are in `twolink.chain`, the equations of motion in `twolink.kane` and
`twolink.lagrange`, and what compares them with engines in `twolink.verification`.
"""

from twolink.chain import Chain, Point
from twolink.errors import EngineError, ParameterError, TwolinkError, UrdfError

__all__ = ["Chain", "EngineError", "ParameterError", "Point", "TwolinkError", "UrdfError"]
