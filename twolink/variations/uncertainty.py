"""Uncertainty of a motion from that of its start and parameters, to first order.

With the derivatives S of the state by the parameters and their covariance C, that of the state is
S C Sᵀ. How far this holds is measured: motions a standard deviation away in each principal
direction of C are compared with it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twolink.errors import ParameterError
from twolink.inputs import as_floats, as_number, nearest_float, refuse
from twolink.tables import Column, Table, table

Array = NDArray[np.float64]

LINEAR = 0.1
"""The share of the standard deviation up to which a departure from first order counts as small."""

# Differences of so many roundings of states are none.
_ROUNDINGS = 8

VARIABLES = ("q1", "q2", "u1", "u2")
"""The components of a state, in the order of its covariance."""


@dataclass(frozen=True)
class Uncertainty:
    """The covariance of (q1, q2, u1, u2), shape (n, 4, 4), at times t (s), to first order.

    `error`, shape (n,), bounds the error of every standard deviation (rad, rad/s) that comes from
    the measured errors of the derivatives. `departure`, shape (n,), is the largest difference so
    far between motions a standard deviation away and their first order, as a share of the standard
    deviation so far. `linear_until` is the time (s) up to which it is at most `LINEAR`.
    """

    t: Array
    covariance: Array
    error: Array
    departure: Array

    @property
    def deviation(self) -> Array:
        """The standard deviations of q1, q2 (rad), u1 and u2 (rad/s), shape (4, n)."""
        diagonal = np.diagonal(self.covariance, axis1=1, axis2=2)
        return np.asarray(np.sqrt(np.maximum(diagonal, 0.0)).T)

    @property
    def linear_until(self) -> float:
        """The time (s) up to which the first order holds."""
        small = self.departure <= LINEAR
        return float(self.t[-1] if small.all() else self.t[max(int(small.argmin()) - 1, 0)])

    @property
    def note(self) -> str:
        """A sentence on the part of the motion for which the first order holds."""
        if self.linear_until == self.t[-1]:
            return (
                "Motions one standard deviation away differ from the first order by"
                f" {self.departure[-1]:.1e} of it at most."
            )
        return (
            f"The first order holds until {self.linear_until:.6g} s: after that, motions one"
            f" standard deviation away differ from it by more than {LINEAR:g} of the deviation."
        )

    def summary(self) -> Table:
        """Return a table of the standard deviations at the end of each fifth."""
        places = np.linspace(0, len(self.t) - 1, 6).round().astype(int)
        columns = [Column("t (s)", number=True)]
        columns += [Column(f"σ of {name}", number=True) for name in VARIABLES]
        rows = (
            (f"{self.t[k]:.6g}", *(f"{sigma:.4g}" for sigma in self.deviation[:, k]))
            for k in places
        )
        return table("Standard deviations, to first order", columns, rows)


def propagated(
    t: Array,
    states: Array,
    slopes: Array,
    errors: Array,
    factor: Array,
    neighbour: Callable[[Array], Array],
) -> Uncertainty:
    """Return the uncertainty of states (4, n) with slopes (k, 4, n), whose errors are (k, n).

    The covariance of the parameters is F Fᵀ with the `factor` F, shape (k, k). `neighbour` returns
    the states with other values of the parameters, which are given as differences, shape (k,).
    """
    along = np.einsum("kj,kin->jin", factor, slopes)
    covariance = np.einsum("jan,jbn->nab", along, along)
    deviation = np.sqrt(np.maximum(np.diagonal(covariance, axis1=1, axis2=2), 0.0)).T
    # Angles are compared with the larger deviation of both, and so are speeds.
    of_kind = deviation.reshape(2, 2, -1).max(axis=1).repeat(2, axis=0)
    reached = np.maximum.accumulate(of_kind, axis=1)
    rounding = _ROUNDINGS * np.spacing(np.abs(states).max())
    departure = np.zeros(len(t))
    for column, first_order in zip(factor.T, along, strict=True):
        for sign in (1.0, -1.0) if column.any() else ():
            off = np.abs(neighbour(sign * column) - states - sign * first_order)
            departure = np.maximum(departure, _share(np.where(off > rounding, off, 0.0), reached))
    # By the triangle inequality, for any covariance.
    error = np.sqrt((factor**2).sum(axis=1)) @ errors
    return Uncertainty(t, covariance, error, np.maximum.accumulate(departure))


def _share(off: Array, reached: Array) -> Array:
    """Return the largest of four differences, each as a share of the deviation of its kind."""
    shares = np.divide(off, reached, out=np.full_like(off, np.inf), where=reached > 0)
    return np.asarray(np.where(off > 0, shares, 0.0).max(axis=0))


def factor_of(
    by: tuple[str, ...], deviations: Mapping[str, float] | None, covariance: Any
) -> Array:
    """Return a factor F of the covariance F Fᵀ of parameters, shape (k, k).

    Raises `ParameterError` unless either standard deviations by name or a covariance is given, and
    is one.
    """
    if (deviations is None) == (covariance is None):
        raise ParameterError(
            "uncertainty must have deviations or a covariance; got"
            f" {'both' if covariance is not None else 'none'}"
        )
    if deviations is not None:
        return np.diag(_deviations(by, deviations))
    given = as_floats("covariance", covariance, f"a {len(by)} × {len(by)} array of numbers")
    if given.shape != (len(by), len(by)) or not np.isfinite(given).all():
        refuse("covariance", covariance, f"a {len(by)} × {len(by)} array of finite numbers")
    found = _factor(given) if np.array_equal(given, given.T) else None
    if found is None:
        refuse("covariance", covariance, "symmetric and positive semidefinite")
    return found


def _factor(covariance: Array) -> Array | None:
    """Return a factor F of a symmetric matrix F Fᵀ, None if it is not positive semidefinite.

    The matrix of correlations is factored: parameters may have units in which one is far larger
    than another, and eigenvalues have the round-off of the largest.
    """
    variances = np.diagonal(covariance)
    deviations = np.sqrt(np.maximum(variances, 0.0))
    sizes = np.where(deviations > 0, deviations, 1.0)
    correlations = covariance / sizes / sizes[:, None]
    # A parameter without variance varies with no other.
    if variances.min() < 0 or correlations[deviations == 0].any():
        return None
    values, vectors = np.linalg.eigh(correlations)
    rounding = len(values) * np.spacing(np.abs(values).max())
    if values.min() < -8 * rounding:
        return None
    return np.asarray(deviations[:, None] * vectors * np.sqrt(np.maximum(values, 0.0)))


def _deviations(by: tuple[str, ...], given: Mapping[str, float]) -> list[float]:
    if not isinstance(given, Mapping):
        refuse("deviations", given, "a mapping from names to standard deviations")
    unknown = next((name for name in given if name not in by), None)
    if unknown is not None:
        refuse("deviations", unknown, f"of {', '.join(by)}")
    found = []
    for name in by:
        own = as_number(f"the deviation of {name}", given.get(name, 0.0))
        value = nearest_float(own)
        if not 0 <= value < np.inf:
            refuse(f"the deviation of {name}", own, "zero or positive, and finite")
        found.append(value)
    return found
