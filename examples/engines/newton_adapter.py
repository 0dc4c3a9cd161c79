"""Newton, by `newton` and Warp on the CPU: URDF, its evaluations, and its solvers by `step`.

Traps: the package `newton-physics` is a renamed shell. All numbers are binary32. Kernels are
compiled at the first start, which takes minutes: use `--seconds 300 --memory 24`. Gravity is a
vector of the builder. `SolverFeatherstone` and `SolverSemiImplicit` damp angular speeds (0.05 by
default; 0 here). Solvers in maximal coordinates know angles up to full turns only; the adapter
counts the turns. They hold a link without mass in its place, as an immovable one, so that they get
the model with its fixed joints collapsed; without that the tip pins the chain. Continuous joints
are unlimited; the joint limits of others are springs.

Featherstone, MuJoCo and SemiImplicit have passive damping and springs of joints (`joint_damping`,
`joint_stiffness`, `joint_rest_q`). Steel and Kamino have the damping alone, XPBD and VBD neither:
drives of the joints (`joint_target_ke`, `joint_target_kd`), with targets at rest, are in their
place.

`python newton_adapter.py collapse` reads URDF with `collapse_fixed_joints=True`; names of solvers
(`python newton_adapter.py Featherstone XPBD`) are the methods that it offers, by default all but
Kamino, whose 1000 steps did not end in three minutes on two cores.
"""

from __future__ import annotations

import sys
from typing import Any

import newton
import numpy as np
import warp as wp
from adapter import Array, Engine, Model, RefusedError, each, serve, springs_of, stepped

wp.config.quiet = True

_COLLAPSE = "collapse" in sys.argv[1:]
_SOLVERS = newton.solvers
_METHODS = {
    "Featherstone": lambda m: _SOLVERS.SolverFeatherstone(m, angular_damping=0.0),
    "MuJoCo": lambda m: _SOLVERS.SolverMuJoCo(m, disable_contacts=True),
    "Steel": _SOLVERS.SolverSteel,
    "Kamino": _SOLVERS.SolverKamino,
    "SemiImplicit": lambda m: _SOLVERS.SolverSemiImplicit(m, angular_damping=0.0),
    "XPBD": _SOLVERS.SolverXPBD,
    "VBD": _SOLVERS.SolverVBD,
}
_CHOSEN = [name for name in _METHODS if name in sys.argv[1:]] or [
    name for name in _METHODS if name != "Kamino"
]
_MAXIMAL = ("Kamino", "SemiImplicit", "XPBD", "VBD")
_DRIVEN_SPRINGS = ("Steel", "Kamino", "XPBD", "VBD")
_DRIVEN_DAMPING = ("XPBD", "VBD")


class Newton(Engine):
    """Newton."""

    name = "Newton, fixed joints collapsed" if _COLLAPSE else "Newton"
    package, precision = "newton", "binary32"
    effects = ("armature", "joint_damping", "joint_spring")
    methods = tuple({"name": name, "order": 1.0, "parameter": "step"} for name in _CHOSEN)
    issues = "https://github.com/newton-physics/newton/issues"

    def load(self, model: Model) -> dict[str, Any]:
        """Read the URDF by `add_urdf`; the armature is set on the model."""
        self.read = model
        return self._take(collapse=_COLLAPSE)

    def _take(self, *, collapse: bool) -> dict[str, Any]:
        """Build the model that was read."""
        model, self.collapsed = self.read, collapse
        builder = newton.ModelBuilder(gravity=model.gravity)
        builder.add_urdf(model.urdf, collapse_fixed_joints=collapse)
        # Otherwise Kamino asks for the gains of motors that no joint has.
        builder.joint_target_mode = [int(newton.JointTargetMode.NONE)] * builder.joint_dof_count
        labels = [label.rpartition("/")[2] for label in builder.joint_label]
        if builder.joint_dof_count != 2 or not set(model.joints) <= set(labels):
            raise RefusedError(f"{builder.joint_dof_count} degrees of freedom")
        builder.color()
        self.model = builder.finalize(device="cpu")
        self.joints = [labels.index(name) for name in model.joints]
        starts = self.model.joint_qd_start.numpy()
        self.order = [int(starts[joint]) for joint in self.joints]
        bodies = [label.rpartition("/")[2] for label in builder.body_label]
        self.tip = bodies.index(model.tip) if model.tip in bodies else None
        if model.planar:
            armature = np.array(model.armature, dtype=np.float32)
            self.model.joint_armature.assign(armature[np.argsort(self.order)])
        self.state = self.model.state()
        return self._understood()

    def _understood(self) -> dict[str, Any]:
        found: dict[str, Any] = {}
        for key in ("damping", "friction", "armature"):
            name = f"joint_{key}"
            found[key] = [float(getattr(self.model, name).numpy()[n]) for n in self.order]
        return found

    def _at(self, q: Array, v: Array | None = None) -> newton.State:
        back = np.argsort(self.order)
        self.state.joint_q.assign(q[back].astype(np.float32))
        self.state.joint_qd.assign((np.zeros(2) if v is None else v[back]).astype(np.float32))
        newton.eval_fk(self.model, self.state.joint_q, self.state.joint_qd, self.state)
        return self.state

    def mass_matrix(self, angles: Array) -> Array:
        """`eval_mass_matrix`."""
        M = each(lambda q: newton.eval_mass_matrix(self.model, self._at(q)).numpy()[0], angles)
        return M[:, self.order][:, :, self.order]

    def _passive(self, *state: Array) -> dict[str, wp.array]:
        """`eval_inverse_dynamics_passive`."""
        names = ("gravity_force", "coriolis_force")
        found = {name: wp.zeros(2, dtype=float, device="cpu") for name in names}
        newton.eval_inverse_dynamics_passive(self.model, self._at(*state), **found)
        return found

    def velocity_terms(self, angles: Array, speeds: Array) -> Array:
        """`eval_inverse_dynamics_passive`, coriolis_force."""
        rows = each(lambda *s: self._passive(*s)["coriolis_force"].numpy(), angles, speeds)
        return rows[:, self.order]

    def gravity_terms(self, angles: Array) -> Array:
        """`eval_inverse_dynamics_passive`, gravity_force."""
        rows = each(lambda q: self._passive(q)["gravity_force"].numpy(), angles)
        return rows[:, self.order]

    def inverse_dynamics(self, angles: Array, speeds: Array, accelerations: Array) -> Array:
        """`eval_inverse_dynamics_force`."""

        def torques(q: Array, v: Array, a: Array) -> Array:
            given = {
                **self._passive(q, v),
                "mass_matrix": newton.eval_mass_matrix(self.model, self.state),
                "joint_qdd": wp.array(a[np.argsort(self.order)], dtype=float, device="cpu"),
                "joint_f": wp.zeros(2, dtype=float, device="cpu"),
            }
            newton.eval_inverse_dynamics_force(self.model, self.state, **given)
            return given["joint_f"].numpy()[self.order]

        return each(torques, angles, speeds, accelerations)

    def jacobian(self, angles: Array) -> Array:
        """`eval_jacobian`, at the tip's mass centre, which is its origin."""
        first = 6 * int(np.flatnonzero(self.model.joint_child.numpy() == self.tip)[0])
        rows = each(lambda q: newton.eval_jacobian(self.model, self._at(q)).numpy()[0], angles)
        return rows[:, first : first + 3, self.order]

    def velocity(self, angles: Array, speeds: Array) -> Array:
        """`eval_fk`: the velocity of the tip's mass centre, which is its origin."""
        return each(lambda *s: self._at(*s).body_qd.numpy()[self.tip][:3], angles, speeds)

    def position(self, angles: Array) -> Array:
        """`eval_fk`."""
        return each(lambda q: self._at(q).body_q.numpy()[self.tip][:3], angles)

    def _resist(self, method: str) -> None:
        """Put springs and damping where a solver has them: in the joints, or in their drives."""
        model = self.model
        stiffness, rest, none = np.zeros((3, 2), dtype=np.float32)
        for name, *spring in springs_of(self.read):
            number = self.order[self.read.joints.index(name)]
            stiffness[number], rest[number] = spring
        driven = method in _DRIVEN_SPRINGS
        # Kamino has drives of these modes alone; MuJoCo must have no motors.
        mode = newton.JointTargetMode.POSITION if driven else newton.JointTargetMode.NONE
        model.joint_target_mode.assign(np.where(stiffness > 0, int(mode), 0).astype(np.int32))
        model.joint_stiffness.assign(none if driven else stiffness)
        model.joint_rest_q.assign(rest)
        model.joint_target_ke.assign(stiffness if driven else none)
        model.joint_target_kd.assign(model.joint_damping if method in _DRIVEN_DAMPING else none)
        model.joint_target_q.assign(rest)

    def move(
        self, angles: Array, speeds: Array, method: str, parameter: float, times: list[float]
    ) -> tuple[Array, Array]:
        """`step` of a solver."""
        if self.collapsed != (_COLLAPSE or method in _MAXIMAL):
            self._take(collapse=not self.collapsed)
        self._resist(method)
        solver = _METHODS[method](self.model)
        self._at(angles, speeds)
        now, after, control = self.model.state(), self.model.state(), self.model.control()
        now.assign(self.state)
        found, seen = [(angles, speeds)], angles
        for step, count in stepped(times, parameter):
            for _ in range(count):
                now.clear_forces()
                solver.step(now, after, control, None, step)
                now, after = after, now
                if method in _MAXIMAL:
                    newton.eval_ik(self.model, now, now.joint_q, now.joint_qd)
                q = now.joint_q.numpy()[self.order].astype(float)
                seen = q + 2 * np.pi * np.round((seen - q) / (2 * np.pi))
            found.append((seen, now.joint_qd.numpy()[self.order]))
        return tuple(np.array(rows) for rows in zip(*found, strict=True))


if __name__ == "__main__":
    serve(Newton)
