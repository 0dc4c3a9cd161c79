"""Simbody, by the wheels of `opensim`: `SimbodyMatterSubsystem`, and OpenSim's `Manager`.

Traps: OpenSim reads no URDF, so that the adapter builds a model of pin joints from parameters. They
turn about z, with y upwards: angles have the opposite sign of the kit's. `Manager` integrates with
variable steps to a tolerance (`setIntegratorAccuracy`); forces must be components of the model. A
massless body is refused, so that D is a station of the second link. `addBody` rejects a negative
mass and leaves the body to two owners, which crashes the process when both free it: the adapter
asks the body for its mass properties before, which rejects the same masses.
"""

from __future__ import annotations

import numpy as np
import opensim
from adapter import Array, Engine, Model, each, parameters_of, serve, springs_of

opensim.Logger.setLevelString("Error")

_ZERO = opensim.Vec3(0)
_METHODS = {
    "RungeKuttaMerson": 4.0,
    "RungeKutta3": 3.0,
    "RungeKuttaFeldberg": 5.0,
    "CPodes": None,
}


class Simbody(Engine):
    """Simbody."""

    name = "Simbody (OpenSim)"
    package = "opensim"
    reads = ("parameters",)
    effects = ("joint_damping", "joint_spring")
    methods = tuple(
        {"name": name, "parameter": "tolerance", **({"order": order} if order else {})}
        for name, order in _METHODS.items()
    )
    issues = "https://github.com/opensim-org/opensim-core/issues"

    def load(self, model: Model) -> None:
        """Build a model of two bodies on pin joints."""
        given = parameters_of(model)
        vector, zero = opensim.Vec3, opensim.Vec3(0)
        self.model = opensim.Model()
        self.model.setGravity(vector(0, -given["gravity"], 0))
        parent, place = self.model.getGround(), zero
        for number, name in enumerate(("shoulder", "elbow")):
            a, b = given["centre"][number]
            moment = given["inertia"][number]
            body = opensim.Body(
                f"link{number}",
                given["mass"][number],
                vector(a, -b, 0),
                opensim.Inertia(moment, moment, moment, 0, 0, 0),
            )
            body.getMassProperties()
            joint = opensim.PinJoint(name, parent, place, zero, body, zero, zero)
            self.model.addBody(body)
            self.model.addJoint(joint)
            parent, place = body, vector(given["length"][number], 0, 0)
        self.tip = place
        springs = {name: spring for name, *spring in springs_of(model)}
        for number, name in enumerate(("shoulder", "elbow")):
            coordinate = self.model.getJointSet().get(number).get_coordinates(0)
            coordinate.setName(f"{name}_angle")
            stiffness, rest = springs.get(name, (0.0, 0.0))
            damping = given["damping"][number]
            if damping or stiffness:
                force = opensim.SpringGeneralizedForce(f"{name}_angle")
                force.setStiffness(stiffness)
                force.setRestLength(-rest)
                force.setViscosity(damping)
                self.model.addForce(force)
        self.state = self.model.initSystem()
        self.matter = self.model.getMatterSubsystem()

    def _at(self, q: Array, v: Array | None = None) -> opensim.State:
        speeds = np.zeros(2) if v is None else v
        for number in range(2):
            coordinate = self.model.getJointSet().get(number).get_coordinates(0)
            coordinate.setValue(self.state, float(-q[number]), False)
            coordinate.setSpeedValue(self.state, float(-speeds[number]))
        self.model.realizeVelocity(self.state)
        return self.state

    def mass_matrix(self, angles: Array) -> Array:
        """`calcM`."""

        def matrix(q: Array) -> Array:
            M = opensim.Matrix()
            self.matter.calcM(self._at(q), M)
            return np.array([[M.get(i, j) for j in range(2)] for i in range(2)])

        return each(matrix, angles)

    def velocity_terms(self, angles: Array, speeds: Array) -> Array:
        """`calcResidualForceIgnoringConstraints` without forces."""

        def terms(q: Array, v: Array) -> Array:
            state, found = self._at(q, v), opensim.Vector()
            nothing = opensim.VectorOfSpatialVec(3, opensim.SpatialVec(_ZERO, _ZERO))
            at_rest = opensim.Vector(2, 0.0)
            self.matter.calcResidualForceIgnoringConstraints(
                state, at_rest, nothing, at_rest, found
            )
            return -np.array([found.get(0), found.get(1)])

        return each(terms, angles, speeds)

    def inverse_dynamics(self, angles: Array, speeds: Array, accelerations: Array) -> Array:
        """`InverseDynamicsSolver.solve`."""

        def torques(q: Array, v: Array, a: Array) -> Array:
            solver = opensim.InverseDynamicsSolver(self.model)
            found = solver.solve(self._at(q, v), _vector(-a))
            return -np.array([found.get(0), found.get(1)])

        return each(torques, angles, speeds, accelerations)

    def kinetic_energy(self, angles: Array, speeds: Array) -> Array:
        """`calcKineticEnergy`."""
        return each(lambda q, v: self.matter.calcKineticEnergy(self._at(q, v)), angles, speeds)

    def potential_energy(self, angles: Array) -> Array:
        """`calcPotentialEnergy`."""

        def energy(q: Array) -> float:
            self.model.realizeDynamics(self._at(q))
            return self.model.calcPotentialEnergy(self.state)

        return each(energy, angles)

    def forward_dynamics(self, angles: Array, speeds: Array, torques: Array) -> Array:
        """`realizeAcceleration`, with torques through M⁻¹ by `multiplyByMInv`."""

        def accelerations(q: Array, v: Array, torque: Array) -> Array:
            state = self._at(q, v)
            self.model.realizeAcceleration(state)
            free, extra = state.getUDot(), opensim.Vector()
            self.matter.multiplyByMInv(state, _vector(-torque), extra)
            return -np.array([free.get(i) + extra.get(i) for i in range(2)])

        return each(accelerations, angles, speeds, torques)

    def position(self, angles: Array) -> Array:
        """`findStationLocationInGround` of D."""
        body = self.model.getBodySet().get(1)

        def place(q: Array) -> Array:
            found = body.findStationLocationInGround(self._at(q), self.tip)
            return np.array([found.get(0), 0.0, found.get(1)])

        return each(place, angles)

    def velocity(self, angles: Array, speeds: Array) -> Array:
        """`findStationVelocityInGround` of D."""
        body = self.model.getBodySet().get(1)

        def rate(q: Array, v: Array) -> Array:
            found = body.findStationVelocityInGround(self._at(q, v), self.tip)
            return np.array([found.get(0), 0.0, found.get(1)])

        return each(rate, angles, speeds)

    def move(
        self, angles: Array, speeds: Array, method: str, parameter: float, times: list[float]
    ) -> tuple[Array, Array]:
        """`Manager.integrate`."""
        state = self._at(angles, speeds)
        state.setTime(times[0])
        manager = opensim.Manager(self.model)
        manager.setIntegratorMethod(getattr(opensim.Manager, f"IntegratorMethod_{method}"))
        manager.setIntegratorAccuracy(parameter)
        manager.setWriteToStorage(False)
        manager.initialize(state)
        found = [(angles, speeds)]
        for time in times[1:]:
            state = manager.integrate(time)
            found.append(
                tuple(-np.array([row.get(0), row.get(1)]) for row in (state.getQ(), state.getU()))
            )
        return tuple(np.array(rows) for rows in zip(*found, strict=True))


def _vector(values: Array) -> opensim.Vector:
    found = opensim.Vector(len(values), 0.0)
    for index, value in enumerate(values):
        found.set(index, float(value))
    return found


if __name__ == "__main__":
    serve(Simbody)
