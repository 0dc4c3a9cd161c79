"""Constraint coordinates: the motions that friction resists and contacts limit.

A coordinate is defined by the load that does unit work along it. Each formulation maps this load to
generalized forces, which by the principle of virtual work are also the Jacobian row of the
coordinate: its speed is the row times u. A constraint thus enters each formulation as a load does.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol

from twolink.arithmetic import Pair, Scalar
from twolink.chain import Chain, Point
from twolink.kinematics import acceleration, position, velocity
from twolink.loads import Force, Loads, motor_loads

PointName = Literal["B", "C1", "C2", "D"]


class ConstraintCoordinate(Protocol):
    """A scalar function of q (rad or m) with its rate and the load that does work along it."""

    def __hash__(self) -> int:
        """Return a hash: compiled formulas are kept by their coordinate."""

    def coordinate(self, chain: Chain, q: Pair) -> Scalar:
        """Return the value (rad or m)."""

    def speed(self, chain: Chain, q: Pair, u: Pair) -> Scalar:
        """Return the coordinate's rate (rad/s or m/s)."""

    def bias(self, chain: Chain, q: Pair, u: Pair) -> Scalar:
        """Return the coordinate's second derivative when du = 0 (rad/s² or m/s²)."""

    def unit_loads(self, chain: Chain) -> Loads:
        """Return the loads that do 1 J of work per radian or metre of the coordinate."""

    def size(self, chain: Chain) -> float:
        """Return the usual size of its values: 1 rad, or the length of the stretched chain (m)."""


@dataclass(frozen=True)
class JointCoordinate:
    """The angle of the joint A or B times `sense`, +1 or −1."""

    joint: Literal["A", "B"]
    sense: int = 1

    def coordinate(self, chain: Chain, q: Pair) -> Scalar:
        """Return the joint's angle, q1 or q2 − q1, times the sense (rad)."""
        return self._of(q)

    def speed(self, chain: Chain, q: Pair, u: Pair) -> Scalar:
        """Return the joint's speed, u1 or u2 − u1, times the sense (rad/s)."""
        return self._of(u)

    def bias(self, chain: Chain, q: Pair, u: Pair) -> Scalar:
        """Return 0: the second derivative of an angle is linear in du."""
        return 0

    def unit_loads(self, chain: Chain) -> Loads:
        """Return a torque of 1 N m in the joint."""
        return motor_loads(self.sense, 0) if self.joint == "A" else motor_loads(0, self.sense)

    def size(self, chain: Chain) -> float:
        """Return 1 rad."""
        return 1.0

    def _of(self, pair: Pair) -> Scalar:
        of_joint = pair[0] if self.joint == "A" else pair[1] - pair[0]
        return of_joint if self.sense > 0 else -of_joint


@dataclass(frozen=True)
class PointCoordinate:
    """The position of a named point along a unit vector (x, y)."""

    point: PointName
    vector: tuple[float, float]

    def coordinate(self, chain: Chain, q: Pair) -> Scalar:
        """Return the point's position along the vector (m)."""
        return self._along(position(chain, q, self.of(chain)))

    def speed(self, chain: Chain, q: Pair, u: Pair) -> Scalar:
        """Return the point's velocity along the vector (m/s)."""
        return self._along(velocity(chain, q, u, self.of(chain)))

    def bias(self, chain: Chain, q: Pair, u: Pair) -> Scalar:
        """Return the point's acceleration along the vector when du = 0 (m/s²)."""
        return self._along(acceleration(chain, q, u, (0, 0), self.of(chain)))

    def unit_loads(self, chain: Chain) -> Loads:
        """Return a force of 1 N at the point, along the vector."""
        return (Force(self.of(chain), self.vector),)

    def size(self, chain: Chain) -> float:
        """Return the length of the stretched chain (m)."""
        return float(chain.L1 + chain.L2)

    def of(self, chain: Chain) -> Point:
        """Return the point on its link."""
        point: Point = getattr(chain, self.point)
        return point

    def _along(self, vector: Pair) -> Scalar:
        x, y = self.vector
        return x * vector[0] + y * vector[1]
