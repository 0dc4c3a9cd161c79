"""Sampled motor torques, with an explicit interpolation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from decimal import Context, Decimal, localcontext
from fractions import Fraction
from functools import cached_property
from itertools import pairwise
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from twolink.arithmetic import Pair, Scalar
from twolink.chain import Chain
from twolink.effects.effect import ParametricEffect, PiecewiseEffect
from twolink.errors import ParameterError
from twolink.inputs import nearest_float, take_fields
from twolink.loads import Loads, motor_loads
from twolink.text import quoted

_FEWEST = {"hold": 1, "linear": 2, "cubic": 4}

# Digits of the coefficients of a spline. Runs with discontinuities have at most 34, and steeply
# graded times lose some.
_DIGITS = 80

Rows = tuple[tuple[Scalar, ...], tuple[Scalar, ...]]
Column = list[Decimal]


@dataclass(frozen=True)
class PolynomialTorque(ParametricEffect):
    """Torques that are polynomials in t − `start` (s): `coefficients` of A and of B (N m/sᵏ)."""

    start: Scalar
    coefficients: Rows
    # Those of samples are rational numbers, of which `coefficients` are the nearest floats.
    _exact: Rows | None = field(default=None, repr=False, compare=False)

    @property
    def numbers(self) -> tuple[Scalar, ...]:
        """The start and all coefficients, in a fixed order; pieces differ only in these numbers."""
        A, B = self._rows
        return (self.start, *A, *B)

    @property
    def _rows(self) -> Rows:
        return self._exact or self.coefficients

    def with_numbers(self, numbers: tuple[Scalar, ...]) -> PolynomialTorque:
        """Return the polynomial of the same degree with these numbers."""
        start, *rest = numbers
        half = len(rest) // 2
        return PolynomialTorque(start, (tuple(rest[:half]), tuple(rest[half:])))

    def loads(self, chain: Chain, q: Pair, u: Pair, t: Scalar = 0.0) -> Loads:
        """Return the torques on link 1 and on link 2, by Horner's scheme."""
        since = t - chain.scalar(self.start)
        A, B = (tuple(map(chain.scalar, row)) for row in self._rows)
        return motor_loads(_horner(A, since), _horner(B, since))


def _horner(coefficients: tuple[Scalar, ...], x: Scalar) -> Scalar:
    value = coefficients[-1]
    for coefficient in coefficients[-2::-1]:
        value = value * x + coefficient
    return value


@dataclass(frozen=True)
class SampledTorque(PiecewiseEffect):
    """Torques of the motors at A and B (N m), sampled at rising `times` (s).

    Between samples they are interpolated: `hold` keeps a sample until the next, `linear` draws
    straight lines, `cubic` a spline that is twice differentiable (not-a-knot at its ends). Before
    the first sample and after the last they are constant. The motion is integrated from sample to
    sample, so no step crosses a kink or a jump.

    Times become float64. Slopes and coefficients of splines follow exactly from times and samples,
    up to 80 digits, and are rounded in the precision of a run. `loads` are in float64.
    """

    times: tuple[float, ...]
    A: tuple[float, ...]
    B: tuple[float, ...]
    interpolation: Literal["hold", "linear", "cubic"]

    def __post_init__(self) -> None:
        """Require enough samples, increasing times, and equal numbers of entries."""
        take_fields(self, "sampled torque")
        if self.interpolation not in _FEWEST:
            raise ParameterError(
                f"sampled torque: interpolation must be one of {', '.join(_FEWEST)}; got"
                f" {self.interpolation!r}"
            )
        fewest = _FEWEST[self.interpolation]
        if len(self.times) < fewest:
            raise ParameterError(
                f"sampled torque: times must have {fewest} or more entries for"
                f" {self.interpolation}; got {len(self.times)}"
            )
        for name, values in (("times", self.times), ("A", self.A), ("B", self.B)):
            if len(values) != len(self.times):
                raise ParameterError(
                    f"sampled torque: {name} must have as many entries as times,"
                    f" {len(self.times)}; got {len(values)}"
                )
            if not all(abs(value) < float("inf") for value in values):
                wrong = next(value for value in values if not abs(value) < float("inf"))
                raise ParameterError(
                    f"sampled torque: {name} must be finite numbers; got {wrong!r}"
                )
        object.__setattr__(self, "times", tuple(map(nearest_float, self.times)))
        for earlier, later in pairwise(self.times):
            if not earlier < later:
                raise ParameterError(
                    f"sampled torque: times must increase; got {later!r} s after {earlier!r} s"
                )
        self._check_finite()

    def _check_finite(self) -> None:
        """Require coefficients of the interpolation that float64 holds."""
        try:
            pieces = self._pieces
        except ArithmeticError:
            raise ParameterError(
                f"sampled torque: times must be less uneven for {self.interpolation}, whose slopes"
                f" lose all {_DIGITS} digits; got {quoted(self.times)}"
            ) from None
        for name, rows in zip("AB", pieces, strict=True):
            finite = np.isfinite(rows).all(axis=1)
            if not finite.all():
                since = self.times[max(int(finite.argmin()) - 1, 0)]
                raise ParameterError(
                    f"sampled torque: {name} must have slopes and curvatures that are finite in"
                    f" float64; got others after {since!r} s"
                )

    @property
    def discontinuities(self) -> tuple[float, ...]:
        """The times (s) at which the torques are not smooth."""
        return self.times

    def piece_at(self, t: float) -> PolynomialTorque:
        """Return the torques of the piece that contains a time (s), or begins there."""
        piece = int(np.searchsorted(self.times, t, side="right"))
        start = self.times[max(piece - 1, 0)]
        exact = self._exact_row(self.A, 0, piece), self._exact_row(self.B, 1, piece)
        A, B = (tuple(map(float, row)) for row in exact)
        return PolynomialTorque(start, (A, B), exact)

    def _exact_row(
        self, samples: tuple[float, ...], joint: int, piece: int
    ) -> tuple[Fraction, ...]:
        """Return the coefficients of a piece, lowest first: 0 is before the samples."""
        last = len(samples)
        value = _fraction(samples[max(piece - 1, 0)])
        if self.interpolation == "hold":
            return (value,)
        if piece in (0, last):
            return (value, *[Fraction(0)] * (3 if self.interpolation == "cubic" else 1))
        if self.interpolation == "cubic":
            return (value, *map(Fraction, self._splines[joint][piece - 1]))
        rise = _fraction(samples[piece]) - value
        return value, rise / (Fraction(self.times[piece]) - Fraction(self.times[piece - 1]))

    @cached_property
    def _pieces(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The coefficients of A and of B in float64, lowest first, of each piece."""
        A, B = self._coefficients(0, self.A), self._coefficients(1, self.B)
        return A, B

    def _coefficients(self, joint: int, values: tuple[float, ...]) -> NDArray[np.float64]:
        """Return the coefficients of each piece: before the samples, between them, and after."""
        times, samples = np.array(self.times), np.array(values, dtype=float)
        if self.interpolation == "hold":
            return np.concatenate([samples[:1], samples])[:, None]
        if self.interpolation == "linear":
            with np.errstate(over="ignore"):
                higher = (np.diff(samples) / np.diff(times))[:, None]
        else:
            higher = np.array(self._splines[joint], dtype=float)
        inside = np.concatenate([samples[:-1, None], higher], axis=1)
        ends = np.zeros((2, inside.shape[1]))
        ends[:, 0] = samples[0], samples[-1]
        return np.concatenate([ends[:1], inside, ends[1:]])

    @cached_property
    def _splines(self) -> tuple[list[Column], list[Column]]:
        """The coefficients of powers 1, 2, 3 between the samples of A and of B."""
        return _spline(self.times, self.A), _spline(self.times, self.B)

    def slopes_of(self, slopes: tuple[float, ...]) -> Callable[[float], tuple[Scalar, ...]]:
        """Return the slopes of the numbers of pieces, where samples have slopes and times none.

        Torques are linear in their samples: they are the torques of these slopes as samples, and
        as exact.
        """
        count = len(self.times)
        along = replace(self, A=slopes[count : 2 * count], B=slopes[2 * count :])

        def slopes_at(t: float) -> tuple[Scalar, ...]:
            _, *rows = along.piece_at(t).numbers
            return (0.0, *rows)

        return slopes_at

    def smooth_loads(self, chain: Chain, q: Pair, u: Pair, t: Scalar = 0.0) -> Loads:
        """Return the torques on link 1 and on link 2 at a time, or at an array of times (s)."""
        pieces = np.searchsorted(self.times, t, side="right")
        since = np.asarray(t, dtype=float) - np.asarray(self.times)[np.maximum(pieces - 1, 0)]
        tau = [_horner(tuple(np.moveaxis(rows[pieces], -1, 0)), since) for rows in self._pieces]
        return motor_loads(*(value if np.ndim(t) else float(value) for value in tau))


def _spline(times: tuple[float, ...], samples: tuple[float, ...]) -> list[Column]:
    """Return the coefficients of powers 1, 2, 3 of a not-a-knot spline on each interval.

    They are accurate to about `_DIGITS` digits. C. de Boor, A Practical Guide to Splines (1978),
    chapter IV.
    """
    with localcontext(Context(prec=_DIGITS)):
        x, y = ([_decimal(value) for value in row] for row in (times, samples))
        h = [after - before for before, after in pairwise(x)]
        rise = [(after - before) / d for (before, after), d in zip(pairwise(y), h, strict=True)]
        slopes = _solved(*_knots(h, rise))
        found = []
        for (first, last), mean, d in zip(pairwise(slopes), rise, h, strict=True):
            bend = (first + last - 2 * mean) / d
            found.append([first, (mean - first) / d - bend, bend / d])
        return found


def _fraction(value: Any) -> Fraction:
    """Return a number exactly, and one of mpmath or SymPy in float64, as scenes have none."""
    return Fraction(value) if isinstance(value, (int, float, Fraction)) else Fraction(float(value))


def _decimal(value: Any) -> Decimal:
    exact = _fraction(value)
    return Decimal(exact.numerator) / Decimal(exact.denominator)


def _knots(h: Column, rise: Column) -> tuple[Column, Column, Column, Column]:
    """Return the tridiagonal system of the slopes at the samples: three diagonals, right side."""
    first, last = h[0] + h[1], h[-1] + h[-2]
    inner = list(zip(pairwise(h), pairwise(rise), strict=True))
    below = [Decimal(0), *(after for (_, after), _ in inner), last]
    diagonal = [h[1], *(2 * (before + after) for (before, after), _ in inner), h[-2]]
    above = [first, *(before for (before, _), _ in inner), Decimal(0)]
    right = [3 * (after * r + before * s) for (before, after), (r, s) in inner]
    start = ((h[0] + 2 * first) * h[1] * rise[0] + h[0] ** 2 * rise[1]) / first
    end = ((h[-1] + 2 * last) * h[-2] * rise[-1] + h[-1] ** 2 * rise[-2]) / last
    return below, diagonal, above, [start, *right, end]


def _solved(below: Column, diagonal: Column, above: Column, right: Column) -> Column:
    """Return the solution of a tridiagonal system, by elimination."""
    diagonal, right = diagonal[:], right[:]
    for k in range(1, len(diagonal)):
        factor = below[k] / diagonal[k - 1]
        diagonal[k] -= factor * above[k - 1]
        right[k] -= factor * right[k - 1]
    found = [right[-1] / diagonal[-1]]
    for d, a, r in list(zip(diagonal, above, right, strict=True))[-2::-1]:
        found.append((r - a * found[-1]) / d)
    return found[::-1]
