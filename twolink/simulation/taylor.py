"""Motion by Taylor series: a scene's equations compiled by heyoka, in any precision.

The equations are evaluated once on heyoka's expressions with exactly the scene's loads, so the
compiled code has the operations that the scene calls for and no other.
"""

from __future__ import annotations

import functools
import math
import sys
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np

from twolink.arithmetic import Pair
from twolink.chain import Chain
from twolink.effects import Effect
from twolink.errors import SimulationError
from twolink.scene import Scene
from twolink.simulation.equations import EQUATIONS, Equations

# Digits (bits) of each precision, and the most that can be asked of it.
PRECISIONS = {"double": 53, "long double": 64, "quadruple": 113}


def heyoka() -> Any:
    """Return the module heyoka.

    Where SymPy is installed, heyoka imports it, which takes seconds and is of no use here: it is
    kept out of the way. Raises `SimulationError` where heyoka is not installed.
    """
    hidden = "sympy" not in sys.modules and "heyoka" not in sys.modules
    if hidden:
        sys.modules["sympy"] = None  # type: ignore[assignment]
    try:
        import heyoka
    except ImportError as error:
        raise SimulationError(
            "heyoka is not installed; allowed is version 7 or later (pip install heyoka), or "
            "method DOP853"
        ) from error
    finally:
        if hidden:
            del sys.modules["sympy"]
    return heyoka


def number_type(precision: str) -> Any:
    """Return the kind of number that heyoka computes with in a precision."""
    kinds = {"double": float, "long double": np.longdouble}
    return kinds[precision] if precision in kinds else heyoka().real128


@dataclass(frozen=True)
class TaylorRun:
    """A motion as Taylor polynomials: what an integration leaves behind.

    `output` is heyoka's continuous output in the equations' variables; `steps` were taken to
    reach `end` (s), and `seconds` of compiling and of running were spent.
    """

    output: Any
    equations: Equations
    chain: Chain
    precision: str
    steps: int
    order: int
    operations: int
    end: float
    compile_seconds: float
    run_seconds: float

    def at(self, times: Any) -> tuple[Any, Any]:
        """Return q (rad) and u (rad/s), each of shape (2, n), at times (s) within the run."""
        kind = number_type(self.precision)
        moments = np.array([kind(t) for t in np.atleast_1d(times)])
        variables = np.array(self.output(moments)).T
        q, second = variables[:2], variables[2:]
        return q, np.array(self.equations.to_speeds(self.chain, q, second))


def taylor_run(
    scene: Scene, formulation: str, precision: str = "double", tolerance: float | None = None
) -> TaylorRun:
    """Return a scene's motion by Taylor series.

    `tolerance` is heyoka's, for a step; by default the precision's own. Raises `SimulationError`
    when the motion cannot be followed to its end.
    """
    equations = EQUATIONS[formulation]
    start = perf_counter()
    cached = _compiled(
        scene.chain, scene.effects, formulation, precision, tolerance, scene.chain._exact_inertia
    )
    compile_seconds = perf_counter() - start
    integrator = cached.integrator
    kind = number_type(precision)
    q = tuple(kind(x) for x in scene.q)
    u = tuple(kind(x) for x in scene.u)
    integrator.state[:] = [*q, *equations.from_speeds(cached.chain, q, u)]
    integrator.time = kind(0)
    start = perf_counter()
    outcome, _, _, steps, output, _ = integrator.propagate_until(
        kind(scene.duration), c_output=True, max_delta_t=kind(longest_step(scene))
    )
    run_seconds = perf_counter() - start
    if outcome != heyoka().taylor_outcome.time_limit:
        raise SimulationError(
            f"the motion could not be followed beyond {float(integrator.time):.6g} s of "
            f"{scene.duration:.6g} s ({outcome.name}); allowed are scenes whose motion stays finite"
        )
    return TaylorRun(
        output=output,
        equations=equations,
        chain=cached.chain,
        precision=precision,
        steps=steps,
        order=integrator.order,
        operations=len(integrator.decomposition) - 8,
        end=scene.duration,
        compile_seconds=compile_seconds,
        run_seconds=run_seconds,
    )


def longest_step(scene: Scene) -> float:
    """Return the longest step to allow (s).

    From a symmetric start the highest derivatives can all vanish, and a step that is chosen by
    them would be endless. A fraction of the time in which the chain falls or turns through about
    a radian is never much shorter than the step that is needed.
    """
    rates = EQUATIONS["lagrange"].rates(scene.chain, scene.effects, scene.q, scene.u, 0.0)[1]
    fastest = max(
        *(abs(float(u)) for u in scene.u), *(math.sqrt(abs(float(du))) for du in rates), 1e-300
    )
    return min(scene.duration, 0.5 / fastest)


@dataclass(frozen=True)
class _Compiled:
    """An integrator that is ready for any start, and the chain in its numbers."""

    integrator: Any
    chain: Chain


@functools.lru_cache(maxsize=32)
def _compiled(
    chain: Chain,
    effects: tuple[Effect, ...],
    formulation: str,
    precision: str,
    tolerance: float | None,
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
    options = {} if tolerance is None else {"tol": kind(tolerance)}
    zeros = np.array([kind(0)] * 4)
    integrator = hy.taylor_adaptive(system, zeros, fp_type=_fp_type(precision), **options)
    return _Compiled(integrator, own)


def _fp_type(precision: str) -> Any:
    return number_type(precision)
