"""Linear torsion springs in the joints A and B."""

from dataclasses import dataclass

from twolink.arithmetic import Pair, Scalar
from twolink.chain import Chain
from twolink.effects.effect import ConservativeEffect
from twolink.inputs import take_fields
from twolink.loads import Loads, motor_loads
from twolink.validation import check_finite


@dataclass(frozen=True)
class JointSpring(ConservativeEffect):
    """Springs of the joints A and B: stiffness (N m/rad) and the angles of rest (rad).

    The spring at A is at rest at q1 = rest[0], the one at B at q2 − q1 = rest[1].
    """

    stiffness: tuple[float, float]
    rest: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        """Require finite numbers."""
        take_fields(self, "joint spring")
        check_finite("joint spring", stiffness=self.stiffness, rest=self.rest)

    def loads(self, chain: Chain, q: Pair, u: Pair, t: Scalar = 0.0) -> Loads:
        """Return the torques towards rest."""
        (k1, k2), (x1, x2) = chain.scalars(self.stiffness), self._stretch(chain, q)
        return motor_loads(-k1 * x1, -k2 * x2)

    def potential_energy(self, chain: Chain, q: Pair) -> Scalar:
        """Return V (J), zero at rest."""
        (k1, k2), (x1, x2) = chain.scalars(self.stiffness), self._stretch(chain, q)
        return (k1 * x1 * x1 + k2 * x2 * x2) / 2

    def _stretch(self, chain: Chain, q: Pair) -> Pair:
        (q1, q2), (rest1, rest2) = q, chain.scalars(self.rest)
        return q1 - rest1, q2 - q1 - rest2
