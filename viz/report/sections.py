"""The report's sections: from what was found to HTML."""

from __future__ import annotations

import math
from typing import Any

from twolink.accuracy.study import Study
from twolink.simulation.effects_cost import EffectsCost
from twolink.simulation.trajectory import Trajectory
from twolink.verification.verify import Comparison, Verdict
from viz.plots.work_precision import work_precision_plot
from viz.report.page import Section, paragraph, picture, table, text

_LOG_LINES = 24


def verification(verdict: Verdict) -> Section:
    """Return what was checked and how well."""
    pairs = list(dict.fromkeys((c.source, c.against) for c in verdict.comparisons))
    rows = []
    for quantity in dict.fromkeys(c.quantity for c in verdict.comparisons):
        own = {(c.source, c.against): c for c in verdict.comparisons if c.quantity == quantity}
        algorithm = next(iter(own.values())).algorithm
        cells = [_difference(own[pair]) if pair in own else "" for pair in pairs]
        rows.append([text(quantity), f"<code>{text(algorithm)}</code>", *cells])
    heads = ["quantity", "Pinocchio's algorithm", *(f"{text(a)} − {text(b)}" for a, b in pairs)]
    body = (
        _verdict(verdict.sentence, verdict.passed)
        + table(heads, rows, numbers=range(2, len(heads)))
        + paragraph(
            "d / n: the largest difference is d units in the last place of what was summed; in "
            "that state two correct computations may differ by n.",
            "note",
        )
    )
    return Section("What was checked", body)


def _verdict(sentence: str, passed: bool) -> str:
    return paragraph(sentence, "verdict" if passed else "verdict bad")


def _difference(comparison: Comparison) -> str:
    mark = '<span class="good">✓</span>' if comparison.passed else '<span class="bad">✗</span>'
    units = "&lt;0.01" if 0 < comparison.units < 0.01 else f"{comparison.units:.2g}"
    return f"{units} / {comparison.allowed_units:.0f} {mark}"


def motion(trajectory: Trajectory, player: str) -> Section:
    """Return what moved: the player (HTML), what was simulated, and the log."""
    scene, statistics = trajectory.scene, trajectory.statistics
    facts = [
        ("simulated", f"{scene.duration:g} s with {', '.join(trajectory.effects) or 'no effects'}"),
        ("method", f"{trajectory.method} on {trajectory.formulation}, {trajectory.precision}"),
        ("global error", f"{trajectory.error:.1e} measured, {trajectory.accuracy:.1e} allowed"),
        ("steps", f"{statistics.steps} kept, in {statistics.runs} runs"),
        (
            "time",
            f"{statistics.run_seconds * 1e3:.1f} ms to run, "
            f"{statistics.compile_seconds * 1e3:.0f} ms to compile",
        ),
    ]
    rows = [[text(name), text(value)] for name, value in facts]
    notes = "".join(paragraph(note, "note") for note in trajectory.notes)
    lead = paragraph(scene.shows[:1].upper() + scene.shows[1:] + ".") if scene.shows else ""
    return Section(
        f"Motion: {scene.title}", lead + player + table(["", ""], rows) + notes + _log(trajectory)
    )


def _log(trajectory: Trajectory) -> str:
    log: list[Any] = [*trajectory.impacts, *trajectory.events]
    log.sort(key=lambda entry: entry.time)
    if not log:
        return ""
    shown = log[:_LOG_LINES]
    rows = [[f"{entry.time:.9g}", text(entry.what)] for entry in shown]
    more = len(log) - len(shown)
    after = paragraph(f"{more} more follow.", "note") if more else ""
    return table(["t (s)", "what"], rows, numbers=(0,), caption="Impacts and modes") + after


def accuracy(study: Study) -> Section:
    """Return what accuracy costs in time, and what to take."""
    rows = []
    for line in study.ways:
        time = "never" if line.seconds is None else _time(line.seconds)
        rows.append(
            [
                text(line.way),
                time + ("" if line.repeatable or line.seconds is None else " ±"),
                "" if line.ratio is None else f"{line.ratio:.3g}",
                f"{line.best:.1e}" if math.isfinite(line.best) else "failed",
            ]
        )
    heads = ["way", "time to an error of 1e-8", "ratio", "least error"]
    alt = "Time against error of every way; the broad band is the best to be had"
    return Section(
        "What accuracy costs",
        paragraph(study.recommendation, "verdict")
        + picture(work_precision_plot(study), alt)
        + table(heads, rows, numbers=(1, 2, 3))
        + paragraph("± marks times that could not be repeated to within a factor of two.", "note"),
    )


def _time(seconds: float) -> str:
    if seconds < 1e-3:
        return f"{seconds * 1e6:.0f} µs"
    return f"{seconds * 1e3:.3g} ms" if seconds < 1 else f"{seconds:.3g} s"


def effects(cost: EffectsCost) -> Section:
    """Return what each effect adds to the cost of a step."""
    whole = cost.whole
    rows = [["all effects", str(whole.operations), f"{whole.seconds * 1e9:.0f}", ""]]
    for name, step in cost.without.items():
        rows.append(
            [
                f"without {text(name)}",
                str(step.operations),
                f"{step.seconds * 1e9:.0f}",
                f"{whole.operations - step.operations} operations",
            ]
        )
    heads = ["", "operations a term", "ns a step", "it adds"]
    return Section(
        "Effects and their cost",
        paragraph("What a scene does not name is not simulated: each effect left out in turn.")
        + table(heads, rows, numbers=(1, 2, 3)),
    )


def origin(verdict: Verdict, command: str) -> Section:
    """Return versions, machine, and the command that makes the page again."""
    rows = [[text(name), text(version)] for name, version in verdict.versions.items()]
    rows += [[text(name), text(value)] for name, value in verdict.machine.items()]
    return Section("How to make it again", f"<pre>{text(command)}</pre>" + table(["", ""], rows))
