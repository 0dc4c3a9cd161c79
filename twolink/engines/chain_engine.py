"""The contract of an engine with a chain loaded, as `verify` compares it with the formulations."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from twolink.engines.contract import Array


@dataclass(frozen=True)
class Sizes:
    """Spatial sizes in an engine's computation: levers (m) and inertias (kg m²)."""

    radius: tuple[float, float]
    length: float
    inertia: tuple[float, float]
    tip: float
    origin: float


class ChainEngine(Protocol):
    """An engine that has loaded a chain's URDF, in the frame of the chain.

    States are arrays of shape (2, n) in the URDF's joint angles θ (rad), speeds (rad/s),
    accelerations (rad/s²) and torques (N m); results have the states along their last axis. Points
    are named C1, C2 and D; vectors are x and y components in the chain's frame, positions are
    relative to A, and the potential energy (J) is zero with both mass centres level with A.
    """

    @property
    def name(self) -> str:
        """The engine's name and version."""

    @property
    def roundings(self) -> int:
        """The largest number of operations on any path from a state to a result."""

    @property
    def contact_roundings(self) -> int:
        """The same, if constraint forces are solved for as well."""

    @property
    def sizes(self) -> Sizes:
        """The sizes of the numbers that the engine computes with."""

    def mass_matrix(self, angles: Array) -> Array:
        """Return M over the joint angles (kg m²), shape (2, 2, n)."""

    def velocity_terms(self, angles: Array, speeds: Array) -> Array:
        """Return C θ̇ (N m), shape (2, n), without gravity."""

    def coriolis_matrix(self, angles: Array, speeds: Array) -> Array:
        """Return C (kg m²/s), shape (2, 2, n)."""

    def gravity_terms(self, angles: Array) -> Array:
        """Return ∂V/∂θ (N m), shape (2, n)."""

    def inverse_dynamics(
        self, angles: Array, speeds: Array, accelerations: Array, end_force: Array | None = None
    ) -> Array:
        """Return the joint torques (N m), shape (2, n), under gravity and a force on D (N)."""

    def forward_dynamics(
        self, angles: Array, speeds: Array, torques: Array, end_force: Array | None = None
    ) -> Array:
        """Return the joint accelerations (rad/s²), shape (2, n), under gravity and a force on D."""

    def inverse_dynamics_derivatives(
        self, angles: Array, speeds: Array, accelerations: Array
    ) -> Array:
        """Return ∂τ/∂θ and ∂τ/∂θ̇, shape (2, 2, 2, n): which, row, column, state."""

    def forward_dynamics_derivatives(self, angles: Array, speeds: Array, torques: Array) -> Array:
        """Return ∂θ̈/∂θ, ∂θ̈/∂θ̇ and ∂θ̈/∂τ, shape (3, 2, 2, n): which, row, column, state."""

    def kinetic_energy(self, angles: Array, speeds: Array) -> Array:
        """Return T (J), shape (n,)."""

    def potential_energy(self, angles: Array) -> Array:
        """Return V (J), shape (n,)."""

    def point_motion(self, point: str, angles: Array, speeds: Array, accelerations: Array) -> Array:
        """Return position, velocity and acceleration of a point, shape (3, 2, n)."""

    def angular_motion(self, angles: Array, speeds: Array, accelerations: Array) -> Array:
        """Return angular velocities (rad/s) and accelerations (rad/s²) of the links about z.

        Shape (2, 2, n): which, link, state.
        """

    def jacobian(self, point: str, angles: Array) -> Array:
        """Return ∂(x, y)/∂θ of a point (m), shape (2, 2, n): component, coordinate, state."""

    def impact(self, angles: Array, speeds: Array, directions: Array, restitution: Array) -> Array:
        """Return the impulses of an impact on D and the joint speeds (rad/s) after it.

        It acts along `directions`, one or two unit vectors in each state, shape (k, 2, n): along
        each the velocity of D is multiplied by −`restitution`, shape (n,). The result has
        shape (k + 2, n): an impulse (N s) along each direction, then both speeds.
        """

    def held(self, angles: Array, speeds: Array, torques: Array, directions: Array) -> Array:
        """Return the constraint forces on D along directions and the joint accelerations (rad/s²).

        Along each of the `directions`, shape (k, 2, n), the acceleration of D is zero, under
        gravity and joint torques. The result has shape (k + 2, n): a force (N) along each
        direction, then both accelerations.
        """
