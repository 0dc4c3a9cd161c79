"""The capabilities that an engine names at its start, which decide what it is asked."""

from __future__ import annotations

from twolink.conformance.quantities import QUANTITIES
from twolink.engines.messages import About


def mistake_in(about: About) -> str:
    """Return what is wrong with the capabilities of an engine, or an empty string.

    A misspelt quantity would never be asked for, and two methods of one name not be told apart.
    """
    unknown = [name for name in about.answers if name not in QUANTITIES]
    if unknown:
        return f"answers must be of {', '.join(QUANTITIES)}; got {', '.join(unknown)}"
    names = [method.name for method in about.methods]
    again = sorted({name for name in names if names.count(name) > 1})
    if again:
        return f"methods must have different names; got {', '.join(again)} several times"
    return ""
