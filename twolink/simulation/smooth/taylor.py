"""Motion by Taylor series: a scene's equations compiled by heyoka, in any precision.

The equations are evaluated once on heyoka's expressions with exactly the scene's loads, so the
compiled code has the operations that the scene calls for and no other.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np

from twolink.arithmetic import Pair
from twolink.chain import Chain
from twolink.effects import Effect, breaks
from twolink.errors import IntegrationError, SimulationError
from twolink.optional import heyoka
from twolink.scene import Scene
from twolink.simulation.run import MotionRun
from twolink.simulation.smooth.equations import EQUATIONS

# The order that brings a step down to rounding in each precision. Orders are odd: from the source's
# natural start (q = 0 at rest) only every fourth coefficient of a series in t is there, and an
# order that ends on two missing ones, a multiple of four, sees an endless step.
FULL_ORDERS = {"double": 21, "long double": 23, "quadruple": 41}
PRECISIONS = tuple(FULL_ORDERS)


# At so many times between start and end is looked at what acts.
_LOOKS = 33

# So long (s) an integrator may run before it is compiled again, optimised, which takes as long.
_WORTH_OPTIMISING = 0.4


def step_tolerance(precision: str, order: int | None = None) -> float:
    """Return the tolerance of a step for which heyoka takes an order; by default the full one.

    heyoka takes the smallest order p with exp(−2 (p − 1)) below the tolerance (Jorba and Zou, A
    software package for the numerical integration of ODEs by means of high-order Taylor methods,
    2005, section 3.2).
    """
    return math.exp(-2 * ((order or FULL_ORDERS[precision]) - 1) + 0.4)


def numbers(values: Any, precision: str) -> Any:
    """Return an array of numbers of a precision."""
    kind = number_type(precision)
    if precision in ("double", "long double"):
        return np.asarray(values, dtype=kind)
    return np.array([kind(value) for value in values])


def rounding(precision: str) -> float:
    """Return the distance from 1 to the next number of a precision."""
    return {"double": 2.0**-52, "long double": 2.0**-63, "quadruple": 2.0**-112}[precision]


def compact(precision: str) -> bool:
    """Return whether a precision's integrators are compiled as loops, and not unrolled.

    Quadruple numbers are computed by calls of a library: loops of them are compiled fifty times as
    fast, take a twentieth longer, and leave nothing to optimise.
    """
    return precision == "quadruple"


def heyoka_is_here() -> bool:
    """Return whether heyoka can be imported."""
    try:
        heyoka()
    except SimulationError:
        return False
    return True


def number_type(precision: str) -> Any:
    """Return the kind of number that heyoka computes with in a precision."""
    kinds = {"double": float, "long double": np.longdouble}
    return kinds[precision] if precision in kinds else heyoka().real128


class TaylorRun(MotionRun):
    """A motion without events, by one run of one integrator."""

    def dense(self) -> Callable[..., tuple[Any, Any]]:
        """Return q and u as functions of time (s): the very polynomials of this run's steps."""
        compiled, kind = _ready(self.scene, self.formulation, self.precision, self.order)
        *_, output, _ = compiled.integrator.propagate_until(
            kind(self.scene.duration), c_output=True, max_delta_t=kind(self.longest_step)
        )
        equations, chain = EQUATIONS[self.formulation], compiled.chain

        def at(times: Any, side: str = "right") -> tuple[Any, Any]:
            variables = np.array(output(numbers(times, self.precision))).T
            q, second = variables[:2], variables[2:]
            return q, np.array(equations.to_speeds(chain, q, second))

        return at


def taylor_run(
    scene: Scene,
    times: Any,
    *,
    formulation: str,
    precision: str = "double",
    order: int | None = None,
    longest_step: float | None = None,
    optimised: bool = False,
    progress: Callable[[float], None] | None = None,
) -> TaylorRun:
    """Return a scene's motion by Taylor series at increasing times (s), the first of them 0.

    Each step goes to rounding, unless a lower `order` is given; `longest_step` (s) caps it. With
    `optimised` the integrator is compiled for long use at once. Raises `SimulationError` when the
    motion cannot be followed to the last time. `progress` is told the share that is done.
    """
    start = perf_counter()
    compiled, kind = _ready(scene, formulation, precision, order)
    if not compiled.optimised and (optimised or compiled.spent > _WORTH_OPTIMISING):
        compiled.optimise()
        compiled, kind = _ready(scene, formulation, precision, order)
    compile_seconds = perf_counter() - start
    integrator = compiled.integrator
    cap = longest_step or default_longest_step(scene)
    start = perf_counter()
    told = {} if progress is None else {"callback": _Teller(progress, scene.duration)}
    outcome, _, _, steps, _, variables = integrator.propagate_grid(
        numbers(times, precision), max_delta_t=kind(cap), **told
    )
    run_seconds = perf_counter() - start
    compiled.spent += run_seconds
    if outcome != heyoka().taylor_outcome.time_limit:
        raise IntegrationError(
            f"the motion could not be followed beyond {float(integrator.time):.6g} s "
            f"({outcome.name}); allowed are scenes whose motion stays finite until "
            f"{scene.duration:.6g} s"
        )
    q, second = np.array(variables).T[:2], np.array(variables).T[2:]
    return TaylorRun(
        scene=scene,
        formulation=formulation,
        precision=precision,
        longest_step=cap,
        q=q,
        u=np.array(EQUATIONS[formulation].to_speeds(compiled.chain, q, second)),
        steps=steps,
        order=integrator.order,
        operations=compiled.operations,
        compile_seconds=compile_seconds,
        run_seconds=run_seconds,
    )


class _Teller:
    """A callback of heyoka's that tells now and then which share of a run is done."""

    _EVERY = 256

    def __init__(self, progress: Callable[[float], None], duration: float) -> None:
        self._progress, self._duration, self._steps = progress, duration, 0

    def __call__(self, integrator: Any) -> bool:
        self._steps += 1
        if self._steps % self._EVERY == 0:
            self._progress(float(integrator.time) / self._duration)
        return True


def default_longest_step(scene: Scene) -> float:
    """Return the longest step to allow (s), from how fast the scene starts, and is driven later.

    The series of a chain that turns through a radian in a time τ does not converge much beyond τ.
    A longer step is one that the last coefficients, vanishing by some symmetry, have feigned: that
    of a torque which begins as t³, for one, pushes a chain at rest by t⁵ and then by t¹⁵.
    """
    later = np.linspace(0.0, scene.duration, _LOOKS)
    jumps = [t for t in breaks(scene.effects) if 0 < t < scene.duration]
    times = np.union1d(later, jumps)
    # From where the chain stands, by all that acts then.
    lagrange = EQUATIONS["lagrange"]
    _, rates = lagrange.rates(scene.equipped, scene.effects, scene.q, scene.u, times)
    if not all(np.isfinite(du).all() for du in rates):
        raise SimulationError(
            f"from q = {scene.q!r} and u = {scene.u!r} the accelerations are no finite numbers; "
            "allowed are speeds and loads that float64 can follow"
        )
    strongest = max(float(np.abs(du).max()) for du in rates)
    fastest = max(*(abs(float(u)) for u in scene.u), math.sqrt(strongest), 1e-300)
    return min(scene.duration, 1 / fastest)


@dataclass
class _Compiled:
    """An integrator that is ready for any start, and the chain in its numbers.

    heyoka compiles fifteen times as fast without optimising, and what it compiles then takes less
    than twice as long. So it optimises what has run for as long as that takes (`spent`, in s).
    """

    make: Callable[[int], Any]
    chain: Chain
    spent: float = 0.0
    optimised: bool = False

    def __post_init__(self) -> None:
        self.integrator = self.make(0)
        self.operations = len(self.integrator.decomposition) - 8

    def optimise(self) -> None:
        """Compile again, to the best that heyoka can do."""
        if not self.optimised:
            self.integrator, self.optimised = self.make(3), True


def _ready(
    scene: Scene, formulation: str, precision: str, order: int | None
) -> tuple[_Compiled, Any]:
    """Return a scene's compiled integrator, set to its start, and its kind of number."""
    compiled = _compiled(
        scene.equipped,
        scene.effects,
        formulation,
        precision,
        order or FULL_ORDERS[precision],
        scene.equipped._exact_inertia,
    )
    kind = number_type(precision)
    q = (kind(scene.q[0]), kind(scene.q[1]))
    u = (kind(scene.u[0]), kind(scene.u[1]))
    second = EQUATIONS[formulation].from_speeds(compiled.chain, q, u)
    compiled.integrator.state[:] = [*q, *second]
    compiled.integrator.time = kind(0)
    return compiled, kind


@functools.lru_cache(maxsize=128)
def _compiled(
    chain: Chain,
    effects: tuple[Effect, ...],
    formulation: str,
    precision: str,
    order: int,
    exact_inertia: Pair | None,
) -> _Compiled:
    """Return a compiled integrator, kept for scenes that differ in their start alone.

    `exact_inertia` is part of the key because chains that differ in it alone count as equal.
    """
    hy = heyoka()
    kind = number_type(precision)
    own = chain.convert(kind)
    names = ("q1", "q2", "x1", "x2")
    q1, q2, x1, x2 = hy.make_vars(*names)
    first, second = EQUATIONS[formulation].rates(own, effects, (q1, q2), (x1, x2), hy.time)
    system = list(zip((q1, q2, x1, x2), (*first, *second), strict=True))
    zeros = np.array([kind(0)] * 4)
    tolerance = kind(step_tolerance(precision, order))

    def make(level: int) -> Any:
        return hy.taylor_adaptive(
            system,
            zeros,
            tol=tolerance,
            fp_type=kind,
            opt_level=level,
            compact_mode=compact(precision),
        )

    return _Compiled(make, own, optimised=compact(precision))
