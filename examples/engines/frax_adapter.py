"""frax, by `frax` (JAX): URDF, CRBA, RNEA, forward dynamics.

Traps: binary64 needs `JAX_ENABLE_X64=1`, as here. Gravity is fixed, -9.81 along z, but for RNEA,
which takes it. Joints of type `continuous` must have limits. Damping and friction are left out.
"""

from __future__ import annotations

import os

os.environ["JAX_ENABLE_X64"] = "1"
os.environ["JAX_PLATFORMS"] = "cpu"

import frax
import numpy as np
from adapter import Array, Engine, Model, RefusedError, as_file, serve
from jax import jit, vmap


class Frax(Engine):
    """frax."""

    name, package = "frax", "frax"
    issues = "https://github.com/StanfordASL/frax/issues"

    def load(self, model: Model) -> None:
        """Read the URDF by `Robot`."""
        with as_file(model.urdf) as path:
            self.robot = frax.Robot(path)
        names = list(self.robot.joint_names)
        if self.robot.nv != 2 or not set(model.joints) <= set(names):
            raise RefusedError(f"{self.robot.nv} degrees of freedom")
        self.order = [names.index(joint) for joint in model.joints]
        # The acceleration of the base against gravity, as a spatial vector.
        self.gravity = np.array([*(-np.array(model.gravity)), 0.0, 0.0, 0.0])

    def _each(self, function, *rows: Array) -> Array:
        back = np.argsort(self.order)
        return np.asarray(jit(vmap(function))(*(row[:, back] for row in rows)))

    def mass_matrix(self, angles: Array) -> Array:
        """`mass_matrix`."""
        return self._each(self.robot.mass_matrix, angles)[:, self.order][:, :, self.order]

    def velocity_terms(self, angles: Array, speeds: Array) -> Array:
        """`centrifugal_coriolis_vector`."""
        terms = self._each(self.robot.centrifugal_coriolis_vector, angles, speeds)
        return terms[:, self.order]

    def inverse_dynamics(self, angles: Array, speeds: Array, accelerations: Array) -> Array:
        """`rnea`, with gravity."""
        rnea = lambda q, v, a: self.robot.rnea(q, v, a, self.gravity, None)  # noqa: E731
        return self._each(rnea, angles, speeds, accelerations)[:, self.order]

    def gravity_terms(self, angles: Array) -> Array:
        """`rnea` at rest, with gravity."""
        rnea = lambda q: self.robot.rnea(q, None, None, self.gravity, None)  # noqa: E731
        return self._each(rnea, angles)[:, self.order]


if __name__ == "__main__":
    serve(Frax)
