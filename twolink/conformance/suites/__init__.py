"""The suites of the kit: each a function that returns its groups."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cache

from twolink.conformance.suites.evaluation import evaluation_suite
from twolink.conformance.suites.imports import import_suite
from twolink.conformance.suites.motion import friction_suite, impact_suite, motion_suite
from twolink.conformance.vectors import Group
from twolink.errors import ParameterError
from twolink.hardcases import Case
from twolink.text import choice

_SUITES: dict[str, Callable[[], tuple[Group, ...]]] = {
    "import": import_suite,
    "evaluation": evaluation_suite,
    "motion": motion_suite,
    "friction": friction_suite,
    "impact": impact_suite,
}

SUITES = tuple(_SUITES)

HARD_CASES = "hardcases"
"""The suite of the hard cases, which runs only if it is named: some cases take minutes."""

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


def with_cases(names: Iterable[str] | None) -> dict[str, tuple[Group | Case, ...]]:
    """Return the named suites, of which `HARD_CASES` has cases, or all suites of groups."""
    from twolink.hardcases.catalogue import CASES

    wanted = SUITES if names is None else dict.fromkeys(names)
    unknown = next((name for name in wanted if name not in (*SUITES, HARD_CASES)), None)
    if unknown is not None:
        raise ParameterError(choice("suite", unknown, (*SUITES, HARD_CASES)))
    return {name: CASES if name == HARD_CASES else suite(name) for name in wanted}
