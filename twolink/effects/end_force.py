"""The source's force P on the end point D, with Coulomb friction.

The source prints P = −sign(v_D·**i**) μ F **i** + F **j**. With y downward, F > 0 pushes D down
and a floor below D pushes with F < 0; then the printed friction would drive the sliding. Friction
opposes sliding whatever the side of the surface, so its size is μ|F|. The two agree for F ≥ 0.
"""

from dataclasses import dataclass

from twolink.arithmetic import Pair, Scalar, sign
from twolink.chain import Chain
from twolink.contact.coordinates import PointCoordinate
from twolink.contact.elements import DryFriction
from twolink.errors import ParameterError
from twolink.finite import check_finite
from twolink.kinematics import velocity
from twolink.loads import Force, Loads


@dataclass(frozen=True)
class EndForce:
    """P on D: `normal` F along y (N), and friction μ|F| along x, against the sliding of D.

    `friction` is the coefficient μ ≥ 0 while D slides, `static` the one while it sticks (the same
    unless given). `sliding` is the direction in which D slides, +1 or −1; without it, the sign of
    v_D·**i** in the given state. Where that is zero, D may stick: Coulomb's law then gives a set of
    forces and not one. A simulation finds the one that the motion demands (it makes modes of
    sticking and slipping); `loads` raises an error there unless a direction is named.
    """

    normal: float
    friction: float = 0
    sliding: int | None = None
    static: float | None = None

    def __post_init__(self) -> None:
        """Refuse friction that drives, and directions that are none."""
        check_finite("end force", normal=self.normal)
        if isinstance(self.friction, (int, float)) and not 0 <= self.friction < float("inf"):
            raise ParameterError(
                f"end force: friction is {self.friction!r}; allowed is zero or a positive number"
            )
        if self.sliding not in (None, 1, -1):
            raise ParameterError(
                f"end force: sliding is {self.sliding!r}; allowed is +1 or -1, or None to take it "
                "from the velocity of D"
            )

        if self.static is not None and not self.friction <= self.static < float("inf"):
            raise ParameterError(
                f"end force: static is {self.static!r}; allowed is the friction {self.friction!r} "
                "or more"
            )

    def nonsmooth(self, chain: Chain) -> tuple[DryFriction, ...]:
        """Return the friction of D, unless there is none or its direction is named."""
        static = self.friction if self.static is None else self.static
        if static == 0 or self.sliding is not None:
            return ()
        size = abs(self.normal)
        along_x = PointCoordinate("D", (1.0, 0.0))
        return (DryFriction("D", along_x, self.friction * size, static * size),)

    def smooth_loads(self, chain: Chain, q: Pair, u: Pair, t: Scalar = 0.0) -> Loads:
        """Return P without what `nonsmooth` hands over."""
        if self.nonsmooth(chain):
            return (Force(chain.D, (0, self.normal)),)
        return self.loads(chain, q, u, t)

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
