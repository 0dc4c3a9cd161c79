"""Random states of the chain in general position: entries are non-zero and distinct."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class States:
    """States with accelerations, torques and end forces; each field has shape (2, n).

    `angles` (rad), `speeds` (rad/s), `accelerations` (rad/s²) and `torques` (N m) have one entry
    per coordinate; `end_force` (N) has the x and y components of a force on D.
    """

    angles: Array
    speeds: Array
    accelerations: Array
    torques: Array
    end_force: Array

    def __len__(self) -> int:
        """Return the number of states."""
        return int(self.angles.shape[1])

    def with_accelerations(self, accelerations: Array) -> States:
        """Return the same states with other accelerations."""
        return replace(self, accelerations=accelerations)


@dataclass(frozen=True)
class ContactStates(States):
    """States in which the end point D touches a surface.

    `normal` has the x and y components of the surface's unit normal; `restitution` is e along the
    normal in a frictionless impact, and 0 along the tangent.
    """

    normal: Array
    restitution: Array


def random_states(
    n: int, *, seed: int | tuple[int, int], torque: float = 1.0, force: float = 1.0
) -> States:
    """Return n random states, the same for the same seed (or pair of seeds).

    Angles span two turns, speeds reach 10 rad/s and accelerations 100 rad/s²; `torque` (N m) and
    `force` (N) are the largest magnitudes.
    """
    random = np.random.default_rng(seed)

    def uniform(limit: float) -> Array:
        return random.uniform(-limit, limit, size=(2, n))

    return States(
        angles=uniform(2 * np.pi),
        speeds=uniform(10.0),
        accelerations=uniform(100.0),
        torques=uniform(torque),
        end_force=uniform(force),
    )


def random_contact_states(
    n: int, *, seed: tuple[int, int], torque: float = 1.0, force: float = 1.0
) -> ContactStates:
    """Return `random_states` on surfaces of random normal, with restitution from 0 to 1."""
    free = random_states(n, seed=seed, torque=torque, force=force)
    random = np.random.default_rng((*seed, 1))
    towards = random.uniform(-np.pi, np.pi, size=n)
    restitution = random.uniform(0.0, 1.0, size=n)
    return ContactStates(
        **vars(free),
        normal=np.stack([np.cos(towards), np.sin(towards)]),
        restitution=np.stack([restitution, np.zeros(n)]),
    )
