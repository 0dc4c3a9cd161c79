"""What happens in no time: impacts, and what comes to rest exactly."""

from __future__ import annotations

from collections.abc import Collection
from typing import NamedTuple

from twolink.arithmetic import Pair, Scalar
from twolink.contact.coordinates import ConstraintCoordinate, JointCoordinate
from twolink.contact.elements import RigidContact
from twolink.contact.impact_laws import (
    Impulse,
    Response,
    guided_impulse,
    rough_impulse,
    smooth_impulse,
)
from twolink.simulation.constrained import rests, same_way
from twolink.simulation.mode import BOUNCES_DIE_AWAY
from twolink.simulation.modes import Modes

# Impacts that answer each other at one instant; more than these have come to nothing.
_MOST_IMPACTS = 1000

# A row smaller than this part of the other is the rounding of none.
_NO_LEVER = 1e-14

# A speed smaller than this part of what was stopped is the rounding of none.
_LEFT_OVER = 1e-14

# A rebound slower than this part of the approach is the rounding of none.
_NO_REBOUND = 1e-13


class Strike(NamedTuple):
    """An impact as it is met at a time (s), in the pose q: its log is written when all is over.

    `speeds` and `sliding` are those along the obstacle's direction and tangent, before and after;
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


class Struck(NamedTuple):
    """The speeds u (rad/s) after strikes, these, and the obstacles that are rested on."""

    u: Pair
    strikes: list[Strike]
    resting: set[int]


class Striking:
    """Impacts on the obstacles of a chain, and rest that is exact."""

    def __init__(self, modes: Modes) -> None:
        """Take the chain's modes, which know its obstacles and its formulation."""
        self._modes = modes

    def placed(self, direction: ConstraintCoordinate, bound: Scalar, q: Pair) -> Pair:
        """Return q moved by rounding, so that a direction's coordinate (rad or m) is its bound."""
        if isinstance(direction, JointCoordinate):
            q1, q2 = q
            angle = direction.sense * bound + 0 * q1
            return (angle, q2) if direction.joint == "A" else (q1, q1 + angle)
        # By so little the row does not change.
        row = self._modes.row(direction, q)
        long = row[0] * row[0] + row[1] * row[1]
        for _ in range(2):
            gap = direction.coordinate(self._modes.chain, q) - bound
            if gap == 0:
                break
            step = gap / long
            q = q[0] - step * row[0], q[1] - step * row[1]
        return q

    def stopped(self, directions: list[ConstraintCoordinate], q: Pair, u: Pair) -> Pair:
        """Return u with no speed along some directions, where it was no more than rounding."""
        for direction in directions:
            if isinstance(direction, JointCoordinate):
                u1, u2 = u
                u = (0 * u1, u2) if direction.joint == "A" else (u1, u1)
            else:
                row = self._modes.row(direction, q)
                u = self._without(row, u)
        rows = [self._modes.row(direction, q) for direction in directions]
        if any(not same_way(rows[0], row) for row in rows[1:]):
            return 0 * u[0], 0 * u[1]
        return u

    @staticmethod
    def _without(row: Pair, u: Pair) -> Pair:
        x, y = row
        share = (x * u[0] + y * u[1]) / (x * x + y * y)
        return u[0] - share * x, u[1] - share * y

    def impacts(self, q: Pair, u: Pair, touched: Collection[int], time: float) -> Struck:
        """Return what becomes of u when all obstacles that are touched and run into strike.

        Where there are several they strike one after the other, the fastest approach first, until
        nothing is run into any more: each takes no energy or gives none, so neither do they all.
        """
        strikes: list[Strike] = []
        rows = {index: self._row(index, q) for index in touched}
        resting = {index for index, row in rows.items() if rests(row, u)}
        before = u
        for _ in range(_MOST_IMPACTS):
            if strikes:
                # Of what has been stopped the rounding is left, which is no speed to fly off at.
                resting |= {index for index, row in rows.items() if _is_left_over(row, u, before)}
                u = self.stopped([self._modes.elements[i].direction for i in resting], q, u)
            approached = {
                index: row[0] * u[0] + row[1] * u[1]
                for index, row in rows.items()
                if _runs_into(row, u)
            }
            if not approached:
                return Struck(u, strikes, resting)
            index = min(approached, key=lambda number: (approached[number], number))
            strike = self.impact(index, q, u, time)
            strikes.append(strike)
            u = strike.u[1]
            resting = {i for i in resting if i != index and rests(rows[i], u)}
            if abs(strike.speeds[1]) <= _NO_REBOUND * abs(strike.speeds[0]):
                u = self.stopped([self._modes.elements[index].direction], q, u)
                resting.add(index)
        # They go on answering each other, ever more weakly: in the limit all come to rest.
        directions = [self._modes.elements[index].direction for index in touched]
        return Struck(self.stopped(directions, q, u), strikes, set(touched))

    def approached(self, index: int, q: Pair, u: Pair) -> bool:
        """Return whether an obstacle is run into, by more than rounding."""
        return _runs_into(self._row(index, q), u)

    def captured(self, index: int, q: Pair, u: Pair, time: float) -> Strike:
        """Return u without the speed along an obstacle, at which bounces to come are not seen.

        Their impulses, and the friction that goes with them, are those of resting on the obstacle,
        and of an impact that takes the rebound back.
        """
        obstacle = self._obstacle(index)
        row = self._row(index, q)
        speed = row[0] * u[0] + row[1] * u[1]
        s = sliding = 0 * speed
        force, held = row, [obstacle.direction]
        if obstacle.tangent is not None:
            tangent = self._modes.row(obstacle.tangent, q)
            sliding = tangent[0] * u[0] + tangent[1] * u[1]
            if rests(tangent, u):
                held.append(obstacle.tangent)
            else:
                s = -obstacle.kinetic if sliding > 0 else obstacle.kinetic
                force = row[0] + s * tangent[0], row[1] + s * tangent[1]
        normal = -speed / self._modes.response(row, force, q)
        after = self._after(q, u, (normal * force[0], normal * force[1]))
        after = self.stopped(held, q, after)
        impulse = Impulse(normal, s * normal, BOUNCES_DIE_AWAY)
        return self._strike(index, impulse, q, (u, after), time)

    def without_speed(self, index: int, q: Pair, u: Pair) -> Pair:
        """Return u without speed along an obstacle that is touched: exactly, not to rounding."""
        return self.stopped([self._obstacle(index).direction], q, u)

    def _obstacle(self, index: int) -> RigidContact:
        obstacle = self._modes.elements[index]
        assert isinstance(obstacle, RigidContact)
        return obstacle

    def impact(self, index: int, q: Pair, u: Pair, time: float) -> Strike:
        """Return what an obstacle does when it strikes at u."""
        obstacle, row = self._obstacle(index), self._row(index, q)
        # What was stopped along the normal comes in at no speed, and not at that of rounding.
        v_n = 0 * u[0] if rests(row, u) else row[0] * u[0] + row[1] * u[1]
        G_nn = self._modes.response(row, row, q)
        tangent = (0, 0) if obstacle.tangent is None else self._modes.row(obstacle.tangent, q)
        # A point that cannot move along the surface in this pose has no friction to speak of.
        if max(abs(entry) for entry in tangent) <= _NO_LEVER * max(abs(entry) for entry in row):
            impulse = smooth_impulse(v_n, G_nn, obstacle.restitution)
            after = self._after(q, u, (impulse.normal * row[0], impulse.normal * row[1]))
            return self._strike(index, impulse, q, (u, after), time)
        G_nt = self._modes.response(row, tangent, q)
        across = row[0] * tangent[1] - row[1] * tangent[0]
        # Nor does one that moves along one line only slide by itself: both speeds are one.
        if abs(across) <= _NO_LEVER * (abs(row[0] * tangent[1]) + abs(row[1] * tangent[0])):
            return self._guided_impact(index, q, u, time, (v_n, G_nn, G_nt))
        _, det_M = self._modes.inertia(q)
        impulse = rough_impulse(
            v_n,
            tangent[0] * u[0] + tangent[1] * u[1],
            Response(G_nn, G_nt, self._modes.response(tangent, tangent, q)),
            friction=obstacle.kinetic,
            restitution=obstacle.restitution,
            law=obstacle.law,
            determinant=across * across / det_M,
        )
        given = (
            impulse.normal * row[0] + impulse.tangential * tangent[0],
            impulse.normal * row[1] + impulse.tangential * tangent[1],
        )
        after = self._after(q, u, given)
        if impulse.regime.endswith("sticks"):
            # Where both speeds are known so is u: impulses lose digits near a straight pose.
            known = obstacle.law == "newton" or obstacle.restitution == 0
            found = row[0] * after[0] + row[1] * after[1]
            speed = -obstacle.restitution * v_n if known else found
            after = self._with_normal_speed(row, tangent, speed)
        return self._strike(index, impulse, q, (u, after), time)

    def _guided_impact(
        self, index: int, q: Pair, u: Pair, time: float, blow: tuple[Scalar, Scalar, Scalar]
    ) -> Strike:
        """Return what an obstacle does to a point that moves along one line only."""
        obstacle, row = self._obstacle(index), self._row(index, q)
        assert obstacle.tangent is not None
        tangent = self._modes.row(obstacle.tangent, q)
        v_n, G_nn, G_nt = blow
        impulse = guided_impulse(
            v_n,
            G_nn,
            G_nt / G_nn,
            friction=obstacle.kinetic,
            restitution=obstacle.restitution,
            law=obstacle.law,
        )
        normal, along = impulse.normal, impulse.tangential
        given = (normal * row[0] + along * tangent[0], normal * row[1] + along * tangent[1])
        after = self._after(q, u, given)
        if impulse.regime == "sticks":
            after = self.stopped([obstacle.direction], q, after)
        return self._strike(index, impulse, q, (u, after), time)

    def _strike(
        self, index: int, impulse: Impulse, q: Pair, speeds: tuple[Pair, Pair], time: float
    ) -> Strike:
        """Return the strike of an impact that changes u from the first of the speeds to the second.

        A tangent along which nothing slides has the speeds 0.
        """
        obstacle, row = self._obstacle(index), self._row(index, q)
        before, after = speeds
        along = (
            row[0] * before[0] + row[1] * before[1],
            row[0] * after[0] + row[1] * after[1],
        )
        sliding: Pair = (0.0, 0.0)
        if obstacle.tangent is not None:
            x, y = self._modes.row(obstacle.tangent, q)
            sliding = x * before[0] + y * before[1], x * after[0] + y * after[1]
        return Strike(time, index, obstacle.name, q, speeds, along, sliding, impulse)

    @staticmethod
    def _with_normal_speed(row: Pair, tangent: Pair, speed: Scalar) -> Pair:
        """Return the u that has a speed along the normal, and none along the tangent."""
        det = row[0] * tangent[1] - row[1] * tangent[0]
        return speed * tangent[1] / det, -speed * tangent[0] / det

    def _after(self, q: Pair, u: Pair, impulse: Pair) -> Pair:
        """Return u after a generalized impulse (N m s): M Δu = impulse."""
        ((M11, M12), (_, M22)), det = self._modes.inertia(q)
        Q1, Q2 = impulse
        return u[0] + (M22 * Q1 - M12 * Q2) / det, u[1] + (M11 * Q2 - M12 * Q1) / det

    def _row(self, index: int, q: Pair) -> Pair:
        return self._modes.row(self._modes.elements[index].direction, q)


def _is_left_over(row: Pair, u: Pair, before: Pair) -> bool:
    """Return whether the speed row · u is zero, but for the rounding of what u was before."""
    size = max(abs(before[0]), abs(before[1])) * (abs(row[0]) + abs(row[1]))
    return bool(abs(row[0] * u[0] + row[1] * u[1]) <= _LEFT_OVER * size)


def _runs_into(row: Pair, u: Pair) -> bool:
    """Return whether the speed row · u is negative, by more than rounding."""
    return bool(row[0] * u[0] + row[1] * u[1] < 0) and not rests(row, u)
