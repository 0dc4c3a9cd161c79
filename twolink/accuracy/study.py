"""The cost of accuracy in a scene: measured points, recommendation and round-off floor."""

from __future__ import annotations

import csv
import io
import math
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, fields
from itertools import groupby
from typing import Any

from twolink.accuracy.engine_configurations import engine_configurations
from twolink.accuracy.method_configurations import chosen, own_configurations
from twolink.accuracy.pareto import (
    Choice,
    by_configuration,
    choices,
    measured_order,
    operations_at,
    pareto_front,
    seconds_at,
)
from twolink.accuracy.roundoff_floor import RoundoffFloor, roundoff_floor
from twolink.accuracy.work_precision import RESOLVED, Point, WorkPrecision, work_precision
from twolink.environment import package_versions, this_machine
from twolink.inputs import as_flag, as_positive, as_words
from twolink.integration.operations import Extent
from twolink.limits import DEFAULT_LIMITS, Limits
from twolink.scene import Scene
from twolink.simulation.motion import check_run
from twolink.text import rounded

# The error (rad, rad/s) at which configurations are compared.
COMPARED_AT = 1e-8


@dataclass(frozen=True)
class Work:
    """The floating-point operations of a configuration at an error, exact or a bound of them.

    The error is `COMPARED_AT`, or the least one if that is larger. `ratio` is the number of
    operations over the fewest of all configurations at this error.
    """

    error: float
    operations: float
    extent: Extent
    ratio: float

    def __str__(self) -> str:
        """Return the operations in words."""
        bound = "" if self.extent is Extent.COUNTED else f"{self.extent} "
        return f"{bound}{self.operations:.2g}"


@dataclass(frozen=True)
class ConfigurationSummary:
    """One configuration in a line: best error, declared and measured order, time, operations.

    `seconds` is the time at `COMPARED_AT`, None if the error is not reached, or is reached at one
    setting and not at the next finer one; `ratio` is that time over the shortest of all
    configurations. `work` has its floating-point operations. `failures` counts the failed settings.
    `stopped` states whether the time budget ended before the finest setting.
    """

    configuration: str
    engine: str
    best: float
    declared: int | None
    measured: float | None
    seconds: float | None
    ratio: float | None
    failures: int
    repeatable: bool
    stopped: bool = False
    work: Work | None = None

    @property
    def why_no_time(self) -> str:
        """The reason why there is no time at `COMPARED_AT`, in a word or two."""
        if self.best <= COMPARED_AT:
            return "by chance"
        return "budget ended" if self.stopped else "not reached"


@dataclass(frozen=True)
class Study:
    """The cost of accuracy in a scene."""

    work_precision: WorkPrecision
    roundoff_floor: RoundoffFloor

    @property
    def points(self) -> tuple[Point, ...]:
        """Every configuration at every setting."""
        return self.work_precision.points

    @property
    def choices(self) -> tuple[Choice, ...]:
        """The cheapest configuration for each number of digits."""
        return choices(self.points)

    @property
    def pareto_front(self) -> tuple[Point, ...]:
        """The Pareto-optimal points in error and time."""
        return pareto_front(self.points)

    @property
    def configurations(self) -> tuple[ConfigurationSummary, ...]:
        """A line for each configuration, the quickest at `COMPARED_AT` first."""
        grouped = by_configuration(self.points)
        times = {name: seconds_at(points, COMPARED_AT) for name, points in grouped.items()}
        least = min((seconds for seconds in times.values() if seconds), default=None)
        stopped = {stop.configuration for stop in self.work_precision.stopped}
        lines = [
            ConfigurationSummary(
                configuration=name,
                engine=points[0].engine,
                best=min((p.error for p in points if not p.failed), default=float("nan")),
                declared=points[0].order,
                measured=measured_order(points, roundoff_floor=self.roundoff_floor.error),
                seconds=times[name],
                ratio=_ratio(times[name], least),
                failures=sum(bool(p.failed) for p in points),
                repeatable=all(p.repeatable for p in points if not p.failed),
                stopped=name in stopped,
                work=_work(points, grouped.values()),
            )
            for name, points in grouped.items()
        ]
        return tuple(sorted(lines, key=lambda line: (line.seconds or float("inf"), line.best)))

    @property
    def recommendation(self) -> str:
        """The recommended configurations by number of digits, in a sentence."""
        if not self.choices:
            return "No configuration that was tried has one correct digit."
        parts = []
        for _, group in groupby(self.choices, key=lambda choice: _kind(choice.point)):
            own = list(group)
            # If several formulations alternate, the one that is cheapest most often.
            configuration, _ = Counter(choice.point.configuration for choice in own).most_common(1)[
                0
            ]
            parts.append(f"{configuration} up to {own[-1].digits} digits")
        return f"Recommended: {'; '.join(parts)}."

    @property
    def waste(self) -> str:
        """The operations of the most frugal and of the most wasteful configurations, in words."""
        lines = [(line.configuration, line.work) for line in self.configurations if line.work]
        words = []
        reached = [line for line in lines if line[1].error == COMPARED_AT]
        if reached:
            name, work = min(reached, key=lambda line: (line[1].ratio < 1, line[1].operations))
            a_digit = work.operations / -math.log10(COMPARED_AT)
            words.append(
                f"At an error of {COMPARED_AT:g} {name} takes the fewest floating-point operations,"
                f" {work}, or {a_digit:.2g} a digit."
            )
        for kind, up_to, estimated in (("counted", "", False), ("estimated", "up to ", True)):
            group = [line for line in lines if (line[1].extent is Extent.AT_MOST) is estimated]
            wasteful = [line for line in group if line[1].ratio > 1]
            if wasteful:
                name, work = max(wasteful, key=lambda line: line[1].ratio)
                words.append(
                    f"Of those {kind} {name} is the most wasteful: {work} at an error of "
                    f"{_short(work.error)}, {up_to}{rounded(work.ratio)} times as many as are "
                    "needed."
                )
        return " ".join(words)

    def document(self) -> dict[str, Any]:
        """Return the study as JSON-compatible data."""
        return {
            "scene": self.work_precision.scene.title,
            "duration_s": self.work_precision.scene.duration,
            "judged_at": self.work_precision.judged_at,
            "judged_by": self.work_precision.reference.source,
            "machine": this_machine(),
            "load": None if self.work_precision.load is None else asdict(self.work_precision.load),
            "peak_operations_a_second": self.work_precision.peak,
            "versions": package_versions("heyoka", "numpy", "scipy"),
            "recommendation": self.recommendation,
            "choices": [
                {
                    "digits": choice.digits,
                    "configuration": choice.point.configuration,
                    choice.point.parameter: choice.point.setting,
                    "seconds": choice.point.seconds,
                    "next_digit_takes_times": choice.next_digit,
                }
                for choice in self.choices
            ],
            "float64": {
                "error_at_the_end": self.roundoff_floor.error,
                "digits_lost_in_a_second": self.roundoff_floor.growth,
                "held_until_s": {
                    str(digits): _held(self.roundoff_floor, digits) for digits in range(3, 16, 3)
                },
            },
            "configurations": [asdict(line) for line in self.configurations],
            "points": [asdict(point) for point in self.points],
            "left_out": list(self.work_precision.left_out),
            "stopped": [asdict(stop) for stop in self.work_precision.stopped],
        }

    def csv(self) -> str:
        """Return the points as comma-separated values, one line per point."""
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


def _short(error: float) -> str:
    """Return an error to two digits, or to one where the second is zero."""
    return f"{error:.1e}".replace(".0e", "e")


def _ratio(seconds: float | None, least: float | None) -> float | None:
    return None if seconds is None or least is None else seconds / least


def _work(points: tuple[Point, ...], others: Iterable[tuple[Point, ...]]) -> Work | None:
    """Return the operations of a configuration, compared with all; None if it is too coarse."""
    usable = [point for point in points if not point.failed]
    best = min(usable, key=lambda point: point.error, default=None)
    if best is None or best.arithmetic is None or best.error >= RESOLVED:
        return None
    error, operations = COMPARED_AT, operations_at(points, COMPARED_AT)
    if operations is None:
        error, operations = best.error, best.arithmetic
    rivals = [(operations, best.extent), *((operations_at(p, error), _extent(p)) for p in others)]
    known = [(number, extent) for number, extent in rivals if number is not None]
    # That some operations were not counted does not make them few.
    firm = [number for number, extent in known if extent is not Extent.AT_LEAST]
    fewest = min(firm or [number for number, _ in known])
    return Work(error, operations, best.extent, operations / fewest)


def _extent(points: Iterable[Point]) -> Extent:
    """Return whether the operations of a configuration are exact; they are for all points alike."""
    return next((point.extent for point in points if not point.failed), Extent.COUNTED)


def _held(floor: RoundoffFloor, digits: int) -> dict[str, Any]:
    seconds, measured = floor.held_until(digits)
    return {"seconds": seconds, "measured": measured}


def study(
    scene: Scene,
    *,
    methods: tuple[str, ...] = (),
    engines: bool = False,
    budget: float = 20.0,
    progress: Callable[[str, float], None] | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> Study:
    """Measure the cost of accuracy in a scene with the named methods (default: all).

    `engines` includes external engines; those that are missing or do not support the scene are in
    `WorkPrecision.left_out` with the reason. `budget` (s) is the time for the measured runs.
    Raises `SimulationError` for a method that the scene does not support, and `TooMuchError` if the
    budget or the reference run would exceed the `limits`; other runs that would are left out.
    """
    check_run(scene, progress, limits)
    methods, budget = as_words("methods", methods), as_positive("budget", budget)
    engines = as_flag("engines", engines)
    limits.check_time("a measurement with this budget", budget)
    configurations = own_configurations(scene, limits)
    left_out: tuple[str, ...] = ()
    if engines:
        theirs, left_out = engine_configurations(scene)
        configurations = (*configurations, *theirs)
    measured = work_precision(
        scene,
        chosen(configurations, methods),
        budget=budget,
        left_out=left_out,
        progress=progress,
        limits=limits,
    )
    return Study(measured, roundoff_floor(scene, limits=limits))
