"""Robotics Toolbox for Python, by `roboticstoolbox-python`: URDF, recursive Newton-Euler, `fdyn`.

Traps: `gravity` is the acceleration of free fall, (0, 0, -9.81) by default, though the docstring of
`rne` speaks of the base. `URDF_file` drops the damping of joints, and takes their friction for the
viscous `B`; the adapter sets `B` to the damping of chains that come as parameters. Joints have no
springs: the torque function of `fdyn` adds them. `fdyn` is Python alone: a step takes milliseconds.
`coriolis` fails on every robot that is read from a URDF.
"""

from __future__ import annotations

import numpy as np
from adapter import (
    Array,
    Engine,
    Model,
    RefusedError,
    as_file,
    child_of,
    each,
    parameters_of,
    serve,
    springs_of,
)
from roboticstoolbox import Robot
from roboticstoolbox.models.URDF.URDFRobot import URDF_file


class Toolbox(Engine):
    """Robotics Toolbox for Python."""

    name, package = "Robotics Toolbox", "roboticstoolbox-python"
    effects = ("joint_damping", "joint_spring")
    methods = ({"name": "fdyn RK45", "order": 5.0, "parameter": "tolerance"},)
    issues = "https://github.com/petercorke/robotics-toolbox-python/issues"

    def load(self, model: Model) -> None:
        """Read the URDF by `URDF_file`."""
        with as_file(model.urdf) as path:
            links, name, *_ = URDF_file(path)
        self.robot = Robot(links, name=name, gravity=list(model.gravity))
        if self.robot.n != 2:
            raise RefusedError(f"{self.robot.n} degrees of freedom")
        children = [child_of(model.urdf, joint) for joint in model.joints]
        self.order = [self.robot.link_dict[child].jindex for child in children]
        self.tip = model.tip
        if model.planar:
            for child, damping in zip(children, parameters_of(model)["damping"], strict=True):
                self.robot.link_dict[child].B = damping
        self.stiffness, self.rest = np.zeros((2, 2))
        for joint, *spring in springs_of(model):
            number = self.order[model.joints.index(joint)]
            self.stiffness[number], self.rest[number] = spring

    def _each(self, function, *rows: Array) -> Array:
        back = np.argsort(self.order)
        return each(function, *(row[:, back] for row in rows))

    def mass_matrix(self, angles: Array) -> Array:
        """`inertia`."""
        return self._each(self.robot.inertia, angles)[:, self.order][:, :, self.order]

    def velocity_terms(self, angles: Array, speeds: Array) -> Array:
        """`coriolis` times the speeds."""
        terms = self._each(lambda q, v: self.robot.coriolis(q, v) @ v, angles, speeds)
        return terms[:, self.order]

    def gravity_terms(self, angles: Array) -> Array:
        """`gravload`."""
        return self._each(self.robot.gravload, angles)[:, self.order]

    def inverse_dynamics(self, angles: Array, speeds: Array, accelerations: Array) -> Array:
        """`rne`."""
        return self._each(self.robot.rne, angles, speeds, accelerations)[:, self.order]

    def forward_dynamics(self, angles: Array, speeds: Array, torques: Array) -> Array:
        """`accel`."""
        return self._each(self.robot.accel, angles, speeds, torques)[:, self.order]

    def position(self, angles: Array) -> Array:
        """`fkine`."""
        return self._each(lambda q: self.robot.fkine(q, end=self.tip).t, angles)

    def jacobian(self, angles: Array) -> Array:
        """`jacob0`."""
        rows = self._each(lambda q: self.robot.jacob0(q, end=self.tip)[:3], angles)
        return rows[:, :, self.order]

    def _springs(self, robot: Robot, time: float, q: Array, v: Array) -> Array:
        return self.stiffness * (self.rest - q)

    def move(
        self, angles: Array, speeds: Array, method: str, parameter: float, times: list[float]
    ) -> tuple[Array, Array]:
        """`fdyn`, from each time to the next."""
        back = np.argsort(self.order)
        q, v = angles[back], speeds[back]
        found = [(angles, speeds)]
        for duration in np.diff(times):
            settings = {"rtol": parameter, "atol": parameter}
            motion = self.robot.fdyn(float(duration), q, self._springs, qd0=v, solver_args=settings)
            q, v = motion.q[-1], motion.qd[-1]
            found.append((q[self.order], v[self.order]))
        return tuple(np.array(rows) for rows in zip(*found, strict=True))


if __name__ == "__main__":
    serve(Toolbox)
