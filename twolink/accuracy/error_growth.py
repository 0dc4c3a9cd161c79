"""Growth of errors with time: root mean square in bins of time, and a fitted power of time.

Errors of several initial states are combined. The exponent of a single random walk is poorly
determined; several walks determine it, and the jackknife over initial states its uncertainty.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_BINS_A_DECADE = 10


@dataclass(frozen=True)
class Binned:
    """Mean squares of errors: `times` (s), shape (bins,), and `squares`, shape (bins, starts)."""

    times: Array
    squares: Array

    @property
    def rms(self) -> Array:
        """The root mean square over the initial states, shape (bins,)."""
        return np.asarray(np.sqrt(self.squares.mean(axis=1)))


@dataclass(frozen=True)
class ErrorGrowth:
    """An error proportional to a power of time with the `exponent`, between two times (s).

    `uncertainty` is the standard error of the exponent over the initial states.
    """

    exponent: float
    uncertainty: float
    start: float
    end: float

    @property
    def rounded(self) -> str:
        """The exponent with two decimals, without a sign if it rounds to zero."""
        return f"{self.exponent:.2f}".replace("-0.00", "0.00")


def binned(times: Array, errors: Array) -> Binned:
    """Return the mean squares of errors (n, starts) at increasing times (s), ten bins per decade.

    Bins are counted backwards from the last time, so that the last bin is full.
    """
    places = np.ceil(np.log10(times / times.max(initial=0.0)) * _BINS_A_DECADE - 1e-9).astype(int)
    inside = [places == place for place in np.unique(places)]
    return Binned(
        np.array([np.exp(np.log(times[chosen]).mean()) for chosen in inside]),
        np.array([(errors[chosen] ** 2).mean(axis=0) for chosen in inside]).reshape(
            -1, errors.shape[1]
        ),
    )


def fit_growth(measured: Binned, *, start: float) -> ErrorGrowth | None:
    """Fit the power of time that the errors follow from a time (s) on, by least squares.

    The fit is linear in the logarithms of the root mean square. Its uncertainty is the jackknife's
    (Efron and Stein, The jackknife estimate of variance, 1981): each initial state is omitted in
    turn. Returns None with fewer than three bins, or two initial states, with errors.
    """
    chosen = (measured.times >= start) & (measured.squares > 0).all(axis=1)
    times, squares = np.log10(measured.times[chosen]), measured.squares[chosen]
    count = squares.shape[1]
    if len(times) < 3 or count < 2:
        return None
    without = [_slope(times, np.delete(squares, one, axis=1)) for one in range(count)]
    spread = (count - 1) / count * np.sum((np.array(without) - np.mean(without)) ** 2)
    return ErrorGrowth(
        exponent=_slope(times, squares),
        uncertainty=float(np.sqrt(spread)),
        start=float(measured.times[chosen][0]),
        end=float(measured.times[chosen][-1]),
    )


def _slope(times: Array, squares: Array) -> float:
    return float(np.polyfit(times, np.log10(squares.mean(axis=1)) / 2, 1)[0])
