"""The comparisons of a trajectory with another one, by name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numpy.random import Generator

from tests.campaign.knots import undisturbed
from tests.campaign.reference import compared

Comparison = Callable[[Any, Generator], tuple[list[tuple[str, str]], str]]
"""Takes a trajectory and random numbers; returns violations, and a remark on the comparison."""

COMPARISONS: dict[str, Comparison] = {"reference": compared, "knots": undisturbed}
