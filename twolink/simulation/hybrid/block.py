"""Steps of an integrator, with their Taylor coefficients."""

from __future__ import annotations

from typing import Any, NamedTuple


class Block(NamedTuple):
    """Steps taken one after another: starts, lengths, and coefficients of shape (n, v, p + 1)."""

    starts: Any
    lengths: Any
    coefficients: Any
