"""Compare contact at the end point D: formulations and contact solver against Pinocchio."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from os import PathLike
from typing import Any

import numpy as np

from twolink.arithmetic import Pair, Scalar
from twolink.chain import Chain
from twolink.contact.coordinates import PointCoordinate
from twolink.contact.elements import RigidContact
from twolink.contact.impact_laws import smooth_impulse
from twolink.contact.states import ContactState
from twolink.effects import ContactEffect, Effect
from twolink.effects.gravity import Gravity
from twolink.effects.joint_torque import JointTorque
from twolink.engines.pinocchio_chain import PinocchioChain
from twolink.errors import ParameterError
from twolink.formulations import FORMULATIONS, Formulation
from twolink.limits import DEFAULT_LIMITS, Limits
from twolink.loads import Force, Loads, Torque
from twolink.names import FormulationName
from twolink.simulation.hybrid.dynamics import Solution, mode_solution
from twolink.simulation.hybrid.pose import Pose
from twolink.urdf import PlanarUrdf
from twolink.verification.contact_tolerance import contact_tolerance
from twolink.verification.jointspace import PlanarModel
from twolink.verification.quantities import Quantity
from twolink.verification.states import Array, ContactStates, random_contact_states
from twolink.verification.verdict import Verdict
from twolink.verification.verify import ComparisonPlan, Progress, cases, planar_urdf

Three = tuple[Scalar, Scalar, Scalar]
Four = tuple[Scalar, Scalar, Scalar, Scalar]


@dataclass(frozen=True)
class _Still(PointCoordinate):
    """A constraint direction of D with zero position error and zero speed.

    The simulation adds Baumgarte stabilisation to the bias. Position and speed errors are zero
    here, so the bias contains only the terms of the equations of motion, at any speed.
    """

    def coordinate(self, chain: Chain, q: Pair) -> Scalar:
        """Return 0 (m): D is on the surface."""
        return 0

    def speed(self, chain: Chain, q: Pair, u: Pair) -> Scalar:
        """Return 0 (m/s)."""
        return 0


@dataclass(frozen=True)
class _Touched(ContactEffect):
    """A surface in contact with D, with a unit `normal` of any scalar type."""

    normal: Pair
    rough: bool

    def loads(self, chain: Chain, q: Pair, u: Pair, t: Scalar = 0.0) -> Loads:
        """Return no loads: contact forces are unknowns of the constrained solution."""
        return ()

    def smooth_loads(self, chain: Chain, q: Pair, u: Pair, t: Scalar = 0.0) -> Loads:
        """Return no load."""
        return ()

    def contact_elements(self, chain: Chain) -> tuple[RigidContact, ...]:
        """Return the surface as a rigid contact element; the friction force is unbounded."""
        x, y = self.normal
        tangent = _Still("D", (-y, x)) if self.rough else None
        return (RigidContact("surface", _Still("D", self.normal), 0, 0, tangent),)


@dataclass(frozen=True)
class _Given(Effect):
    """Generalized forces over absolute angles (N m), as an effect."""

    generalized: Pair

    def loads(self, chain: Chain, q: Pair, u: Pair, t: Scalar = 0.0) -> Loads:
        """Return the forces as torques on both links."""
        return Torque(1, self.generalized[0]), Torque(2, self.generalized[1])


class ContactSpace:
    """A formulation's contact equations of D in the URDF's joint angles θ, as engines use.

    Each method accepts any scalar type. `normal` is the surface's unit normal (x, y).
    Impulses (N s) and forces (N) act on D: the first along the normal, the second along the
    tangent, the normal turned by +90°. The joint speeds (rad/s) or accelerations (rad/s²) follow
    them.
    """

    def __init__(self, formulation: Formulation, model: PlanarModel) -> None:
        """Set up the equations of a formulation for a planar model."""
        self._equations = formulation.equations
        self._chain = model.chain
        self._joints = model.joints
        self._gravity = Gravity(model.gravity)

    def frictionless_impact(
        self, angles: Pair, speeds: Pair, normal: Pair, restitution: Pair
    ) -> Three:
        """Return the impulse of a frictionless surface and the joint speeds after the impact."""
        q, u = self._state(angles, speeds)
        pose = Pose(self._chain, self._equations, q)
        row = pose.row(PointCoordinate("D", normal))
        approach = row[0] * u[0] + row[1] * u[1]
        impulse = smooth_impulse(approach, pose.response(row, row), restitution[0]).normal
        # M Δu = Jᵀ Λ is the equation of motion at rest, with the impulse in place of the force.
        given = Force(self._chain.D, (impulse * normal[0], impulse * normal[1]))
        change = self._equations.forward_dynamics(self._chain, q, (0, 0), (given,))
        after = self._joints.joint_speeds((u[0] + change[0], u[1] + change[1]))
        return (impulse, *after)

    def sticking_impact(self, angles: Pair, speeds: Pair, normal: Pair) -> Four:
        """Return both impulses that bring D to rest and the joint speeds after the impact."""
        q, (u1, u2) = self._state(angles, speeds)
        (M11, M12), (M21, M22) = self._equations.mass_matrix(self._chain, q)
        # M u⁺ = M u + Jᵀ Λ has the same form, with the momenta M u in place of the torques.
        momenta = _Given((M11 * u1 + M12 * u2, M21 * u1 + M22 * u2))
        touched = _Touched(normal, rough=True)
        return self._four(self._solved((momenta,), touched, ContactState.STICKS, q, (0, 0)))

    def frictionless_contact(
        self, angles: Pair, speeds: Pair, torques: Pair, normal: Pair
    ) -> Three:
        """Return the normal force of a frictionless surface and the joint accelerations."""
        q, u = self._state(angles, speeds)
        touched = _Touched(normal, rough=False)
        solution = self._solved(self._acting(torques), touched, ContactState.CLOSED, q, u)
        return (solution.forces[0].normal, *self._joints.joint_speeds(solution.du))

    def sticking_contact(self, angles: Pair, speeds: Pair, torques: Pair, normal: Pair) -> Four:
        """Return both contact forces on a sticking D and the joint accelerations."""
        q, u = self._state(angles, speeds)
        touched = _Touched(normal, rough=True)
        return self._four(self._solved(self._acting(torques), touched, ContactState.STICKS, q, u))

    def pushed(self, angles: Pair, speeds: Pair, torques: Pair, end_force: Pair) -> Pair:
        """Return the joint accelerations (rad/s²) under a given force on D (N)."""
        q, u = self._state(angles, speeds)
        acting = [x for effect in self._acting(torques) for x in effect.loads(self._chain, q, u)]
        loads = (*acting, Force(self._chain.D, end_force))
        return self._joints.joint_speeds(self._equations.forward_dynamics(self._chain, q, u, loads))

    def _state(self, angles: Pair, speeds: Pair) -> tuple[Pair, Pair]:
        return self._joints.absolute_angles(angles), self._joints.absolute_speeds(speeds)

    def _solved(
        self,
        effects: tuple[Effect, ...],
        touched: _Touched,
        state: ContactState,
        q: Pair,
        u: Pair,
    ) -> Solution:
        """Return the simulation's constrained solution with D sliding on or sticking to it."""
        pose, elements = (
            Pose(self._chain, self._equations, q),
            touched.contact_elements(self._chain),
        )
        return mode_solution(pose, (*effects, touched), elements, (state,), (None,), u, 0.0)

    def _acting(self, torques: Pair) -> tuple[Effect, ...]:
        """Return gravity and motors with the joint torques (N m) as effects."""
        Q1, Q2 = self._joints.generalized_forces(torques)
        return self._gravity, JointTorque((Q1 + Q2, Q2))

    def _four(self, solution: Solution) -> Four:
        (forces,) = solution.forces
        return (forces.normal, forces.tangential, *self._joints.joint_speeds(solution.du))


def _directions(states: ContactStates, count: int) -> Array:
    """Return the normal, or normal and tangent, in each state: shape (count, 2, n)."""
    x, y = states.normal
    return np.array([[x, y], [-y, x]][:count])


def _solved_for(
    situation: str,
    parts: Mapping[str, tuple[str, tuple[int, int]]],
    algorithm: str,
    inputs: tuple[str, ...],
    text: Callable[[Any], Callable[..., Any]],
    call: Callable[[Any, Any], Array],
) -> tuple[Quantity, ...]:
    """Return the quantities of one contact problem, given their units and solution rows."""
    return tuple(
        Quantity(
            f"{situation}: {part}",
            unit,
            algorithm,
            inputs,
            text,
            call,
            from_world=True,
            constrained=True,
            rows=rows,
        )
        for part, (unit, rows) in parts.items()
    )


_DRIVEN = ("angles", "speeds", "torques")

CONTACT: tuple[Quantity, ...] = (
    *_solved_for(
        "frictionless impact",
        {"impulse": ("N s", (0, 1)), "speeds after": ("rad/s", (1, 3))},
        "impulseDynamics",
        ("angles", "speeds", "normal", "restitution"),
        lambda texts: texts.frictionless_impact,
        lambda engine, s: engine.impact(s.angles, s.speeds, _directions(s, 1), s.restitution[0]),
    ),
    *_solved_for(
        "sticking impact",
        {"impulses": ("N s", (0, 2)), "speeds after": ("rad/s", (2, 4))},
        "impulseDynamics",
        ("angles", "speeds", "normal"),
        lambda texts: texts.sticking_impact,
        lambda engine, s: engine.impact(s.angles, s.speeds, _directions(s, 2), s.restitution[1]),
    ),
    *_solved_for(
        "frictionless contact",
        {"force": ("N", (0, 1)), "motion": ("rad/s²", (1, 3))},
        "forwardDynamics",
        (*_DRIVEN, "normal"),
        lambda texts: texts.frictionless_contact,
        lambda engine, s: engine.held(s.angles, s.speeds, s.torques, _directions(s, 1)),
    ),
    *_solved_for(
        "sticking contact",
        {"forces": ("N", (0, 2)), "motion": ("rad/s²", (2, 4))},
        "forwardDynamics",
        (*_DRIVEN, "normal"),
        lambda texts: texts.sticking_contact,
        lambda engine, s: engine.held(s.angles, s.speeds, s.torques, _directions(s, 2)),
    ),
    Quantity(
        "given force on D: motion",
        "rad/s²",
        "aba, fext",
        (*_DRIVEN, "end_force"),
        lambda texts: texts.pushed,
        lambda engine, s: engine.forward_dynamics(s.angles, s.speeds, s.torques, s.end_force),
    ),
)


def verify_contact(
    urdf: PlanarUrdf | str | PathLike[str] | None = None,
    *,
    states: int = 10_000,
    seed: int = 1,
    formulations: Mapping[FormulationName, Formulation] = FORMULATIONS,
    engine: PinocchioChain | None = None,
    draw: Callable[..., ContactStates] = random_contact_states,
    progress: Progress = lambda share: None,
    limits: Limits = DEFAULT_LIMITS,
) -> Verdict:
    """Compare impacts, contact forces and end-force response at D, as `verify` compares motion.

    `draw` generates the states. The last remark counts the poses that are excluded because
    J M⁻¹ Jᵀ is singular to rounding. Raises `ParameterError` for less than one state, or if a
    quantity is excluded at all states; `EngineError` when the engine is missing or rejects the
    file.
    """
    read = planar_urdf(urdf)
    model = PlanarModel(Chain.from_links(read.links), read.joints, read.gravity)
    texts: dict[str, ContactSpace] = {
        name: ContactSpace(f, model) for name, f in formulations.items()
    }
    plan = ComparisonPlan(
        read,
        engine or PinocchioChain(read),
        groups=tuple(cases(CONTACT, texts)),
        names={name: f.name for name, f in formulations.items()},
        draw=draw,
        bound=contact_tolerance,
    )
    comparisons, left_out = plan.worst(states, seed, progress, limits)
    for quantity, count in left_out.items():
        if count == states:
            raise ParameterError(
                f"{read.path}: {quantity}: J M⁻¹ Jᵀ of D is singular to rounding at all {states} "
                "states; D must be able to move along x and y"
            )
    remark = (
        f"Excluded: {max(left_out.values())} of {states} poses, in which J M⁻¹ Jᵀ is singular to "
        "rounding."
    )
    return plan.verdict(comparisons, states, seed, (remark,))
