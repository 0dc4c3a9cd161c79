"""Gravity: G_1 = m1 g **j** at C1 and G_2 = m2 g **j** at C2 (section 6.1 of the derivation)."""

import math
from dataclasses import dataclass

from twolink.arithmetic import Pair, Scalar
from twolink.chain import Chain
from twolink.effects.effect import ConservativeEffect
from twolink.errors import ParameterError
from twolink.inputs import take_fields
from twolink.kinematics import position
from twolink.loads import Force, Loads
from twolink.validation import check_finite


@dataclass(frozen=True)
class Gravity(ConservativeEffect):
    """Uniform gravity of size g (m/s²) along `direction` (x, y); by default y, downward."""

    g: float = 9.81
    direction: tuple[float, float] = (0.0, 1.0)

    def __post_init__(self) -> None:
        """Require a finite size and a non-zero direction."""
        take_fields(self, "gravity")
        check_finite("gravity", g=self.g)
        if not 0 < math.hypot(*self.direction) < math.inf:
            raise ParameterError(
                "gravity: direction must be two finite numbers, not both zero; got"
                f" {self.direction!r}"
            )

    @property
    def acceleration(self) -> Pair:
        """The components of g along x and y (m/s²), in float64."""
        size = math.hypot(*self.direction)
        x, y = self.direction
        return x / size * self.g if x else 0, y / size * self.g if y else 0

    def _acceleration(self, chain: Chain) -> Pair:
        """Return the components of g along x and y (m/s²), in the numbers of a chain."""
        (x, y), g = self.direction, chain.scalar(self.g)
        if not (x and y):
            # Along an axis g is exact, also as a fraction.
            return (g if x > 0 else -g) if x else 0, (g if y > 0 else -g) if y else 0
        x, y = chain.unit(self.direction)
        return x * g, y * g

    def loads(self, chain: Chain, q: Pair, u: Pair, t: Scalar = 0.0) -> Loads:
        """Return the weight of each link, at its mass centre."""
        gx, gy = self._acceleration(chain)
        return (
            Force(chain.C1, (chain.m1 * gx, chain.m1 * gy)),
            Force(chain.C2, (chain.m2 * gx, chain.m2 * gy)),
        )

    def potential_energy(self, chain: Chain, q: Pair) -> Scalar:
        """Return V (J), zero where both mass centres are at A."""
        gx, gy = self._acceleration(chain)
        x1, y1 = position(chain, q, chain.C1)
        x2, y2 = position(chain, q, chain.C2)
        return -(gx * (chain.m1 * x1 + chain.m2 * x2) + gy * (chain.m1 * y1 + chain.m2 * y2))
