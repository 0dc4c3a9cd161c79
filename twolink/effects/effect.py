"""The contracts of effects: the interface of each kind of effect.

An effect is a small frozen object: scene parameters in, loads out. It has no switch: an effect that
does not act is left out. An effect that provides more than smooth loads inherits from the class
that names it; a class that lacks one of the methods cannot be instantiated.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from twolink.arithmetic import Pair, Scalar
from twolink.chain import Chain
from twolink.errors import SimulationError
from twolink.loads import Loads
from twolink.text import distinct_names

if TYPE_CHECKING:
    from twolink.contact.elements import ContactElement


class Effect(ABC):
    """A source of loads on a chain. Numbers may be of any kind: see `twolink.arithmetic`."""

    @abstractmethod
    def loads(self, chain: Chain, q: Pair, u: Pair, t: Scalar = 0.0) -> Loads:
        """Return the forces and torques at angles q (rad), speeds u (rad/s) and time t (s)."""

    def smooth_loads(self, chain: Chain, q: Pair, u: Pair, t: Scalar = 0.0) -> Loads:
        """Return the loads that are smooth functions of the state: all, unless overridden."""
        return self.loads(chain, q, u, t)

    @property
    def shortest_time(self) -> float:
        """The shortest time (s) in which the loads change at a fixed pose; infinite if unknown.

        No step of a simulation is longer. A load that an effect does not declare is looked for on a
        grid of times: see `docs/write_an_effect.md`.
        """
        return math.inf

    @property
    def label(self) -> str:
        """The joint or the name that distinguishes it from others of its class, or empty."""
        return ""


class ConservativeEffect(Effect):
    """An effect whose loads follow from a potential energy."""

    @abstractmethod
    def potential_energy(self, chain: Chain, q: Pair) -> Scalar:
        """Return V (J) at angles q (rad)."""


class ContactEffect(Effect):
    """An effect with dry friction or contact, which a simulation resolves by modes and events.

    `loads` then gives the loads in a state where they are single-valued, for one evaluation.
    """

    @abstractmethod
    def contact_elements(self, chain: Chain) -> tuple[ContactElement, ...]:
        """Return the friction and contact elements, in a fixed order."""

    @abstractmethod
    def smooth_loads(self, chain: Chain, q: Pair, u: Pair, t: Scalar = 0.0) -> Loads:
        """Return the loads beside those of the contact elements."""


class RotorEffect(Effect):
    """An effect that adds rotors to the chain, and so to its mass matrix."""

    @abstractmethod
    def with_rotors(self, chain: Chain) -> Chain:
        """Return the chain with the rotors added."""

    def loads(self, chain: Chain, q: Pair, u: Pair, t: Scalar = 0.0) -> Loads:
        """Return no load: the inertia of a rotor is in the mass matrix."""
        return ()


class PiecewiseEffect(Effect):
    """An effect that is smooth in time between its discontinuities.

    Its loads are those of its pieces.
    """

    @property
    @abstractmethod
    def discontinuities(self) -> tuple[float, ...]:
        """The increasing times (s) at which the loads are not smooth."""

    @abstractmethod
    def piece_at(self, t: float) -> Effect:
        """Return the smooth effect that acts from a time (s) until the next discontinuity."""

    def loads(self, chain: Chain, q: Pair, u: Pair, t: Scalar = 0.0) -> Loads:
        """Return the loads at a time (s), or those of all pieces at an array of times."""
        return self.smooth_loads(chain, q, u, t)

    def smooth_loads(self, chain: Chain, q: Pair, u: Pair, t: Scalar = 0.0) -> Loads:
        """Return the loads of the piece at a time (s).

        At an array of times those of all pieces are returned, each zero where another one acts.
        """
        if not np.ndim(t):
            return self.piece_at(float(t)).smooth_loads(chain, q, u, t)
        known = (0.0, *self.discontinuities)
        pieces = np.searchsorted(known[1:], np.asarray(t, dtype=float), side="right")
        return tuple(
            load.where(pieces == piece)
            for piece in np.unique(pieces).tolist()
            for load in self.piece_at(known[piece]).smooth_loads(chain, q, u, t)
        )

    def slopes_of(self, slopes: tuple[float, ...]) -> Callable[[float], tuple[Scalar, ...]]:
        """Return a function from a time (s) to the slopes of the numbers of the piece there.

        They follow from `slopes` of its own numbers, in the order of fields. Raises
        `SimulationError` where there are none: by default.
        """
        raise SimulationError(f"the pieces of {type(self).__name__} have no slopes by its numbers")


class ParametricEffect(Effect):
    """An effect whose numbers are run-time parameters of compiled equations.

    Effects that differ in these numbers only share one compiled integrator.
    """

    @property
    @abstractmethod
    def numbers(self) -> tuple[Scalar, ...]:
        """The parameters, in a fixed order."""

    @abstractmethod
    def with_numbers(self, numbers: tuple[Scalar, ...]) -> Self:
        """Return the effect with these parameters."""


def contact_elements(effects: tuple[Effect, ...], chain: Chain) -> tuple[ContactElement, ...]:
    """Return the friction and contact elements of all effects, in their order.

    Contacts of one name have numbers.
    """
    found: tuple[Any, ...] = tuple(
        element
        for effect in effects
        if isinstance(effect, ContactEffect)
        for element in effect.contact_elements(chain)
    )
    names = [element.name for element in found]
    if len(set(names)) == len(names):
        return found
    return tuple(
        element if name == element.name else replace(element, name=name)
        for element, name in zip(found, distinct_names(names, "{} {}"), strict=True)
    )


def discontinuities(effects: tuple[Effect, ...]) -> tuple[float, ...]:
    """Return the increasing times (s) at which any of the effects is not smooth."""
    piecewise = (effect for effect in effects if isinstance(effect, PiecewiseEffect))
    return tuple(sorted({t for effect in piecewise for t in effect.discontinuities}))


def pieces_at(effects: tuple[Effect, ...], t: float) -> tuple[Effect, ...]:
    """Return the effects that act from a time (s) until the next discontinuity."""
    return tuple(
        effect.piece_at(t) if isinstance(effect, PiecewiseEffect) else effect for effect in effects
    )


def potential_energy(effects: tuple[Effect, ...], chain: Chain, q: Pair) -> Scalar:
    """Return V (J) of all effects that have a potential energy."""
    return sum(
        effect.potential_energy(chain, q)
        for effect in effects
        if isinstance(effect, ConservativeEffect)
    )


def smooth_loads(
    effects: tuple[Effect, ...], chain: Chain, q: Pair, u: Pair, t: Scalar = 0.0
) -> Loads:
    """Return the loads of all effects but those of friction and contact elements."""
    return tuple(load for effect in effects for load in effect.smooth_loads(chain, q, u, t))


def with_rotors(effects: tuple[Effect, ...], chain: Chain) -> Chain:
    """Return the chain with the rotors of all effects."""
    for effect in effects:
        if isinstance(effect, RotorEffect):
            chain = effect.with_rotors(chain)
    return chain
