"""Refuses what is no finite number, wherever real numbers are given."""

from __future__ import annotations

import math
from numbers import Real
from typing import Any

from twolink.errors import ParameterError


def check_finite(where: str, **values: Any) -> None:
    """Raise `ParameterError` where a number, or an entry of a tuple of them, is not finite.

    Numbers of other kinds, such as symbols, are let pass.
    """
    for name, value in values.items():
        for entry in value if isinstance(value, tuple) else (value,):
            if isinstance(entry, Real) and not math.isfinite(entry):
                allowed = "are finite numbers" if isinstance(value, tuple) else "is a finite number"
                raise ParameterError(f"{where}: {name} is {value!r}; allowed {allowed}")
