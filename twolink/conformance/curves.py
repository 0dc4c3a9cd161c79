"""Errors of motions against steps and tolerances: a panel for each scene and kind of setting."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from twolink.conformance.convergence import Curve
from twolink.conformance.results import MOTION, TestResult


@dataclass(frozen=True)
class MethodCurve:
    """The curve of one method of an engine; both are numbered from 0, the same in all scenes."""

    engine: str
    method: str
    number: int
    method_number: int
    curve: Curve

    @property
    def name(self) -> str:
        """Engine and method."""
        return f"{self.engine}, {self.method}"


def scene_of(result: TestResult) -> str:
    """Return the name of the scene of a test's group."""
    return result.id.split("/")[1]


def curves_by_scene(
    engines: Iterable[tuple[str, Sequence[TestResult]]],
) -> Mapping[str, tuple[MethodCurve, ...]]:
    """Return the curves of engines, given by name with their results, by scene."""
    found: dict[str, list[MethodCurve]] = {}
    number = 0
    for engine, results in engines:
        methods: dict[str, int] = {}
        for result in results:
            if result.curve is not None:
                method = result.quantity.removeprefix(MOTION)
                place = methods.setdefault(method, len(methods))
                curve = MethodCurve(engine, method, number, place, result.curve)
                found.setdefault(scene_of(result), []).append(curve)
        # Only engines that are drawn take one of the few colours.
        number += bool(methods)
    return {scene: tuple(curves) for scene, curves in found.items()}


def by_parameter(curves: Iterable[MethodCurve]) -> Mapping[str, tuple[MethodCurve, ...]]:
    """Return the curves against steps and those against tolerances, as far as there are any."""
    found: dict[str, list[MethodCurve]] = {"step": [], "tolerance": []}
    for each in curves:
        found[each.curve.parameter].append(each)
    return {parameter: tuple(own) for parameter, own in found.items() if own}
