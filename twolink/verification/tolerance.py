"""Derived bound on the difference between two correct float64 results, for tests and commands.

Derivation
----------
*Sums of products.* Every quantity here is a sum of products of parameters, speeds, and at most two
sines or cosines. In floating point each term is multiplied by a product of (1 + δ), |δ| ≤ ε/2,
with one factor for each operation it passes through. With at most N operations on any path,

    |computed − exact| ≤ N (ε/2) Σ|terms|          to first order in ε = 2⁻⁵².

*Magnitudes.* No component of ∂v_C/∂u exceeds the lever ℓ, the greatest distance of the mass centre
from the pivot the speed turns about. Replacing each vector by its lever and each number by its
size turns the quantity into a sum S of positive terms that holds in every pose. Taking components
(x and y, along and across) apart can make Σ|terms| larger than S, by Cauchy and Schwarz at most
twice. Hence the first rule:

    |computed − exact| ≤ N ε S.

*Angles.* An angle that is formed from others (q2 − q1, or s1 θ1 + φ1 + s2 θ2 + φ2) carries a
rounding of ε/2 times their sizes for each of two operations, and at most two sines or cosines in a
term propagate it. With Θ the sum of the sizes of all angles involved, N grows by 2Θ, and by 2 for
the error of sine and cosine themselves (below one unit in the last place).

*Solving.* u̇ solves M u̇ = r. Perturbations of r by N ε R and of M by N ε M̄ change it by

    |δu̇| ≤ |M⁻¹| N ε (R + M̄ |u̇|),

entry by entry. The condition number enters here: |M⁻¹| M̄ is the componentwise one of Bauer and
Skeel. The normwise condition number κ₂(M) is too pessimistic: a link 1e-6 times as long as the
other makes it 1e12 by the choice of units alone, while no digit is lost. |M⁻¹| is computed as
adj(M̄)/det M, with the determinant as a sum of positive terms, so that it stays accurate where the
condition is worst.

*Reference point of an algorithm.* An algorithm that moves all inertias or velocities to the
world's origin, as Pinocchio's Jacobians and derivatives do, rounds with the lever from the origin
even if a short second link turns about its own joint. The same holds if products of velocities
cancel. The rounding is that of the long lever; `from_world` and `inertia_force` give its size.

*Two algorithms* differ by at most the sum of their bounds, so N is the sum of their counts: for a
formula of ours the depth of its compiled expression, which is counted; for an engine, an upper
bound on the operations of its recursion over two joints (see
`twolink/engines/pinocchio_chain.py`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from twolink.chain import Chain
from twolink.coordinates import JointConvention
from twolink.engines.chain_engine import Sizes
from twolink.verification.states import Array, States

EPSILON = float(np.finfo(np.float64).eps)

_AS_THE_SOURCE = JointConvention()


@dataclass(frozen=True)
class Scale:
    """Sizes of the quantities in a computation on a chain, all positive.

    `mass` (kg), `radius` of the mass centre from its own joint (m), `length` of link 1 (m) and
    `inertia` (kg m²) of both links; `joints`, the joint-angle convention; `origin`, the distance
    of A from the origin of positions (m); `gravity` (m/s²). In `joint` angles link 2 moves with
    both coordinates, in absolute angles with its own. A computation `in_space` has products that
    are zero in the plane; with `from_world` every lever is measured from the origin of positions.
    """

    mass: tuple[float, float]
    radius: tuple[float, float]
    length: float
    inertia: tuple[float, float]
    joint: bool
    tip: float = 0.0
    joints: JointConvention = _AS_THE_SOURCE
    origin: float = 0.0
    gravity: float = 0.0
    in_space: bool = False
    from_world: bool = False

    @classmethod
    def of(
        cls,
        chain: Chain,
        *,
        joint: bool,
        gravity: float = 0.0,
        joints: JointConvention = _AS_THE_SOURCE,
    ) -> Scale:
        """Return the sizes of a chain's own parameters."""
        (a1, b1), (a2, b2) = chain.centre
        return cls(
            mass=chain.mass,
            radius=(float(np.hypot(a1, b1)), float(np.hypot(a2, b2))),
            length=chain.L1,
            inertia=chain.inertia,
            joint=joint,
            tip=chain.L2,
            joints=joints,
            gravity=abs(gravity),
        )

    def widened(self, sizes: Sizes) -> Scale:
        """Return the larger of these sizes and the spatial sizes of an engine."""
        return replace(
            self,
            radius=_larger(self.radius, sizes.radius),
            inertia=_larger(self.inertia, sizes.inertia),
            length=max(self.length, sizes.length),
            tip=max(self.tip, sizes.tip),
            origin=max(self.origin, sizes.origin),
            in_space=True,
        )

    def levers(self, link: int, radius: float) -> Array:
        """Return the levers of both coordinates at a point of a link (m), shape (2, 1)."""
        if self.from_world:
            reach = self.origin + radius + self.length * (link - 1)
            return np.array([[reach], [reach * (link - 1)]])
        if link == 1:
            return np.array([[radius], [0.0]])
        return np.array([[self.length + radius * self.joint], [radius]])

    def angles_met(self, angles: Array) -> Array:
        """Return the sum of the sizes of all added angles (rad), shape (n,)."""
        return np.asarray(np.abs(angles).sum(axis=0) + sum(map(abs, self.joints.offset)))

    def elbow(self, angles: Array) -> Array:
        """Return q2 − q1 (rad), shape (n,), of angles of the scale's own kind."""
        q1, q2 = self.joints.absolute_angles(tuple(angles)) if self.joint else angles
        return np.asarray(q2 - q1)

    def turning(self, speeds: Array) -> Array:
        """Return bounds on the links' angular speeds from both speeds' sizes: shape (2, n)."""
        first, second = np.abs(speeds)
        return np.stack([first, second + first * self.joint])

    @property
    def mass_matrix(self) -> Array:
        """The mass matrix of the stretched chain (kg m²), which bounds it in every pose."""
        turns = np.array([[1.0, 0.0], [float(self.joint), 1.0]])
        total = np.zeros((2, 2))
        for link in (1, 2):
            lever = self.levers(link, self.radius[link - 1])
            turn = turns[link - 1][:, None]
            total += self.mass[link - 1] * lever @ lever.T
            total += self.inertia[link - 1] * turn @ turn.T
        return total

    def point_acceleration(self, link: int, radius: float, states: States) -> Array:
        """Return the size of a point's acceleration (m/s²), shape (n,)."""
        lever = self.levers(link, radius)
        turning = self.turning(states.speeds)
        # Spatial recursions also contain products of both links' speeds, which cancel in the end.
        inward = lever[0] * turning[link - 1] ** 2
        if link == 2 and not self.in_space:
            inward = self.length * turning[0] ** 2 + radius * turning[1] ** 2
        return np.asarray((lever * np.abs(states.accelerations)).sum(axis=0) + inward)

    def inertia_force(self, states: States) -> Array:
        """Return the size of M u̇ + C u (N m), shape (2, n)."""
        turning = self.turning(states.speeds)
        total = self.mass_matrix @ np.abs(states.accelerations)
        still = states.with_accelerations(np.zeros_like(states.accelerations))
        for link in (1, 2):
            radius = self.radius[link - 1]
            force = self.mass[link - 1] * self.point_acceleration(link, radius, still)
            total = total + self.levers(link, radius) * force
            # ω × I ω and v × m v are zero in the plane, but a spatial recursion computes them.
            reach = self.levers(link, radius)[0]
            inertia = self.inertia[link - 1] + self.mass[link - 1] * reach**2
            gyroscopic = self.in_space * inertia * turning[link - 1] ** 2
            total = total + np.array([[1.0], [float(link == 2)]]) * gyroscopic
        return total + 2 * self.coupling * turning[0] * turning[1]

    def speed_slope(self, states: States) -> Array:
        """Return the size of ∂(C u)/∂u and of 2 C (N m s), shape (2, 2, n)."""
        turning = self.turning(states.speeds)
        total = np.zeros((2, 2, len(states)))
        for link in (1, 2):
            lever = self.levers(link, self.radius[link - 1])
            inertia = self.mass[link - 1] * lever @ lever.T
            inertia = inertia + self.in_space * self.inertia[link - 1] * np.ones((2, 2))
            total += 2 * inertia[:, :, None] * turning.max(axis=0)
        return total + 2 * self.coupling * turning.max(axis=0)

    @property
    def coupling(self) -> float:
        """The factor of u1 u2 in T (kg m²), whose terms cancel between the two parts of (6.9)."""
        return self.mass[1] * self.length * self.radius[1]

    @property
    def weight(self) -> Array:
        """The size of the generalized gravity (N m), shape (2, 1)."""
        lever1, lever2 = self.levers(1, self.radius[0]), self.levers(2, self.radius[1])
        return self.gravity * (self.mass[0] * lever1 + self.mass[1] * lever2)

    def end_moment(self, states: States) -> Array:
        """Return the size of the generalized force of the force on D (N m), shape (2, n)."""
        return self.levers(2, self.tip) * np.abs(states.end_force).sum(axis=0)

    def determinant(self, chain: Chain, elbow: Array, uncertainty: Array | float) -> Array:
        """Return det M (kg² m⁴), shape (n,), at the elbow angles q2 − q1 (rad).

        The smallest value within the uncertainty of the angle (rad).
        """
        (a1, b1), (a2, b2) = chain.centre
        h = np.abs(a2 * np.sin(elbow) + b2 * np.cos(elbow)) - self.radius[1] * uncertainty
        h = np.maximum(h, 0.0)
        I_A = chain.I_C1 + chain.m1 * (a1 * a1 + b1 * b1)
        I_B = chain.I_C2 + chain.m2 * (a2 * a2 + b2 * b2)
        return np.asarray(I_A * I_B + chain.m2 * chain.L1**2 * (chain.I_C2 + chain.m2 * h * h))

    def inverse(self, chain: Chain, elbow: Array, uncertainty: Array | float) -> Array:
        """Return adj(M̄)/det M (1/(kg m²)), shape (2, 2, n), likewise."""
        (M11, M12), (_, M22) = replace(self, from_world=False).mass_matrix
        adjugate = np.array([[M22, M12], [M12, M11]])
        return adjugate[:, :, None] / self.determinant(chain, elbow, uncertainty)


@dataclass(frozen=True)
class Problem:
    """Inputs of a tolerance: chain, sizes, states and operation count.

    `found` is the value of a quantity that solves an equation; its bound depends on it.
    """

    chain: Chain
    scale: Scale
    states: States
    roundings: int
    found: Array | None = None

    @property
    def units(self) -> Array:
        """N ε with the angles' share (see the module's derivation), shape (n,)."""
        return (self.roundings + 2 + 2 * self.scale.angles_met(self.states.angles)) * EPSILON

    @property
    def value(self) -> Array:
        """The computed value, for the bounds that depend on it."""
        if self.found is None:
            raise ValueError("this bound depends on the computed value: pass it as `found`")
        return self.found

    @property
    def elbow(self) -> Array:
        """The elbow angle q2 − q1 (rad), shape (n,)."""
        return self.scale.elbow(self.states.angles)

    @property
    def uncertainty(self) -> Array:
        """The uncertainty of the elbow angle (rad), shape (n,)."""
        return EPSILON * (1 + self.scale.angles_met(self.states.angles))

    @property
    def inverse(self) -> Array:
        """The size of M⁻¹ (1/(kg m²)), shape (2, 2, n)."""
        return self.scale.inverse(self.chain, self.elbow, self.uncertainty)

    def torque(self, *, loads: Array | float) -> Array:
        """Return the tolerance of M u̇ + C u − Q (N m), with Q of size `loads`."""
        return self.units * (self.scale.inertia_force(self.states) + loads)

    def solution(self, right: Array | float, found: Array) -> Array:
        """Return |M⁻¹| (right + N ε M̄ |found|), for columns of any number k: shape (2, k, n)."""
        matrix = np.einsum("ij,jkn->ikn", self.scale.mass_matrix, np.abs(found))
        return np.einsum("ijn,jkn->ikn", self.inverse, right + self.units * matrix)


def tolerance(quantity: str, problem: Problem) -> Array:
    """Return the largest difference between two correct values of a quantity.

    The states' `accelerations` belong to the quantity: they are inputs of the inverse dynamics and
    results of the forward dynamics and its derivatives. The result has the unit of the quantity and
    its shape, or one that broadcasts to it.
    """
    return _BOUNDS[quantity](problem)


def _mass_matrix(problem: Problem) -> Array:
    return problem.units * problem.scale.mass_matrix[:, :, None]


def _velocity_terms(problem: Problem) -> Array:
    still = problem.states.with_accelerations(np.zeros_like(problem.states.accelerations))
    return problem.units * problem.scale.inertia_force(still)


def _coriolis_matrix(problem: Problem) -> Array:
    return problem.units * problem.scale.speed_slope(problem.states)


def _gravity_terms(problem: Problem) -> Array:
    return problem.units * problem.scale.weight


def _inverse_dynamics(problem: Problem) -> Array:
    return problem.torque(loads=problem.scale.weight)


def _end_force(problem: Problem) -> Array:
    return problem.torque(loads=problem.scale.weight + problem.scale.end_moment(problem.states))


def _forward_dynamics(problem: Problem) -> Array:
    loads = problem.scale.weight + np.abs(problem.states.torques)
    right = _velocity_terms(problem) + problem.units * loads
    return problem.solution(right[:, None], problem.states.accelerations[:, None])[:, 0]


def _inverse_dynamics_by_angles(problem: Problem) -> Array:
    # Each term has at most two sines or cosines, and θ1 moves both links: four slopes at most.
    torque = problem.torque(loads=problem.scale.weight)
    return 4 * np.stack([torque, torque], axis=1)


def _inverse_dynamics_by_speeds(problem: Problem) -> Array:
    return 2 * _coriolis_matrix(problem)


def _forward_dynamics_by_angles(problem: Problem) -> Array:
    # ∂u̇/∂q = −M⁻¹ ∂τ/∂q, with τ the inverse dynamics at the computed u̇.
    loads = problem.scale.weight + np.abs(problem.states.torques)
    torque = problem.torque(loads=loads)
    error = np.einsum("ij,jn->in", problem.scale.mass_matrix, _forward_dynamics(problem))
    slope = 4 * (torque + error)
    return problem.solution(np.stack([slope, slope], axis=1), problem.value)


def _forward_dynamics_by_speeds(problem: Problem) -> Array:
    return problem.solution(_inverse_dynamics_by_speeds(problem), problem.value)


def _forward_dynamics_by_torques(problem: Problem) -> Array:
    return problem.solution(0.0, problem.value)


def _angular_velocities(problem: Problem) -> Array:
    return problem.units * problem.scale.turning(problem.states.speeds)


def _angular_accelerations(problem: Problem) -> Array:
    # A spatial engine also computes the product of both angular velocities, which are parallel.
    scale, states = problem.scale, problem.states
    products = scale.in_space * scale.turning(states.speeds) ** 2
    return problem.units * (scale.turning(states.accelerations) + products)


def _kinetic_energy(problem: Problem) -> Array:
    speeds = np.abs(problem.states.speeds)
    energy = np.einsum("in,ij,jn->n", speeds, problem.scale.mass_matrix, speeds)
    return np.asarray(problem.units * energy)


def _potential_energy(problem: Problem) -> Array:
    scale = problem.scale
    origin = scale.gravity * sum(scale.mass) * scale.origin
    return np.asarray(problem.units * (scale.weight.sum() + origin))


def _larger(first: tuple[float, float], second: tuple[float, float]) -> tuple[float, float]:
    return max(first[0], second[0]), max(first[1], second[1])


def _point_bounds(name: str, link: int, radius: Callable[[Scale], float]) -> dict[str, _Bound]:
    """Return the bounds of a point's position, velocity, acceleration and Jacobian."""

    def lever(problem: Problem) -> Array:
        return problem.scale.levers(link, radius(problem.scale))

    def position(problem: Problem) -> Array:
        return np.asarray(problem.units * (lever(problem).sum() + problem.scale.origin))

    def velocity(problem: Problem) -> Array:
        speeds = np.abs(problem.states.speeds)
        return np.asarray(problem.units * (lever(problem) * speeds).sum(axis=0))

    def acceleration(problem: Problem) -> Array:
        scale = problem.scale
        return problem.units * scale.point_acceleration(link, radius(scale), problem.states)

    def jacobian(problem: Problem) -> Array:
        return problem.units * lever(problem)[None]

    return {
        f"position of {name}": position,
        f"velocity of {name}": velocity,
        f"acceleration of {name}": acceleration,
        f"Jacobian of {name}": jacobian,
    }


_Bound = Callable[[Problem], Array]
_BOUNDS: dict[str, _Bound] = {
    "mass matrix": _mass_matrix,
    "velocity terms": _velocity_terms,
    "Coriolis matrix": _coriolis_matrix,
    "gravity terms": _gravity_terms,
    "inverse dynamics": _inverse_dynamics,
    "inverse dynamics, force on D": _end_force,
    "forward dynamics": _forward_dynamics,
    "∂τ/∂θ": _inverse_dynamics_by_angles,
    "∂τ/∂θ̇": _inverse_dynamics_by_speeds,
    "∂θ̈/∂θ": _forward_dynamics_by_angles,
    "∂θ̈/∂θ̇": _forward_dynamics_by_speeds,
    "∂θ̈/∂τ": _forward_dynamics_by_torques,
    "angular velocities": _angular_velocities,
    "angular accelerations": _angular_accelerations,
    "kinetic energy": _kinetic_energy,
    "potential energy": _potential_energy,
    **_point_bounds("C1", 1, lambda scale: scale.radius[0]),
    **_point_bounds("C2", 2, lambda scale: scale.radius[1]),
    **_point_bounds("D", 2, lambda scale: scale.tip),
}
