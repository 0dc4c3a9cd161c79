"""Hard cases for dynamics code, each with a known outcome and an error bound."""

from twolink.engines.marks import Mark, Result
from twolink.hardcases.record import Case, Column, Outcome, Trial

__all__ = ["Case", "Column", "Mark", "Outcome", "Result", "Trial"]
