"""adam, by `adam-robotics` (its NumPy interface): URDF, CRBA, RNEA, ABA of a floating base.

Traps: all algorithms are those of a floating base; the chain's part are the last two rows, with the
base at rest. Gravity is a vector of six numbers, -9.80665 along z by default. ABA has no fixed base
and is left out. Joint damping and friction are not in the equations.
"""

from __future__ import annotations

import numpy as np
from adam.numpy import KinDynComputations
from adapter import Array, Engine, Model, each, serve

_BASE, _REST = np.eye(4), np.zeros(6)


class Adam(Engine):
    """adam."""

    name, package = "adam", "adam-robotics"
    issues = "https://github.com/gbionics/adam/issues"

    def load(self, model: Model) -> None:
        """Read the URDF by `KinDynComputations`."""
        self.robot = KinDynComputations(
            model.urdf, list(model.joints), gravity=np.array([*model.gravity, 0.0, 0.0, 0.0])
        )
        self.tip = model.tip

    def mass_matrix(self, angles: Array) -> Array:
        """`mass_matrix`."""
        return each(lambda q: self.robot.mass_matrix(_BASE, q)[6:, 6:], angles)

    def velocity_terms(self, angles: Array, speeds: Array) -> Array:
        """`coriolis_term`."""
        terms = self.robot.coriolis_term
        return each(lambda q, v: np.ravel(terms(_BASE, q, _REST, v))[6:], angles, speeds)

    def gravity_terms(self, angles: Array) -> Array:
        """`gravity_term`."""
        return each(lambda q: np.ravel(self.robot.gravity_term(_BASE, q))[6:], angles)

    def position(self, angles: Array) -> Array:
        """`forward_kinematics`."""
        return each(lambda q: self.robot.forward_kinematics(self.tip, _BASE, q)[:3, 3], angles)

    def jacobian(self, angles: Array) -> Array:
        """`jacobian`, in the mixed representation."""
        return each(lambda q: self.robot.jacobian(self.tip, _BASE, q)[:3, 6:], angles)


if __name__ == "__main__":
    serve(Adam)
