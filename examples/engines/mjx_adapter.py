"""MJX, MuJoCo on JAX, by `mujoco-mjx`: MuJoCo's URDF compiler, CRB, RNE, `step`.

Traps: binary32 unless `JAX_ENABLE_X64` is set, as here. The compiler fuses static bodies, so that D
disappears, unless `fusestatic` is off. Contacts need no geometry here. `step` compiles for each
model; damping is implicit by default in the Euler method (`eulerdamp`).
"""

from __future__ import annotations

import os

os.environ["JAX_PLATFORMS"] = "cpu"
os.environ["JAX_ENABLE_X64"] = "1"

from typing import Any

import jax
import mujoco
import numpy as np
from adapter import Array, Engine, Model, RefusedError, serve, stepped


class Mjx(Engine):
    """MJX."""

    name, package = "MJX", "mujoco-mjx"
    effects = ("joint_damping", "armature")
    methods = (
        {"name": "Euler", "order": 1.0, "parameter": "step"},
        {"name": "RK4", "order": 4.0, "parameter": "step"},
    )
    issues = "https://github.com/google-deepmind/mujoco/issues"

    def __init__(self) -> None:
        """Import MJX, which prints."""
        from mujoco import mjx

        self.mjx = mjx

    def load(self, model: Model) -> dict:
        """Compile the URDF, and put the model on JAX."""
        spec = mujoco.MjSpec.from_string(model.urdf)
        spec.compiler.fusestatic = False
        spec.option.gravity = model.gravity
        spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_LIMIT
        spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
        compiled = spec.compile()
        if compiled.nv != 2:
            raise RefusedError(f"{compiled.nv} degrees of freedom")
        self.order = [compiled.joint(joint).dofadr[0] for joint in model.joints]
        understood = {
            "damping": compiled.dof_damping[self.order].tolist(),
            "friction": compiled.dof_frictionloss[self.order].tolist(),
        }
        compiled.dof_frictionloss[:] = 0.0
        compiled.dof_armature[self.order] += model.armature
        self.compiled = compiled
        self.tip = compiled.body(model.tip).id
        self.device = self.mjx.put_model(compiled)
        self.blank = self.mjx.make_data(self.device)
        return understood

    def _each(self, function, *rows: Array) -> Array:
        back = np.argsort(self.order)

        def at(*state):
            names = dict(zip(("qpos", "qvel"), state[:2], strict=False))
            return function(self.mjx.forward(self.device, self.blank.replace(**names)), *state[2:])

        return np.asarray(jax.jit(jax.vmap(at))(*(row[:, back] for row in rows)))

    def mass_matrix(self, angles: Array) -> Array:
        """`full_m`."""
        M = self._each(lambda data: self.mjx.full_m(self.device, data), angles)
        return M[:, self.order][:, :, self.order]

    def gravity_terms(self, angles: Array) -> Array:
        """`qfrc_bias` at rest."""
        return self._each(lambda data: data.qfrc_bias, angles)[:, self.order]

    def forward_dynamics(self, angles: Array, speeds: Array, torques: Array) -> Array:
        """`forward` with applied forces."""

        def act(data: Any, torque: jax.Array) -> jax.Array:
            return self.mjx.forward(self.device, data.replace(qfrc_applied=torque)).qacc

        return self._each(act, angles, speeds, torques)[:, self.order]

    def position(self, angles: Array) -> Array:
        """`xpos`."""
        return self._each(lambda data: data.xpos[self.tip], angles)

    def jacobian(self, angles: Array) -> Array:
        """`jac`."""
        jac = lambda data: self.mjx.jac(self.device, data, data.xpos[self.tip], self.tip)[0]  # noqa: E731
        return np.swapaxes(self._each(jac, angles), 1, 2)[:, :, self.order]

    def move(
        self, angles: Array, speeds: Array, method: str, parameter: float, times: list[float]
    ) -> tuple[Array, Array]:
        """`step`."""
        self.compiled.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{method.upper()}")
        device = self.mjx.put_model(self.compiled)
        back = np.argsort(self.order)
        data = self.blank.replace(qpos=angles[back], qvel=speeds[back])
        found = [(angles, speeds)]

        @jax.jit
        def run(data, step, count):
            with_step = device.replace(opt=device.opt.replace(timestep=step))
            return jax.lax.fori_loop(0, count, lambda _, at: self.mjx.step(with_step, at), data)

        for step, count in stepped(times, parameter):
            data = run(data, step, count)
            found.append((np.asarray(data.qpos)[self.order], np.asarray(data.qvel)[self.order]))
        return tuple(np.array(rows) for rows in zip(*found, strict=True))


if __name__ == "__main__":
    serve(Mjx)
