"""The sections of the report: results as HTML."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from twolink.accuracy.study import Study
from twolink.accuracy.tables import MARKS, choices_table, configurations_table
from twolink.chain import Chain
from twolink.kinematics import position
from twolink.lagrange import kinetic_energy
from twolink.scene import Scene
from twolink.simulation import Trajectory
from twolink.simulation.effects_cost import EffectsCost
from twolink.simulation.hybrid.mode import with_minus
from twolink.simulation.log import LogEntry
from twolink.tables import as_html
from twolink.tables import table as described
from twolink.text import as_sentence
from twolink.verification import Verdict
from twolink.verification.verdict import KEY
from twolink.viz.plots.angles import angles
from twolink.viz.plots.contact import contact
from twolink.viz.plots.energy import energy
from twolink.viz.plots.moments import Moments, moments, time_limits
from twolink.viz.plots.path import path
from twolink.viz.plots.work_precision import work_precision_plot
from twolink.viz.report.page import (
    Section,
    download,
    folded,
    heading,
    paragraph,
    picture,
    table,
    text,
)

# A longer log is folded.
_LOG_LINES = 16


@dataclass(frozen=True)
class Card:
    """A part of the report in the summary: its name, its verdict, and the anchor of its section.

    `passed` is None for a part that was not run; the `command` runs it.
    """

    name: str
    passed: bool | None
    sentence: str
    anchor: str = ""
    command: str = ""


_SYMBOLS = {
    "A": "the fixed joint",
    "B": "the joint of both links, the elbow",
    "D": "the free end",
    "C1, C2": "the mass centres of the links",
    "q1, q2": "the absolute angles of the links from the x axis, clockwise in the picture (rad)",
    "u1, u2": "their rates (rad/s)",
    "θ, ω": "joint angles and speeds of a URDF",
    "T, V": "kinetic and potential energy (J)",
}


def summary(cards: Sequence[Card], drawing: str) -> str:
    """Return the verdicts, the failed ones first, beside a drawing (SVG) with its symbols."""
    kinds = {True: "good", False: "bad", None: "soft"}
    marks = {True: "✓ ", False: "✗ ", None: "– "}
    items = "".join(
        f'<li class="{kinds[card.passed]}"><b class="{kinds[card.passed]}">{marks[card.passed]}'
        f"{_named(card)}</b>{as_html(card.sentence)}{_ran_by(card)}</li>"
        for card in sorted(cards, key=lambda card: card.passed is not False)
    )
    names = "".join(f"<dt>{text(k)}</dt><dd>{text(v)}</dd>" for k, v in _SYMBOLS.items())
    return (
        f'<ul class="cards">{items}</ul>\n<div class="overview"><div role="img" '
        f'aria-label="The chain with its symbols, named beside the drawing">{drawing}</div>'
        f"<dl>{names}</dl></div>"
    )


def _named(card: Card) -> str:
    return f'<a href="#{card.anchor}">{text(card.name)}</a>' if card.anchor else text(card.name)


def _ran_by(card: Card) -> str:
    # A line break in an option's dashes would spoil it.
    return f' <code class="whole">{text(card.command)}</code>' if card.command else ""


def verification(verdict: Verdict) -> Section:
    """Return the section on verification; its tables are folded."""
    tables = "".join(table(each) for each in verdict.tables())
    states = f"{verdict.states} random states, seed {verdict.seed}, against {verdict.engine}"
    count = len(verdict.comparisons)
    body = (
        _verdict(verdict.sentence, verdict.passed)
        + paragraph(f"Each quantity at {states}.")
        + folded(
            f"All {count} comparisons", tables + paragraph(KEY, "note"), opened=not verdict.passed
        )
        + _downloads(download("verdict.json", "application/json", _as_json(verdict)))
    )
    return Section("Verification", body)


def _as_json(verdict: Verdict) -> bytes:
    found = {"passed": verdict.passed, "sentence": verdict.sentence, **asdict(verdict)}
    return json.dumps(found, indent=2, ensure_ascii=False, default=str).encode()


def _downloads(*links: str) -> str:
    return f'<p class="downloads">Download: {", ".join(links)}</p>'


def _verdict(sentence: str, passed: bool = True) -> str:
    return paragraph(sentence, "verdict" if passed else "verdict bad")


def accuracy_card(trajectories: Sequence[Trajectory]) -> Card:
    """Return whether every scene has the requested accuracy."""
    missed = [each for each in trajectories if not each.met]
    if missed:
        names = ", ".join(f"{each.scene.title} (until {each.holds_until:.4g} s)" for each in missed)
        sentence = f"The requested accuracy is not met to the end by {names}."
    else:
        worst = max((each.error for each in trajectories), default=0.0)
        sentence = (
            f"{len(trajectories)} of {len(trajectories)} have the requested accuracy; the largest "
            f"measured error is {worst:.1e} rad or rad/s."
        )
    return Card("Scenes", not missed, sentence, anchor_of(trajectories[0].scene))


def anchor_of(scene: Scene) -> str:
    """Return the anchor of a scene's section."""
    return Section(scene.title, "").anchor


def scene(trajectory: Trajectory, player: str, cost: EffectsCost, study: Study) -> Section:
    """Return the section of a scene: motion and accuracy; `player` is the HTML of its film."""
    shows = trajectory.scene.shows
    film = (
        player
        + paragraph("Click in a curve, or on a time, to move the film there.", "note screen")
        + _facts(trajectory)
        + _log(trajectory)
    )
    body = (
        (paragraph(as_sentence(shows)) if shows else "")
        + f'<div class="side"><div class="film">{film}</div>'
        + f"<div>{heading('Curves')}{_curves(trajectory)}</div></div>"
        + heading("Cost of accuracy")
        + _accuracy(study)
        + heading("Cost of the effects")
        + paragraph("Only the effects that a scene names are simulated. Each is removed in turn.")
        + table(cost.table())
        + _downloads(download(f"{anchor_of(trajectory.scene)}.csv", "text/csv", _csv(trajectory)))
    )
    return Section(trajectory.scene.title, body)


def _csv(trajectory: Trajectory) -> bytes:
    with tempfile.TemporaryDirectory(prefix="twolink-") as folder:
        file = Path(folder) / "trajectory.csv"
        trajectory.save(file)
        return file.read_bytes()


def _facts(trajectory: Trajectory) -> str:
    notes = "".join(paragraph(note, "note") for note in trajectory.notes)
    return table(described("Simulation", ("", ""), trajectory.facts.items())) + notes


def _log(trajectory: Trajectory) -> str:
    """Return all modes and impacts; a sequence of bounces, and a long log, is folded."""
    log = trajectory.log
    if not log:
        return ""
    items = "".join(f"<li>{_entry(entry)}</li>" for entry in log)
    listed = f'<ul class="log">{items}</ul>'
    title = "Modes and impacts"
    if len(log) <= _LOG_LINES:
        return heading(title) + listed
    return heading(title) + folded(f"Show the {len(log)} entries", listed)


def _entry(entry: LogEntry) -> str:
    time = f'<button class="time" data-time="{entry.time!r}">{entry.time:.6g} s</button>'
    if not entry.parts:
        return f"{time} {as_html(entry.words)}"
    parts = "".join(f"<li>{_entry(part)}</li>" for part in entry.parts)
    inside = folded(f"Show the {len(entry.parts)} entries", f"<ul>{parts}</ul>")
    return f"{time} to {entry.until:.6g} s: {as_html(entry.words)} {inside}"


def _curves(trajectory: Trajectory) -> str:
    limits, shown = time_limits(trajectory), moments(trajectory)
    found = [
        picture(angles(trajectory), _angles_in_words(shown), limits),
        picture(energy(trajectory), _energy_in_words(trajectory, shown), limits),
        picture(path(trajectory), _path_in_words(trajectory.chain, shown)),
    ]
    if trajectory.events:
        kinds = dict.fromkeys(
            element for event in trajectory.events for element in event.mode.names
        )
        words = f"Forces and impulses of {', '.join(kinds)}, with the modes shaded."
        found.insert(2, picture(contact(trajectory), words, limits))
    return "\n".join(found)


def _angles_in_words(shown: Moments) -> str:
    ranges = (
        f"{name} from {with_minus(values.min(), 3)} to {with_minus(values.max(), 3)} {unit}"
        for name, values, unit in zip(
            ("q1", "q2", "u1", "u2"),
            (*shown.q, *shown.u),
            ("rad", "rad", "rad/s", "rad/s"),
            strict=True,
        )
    )
    return f"Angles and speeds: {', '.join(ranges)}."


def _energy_in_words(trajectory: Trajectory, shown: Moments) -> str:
    E = trajectory.energy
    T = kinetic_energy(trajectory.chain, (shown.q[0], shown.q[1]), (shown.u[0], shown.u[1]))
    first, last = with_minus(E[0]), with_minus(E[-1])
    return (
        f"Energy, and the work of each effect: T + V from {first} to {last} J, T at most "
        f"{np.max(T):.4g} J."
    )


def _path_in_words(chain: Chain, shown: Moments) -> str:
    x, y = position(chain, (shown.q[0], shown.q[1]), chain.D)
    far = float(np.hypot(x, y).max())
    return f"Path of D, at most {far:.3g} m from A; the chain at the start (faint) and at the end."


def _accuracy(study: Study) -> str:
    """Return the cost of accuracy in time, the recommendation, and the omissions."""
    measured = study.work_precision
    judge = f"Errors at {measured.judged_at}, measured against {measured.reference.source}."
    tables = (
        table(choices_table(study))
        + table(configurations_table(study.configurations))
        + (paragraph(study.waste) if study.waste else "")
        + paragraph(MARKS, "note")
    )
    return (
        _verdict(study.recommendation)
        + paragraph(judge)
        + picture(
            work_precision_plot(study),
            "Time against error of each configuration; shaded band: the fastest at each error",
        )
        + folded("Every configuration", tables)
        + "".join(paragraph(note, "note") for note in measured.notes)
    )


def origin(verdict: Verdict, command: str, more: Iterable[tuple[str, str]] = ()) -> Section:
    """Return the command that reproduces the page, versions, and the machine."""
    facts = [*more, *verdict.versions.items(), *verdict.machine.items()]
    rows = [(name, str(value)) for name, value in facts if value not in ("", None)]
    return Section(
        "Reproduce this report",
        f"<pre>{text(command)}</pre>" + table(described("Versions and machine", ("", ""), rows)),
    )
