"""Linear drag on the end point D, as in a very viscous fluid."""

from dataclasses import dataclass
from numbers import Real

from twolink.arithmetic import Pair, Scalar
from twolink.chain import Chain
from twolink.effects.effect import Effect
from twolink.errors import ParameterError
from twolink.inputs import take_fields
from twolink.kinematics import velocity
from twolink.loads import Force, Loads


@dataclass(frozen=True)
class EndDrag(Effect):
    """A force −c v_D on D, with the coefficient c ≥ 0 in N s/m."""

    coefficient: float

    def __post_init__(self) -> None:
        """Require c ≥ 0."""
        take_fields(self, "end drag")
        c = self.coefficient
        if isinstance(c, Real) and not 0 <= c < float("inf"):
            raise ParameterError(f"end drag must be zero or positive and finite; got {c!r} N s/m")

    def loads(self, chain: Chain, q: Pair, u: Pair, t: Scalar = 0.0) -> Loads:
        """Return the force against the velocity of D."""
        vx, vy = velocity(chain, q, u, chain.D)
        c = chain.scalar(self.coefficient)
        return (Force(chain.D, (-c * vx, -c * vy)),)
