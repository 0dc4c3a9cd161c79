"""Formulations against engines: states, tolerances, quantities, and the verdict on them."""

from twolink.verification.verify import Comparison, Verdict, verify

__all__ = ["Comparison", "Verdict", "verify"]
