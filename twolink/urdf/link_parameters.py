"""The parameters of a link in its own planar frame."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class LinkParameters:
    """One link: mass (kg), length (m), mass centre along and across (m), inertia (kg m²).

    The inertia is about the mass centre and the axis of rotation.
    """

    mass: float
    length: float
    centre: tuple[float, float]
    inertia: float

    @property
    def is_without_inertia(self) -> bool:
        """Whether it is a point mass on the axis of its joint, without inertia about it."""
        return self.inertia == 0 and not any(self.centre)


def link_without_inertia(links: tuple[LinkParameters, LinkParameters]) -> int | None:
    """Return the link, 1 or 2, that makes the mass matrix singular in some pose, if one does."""
    first, second = links
    # A link 1 of no inertia is moved by link 2 at the elbow, unless that is a point mass.
    if first.is_without_inertia and second.inertia == 0:
        return 1
    return 2 if second.is_without_inertia else None
