"""Impact resolution, and exact projection onto zero speed."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import NamedTuple

from twolink.arithmetic import Pair, Scalar
from twolink.contact.coordinates import ConstraintCoordinate, JointCoordinate
from twolink.contact.elements import ContactElement, RigidContact
from twolink.contact.impact_laws import (
    Impulse,
    Response,
    guided_impulse,
    rough_impulse,
    smooth_impulse,
)
from twolink.errors import IntegrationError
from twolink.simulation.hybrid.constraint import parallel
from twolink.simulation.hybrid.dynamics import Pose
from twolink.simulation.hybrid.mode import BOUNCES_DIE_AWAY
from twolink.simulation.hybrid.tolerances import (
    AT_REST,
    LEFT_OVER,
    MOST_ENERGY,
    MOST_IMPACTS,
    NO_LEVER,
    NO_REBOUND,
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


class Resolution(NamedTuple):
    """The speeds u (rad/s) after impacts, the impacts, and the contacts that end at rest."""

    u: Pair
    strikes: tuple[Strike, ...]
    resting: frozenset[int]


def speed_along(row: Pair, u: Pair) -> Scalar:
    """Return row · u."""
    return row[0] * u[0] + row[1] * u[1]


def at_rest(row: Pair, u: Pair, rounding: float) -> bool:
    """Return whether the speed row · u is zero, but for the rounding of its terms."""
    first, second = row[0] * u[0], row[1] * u[1]
    return bool(abs(first + second) <= AT_REST * rounding * (abs(first) + abs(second)))


def placed(pose: Pose, coordinate: ConstraintCoordinate, bound: Scalar, rounding: float) -> Pair:
    """Return q moved by rounding, so that a coordinate (rad or m) is at its bound."""
    q = pose.q
    if isinstance(coordinate, JointCoordinate):
        q1, q2 = q
        angle = coordinate.sense * bound + 0 * q1
        return (angle, q2) if coordinate.joint == "A" else (q1, q1 + angle)
    # By so little the row does not change.
    row = pose.row(coordinate)
    long = row[0] * row[0] + row[1] * row[1]
    for _ in range(2):
        gap = coordinate.coordinate(pose.chain, q) - bound
        if gap == 0 or long == 0:
            break
        step = gap / long
        moved = q[0] - step * row[0], q[1] - step * row[1]
        if _long((moved[0] - q[0], moved[1] - q[1])) > UNDECIDED * rounding * max(1, _long(q)):
            # Near a dead point, where the row vanishes, the gap is known better than the pose.
            break
        q = moved
    return q


def stopped(
    pose: Pose, coordinates: Sequence[ConstraintCoordinate], u: Pair, rounding: float
) -> Pair:
    """Return u with no speed along some coordinates, where it was no more than rounding.

    Two coordinates that are independent leave no motion. One along which the chain cannot move in
    this pose has no speed at any u.
    """
    lever = float(abs(pose.chain.L1) + abs(pose.chain.L2))
    pairs = [(coordinate, pose.row(coordinate)) for coordinate in coordinates]
    pairs = [pair for pair in pairs if _long(pair[1]) > NO_LEVER * lever]
    if any(not parallel(pairs[0][1], row) for _, row in pairs[1:]):
        return 0 * u[0], 0 * u[1]
    for coordinate, row in pairs:
        if isinstance(coordinate, JointCoordinate):
            u1, u2 = u
            u = (0 * u1, u2) if coordinate.joint == "A" else (u1, u1)
        else:
            share = speed_along(row, u) / (row[0] * row[0] + row[1] * row[1])
            change = share * row[0], share * row[1]
            if _long(change) <= UNDECIDED * rounding * _long(u):
                u = u[0] - change[0], u[1] - change[1]
    return u


class Impacts:
    """The rigid contacts that may take part in impacts at an instant, in one pose."""

    def __init__(
        self, pose: Pose, elements: Sequence[ContactElement], time: float, rounding: float
    ) -> None:
        """Take the pose, the elements, the time (s), and the rounding of the precision."""
        self._pose, self._elements, self._time = pose, elements, time
        self._rounding = rounding

    def approached(self, index: int, u: Pair) -> bool:
        """Return whether a contact is approached, by more than rounding."""
        row = self._row(index)
        return bool(speed_along(row, u) < 0) and not at_rest(row, u, self._rounding)

    def resolve(self, u: Pair, contacts: Collection[int], resting: Collection[int]) -> Resolution:
        """Return the speeds after all contacts that are approached have struck.

        They strike one after the other, the fastest approach first, until none is approached any
        more: each takes no energy or gives none, so neither do they all. `resting` are the contacts
        whose normal speed is zero exactly.
        """
        strikes: list[Strike] = []
        rows = {index: self._row(index) for index in contacts}
        still = {i for i in contacts if i in resting or at_rest(rows[i], u, self._rounding)}
        before = u
        for _ in range(MOST_IMPACTS):
            if strikes:
                still |= {
                    i for i, row in rows.items() if is_left_over(row, u, before, self._rounding)
                }
                if self._is_lost(still, u, before):
                    strikes += self.ended(sorted(still), u, ())
                u = stopped(
                    self._pose, [self._contact(i).normal for i in sorted(still)], u, self._rounding
                )
            approached = {
                index: float(speed_along(row, u))
                for index, row in rows.items()
                if index not in still and self.approached(index, u)
            }
            if not approached:
                return Resolution(u, tuple(strikes), frozenset(still))
            index = min(approached, key=lambda number: (approached[number], number))
            strike = self.impact(index, u)
            self._refuse_energy(self._contact(index), *strike.u)
            strikes.append(strike)
            u = strike.u[1]
            still = {i for i in still if i != index and at_rest(rows[i], u, self._rounding)}
            if abs(strike.speeds[1]) <= NO_REBOUND * self._rounding * abs(strike.speeds[0]):
                still.add(index)
        # They go on answering each other, ever more weakly: in the limit all come to rest.
        strikes += self.ended(sorted({strike.number for strike in strikes}), u, ())
        u = strikes[-1].u[1]
        still = {i for i in contacts if is_left_over(rows[i], u, before, self._rounding)}
        return Resolution(u, tuple(strikes), frozenset(still))

    def _is_lost(self, still: Collection[int], u: Pair, before: Pair) -> bool:
        """Return whether contacts at rest bring the chain to rest from more than rounding.

        Two rows that are nearly parallel leave a motion across them that rounding does not measure.
        """
        rows = [self._row(index) for index in sorted(still)]
        fast = _long(u) > UNDECIDED * self._rounding * _long(before)
        return bool(fast) and any(not parallel(rows[0], row) for row in rows[1:])

    def ended(self, indices: Sequence[int], u: Pair, sliding: Collection[int]) -> list[Strike]:
        """Return the impacts by which contacts come to rest whose further bounces are left out.

        Two independent contacts bring the chain to rest; `sliding` are the contacts along which a
        point slides on.
        """
        first = indices[0]
        for second in indices[1:]:
            if not parallel(self._row(first), self._row(second)):
                return self._both_ended(first, second, u)
        return [self._clamped(first, u, sticks=first not in sliding)]

    def _both_ended(self, first: int, second: int, u: Pair) -> list[Strike]:
        """Return the impacts on two contacts whose normal impulses bring the chain to rest."""
        rows = (x1, y1), (x2, y2) = self._row(first), self._row(second)
        ((M11, M12), (_, M22)), _ = self._pose.inertia
        # The momentum that they take: −M u = Σ Λ row.
        p1, p2 = -(M11 * u[0] + M12 * u[1]), -(M12 * u[0] + M22 * u[1])
        across = x1 * y2 - y1 * x2
        normal, other = (p1 * y2 - p2 * x2) / across, (x1 * p2 - y1 * p1) / across
        du = self._pose.impulse_response((normal * rows[0][0], normal * rows[0][1]))
        between = u[0] + du[0], u[1] + du[1]
        regime = BOUNCES_DIE_AWAY
        return [
            self._strike(first, Impulse(normal, 0 * normal, regime), u, between),
            self._strike(second, Impulse(other, 0 * other, regime), between, (0 * u[0], 0 * u[1])),
        ]

    def impact(self, index: int, u: Pair, without_collision: bool = False) -> Strike:
        """Return the impact on a contact at u; without collision the normal speed is zero."""
        contact, row = self._contact(index), self._row(index)
        v_n = 0 * u[0] if without_collision else speed_along(row, u)
        G_nn = self._pose.response(row, row)
        tangent = (0, 0) if contact.tangent is None else self._pose.row(contact.tangent)
        # A point that cannot move along the surface in this pose has no friction to speak of.
        if max(abs(entry) for entry in tangent) <= NO_LEVER * max(abs(entry) for entry in row):
            impulse = smooth_impulse(v_n, G_nn, contact.restitution)
            return self._strike(index, impulse, u, self._after(u, row, tangent, impulse))
        G_nt = self._pose.response(row, tangent)
        across = row[0] * tangent[1] - row[1] * tangent[0]
        # A point that moves along one line only does not slide by itself: both speeds are one.
        if abs(across) <= NO_LEVER * (abs(row[0] * tangent[1]) + abs(row[1] * tangent[0])):
            return self._guided(index, u, v_n, G_nn, G_nt / G_nn)
        return self._rough(
            index, u, v_n, Response(G_nn, G_nt, self._pose.response(tangent, tangent))
        )

    def _rough(self, index: int, u: Pair, v_n: Scalar, G: Response) -> Strike:
        """Return an impact with friction of a point that moves freely."""
        contact, row = self._contact(index), self._row(index)
        assert contact.tangent is not None
        tangent = self._pose.row(contact.tangent)
        across = row[0] * tangent[1] - row[1] * tangent[0]
        v_t = 0 * u[0] if at_rest(tangent, u, self._rounding) else speed_along(tangent, u)
        impulse = rough_impulse(
            v_n,
            v_t,
            G,
            friction=contact.kinetic,
            restitution=contact.restitution,
            law=contact.law,
            determinant=across * across / self._pose.inertia[1],
        )
        after = self._after(u, row, tangent, impulse)
        if impulse.regime.endswith("sticks"):
            # Where both speeds are known so is u: impulses lose digits near a straight pose.
            known = contact.law == "newton" or contact.restitution == 0
            speed = -contact.restitution * v_n if known else speed_along(row, after)
            after = speed * tangent[1] / across, -speed * tangent[0] / across
        return self._strike(index, impulse, u, after)

    def _guided(self, index: int, u: Pair, v_n: Scalar, G_nn: Scalar, lever: Scalar) -> Strike:
        """Return an impact of a point that moves along one line only."""
        contact, row = self._contact(index), self._row(index)
        assert contact.tangent is not None
        impulse = guided_impulse(
            v_n,
            G_nn,
            lever,
            friction=contact.kinetic,
            restitution=contact.restitution,
            law=contact.law,
        )
        after = self._after(u, row, self._pose.row(contact.tangent), impulse)
        if impulse.regime == "sticks":
            after = stopped(self._pose, [contact.normal], after, self._rounding)
        return self._strike(index, impulse, u, after)

    def _clamped(self, index: int, u: Pair, sticks: bool) -> Strike:
        """Return the impact that takes the speed along a contact at its Zeno limit.

        Its impulses are those of all bounces that are left out; the friction is that of the slide,
        or that of sticking.
        """
        contact, row = self._contact(index), self._row(index)
        speed = speed_along(row, u)
        s = 0 * speed
        force, held = row, [contact.normal]
        if contact.tangent is not None:
            tangent = self._pose.row(contact.tangent)
            sliding = speed_along(tangent, u)
            across = row[0] * tangent[1] - row[1] * tangent[0]
            guided = abs(across) <= NO_LEVER * (abs(row[0] * tangent[1]) + abs(row[1] * tangent[0]))
            if sticks and not guided:
                held.append(contact.tangent)
            elif not guided:
                s = -contact.kinetic if sliding > 0 else contact.kinetic
                force = row[0] + s * tangent[0], row[1] + s * tangent[1]
        response = self._pose.response(row, force)
        if response <= 0:
            s, force, response = 0 * speed, row, self._pose.response(row, row)
        normal = -speed / response
        du = self._pose.impulse_response((normal * force[0], normal * force[1]))
        after = stopped(self._pose, held, (u[0] + du[0], u[1] + du[1]), self._rounding)
        return self._strike(index, Impulse(normal, s * normal, BOUNCES_DIE_AWAY), u, after)

    def locked(self, index: int, u: Pair, direction: int) -> Strike:
        """Return the impact that ends a slide whose normal force grows without bound.

        It is the limit of an impact without collision in which the normal speed stays zero: the
        friction of the slide stops it, and nothing rebounds.
        """
        contact, row = self._contact(index), self._row(index)
        assert contact.tangent is not None
        tangent, s = self._pose.row(contact.tangent), -direction * contact.kinetic
        slope = self._pose.response(tangent, (row[0] + s * tangent[0], row[1] + s * tangent[1]))
        normal = -speed_along(tangent, u) / slope
        after = (0 * u[0], 0 * u[1])
        return self._strike(index, Impulse(normal, s * normal, "slides, then sticks"), u, after)

    def _after(self, u: Pair, row: Pair, tangent: Pair, impulse: Impulse) -> Pair:
        """Return u after the impulses along a normal and a tangent."""
        normal, along = impulse.normal, impulse.tangential
        given = normal * row[0] + along * tangent[0], normal * row[1] + along * tangent[1]
        du = self._pose.impulse_response(given)
        return u[0] + du[0], u[1] + du[1]

    def _strike(self, index: int, impulse: Impulse, before: Pair, after: Pair) -> Strike:
        contact, row = self._contact(index), self._row(index)
        sliding: Pair = (0.0, 0.0)
        if contact.tangent is not None:
            tangent = self._pose.row(contact.tangent)
            sliding = speed_along(tangent, before), speed_along(tangent, after)
        speeds = speed_along(row, before), speed_along(row, after)
        q, name = self._pose.q, contact.name
        return Strike(self._time, index, name, q, (before, after), speeds, sliding, impulse)

    def _refuse_energy(self, contact: RigidContact, before: Pair, after: Pair) -> None:
        """Raise `IntegrationError` if a law of restitution is far outside its range."""
        early, late = (self._energy(u) for u in (before, after))
        if late > MOST_ENERGY * early:
            raise IntegrationError(
                f"at {self._time:.9g} s the impact on {contact.name} is beyond the range of its "
                f"law ({contact.law}): near a singular pose it would give the chain {late:.3g} J, "
                f"which had {early:.3g} J"
            )

    def _energy(self, u: Pair) -> float:
        """Return the kinetic energy (J) at u (rad/s)."""
        ((M11, M12), (_, M22)), _ = self._pose.inertia
        u1, u2 = u
        return float(M11 * u1 * u1 + 2 * M12 * u1 * u2 + M22 * u2 * u2) / 2

    def _row(self, index: int) -> Pair:
        return self._pose.row(self._contact(index).normal)

    def _contact(self, index: int) -> RigidContact:
        contact = self._elements[index]
        assert isinstance(contact, RigidContact)
        return contact


def is_left_over(row: Pair, u: Pair, before: Pair, rounding: float) -> bool:
    """Return whether the speed row · u is zero, but for the rounding of u before the impacts."""
    size = max(abs(before[0]), abs(before[1])) * (abs(row[0]) + abs(row[1]))
    return bool(abs(speed_along(row, u)) <= LEFT_OVER * rounding * size)


def _long(row: Pair) -> Scalar:
    return max(abs(entry) for entry in row)
