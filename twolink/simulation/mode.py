"""The mode of a motion that is not smooth, and the events between modes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum

from twolink.arithmetic import Scalar
from twolink.contact.force_laws import Phase, PlasticState

BOUNCES_DIE_AWAY = "bounces die away"
"""The regime of the impact that stands for bounces too low to be seen."""


class ContactState(Enum):
    """What a dry friction or an obstacle does: its value is how that is said.

    What is pressed against an obstacle gives all the friction that it can, and does not move.
    """

    FORWARD = "slips forward"
    BACKWARD = "slips backward"
    STICKS = "sticks"
    PRESSED_FORWARD = "is pressed forward"
    PRESSED_BACKWARD = "is pressed backward"
    OPEN = "is free"
    CLOSED = "rests"

    @property
    def direction(self) -> int:
        """+1 or −1 for one that slips or is pressed forward or backward, else 0."""
        return _DIRECTIONS.get(self.name, 0)


_DIRECTIONS = {"FORWARD": 1, "BACKWARD": -1, "PRESSED_FORWARD": 1, "PRESSED_BACKWARD": -1}
_PRESSED = {
    ContactState.FORWARD: ContactState.PRESSED_FORWARD,
    ContactState.BACKWARD: ContactState.PRESSED_BACKWARD,
}


@dataclass(frozen=True)
class Mode:
    """The states of all dry frictions and obstacles, each with the name of what it acts on.

    Where any of them remembers what has been, `dents` has an entry for each, else none.
    """

    names: tuple[str, ...]
    states: tuple[ContactState, ...]
    dents: tuple[PlasticState | None, ...] = ()

    def __getitem__(self, name: str) -> ContactState:
        """Return the state of what has this name."""
        return self.states[self.names.index(name)]

    def pressed(self, index: int) -> Mode:
        """Return the same mode, in which the friction of this number cannot slip as it would."""
        states = list(self.states)
        states[index] = _PRESSED[states[index]]
        return replace(self, states=tuple(states))

    def dent(self, index: int) -> PlasticState | None:
        """Return what the friction or obstacle of this number remembers."""
        return self.dents[index] if self.dents else None

    @property
    def numbers(self) -> tuple[Scalar, ...]:
        """The numbers in which modes of the same kind differ: those of their dents."""
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
        """The mode without its numbers: modes of a kind do the same, in dents of other sizes."""
        return self.with_numbers((0.0,) * len(self.numbers)) if self.dents else self

    @property
    def told(self) -> Mode:
        """The mode as an event has it: in plain numbers, without dents in which nothing lies."""
        if not self.dents:
            return self
        dents = tuple(
            None if dent is None or state is ContactState.OPEN else _in_floats(dent)
            for dent, state in zip(self.dents, self.states, strict=True)
        )
        return replace(self, dents=dents)

    def __str__(self) -> str:
        """Return the mode in words; what is free is not mentioned."""
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
class Event:
    """What happened at a time (s): the mode that begins there.

    Where bounces have died away it was `entered` a moment earlier, at the last one that was seen.
    """

    time: float
    mode: Mode
    entered: float

    @property
    def what(self) -> str:
        """The mode in words."""
        return str(self.mode)


@dataclass(frozen=True)
class Impact:
    """What an impact did at a time (s), on the obstacle of this number and name.

    Speeds are those along the obstacle's direction (rad/s or m/s), before and after, and along its
    tangent where it is rough; impulses likewise (N m s or N s). `kinetic_energy` is T before and
    after (J), and `link_energies` those of link 1 and link 2. `regime` says how the point slid.
    """

    time: float
    index: int
    name: str
    speeds: tuple[float, float]
    sliding: tuple[float, float]
    normal_impulse: float
    tangential_impulse: float
    regime: str
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
        """Whether T grows by more than rounding, other than where bounces are summed up."""
        of_note = self.regime != BOUNCES_DIE_AWAY
        return of_note and self.energy_change > 1e-12 * max(self.kinetic_energy)

    @property
    def what(self) -> str:
        """The impact in words."""
        before, after = self.speeds
        if self.regime == BOUNCES_DIE_AWAY:
            # Their energy is no news: the friction that goes with them acts as the contact begins.
            return f"{self.name}: bounces of {before:.6g} and less die away"
        gain = "; this law of restitution creates energy here" if self.creates_energy else ""
        return (
            f"{self.name}: impact, {before:.6g} to {after:.6g}, {self.regime}, "
            f"{self.energy_change:+.6g} J{gain}"
        )
