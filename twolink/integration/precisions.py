"""The precisions of Taylor series, in one registry.

Scenes are simulated in the shortest precision that suffices, and judged in a longer one. A new
precision is an entry in `PRECISIONS`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from twolink.optional import heyoka

PrecisionName = Literal["double", "long double", "quadruple"]


@dataclass(frozen=True)
class Code:
    """The compilation of an integrator: as loops or unrolled, and LLVM's level of optimization.

    A run of more `steps` is worth the compilation of faster code.
    """

    compact: bool
    level: int
    steps: float = math.inf


OPTIMISED = Code(compact=False, level=3)
"""The fastest code, for long runs: its compilation takes half a second."""


@dataclass(frozen=True)
class Precision:
    """Numbers of one length, and the orders of Taylor series in them.

    `rounding` is the distance from 1 to the next number, and `type_of_numbers` returns their type.
    At the order `full_order` the truncation error is at round-off, and at `truncated_order` some
    fifty times as large. Orders are odd: from q = 0 at rest only every fourth coefficient of a
    series in t is non-zero, and an order that ends on two zero ones, a multiple of four, would give
    an unbounded step.

    Between two checks of signals and progress an integrator takes `steps_at_once`, which last a few
    tenths of a second. Its `codes` are those of ever longer runs, which take longer to compile.
    Optimising takes a quarter of a second, which `steps_worth_optimising` steps regain.
    """

    rounding: float
    full_order: int
    truncated_order: int
    steps_at_once: int
    type_of_numbers: Callable[[], Any]
    codes: tuple[Code, ...]
    steps_worth_optimising: float

    @property
    def number(self) -> Any:
        """The type of the numbers, of NumPy or of heyoka."""
        return self.type_of_numbers()

    def array(self, values: Any) -> Any:
        """Return an array of numbers of this precision."""
        kind = self.number
        if kind in (float, np.longdouble):
            return np.asarray(values, dtype=kind)
        return np.array([kind(value) for value in values])

    def lengthened(self, values: Any) -> Any:
        """Return an array of numbers of this or a shorter precision in numbers of this one."""
        kind = np.dtype(self.number)
        if values.dtype == kind:
            return values
        if kind == np.longdouble or values.dtype == np.float64:
            return values.astype(kind)
        # NumPy does not convert long doubles to heyoka's quadruple numbers.
        first = values.astype(float)
        return first.astype(kind) + (values - first).astype(float).astype(kind)

    def mixable(self, values: Any) -> Any:
        """Return an array of numbers of this precision in NumPy's numbers, rounded if longer.

        They are float64 or long double, arrays of which mix with float64 numbers in all arithmetic.
        """
        if self.number is float or values.dtype == np.longdouble:
            return values
        # NumPy does not convert heyoka's quadruple numbers to long double.
        first = values.astype(float)
        rest = (values - first.astype(values.dtype)).astype(float)
        return first.astype(np.longdouble) + rest.astype(np.longdouble)

    def step_tolerance(self, order: int | None = None) -> float:
        """Return the step tolerance for which heyoka selects an order, by default the full order.

        heyoka takes the smallest order p with exp(−2 (p − 1)) below the tolerance (Jorba and Zou, A
        software package for the numerical integration of ODEs by means of high-order Taylor
        methods, 2005, section 3.2).
        """
        return math.exp(-2 * ((order or self.full_order) - 1) + 0.4)


def _real128() -> Any:
    return heyoka().real128


# In double precision, unrolled code compiles ten times faster without optimization, and takes up
# to three times as long. Long doubles take twice as long in loops without optimization, and these
# compile in a fifth of the time: 30 ms in place of 200. Quadruple precision uses library calls:
# loops of them compile fifty times faster, run a twentieth longer, and do not benefit from
# optimization. A run that takes too many steps begins anew with faster code, so its steps are as
# many as take the time of that compilation.
_IN_DOUBLE = Code(compact=False, level=0, steps=80_000), OPTIMISED
_IN_LONG_DOUBLE = (
    Code(compact=True, level=0, steps=8_000),
    Code(compact=True, level=1, steps=80_000),
    OPTIMISED,
)

PRECISIONS: dict[PrecisionName, Precision] = {
    "double": Precision(2.0**-52, 21, 15, 20_000, lambda: float, _IN_DOUBLE, 15_000),
    "long double": Precision(
        2.0**-63, 23, 19, 8_000, lambda: np.longdouble, _IN_LONG_DOUBLE, 4_000
    ),
    "quadruple": Precision(
        2.0**-112, 41, 33, 128, _real128, (Code(compact=True, level=0),), math.inf
    ),
}
"""The precisions by their names, from the shortest."""


def longer_than(precision: PrecisionName) -> PrecisionName:
    """Return the next longer precision; raises `IndexError` for the longest."""
    names = list(PRECISIONS)
    return names[names.index(precision) + 1]
