"""The global error of a run by Taylor series, from the defect of its own steps.

The errors of all steps add up as the linearized motion carries them: e_{i+1} = Φ_i e_i + l_i
(Hairer, Nørsett and Wanner, Solving Ordinary Differential Equations I, 1993, section II.8), with l
the defect of a step. Φ is the exponential of Magnus's series of sixth order (Blanes, Casas, Oteo
and Ros, The Magnus expansion and some of its applications, 2009, section 5.4): over many steps an
error of Φ would grow like an instability.

The rates f have round-off too, of the size that a rounding of the state, of the time and of f
itself gives. Most of it is independent on each step and for each variable: the linearized motion
carries its covariance, P_{i+1} = Φ_i P_i Φ_iᵀ + diag v_i. The round-off of the constants of the
chain and of its loads is the same on all steps. An evaluation in the precision of the run has the
same constants, and does not see it; it is bounded by errors of a rounding of each rate, in the
direction of the rate, which are carried like the defect.

An error that is known can be subtracted. A correction leaves the round-off of the estimate and a
small part of the error itself.
"""

from __future__ import annotations

import math
from time import perf_counter
from typing import NamedTuple

import numpy as np

from twolink.effects import is_built_in
from twolink.integration.precisions import PRECISIONS, PrecisionName
from twolink.names import EquationsName
from twolink.scene import Scene
from twolink.simulation.run import Array
from twolink.simulation.smooth.correction import Correction, correction_of
from twolink.simulation.smooth.defect import Defects, evaluation_of
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.simulation.smooth.error_bounds import ErrorBounds, error_bounds, of_values
from twolink.simulation.smooth.flows import accumulated, carried
from twolink.simulation.smooth.linear import Linear, linearized, scaled_polynomials
from twolink.simulation.smooth.load_sizes import LoadSizes, load_sizes
from twolink.simulation.smooth.quadrature import MOMENTS
from twolink.simulation.smooth.rates import jacobians_of
from twolink.simulation.smooth.steps import Steps

# Powers of h J by which constant errors are carried over the rest of a step: those of nearly all
# steps are below 2.
_OF_CONSTANTS = 5

# Moments whose terms in a sum are below this part of the defect are left out.
_OF_MOMENTS = 1e-3

# The part of the error that each step adds which is not known. Errors of many steps may cancel, as
# those of links that round-off cannot bend do; at most 3e-4 of their root mean square was left.
_OF_SOURCES = 2e-4

# The round-off of a corrected value, in that of the values of a run: where a step ends, the error
# changes by a rounding of the next start.
_VALUES = 4

# The largest change of the logarithms of flows, in all, by an estimated error: errors are carried
# along the run, and not along the motion.
_MOST_BENT = 0.25

# The most that both links turn in a step (rad), together, where a few nodes show all round-off: the
# series of sines and cosines of larger angles x have terms up to e^x. Where these cancel in the
# rates, as on uncoupled links, steps may be far longer. Steps of random motions turn by 0.9 rad.
_MOST_TURN = 1.5

# The most steps that are kept for a correction: 2 kB each.
MOST_KEPT = 50_000


class _Part(NamedTuple):
    """Consecutive steps, the linearized motion along them, and their estimated errors.

    The steps have `added` errors of shape (n, 4), and the `errors` at their ends, after that of the
    start, have shape (n + 1, 4).
    """

    steps: Steps
    linear: Linear
    added: Array
    errors: Array


class StepErrors:
    """The estimated error of a run at the ends of its steps, from the steps as they are taken.

    Errors are not carried over steps in which they decay too far: these have no bound.
    """

    def __init__(
        self,
        scene: Scene,
        formulation: EquationsName,
        precision: PrecisionName,
        evaluated_in: PrecisionName | None = None,
    ) -> None:
        """Store the run: a scene, its equations, and its precision.

        Its defects are evaluated in its own precision, by default, or in a longer one, in which
        their round-off is small. Their code took `compile_seconds`.
        """
        self._scene, self._formulation, self._precision = scene, formulation, precision
        self._is_smooth = all(map(is_built_in, scene.effects))
        self.evaluated_in = evaluated_in or precision
        begun = perf_counter()
        self._evaluation = evaluation_of(scene, formulation, self.evaluated_in)
        self._derivatives = jacobians_of(scene, formulation)
        self.compile_seconds = perf_counter() - begun
        self._begin()

    def _begin(self) -> None:
        self._bounds: list[ErrorBounds] = []
        self._parts: list[_Part] = []
        self._carried = np.zeros((4, 7)), np.zeros((4, 4))
        self._count, self._bent = 0, 0.0

    def __call__(self, steps: Steps) -> None:
        """Add steps that continue those before; steps from 0 s begin anew."""
        if steps.starts[0] == 0:
            self._begin()
            self._carried = self._start(steps)
        with np.errstate(all="ignore"):
            # A motion that diverges has no bound.
            polynomials = scaled_polynomials(steps)
            self._add(steps, polynomials, linearized(self._derivatives, steps, polynomials))

    def again(self, evaluated_in: PrecisionName) -> StepErrors | None:
        """Return the errors of the same steps by defects in another precision.

        It is None if the steps were too many to be kept.
        """
        if not self.is_kept:
            return None
        found = StepErrors(self._scene, self._formulation, self._precision, evaluated_in)
        found._carried = found._start(self._parts[0].steps)
        with np.errstate(all="ignore"):
            for part in self._parts:
                found._add(part.steps, scaled_polynomials(part.steps), part.linear)
        return found

    @property
    def longest_step(self) -> float:
        """The longest step (s) of a run whose errors are carried; infinite if this run's are."""
        return min(each.longest_step for each in self._bounds)

    @property
    def is_kept(self) -> bool:
        """Whether the steps are kept, which they are unless they are too many."""
        return self._count <= MOST_KEPT

    def correction(self) -> Correction:
        """Return the estimated error as a function of time; for runs whose steps are kept."""
        return correction_of(
            [(part.linear, part.errors, part.added) for part in self._parts],
            len(self._parts[0].steps.coefficients[0, 0]) - 1,
        )

    def at(self, times: Array) -> Array:
        """Return the bound on the error (rad, rad/s) up to each time (s)."""
        return self._largest([each.errors for each in self._bounds], times)

    def corrected_at(self, times: Array) -> Array:
        """Return the bound (rad, rad/s) up to each time (s) on the error of the corrected run."""
        return self._largest([each.corrected for each in self._bounds], times)

    def left_at(self, times: Array) -> Array:
        """Return `corrected_at` without the round-off of the estimate.

        It is the bound that an evaluation in a longer precision is expected to give.
        """
        return self._largest([each.left for each in self._bounds], times)

    def estimate_at(self, times: Array) -> Array:
        """Return the estimate of the error (rad, rad/s) up to each time (s), without a margin."""
        return self._largest([each.estimates for each in self._bounds], times)

    def round_off_at(self, times: Array) -> Array:
        """Return the standard deviation of the estimate (rad, rad/s) up to each time (s)."""
        return self._largest([each.noise for each in self._bounds], times)

    def _largest(self, values: list[Array], times: Array) -> Array:
        """Return the largest value of the steps up to each time (s)."""
        ends, every = np.concatenate([each.ends for each in self._bounds]), np.concatenate(values)
        place = np.minimum(np.searchsorted(ends, times), len(ends) - 1)
        found: Array = np.maximum.accumulate(every)[place]
        return found

    def _start(self, steps: Steps) -> tuple[Array, Array]:
        """Return the errors of the start, and their covariance by the round-off of its exact value.

        Momenta are rounded.
        """
        own, given = self._evaluation.precision, self._scene
        equations, chain = EQUATIONS[self._formulation], given.moving_chain
        q, u = (tuple(map(own.number, pair)) for pair in (given.q, given.u))
        exact = np.array([*q, *equations.from_speeds(chain.convert(own.number), q, u)])
        missed = (exact - own.lengthened(steps.coefficients[0, :, 0])).astype(float)
        rounded = chain.convert(float), np.array(given.q), np.array(given.u)
        sizes = equations.rounded_starts(*rounded)
        errors = np.concatenate([missed[:, None], np.zeros((4, 6))], axis=1)
        return errors, np.diag((own.rounding * np.array([0.0, 0.0, *sizes])) ** 2)

    def _add(self, steps: Steps, polynomials: Array, linear: Linear) -> None:
        """Add steps, and the linearized motion along them."""
        found = self._evaluation.of(steps, polynomials)
        added = _added(found, linear)
        loads = self._of_loads(linear)
        rates = _rounded_rates(found, linear, loads.errors)
        variances = self._variances(np.abs(rates), found.noise, linear, loads.spread)
        variances += (_OF_SOURCES * added) ** 2 + self._of_turns(found.rates) ** 2
        alike = PRECISIONS[self.evaluated_in].rounding * _alike(rates, linear)
        sources = np.concatenate([added[..., None], alike, found.truncated[..., None]], axis=2)
        known, covariance = self._carried
        errors, covariances = accumulated(
            linear.flows, sources, variances, (known[:, :6], covariance)
        )
        # Flows of a lower order carry other errors.
        apart = (linear.differences @ errors[1:, :, :1])[..., 0]
        lower = carried(linear.flows, apart, known[:, 6])
        errors = np.concatenate([errors, lower[..., None]], axis=2)
        self._carried = errors[-1], covariances[-1]
        bent = self._bent_by(linear, errors[:-1, :, 0])
        rounded = _VALUES * PRECISIONS[self._precision].rounding
        values = of_values(linear, rounded * np.abs(linear.states))
        within = of_values(linear, _within(found, linear))
        fastest = float((np.abs(found.rates[:, :2]) / linear.lengths[:, None]).max())
        found_bounds = error_bounds(linear, (errors, covariances), fastest, values, within)
        self._bounds.append(found_bounds.known_where(bent <= _MOST_BENT))
        self._count += len(linear.lengths)
        if self.is_kept:
            self._parts.append(_Part(steps, linear, added, errors[:, :, 0].copy()))
        else:
            self._parts = []

    def _of_turns(self, rates: Array) -> Array:
        """Return the round-off of steps in which links turn far, shape (n, 4), by their h f."""
        turns = np.abs(rates[:, :2]).sum(axis=1, keepdims=True)
        rounded = PRECISIONS[self._precision].rounding * np.abs(rates)
        return np.where(turns > _MOST_TURN, np.exp(turns) * rounded, 0.0)

    def _bent_by(self, linear: Linear, errors: Array) -> Array:
        """Return the change of the logarithms of flows by the errors so far, in all, shape (n,).

        Loads that are not built in may change within them.
        """
        if self._is_smooth:
            return np.zeros(len(errors))
        states, sizes = linear.states, np.abs(linear.states).max(axis=0).reshape(2, 2).max(axis=1)
        own = np.repeat([max(1.0, sizes[0]), sizes[1] or 1.0], 2)
        at_start, *moved = (
            self._derivatives((states + sign * errors).T, linear.starts) for sign in (0, 1, -1)
        )
        changes = np.max([np.abs(each - at_start) for each in moved], axis=0)
        relative = changes * (own[None, :, None] / own[:, None, None])
        bent = self._bent + np.cumsum(relative.sum(axis=1).max(axis=0) * linear.lengths)
        self._bent = float(bent[-1])
        return np.asarray(bent)

    def _of_loads(self, linear: Linear) -> LoadSizes:
        """Return the round-off of the loads at the starts of steps."""
        q, x = linear.states.T[:2], linear.states.T[2:]
        chain = self._scene.moving_chain
        u = np.array(EQUATIONS[self._formulation].to_speeds(chain, q, x))
        return load_sizes(self._scene, self._formulation, q, u, linear.starts)

    def _variances(self, rates: Array, noise: float, linear: Linear, spread: Array) -> Array:
        """Return the variances of defects by round-off, shape (n, 4).

        `rates` have the round-off of h f. `noise` is the standard deviation of an integral, divided
        by that of a value at a node. `spread`, shape (2, n), is the round-off of loads that differs
        between nodes.
        """
        of_states = (np.abs(linear.scaled[1]) @ np.abs(linear.states)[:, :, None])[:, :, 0]
        # The rates and the slopes of the polynomials are rounded, independently.
        of_values = noise * (of_states + math.sqrt(2) * rates)
        # The start of a step has one rounding of time for all of its nodes.
        of_time = np.abs(linear.by_time) * (linear.lengths * linear.starts)[:, None]
        of_arguments = noise * linear.lengths[:, None] * _second_pair(spread)
        rounding = PRECISIONS[self.evaluated_in].rounding
        return np.asarray(rounding**2 * (of_values**2 + of_time**2 + of_arguments**2))


def _rounded_rates(found: Defects, linear: Linear, loads: Array) -> Array:
    """Return numbers, shape (n, 4), that have the round-off of h f: h f itself, with its sign.

    Where terms of the loads nearly cancel, it is their size, `loads` of shape (2, n).
    """
    of_loads = linear.lengths[:, None] * _second_pair(loads)
    return np.where(of_loads > np.abs(found.rates), of_loads, found.rates)


def _second_pair(values: Array) -> Array:
    """Return values of the second pair of variables, shape (2, n), for all four: (n, 4)."""
    return np.concatenate([np.zeros_like(values), values]).T


def _added(found: Defects, linear: Linear) -> Array:
    """Return the errors that steps add, shape (n, 4): defects are carried over the rest of them.

    The first power of h J varies over the step, and the others have their values at its middle.
    """
    scaled = linear.scaled
    carried = np.zeros_like(found.defects)[..., None]
    for moment in found.moments[: _moments(linear.exponents)][::-1]:
        carried = scaled[1] @ (moment[..., None] + carried)
    firsts = found.firsts[..., None].copy()
    firsts[1] += carried
    return np.asarray(found.defects + (scaled @ firsts).sum(axis=0)[..., 0])


def _within(found: Defects, linear: Linear) -> Array:
    """Return the errors within steps that are not at their ends, shape (n, 4).

    A defect that is constant over a step has twice its first moment, and moves other variables.
    """
    own = 2 * np.abs(found.firsts.sum(axis=0))
    return np.asarray(own + (np.abs(linear.scaled[1]) @ own[..., None])[..., 0] / 2)


def _alike(rates: Array, linear: Linear) -> Array:
    """Return what a rounding of h f adds on each step, one source for each variable: (n, 4, 4).

    The round-off of constants is alike on all steps. On each it is constant, and is carried over
    the rest of it: a chain at rest may take one step.
    """
    sources = rates[:, None] * np.eye(4)
    carried, jacobian = sources, linear.scaled[1]
    for k in range(_OF_CONSTANTS, 1, -1):
        carried = sources + jacobian @ carried / k
    return np.asarray(carried)


def _moments(exponents: Array) -> int:
    """Return the number of moments, from the second on, that count on steps, by the sizes of h J.

    Moment k is multiplied by (h J)^k, and is at most 1/k! of the defect. The first one always
    counts: a size of h J is that of its eigenvalues, which are zero where nothing acts on a chain.
    """
    k = np.arange(2.0, MOMENTS + 1)
    terms = float(exponents.max()) ** k / np.cumprod(k)
    counting = np.flatnonzero(terms > _OF_MOMENTS)
    return int(counting[-1]) + 1 if len(counting) else 0
