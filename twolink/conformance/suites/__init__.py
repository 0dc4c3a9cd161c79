"""The suites of the kit: each a function that returns its groups."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cache

from twolink.conformance.suites.evaluation import evaluation_suite
from twolink.conformance.suites.imports import import_suite
from twolink.conformance.suites.motion import friction_suite, impact_suite, motion_suite
from twolink.conformance.vectors import Group
from twolink.errors import ParameterError
from twolink.text import choice

_SUITES: dict[str, Callable[[], tuple[Group, ...]]] = {
    "import": import_suite,
    "evaluation": evaluation_suite,
    "motion": motion_suite,
    "friction": friction_suite,
    "impact": impact_suite,
}

SUITES = tuple(_SUITES)

ABOUT = {
    "import": "URDF files of planar two-link chains: one feature or fault each.",
    "evaluation": "Quantities of chains given by parameters or by a plain URDF.",
    "motion": "Smooth motions from a state, by every method of an engine.",
    "friction": "Motions with dry friction in the joints or on a floor, and with joint stops.",
    "impact": "Motions with impacts on a floor, without and with friction.",
}


@cache
def suite(name: str) -> tuple[Group, ...]:
    """Return the groups of a suite. Raises `ParameterError` for an unknown name."""
    if name not in _SUITES:
        raise ParameterError(choice("suite", name, SUITES))
    return _SUITES[name]()


def chosen(names: Iterable[str] | None) -> dict[str, tuple[Group, ...]]:
    """Return the groups of the named suites, or of all."""
    return {name: suite(name) for name in (SUITES if names is None else dict.fromkeys(names))}
