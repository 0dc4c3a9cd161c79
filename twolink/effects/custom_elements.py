"""Validation of the contact elements of user-defined effects: they do not pull, or give energy."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from twolink.contact.coordinates import JointCoordinate, PointCoordinate
from twolink.contact.elements import ContactElement, RigidContact
from twolink.contact.force_laws import ContactLaw
from twolink.errors import ParameterError
from twolink.inputs import refuse
from twolink.text import quoted

ELEMENTS = "a tuple of ContactElement"
"""The type of the elements of an effect, in words."""

# The most that the length of a unit vector may differ from 1.
_UNIT = 1e-12

# Depths (m or rad) and rates (m/s or rad/s) at which force laws are tried.
_DEPTHS = 1e-9, 1e-6, 1e-3
_RATES = 1e-3, 1.0

# Rates (m/s or rad/s) at which a point leaves a surface: a damped law pulls beyond one of them.
_LEAVING = 1.0, 1e3, 1e6

# The most that the stored energy may differ from the work of the force, relative to it.
_ENERGY = 1e-6


def check_elements(name: str, elements: tuple[Any, ...]) -> None:
    """Require elements that oppose motion: of an effect with a name, and of any class.

    Raises `ParameterError` for friction that drives, for impacts that give energy, and for force
    laws that pull.
    """
    for element in elements:
        if not isinstance(element, ContactElement):
            raise ParameterError(
                f"effect {name}: contact_elements must be {ELEMENTS}; got {quoted(element)} in it"
            )
        for coordinate in (element.normal, element.tangent):
            _check_coordinate(f"effect {name}: a coordinate of {element.name}", coordinate)
        kinetic, static = (float(limit) for limit in element.limits(1))
        if not 0 <= kinetic <= static < math.inf:
            raise ParameterError(
                f"effect {name}: the friction of {element.name} must be at least 0, and no more "
                f"while it slides than while it sticks; got {kinetic:g} and {static:g}"
            )
        if isinstance(element, RigidContact) and not 0 <= float(element.restitution) <= 1:
            refuse(
                f"effect {name}: restitution of {element.name}",
                float(element.restitution),
                "a number from 0 to 1",
            )
        if element.compliant is not None:
            tried = _Tried(f"effect {name}: the law of {element.name}", element.compliant)
            _check_law(tried)
            _check_release(tried, element)


def _check_coordinate(name: str, coordinate: Any) -> None:
    """Require the angle of a joint, or the place of a point along a unit vector."""
    if coordinate is None or isinstance(coordinate, JointCoordinate):
        return
    if not isinstance(coordinate, PointCoordinate):
        raise ParameterError(
            f"{name} must be a JointCoordinate or a PointCoordinate; got {quoted(coordinate)}"
        )
    length = math.hypot(*map(float, coordinate.vector))
    if not abs(length - 1) <= _UNIT:
        refuse(f"{name}: the length of its vector", length, "1")


class _Tried(NamedTuple):
    """A law of a user, with its name for messages."""

    name: str
    law: ContactLaw

    def force(self, depth: float, rate: float = 0.0) -> float:
        """Return the force at a depth and a rate."""
        return self._called(lambda: self.law.force(depth, math.sqrt(depth), rate))

    def stored(self, depth: float) -> float:
        """Return the stored energy (J) at a depth."""
        return self._called(lambda: self.law.stored(depth, math.sqrt(depth)))

    def _called(self, function: Callable[[], Any]) -> float:
        try:
            return float(function())
        except Exception as error:
            raise ParameterError(f"{self.name} raised {type(error).__name__}: {error}") from error


def _check_law(tried: _Tried) -> None:
    """Require a force that begins with zero, does not pull at rest, and does not feed a rate."""
    if (begins := tried.force(0.0)) != 0:
        refuse(f"{tried.name}: force at a depth of 0", begins, "0")
    for depth in _DEPTHS:
        still = tried.force(depth)
        if not 0 <= still < math.inf:
            refuse(f"{tried.name}: force at a depth of {depth:g}, at rest", still, "0 or more")
        for rate in _RATES:
            released, pressed = tried.force(depth, -rate), tried.force(depth, rate)
            if not released <= still <= pressed:
                raise ParameterError(
                    f"{tried.name}: force at a depth of {depth:g} must not fall with the rate of "
                    f"the depth; got {released:g}, {still:g} and {pressed:g} at rates of "
                    f"{-rate:g}, 0 and {rate:g}"
                )
        _check_energy(tried, depth)


def _check_release(tried: _Tried, element: ContactElement) -> None:
    """Require that a law does not pull in motion, or says where its surface is from then on."""
    law = tried.law
    if element.hysteresis is not None:
        if not law.uses_root:
            refuse(f"{tried.name}: uses_root", law.uses_root, "True for a contact with a memory")
        return
    for depth in _DEPTHS:
        still = tried.force(depth)
        if law.relaxation is not None:
            # The surface follows the point while its own force is zero.
            left = tried.force(depth, -law.relaxation * depth)
            if not abs(left) <= _ENERGY * still:
                refuse(
                    f"{tried.name}: force at a depth of {depth:g} that falls at its relaxation of"
                    f" {law.relaxation:g} 1/s", left, "0",
                )  # fmt: skip
            continue
        for rate in _LEAVING:
            if (pulls := tried.force(depth, -rate)) < 0:
                refuse(
                    f"{tried.name}: force at a depth of {depth:g} that falls at {rate:g}", pulls,
                    "0 or more, as the point leaves the surface there; a law that pulls in motion"
                    " must have a relaxation, or its contact a memory, such as NoPull",
                )  # fmt: skip


def _check_energy(tried: _Tried, depth: float) -> None:
    """Require that the stored energy is the work of the force at rest, up to a depth."""
    nodes, weights = np.polynomial.legendre.leggauss(12)
    # Over the root of the depth, of which Hertz's law is a polynomial.
    roots = math.sqrt(depth) * (nodes + 1) / 2
    forces = [tried.force(root * root) for root in roots.tolist()]
    work = float(math.sqrt(depth) * (weights * forces * roots).sum())
    stored = tried.stored(depth)
    if not abs(stored - work) <= _ENERGY * work:
        refuse(
            f"{tried.name}: stored energy at a depth of {depth:g}", stored,
            f"the work of its force, {work:g} J",
        )  # fmt: skip
