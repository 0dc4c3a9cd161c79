"""Loads on the chain: forces at points and torques on links.

A load is independent of generalized coordinates. Each formulation maps it separately: Kane by the
velocity's partial derivatives, Lagrange by the position's, an engine by its external forces.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from twolink.arithmetic import Pair, Scalar
from twolink.chain import Point


@dataclass(frozen=True)
class Force:
    """A force at a point of a link: components along x and y (N; y points down)."""

    point: Point
    components: Pair

    def where(self, acts: Any) -> "Force":
        """Return the force at the times at which it acts, a boolean array, and zero at others."""
        x, y = self.components
        return Force(self.point, (np.where(acts, x, 0), np.where(acts, y, 0)))


@dataclass(frozen=True)
class Torque:
    """A torque on link 1 or 2 about z (N m), in the positive sense of the angles.

    A motor or a spring between the links is a pair of torques: +τ on link 2 and −τ on link 1.
    """

    link: int
    moment: Scalar

    def where(self, acts: Any) -> "Torque":
        """Return the torque at the times at which it acts, a boolean array, and zero at others."""
        return Torque(self.link, np.where(acts, self.moment, 0))


Load = Force | Torque
Loads = tuple[Load, ...]


def motor_loads(tau1: Scalar, tau2: Scalar) -> Loads:
    """Return the loads of torques (N m) in the joints A and B, positive in the sense of the angles.

    The motor at A is mounted on the ground and drives link 1; the one at B is mounted on link 1 and
    drives link 2, so its reaction acts on link 1.
    """
    return Torque(1, tau1), Torque(1, -tau2), Torque(2, tau2)
