"""The catalogue of all hard cases, by group."""

from __future__ import annotations

from twolink.errors import ParameterError
from twolink.hardcases import contact, evaluation, friction, smooth
from twolink.hardcases import input as input_cases
from twolink.hardcases.record import Case
from twolink.text import choice

CASES: tuple[Case, ...] = (
    *evaluation.CASES,
    *smooth.CASES,
    *friction.CASES,
    *contact.CASES,
    *input_cases.CASES,
)


def case_named(name: str) -> Case:
    """Return a case by name. Raises `ParameterError` with similar names, or all of them."""
    for case in CASES:
        if case.name == name:
            return case
    alike = [case.name for case in CASES if name and (name in case.name or case.name in name)]
    raise ParameterError(choice("case", name, alike or [case.name for case in CASES]))


def explained(case: Case) -> str:
    """Return a case as a page of Markdown: difficulty, expected outcome, reference, bound."""
    return (
        f"# {case.name}\n\n"
        f"Group: {case.group}.\n\n"
        f"**Difficulty.** {_sentence(case.hard)}\n\n"
        f"**Expected.** {_sentence(case.expected)}\n\n"
        f"**Reference.** {_sentence(case.reference)}\n\n"
        f"**Bound.** {_sentence(case.bound)}\n"
    )


def _sentence(text: str) -> str:
    return text[0].upper() + text[1:] + "."
