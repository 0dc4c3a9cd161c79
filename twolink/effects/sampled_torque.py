"""Sampled motor torques, with an explicit interpolation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from twolink.arithmetic import Pair, Scalar
from twolink.chain import Chain
from twolink.effects.effect import ParametricEffect, PiecewiseEffect
from twolink.errors import ParameterError
from twolink.inputs import take_fields
from twolink.loads import Loads, motor_loads

_FEWEST = {"hold": 1, "linear": 2, "cubic": 4}


@dataclass(frozen=True)
class PolynomialTorque(ParametricEffect):
    """Torques that are polynomials in t − `start` (s): `coefficients` of A and of B (N m/sᵏ)."""

    start: Scalar
    coefficients: tuple[tuple[Scalar, ...], tuple[Scalar, ...]]

    @property
    def numbers(self) -> tuple[Scalar, ...]:
        """The start and all coefficients, in a fixed order; pieces differ only in these numbers."""
        return (self.start, *self.coefficients[0], *self.coefficients[1])

    def with_numbers(self, numbers: tuple[Scalar, ...]) -> PolynomialTorque:
        """Return the polynomial of the same degree with these numbers."""
        start, *rest = numbers
        half = len(rest) // 2
        return PolynomialTorque(start, (tuple(rest[:half]), tuple(rest[half:])))

    def loads(self, chain: Chain, q: Pair, u: Pair, t: Scalar = 0.0) -> Loads:
        """Return the torques on link 1 and on link 2, by Horner's scheme."""
        since = t - self.start
        return motor_loads(*(_horner(row, since) for row in self.coefficients))


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
    """

    times: tuple[float, ...]
    A: tuple[float, ...]
    B: tuple[float, ...]
    interpolation: Literal["hold", "linear", "cubic"]
    _pieces: Any = field(default=None, repr=False, compare=False, init=False)

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
        for earlier, later in pairwise(self.times):
            if not earlier < later:
                raise ParameterError(
                    f"sampled torque: times must increase; got {later!r} s after {earlier!r} s"
                )
        pieces = _coefficients(self, self.A), _coefficients(self, self.B)
        object.__setattr__(self, "_pieces", pieces)

    @property
    def discontinuities(self) -> tuple[float, ...]:
        """The times (s) at which the torques are not smooth."""
        return self.times

    def piece_at(self, t: float) -> PolynomialTorque:
        """Return the torques of the piece that contains a time (s), or begins there."""
        piece = int(np.searchsorted(self.times, t, side="right"))
        start = self.times[max(piece - 1, 0)]
        A, B = (tuple(rows[piece].tolist()) for rows in self._pieces)
        return PolynomialTorque(start, (A, B))

    def slopes_of(self, slopes: tuple[float, ...]) -> Callable[[float], tuple[float, ...]]:
        """Return the slopes of the numbers of pieces, where samples have slopes and times none.

        Torques are linear in their samples: they are the torques of these slopes as samples.
        """
        count = len(self.times)
        along = replace(self, A=slopes[count : 2 * count], B=slopes[2 * count :])
        return lambda t: (0.0, *along.piece_at(t).numbers[1:])

    def loads(self, chain: Chain, q: Pair, u: Pair, t: Scalar = 0.0) -> Loads:
        """Return the torques on link 1 and on link 2 at a time, or at an array of times (s)."""
        pieces = np.searchsorted(self.times, t, side="right")
        since = np.asarray(t, dtype=float) - np.asarray(self.times)[np.maximum(pieces - 1, 0)]
        tau = [_horner(tuple(np.moveaxis(rows[pieces], -1, 0)), since) for rows in self._pieces]
        return motor_loads(*(value if np.ndim(t) else float(value) for value in tau))


def _coefficients(sampled: SampledTorque, values: tuple[float, ...]) -> NDArray[np.float64]:
    """Return the coefficients of each piece, lowest first: before the samples, between, after."""
    times, samples = np.array(sampled.times, dtype=float), np.array(values, dtype=float)
    if sampled.interpolation == "hold":
        return np.concatenate([samples[:1], samples])[:, None]
    if sampled.interpolation == "linear":
        inside = np.stack([samples[:-1], np.diff(samples) / np.diff(times)], axis=-1)
    else:
        from scipy.interpolate import CubicSpline

        inside = CubicSpline(times, samples).c[::-1].T
    ends = np.zeros((2, inside.shape[1]))
    ends[:, 0] = samples[0], samples[-1]
    return np.concatenate([ends[:1], inside, ends[1:]])
