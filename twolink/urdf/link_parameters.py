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
