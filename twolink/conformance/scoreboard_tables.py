"""The scoreboard as tables: engines by suites and quantities, motions, and settings."""

from __future__ import annotations

import math
from collections.abc import Iterable

from twolink.conformance.convergence import Limit
from twolink.conformance.curves import scene_of
from twolink.conformance.results import MOTION, TestResult, rows
from twolink.conformance.scoreboard import Entry, Scoreboard, Tally, tally
from twolink.engines.marks import Mark
from twolink.engines.messages import Method
from twolink.tables import Cell, Column, Table, Tone, table

_LIMITS = {Limit.TRUTH: "truth", Limit.ANOTHER: "other", Limit.NONE: "none"}

_GIGABYTE = 2**30


def results_table(results: Iterable[TestResult]) -> Table:
    """Return one engine's passes, worst digits and other marks, by suite and quantity."""
    made, before = [], ""
    for (suite, quantity), found in rows(results).items():
        count = tally(found)
        cannot = [(Mark.CANNOT, len(found) - count.put)] if len(found) > count.put else []
        made.append(
            (
                "" if suite == before else suite,
                quantity,
                f"{count.passed}/{count.put}" if count.put else "–",
                "–" if count.digits is None else f"{count.digits:.1f}",
                ", ".join(f"{number} {mark.value}" for mark, number in (*count.others, *cannot)),
            )
        )
        before = suite
    heads = (Column("pass", number=True), Column("digits", number=True), Column("otherwise"))
    return table("", ["suite", "quantity", *heads], made)


def summary_table(board: Scoreboard) -> Table:
    """Return passed tests and the worst digits of each engine, in all and by suite."""
    rows = []
    for number, entry in enumerate(board.entries):
        everything = tally(entry.results)
        cells = [counted(tally(entry.of(suite))) for suite in board.suites]
        title = Cell(entry.engine.name, link=f"#{anchor(number)}")
        rows.append(
            [title, entry.engine.version, entry.engine.precision, counted(everything), *cells]
        )
    heads = [Column(name, number=True) for name in ("all", *board.suites)]
    return table("Passed tests", ["engine", "version", "precision", *heads], rows)


def suite_table(board: Scoreboard, suite: str) -> Table | None:
    """Return passed tests and digits by quantity, or None for motions alone.

    Engines to which no test of the suite was put have no row.
    """
    names = dict.fromkeys(
        result.quantity
        for entry in board.entries
        for result in entry.of(suite)
        if not result.quantity.startswith(MOTION) and result.quantity != MOTION.strip(": ")
    )
    if set(names) <= {"read"}:
        return None
    rows: list[list[str | Cell]] = []
    for number, entry in enumerate(board.entries):
        results = entry.of(suite)
        if not tally(results).put:
            continue
        cells = [counted(tally(r for r in results if r.quantity == name)) for name in names]
        rows.append([Cell(entry.engine.name, link=f"#{anchor(number)}"), *cells])
    # Long names break between words.
    heads = [Column(name.replace("_", "\n"), number=True) for name in names]
    return table(f"Suite {suite}", ["engine", *heads], rows)


def motion_table(board: Scoreboard) -> Table | None:
    """Return the convergence of each method of each engine on each motion, or None without any.

    Cells have the limit, the measured order, and the error of the finest motion (rad, rad/s).
    """
    found: dict[tuple[int, str], dict[str, TestResult]] = {}
    motions: dict[str, None] = {}
    for number, entry in enumerate(board.entries):
        for result in entry.results:
            if result.quantity.startswith(MOTION):
                method = result.quantity.removeprefix(MOTION)
                motions[scene_of(result)] = None
                found.setdefault((number, method), {})[scene_of(result)] = result
    if not found:
        return None
    rows: list[list[str | Cell]] = [
        [
            Cell(board.entries[number].engine.name, link=f"#{anchor(number)}"),
            method,
            *(_convergence(results.get(motion)) for motion in motions),
        ]
        for (number, method), results in found.items()
    ]
    return table(
        "Convergence of motions",
        ["engine", "method", *(name.replace("-", "\n") for name in motions)],
        rows,
    )


def settings_table(board: Scoreboard) -> Table:
    """Return how each engine was run: by which command, in which form, and with which methods."""
    rows = [
        [
            entry.title,
            entry.attachment,
            ", ".join(entry.engine.reads),
            ", ".join(effect.replace("_", " ") for effect in entry.engine.effects) or "–",
            ", ".join(map(_method, entry.engine.methods)) or "–",
            f"{entry.seconds:g} s, {entry.memory / _GIGABYTE:g} GB",
        ]
        for entry in board.entries
    ]
    heads = ["engine", "attached by", "reads", "effects", "methods", "limits of an answer"]
    return table("Settings", heads, rows)


def anchor(number: int) -> str:
    """Return the identifier of an engine's part of the page."""
    return f"engine-{number + 1}"


def counted(found: Tally) -> Cell:
    """Return passed tests of those put, and below them the correct digits of the worst answer."""
    if not found.put:
        return Cell("–", Tone.SOFT)
    digits = "" if found.digits is None else f"\n{found.digits:.1f}"
    tones = {mark.tone for mark, _ in found.others}
    worst = (tone for tone in (Tone.BAD, Tone.WARN, Tone.GOOD) if tone in tones)
    return Cell(f"{found.passed}/{found.put}{digits}", next(worst, Tone.GOOD))


def failures(entry: Entry) -> dict[str, tuple[TestResult, ...]]:
    """Return an engine's failures by their reason in words, the most frequent first."""
    found: dict[str, list[TestResult]] = {}
    for result in entry.failed:
        found.setdefault(_reason(result), []).append(result)
    ordered = sorted(found, key=lambda reason: -len(found[reason]))
    return {reason: tuple(found[reason]) for reason in ordered}


def _reason(result: TestResult) -> str:
    # Errors of numbers differ from test to test, so one sentence stands for all of them.
    numbers = not result.cause and not math.isnan(result.factor)
    said = "the values are wrong, for a reason that is not known" if numbers else result.reason
    return f"{result.verdict}: {said}"


def _convergence(result: TestResult | None) -> Cell:
    if result is None or result.mark is Mark.CANNOT:
        return Cell("–", Tone.SOFT)
    tone = result.mark.tone
    if result.curve is None:
        return Cell(result.mark.value, tone)
    verdict = result.curve.verdict
    order = [] if math.isnan(verdict.order) else [f"order {verdict.order:.1f}"]
    return Cell("\n".join([_LIMITS[verdict.limit], *order, f"{verdict.error:.1e}"]), tone)


def _method(method: Method) -> str:
    order = "" if method.order is None else f", order {method.order:g}"
    return f"{method.name} ({method.parameter}{order})"
