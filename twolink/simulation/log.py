"""The log of a motion: modes and impacts in order, with sequences of bounces as one entry."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

from twolink.contact.coordinates import JointCoordinate
from twolink.contact.impact_laws import Regime
from twolink.effects import contact_elements
from twolink.scene import Scene
from twolink.simulation.hybrid.mode import Event, Impact, with_minus

# So many impacts in a row on one contact are one entry.
_SEQUENCE = 3


@dataclass(frozen=True)
class LogEntry:
    """An impact or the start of a mode at a time (s), in words.

    For a sequence of bounces, which ends at `until` (s), `parts` are its impacts.
    """

    time: float
    until: float
    words: str
    parts: tuple[LogEntry, ...] = ()


def log_of(
    scene: Scene, impacts: Sequence[Impact], events: Sequence[Event]
) -> tuple[LogEntry, ...]:
    """Return the log of a motion of a scene, in order of time."""
    units = [
        "rad/s" if isinstance(element.principal, JointCoordinate) else "m/s"
        for element in contact_elements(scene.effects, scene.moving_chain)
    ]
    everything: list[Impact | Event] = [*impacts, *events]
    everything.sort(key=lambda entry: entry.time)
    entries: list[LogEntry] = []
    for contact, group in groupby(everything, _contact):
        own = list(group)
        parts = tuple(LogEntry(each.time, each.time, _words(each, units)) for each in own)
        struck = [each for each in own if isinstance(each, Impact)]
        if contact is None or len(own) < _SEQUENCE:
            entries.extend(parts)
        else:
            words = _sequence(struck, units[contact])
            entries.append(LogEntry(own[0].time, own[-1].time, words, parts))
    return tuple(entries)


def _contact(entry: Impact | Event) -> int | None:
    return entry.index if isinstance(entry, Impact) else None


def _words(entry: Impact | Event, units: list[str]) -> str:
    return entry.described(units[entry.index]) if isinstance(entry, Impact) else entry.description


def _sequence(struck: list[Impact], unit: str) -> str:
    """Return a sequence of impacts on one contact in words."""
    resolved = [impact for impact in struck if impact.regime is not Regime.BOUNCES_DIE_AWAY]
    first, last = resolved[0], resolved[-1]
    change = sum(impact.energy_change for impact in struck)
    ends = "" if len(resolved) == len(struck) else "; the remaining bounces end here"
    gain = (
        "; this law of restitution creates energy" if any(i.creates_energy for i in struck) else ""
    )
    return (
        f"{first.hits} {len(resolved)} times: normal speed {with_minus(first.speeds[0])} {unit} at "
        f"first, {with_minus(last.speeds[0], 2)} {unit} at last, energy {with_minus(change)} J"
        f"{ends}{gain}"
    )
