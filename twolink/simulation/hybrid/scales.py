"""The sizes of places, speeds and forces of a system, and of their round-off."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from twolink.chain import Chain
from twolink.contact.elements import ContactElement
from twolink.integration.precisions import PRECISIONS, Precision
from twolink.simulation.hybrid import tolerances


@dataclass(frozen=True, eq=False)
class Scales:
    """The sizes by which numbers of a system count as zero, near, or of order 1.

    They follow from the `chain` in float64 and its elements, so that no unit of length, mass or
    time is in them: lengths are relative to that of the stretched chain, angles to 1 rad. Series
    have an `order` in numbers of a `precision`, and `longest_step` is in s.
    """

    chain: Chain
    elements: tuple[ContactElement, ...]
    precision: Precision
    order: int | None
    longest_step: float

    @cached_property
    def rounding(self) -> float:
        """The relative spacing of the numbers."""
        return self.precision.rounding

    @cached_property
    def near(self) -> tuple[tuple[int, float], ...]:
        """The numbers of the rigid contacts, each with the gap (rad or m) that counts as closed.

        Contacts that no point can get beyond are left out.
        """
        scale = tolerances.CONTACT_GAP * self.rounding
        return tuple(
            (index, scale * self.sizes[index])
            for index, element in enumerate(self.elements)
            if element.rigid and element.reachable
        )

    @cached_property
    def resolution(self) -> float:
        """The relative accuracy of a state at an event: round-off or truncation error."""
        return max(
            self.rounding,
            tolerances.TRUNCATION * self.precision.step_tolerance(self.order),
        )

    @cached_property
    def zeno_time(self) -> float:
        """The time (s) below which all further bounces are omitted."""
        return tolerances.zeno_time(self.longest_step, self.rounding)

    def least_root(self, index: int) -> Any:
        """Return the √depth (m^½) at which a press without speed begins: zero would remain zero.

        The depth is the error of a place that is rounded to nearest: half of the last digit.
        """
        return self.precision.number((self.rounding / 2 * self.sizes[index]) ** 0.5)

    @cached_property
    def lever(self) -> float:
        """The length of the stretched chain (m)."""
        return float(self.chain.L1 + self.chain.L2)

    @cached_property
    def sizes(self) -> tuple[float, ...]:
        """The size (rad or m) of the places of each element: that of its coordinate or its bound.

        It is the larger of the two.
        """
        return tuple(
            max(element.principal.size(self.chain), abs(float(element.bound)))
            for element in self.elements
        )

    @cached_property
    def places_of_rounding(self) -> tuple[float, ...]:
        """The gap (rad or m) of each element that is zero within round-off."""
        return tuple(tolerances.LEADING * self.rounding * size for size in self.sizes)

    def grazing(self, index: int) -> float:
        """Return the gap (rad or m) above which a flight is certain to pass a contact."""
        return tolerances.GRAZING * self.rounding * self.sizes[index]

    @cached_property
    def slowest(self) -> float:
        """The speed (rad/s) below which links that stop are at rest: they have turned faster."""
        return tolerances.UNDECIDED * self.rounding / float(self.longest_step)

    @cached_property
    def stabilisation(self) -> float:
        """The rate (1/s) at which errors of points that are held decay."""
        return tolerances.STABILISATION / float(self.longest_step)

    @cached_property
    def of_rounded_start(self) -> float:
        """The speed (rad/s) at which the roundings of a start vanish, in any precision.

        A start is given in float64, and lies beside its contacts by roundings of a place.
        """
        return tolerances.CONTACT_GAP * PRECISIONS["double"].rounding * self.stabilisation

    @cached_property
    def moment(self) -> float:
        """The factor that scales moments (N m) to order 1, like the other variables."""
        chain, step, lever = self.chain, float(self.longest_step), self.lever
        inertia = float(chain.I_C1 + chain.I_C2 + (chain.m1 + chain.m2) * lever * lever)
        return step * step / inertia

    def force(self, index: int) -> float:
        """Return the factor that scales the forces (N or N m) of an element to order 1."""
        return self.moment * self.elements[index].principal.size(self.chain)

    @cached_property
    def forces_of_rounding(self) -> tuple[float, ...]:
        """The scaled force that round-off of a position causes in each surface, if it is stiff."""
        return tuple(self._force_of_rounding(index) for index in range(len(self.elements)))

    def _force_of_rounding(self, index: int) -> float:
        law = self.elements[index].compliant
        if law is None or law.uses_root:
            return 0.0
        depth = tolerances.CONTACT_GAP * self.rounding * self.sizes[index]
        return abs(float(law.force(depth, 0.0, 0.0))) * self.force(index)
