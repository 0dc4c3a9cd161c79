"""MJX, MuJoCo on JAX, by `mujoco-mjx`: MuJoCo's URDF compiler, CRB, RNE, `step`.

Traps: binary32 unless `JAX_ENABLE_X64` is set, as here. The compiler fuses static bodies, so that D
disappears, unless `fusestatic` is off. Contacts need no geometry here. JAX compiles for some
seconds, but not again for another model of the same structure, as the model is an argument of the
compiled functions; states are padded to few sizes for the same reason. Damping is implicit by
default in the Euler method (`eulerdamp`).
"""

from __future__ import annotations

import os

os.environ["JAX_PLATFORMS"] = "cpu"
os.environ["JAX_ENABLE_X64"] = "1"

import contextlib
import math
import sys

import jax
import mujoco
import numpy as np
from adapter import Array, Engine, Model, RefusedError, serve, springs_of, stepped

# MJX prints at import.
with contextlib.redirect_stdout(sys.stderr):
    from mujoco import mjx


@jax.jit
def _values(
    model: mjx.Model, blank: mjx.Data, tip: int, angles: Array, speeds: Array, torques: Array
) -> dict[str, jax.Array]:
    """Return the quantities in all states."""

    def at(q: Array, v: Array, torque: Array) -> dict[str, jax.Array]:
        data = mjx.forward(model, blank.replace(qpos=q, qvel=v, qfrc_applied=torque))
        return {
            "full_m": mjx.full_m(model, data),
            "qfrc_bias": data.qfrc_bias,
            "qacc": data.qacc,
            "xpos": data.xpos[tip],
            "jac": mjx.jac(model, data, data.xpos[tip], tip)[0],
        }

    return jax.vmap(at)(angles, speeds, torques)


@jax.jit
def _run(model: mjx.Model, data: mjx.Data, step: float, count: int) -> mjx.Data:
    """Return the state after so many steps."""
    stepping = model.replace(opt=model.opt.replace(timestep=step))
    return jax.lax.fori_loop(0, count, lambda _, now: mjx.step(stepping, now), data)


class Mjx(Engine):
    """MJX."""

    name, package = "MJX", "mujoco-mjx"
    effects = ("joint_damping", "joint_spring", "armature")
    methods = (
        {"name": "Euler", "order": 1.0, "parameter": "step"},
        {"name": "RK4", "order": 4.0, "parameter": "step"},
    )
    issues = "https://github.com/google-deepmind/mujoco/issues"

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
        for name, stiffness, rest in springs_of(model):
            compiled.jnt_stiffness[compiled.joint(name).id] = stiffness
            compiled.qpos_spring[compiled.joint(name).qposadr[0]] = rest
        self.compiled = compiled
        self.tip = compiled.body(model.tip).id
        self.device = mjx.put_model(compiled)
        self.blank = mjx.make_data(self.device)
        return understood

    def _at(self, name: str, *rows: Array) -> Array:
        """Return one of the values of `_values` in all states."""
        back = np.argsort(self.order)
        count, nothing = len(rows[0]), np.zeros_like(rows[0])
        size = 2 ** max(5, math.ceil(math.log2(count)))
        padded = [
            np.pad(row[:, back], ((0, size - count), (0, 0)), mode="edge")
            for row in (*rows, nothing, nothing)[:3]
        ]
        return np.asarray(_values(self.device, self.blank, self.tip, *padded)[name])[:count]

    def mass_matrix(self, angles: Array) -> Array:
        """`full_m`."""
        return self._at("full_m", angles)[:, self.order][:, :, self.order]

    def gravity_terms(self, angles: Array) -> Array:
        """`qfrc_bias` at rest."""
        return self._at("qfrc_bias", angles)[:, self.order]

    def forward_dynamics(self, angles: Array, speeds: Array, torques: Array) -> Array:
        """`forward` with applied forces."""
        return self._at("qacc", angles, speeds, torques)[:, self.order]

    def position(self, angles: Array) -> Array:
        """`xpos`."""
        return self._at("xpos", angles)

    def jacobian(self, angles: Array) -> Array:
        """`jac`."""
        return np.swapaxes(self._at("jac", angles), 1, 2)[:, :, self.order]

    def move(
        self, angles: Array, speeds: Array, method: str, parameter: float, times: list[float]
    ) -> tuple[Array, Array]:
        """`step`."""
        self.compiled.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{method.upper()}")
        device = mjx.put_model(self.compiled)
        back = np.argsort(self.order)
        data = self.blank.replace(qpos=angles[back], qvel=speeds[back])
        found = [(angles, speeds)]

        for step, count in stepped(times, parameter):
            data = _run(device, data, step, count)
            found.append((np.asarray(data.qpos)[self.order], np.asarray(data.qvel)[self.order]))
        return tuple(np.array(rows) for rows in zip(*found, strict=True))


if __name__ == "__main__":
    serve(Mjx)
