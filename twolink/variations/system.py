"""Variational equations: a motion and its derivatives as one system of differential equations.

The numbers of a scene become value + slope · p with a run-time parameter p for each direction,
which is zero. heyoka differentiates the equations of motion by p, and the derivatives of the start
are the start of the derivatives. Those of momenta, and back to speeds, are by dual numbers.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from twolink.accuracy.dual import Dual
from twolink.chain import Chain
from twolink.ensembles.numbers import numbers_in, with_numbers
from twolink.errors import SimulationError, TwolinkError
from twolink.integration.outcomes import check_arrival
from twolink.integration.precisions import PRECISIONS, Code, PrecisionName
from twolink.names import EquationsName
from twolink.optional import heyoka
from twolink.scene import Scene
from twolink.simulation.pool import IntegratorPool
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.simulation.smooth.longest_step import default_longest_step
from twolink.simulation.smooth.taylor import parts_of_run
from twolink.values import Content
from twolink.variations.directions import Direction

# Loops: the unrolled code of so many equations takes seconds to compile.
_CODE = Code(compact=True, level=0)

Slopes = tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class VariedMotion:
    """A motion q, u of shape (2, n), and its derivatives dq, du of shape (k, 2, n).

    They are in the numbers of the `precision`; `steps` were taken by the equations of the
    `formulation`.
    """

    q: Any
    u: Any
    dq: Any
    du: Any
    formulation: EquationsName
    precision: PrecisionName
    steps: int


def varied_motion(
    scene: Scene,
    directions: Sequence[Direction],
    times: Any,
    formulation: EquationsName,
    precision: PrecisionName,
    progress: Callable[[float], None],
) -> VariedMotion:
    """Return a smooth motion and its derivatives at increasing times (s), the first of them 0.

    Truncation errors are at round-off. Raises `SimulationError` if the motion cannot be integrated
    to the last time, or the equations cannot be differentiated. `progress` receives the completed
    share.
    """
    system = VariedSystem.of(scene, directions, formulation, precision)
    grid = PRECISIONS[precision].array(times)
    cap = default_longest_step(scene)
    rows, steps = [], 0
    with system.pool.lend() as integrator:
        integrator.state[:] = system.start(scene, directions)
        integrator.time = grid[0]
        for outcome, taken, known in parts_of_run(integrator, precision, grid, cap):  # noqa: B007
            rows.append(known)
            steps += taken
            progress(float(integrator.time) / scene.duration)
        check_arrival(outcome, float(integrator.time), scene.duration)
    q, u, dq, du = system.in_speeds(np.concatenate(rows).T)
    return VariedMotion(q, u, dq, du, formulation, precision, steps)


@dataclass(frozen=True)
class VariedSystem:
    """Compiled variational equations, for any start of a scene.

    `places`, shape (4, k), are those of the derivatives among the variables of the integrator,
    which are four of the motion before them.
    """

    pool: IntegratorPool
    places: Any
    chain: Chain
    slopes: Slopes
    formulation: EquationsName
    precision: PrecisionName

    @classmethod
    def of(
        cls,
        scene: Scene,
        directions: Sequence[Direction],
        formulation: EquationsName,
        precision: PrecisionName,
        code: Code | None = None,
    ) -> VariedSystem:
        """Return the system of a scene, compiled at its first use."""
        chain, slopes = scene.moving_chain, tuple(each.numbers for each in directions)
        code = code or (_CODE if precision == "double" else PRECISIONS[precision].code)
        pool, places = _compiled(
            Content((chain,)), Content(scene.effects), slopes, formulation, precision, code
        )
        return cls(pool, places, chain, slopes, formulation, precision)

    def start(self, scene: Scene, directions: Sequence[Direction]) -> Any:
        """Return the variables of the integrator at the start of a scene."""
        own = PRECISIONS[self.precision]

        def dual(values: Any, slopes: list[Any]) -> tuple[Dual, Dual]:
            first, second = np.array(slopes).T
            return tuple(  # type: ignore[return-value]
                Dual(own.number(x), own.array(along)[:, None])
                for x, along in zip(values, (first, second), strict=True)
            )

        q = dual(scene.q, [each.q for each in directions])
        u = dual(scene.u, [each.u for each in directions])
        x = EQUATIONS[self.formulation].from_speeds(self._dual_chain, q, u)
        found = own.array(np.zeros(4 + self.places.size))
        found[:4] = [variable.value for variable in (*q, *x)]
        for place, variable in zip(self.places, (*q, *x), strict=True):
            found[place] = variable.slope[:, 0]
        return found

    def in_speeds(self, variables: Any) -> tuple[Any, Any, Any, Any]:
        """Return q, u, shape (2, n), and their derivatives, shape (k, 2, n), of variables."""
        q1, q2, x1, x2 = (
            Dual(variables[k], variables[place]) for k, place in enumerate(self.places)
        )
        equations = EQUATIONS[self.formulation]
        u1, u2 = equations.to_speeds(self._dual_chain, (q1, q2), (x1, x2))
        values = np.array([q1.value, q2.value]), np.array([u1.value, u2.value])
        dq, du = (np.stack([a.slope, b.slope], axis=1) for a, b in ((q1, q2), (u1, u2)))
        return *values, dq, du

    @functools.cached_property
    def _dual_chain(self) -> Any:
        """The chain of dual numbers, whose slopes have shape (k, 1)."""
        own = PRECISIONS[self.precision]
        exact = _leaves(self.chain.convert(own.number))
        slopes = np.array(self.slopes).reshape(len(self.slopes), -1)
        if not slopes.size:
            # No number varies, as in the directions of a spectrum.
            slopes = np.zeros((len(self.slopes), len(exact)))
        columns = (own.array(column)[:, None] for column in slopes.T)
        duals = [Dual(value, column) for value, column in zip(exact, columns, strict=False)]
        return with_numbers(self.chain.convert(float), iter(duals))


@functools.lru_cache(maxsize=64)
def _compiled(
    chain: Content,
    effects: Content,
    slopes: Slopes,
    formulation: EquationsName,
    precision: PrecisionName,
    code: Code,
) -> tuple[IntegratorPool, Any]:
    """Return compiled integrators, cached for scenes that differ only in their start."""
    hy = heyoka()
    own = PRECISIONS[precision]
    equations = _equations(chain.objects[0], effects.objects, slopes, formulation, own.number)
    integrator = hy.taylor_adaptive(
        hy.var_ode_sys(equations, [hy.par[k] for k in range(len(slopes))]),
        np.array([own.number(0)] * 4),
        tol=own.number(own.step_tolerance()),
        fp_type=own.number,
        opt_level=code.level,
        compact_mode=code.compact,
    )
    return IntegratorPool(integrator), _places(integrator, len(slopes))


def check_form(scene: Scene, direction: Direction, name: str) -> None:
    """Raise `SimulationError` unless the equations can be written with a parameter as a symbol."""
    slopes = (direction.numbers,)
    try:
        for formulation in EQUATIONS:
            _equations(scene.moving_chain, scene.effects, slopes, formulation, float)
    except (TypeError, ValueError, AttributeError, TwolinkError) as error:
        raise SimulationError(
            f"{name} must be a number by which the equations can be differentiated; got one that"
            f" has to be a float in them ({error})"
        ) from error


def _equations(
    chain: Chain, effects: Any, slopes: Slopes, formulation: EquationsName, kind: Any
) -> list[tuple[Any, Any]]:
    """Return the equations of motion in heyoka's symbols, with parameters in the numbers."""
    hy = heyoka()
    q1, q2, x1, x2 = hy.make_vars("q1", "q2", "x1", "x2")
    moved = _moved(chain, effects, slopes, kind)
    first, second = EQUATIONS[formulation].rates(*moved, (q1, q2), (x1, x2), hy.time)
    return list(zip((q1, q2, x1, x2), (*first, *second), strict=True))


def _moved(chain: Chain, effects: Any, slopes: Slopes, kind: Any) -> tuple[Any, Any]:
    """Return chain and effects with numbers that depend on the run-time parameters."""
    exact = chain.convert(kind)
    if not any(map(any, slopes)):
        return exact, effects
    numbers = [*_leaves(exact), *numbers_in(effects)[0]]
    for k, along in enumerate(slopes):
        for place, slope in enumerate(along):
            if slope:
                numbers[place] = numbers[place] + kind(slope) * heyoka().par[k]
    moved: tuple[Any, Any] = with_numbers((chain, effects), iter(numbers))
    return moved


def _leaves(chain: Chain) -> list[Any]:
    """Return the numbers of a chain of any kind, in the order of `numbers_in`."""

    def flat(thing: Any) -> list[Any]:
        return (
            [leaf for part in thing for leaf in flat(part)] if isinstance(thing, tuple) else [thing]
        )

    return flat((chain.mass, chain.length, chain.centre, chain.inertia, chain.rotors))


def _places(integrator: Any, count: int) -> Any:
    """Return the places of the derivatives of the four variables, shape (4, count)."""
    found = np.empty((4, count), int)
    for place in range(len(integrator.state)):
        variable, *orders = integrator.get_mindex(place)
        if any(orders):
            found[variable, orders.index(1)] = place
    return found
