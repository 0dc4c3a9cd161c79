"""The contract of engines, its errors and its arrays, for the authors of engines."""

from twolink.engines.contract import Array, Engine
from twolink.engines.faults import CannotError, ModelRefusedError

__all__ = ["Array", "CannotError", "Engine", "ModelRefusedError"]
