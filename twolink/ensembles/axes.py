"""The axes of an ensemble: a parameter of a scene, and the values that it takes.

Fixed axes have a list of values each, and all their combinations are run. Random axes are drawn
together: every combination is run with each of the draws. A draw is a pure function of the seed,
the number of the axis and the number of the draw (Philox, a counter-based generator), so that any
worker computes any of them alone.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twolink.ensembles.parameters import keys_of
from twolink.errors import ParameterError
from twolink.inputs import as_count, as_positive, as_real, as_tuple, refuse

Array = NDArray[np.float64]

# A value of 53 random bits is at the middle of its interval, so that it is never 0 or 1.
_BITS = 53
# Philox gives four numbers for each value of its counter.
_AT_ONCE = 4


class Values(ABC):
    """The values of an axis."""

    @abstractmethod
    def __len__(self) -> int:
        """Return the number of values; 0 for a distribution."""


class FixedValues(Values):
    """Values that are known beforehand, all of which are run."""

    @property
    @abstractmethod
    def numbers(self) -> Array:
        """The values, shape (n,)."""

    def __len__(self) -> int:
        return len(self.numbers)


class Distribution(Values):
    """A distribution, of which values are drawn."""

    @abstractmethod
    def quantiles(self, shares: Array) -> Array:
        """Return the values below which shares in (0, 1) of the distribution lie."""

    def __len__(self) -> int:
        return 0


@dataclass(frozen=True)
class Grid(FixedValues):
    """`count` evenly spaced values, from `first` to `last`, both included."""

    first: float
    last: float
    count: int

    def __post_init__(self) -> None:
        """Require finite ends, and one value or more, but not one for two ends."""
        for name in ("first", "last"):
            object.__setattr__(self, name, as_real(f"grid: {name}", getattr(self, name)))
        _check_range("grid: last - first", self.first, self.last)
        object.__setattr__(self, "count", as_count("grid: count", self.count, 1))
        if self.count == 1 and self.first != self.last:
            raise ParameterError(
                f"grid: last must be first = {self.first!r} where count is 1; got {self.last!r}"
            )

    def __len__(self) -> int:
        return self.count

    @property
    def numbers(self) -> Array:
        """The values, shape (n,)."""
        return np.linspace(self.first, self.last, self.count)


@dataclass(frozen=True)
class Listed(FixedValues):
    """The values of a list."""

    values: tuple[float, ...]

    def __post_init__(self) -> None:
        """Require one finite number or more."""
        entries = as_tuple("values", self.values, "a list of numbers")
        if not entries:
            refuse("values", entries, "one number or more")
        found = tuple(as_real(f"values[{k}]", entry) for k, entry in enumerate(entries))
        object.__setattr__(self, "values", found)

    @property
    def numbers(self) -> Array:
        """The values, shape (n,)."""
        return np.array(self.values)


@dataclass(frozen=True)
class Uniform(Distribution):
    """The uniform distribution from `low` to `high`."""

    low: float
    high: float

    def __post_init__(self) -> None:
        """Require low < high, both finite."""
        for name in ("low", "high"):
            object.__setattr__(self, name, as_real(f"uniform: {name}", getattr(self, name)))
        if not self.low < self.high:
            raise ParameterError(
                f"uniform: high must be above low = {self.low!r}; got {self.high!r}"
            )
        _check_range("uniform: high - low", self.low, self.high)

    def quantiles(self, shares: Array) -> Array:
        """Return the values below which shares in (0, 1) of the distribution lie."""
        return self.low + (self.high - self.low) * shares


@dataclass(frozen=True)
class Normal(Distribution):
    """The normal distribution with a `mean` and a standard `deviation`."""

    mean: float
    deviation: float

    def __post_init__(self) -> None:
        """Require a finite mean and a positive deviation."""
        object.__setattr__(self, "mean", as_real("normal: mean", self.mean))
        deviation = as_positive("normal: deviation", self.deviation)
        object.__setattr__(self, "deviation", deviation)

    def quantiles(self, shares: Array) -> Array:
        """Return the values below which shares in (0, 1) of the distribution lie."""
        from scipy.special import ndtri

        # A value that is not finite is refused in its run.
        with np.errstate(over="ignore"):
            return np.asarray(self.mean + self.deviation * ndtri(shares))


def _check_range(name: str, low: float, high: float) -> None:
    """Raise `ParameterError` unless the difference of two finite numbers is finite."""
    if not math.isfinite(high - low):
        raise ParameterError(f"{name} must be finite; got {high!r} - {low!r}")


KINDS: dict[str, type[Grid | Listed | Uniform | Normal]] = {
    "grid": Grid,
    "values": Listed,
    "uniform": Uniform,
    "normal": Normal,
}
"""The kinds of values by their keys in sweep files."""


@dataclass(frozen=True)
class Axis:
    """A parameter of a scene by the keys that lead to it, its name in results, and its values."""

    parameter: str
    values: Values
    name: str

    @property
    def keys(self) -> tuple[str, ...]:
        """The keys that lead to the parameter in a scene file."""
        return keys_of(self.parameter)


@dataclass(frozen=True)
class Runs:
    """The runs of an ensemble, numbered from 0: the last fixed axis and then the draws vary first.

    `draws` is the number of draws of random axes, which are those of the `seed`; 1 without any.
    """

    axes: tuple[Axis, ...]
    draws: int = 1
    seed: int = 0

    @property
    def shape(self) -> tuple[int, ...]:
        """The number of values of each fixed axis, in their order, and of draws."""
        return (*(len(axis.values) for axis in self._fixed()), self.draws)

    @property
    def varied(self) -> tuple[str, ...]:
        """The names of the fixed axes that have two or more different values."""
        return tuple(a.name for a in self._fixed() if len(np.unique(a.values.numbers)) > 1)

    @property
    def count(self) -> int:
        """The number of runs."""
        return math.prod(self.shape)

    def values(self, first: int, last: int) -> Array:
        """Return the value of each axis in the runs from `first` to before `last`: (n, axes)."""
        numbers = np.arange(first, last)
        *places, draws = np.unravel_index(numbers, self.shape)
        of_fixed = iter(places)
        found = np.empty((len(numbers), len(self.axes)))
        for column, axis in enumerate(self.axes):
            if isinstance(axis.values, FixedValues):
                found[:, column] = axis.values.numbers[next(of_fixed)]
            elif isinstance(axis.values, Distribution):
                shares = _shares(self.seed, column, draws)
                found[:, column] = axis.values.quantiles(shares)
        return found

    def _fixed(self) -> tuple[Any, ...]:
        return tuple(axis for axis in self.axes if isinstance(axis.values, FixedValues))


def _shares(seed: int, stream: int, draws: Any) -> Array:
    """Return the random numbers in (0, 1) of a stream with these numbers, each for itself."""
    if not len(draws):
        return np.empty(0)
    first = int(draws.min()) // _AT_ONCE
    count = int(draws.max()) + 1 - first * _AT_ONCE
    generator = np.random.Philox(key=np.array([seed, stream], np.uint64), counter=first)
    bits = generator.random_raw(count) >> np.uint64(64 - _BITS)
    shares: Array = (bits[draws - first * _AT_ONCE].astype(float) + 0.5) / 2.0**_BITS
    return shares
