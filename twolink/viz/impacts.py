"""Marks of impacts for a short time at their position: an arrow and the size of the impulse."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np

from twolink.contact.coordinates import JointCoordinate, PointCoordinate
from twolink.viz.commands import ROOT, flat_mesh, visible
from twolink.viz.contacts import elements_of, joint_labels, place_of, tangent_of
from twolink.viz.labels import Drawn, Label, Mark, line_mark, round_mark
from twolink.viz.run import Moments, Run
from twolink.viz.shapes import Array, Shape, arrow, joined, ring
from twolink.viz.themes import Theme

_ORDER = 70
_PATH = f"{ROOT}/impacts"

# Time (s) of an impact's mark on the screen, the part of it with a label, in which the mark is not
# faint, and the longest arrow relative to the reach.
_MARKED = 0.9
_LABELLED = 0.75
_LONGEST = 0.28

# Impulses below this part of the strongest simultaneous one are not drawn.
_BESIDE = 0.02


class Impulse(NamedTuple):
    """An impact: time (s), position (m), impulse, and its size relative to the largest.

    The impulse (N s) is a vector (x, y); for a joint, whose impulse is that of a torque, it is
    None, and the mark moves with the joint.
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

    def marks(self, now: Moments, speed: float, size: float, theme: Theme) -> Drawn:
        """Return the marks of the last impacts before a moment, and the strongest one's label.

        Their duration scales with `speed`; `size` (m) is half of a bar's width.
        """
        time, lasting = float(now.times[0]), _MARKED * speed
        recent = [
            self._now(impulse, now) for impulse in self.all if time - lasting < impulse.time <= time
        ]
        if not recent:
            return Drawn([visible(f"{_PATH}/<object>", False)], [], [])
        # The strongest is drawn last, above the others, and only it has a label.
        recent.sort(key=lambda impulse: impulse.share)
        strongest = recent[-1]
        recent = [impulse for impulse in recent if impulse.share >= _BESIDE * strongest.share]
        shapes, shades = [], []
        marks: list[Mark] = []
        for impulse in recent:
            age = (time - impulse.time) / lasting
            shape = self._shape(impulse, size, age)
            shapes.append(shape)
            if age < _LABELLED:
                marks += self._marks(impulse, size, age)
            shades.append(np.full(len(shape.corners), round(1 - age**3, 3)))
        opacity = np.concatenate(shades)
        mesh = flat_mesh(_PATH, joined(shapes), theme.impulse, order=_ORDER, opacities=opacity)
        fresh = time - strongest.time < _LABELLED * lasting
        return Drawn([mesh], [self._label(strongest, now)] if fresh else [], marks)

    def _now(self, impulse: Impulse, now: Moments) -> Impulse:
        """Return an impulse where its mark is at a moment."""
        return impulse._replace(place=now.point(impulse.joint)[0]) if impulse.joint else impulse

    def _shape(self, impulse: Impulse, size: float, age: float) -> Shape:
        """Return a ring that widens with age (0 to 1), and the impulse's arrow."""
        strength = impulse.share**0.5
        mark = ring(impulse.place, *self._radii(strength, size, age))
        if impulse.vector is None:
            return mark
        return joined(
            [mark, arrow(impulse.place, self._head(impulse), (0.3 + 0.3 * strength) * size)]
        )

    @staticmethod
    def _radii(strength: float, size: float, age: float) -> tuple[float, float]:
        """Return the radii of a ring, whose area is proportional to the impulse."""
        radius = (1.0 + strength + 1.6 * age * strength) * size
        return radius, radius + (0.15 + 0.25 * strength) * size

    def _marks(self, impulse: Impulse, size: float, age: float) -> list[Mark]:
        """Return the marks of a ring and its arrow."""
        strength = impulse.share**0.5
        found = [round_mark(impulse.place, self._radii(strength, size, age)[1])]
        if impulse.vector is not None:
            width = (0.9 + 0.9 * strength) * size
            found.append(line_mark(impulse.place, self._head(impulse), width))
        return found

    def _head(self, impulse: Impulse) -> Array:
        assert impulse.vector is not None
        size = float(np.hypot(*impulse.vector)) or 1.0
        return impulse.place + impulse.vector / size * (_LONGEST * impulse.share * self.length)

    def _label(self, impulse: Impulse, now: Moments) -> Label:
        if impulse.vector is None:
            # Behind the joint's letter and behind its stop.
            letter = joint_labels(now)[impulse.joint]
            return [impulse.words, *letter[1:5], "impulse", 2]
        head = self._head(impulse)
        way = impulse.vector / (float(np.hypot(*impulse.vector)) or 1.0)
        return [impulse.words, *head.tolist(), *way.tolist(), "impulse"]
