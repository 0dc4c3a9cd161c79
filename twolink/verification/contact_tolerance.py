"""Derived bound on the difference between two correct float64 results with D in contact.

Derivation
----------
This extends `twolink/verification/tolerance.py`: N ε times sizes, to first order in ε. A bar marks
a size: M̄ of the mass matrix, J̄ of J (the levers of D), R̄ of r.

*The equations.* D is in contact along one direction (the normal, without friction) or along two
(normal and tangent, where it sticks). With a row of J for each, forces λ and motion x,

    M x = r + Jᵀ λ,    J x = c.

In sustained contact x is θ̈, r are all torques except those of the contact, and c is minus the bias
γ, the acceleration of D when θ̈ = 0. In an impact x is θ̇ after it, r = M v with θ̇ = v before, and
c = −e J v.

*Two-step solution.* With x₀ = M⁻¹ r, the motion without contact, and Z = M⁻¹ Jᵀ, the solution is

    G λ = c − J x₀,    x = x₀ + Z λ,    where G = J Z = J M⁻¹ Jᵀ.

Pinocchio solves this with triangular factors of M and G over joint angles, and our frictionless
impact with Cramer's rule over absolute angles. Each step adds the rounding of its own operations to
the error of its input. A solution by factors is exact for an M perturbed by N ε M̄, so an error of
M⁻¹ multiplies J as Zᵀ; with Cramer's rule the factor is |J| |M⁻¹|. With A for either,

    δG = N ε (A M̄ |Z| + J̄ |Z| + A J̄ᵀ),
    δr = N ε (R̄ + M̄ |x₀|),                   and 0 in an impact, where x₀ = v is given,
    δc = N ε (γ̄ + J̄ |x₀|) + |Z|ᵀ δr,         and N ε (1 + e) J̄ |v| in an impact,
    δλ = |G⁻¹| (δc + δG |λ + δλ|),
    δx = |M⁻¹| (δr + N ε (J̄ᵀ + M̄ |Z|) |λ|) + |Z G⁻¹| (δc + δG |λ + δλ|) + N ε (|x| + |x₀|),

where |x₀| ≤ |x| + |Z| |λ|. The condition of M enters in δG, that of J M⁻¹ Jᵀ in |G⁻¹| δG.

*One-step solution.* With two rows our simulation solves directly, x = J⁻¹ c and λ = J⁻ᵀ (M x − r):

    δx = |J⁻¹| N ε (γ̄ + J̄ |x|),
    δλ = |J⁻ᵀ| (M̄ δx + N ε (M̄ |x| + R̄ + J̄ᵀ |λ|)).

*Split along and across the row.* With a single row w the simulation splits the motion into the
part required by the bias, x∥ = −γ w/|w|², and a part across w determined by M:

    x = x∥ + z w⊥,    z = w⊥·(r − M x∥) / (w⊥·M w⊥),    λ = w·(M x − r) / |w|².

If x∥ is larger than x, its rounding dominates. The error of w, N ε J̄, acts as on the exact
solution: across as |w⊥| |w⊥|ᵀ/(w⊥·M w⊥) and along as Z G⁻¹:

    δx = N ε (2 |x∥| + |x|) + |Z G⁻¹| N ε (γ̄ + J̄ |x|)
         + |w⊥| |w⊥|ᵀ N ε (R̄ + J̄ᵀ |λ| + M̄ (|x| + 2 |x∥|)) / (w⊥·M w⊥),
    δλ = |w|ᵀ (M̄ δx + N ε (M̄ |x| + R̄ + J̄ᵀ |λ|)) / |w|².

The tolerance for a comparison with an engine is the sum of the two-step bound and the bound of our
solution; for a comparison between formulations it contains only our bound.

*No cancellation in sizes.* |Z| is computed with signs, and its own rounding is added. For one
row, w⊥·M w⊥ is twice the kinetic energy at speeds w⊥, a sum of squares, and G is that divided by
det M. For two, |det J| is L1 L2 |sin(q2 − q1)|, the smallest within the angle's uncertainty, and
|G⁻¹| = |J⁻ᵀ| M̄ |J⁻¹| over absolute angles: G is the same over joint angles.

*Singular to rounding.* G is singular if the chain is stretched or folded, or if D cannot move
along the normal; the bounds above grow near such poses. They are valid while rounding changes G, or
the rows, by less than half: while |G⁻¹| δG (for our solution |J⁻¹| N ε J̄, or N ε J̄ relative to |w|)
has a spectral radius below ½. Otherwise not even the first digit of λ is certain: the tolerance is
infinite, and `verify` counts the pose as excluded.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from twolink.kinematics import velocity
from twolink.verification.states import Array, ContactStates
from twolink.verification.tolerance import Problem, Scale

# Largest relative change of an inverted matrix for which λ has a certain digit.
_CERTAIN = 0.5


def contact_tolerance(quantity: str, problem: Problem) -> Array:
    """Return the largest difference between two correct values of a quantity of contact.

    The problem's states are `ContactStates`; its `found` holds the forces along each direction and
    the motion, shape (k + 2, n). The result has the shape and the unit of the quantity; it is
    infinite where J M⁻¹ Jᵀ is singular to rounding.
    """
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        return _BOUNDS[quantity](problem)


class _Errors(NamedTuple):
    """Error bounds on forces λ and motion x: shapes (k, n) and (2, n)."""

    forces: Array
    motion: Array

    def and_those_of(self, others: _Errors) -> _Errors:
        """Return the sum of these bounds and others."""
        return _Errors(self.forces + others.forces, self.motion + others.motion)

    def where(self, certain: Array) -> _Errors:
        """Return bounds that are infinite at states where λ is not certain."""
        return _Errors(*(np.where(certain, error, np.inf) for error in self))


class _Given(NamedTuple):
    """Sizes of the right-hand sides: γ̄ (or the prescribed motion of D), R̄ and |x₀|.

    If the motion without contact is given, it has no error and `torques` is None.
    """

    demanded: Array
    torques: Array | None
    free: Array


@dataclass(frozen=True)
class _Contact:
    """Sizes of the contact equations along `count` directions; names as in the derivation.

    Coordinates are `joint` angles or absolute angles; λ and G are the same in both.
    """

    problem: Problem
    count: int
    joint: bool

    @property
    def states(self) -> ContactStates:
        """The states, each with its surface."""
        assert isinstance(self.problem.states, ContactStates)
        return self.problem.states

    @property
    def units(self) -> Array:
        """N ε, shape (n,)."""
        return self.problem.units

    @property
    def forces(self) -> Array:
        """|λ|, shape (k, n)."""
        return _sizes(self.problem.value[: self.count])

    @property
    def motion(self) -> Array:
        """|x|, shape (2, n)."""
        return self.over(_sizes(self.problem.value[self.count :]))

    def over(self, speeds: Array) -> Array:
        """Return the sizes of joint speeds or accelerations in these coordinates."""
        return speeds if self.joint else _summed(speeds)

    @cached_property
    def scale(self) -> Scale:
        """Sizes of everything except J̄: M and r are computed link by link."""
        return replace(self.problem.scale, from_world=False, joint=self.joint)

    @property
    def masses(self) -> Array:
        """M̄ (kg m²), shape (2, 2)."""
        return self.scale.mass_matrix

    @cached_property
    def inverse_masses(self) -> Array:
        """|M⁻¹| (1/(kg m²)), shape (2, 2, n)."""
        problem = self.problem
        return self.scale.inverse(problem.chain, problem.elbow, problem.uncertainty)

    @cached_property
    def levers(self) -> Array:
        """J̄ (m), shape (k, 2, n)."""
        scale = replace(self.problem.scale, joint=self.joint)
        levers = scale.levers(2, scale.tip)
        return np.broadcast_to(levers, (self.count, 2, len(self.states)))

    @cached_property
    def angles(self) -> tuple[Array, Array]:
        """The absolute angles q (rad)."""
        q1, q2 = self.scale.joints.absolute_angles(tuple(self.states.angles))
        return q1, q2

    @cached_property
    def signed_rows(self) -> Array:
        """J over absolute angles (m), shape (k, 2, n)."""
        chain = self.problem.chain
        x, y = self.states.normal
        directions = ((x, y), (-y, x))[: self.count]
        columns = [velocity(chain, self.angles, u, chain.D) for u in ((1.0, 0.0), (0.0, 1.0))]
        return np.array([[n[0] * v[0] + n[1] * v[1] for v in columns] for n in directions])

    @cached_property
    def rows(self) -> Array:
        """|J| (m), shape (k, 2, n); over joint angles the sum of the sizes of the terms."""
        first, second = np.moveaxis(np.abs(self.signed_rows), 1, 0)
        return np.stack([first + second if self.joint else first, second], axis=1)

    @cached_property
    def response(self) -> Array:
        """|Z| (1/(kg m)), shape (2, k, n), and its rounding."""
        chain, (q1, q2) = self.problem.chain, self.angles
        # Uses the chain's own sizes, not the larger ones of an engine.
        ((M11, _), (_, M22)) = Scale.of(chain, joint=False).mass_matrix
        _, a, b = chain.C2
        M12 = chain.m2 * chain.L1 * (a * np.cos(q2 - q1) - b * np.sin(q2 - q1))
        x, y = np.moveaxis(self.signed_rows, 1, 0)
        first, second = (M22 * x - M12 * y), (M11 * y - M12 * x)
        exact = np.stack([first, second - first if self.joint else second])
        exact = np.abs(exact) / self.determinant
        return exact + self.units * np.einsum("ijn,kjn->ikn", self.inverse_masses, self.rows)

    @cached_property
    def determinant(self) -> Array:
        """The determinant of M (kg² m⁴), shape (n,)."""
        return self.scale.determinant(self.problem.chain, self.problem.elbow, 0.0)

    @cached_property
    def across(self) -> Array:
        """w⊥·M w⊥ (kg m⁴) of a single row, shape (n,): a sum of squares."""
        chain = self.problem.chain
        ((x, y),) = self.signed_rows
        total = chain.I_C1 * y * y + chain.I_C2 * x * x
        for mass, centre in ((chain.m1, chain.C1), (chain.m2, chain.C2)):
            vx, vy = velocity(chain, self.angles, (y, -x), centre)
            total = total + mass * (vx * vx + vy * vy)
        return np.asarray(total)

    @cached_property
    def inverse_rows(self) -> Array:
        """|J⁻¹| (1/m) of two rows, shape (2, 2, n)."""
        chain = self.problem.chain
        sine = np.abs(np.sin(self.problem.elbow)) - self.problem.uncertainty
        determinant = chain.L1 * chain.L2 * np.maximum(sine, 0.0)
        (J11, J12), (J21, J22) = self.rows
        return np.array([[J22, J12], [J21, J11]]) / determinant

    def inverse(self, change: Array | float) -> Array:
        """Return |G⁻¹| (kg), shape (k, k, n), of a G that may be smaller by `change`."""
        if self.count == 1:
            least = self.across / self.determinant - change
            return np.asarray(1 / np.maximum(least, 0.0)).reshape(1, 1, -1)
        absolute = replace(self, joint=False)
        inverse = absolute.inverse_rows
        return np.einsum("ikn,ij,jln->kln", inverse, absolute.masses, inverse)

    def drive(self, inverse: Array) -> Array:
        """Return |Z G⁻¹| (1/m), shape (2, k, n): motion per unit motion of D per direction."""
        return self.inverse_rows if self.count == 2 else self.response * inverse[0, 0]


def _sizes(found: Array) -> Array:
    """Return the absolute values of a solution; non-finite entries give 0."""
    return np.where(np.isfinite(found), np.abs(found), 0.0)


def _times(matrix: Array, vector: Array) -> Array:
    """Return matrix · vector in each state: shapes (i, j, n) and (j, n) give (i, n)."""
    return np.asarray(np.einsum("ijn,jn->in", matrix, vector))


def _turned(matrix: Array) -> Array:
    """Return the transposed matrix in each state."""
    return matrix.swapaxes(0, 1)


def _summed(speeds: Array) -> Array:
    """Return sizes of absolute speeds from those of joint speeds, or the reverse."""
    return np.stack([speeds[0], speeds[0] + speeds[1]])


def _certain(matrix: Array) -> Array:
    """Return whether a relative change, shape (k, k, n), leaves an inverse certain."""
    finite = np.isfinite(matrix).all(axis=(0, 1))
    matrices = np.moveaxis(np.where(finite, matrix, 0.0), -1, 0)
    radius = np.abs(np.linalg.eigvals(matrices)).max(axis=1)
    return np.asarray(finite & (radius < _CERTAIN))


def _geometric(matrix: Array) -> Array:
    """Return (1 − A)⁻¹ = 1 + A + A² + … of matrices A, shape (k, k, n)."""
    matrices = np.eye(len(matrix)) - np.moveaxis(matrix, -1, 0)
    return np.asarray(np.moveaxis(np.linalg.inv(matrices), 0, -1))


def _in_two_steps(contact: _Contact, given: _Given, *, factors: bool) -> _Errors:
    """Return the errors of solving for λ with G, then for x; by factors of M or Cramer's rule."""
    units, Z, J = contact.units, contact.response, contact.levers
    A = _turned(Z)
    if not factors:
        A = np.einsum("kjn,jin->kin", contact.rows, contact.inverse_masses)
    by_rows = np.einsum("kin,iln->kln", J, Z) + np.einsum("kin,lin->kln", A, J)
    change = units * (np.einsum("kin,ij,jln->kln", A, contact.masses, Z) + by_rows)
    inverse = contact.inverse(change[0, 0])
    amplified = np.einsum("kmn,mln->kln", inverse, change)
    certain = _certain(amplified)
    residual = np.zeros_like(given.free)
    if given.torques is not None:
        residual = units * (given.torques + contact.masses @ given.free)
    demanded = units * given.demanded + _times(_turned(Z), residual)
    series = _geometric(np.where(certain, amplified, 0.0))
    missing = demanded + _times(change, contact.forces)
    forces = _times(series, _times(inverse, missing))
    pushed = _times(_turned(J), contact.forces) + contact.masses @ _times(Z, contact.forces)
    motion = (
        _times(contact.inverse_masses, residual + units * pushed)
        + _times(contact.drive(inverse), missing + _times(change, forces))
        + units * (contact.motion + given.free)
    )
    return _Errors(forces, motion).where(certain)


def _in_one(contact: _Contact, drift: Array, torques: Array) -> _Errors:
    """Return the errors of solving for x with J⁻¹ and for λ with J⁻ᵀ."""
    units, M, J, inverse = contact.units, contact.masses, contact.levers, contact.inverse_rows
    motion = units * _times(inverse, drift + _times(J, contact.motion))
    met = M @ contact.motion + torques + _times(_turned(J), contact.forces)
    forces = _times(_turned(inverse), M @ motion + units * met)
    change = units * np.einsum("ijn,jkn->ikn", inverse, J)
    return _Errors(forces, motion).where(_certain(change))


def _across_and_along(contact: _Contact, drift: Array, torques: Array) -> _Errors:
    """Return the errors of splitting the motion along and across a single row."""
    units, M, J, x = contact.units, contact.masses, contact.levers, contact.motion
    (row,) = contact.rows
    turned, squared = row[::-1], (row * row).sum(axis=0)
    along = drift * row / squared
    moved = torques + _times(_turned(J), contact.forces)
    met = moved + M @ (x + 2 * along)
    motion = units * (
        2 * along
        + x
        + _times(contact.drive(contact.inverse(0.0)), drift + _times(J, x))
        + turned * (turned * met).sum(axis=0) / contact.across
    )
    missing = M @ motion + units * (M @ x + moved)
    forces = (row * missing).sum(axis=0) / squared
    change = units * (J[0] * J[0]).sum(axis=0) ** 0.5 / squared**0.5
    return _Errors(forces[None], motion).where(_certain(change[None, None]))


def _over_joints(errors: _Errors) -> _Errors:
    """Convert errors in absolute angles to errors in joint angles."""
    return _Errors(errors.forces, _summed(errors.motion))


def _impact(problem: Problem, count: int) -> _Errors:
    ours, theirs = (_Contact(problem, count, joint) for joint in (False, True))
    before = np.abs(theirs.states.speeds)

    def given(contact: _Contact) -> _Given:
        speeds = contact.over(before)
        factor = 1 + contact.states.restitution[:count]
        return _Given(factor * _times(contact.levers, speeds), None, speeds)

    if count == 1:
        errors = _over_joints(_in_two_steps(ours, given(ours), factors=False))
    else:
        # The torques are momenta here, and D comes to rest: the bias is zero.
        momenta = ours.masses @ ours.over(before)
        errors = _over_joints(_in_one(ours, np.zeros_like(momenta), momenta))
    if not problem.scale.in_space:
        return errors
    return errors.and_those_of(_in_two_steps(theirs, given(theirs), factors=True))


def _sustained(problem: Problem, count: int) -> _Errors:
    ours, theirs = (_Contact(problem, count, joint) for joint in (False, True))
    solve = _across_and_along if count == 1 else _in_one
    drift, torques = _drift(theirs), _torques(theirs)
    # Generalized forces over absolute angles are τ1 − τ2 and τ2.
    errors = _over_joints(solve(ours, drift, _summed(torques[::-1])[::-1]))
    if not problem.scale.in_space:
        return errors
    free = theirs.motion + _times(theirs.response, theirs.forces)
    demanded = drift + _times(theirs.levers, free)
    given = _Given(demanded, torques, free)
    return errors.and_those_of(_in_two_steps(theirs, given, factors=True))


def _still(contact: _Contact) -> ContactStates:
    states = contact.states
    return replace(states, accelerations=np.zeros_like(states.accelerations))


def _torques(contact: _Contact) -> Array:
    """Return R̄ (N m): velocity terms, weight and joint torques, shape (2, n)."""
    scale, states = contact.scale, contact.states
    return scale.inertia_force(_still(contact)) + scale.weight + np.abs(states.torques)


def _drift(contact: _Contact) -> Array:
    """Return γ̄ (m/s²), shape (n,)."""
    return contact.scale.point_acceleration(2, contact.scale.tip, _still(contact))


def _pushed(problem: Problem) -> Array:
    """Return the error of accelerations under a given force on D (rad/s²), shape (2, n)."""
    scale, states = problem.scale, problem.states
    loads = scale.weight + np.abs(states.torques) + scale.end_moment(states)
    still = states.with_accelerations(np.zeros_like(states.accelerations))
    right = problem.units * (scale.inertia_force(still) + loads)
    return problem.solution(right[:, None], problem.value[:, None])[:, 0]


_BOUNDS: dict[str, Callable[[Problem], Array]] = {
    "frictionless impact: impulse": lambda problem: _impact(problem, 1).forces,
    "frictionless impact: speeds after": lambda problem: _impact(problem, 1).motion,
    "sticking impact: impulses": lambda problem: _impact(problem, 2).forces,
    "sticking impact: speeds after": lambda problem: _impact(problem, 2).motion,
    "frictionless contact: force": lambda problem: _sustained(problem, 1).forces,
    "frictionless contact: motion": lambda problem: _sustained(problem, 1).motion,
    "sticking contact: forces": lambda problem: _sustained(problem, 2).forces,
    "sticking contact: motion": lambda problem: _sustained(problem, 2).motion,
    "given force on D: motion": _pushed,
}
