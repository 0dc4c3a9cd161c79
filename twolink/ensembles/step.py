"""A Taylor step of runs in lanes that carries the region of the error, in one compiled function.

The function maps an array of rows to another, a lane in each column. Its series have an order N.
The defect of a step is known at the start of the next: the derivative of the polynomial at the end
less the rates there. It begins as a power N of the time in the step, whose integral is the error of
the step; so no error is estimated by a term of the series, which may vanish by symmetry.

States are summed with the rest of each sum: in a steady motion all roundings have the same sign.

The lengths of steps follow from the last two terms of the speeds, which are to be a tolerance, or a
small part of the region of the error so far if that is larger: where errors have grown, more of
truncation does not count.
"""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twolink.arithmetic import whole_power
from twolink.effects import is_built_in
from twolink.ensembles.blocks import ROUNDING
from twolink.ensembles.comparisons import largest, size, smallest, two_sum
from twolink.ensembles.compiled import System
from twolink.ensembles.deviations import UNKNOWN, Region
from twolink.ensembles.lane_rows import ROWS, Rows, Settings
from twolink.ensembles.linear_flow import NODES, derivatives, flow, frequency
from twolink.ensembles.motion_terms import MotionTerms, motion_terms
from twolink.ensembles.terms import value
from twolink.integration.expressions import plain
from twolink.optional import heyoka
from twolink.simulation.smooth.rates import of_differences
from twolink.values import Content

Array = NDArray[np.float64]

ORDER = 20
"""The order of the series. Lower ones cost more: much is done once in each step."""

TOGETHER = 8
"""The lanes that the compiled function computes together: those of the widest registers.

Where registers are narrower each takes several. Lanes beyond a multiple of them are computed by
other instructions, with other bits.
"""

OF_REGION = 0.1
"""The part of the region so far that the last terms of a step may be."""

# The most that they may be (rad/s).
_MOST = 1e-8

# The length of the first step, in longest steps: more terms vanish at the start than later.
FIRST = 0.15

# The size of a term relative to the one before it, where steps are long.
_OF_TERMS = 0.3

# The angle (rad) from which on a run is lost. Sines of larger ones, from 1e14, would be computed
# otherwise in all lanes of a register.
_LARGEST_ANGLE = 1e9

# Roundings of a state in each step, and of the rates, which all steps share.
_OF_STATES, _OF_RATES = 2.0, 0.5


def has_step(system: System) -> bool:
    """Return whether a system has a step, without compiling it."""
    return _has_step(*_key(system))


def compiled_step(system: System, *, paths: bool = False) -> Any:
    """Return the step of a system that has one.

    It is called with rows of shape (ROWS, n), the parameters of the runs and below them those of
    `Settings`, and with the times of the starts (s); n is a multiple of `TOGETHER`. With `paths` it
    adds to those of the rows.
    """
    return _compiled_step(*_key(system), paths)


def compiled_angles(system: System) -> Any:
    """Return the function that maps states (q, p), shape (4, n), to the angles of their next steps.

    It is called as `compiled_step`, and returns the coefficients of q1 and below them those of q2.
    """
    return _compiled_angles(*_key(system))


def _key(system: System) -> tuple[Content, Content, tuple[int, ...]]:
    return Content((system.chain,)), Content(system.effects), system.varying


@functools.lru_cache(maxsize=32)
def _has_step(chain: Content, effects: Content, varying: tuple[int, ...]) -> bool:
    if not all(map(is_built_in, effects.objects)):
        # Functions of one's own may change where no term of a series shows it.
        return False
    try:
        _series(System(chain.objects[0], effects.objects, varying), _state())
    except TypeError:
        return False
    return True


def _state() -> Any:
    return heyoka().make_vars(*(f"x{k}" for k in range(4)))


@functools.lru_cache(maxsize=32)
def _compiled_step(chain: Content, effects: Content, varying: tuple[int, ...], paths: bool) -> Any:
    system = System(chain.objects[0], effects.objects, varying)
    variables = heyoka().make_vars(*(f"x{k}" for k in range(ROWS)))
    before = Rows.of(variables)
    after = _after(system, before, _series(system, before.state), paths)
    return _function(after, variables)


@functools.lru_cache(maxsize=32)
def _compiled_angles(chain: Content, effects: Content, varying: tuple[int, ...]) -> Any:
    system = System(chain.objects[0], effects.objects, varying)
    state = _state()
    angles = [term for q in _series(system, state).q for term in q.terms(ORDER + 1)]
    return _function(angles, state)


def _function(outputs: list[Any], variables: Any) -> Any:
    """Return compiled functions of rows of lanes."""
    return heyoka().cfunc(outputs, variables, compact_mode=False, batch_size=TOGETHER)


def _series(system: System, state: Any) -> MotionTerms:
    """Return the series of the motion; raises `TypeError` where an effect has none."""
    q, p = map(_within_range, state[:2]), state[2:]
    chain, effects = system.with_symbols()
    found = motion_terms(chain, effects, tuple(q), tuple(p), heyoka().time)
    for each in found.forces:
        each.terms(ORDER)
    return found


def _after(system: System, before: Rows, series: MotionTerms, paths: bool) -> list[Any]:
    """Return the expressions of all rows after a step."""
    hy, count = heyoka(), len(system.varying)
    settings = Settings(*(hy.par[count + k] for k in range(len(Settings._fields))))
    region = _with_last_step(before, series, settings)
    directions = _of_angles_and_speeds(series)
    spread = largest(before.spread, region.spread(directions))
    shift = largest(before.shift, region.shift(directions))
    most = smallest(largest(settings.tolerance, OF_REGION * spread), _MOST)
    wanted = smallest(_length(series, most), settings.cap, 1.0 / before.frequency)
    length = hy.select(hy.gte(wanted, before.left), before.left, wanted)
    left = before.left - length
    # This is exact, so that the times of all steps sum to the duration.
    length = before.left - left
    polynomials = [x.terms(ORDER + 1) for x in (*series.q, *series.p)]
    slopes = [x.terms(ORDER) for x in (*series.u, *series.forces)]
    first, second, third = (_jacobian(system, polynomials, length * node) for node in NODES)
    region = region.carried(flow((first, second, third), length))
    places = [value(x, length * node) for x in polynomials[:2] for node in NODES]
    farthest = largest(*map(size, (*before.state[:2], *places)))
    moves = hy.select(hy.gt(before.left, 0.0), 1.0, 0.0)
    turned = np.array(before.paths, object)
    if paths:
        turned += [_turned(x, length) for x in polynomials[:2]]
    sums = [
        two_sum(start, value(terms[1:], length) * length + low)
        for start, low, terms in zip(before.state, before.low, polynomials, strict=True)
    ]
    return [
        *(high for high, _ in sums),
        *region.centre,
        *region.entries,
        *(value(terms, length) for terms in slopes),
        *(_tail(terms, length) for terms in slopes),
        *(low for _, low in sums),
        *turned,
        length,
        hy.select(hy.lt(farthest, _LARGEST_ANGLE), left, math.nan),
        spread,
        shift,
        frequency(third),
        before.steps + moves,
    ]


def _with_last_step(before: Rows, series: MotionTerms, settings: Settings) -> Region:
    """Return the region of the error with the truncation error and the round-off of the last step.

    The round-off of the start is that of the first step.
    """
    hy = heyoka()
    rates = np.array([x.term(0) for x in (*series.u, *series.forces)], object)
    last = before.last
    truncation = (np.array(before.rates, object) - rates) * (last * (1.0 / (ORDER + 1)))
    # The defect may happen to be small where it is known: the terms show how large it is before.
    sizes = _sizes(truncation) + np.array(before.tail, object) * (last * (_OF_TERMS / (ORDER + 1)))
    # The constants of the equations are rounded once.
    shared = sizes * UNKNOWN + _sizes(rates) * (last * (_OF_RATES * ROUNDING))
    momenta = series.mass.sizes_of_momenta(rates[:2])
    moves = hy.select(hy.gt(before.left, 0.0), _OF_STATES * ROUNDING, 0.0)
    independent = np.array([*_sizes(before.state[:2]), *momenta], object) * moves
    shared[2:] += np.array([settings.shared1, settings.shared2], object) * last
    independent[2:] += np.array([settings.independent1, settings.independent2], object) * last
    M11, _, M22 = series.mass.entries
    # The inverse of a time of the motion makes momenta angles.
    scale = largest(before.frequency, 1.0 / settings.cap)
    units = np.array([1.0, 1.0, M11 * scale, M22 * scale], object)
    region = Region.of(before.centre, before.shape)
    return region.with_step(truncation, shared, independent, units)


def _tail(terms: list[Any], t: Any) -> Any:
    """Return the size of the last term at a time, or that which the one before lets expect."""
    power = whole_power(t, len(terms) - 2)
    return power * largest(size(terms[-1]) * t, size(terms[-2]) * _OF_TERMS)


def _sizes(expressions: Any) -> Any:
    return np.array([size(x) for x in expressions], object)


def _of_angles_and_speeds(series: MotionTerms) -> Any:
    """Return the rows by which deviations of q and p give those of q and u.

    By M du = dp + s (dq2 − dq1) (u2, u1), the variation of M u = p.
    """
    u1, u2 = (x.term(0) for x in series.u)
    first, second = series.mass.speeds((series.across * u2, series.across * u1))
    A11, A12, A22 = series.mass.inverse
    angles = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0]]
    speeds = [[-first, first, A11, A12], [-second, second, A12, A22]]
    return np.array([*angles, *speeds], object)


def _length(series: MotionTerms, most: Any) -> Any:
    """Return the length (s) at which the last two terms of both speeds are at most a size."""
    hy = heyoka()
    logarithm = hy.log(most)
    lengths = []
    for k in (ORDER - 1, ORDER - 2):
        last = largest(*(size(u.term(k)) for u in series.u))
        lengths.append(hy.exp((logarithm - hy.log(last)) * (1.0 / k)))
    return smallest(*lengths)


def _within_range(angle: Any) -> Any:
    """Return an angle, or 0 for one that is too large or not a number: its run is lost."""
    return heyoka().select(heyoka().lt(size(angle), _LARGEST_ANGLE), angle, 0.0)


def _turned(terms: list[Any], t: Any) -> Any:
    """Return a bound on how far an angle turns on a step (rad)."""
    return value([size(x) for x in terms[1:]], t) * t


def _jacobian(system: System, polynomials: list[Any], t: Any) -> Any:
    """Return the derivatives of the rates by q and p at a time (s) in a step."""
    hy = heyoka()
    names = hy.make_vars("q1", "q2", "p1", "p2")
    rates = system.rates(tuple(names[:2]), tuple(names[2:]))
    shorter = hy.subs([plain(x) for pair in rates for x in pair], of_differences(*names[:2]))
    known = derivatives(shorter, names)
    values = [value(terms, t) for terms in polynomials]
    there = dict(zip(names, (*map(_within_range, values[:2]), *values[2:]), strict=True))
    flat = hy.subs(known.ravel().tolist(), {**there, hy.time: hy.time + t})
    return np.array(flat, object).reshape(4, 4)
