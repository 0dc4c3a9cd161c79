"""Gravity: G_1 = m1 g **j** at C1 and G_2 = m2 g **j** at C2 (source, section 6.1)."""

from dataclasses import dataclass

from twolink.arithmetic import Pair, Scalar
from twolink.chain import Chain
from twolink.kinematics import position
from twolink.loads import Force, Loads


@dataclass(frozen=True)
class Gravity:
    """Uniform gravity of size g (m/s²) along y, that is downward."""

    g: Scalar = 9.81

    def loads(self, chain: Chain, q: Pair, u: Pair) -> Loads:
        """Return the weight of each link, at its mass centre."""
        return (
            Force(chain.C1, (0, chain.m1 * self.g)),
            Force(chain.C2, (0, chain.m2 * self.g)),
        )

    def potential_energy(self, chain: Chain, q: Pair) -> Scalar:
        """Return V (J), zero where both mass centres are level with A; y points down."""
        _, y1 = position(chain, q, chain.C1)
        _, y2 = position(chain, q, chain.C2)
        return -self.g * (chain.m1 * y1 + chain.m2 * y2)
