"""Compare formulations with engines: random states, derived tolerances, quantities, verdict."""

from twolink.verification.verify import Comparison, Verdict, verify

__all__ = ["Comparison", "Verdict", "verify"]
