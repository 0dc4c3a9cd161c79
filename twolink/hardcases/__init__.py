"""Hard cases for dynamics code, each with a known outcome and an error bound."""

from twolink.hardcases.record import Case, Column, Mark, Outcome, Result, Trial

__all__ = ["Case", "Column", "Mark", "Outcome", "Result", "Trial"]
