"""The report's sections: from what was found to HTML."""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import partial
from typing import Any

from twolink.accuracy.study import COMPARED_AT, Study, WaySummary
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
    """Return what was checked and how well."""
    motion = [c for c in verdict.comparisons if c.source == "Section 6.1"]
    dynamics = [c for c in verdict.comparisons if c.source != "Section 6.1"]
    states = f"{verdict.states} random states, seed {verdict.seed}, against {verdict.engine}."
    body = (
        _verdict(verdict.sentence, verdict.passed)
        + paragraph(f"Each quantity at {states}")
        + _comparisons("Equations of motion", dynamics)
        + _comparisons("Motion of the points", motion)
        + paragraph(
            "d / n: the largest difference is d units in the last place of what was summed; in "
            "that state two correct computations may differ by n.",
            "note",
        )
    )
    return Section("What was checked", body)


def _verdict(sentence: str, passed: bool = True) -> str:
    return paragraph(sentence, "verdict" if passed else "verdict bad")


def _comparisons(title: str, comparisons: list[Comparison]) -> str:
    """Return a table of quantities by pairs of sources."""
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
    """Return what moved and how well that is known; `player` is the HTML that shows it."""
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
        + heading("What accuracy costs")
        + _accuracy(study)
    )
    return Section(trajectory.scene.title, body)


def _facts(trajectory: Trajectory) -> str:
    run, statistics = trajectory, trajectory.statistics
    facts = {
        "simulated": f"{run.scene.duration:g} s with {', '.join(run.effects) or 'no effects'}",
        "method": f"{run.method} on {run.formulation}, {run.precision}",
        "global error": f"{run.error:.1e} measured, {run.accuracy:.1e} allowed",
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
    logged = table(["t (s)", "what"], rows, numbers=(0,), caption="Impacts and modes")
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
    """Return what accuracy costs in time, and what to take."""
    rows = [
        [
            text(line.way),
            _time_of(line),
            "" if line.ratio is None else f"{line.ratio:.3g}",
            f"{line.best:.1e}" if math.isfinite(line.best) else "failed",
        ]
        for line in study.ways
    ]
    heads = ["way", f"time to an error of {COMPARED_AT:g}", "ratio", "least error"]
    measured = study.work_precision
    judge = f"Errors at {measured.judged_at}, judged by {measured.truth.source}."
    return (
        _verdict(study.recommendation)
        + paragraph(judge)
        + picture(
            partial(work_precision_plot, study),
            "Time against error; the band is the best to be had",
        )
        + table(heads, rows, numbers=(1, 2, 3))
        + paragraph(
            "± marks times that could not be repeated to within a factor of two; by chance: one "
            "setting errs so little, and the next finer one does not.",
            "note",
        )
    )


def _time_of(line: WaySummary) -> str:
    """Return a way's time in the unit that suits it, marked if it is not to be trusted."""
    seconds = line.seconds
    if seconds is None:
        return line.why_no_time
    mark = "" if line.repeatable else " ±"
    if seconds < 1e-3:
        return f"{seconds * 1e6:.0f} µs{mark}"
    return f"{seconds * 1e3:.3g} ms{mark}" if seconds < 1 else f"{seconds:.3g} s{mark}"


def _effects(cost: EffectsCost) -> str:
    """Return what each effect adds to the cost of a step."""
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
    heads = ["", "operations a term", "ns a step", "it adds"]
    return paragraph("What a scene does not name is not simulated: each is left out in turn.") + (
        table(heads, rows, numbers=(1, 2, 3))
    )


def origin(verdict: Verdict, command: str, more: Iterable[tuple[str, str]] = ()) -> Section:
    """Return versions, machine, and the command that makes the page again."""
    facts = [*verdict.versions.items(), *verdict.machine.items(), *more]
    rows = [[text(name), text(value)] for name, value in facts]
    return Section("How to make it again", f"<pre>{text(command)}</pre>" + table(["", ""], rows))
