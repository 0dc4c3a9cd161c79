"""Modes, events and impacts of a hybrid motion: data only."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

from twolink.arithmetic import Scalar
from twolink.contact.force_laws import Phase, PlasticState
from twolink.contact.impact_laws import Regime
from twolink.contact.states import ContactState, EventKind


@dataclass(frozen=True)
class Mode:
    """The states of all elements, each with its name.

    `dents` has the plastic state of each element where any surface yields, and is empty elsewhere.
    """

    names: tuple[str, ...]
    states: tuple[ContactState, ...]
    dents: tuple[PlasticState | None, ...] = ()

    def __getitem__(self, name: str) -> ContactState:
        """Return the state of the element of this name."""
        return self.states[self.names.index(name)]

    def dent(self, index: int) -> PlasticState | None:
        """Return the plastic state of the element of this number."""
        return self.dents[index] if self.dents else None

    @cached_property
    def slides(self) -> tuple[int, ...]:
        """The direction in which each element slides, 0 for none."""
        return tuple(state.direction if state.slips else 0 for state in self.states)

    @property
    def numbers(self) -> tuple[Scalar, ...]:
        """The numbers in which modes of the same kind differ: those of their plastic states."""
        return tuple(number for dent in self.dents if dent for number in dent.numbers)

    def with_numbers(self, numbers: tuple[Scalar, ...]) -> Mode:
        """Return a mode of the same kind with these numbers."""
        left = iter(numbers)
        dents = tuple(
            dent and dent.with_numbers(tuple(next(left) for _ in dent.numbers))
            for dent in self.dents
        )
        return replace(self, dents=dents)

    @property
    def kind(self) -> Mode:
        """The mode with zeros for its numbers, and forward: modes of one kind share an integrator.

        Modes that slide backward differ from those that slide forward in the sign of frictions.
        """
        found = self.with_numbers((0.0,) * len(self.numbers)) if self.dents else self
        states = tuple(state.forward for state in self.states)
        return found if states == self.states else replace(found, states=states)

    @property
    def in_floats(self) -> Mode:
        """The mode in floats, without dents that no point lies in."""
        if not self.dents:
            return self
        dents = tuple(
            None if dent is None or state is ContactState.OPEN else _in_floats(dent)
            for dent, state in zip(self.dents, self.states, strict=True)
        )
        return replace(self, dents=dents)

    def __str__(self) -> str:
        """Return the description of the mode, without free elements."""
        words = [
            f"{name} {state.value}{_words(self.dent(index))}"
            for index, (name, state) in enumerate(zip(self.names, self.states, strict=True))
            if state is not ContactState.OPEN
        ]
        return ", ".join(words) or "moves freely"


def _words(dent: PlasticState | None) -> str:
    return "" if dent is None or dent.phase is Phase.WHOLE else f" and {dent.phase.value}"


def _in_floats(dent: PlasticState) -> PlasticState:
    return dent.with_numbers(tuple(float(number) for number in dent.numbers))


@dataclass(frozen=True)
class Trigger:
    """The event that ended an arc: its kind, its element, and its sense where it has one."""

    kind: EventKind
    index: int
    sense: int = 0


def _always() -> bool:
    return True


class Leaving(NamedTuple):
    """How a small change of a state goes on: it grows by a rate (1/s), or is held back.

    A constant load moves a pose that is held back by up to twice its acceleration divided by the
    square of the `slowest` rate (1/s), which is 0 where the chain is free. The speeds (rad/s) that
    follow from a change of angles (rad) are at most those of the `fastest` rate (1/s).
    """

    growth: float
    slowest: float
    fastest: float = 0.0

    @classmethod
    def worst(cls, every: Iterable[Leaving]) -> Leaving:
        """Return one by which a change may go on as by the worst of several."""
        growth, slowest, fastest = zip(*every, strict=True)
        return cls(max(growth), min(slowest), max(fastest))


_FREE = Leaving(0.0, 0.0)


class Doubt(NamedTuple):
    """A choice at a time (s) that was made by round-off or by the limit of work.

    An event function has touched zero without falling, or has fallen by no more than the error of a
    run, or bounces were omitted. `speed` (rad/s or m/s) is that of the impacts that may have been
    missed, or infinity, and `change` (rad/s) what they would change u by. The event function stays
    within its error `until` a time (s). A doubt counts only if the error of an angle may be
    `within` (rad), and if it `matters`: whether another choice leads to another motion is computed
    where it is asked for. A choice that leaves out an acceleration has its `rate` (rad/s²); the
    motion that it causes goes on as a change `leaving` the state, and as `later` ones from their
    times (s) on, where the chain rests in other modes.
    """

    time: float
    trigger: Trigger
    speed: float
    change: float
    until: float
    within: float = 0.0
    matters: Callable[[], bool] = _always
    rate: float = 0.0
    leaving: Leaving = _FREE
    later: tuple[tuple[float, Leaving], ...] = ()

    @property
    def may_be_endless(self) -> bool:
        """Whether its change has no bound, or grows until it has none."""
        grows = self.leaving.growth or any(own.growth for _, own in self.later)
        return math.isinf(self.change) or bool(self.rate and grows)

    def since(self, time: float, later: Leaving) -> Doubt:
        """Return the doubt with the motion by an acceleration that it leaves out from a time on."""
        known = self.later[-1][1] if self.later else self.leaving
        if not self.rate or time <= self.time or later == known:
            return self
        return self._replace(later=(*self.later, (time, later)))


def doubt_of_change(time: float, trigger: Trigger, change: float) -> Doubt:
    """Return the doubt on a choice at a time (s) that changes u by `change` (rad/s)."""
    return Doubt(time, trigger, math.inf if math.isinf(change) else 0.0, change, 0.0)


def doubt_of_rate(time: float, trigger: Trigger, rate: float, leaving: Leaving) -> Doubt:
    """Return the doubt on a choice at a time (s) that leaves out an acceleration (rad/s²)."""
    return Doubt(time, trigger, 0.0, 0.0, 0.0, rate=rate, leaving=leaving)


class Remark(NamedTuple):
    """A sentence on a choice of the simulator at a time (s); remarks of one `kind` are alike.

    `change` (rad/s) is that of u by another choice, where it is known.
    """

    kind: str
    time: float
    sentence: str
    change: float = 0.0


def sentences(remarks: Iterable[Remark]) -> tuple[str, ...]:
    """Return the remark of each kind whose change is largest, with the number of the others."""
    alike: dict[str, dict[str, Remark]] = {}
    for remark in remarks:
        alike.setdefault(remark.kind, {}).setdefault(remark.sentence, remark)
    return tuple(_summed_up(list(kind.values())) for kind in alike.values())


def _summed_up(alike: list[Remark]) -> str:
    """Return the first sentence of the largest change, with the number and the times of others."""
    chosen = max(alike, key=lambda remark: remark.change)
    count, times = len(alike) - 1, [remark.time for remark in alike]
    if not count:
        return chosen.sentence
    since = "" if chosen.time == min(times) else f" from {min(times):.9g} s"
    often = f"{count} more {'time' if count == 1 else 'times'}{since}"
    return f"{chosen.sentence} This happens {often} until {max(times):.9g} s."


@dataclass(frozen=True)
class Event:
    """The beginning of a mode at a time (s).

    After a Zeno limit the mode was `entered` at the last resolved bounce, slightly earlier.
    """

    time: float
    mode: Mode
    entered: float

    @property
    def description(self) -> str:
        """The description of the mode."""
        return str(self.mode)


@dataclass(frozen=True)
class Impact:
    """An impact at a time (s) on the element of this number and name.

    Speeds are those along the element's normal (rad/s or m/s), before and after, and `sliding`
    those along its tangent if it is rough; impulses likewise (N m s or N s). `kinetic_energy` is
    T before and after (J), and `link_energies` those of link 1 and link 2, without those of rotors.
    `regime` describes the sliding. In the regime "bounces die away" the normal impulse takes back
    the last rebound, and is negative then: with the force at rest from `Event.entered` to
    `Event.time` it is the impulse of all bounces that are left out.
    """

    time: float
    index: int
    name: str
    speeds: tuple[float, float]
    sliding: tuple[float, float]
    normal_impulse: float
    tangential_impulse: float
    regime: Regime
    u: tuple[tuple[float, float], tuple[float, float]]
    kinetic_energy: tuple[float, float]
    link_energies: tuple[tuple[float, float], tuple[float, float]]

    @property
    def energy_change(self) -> float:
        """T after less T before (J)."""
        before, after = self.kinetic_energy
        return after - before

    @property
    def creates_energy(self) -> bool:
        """Whether T increases beyond round-off in an impact that does not sum up bounces."""
        of_note = self.regime is not Regime.BOUNCES_DIE_AWAY
        return of_note and self.energy_change > 1e-12 * max(self.kinetic_energy)

    @property
    def hits(self) -> str:
        """The contact in words, such as "D hits floor"."""
        return self.name.replace(" on ", " hits ", 1)

    @property
    def description(self) -> str:
        """The description of the impact, without the unit of its speeds."""
        return self.described("")

    def described(self, unit: str) -> str:
        """Return the description of the impact, with the unit of its speeds."""
        before, after = self.speeds
        unit = f" {unit}" if unit else ""
        if self.regime is Regime.BOUNCES_DIE_AWAY:
            # Their friction acts as the contact begins.
            return f"{self.name}: the remaining bounces (below {abs(before):.2g}{unit}) end here"
        gain = "; this law of restitution creates energy here" if self.creates_energy else ""
        return (
            f"{self.hits}: normal speed {with_minus(before)} → {with_minus(after)}{unit}, "
            f"{self.regime}, energy {with_minus(self.energy_change)} J{gain}"
        )


def with_minus(value: float, digits: int = 4) -> str:
    """Return a number as text, with a typographic minus sign."""
    return f"{value + 0.0:.{digits}g}".replace("-", "−", 1) if value < 0 else f"{value:.{digits}g}"
