"""Random numbers for scenes: plain floats from one generator per scene."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeVar

import numpy as np

T = TypeVar("T")


class Dice:
    """Draws from a generator of (seed, index); in some scenes all sizes are round numbers."""

    def __init__(self, seed: int, index: int) -> None:
        self.rng = np.random.default_rng([seed, index])
        self.round = self.chance(0.25)
        self.density = self.between(0.15, 0.6)

    def chance(self, probability: float) -> bool:
        """Return true with a probability."""
        return bool(self.rng.random() < probability)

    def wanted(self, weight: float = 1.0) -> bool:
        """Return true with this scene's own density of effects, times a weight."""
        return self.chance(min(1.0, weight * self.density))

    def pick(self, choices: Sequence[T]) -> T:
        """Return one of the choices."""
        return choices[int(self.rng.integers(len(choices)))]

    def between(self, low: float, high: float) -> float:
        """Return a number between two."""
        return float(self.rng.uniform(low, high))

    def decades(self, low: float, high: float) -> float:
        """Return 10 to a power between two, with two digits where all sizes are round."""
        value = 10.0 ** self.between(low, high)
        return self.rounded(value)

    def size(self, low: float, high: float) -> float:
        """Return a number between two, with two digits where all sizes are round."""
        return self.rounded(self.between(low, high))

    def normal(self, scale: float) -> float:
        """Return a normally distributed number, with two digits where all sizes are round."""
        return self.rounded(float(self.rng.normal(0.0, scale)))

    def rounded(self, value: float) -> float:
        """Return a value, with two significant digits where all sizes are round."""
        return float(f"{value:.2g}") if self.round else value

    def unit(self) -> tuple[float, float]:
        """Return a random unit vector."""
        angle = self.between(-math.pi, math.pi)
        return math.cos(angle), math.sin(angle)

    def pair(self, low: float, high: float) -> tuple[float, float]:
        """Return two numbers between two."""
        return self.size(low, high), self.size(low, high)

    def static(self, kinetic: float) -> float | None:
        """Return a static friction above the kinetic one, or None for the same."""
        return kinetic * self.between(1.0, 2.0) if self.chance(0.35) else None
