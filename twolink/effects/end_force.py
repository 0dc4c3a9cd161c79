"""The source's force P on the end point D, with Coulomb friction.

The source prints P = −sign(v_D·**i**) μ F **i** + F **j**. With y downward, F > 0 pushes D down
and a floor below D pushes with F < 0; then the printed friction would drive the sliding. Friction
opposes sliding whatever the side of the surface, so its size is μ|F|. The two agree for F ≥ 0.
"""

from dataclasses import dataclass

from twolink.arithmetic import Pair, Scalar, sign
from twolink.chain import Chain
from twolink.errors import ParameterError
from twolink.kinematics import velocity
from twolink.loads import Force, Loads


@dataclass(frozen=True)
class EndForce:
    """P on D: `normal` F along y (N), and friction μ|F| along x, against the sliding of D.

    `friction` is the coefficient μ ≥ 0. `sliding` is the direction in which D slides, +1 or −1;
    without it, the sign of v_D·**i** in the given state. Where that is zero, D may stick: Coulomb's
    law then gives a set of forces and not one, so a direction must be named, or an error is raised.
    """

    normal: float
    friction: float = 0
    sliding: int | None = None

    def __post_init__(self) -> None:
        """Refuse friction that drives, and directions that are none."""
        if isinstance(self.friction, (int, float)) and not 0 <= self.friction < float("inf"):
            raise ParameterError(
                f"end force: friction is {self.friction!r}; allowed is zero or a positive number"
            )
        if self.sliding not in (None, 1, -1):
            raise ParameterError(
                f"end force: sliding is {self.sliding!r}; allowed is +1 or -1, or None to take it "
                "from the velocity of D"
            )

    @property
    def may_stick(self) -> bool:
        """Whether D may stop sliding, where its friction is no single force."""
        return self.friction != 0 and self.sliding is None

    def loads(self, chain: Chain, q: Pair, u: Pair, t: Scalar = 0.0) -> Loads:
        """Return P at D. Raises `ParameterError` where D does not slide and μ is not zero."""
        if isinstance(self.friction, (int, float)) and self.friction == 0:
            return (Force(chain.D, (0, self.normal)),)
        direction = self.sliding if self.sliding is not None else self._sliding(chain, q, u)
        return (Force(chain.D, (-direction * self.friction * abs(self.normal), self.normal)),)

    def _sliding(self, chain: Chain, q: Pair, u: Pair) -> Scalar:
        vx, _ = velocity(chain, q, u, chain.D)
        direction = sign(vx)
        if _anywhere(direction == 0):
            raise ParameterError(
                "end force: D does not slide (v_D·i is zero), where friction is any force up to "
                "mu |F|; allowed is a state with sliding, or sliding=+1 or -1"
            )
        return direction


def _anywhere(condition: object) -> bool:
    """Return whether a condition on a number, or on any entry of an array, is true."""
    return bool(getattr(condition, "any", lambda: condition)())
