"""The force P on the end point D, with Coulomb friction.

The textbook chapter of `docs/derivation.md` prints P = −sign(v_D·**i**) μ F **i** + F **j**. With
y downward, F > 0 pushes D down and a floor below D pushes with F < 0; then the printed friction
would drive the sliding. Friction opposes sliding on either side of the surface, so its size is
μ|F|. The two agree for F ≥ 0.
"""

from dataclasses import dataclass
from numbers import Real

from twolink.arithmetic import Pair, Scalar, sign
from twolink.chain import Chain
from twolink.contact.coordinates import PointCoordinate
from twolink.contact.elements import DryFriction
from twolink.effects.effect import ContactEffect
from twolink.errors import ParameterError
from twolink.inputs import take_fields
from twolink.kinematics import velocity
from twolink.loads import Force, Loads
from twolink.validation import check_finite


@dataclass(frozen=True)
class EndForce(ContactEffect):
    """P on D: `normal` F along y (N), and friction μ|F| along x, against the sliding of D.

    `friction` is the coefficient μ ≥ 0 while D slides, `static` the one while it sticks (the same
    unless given). `sliding` is the direction in which D slides, +1 or −1; without it, the sign of
    v_D·**i** in the given state. If that is zero, D may stick, and Coulomb's law gives a set of
    forces. A simulation determines the force from modes of sticking and slipping; `loads` raises an
    error unless `sliding` is given.
    """

    normal: float
    friction: float = 0
    sliding: int | None = None
    static: float | None = None

    def __post_init__(self) -> None:
        """Require 0 ≤ μ ≤ static μ, and a valid sliding direction."""
        take_fields(self, "end force", real=True)
        check_finite("end force", normal=self.normal)
        if not 0 <= self.friction < float("inf"):
            raise ParameterError(
                f"end force: friction must be zero or positive and finite; got {self.friction!r}"
            )
        if self.sliding not in (None, 1, -1):
            raise ParameterError(
                "end force: sliding must be +1 or -1, or None to take it from the velocity of D;"
                f" got {self.sliding!r}"
            )

        if self.static is not None and not self.friction <= self.static < float("inf"):
            raise ParameterError(
                f"end force: static must be finite and not below the friction {self.friction!r};"
                f" got {self.static!r}"
            )

    def contact_elements(self, chain: Chain) -> tuple[DryFriction, ...]:
        """Return the friction of D, unless it is zero or `sliding` is given."""
        static = self.friction if self.static is None else self.static
        if static == 0 or self.sliding is not None:
            return ()
        size = abs(chain.scalar(self.normal))
        kinetic, static = chain.scalars((self.friction, static))
        along_x = PointCoordinate("D", (1.0, 0.0))
        return (DryFriction("D", along_x, kinetic * size, static * size),)

    def smooth_loads(self, chain: Chain, q: Pair, u: Pair, t: Scalar = 0.0) -> Loads:
        """Return P without the friction that is a contact element."""
        if self.contact_elements(chain):
            return (Force(chain.D, (0, chain.scalar(self.normal))),)
        return self.loads(chain, q, u, t)

    def loads(self, chain: Chain, q: Pair, u: Pair, t: Scalar = 0.0) -> Loads:
        """Return P at D. Raises `ParameterError` if D does not slide and μ is not zero."""
        normal = chain.scalar(self.normal)
        if isinstance(self.friction, Real) and self.friction == 0:
            return (Force(chain.D, (0, normal)),)
        direction = self.sliding if self.sliding is not None else self._sliding(chain, q, u)
        most = chain.scalar(self.friction) * abs(normal)
        return (Force(chain.D, (-direction * most, normal)),)

    def _sliding(self, chain: Chain, q: Pair, u: Pair) -> Scalar:
        vx, _ = velocity(chain, q, u, chain.D)
        direction = sign(vx)
        if _anywhere(direction == 0):
            raise ParameterError(
                "end force: D must slide, or sliding must be +1 or -1; got a state in which D does "
                "not slide (v_D·i = 0), where friction is any force up to mu |F|"
            )
        return direction


def _anywhere(condition: object) -> bool:
    """Return whether a condition on a number, or on any entry of an array, is true."""
    return bool(getattr(condition, "any", lambda: condition)())
