"""The page of the scoreboard of `twolink scoreboard`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from twolink.conformance.convergence import Limit
from twolink.conformance.curves import MethodCurve, curves_by_scene
from twolink.conformance.results import TestResult
from twolink.conformance.scoreboard import REFERENCE, Entry, Scoreboard
from twolink.conformance.scoreboard_tables import (
    anchor,
    failures,
    motion_table,
    settings_table,
    suite_table,
    summary_table,
)
from twolink.conformance.suites import suite
from twolink.engines.marks import Mark
from twolink.viz.plots.convergence import convergence_plot
from twolink.viz.report.page import Section, folded, page, paragraph, picture, table, text

# Tests that are named with a reason before the rest is folded away.
_SHOWN = 6

# The suites whose groups are scenes.
_MOTIONS = ("motion", "friction", "impact")


def scoreboard_page(board: Scoreboard, command: str) -> str:
    """Return the whole page: tables, reasons of failures, settings, and the command."""
    count = len(board.entries)
    lead = paragraph(
        f"{count} engine{'' if count == 1 else 's'} on the vectors {board.vectors} of twolink"
        " conform: certified values of planar two-link chains.",
        "lead",
    ) + paragraph(REFERENCE)
    suites = [
        table(found, "scores") for name in board.suites if (found := suite_table(board, name))
    ]
    sections = [
        Section("Engines", _key() + table(summary_table(board), "scores")),
        Section("Suites", "".join(suites)),
    ]
    motions = motion_table(board)
    if motions is not None:
        sections.append(Section("Motions", _curves(board) + table(motions, "scores")))
    reasons = "".join(_of_engine(number, entry) for number, entry in enumerate(board.entries))
    sections += [
        Section("Causes", reasons),
        Section("Settings", table(settings_table(board), "settings")),
        Section("Reproduce", f"<pre>{text(command)}</pre>"),
    ]
    return page("twolink scoreboard", lead, sections)


def _key() -> str:
    marks = "; ".join(f"{mark.value}: {mark.means}" for mark in Mark)
    return paragraph(
        "Each cell has the passed tests of those that were put to the engine, and the correct"
        " digits of its worst answer (LRE). Green: all pass; yellow: some are missed or refused;"
        " red: some are silently wrong, or end in a fault. A dash: the engine does not answer."
        " The engines with the largest share of passed tests stand first; one that answers little"
        " can stand high.",
        "note",
    ) + paragraph(f"{marks}.", "note")


def _curves(board: Scoreboard) -> str:
    """Return a picture of each scene: the errors of all methods against their settings."""
    scenes = curves_by_scene((entry.engine.name, entry.results) for entry in board.entries)
    pictures = "".join(_picture(scene, curves) for scene, curves in scenes.items())
    lead = paragraph(
        "The error of each method, the largest of angles and speeds, as its step or tolerance"
        " shrinks. A curve that levels off above round-off belongs to another model. A curve ends"
        " once half of all digits are right. The table below has the limit of each method (the"
        " truth, another model, or none), its measured order, and its error at the finest setting"
        " (rad, rad/s).",
        "note",
    )
    return lead + pictures if pictures else ""


def _picture(scene: str, curves: Sequence[MethodCurve]) -> str:
    title = _titled(scene)
    limits = Counter(each.curve.verdict.limit for each in curves)
    counts = "; ".join(f"{limit.value}: {limits[limit]}" for limit in Limit if limits[limit])
    return picture(
        convergence_plot({scene: curves}, title, "light"),
        f"{title}. Methods by verdict: {counts}.",
    )


def _titled(scene: str) -> str:
    """Return the name of a scene, with its description where this release has it."""
    groups = (group for name in _MOTIONS for group in suite(name))
    found = [group.comment for group in groups if group.id.rpartition("/")[2] == scene]
    return ": ".join([scene, *found[:1]])


def _of_engine(number: int, entry: Entry) -> str:
    """Return an engine's verdict, and its failures by reason."""
    body = paragraph(entry.verdict)
    body += "".join(_reason(reason, results) for reason, results in failures(entry).items())
    return f'<section id="{anchor(number)}"><h3>{text(entry.title)}</h3>{body}</section>\n'


def _reason(reason: str, results: Sequence[TestResult]) -> str:
    tests = "".join(f"<li><code>{text(r.id)}</code>: {text(r.said)}</li>" for r in results)
    count = f"{len(results)} test{'' if len(results) == 1 else 's'}"
    named = ", ".join(result.id for result in results[:_SHOWN])
    more = ", …" if len(results) > _SHOWN else ""
    return folded(f"{reason} ({count}: {named}{more})", f"<ul>{tests}</ul>")
