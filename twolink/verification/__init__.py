"""Compare formulations with engines: random states, derived tolerances, quantities, verdict."""

from twolink.verification.verdict import Comparison, Verdict
from twolink.verification.verify import verify

__all__ = ["Comparison", "Verdict", "verify"]
