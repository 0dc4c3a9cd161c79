"""Marks of impacts for a short time at their position: an arrow and the size of the impulse."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np

from twolink.contact.coordinates import JointCoordinate, PointCoordinate
from viz.commands import ROOT, flat_mesh, visible
from viz.contacts import elements_of, joint_labels, place_of, tangent_of
from viz.run import Run
from viz.shapes import Array, Shape, arrow, joined, ring
from viz.surfaces import Label
from viz.themes import Theme

_ORDER = 70
_PATH = f"{ROOT}/impacts"

# Time (s) of an impact's mark on the screen, and the longest arrow relative to the reach.
_MARKED = 0.9
_LONGEST = 0.28

# Impulses below this part of the strongest simultaneous one are not drawn.
_BESIDE = 0.02


class Impulse(NamedTuple):
    """An impact: time (s), position (m), impulse, and its size relative to the largest.

    The impulse (N s) is a vector (x, y); for a joint, whose impulse is that of a torque, it is
    None.
    """

    time: float
    place: Array
    vector: Array | None
    share: float
    words: str
    joint: str = ""


class Impacts:
    """The impacts of a run."""

    def __init__(self, run: Run, length: float) -> None:
        """Store the run, and a length (m) that scales the arrows."""
        self.run = run
        self.length = length

    @cached_property
    def all(self) -> tuple[Impulse, ...]:
        """All impacts in order of time."""
        logged = self.run.trajectory.impacts
        elements = elements_of(self.run)
        if not logged or not elements:
            return ()
        at_joint = [isinstance(elements[i.index].principal, JointCoordinate) for i in logged]
        # Impulses in N s and N m s are not comparable.
        largest = {True: 0.0, False: 0.0}
        for impact, turning in zip(logged, at_joint, strict=True):
            largest[turning] = max(largest[turning], abs(impact.normal_impulse))
        moments = self.run.at(np.array([impact.time for impact in logged]))
        found = []
        for number, (impact, turning) in enumerate(zip(logged, at_joint, strict=True)):
            element = elements[impact.index]
            vector = None
            size, unit = abs(impact.normal_impulse), "N m s"
            if isinstance(element.principal, PointCoordinate):
                vector = impact.normal_impulse * np.array(element.principal.vector)
                tangent = tangent_of(element)
                if tangent is not None:
                    vector = vector + impact.tangential_impulse * np.array(tangent)
                size, unit = float(np.hypot(*vector)), "N s"
            share = abs(impact.normal_impulse) / (largest[turning] or 1.0)
            place = place_of(element, moments.only(number))
            joint = getattr(element.principal, "joint", "")
            words = f"impulse {size:.3g} {unit}"
            found.append(Impulse(impact.time, place, vector, share, words, joint))
        return tuple(found)

    def marks(
        self, time: float, speed: float, size: float, theme: Theme
    ) -> tuple[bytes, list[Label]]:
        """Return the marks of the last impacts before a time (s), and the strongest one's label.

        Their duration scales with `speed`; `size` (m) is half of a bar's width.
        """
        lasting = _MARKED * speed
        recent = [impulse for impulse in self.all if time - lasting < impulse.time <= time]
        if not recent:
            return visible(f"{_PATH}/<object>", False), []
        # The strongest is drawn last, above the others, and only it has a label.
        recent.sort(key=lambda impulse: impulse.share)
        strongest = recent[-1]
        recent = [impulse for impulse in recent if impulse.share >= _BESIDE * strongest.share]
        shapes, shades = [], []
        for impulse in recent:
            age = (time - impulse.time) / lasting
            shape = self._shape(impulse, size, age)
            shapes.append(shape)
            shades.append(np.full(len(shape.corners), round(1 - age**3, 3)))
        opacity = np.concatenate(shades)
        mesh = flat_mesh(_PATH, joined(shapes), theme.impulse, order=_ORDER, opacities=opacity)
        return mesh, [self._label(strongest)]

    def _shape(self, impulse: Impulse, size: float, age: float) -> Shape:
        """Return a ring that widens with age (0 to 1), and the impulse's arrow."""
        # The area of the ring is proportional to the impulse.
        strength = impulse.share**0.5
        radius = (1.0 + strength + 1.6 * age * strength) * size
        mark = ring(impulse.place, radius, radius + (0.15 + 0.25 * strength) * size)
        if impulse.vector is None:
            return mark
        return joined(
            [mark, arrow(impulse.place, self._head(impulse), (0.3 + 0.3 * strength) * size)]
        )

    def _head(self, impulse: Impulse) -> Array:
        assert impulse.vector is not None
        size = float(np.hypot(*impulse.vector)) or 1.0
        return impulse.place + impulse.vector / size * (_LONGEST * impulse.share * self.length)

    def _label(self, impulse: Impulse) -> Label:
        if impulse.vector is None:
            # Behind the joint's letter and behind its stop.
            letter = joint_labels(self.run.at(np.array([impulse.time])))[impulse.joint]
            return [impulse.words, *letter[1:5], "impulse", 2]
        head = self._head(impulse)
        way = impulse.vector / (float(np.hypot(*impulse.vector)) or 1.0)
        return [impulse.words, *head.tolist(), *way.tolist(), "impulse"]
