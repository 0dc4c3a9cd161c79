"""How errors grow with time: their root mean square in bins of time, and a power of time fitted.

Errors of several starts stand side by side. One error that walks at random says little about the
power of its walk; many do, and by leaving out each start in turn they say how much.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_BINS_A_DECADE = 10


@dataclass(frozen=True)
class Binned:
    """Mean squares of errors: `times` (s) of shape (bins,), `squares` of (bins, starts)."""

    times: Array
    squares: Array

    @property
    def rms(self) -> Array:
        """The root mean square over the starts, shape (bins,)."""
        return np.asarray(np.sqrt(self.squares.mean(axis=1)))


@dataclass(frozen=True)
class Growth:
    """An error that is proportional to time to the `exponent`, between two times (s).

    `uncertainty` is the standard error of the exponent over the starts.
    """

    exponent: float
    uncertainty: float
    start: float
    end: float

    @property
    def rounded(self) -> str:
        """The exponent with two decimals; one that rounds to zero has no sign."""
        return f"{self.exponent:.2f}".replace("-0.00", "0.00")


def binned(times: Array, errors: Array) -> Binned:
    """Return the mean squares of errors (n, starts) at rising times (s) in bins, ten to a decade.

    They are counted back from the last time, so that the last bin is as full as those before.
    """
    places = np.ceil(np.log10(times / times.max(initial=0.0)) * _BINS_A_DECADE - 1e-9).astype(int)
    inside = [places == place for place in np.unique(places)]
    return Binned(
        np.array([np.exp(np.log(times[chosen]).mean()) for chosen in inside]),
        np.array([(errors[chosen] ** 2).mean(axis=0) for chosen in inside]).reshape(
            -1, errors.shape[1]
        ),
    )


def growth(measured: Binned, *, start: float) -> Growth | None:
    """Return the power of time that the errors follow from a time (s) on, by least squares.

    The line is that through the logarithms of the root mean square. Its uncertainty is the
    jackknife's (Efron and Stein, The jackknife estimate of variance, 1981): each start is left out
    in turn. None with fewer than three bins, or two starts, that have errors.
    """
    chosen = (measured.times >= start) & (measured.squares > 0).all(axis=1)
    times, squares = np.log10(measured.times[chosen]), measured.squares[chosen]
    count = squares.shape[1]
    if len(times) < 3 or count < 2:
        return None
    without = [_slope(times, np.delete(squares, one, axis=1)) for one in range(count)]
    spread = (count - 1) / count * np.sum((np.array(without) - np.mean(without)) ** 2)
    return Growth(
        exponent=_slope(times, squares),
        uncertainty=float(np.sqrt(spread)),
        start=float(measured.times[chosen][0]),
        end=float(measured.times[chosen][-1]),
    )


def _slope(times: Array, squares: Array) -> float:
    return float(np.polyfit(times, np.log10(squares.mean(axis=1)) / 2, 1)[0])
