"""The impact on one contact, for all motions in an enclosure.

Let p be the polynomials at the middle τ of a bracket, e the error of the motion there, g the gap
and G its rate. The contact closes at τ + s with s = −(g(p) + ∇g · e)/G, by the mean value theorem
in the state and in time. With the rates F of the state the impact meets p + e + F s. The impact law
J gives the state after it, by the mean value theorem again; and the motion that leaves it is
followed to τ, with its rates F′, where the next step begins:

    e′ = DJ e + (F′ − DJ F) (g(p) + ∇g · e)/G.

This is the matrix of saltation (M. A. Aizerman and F. R. Gantmakher, 1958). All its entries are
balls over the bracket, and branches of the law are taken only if every motion takes them.

`collision` shares the laws of `twolink.contact.impact_laws` with the simulator and nothing else: it
derives the response of the chain from Lagrange's mass matrix in any kind of numbers.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

from twolink import lagrange
from twolink.accuracy.certain import Certain, UndecidedError
from twolink.accuracy.defect_bound import Step
from twolink.accuracy.dual import slopes, variables
from twolink.accuracy.frames import Frame
from twolink.accuracy.gap_bound import Bracket, gradients
from twolink.accuracy.interval import Interval, interval
from twolink.arithmetic import Pair, Scalar
from twolink.chain import Chain
from twolink.contact.coordinates import PointCoordinate
from twolink.contact.elements import RigidContact
from twolink.contact.impact_laws import (
    Impulse,
    Regime,
    Response,
    guided_impulse,
    rough_impulse,
    smooth_impulse,
)
from twolink.effects import Effect, smooth_loads


@dataclass(frozen=True)
class EnclosedImpact:
    """Intervals that contain the exact numbers of an impact; pairs are before and after it.

    `time` in s, `q` (rad) and `u` (rad/s) of both links, speeds along the normal and the tangent in
    m/s (rad/s at a joint), impulses in N s (N m s at a joint), `kinetic_energy` in J. `unit` is
    that of the gap, m or rad.
    """

    name: str
    unit: str
    regime: Regime
    time: Interval
    q: tuple[Interval, Interval]
    u_before: tuple[Interval, Interval]
    u_after: tuple[Interval, Interval]
    normal_speed: tuple[Interval, Interval]
    sliding_speed: tuple[Interval, Interval]
    normal_impulse: Interval
    tangential_impulse: Interval
    kinetic_energy: tuple[Interval, Interval]

    @property
    def radius(self) -> float:
        """The largest radius of any interval."""
        return max(float(part.radius) for part in self._intervals())

    def document(self) -> dict[str, Any]:
        """Return it as JSON-compatible data."""
        found = asdict(self)
        return {name: _as_data(value) for name, value in found.items()}

    def _intervals(self) -> list[Interval]:
        found: list[Interval] = []
        for value in vars(self).values():
            if isinstance(value, Interval):
                found.append(value)
            elif isinstance(value, tuple):
                found += value
        return found


class Rebound(NamedTuple):
    """The motion after an impact, followed to the middle of its bracket.

    `frame` has the errors of `state` there; `opens` is whether the contact is proven to open.
    """

    impact: EnclosedImpact
    state: list[Any]
    frame: Frame
    opens: bool


class _Collision(NamedTuple):
    """An impact as a function of the state before it: speeds, impulse, and u after it."""

    u: Pair
    normal_speed: Pair
    sliding_speed: Pair
    impulse: Impulse
    kinetic_energy: Pair

    def numbers(self, q: Pair, u: Pair) -> list[Scalar]:
        """Return all numbers of an `EnclosedImpact` but the time, in its order."""
        impulses = self.impulse.normal, self.impulse.tangential
        pairs = (q, u, self.u, self.normal_speed, self.sliding_speed, impulses)
        return [number for pair in (*pairs, self.kinetic_energy) for number in pair]


def rebound(step: Step, contact: RigidContact, bracket: Bracket) -> Rebound:
    """Return the motion after an impact in a bracket of a step.

    Raises `UndecidedError` if the enclosure is too wide to decide about the branches of the law.
    """
    chain, flint = step.chain, step.flint
    centre = step.state(bracket.middle)
    box = step.box(bracket.start, bracket.end, bracket.passage.errors)
    time = step.start + bracket.start.union(bracket.end)
    F = _rates(chain, step.effects, box, time)
    delay = _delay(chain, contact, bracket.passage.frame, centre, box)
    law = _Law(chain, contact)
    numbers, slopes = law.numbers(centre), law.slopes(box)
    found = [
        delay.interval(value, slope, _dot(slope, F))
        for value, slope in zip(numbers, slopes, strict=True)
    ]
    ahead = delay.interval(step.start + bracket.middle, [0 * delay.late] * 4, 1)
    J = _state_after(slopes)
    wide = _reached(chain, step.effects, law.states(box), time, bracket.length)
    direction = [
        x - _dot(row, F) for x, row in zip(_rates(chain, step.effects, wide, time), J, strict=True)
    ]
    state = [
        x + change * delay.late for x, change in zip(_state_after(numbers), direction, strict=True)
    ]
    after = delay.frame.after(flint, flint.arb_mat(J), direction, delay.factors)
    opens = bool(_gap(chain, contact, centre, wide)[1] > 0)
    return Rebound(_impact(contact, law.regime(box), ahead, found), state, after, opens)


class _Delay(NamedTuple):
    """The time s from the middle of a bracket to the impact: −`late` − `factors` · r.

    r are the errors along the columns of a frame, so that s keeps its dependence on them.
    """

    frame: Frame
    late: Any
    factors: list[Any]

    def interval(self, value: Any, slope: list[Any], rate: Any) -> Interval:
        """Return the interval of value + slope · e + rate s, for all errors e of the frame."""
        error = self.frame.bound_along(slope, -rate, self.factors)
        return interval(value - rate * self.late, error)


def _delay(
    chain: Chain, contact: RigidContact, frame: Frame, centre: list[Any], box: list[Any]
) -> _Delay:
    """Return s = −g/G − (∇g · e)/G of the motions whose states are in a box."""
    (g, G), (by_gap, _) = _gap(chain, contact, centre, box), gradients(contact, chain, box)
    return _Delay(frame, g / G, [_dot(by_gap, column) / G for column in frame.columns])


@dataclass(frozen=True)
class _Law:
    """The impact on a contact as a function of balls with q1, q2, u1, u2."""

    chain: Chain
    contact: RigidContact

    def numbers(self, state: list[Any]) -> list[Any]:
        """Return balls with the numbers of the impact."""
        q, u = _pairs([Certain(x) for x in state])
        return [_ball(x) for x in collision(self.chain, self.contact, q, u).numbers(q, u)]

    def slopes(self, box: list[Any]) -> list[list[Any]]:
        """Return balls with the derivatives of these numbers by q1, q2, u1, u2."""
        state = [Certain(ball) for ball in box]
        q, u = _pairs(variables(state))
        numbers = collision(self.chain, self.contact, q, u).numbers(q, u)
        return [[_ball(slope) for slope in slopes(n, state)] for n in numbers]

    def states(self, box: list[Any]) -> list[Any]:
        """Return balls with the states after the impact."""
        return _state_after(self.numbers(box))

    def regime(self, box: list[Any]) -> Regime:
        """Return how the point slides, the same for all states."""
        q, u = _pairs([Certain(x) for x in box])
        return collision(self.chain, self.contact, q, u).impulse.regime


def collision(chain: Chain, contact: RigidContact, q: Pair, u: Pair) -> _Collision:
    """Return the impact on a contact at a state, by Lagrange's equations, in any numbers."""
    row = lagrange.generalized_active_force(chain, q, contact.normal.unit_loads(chain))
    tangent: Pair = (0, 0)
    if contact.tangent is not None:
        tangent = lagrange.generalized_active_force(chain, q, contact.tangent.unit_loads(chain))
    impulse = _impulse(chain, contact, q, row, u, tangent)
    n, t = impulse.normal, impulse.tangential
    change = _response(chain, q, (row[0] * n + tangent[0] * t, row[1] * n + tangent[1] * t))
    after = u[0] + change[0], u[1] + change[1]
    return _Collision(
        after,
        (_along(row, u), _along(row, after)),
        (_along(tangent, u), _along(tangent, after)),
        impulse,
        (lagrange.kinetic_energy(chain, q, u), lagrange.kinetic_energy(chain, q, after)),
    )


def _impulse(
    chain: Chain, contact: RigidContact, q: Pair, row: Pair, u: Pair, tangent: Pair
) -> Impulse:
    """Return the impulse on a contact with these Jacobian rows along its normal and tangent."""
    along = _response(chain, q, row)
    v_n, G_nn = _along(row, u), _along(row, along)
    if not v_n < 0:
        raise UndecidedError(f"the approach to {contact.name} is too slow to decide about it")
    if contact.tangent is None:
        return smooth_impulse(v_n, G_nn, contact.restitution)
    G_nt = _along(tangent, along)
    law = {"friction": contact.kinetic, "restitution": contact.restitution, "law": contact.law}
    assert isinstance(contact.normal, PointCoordinate)
    if contact.normal.of(chain).link == 1:
        return guided_impulse(v_n, G_nn, G_nt / G_nn, **law)
    G_tt = _along(tangent, _response(chain, q, tangent))
    across = row[0] * tangent[1] - row[1] * tangent[0]
    return rough_impulse(
        v_n,
        _along(tangent, u),
        Response(G_nn, G_nt, G_tt),
        determinant=across * across / lagrange.determinant(chain, q),
        **law,
    )


def _gap(chain: Chain, contact: RigidContact, centre: list[Any], box: list[Any]) -> Pair:
    """Return the gap at the centre, and its rate in the box, as balls."""
    (at, _), (q, u) = (_pairs([Certain(x) for x in state]) for state in (centre, box))
    gap = contact.normal.coordinate(chain, at) - contact.bound
    return gap.ball, contact.normal.speed(chain, q, u).ball


def _rates(chain: Chain, effects: tuple[Effect, ...], box: list[Any], time: Any) -> list[Any]:
    """Return balls with the rates of q1, q2, u1, u2 in a box, at times (s) in a ball."""
    q, u = _pairs([Certain(x) for x in box])
    loads = smooth_loads(effects, chain, q, u, Certain(time))
    return [box[2], box[3], *(_ball(x) for x in lagrange.forward_dynamics(chain, q, u, loads))]


def _reached(
    chain: Chain, effects: tuple[Effect, ...], box: list[Any], time: Any, length: Any
) -> list[Any]:
    """Return a box with all motions within a length of time (s) of states in a box.

    Picard's operator proves it.
    """
    for width in (2, 8, 32):
        rates = _rates(chain, effects, box, time)
        reach = [(width * length * abs(x)).upper() for x in rates]
        wide = [x + type(x)(0, r) for x, r in zip(box, reach, strict=True)]
        found = _rates(chain, effects, wide, time)
        if all(length * abs(x) <= r for x, r in zip(found, reach, strict=True)):
            return wide
    raise UndecidedError("the motion after an impact cannot be bounded")


def _state_after(numbers: list[Any]) -> list[Any]:
    """Return q and u after the impact, of the numbers of a collision (or of their derivatives)."""
    q, _, u = numbers[0:2], numbers[2:4], numbers[4:6]
    return [*q, *u]


def _impact(
    contact: RigidContact, regime: Regime, time: Interval, found: list[Interval]
) -> EnclosedImpact:
    pairs = [(found[i], found[i + 1]) for i in range(0, len(found), 2)]
    q, before, after, normal, sliding, (normal_impulse, tangential), energies = pairs
    return EnclosedImpact(
        contact.name,
        "m" if isinstance(contact.normal, PointCoordinate) else "rad",
        regime,
        time,
        q,
        before,
        after,
        normal,
        sliding,
        normal_impulse,
        tangential,
        energies,
    )


def _response(chain: Chain, q: Pair, impulse: Pair) -> Pair:
    """Return M⁻¹ times a generalized impulse (N m s): the change of u (rad/s)."""
    (M11, M12), (_, M22) = lagrange.mass_matrix(chain, q)
    det = lagrange.determinant(chain, q)
    x, y = impulse
    return (M22 * x - M12 * y) / det, (M11 * y - M12 * x) / det


def _along(row: Pair, u: Pair) -> Scalar:
    return row[0] * u[0] + row[1] * u[1]


def _dot(row: Any, column: Any) -> Any:
    return sum(x * y for x, y in zip(row, column, strict=True))


def _pairs(state: list[Any]) -> tuple[Pair, Pair]:
    q1, q2, u1, u2 = state
    return (q1, q2), (u1, u2)


def _ball(x: Any) -> Any:
    return x.ball if isinstance(x, Certain) else x


def _as_data(value: Any) -> Any:
    """Return intervals as dictionaries."""
    if isinstance(value, Interval):
        return value._asdict()
    return [_as_data(part) for part in value] if isinstance(value, tuple) else value
