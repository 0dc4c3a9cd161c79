"""Where a motion stands at an instant: its state, and what the chain touches in it."""

from __future__ import annotations

import math
from types import ModuleType
from typing import Any

from twolink.arithmetic import Pair
from twolink.chain import Chain
from twolink.contact.coordinates import ConstraintCoordinate
from twolink.contact.elements import CompliantContact, ContactElement, DryFriction, RigidContact
from twolink.effects import Effect
from twolink.errors import SimulationError
from twolink.simulation.constrained import rests, same_way
from twolink.simulation.cushions import Cushions
from twolink.simulation.mode import ContactState, Mode
from twolink.simulation.modes import Modes
from twolink.simulation.smooth.taylor import rounding
from twolink.simulation.striking import Striking

# So far inside, in units of rounding, is more than rounding.
_INSIDE = 1e4

# So near, in units of rounding of where things are, is touching.
_NEAR = 64


class Situation:
    """A state q (rad), u (rad/s) at a time (s), and the obstacles and cushions touched in it.

    `touched` has what is neither moving away nor towards, though it may not push; `apart` how far
    away obstacles are (rad or m), as variables of their own and not as differences of positions.
    """

    def __init__(
        self,
        chain: Chain,
        text: ModuleType,
        effects: tuple[Effect, ...],
        start: tuple[Pair, Pair],
        precision: str,
        kind: Any,
    ) -> None:
        """Stand at the start, under effects; `kind` makes numbers of the precision.

        Raises `SimulationError` where that is inside an obstacle.
        """
        self._chain, self._text, self._kind = chain, text, kind
        self._resolution = rounding(precision)
        self.now = kind(0)
        self.q, self.u = start
        self.touched: set[int] = set()
        self.apart: dict[int, Any] = {}
        self.take_up(effects)
        self.cushions = Cushions(self.elements, kind)
        for number, element in enumerate(self.elements):
            if not isinstance(element, DryFriction):
                self._measure(number, element)

    def take_up(self, effects: tuple[Effect, ...]) -> None:
        """Let these effects act from now on."""
        self.modes = Modes(self._chain, effects, self._text)
        self.striking = Striking(self.modes)

    @property
    def elements(self) -> tuple[ContactElement, ...]:
        """What may hold the chain: frictions, obstacles and cushions, by number."""
        return self.modes.elements

    @property
    def free_mode(self) -> Mode:
        """The mode in which nothing is touched."""
        open_all = (ContactState.OPEN,) * len(self.elements)
        return Mode(self.modes.names, open_all, self.cushions.dents)

    def _measure(self, number: int, element: RigidContact | CompliantContact) -> None:
        """Find how far away an obstacle is at the start, or whether it is touched."""
        gap = self.apart[number] = self.gap(number)
        # A start is given in float64, and is on an obstacle to its rounding.
        if self._is_near(element, gap, rounding("double")):
            self.place(number)
            if isinstance(element, CompliantContact) and not self._recedes(element):
                self.press(number)
        elif gap < 0:
            raise SimulationError(
                f"{element.name}: the scene starts {-float(gap):.6g} inside; allowed is a "
                "start on its outside, or on it"
            )

    def gap(self, number: int) -> Any:
        """Return how far an obstacle is away in this pose (rad or m)."""
        here = self.direction(number).coordinate(self.modes.chain, self.q)
        return here - self.cushions.surface(number)

    def direction(self, number: int) -> ConstraintCoordinate:
        """Return the direction in which an element bars or brakes."""
        return self.elements[number].direction

    def row(self, number: int) -> Pair:
        """Return the row of an element's direction in this pose."""
        return self.modes.row(self.direction(number), self.q)

    def place(self, number: int) -> None:
        """Move q by rounding, so that an obstacle is touched exactly."""
        surface = self.cushions.surface(number)
        self.q = self.striking.placed(self.direction(number), surface, self.q)
        self.apart[number] = self._kind(0)

    def press(self, number: int) -> None:
        """Begin to press a cushion: at no depth, or hardly any if it is touched at rest."""
        self.touched.add(number)
        least = math.sqrt(self._resolution) if rests(self.row(number), self.u) else 0.0
        self.cushions.press(number, least)

    def leave(self, number: int) -> None:
        """Come off an obstacle or a cushion."""
        self.touched.discard(number)
        if isinstance(self.elements[number], CompliantContact):
            self.cushions.leave(number, -self.gap(number))
        self.apart[number] = self._kind(0)

    def _recedes(self, element: CompliantContact) -> bool:
        row = self.modes.row(element.direction, self.q)
        return not rests(row, self.u) and bool(row[0] * self.u[0] + row[1] * self.u[1] > 0)

    def _is_near(
        self, obstacle: RigidContact | CompliantContact, gap: Any, resolution: float | None = None
    ) -> bool:
        """Return whether a gap is no more than rounding."""
        size = max(1.0, abs(float(obstacle.bound)))
        return bool(abs(gap) <= _NEAR * (resolution or self._resolution) * size)

    def near(self) -> set[int]:
        """Return the obstacles that are touched, but for rounding."""
        return {
            index
            for index, element in enumerate(self.elements)
            if isinstance(element, RigidContact) and self._is_near(element, self.apart[index])
        }

    def runs_into_something(self) -> bool:
        """Return whether what is touched is also approached: by chance two events may coincide."""
        near = self.near() - self.touched
        return any(self.striking.approached(index, self.q, self.u) for index in near)

    def is_moving(self, number: int) -> bool:
        """Return whether the chain moves along an element's direction."""
        return not rests(self.row(number), self.u)

    def check_outside(self, mode: Mode) -> None:
        """Refuse to go on inside an obstacle: an impact that was missed is not passed over."""
        for index, state in enumerate(mode.states):
            if state is not ContactState.OPEN:
                continue
            element, gap = self.elements[index], self.apart[index]
            assert not isinstance(element, DryFriction)
            if gap < -_INSIDE * rounding("double") * max(1.0, abs(float(element.bound))):
                raise SimulationError(
                    f"{element.name}: at {float(self.now):.9g} s it is {-float(gap):.3g} inside, "
                    "which must not be; allowed are scenes whose contact can be followed"
                )

    def settle(self, mode: Mode) -> None:
        """Set to rest exactly what a mode holds at rest, where it is so to rounding."""
        self.u = self.striking.stopped(self._barred(mode), self.q, self.u)

    def rest_on_all(self) -> None:
        """Take away what speed is left along any of the obstacles that are touched."""
        touched = sorted(i for i in self.touched if isinstance(self.elements[i], RigidContact))
        self.u = self.striking.stopped([self.direction(i) for i in touched], self.q, self.u)

    def stop(self, number: int, mode: Mode) -> None:
        """Bring to rest what slipped in a mode."""
        along = [slides(self.elements[number]), *self._barred(mode)]
        self.u = self.striking.stopped(along, self.q, self.u)

    def halts(self, number: int, mode: Mode) -> bool:
        """Set the chain to rest if it must be where an element's speed is zero, and return whether.

        So it is where a mode holds it in another direction.
        """
        still = [self.direction(number), *self._barred(mode)]
        rows = [self.modes.row(direction, self.q) for direction in still]
        if all(same_way(rows[0], row) for row in rows[1:]):
            return False
        self.u = self.striking.stopped(still, self.q, self.u)
        return True

    def _barred(self, mode: Mode) -> list[ConstraintCoordinate]:
        """Return the directions in which a mode lets nothing move."""
        found = []
        for element, state in zip(self.elements, mode.states, strict=True):
            if isinstance(element, RigidContact) and state is not ContactState.OPEN:
                found.append(element.direction)
            if state is ContactState.STICKS:
                found.append(slides(element))
        return found

    def pushed_by(self, number: int, slips: ContactState) -> dict[int, ContactState]:
        """Return what is touched and would be pushed by a friction that breaks loose this way."""
        if not isinstance(self.elements[number], DryFriction):
            return {}
        row = self.row(number)
        pushed = {}
        for index in self.touched:
            across = self.row(index)
            against = slips.direction * (row[0] * across[0] + row[1] * across[1]) < 0
            if against and same_way(row, across):
                pushed[index] = ContactState.CLOSED
        return pushed

    def choices(self, number: int, moment: Any) -> tuple[ContactState, ...]:
        """Return the states of an element that come into question, the most restful first.

        Where this pose does not tell, that of a free motion a `moment` (s) later does.
        """
        element = self.elements[number]
        if not isinstance(element, DryFriction) and number not in self.touched:
            return (ContactState.OPEN,)
        leaving = (ContactState.OPEN,) if isinstance(element, RigidContact) else ()
        along = element.direction if isinstance(element, DryFriction) else element.tangent
        if along is None:
            return (ContactState.CLOSED, *leaving)
        row, u = self.modes.row(along, self.q), self.u
        if max(abs(row[0]), abs(row[1])) <= self._resolution:
            # A chain that is stretched along a direction cannot move its end that way yet: where it
            # will slide shows a moment later.
            row, u = self._moved_on(along, moment)
        if rests(row, u):
            return (ContactState.STICKS, ContactState.FORWARD, ContactState.BACKWARD, *leaving)
        forward = row[0] * u[0] + row[1] * u[1] > 0
        return (ContactState.FORWARD if forward else ContactState.BACKWARD, *leaving)

    def _moved_on(self, direction: ConstraintCoordinate, h: Any) -> tuple[Pair, Pair]:
        """Return the row of a direction, and u, when the chain has moved freely for h (s)."""
        (q1, q2), (u1, u2) = self.q, self.u
        du1, du2 = self.accelerations(self.free_mode)
        q = q1 + h * (u1 + h * du1 / 2), q2 + h * (u2 + h * du2 / 2)
        return self.modes.row(direction, q), (u1 + h * du1, u2 + h * du2)

    def accelerations(self, mode: Mode) -> Pair:
        """Return du (rad/s²) in a mode."""
        return self.modes.accelerations(mode, self.q, self.u, self.now)

    def pull(self, number: int, mode: Mode) -> Any:
        """Return the acceleration (rad/s² or m/s²) in a mode towards an obstacle or a cushion."""
        row, du = self.row(number), self.accelerations(mode)
        drift = self.direction(number).drift(self.modes.chain, self.q, self.u)
        return -(row[0] * du[0] + row[1] * du[1] + drift)

    def keep_touched(self, mode: Mode) -> None:
        """Forget what a mode leaves; what is held off it by others is touched still."""
        pushing = {index for index in self.touched if mode.states[index] is not ContactState.OPEN}
        kept = set()
        for index in self.touched - pushing:
            row = self.row(index)
            if rests(row, self.u) and rests(row, self.accelerations(mode)):
                kept.add(index)
        self.touched = kept | pushing


def slides(element: ContactElement) -> ConstraintCoordinate:
    """Return the direction in which an element with friction lets the chain slip."""
    along = element.direction if isinstance(element, DryFriction) else element.tangent
    assert along is not None
    return along
