"""Validation of numbers."""

from __future__ import annotations

import math
from numbers import Real
from typing import Any

from twolink.errors import ParameterError


def check_finite(where: str, **values: Any) -> None:
    """Raise `ParameterError` if a real number, or an entry of a tuple, is not finite.

    Other types, such as symbols, are not checked.
    """
    for name, value in values.items():
        for entry in value if isinstance(value, tuple) else (value,):
            if isinstance(entry, Real) and not math.isfinite(entry):
                required = "finite numbers" if isinstance(value, tuple) else "a finite number"
                raise ParameterError(f"{where}: {name} must be {required}; got {value!r}")
