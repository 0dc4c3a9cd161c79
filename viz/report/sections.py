"""The sections of the report: results as HTML."""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import partial
from typing import Any

from twolink.accuracy.study import COMPARED_AT, ConfigurationSummary, Study
from twolink.simulation import Trajectory
from twolink.simulation.effects_cost import EffectsCost
from twolink.verification import Comparison, Verdict
from viz.plots.angles import angles
from viz.plots.contact import contact
from viz.plots.energy import energy
from viz.plots.path import path
from viz.plots.work_precision import work_precision_plot
from viz.report.page import Section, heading, paragraph, picture, table, text

_LOG_LINES = 16


def verification(verdict: Verdict) -> Section:
    """Return the section on verification."""
    motion = [c for c in verdict.comparisons if c.source == "Section 6.1"]
    dynamics = [c for c in verdict.comparisons if c.source != "Section 6.1"]
    states = f"{verdict.states} random states, seed {verdict.seed}, against {verdict.engine}."
    body = (
        _verdict(verdict.sentence, verdict.passed)
        + paragraph(f"Each quantity at {states}")
        + _comparisons("Equations of motion", dynamics)
        + _comparisons("Motion of the points", motion)
        + paragraph(
            "d / n: worst difference d and tolerance n at that state, both in units in the last "
            "place. Agreement means d ≤ n.",
            "note",
        )
    )
    return Section("Verification", body)


def _verdict(sentence: str, passed: bool = True) -> str:
    return paragraph(sentence, "verdict" if passed else "verdict bad")


def _comparisons(title: str, comparisons: list[Comparison]) -> str:
    """Return a table of quantities and pairs of sources."""
    pairs = list(dict.fromkeys((c.source, c.against) for c in comparisons))
    rows = []
    for quantity in dict.fromkeys(c.quantity for c in comparisons):
        own = {(c.source, c.against): c for c in comparisons if c.quantity == quantity}
        algorithm = next(iter(own.values())).algorithm
        cells = [_difference(own[pair]) if pair in own else "" for pair in pairs]
        rows.append([text(quantity), f"<code>{text(algorithm)}</code>", *cells])
    names = (f"{source} − {against.split()[0]}" for source, against in pairs)
    heads = ["quantity", "Pinocchio's algorithm", *map(text, names)]
    return table(heads, rows, numbers=range(2, len(heads)), caption=title)


def _difference(comparison: Comparison) -> str:
    mark = '<span class="good">✓</span>' if comparison.passed else '<span class="bad">✗</span>'
    units = "&lt;0.01" if 0 < comparison.units < 0.01 else f"{comparison.units:.2g}"
    return f"{units} / {comparison.allowed_units:.0f} {mark}"


def scene(trajectory: Trajectory, player: str, cost: EffectsCost, study: Study) -> Section:
    """Return the section of a scene: motion and accuracy; `player` is the HTML of its film."""
    shows = trajectory.scene.shows
    body = (
        (paragraph(f"{shows[:1].upper()}{shows[1:]}.") if shows else "")
        + player
        + _facts(trajectory)
        + _log(trajectory)
        + heading("Curves")
        + _curves(trajectory)
        + heading("Effects and their cost")
        + _effects(cost)
        + heading("Cost of accuracy")
        + _accuracy(study)
    )
    return Section(trajectory.scene.title, body)


def _facts(trajectory: Trajectory) -> str:
    run, statistics = trajectory, trajectory.statistics
    facts = {
        "simulated": f"{run.scene.duration:g} s with {', '.join(run.effects) or 'no effects'}",
        "method": f"{run.method} on {run.formulation}, {run.precision}",
        "global error": f"{run.error:.1e} measured, tolerance {run.accuracy:.1e}",
        "steps": f"{statistics.steps} kept, in {statistics.runs} runs",
        "time": f"{statistics.run_seconds * 1e3:.1f} ms to run, "
        f"{statistics.compile_seconds * 1e3:.0f} ms to compile",
    }
    notes = "".join(paragraph(note, "note") for note in run.notes)
    return table(["", ""], [[text(name), text(value)] for name, value in facts.items()]) + notes


def _log(trajectory: Trajectory) -> str:
    log: list[Any] = [*trajectory.impacts, *trajectory.events]
    if not log:
        return ""
    log.sort(key=lambda entry: entry.time)
    rows = [[f"{entry.time:.9g}", text(entry.what)] for entry in log[:_LOG_LINES]]
    more = len(log) - _LOG_LINES
    after = paragraph(f"{more} more follow.", "note")
    logged = table(["t (s)", "event"], rows, numbers=(0,), caption="Impacts and modes")
    return logged + (after if more > 0 else "")


def _curves(trajectory: Trajectory) -> str:
    title = trajectory.scene.title
    found = [
        picture(partial(path, trajectory), f"Path of D, the chain at start and end: {title}"),
        picture(partial(angles, trajectory), f"Angles and speeds: {title}"),
        picture(partial(energy, trajectory), f"Energy, and the work of each effect: {title}"),
    ]
    if trajectory.events:
        found.append(picture(partial(contact, trajectory), f"Contact, its modes shaded: {title}"))
    return "\n".join(found)


def _accuracy(study: Study) -> str:
    """Return the cost of accuracy in time, and the recommendation."""
    rows = [
        [
            text(line.configuration),
            _time_of(line),
            "" if line.ratio is None else f"{line.ratio:.3g}",
            f"{line.best:.1e}" if math.isfinite(line.best) else "failed",
        ]
        for line in study.configurations
    ]
    heads = ["configuration", f"time to an error of {COMPARED_AT:g}", "ratio", "least error"]
    measured = study.work_precision
    judge = f"Errors at {measured.judged_at}, measured against {measured.reference.source}."
    return (
        _verdict(study.recommendation)
        + paragraph(judge)
        + picture(
            partial(work_precision_plot, study),
            "Time against error; the band is the fastest configuration at each error",
        )
        + table(heads, rows, numbers=(1, 2, 3))
        + paragraph(
            "±: the time varied by more than a factor of two. By chance: this setting reached the "
            "error, the next finer one did not.",
            "note",
        )
    )


def _time_of(line: ConfigurationSummary) -> str:
    """Return a configuration's time in a suitable unit, marked if it is not reproducible."""
    seconds = line.seconds
    if seconds is None:
        return line.why_no_time
    mark = "" if line.repeatable else " ±"
    if seconds < 1e-3:
        return f"{seconds * 1e6:.0f} µs{mark}"
    return f"{seconds * 1e3:.3g} ms{mark}" if seconds < 1 else f"{seconds:.3g} s{mark}"


def _effects(cost: EffectsCost) -> str:
    """Return the contribution of each effect to the cost of a step."""
    whole = cost.whole
    rows = [["all effects", str(whole.operations), f"{whole.seconds * 1e9:.0f}", ""]]
    rows += [
        [
            f"without {text(name)}",
            str(step.operations),
            f"{step.seconds * 1e9:.0f}",
            f"{whole.operations - step.operations} operations",
        ]
        for name, step in cost.without.items()
    ]
    heads = ["", "operations per term", "time per step (ns)", "cost of this effect"]
    return paragraph(
        "Only the effects that a scene names are simulated. Below, each is removed in turn."
    ) + (table(heads, rows, numbers=(1, 2, 3)))


def origin(verdict: Verdict, command: str, more: Iterable[tuple[str, str]] = ()) -> Section:
    """Return versions, machine, and the command that reproduces the page."""
    facts = [*verdict.versions.items(), *verdict.machine.items(), *more]
    rows = [[text(name), text(value)] for name, value in facts]
    return Section("Reproduce this report", f"<pre>{text(command)}</pre>" + table(["", ""], rows))
