"""PhysX 5, by `sapien`: its URDF loader, reduced-coordinate articulations, `PhysxCpuSystem.step`.

Traps: all numbers are binary32. The loader reads files alone, and wants a rendering device for
visuals, which the adapter leaves out. A link without `<inertial>`, or with a zero mass or inertia,
weighs 1e-6 kg. Joints have friction (0.05) unless it is set to zero, as here, and links are damped
(`linear_damping`, `angular_damping`; 0 here) and sleep when they are slow (threshold 0 here). The
angles of continuous joints are wrapped; `revolute_unwrapped` keeps them. A spring is a joint's
drive, with its target at rest.
"""

from __future__ import annotations

import re

import numpy as np
import sapien
from adapter import Array, Engine, Model, RefusedError, as_file, each, serve, springs_of, stepped
from sapien import physx
from sapien.wrapper.urdf_loader import URDFLoader

_VISUAL = re.compile(r"<visual\b.*?</visual>", re.DOTALL)


class Physx(Engine):
    """PhysX."""

    name, package, precision = "PhysX (SAPIEN)", "sapien", "binary32"
    effects = ("joint_damping", "joint_spring")
    methods = ({"name": "step", "order": 1.0, "parameter": "step"},)
    issues = "https://github.com/haosulab/SAPIEN/issues"

    def load(self, model: Model) -> dict:
        """Read the URDF by `URDFLoader`."""
        config = physx.PhysxSceneConfig()
        config.gravity = np.array(model.gravity)
        physx.set_scene_config(config)
        self.scene = sapien.Scene([physx.PhysxCpuSystem()])
        loader = URDFLoader()
        loader.set_scene(self.scene)
        loader.revolute_unwrapped = True
        with as_file(_VISUAL.sub("", model.urdf)) as path:
            robots, actors, _ = loader.parse(path)
        if len(robots) != 1 or actors:
            raise RefusedError(f"{len(robots)} articulations")
        self.robot = robots[0].build()
        active = self.robot.get_active_joints()
        names = [joint.name for joint in active]
        if sorted(names) != sorted(model.joints):
            raise RefusedError(f"{len(names)} degrees of freedom")
        self.order = [names.index(name) for name in model.joints]
        self.robot.set_sleep_threshold(0.0)
        for link in self.robot.get_links():
            link.set_linear_damping(0.0)
            link.set_angular_damping(0.0)
        for number, name in enumerate(model.joints):
            joint = active[names.index(name)]
            joint.set_friction(0.0)
            joint.set_armature(np.array([model.armature[number]], dtype=np.float32))
        for name, stiffness, rest in springs_of(model):
            joint = active[names.index(name)]
            joint.set_drive_properties(stiffness, joint.damping)
            joint.set_drive_target(rest)
        joints = [active[index] for index in self.order]
        limits = [np.array(joint.get_limits()[0], dtype=float) for joint in joints]
        return {
            "damping": [float(joint.damping) for joint in joints],
            "limits": [
                [float(x) for x in pair] if np.isfinite(pair).all() else None for pair in limits
            ],
        }

    def _at(self, q: Array, v: Array | None = None) -> physx.PhysxArticulation:
        back = np.argsort(self.order)
        self.robot.set_qpos(q[back])
        self.robot.set_qvel(np.zeros(2) if v is None else v[back])
        return self.robot

    def _passive(self, gravity: bool, *state: Array) -> Array:
        return self._at(*state).compute_passive_force(gravity, not gravity)[self.order]

    def velocity_terms(self, angles: Array, speeds: Array) -> Array:
        """`compute_passive_force`, coriolis_and_centrifugal."""
        return each(lambda *state: self._passive(False, *state), angles, speeds)

    def gravity_terms(self, angles: Array) -> Array:
        """`compute_passive_force`, gravity."""
        return each(lambda q: self._passive(True, q), angles)

    def move(
        self, angles: Array, speeds: Array, method: str, parameter: float, times: list[float]
    ) -> tuple[Array, Array]:
        """`PhysxCpuSystem.step`."""
        self._at(angles, speeds)
        found = [(angles, speeds)]
        for step, count in stepped(times, parameter):
            self.scene.set_timestep(step)
            for _ in range(count):
                self.scene.step()
            found.append((self.robot.get_qpos()[self.order], self.robot.get_qvel()[self.order]))
        return tuple(np.array(rows) for rows in zip(*found, strict=True))


if __name__ == "__main__":
    serve(Physx)
