"""Tables of work-precision and drift studies."""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import groupby

from twolink.accuracy.drift import Drift
from twolink.accuracy.study import COMPARED_AT, ConfigurationSummary, Study, Work
from twolink.tables import Cell, Column, Table, Tone, table
from twolink.text import rounded

# Names of configurations continue in a second line in narrower columns (characters).
_NAME = 22

MARKS = (
    "±: the time varied by more than a factor of two, or was measured once. By chance: this "
    "setting reached the error, the next finer one did not. Budget ended: finer settings were not "
    "tried. Operations are of floating-point numbers. ≥: some were not counted; ≤: the time times "
    "the peak of a core; *: at the least error, and compared with the fewest at that error."
)
"""The meaning of the marks in a table of configurations."""


def choices_table(study: Study) -> Table:
    """Return the cheapest configuration for each number of correct digits."""
    rows = []
    for point, group in groupby(study.choices, key=lambda choice: choice.point):
        own = list(group)
        digits, further = [choice.digits for choice in own], own[0].next_digit
        rows.append(
            (
                str(digits[0]) if len(digits) == 1 else f"{digits[0]} to {digits[-1]}",
                point.configuration,
                f"{point.parameter} {point.setting:.3g}",
                time_in_words(point.seconds, point.repeatable),
                "—" if further is None else f"× {further:.2f}",
            )
        )
    columns = (
        Column("digits", number=True),
        Column("cheapest configuration", wraps=_NAME),
        Column("setting", spare=1),
        Column("time", number=True),
        Column("time for the next digit", number=True, spare=2),
    )
    return table("Cost of a digit", columns, rows)


def configurations_table(configurations: Iterable[ConfigurationSummary]) -> Table:
    """Return time and operations of each configuration at `COMPARED_AT`, and its least error."""
    columns = (
        Column("configuration", wraps=_NAME),
        Column("time", number=True),
        Column("ratio", number=True, spare=1),
        Column("operations", number=True),
        Column("to fewest", number=True, spare=1),
        Column("least error", number=True),
        Column("order", number=True, spare=4),
        Column("measured order", number=True, spare=3),
        Column("failed", number=True, spare=2),
    )
    rows = (
        (
            line.configuration,
            line.why_no_time
            if line.seconds is None
            else time_in_words(line.seconds, line.repeatable),
            "" if line.ratio is None else rounded(line.ratio),
            *_work(line.work),
            f"{line.best:.1e}" if math.isfinite(line.best) else "none",
            "" if line.declared is None else str(line.declared),
            "" if line.measured is None else f"{line.measured:.2f}",
            str(line.failures or ""),
        )
        for line in configurations
    )
    return table(f"Every configuration, at an error of {COMPARED_AT:g}", columns, rows)


def _work(work: Work | None) -> tuple[str, str]:
    """Return the operations of a configuration, and their ratio to the fewest."""
    if work is None:
        return "", ""
    star = "" if work.error == COMPARED_AT else " *"
    mark = work.extent.mark
    return f"{mark}{work.operations:.1e}{star}", f"{mark}× {rounded(work.ratio)}"


def events_table(study: Study) -> Table:
    """Return the errors of event times, approach speeds and samples."""
    columns = (
        Column("configuration", wraps=_NAME),
        Column("setting"),
        Column("event times (s)", number=True),
        Column("approach speeds", number=True, spare=1),
        Column("samples", number=True),
        Column("events", number=True, spare=2),
    )
    rows = (
        (
            point.configuration,
            f"{point.parameter} {point.setting:.3g}",
            _above_rounding(point.events.time),
            _above_rounding(point.events.approach),
            f"{point.error:.1e}",
            f"{point.events.matched} of {point.events.all}",
        )
        for point in study.points
        if point.events is not None
    )
    return table("Errors across events", columns, rows)


def drifts_table(drifts: Iterable[Drift]) -> Table:
    """Return the growth of each method's energy error."""
    columns = (
        Column("method", wraps=_NAME),
        Column("kind", spare=2),
        Column("order", number=True, spare=1),
        Column("step", number=True, spare=3),
        Column("expected power", number=True),
        Column("measured power", number=True),
        Column("error at the end", number=True),
        Column("time", number=True, spare=4),
    )
    rows = []
    for drift in drifts:
        method, found = drift.method, drift.growth
        tone = Tone.PLAIN if drift.as_expected else Tone.WARN
        texts = (
            method.name,
            method.family,
            str(method.order),
            f"{drift.step:.2g} s" if drift.step > 0 else "",
            f"{method.expected:g}",
            "" if found is None else f"{found.rounded} ± {found.uncertainty:.2f}",
            f"{drift.errors[-1]:.1e}" if len(drift.errors) else "",
            f"{drift.seconds:.1f} s",
        )
        rows.append(tuple(Cell(text, tone) for text in texts))
    return table("Energy error as a power of time", columns, rows)


def time_in_words(seconds: float, repeatable: bool = True) -> str:
    """Return a time in a suitable unit, marked ± if it is not reproducible."""
    mark = "" if repeatable else " ±"
    if seconds < 1e-3:
        return f"{seconds * 1e6:.0f} µs{mark}"
    return f"{seconds * 1e3:.3g} ms{mark}" if seconds < 1 else f"{seconds:.3g} s{mark}"


def _above_rounding(error: float) -> str:
    """Return an error of logged float64 numbers, which cannot show a smaller one."""
    return f"{error:.1e}" if error > 0 else "< 1e-16"
