"""The coefficients of Runge–Kutta methods."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Tableau:
    """A Runge–Kutta method of s stages: k_i = f(x + h Σ A_ij k_j), and then x + h Σ b_i k_i.

    `A` has shape (s, s) and `b` (s,). Its nodes are the sums of the rows of A.
    """

    A: tuple[tuple[float, ...], ...]
    b: tuple[float, ...]

    @property
    def c(self) -> tuple[float, ...]:
        """The nodes of the stages, as parts of a step."""
        return tuple(math.fsum(row) for row in self.A)

    @property
    def explicit(self) -> bool:
        """Whether each stage depends only on earlier ones."""
        return not any(a for i, row in enumerate(self.A) for a in row[i:])


_R3, _R15 = math.sqrt(3.0), math.sqrt(15.0)

RK4 = Tableau(
    A=((0.0, 0.0, 0.0, 0.0), (0.5, 0.0, 0.0, 0.0), (0.0, 0.5, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0)),
    b=(1 / 6, 1 / 3, 1 / 3, 1 / 6),
)

# Hairer, Lubich and Wanner, Geometric Numerical Integration (2nd edition, 2006), section II.1.3.
GAUSS_LEGENDRE = {
    2: Tableau(A=((0.5,),), b=(1.0,)),
    4: Tableau(
        A=((1 / 4, 1 / 4 - _R3 / 6), (1 / 4 + _R3 / 6, 1 / 4)),
        b=(1 / 2, 1 / 2),
    ),
    6: Tableau(
        A=(
            (5 / 36, 2 / 9 - _R15 / 15, 5 / 36 - _R15 / 30),
            (5 / 36 + _R15 / 24, 2 / 9, 5 / 36 - _R15 / 24),
            (5 / 36 + _R15 / 30, 2 / 9 + _R15 / 15, 5 / 36),
        ),
        b=(5 / 18, 4 / 9, 5 / 18),
    ),
}
