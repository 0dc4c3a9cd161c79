"""Floating-point operations of formulas, of Taylor steps and of Runge–Kutta steps.

An addition, subtraction, multiplication, division or square root is one operation, in numbers of
any length, also where a processor fuses two of them. A change of sign, a magnitude, a comparison
and a copy are none. Other functions count as what they cost in double precision in fdlibm (Sun
Microsystems, 1993), at an argument of some size: a sine takes 8 operations to reduce the angle and
18 for its polynomial, and a cosine as many up to 0.3 rad and two more beyond.

A Taylor step of order p has p coefficients of each element of the decomposition of the equations
(Jorba and Zou 2005, section 2), by the recurrences of heyoka's unrolled code. With sums over
j = 0 … n for the coefficient n:

    a product, a quotient of two series   p²: p (p + 1)/2 multiplications or divisions, and
                                          p (p - 1)/2 additions or subtractions
    a square, written as a power          half of the multiplications
    a sine, a cosine, an exponential      1.5 p (p - 1): terms have a factor j
    a sum or a difference of k series     (k - 1) p
    a product with a number               p

Then each variable takes p divisions for its coefficients, and p multiplications and p additions at
the end of the step (one with a constant rate p + 1 in all); the length of the step takes two
powers, two products and two quotients.

Not counted are the evaluation of a motion at requested times, and the search for events.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from twolink.integration.tableaus import Tableau

_FUNCTIONS = {"sin": 26, "cos": 26, "exp": 23, "pow": 88}

# The number of variables: two angles, and two speeds or momenta.
_VARIABLES = 4

# The time at the start of a step of fixed length: a product and a sum.
_START = 2

# Exponents of magnitudes up to this, and halves of them, are products and square roots in heyoka.
_LARGEST_EXPONENT = 16

_SERIES = re.compile(r"u_\d+")
_CALL = re.compile(r"(\w+)\((.*)\)")
# A series, the time, a parameter or a number, or its negative: no operation.
_AT_HAND = re.compile(r"-?(u_\d+|t|p\d+|\d+(\.\d*)?(e[+-]?\d+)?)")


class Extent(StrEnum):
    """Whether a number of operations is exact, or a bound."""

    COUNTED = "counted"
    AT_LEAST = "at least"
    AT_MOST = "at most"

    @property
    def mark(self) -> str:
        """The sign before a number in tables."""
        return {Extent.COUNTED: "", Extent.AT_LEAST: "≥ ", Extent.AT_MOST: "≤ "}[self]


@dataclass(frozen=True)
class Operations:
    """A number of floating-point operations, and whether it is exact."""

    number: float
    extent: Extent = Extent.COUNTED

    def times(self, count: int) -> Operations:
        """Return the operations of this many steps."""
        return Operations(count * self.number, self.extent)


Beside = Callable[[int, int], int]
"""The operations of a method beside the rates, from the numbers of steps and evaluations."""


def of_formula(counts: Mapping[str, int]) -> int:
    """Return the operations of a compiled formula, from `Compiled.operations`."""
    return sum(_FUNCTIONS.get(symbol, 1) * count for symbol, count in counts.items())


def of_taylor_step(integrator: Any) -> Operations:
    """Return the operations of a step of one of heyoka's integrators.

    An element of unknown cost makes it a lower bound.
    """
    order, variables = integrator.order, integrator.dim
    texts = [str(expression) for expression, _ in integrator.decomposition]
    found = [_of_element(text, order) for text in texts[variables:-variables]]
    ends = [3 * order if _SERIES.fullmatch(text) else order + 1 for text in texts[-variables:]]
    number = sum(each for each in found if each is not None) + sum(ends)
    extent = Extent.AT_LEAST if None in found else Extent.COUNTED
    return Operations(number + 2 * _FUNCTIONS["pow"] + 4, extent)


def of_rates(evaluations: int, formula: int, beside: int | None) -> Operations:
    """Return the operations of a run; a lower bound, if those beside the rates are not known."""
    extent = Extent.AT_LEAST if beside is None else Extent.COUNTED
    return Operations(evaluations * formula + (beside or 0), extent)


def total(parts: Iterable[Operations], extent: Extent = Extent.COUNTED) -> Operations:
    """Return the operations of all parts of a run; a lower bound, if those of a part are one."""
    given = tuple(parts)
    extents = {extent, *(part.extent for part in given)}
    exact = extents == {Extent.COUNTED}
    number = sum(part.number for part in given)
    return Operations(number, Extent.COUNTED if exact else Extent.AT_LEAST)


def explicit(tableau: Tableau) -> Beside:
    """Return the operations of an explicit Runge–Kutta method, without products by zero."""
    stages = len(tableau.b)
    moves = sum(a != 0 for row in tableau.A for a in row)
    # h a, then its product with a slope, and a sum; the time of each stage; then the weighted
    # slopes, their product with h, and a sum.
    each = moves * (1 + 2 * _VARIABLES) + 2 * stages + _VARIABLES * (2 * stages + 1) + _START
    return lambda steps, evaluations: steps * each


def implicit(tableau: Tableau) -> Beside:
    """Return the operations of an implicit Runge–Kutta method, with its fixed-point iterations."""
    stages = len(tableau.b)
    # h A, its product with the slopes, the states of the stages, their times, and the changes.
    combined = stages * _VARIABLES * (2 * stages - 1)
    iteration = stages * stages + combined + 2 * stages * _VARIABLES + 2 * stages
    each = _START + stages + _VARIABLES * 2 * stages
    # A step takes one evaluation for its guess, and each iteration one for each stage.
    return lambda steps, evaluations: steps * each + (evaluations - steps) // stages * iteration


def semi_implicit_euler(steps: int, evaluations: int) -> int:
    """Return the operations of the semi-implicit Euler method: its guesses and iterations."""
    return steps * (_START + 2 * _VARIABLES) + (evaluations - steps) * 3 * _VARIABLES


def embedded(stages: int, estimate: int) -> Beside:
    """Return the operations of SciPy's explicit methods, with products by zero, as it has them.

    `estimate` has those of the error of an attempt. Each attempt takes `stages` evaluations, and
    the choice of the first step two.
    """
    moves = _VARIABLES * (stages**2 - 1) + 2 * (stages - 1)
    # The new state, the times and the scale of errors; then the next step by a power of the error.
    each = moves + _VARIABLES * (2 * stages + 1) + 1 + 2 * _VARIABLES
    control = 7 + _FUNCTIONS["pow"]
    return lambda steps, evaluations: (evaluations - 2) // stages * (each + estimate + control)


def estimate_of_one(stages: int) -> int:
    """Return the operations of an estimate by one embedded method, and of its norm."""
    return _VARIABLES * (2 * stages + 3) + 2 * _VARIABLES + 1


def estimate_of_two(stages: int) -> int:
    """Return the operations of an estimate by two embedded methods, and of their norms."""
    return 2 * (_VARIABLES * (2 * stages + 2) + 2 * _VARIABLES + 1) + 6


def _of_element(text: str, order: int) -> int | None:
    """Return the operations of an element of a decomposition, or None for an unknown one."""
    power = text.partition("**")
    call = _CALL.fullmatch(text)
    if power[1]:
        return _of_power(float(power[2]), order)
    if call is not None:
        return _of_function(call[1], call[2].split(", "), order)
    if text.startswith("("):
        return _of_sum_or_product(text[1:-1], order)
    return 0 if _AT_HAND.fullmatch(text) else None


def _of_sum_or_product(text: str, order: int) -> int | None:
    series = len(_SERIES.findall(text))
    if " * " not in text:
        return len(re.findall(r" [+-] ", text)) * (order if series else 1)
    return {2: order**2, 1: order, 0: 1}.get(series)


def _of_function(name: str, operands: list[str], order: int) -> int | None:
    series = [bool(_SERIES.fullmatch(operand)) for operand in operands]
    if name == "sub":
        return order if all(series) else 1
    if name == "div" and series[1]:
        return order**2 if series[0] else order + (order - 1) ** 2
    if name == "div":
        return order
    function = _FUNCTIONS.get(name.removeprefix("combined_"))
    return None if function is None else function + 3 * order * (order - 1) // 2


def _of_power(exponent: float, order: int) -> int:
    """Return the operations of a power of a series: of a square, a square root, or any other."""
    indices = range(1, order)
    if exponent == 2:
        return 1 + sum((n + 1) // 2 + (n + 1) // 2 + 2 * (n % 2 == 0) for n in indices)
    if exponent == 0.5:
        # Twice the first coefficient, the difference from the terms, and a quotient.
        terms = [((n - 1) // 2, n % 2 == 0) for n in indices]
        return 1 + sum(2 + 2 * count + (count > 0) + 2 * even for count, even in terms)
    return _of_first_power(exponent) + sum(2 * n + 1 + (n - 1) + 1 for n in indices)


def _of_first_power(exponent: float) -> int:
    """Return the operations of a power of a number: products, a square root, a quotient."""
    inverse = exponent < 0
    for root in (0, 1):
        whole = abs(exponent) * (1 + root)
        if whole == int(whole) <= _LARGEST_EXPONENT:
            bits = f"{int(whole):b}"
            return len(bits) - 1 + bits[1:].count("1") + root + inverse
    return _FUNCTIONS["pow"]
