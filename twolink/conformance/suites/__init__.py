"""The suites of the kit: each a function that returns its groups."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cache

from twolink.conformance.suites.evaluation import evaluation_suite
from twolink.conformance.suites.imports import import_suite
from twolink.conformance.suites.motion import friction_suite, impact_suite, motion_suite
from twolink.conformance.vectors import Group
from twolink.engines.quantities import QUANTITIES
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

VERIFY = "verify"
"""The suite that compares with the formulations at random states; it runs only if it is named."""

Item = Group | Case | str
"""A member of a suite: a group of vectors, a hard case, or a quantity at random states."""

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


def items(names: Iterable[str] | None) -> dict[str, tuple[Item, ...]]:
    """Return the items of the named suites, or all suites of groups.

    Raises `ParameterError` for an unknown name.
    """
    from twolink.hardcases.catalogue import CASES

    others: dict[str, tuple[Item, ...]] = {HARD_CASES: CASES, VERIFY: tuple(QUANTITIES)}
    wanted = SUITES if names is None else tuple(dict.fromkeys(names))
    for name in wanted:
        if name not in (*SUITES, *others):
            raise ParameterError(choice("suite", name, (*SUITES, *others)))
    return {name: others[name] if name in others else suite(name) for name in wanted}


def tests_of(suite: str, item: Item) -> tuple[str, ...]:
    """Return the ids of an item's tests, or their begin before a method or a formulation."""
    if isinstance(item, Group):
        tests = (each.id for each in item.tests)
        return (f"{item.id}/read", *tests, *(each.id for each in item.motions))
    return (f"{suite}/{item.name if isinstance(item, Case) else item.replace('_', '-')}",)
