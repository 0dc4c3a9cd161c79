"""The catalogue of hard cases: what breaks dynamics code, each with a known outcome and a bound."""

from twolink.hardcases.record import Case, Column, Finding, Mark, Outcome, Trial

__all__ = ["Case", "Column", "Finding", "Mark", "Outcome", "Trial"]
