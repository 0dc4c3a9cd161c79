"""The impact on one contact, and exact projection onto zero speed."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from twolink.arithmetic import Pair, Scalar
from twolink.contact.coordinates import ConstraintCoordinate, JointCoordinate
from twolink.contact.elements import ContactElement, RigidContact
from twolink.contact.impact_laws import (
    Impulse,
    Regime,
    Response,
    guided_impulse,
    rough_impulse,
    smooth_impulse,
)
from twolink.simulation.hybrid.constraint import parallel
from twolink.simulation.hybrid.pose import Pose
from twolink.simulation.hybrid.tolerances import (
    AT_REST,
    LEFT_BY_LOCKING,
    LEFT_OVER,
    NO_LEVER,
    UNDECIDED,
)


class Strike(NamedTuple):
    """An impact at a time (s) in the pose q, before its energies are known.

    `speeds` and `sliding` are those along the contact's normal and tangent, before and after, and
    `u` likewise (rad/s).
    """

    time: float
    number: int
    name: str
    q: Pair
    u: tuple[Pair, Pair]
    speeds: Pair
    sliding: Pair
    impulse: Impulse


def speed_along(row: Pair, u: Pair) -> Scalar:
    """Return row · u."""
    return row[0] * u[0] + row[1] * u[1]


def has_no_lever(row: Pair, lever: float) -> bool:
    """Return whether a row of a chain of length `lever` (m) is round-off of the pose."""
    least = NO_LEVER * lever
    return bool(abs(row[0]) <= least and abs(row[1]) <= least)


def at_rest(row: Pair, u: Pair, rounding: float, lever: float) -> bool:
    """Return whether row · u is zero within round-off.

    It is, too, if the row is round-off of the pose. The chain has the length `lever` (m).
    """
    first, second = row[0] * u[0], row[1] * u[1]
    if abs(first + second) <= AT_REST * rounding * (abs(first) + abs(second)):
        return True
    return has_no_lever(row, lever)


def moves(row: Pair, u: Pair, rounding: float, slowest: float) -> bool:
    """Return whether the speed row · u is more than the error of u at an event.

    Links that turn slower than the `slowest` speed (rad/s) are at rest.
    """
    return bool(abs(speed_along(row, u)) > largest(row) * _error_of(u, rounding, slowest))


def _error_of(u: Pair, rounding: float, slowest: float) -> float:
    """Return the error (rad/s) of u at an event: where all links stop, u itself is round-off."""
    return max(UNDECIDED * rounding * float(largest(u)), slowest)


def approach(row: Pair, u: Pair, rounding: float, lever: float) -> Scalar:
    """Return the speed row · u if it is an approach beyond round-off, else 0.

    A row that is round-off of the pose has no speed. The chain has the length `lever` (m).
    """
    first, second = row[0] * u[0], row[1] * u[1]
    speed = first + second
    if speed < 0 and -speed > AT_REST * rounding * (abs(first) + abs(second)):
        return 0 if has_no_lever(row, lever) else speed
    return 0


def placed(
    pose: Pose, coordinate: ConstraintCoordinate, bound: Scalar, rounding: float, finest: float
) -> Pair:
    """Return q corrected within round-off, so that a coordinate (rad or m) is at its bound.

    `rounding` is that of q, and `finest` that of its numbers, which may be smaller.
    """
    q = pose.q
    if isinstance(coordinate, JointCoordinate):
        q1, q2 = q
        angle = coordinate.sense * bound + 0 * q1
        return (angle, q2) if coordinate.joint == "A" else (q1, q1 + angle)
    # The row is constant within so small a correction.
    row = pose.row(coordinate)
    long = row[0] * row[0] + row[1] * row[1]
    # A smaller gap moves the angles by less than a rounding.
    least = finest * largest(row)
    for _ in range(2):
        gap = pose.value(coordinate, q) - bound
        if abs(gap) <= least or long == 0:
            break
        step = gap / long
        moved = q[0] - step * row[0], q[1] - step * row[1]
        change = largest((moved[0] - q[0], moved[1] - q[1]))
        if change > UNDECIDED * rounding * max(1, largest(q)):
            # Near a singular pose, where the row vanishes, the gap is more accurate than the pose.
            break
        q = moved
        if change * change <= finest:
            # The gap that is left is of second order.
            break
    return q


def stopped(
    pose: Pose,
    coordinates: Sequence[ConstraintCoordinate],
    u: Pair,
    rounding: float,
    slowest: float = 0.0,
) -> Pair:
    """Return u with exactly zero speed along coordinates where it was zero within round-off.

    Two independent coordinates leave no motion. A coordinate along which the chain cannot move in
    this pose has zero speed at any u. Links that turn slower than the `slowest` speed (rad/s) are
    at rest.
    """
    if not coordinates:
        return u
    pairs = [(coordinate, pose.row(coordinate)) for coordinate in coordinates]
    pairs = [pair for pair in pairs if largest(pair[1]) > NO_LEVER * pose.lever]
    if any(not parallel(pairs[0][1], row, pose.lever) for _, row in pairs[1:]):
        return 0 * u[0], 0 * u[1]
    for coordinate, row in pairs:
        if isinstance(coordinate, JointCoordinate):
            u1, u2 = u
            u = (0 * u1, u2) if coordinate.joint == "A" else (u1, u1)
        else:
            share = speed_along(row, u) / (row[0] * row[0] + row[1] * row[1])
            change = share * row[0], share * row[1]
            if largest(change) <= _error_of(u, rounding, slowest):
                # Exactly zero for a point of link 1, whose row is one number.
                u = u[0] - change[0] if row[1] else 0 * u[0], u[1] - change[1]
    return u


class Impacts:
    """The rigid contacts that may take part in impacts at an instant, in one pose."""

    def __init__(
        self, pose: Pose, elements: Sequence[ContactElement], time: float, rounding: float
    ) -> None:
        """Store the pose, the elements, the time (s), and the round-off of the precision."""
        self.pose, self._elements, self.time = pose, elements, time
        self.rounding = rounding

    def both_ended(self, first: int, second: int, u: Pair) -> list[Strike]:
        """Return the impacts on two contacts whose normal impulses bring the chain to rest."""
        row = self.row(first)
        normal, other = self._to_rest(row, self.row(second), u)
        du = self.pose.impulse_response((normal * row[0], normal * row[1]))
        between = u[0] + du[0], u[1] + du[1]
        regime = Regime.BOUNCES_DIE_AWAY
        return [
            self._strike(first, Impulse(normal, 0 * normal, regime), u, between),
            self._strike(second, Impulse(other, 0 * other, regime), between, (0 * u[0], 0 * u[1])),
        ]

    def _to_rest(self, first: Pair, second: Pair, u: Pair) -> Pair:
        """Return the impulses along two rows that bring the chain to rest: −M u = Σ Λ row."""
        ((M11, M12), (_, M22)), _ = self.pose.inertia
        p1, p2 = -(M11 * u[0] + M12 * u[1]), -(M12 * u[0] + M22 * u[1])
        across = first[0] * second[1] - first[1] * second[0]
        one, other = p1 * second[1] - p2 * second[0], first[0] * p2 - first[1] * p1
        return one / across, other / across

    def impact(self, index: int, u: Pair, without_collision: bool = False) -> Strike:
        """Return the impact on a contact at u; without collision the normal speed is zero."""
        contact, pose = self.contact(index), self.pose
        row = pose.row(contact.normal)
        v_n = 0 * u[0] if without_collision else row[0] * u[0] + row[1] * u[1]
        G_nn = pose.response(row, row)
        tangent = (0, 0) if contact.tangent is None else pose.row(contact.tangent)
        # A point that cannot move along the surface in this pose has no friction.
        if contact.tangent is None or largest(tangent) <= NO_LEVER * largest(row):
            impulse = smooth_impulse(v_n, G_nn, contact.restitution)
            return self._strike(index, impulse, u, self._after(u, row, tangent, impulse))
        G_nt = pose.response(row, tangent)
        across = row[0] * tangent[1] - row[1] * tangent[0]
        # For a point that moves along one line only, both speeds are proportional.
        if abs(across) <= NO_LEVER * (abs(row[0] * tangent[1]) + abs(row[1] * tangent[0])):
            return self._guided(index, u, v_n, G_nn, G_nt / G_nn)
        return self._rough(index, u, v_n, Response(G_nn, G_nt, pose.response(tangent, tangent)))

    def _rough(self, index: int, u: Pair, v_n: Scalar, G: Response) -> Strike:
        """Return an impact with friction of a point that moves freely."""
        contact, row = self.contact(index), self.row(index)
        assert contact.tangent is not None
        tangent = self.pose.row(contact.tangent)
        across = row[0] * tangent[1] - row[1] * tangent[0]
        still = at_rest(tangent, u, self.rounding, self.pose.lever)
        v_t = 0 * u[0] if still else speed_along(tangent, u)
        det = across * across / self.pose.inertia[1]
        stopping = self._to_rest(row, tangent, u)
        e, law = contact.restitution, contact.law
        impulse = rough_impulse(
            v_n, v_t, G, friction=contact.kinetic, restitution=e, law=law, determinant=det,
            stopping=stopping,
        )  # fmt: skip
        after = self._after(u, row, tangent, impulse)
        if impulse.regime.ends_sticking:
            # Both speeds determine u; computing it from impulses loses digits near a straight pose.
            known = law in ("newton", "newton-routh") or e == 0
            speed = -e * v_n if known else (impulse.normal - stopping[0]) * det / G.tt
            after = speed * tangent[1] / across, -speed * tangent[0] / across
        return self._strike(index, impulse, u, after)

    def _guided(self, index: int, u: Pair, v_n: Scalar, G_nn: Scalar, lever: Scalar) -> Strike:
        """Return an impact of a point that moves along one line only."""
        contact, row = self.contact(index), self.row(index)
        assert contact.tangent is not None
        impulse = guided_impulse(
            v_n,
            G_nn,
            lever,
            friction=contact.kinetic,
            restitution=contact.restitution,
            law=contact.law,
        )
        after = self._after(u, row, self.pose.row(contact.tangent), impulse)
        if impulse.regime is Regime.STICKS:
            after = stopped(self.pose, [contact.normal], after, self.rounding)
        return self._strike(index, impulse, u, after)

    def clamped(self, index: int, u: Pair, direction: int) -> Strike:
        """Return the impact that removes the normal speed of a contact at its Zeno limit.

        Its impulses are those of all omitted bounces; the friction is that of the slide in this
        direction, or of sticking for 0.
        """
        contact, row = self.contact(index), self.row(index)
        speed = speed_along(row, u)
        s = 0 * speed
        force = row
        if contact.tangent is not None:
            tangent = self.pose.row(contact.tangent)
            across = row[0] * tangent[1] - row[1] * tangent[0]
            guided = abs(across) <= NO_LEVER * (abs(row[0] * tangent[1]) + abs(row[1] * tangent[0]))
            if direction == 0 and not guided:
                stops = Impulse(*self._to_rest(row, tangent, u), Regime.BOUNCES_DIE_AWAY)
                return self._strike(index, stops, u, (0 * u[0], 0 * u[1]))
            if not guided:
                s = -contact.kinetic if direction > 0 else contact.kinetic
                force = row[0] + s * tangent[0], row[1] + s * tangent[1]
        response = self.pose.response(row, force)
        if response <= 0:
            s, force, response = 0 * speed, row, self.pose.response(row, row)
        normal = -speed / response
        du = self.pose.impulse_response((normal * force[0], normal * force[1]))
        after = (u[0] + du[0], u[1] + du[1])
        after = stopped(self.pose, [contact.normal], after, self.rounding)
        return self._strike(index, Impulse(normal, s * normal, Regime.BOUNCES_DIE_AWAY), u, after)

    def locked(self, index: int, u: Pair, direction: int) -> Strike:
        """Return the impact that ends a slide whose normal force grows without bound.

        It is the limit of an impact without collision in which the normal speed stays zero: the
        friction of the slide stops it, without a rebound.
        """
        contact, (x, y) = self.contact(index), self.row(index)
        assert contact.tangent is not None
        (X, Y), s = self.pose.row(contact.tangent), -direction * contact.kinetic
        push = x + s * X, y + s * Y
        # Near a dead point the speed along the tangent says little of the links.
        normal = -speed_along(push, u) / self.pose.response(push, push)
        after = (0 * u[0], 0 * u[1])
        return self._strike(index, Impulse(normal, s * normal, Regime.SLIDES_THEN_STICKS), u, after)

    def stops(self, strike: Strike) -> bool:
        """Return whether the impulse of an impact takes most of the momenta: their sum is small."""
        (M11, M12), (_, M22) = self.pose.inertia[0]
        (u1, u2), tangent = strike.u[0], self.contact(strike.number).tangent
        before = M11 * u1 + M12 * u2, M12 * u1 + M22 * u2
        (x, y), (X, Y) = self.row(strike.number), self.pose.row(tangent)  # type: ignore[arg-type]
        N, T = strike.impulse.normal, strike.impulse.tangential
        after = before[0] + N * x + T * X, before[1] + N * y + T * Y
        return bool(largest(after) <= LEFT_BY_LOCKING * largest(before))

    def _after(self, u: Pair, row: Pair, tangent: Pair, impulse: Impulse) -> Pair:
        """Return u after the impulses along a normal and a tangent."""
        normal, along = impulse.normal, impulse.tangential
        given = normal * row[0] + along * tangent[0], normal * row[1] + along * tangent[1]
        du = self.pose.impulse_response(given)
        return u[0] + du[0], u[1] + du[1]

    def _strike(self, index: int, impulse: Impulse, before: Pair, after: Pair) -> Strike:
        contact, pose = self.contact(index), self.pose
        (x, y), (u1, u2), (v1, v2) = pose.row(contact.normal), before, after
        speeds, sliding = (x * u1 + y * u2, x * v1 + y * v2), (0.0, 0.0)
        if contact.tangent is not None:
            tangent = pose.row(contact.tangent)
            sliding = speed_along(tangent, before), speed_along(tangent, after)
        return Strike(
            self.time, index, contact.name, pose.q, (before, after), speeds, sliding, impulse
        )

    def energy(self, u: Pair) -> float:
        """Return the kinetic energy (J) at u (rad/s)."""
        ((M11, M12), (_, M22)), _ = self.pose.inertia
        u1, u2 = u
        return float(M11 * u1 * u1 + 2 * M12 * u1 * u2 + M22 * u2 * u2) / 2

    def energy_of_approach(self, index: int, u: Pair) -> float:
        """Return v²/(2 G) (J): G is the change of the normal speed v by a unit of impulse."""
        row = self.row(index)
        speed = speed_along(row, u)
        return float(speed * speed / self.pose.response(row, row)) / 2

    def approach(self, index: int, u: Pair) -> Scalar:
        """Return the normal speed of a contact if it is approached, else 0."""
        return approach(self.row(index), u, self.rounding, self.pose.lever)

    def row(self, index: int) -> Pair:
        """Return the Jacobian row of a contact's normal."""
        return self.pose.row(self.contact(index).normal)

    def names_and_laws(self, indices: Iterable[int]) -> tuple[str, str]:
        """Return the names of contacts, and those of their laws, for a message."""
        contacts = [self.contact(index) for index in indices]
        laws = sorted({contact.law for contact in contacts})
        return ", ".join(contact.name for contact in contacts), ", ".join(laws)

    def contact(self, index: int) -> RigidContact:
        """Return the contact with an index."""
        contact = self._elements[index]
        assert isinstance(contact, RigidContact)
        return contact


def is_left_over(row: Pair, u: Pair, before: Pair, rounding: float) -> bool:
    """Return whether the speed row · u is zero within the round-off of u before the impacts."""
    size = max(abs(before[0]), abs(before[1])) * (abs(row[0]) + abs(row[1]))
    return bool(abs(speed_along(row, u)) <= LEFT_OVER * rounding * size)


def largest(row: Pair) -> Scalar:
    """Return the size of the larger entry of a row."""
    return max(abs(row[0]), abs(row[1]))
