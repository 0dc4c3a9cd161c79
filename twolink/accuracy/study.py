"""What accuracy costs in a scene, as one answer: points, what to take, where float64 ends."""

from __future__ import annotations

import csv
import io
from collections import Counter
from collections.abc import Callable
from dataclasses import asdict, dataclass, fields
from itertools import groupby
from typing import Any

from twolink.accuracy.floor import Floor, floor
from twolink.accuracy.front import (
    Choice,
    choices,
    measured_order,
    pareto_front,
    seconds_at,
    ways_of,
)
from twolink.accuracy.peer_ways import peer_ways
from twolink.accuracy.ways import chosen, own_ways
from twolink.accuracy.work_precision import Point, WorkPrecision, work_precision
from twolink.provenance import package_versions, this_machine
from twolink.scene import Scene

# The error (rad, rad/s) at which ways are compared.
COMPARED_AT = 1e-8


@dataclass(frozen=True)
class WaySummary:
    """One way in a line: its best error, its order as declared and measured, its time.

    `seconds` is the time at `COMPARED_AT`, None where it never errs so little, or does at one
    setting and not at the next finer one; `ratio` that time over the least of all ways. `failures`
    counts its settings that failed.
    """

    way: str
    engine: str
    best: float
    declared: int | None
    measured: float | None
    seconds: float | None
    ratio: float | None
    failures: int
    repeatable: bool

    @property
    def why_no_time(self) -> str:
        """Why there is no time at `COMPARED_AT`, in a word or two."""
        return "by chance" if self.best <= COMPARED_AT else "never"


@dataclass(frozen=True)
class Study:
    """What accuracy costs in a scene."""

    work_precision: WorkPrecision
    floor: Floor

    @property
    def points(self) -> tuple[Point, ...]:
        """Every way at every setting."""
        return self.work_precision.points

    @property
    def choices(self) -> tuple[Choice, ...]:
        """The cheapest way to each number of digits."""
        return choices(self.points)

    @property
    def front(self) -> tuple[Point, ...]:
        """The points that no other beats in both error and time."""
        return pareto_front(self.points)

    @property
    def ways(self) -> tuple[WaySummary, ...]:
        """A line for each way, the quickest at `COMPARED_AT` first."""
        grouped = ways_of(self.points)
        times = {name: seconds_at(points, COMPARED_AT) for name, points in grouped.items()}
        least = min((seconds for seconds in times.values() if seconds), default=None)
        lines = [
            WaySummary(
                way=name,
                engine=points[0].engine,
                best=min((p.error for p in points if not p.failed), default=float("nan")),
                declared=points[0].order,
                measured=measured_order(points, floor=self.floor.error),
                seconds=times[name],
                ratio=_ratio(times[name], least),
                failures=sum(bool(p.failed) for p in points),
                repeatable=all(p.repeatable for p in points if not p.failed),
            )
            for name, points in grouped.items()
        ]
        return tuple(sorted(lines, key=lambda line: (line.seconds or float("inf"), line.best)))

    @property
    def recommendation(self) -> str:
        """Which way to take for how many digits, in a sentence."""
        if not self.choices:
            return "No way that was tried gives a single digit."
        parts = []
        for _, group in groupby(self.choices, key=lambda choice: _kind(choice.point)):
            own = list(group)
            # Where several sets of equations take turns, the one that is the cheapest most often.
            way, _ = Counter(choice.point.way for choice in own).most_common(1)[0]
            parts.append(f"{way} up to {own[-1].digits} digits")
        return f"Take {'; '.join(parts)}."

    def document(self) -> dict[str, Any]:
        """Return all of it as plain data, for other programs."""
        return {
            "scene": self.work_precision.scene.title,
            "duration_s": self.work_precision.scene.duration,
            "judged_at": self.work_precision.judged_at,
            "judged_by": self.work_precision.truth.source,
            "machine": this_machine(),
            "versions": package_versions("heyoka", "numpy", "scipy"),
            "recommendation": self.recommendation,
            "choices": [
                {
                    "digits": choice.digits,
                    "way": choice.point.way,
                    choice.point.knob: choice.point.setting,
                    "seconds": choice.point.seconds,
                    "next_digit_takes_times": choice.next_digit,
                }
                for choice in self.choices
            ],
            "float64": {
                "error_at_the_end": self.floor.error,
                "digits_lost_in_a_second": self.floor.growth,
                "held_until_s": {
                    str(digits): _held(self.floor, digits) for digits in range(3, 16, 3)
                },
            },
            "ways": [asdict(line) for line in self.ways],
            "points": [asdict(point) for point in self.points],
            "left_out": list(self.work_precision.left_out),
        }

    def csv(self) -> str:
        """Return the points as comma-separated values, a line each."""
        names = [field.name for field in fields(Point) if field.name not in ("events", "warnings")]
        parts = ("event_time_error", "approach_speed_error")
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow([*names, *parts])
        for point in self.points:
            apart = point.events
            errors = (apart.time, apart.approach) if apart else ("", "")
            writer.writerow([*(getattr(point, name) for name in names), *errors])
        return text.getvalue()


def _kind(point: Point) -> tuple[str, str, str]:
    return point.engine, point.method, point.precision


def _ratio(seconds: float | None, least: float | None) -> float | None:
    return None if seconds is None or least is None else seconds / least


def _held(floor: Floor, digits: int) -> dict[str, Any]:
    seconds, measured = floor.held_until(digits)
    return {"seconds": seconds, "measured": measured}


def study(
    scene: Scene,
    *,
    methods: tuple[str, ...] = (),
    peers: bool = False,
    budget: float = 20.0,
    progress: Callable[[str, float], None] | None = None,
) -> Study:
    """Return what accuracy costs in a scene, by the named methods (all, if none is named).

    `peers` asks for other engines too; those that are missing or cannot express the scene are in
    `WorkPrecision.left_out` with the reason. `budget` (s) is for the runs that are measured.
    Raises `SimulationError` for a method that the scene does not allow.
    """
    ways = own_ways(scene)
    left_out: tuple[str, ...] = ()
    if peers:
        theirs, left_out = peer_ways(scene)
        ways = (*ways, *theirs)
    measured = work_precision(
        scene, chosen(ways, methods), budget=budget, left_out=left_out, progress=progress
    )
    return Study(measured, floor(scene))
