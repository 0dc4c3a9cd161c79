"""Variational equations: a motion and its derivatives as one system of differential equations.

The numbers of a scene become value + slope · p with a run-time parameter p for each direction,
which is zero. heyoka differentiates the equations of motion by p, and the derivatives of the start
are the start of the derivatives. Those of momenta, and back to speeds, are by dual numbers.

At a discontinuity of an effect in time the variables are continuous, as its time is fixed. From one
to the next another piece of the effect acts, whose numbers are parameters of one compiled system.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from twolink.accuracy.dual import Dual
from twolink.arithmetic import Scalar, exactly
from twolink.chain import Chain
from twolink.effects import ParametricEffect, pieces_at
from twolink.ensembles.numbers import numbers_in, with_numbers
from twolink.errors import SimulationError, TwolinkError
from twolink.integration.outcomes import check_arrival
from twolink.integration.precisions import PRECISIONS, Code, PrecisionName
from twolink.names import EquationsName
from twolink.optional import heyoka
from twolink.scene import Scene
from twolink.simulation.pool import IntegratorPool
from twolink.simulation.smooth.equations import EQUATIONS, expressions_of
from twolink.simulation.smooth.integrators import parts_of_run
from twolink.simulation.smooth.longest_step import default_longest_step
from twolink.simulation.smooth.pieces import pieces_of
from twolink.values import Content
from twolink.variations.directions import Direction
from twolink.variations.pieces import SlopesOfPieces, slopes_of_pieces, varies_pieces

# Loops: the unrolled code of so many equations takes seconds to compile.
_CODE = Code(compact=True, level=0)

Slopes = tuple[tuple[Scalar, ...], ...]


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
    own, cap = PRECISIONS[precision], default_longest_step(scene)
    systems = VariedSystems.of(scene, directions, formulation, precision)
    system = systems.at(0.0, pieces_at(scene.effects, 0.0))
    state = system.start(scene, directions)
    rows, steps = [state[None]], 0
    for piece, effects in pieces_of(scene, times):
        system = systems.at(float(piece[0]), effects)
        parts, grid = [], own.array(piece)
        with system.pool.lend() as integrator:
            integrator.state[:] = state
            integrator.pars[:] = own.array(system.numbers)[: len(integrator.pars)]
            integrator.time = grid[0]
            for outcome, taken, known in parts_of_run(integrator, precision, grid, cap):  # noqa: B007
                parts.append(known)
                steps += taken
                progress(float(integrator.time) / scene.duration)
            check_arrival(outcome, float(integrator.time), scene.duration)
        reached = np.concatenate(parts)
        state = reached[-1]
        rows.append(reached[1:][np.isin(piece[1:], times)])
    q, u, dq, du = system.in_speeds(np.concatenate(rows).T)
    return VariedMotion(q, u, dq, du, formulation, precision, steps)


@dataclass(frozen=True)
class VariedSystem:
    """Compiled variational equations between two discontinuities, for any start of a scene.

    `places`, shape (4, k), are those of the derivatives among the variables of the integrator,
    which are four of the motion before them. `numbers` are the run-time parameters of the
    equations, k zeros and those in which the pieces of effects differ, in the numbers of the
    precision.
    """

    pool: IntegratorPool
    places: Any
    numbers: tuple[Scalar, ...]
    chain: Chain
    slopes: Slopes
    formulation: EquationsName
    precision: PrecisionName

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
        slopes: Any = np.array(self.slopes).reshape(len(self.slopes), -1)
        if not slopes.size:
            # No number varies, as in the directions of a spectrum.
            slopes = np.zeros((len(self.slopes), len(exact)))
        columns = (own.array(column)[:, None] for column in slopes.T)
        duals = [Dual(value, column) for value, column in zip(exact, columns, strict=False)]
        return with_numbers(self.chain.convert(float), iter(duals))


@dataclass(frozen=True)
class VariedSystems:
    """The systems of a scene, one for each piece of its effects, by their slopes over time.

    `varied` has the numbers of the directions that change the pieces of effects.
    """

    chain: Chain
    slopes: tuple[SlopesOfPieces, ...]
    varied: tuple[int, ...]
    formulation: EquationsName
    precision: PrecisionName
    code: Code

    @classmethod
    def of(
        cls,
        scene: Scene,
        directions: Sequence[Direction],
        formulation: EquationsName,
        precision: PrecisionName,
        code: Code = _CODE,
    ) -> VariedSystems:
        """Return the systems of a scene; raises `SimulationError` where there are none."""
        slopes = tuple(slopes_of_pieces(scene, each) for each in directions)
        varied = tuple(k for k, each in enumerate(directions) if varies_pieces(scene, each))
        return cls(scene.moving_chain, slopes, varied, formulation, precision, code)

    def at(self, t: float, effects: tuple[Any, ...]) -> VariedSystem:
        """Return the system of the effects from a time (s) on, compiled at its first use."""
        slopes = tuple(each(t) for each in self.slopes)
        form, numbers = _form(self.chain, effects, slopes, self.varied)
        both = Content((self.chain,)), Content(form.effects)
        pool, places = _compiled(
            *both, form.slopes, form.varied, self.formulation, self.precision, self.code
        )
        own = PRECISIONS[self.precision]
        parameters = tuple(exactly(number, own.number) for number in numbers)
        return VariedSystem(
            pool, places, parameters, self.chain, slopes, self.formulation, self.precision
        )


class _Form(NamedTuple):
    """The effects of a piece and the slopes of all numbers, without those that are parameters.

    `varied` has the numbers of the directions in which such numbers have slopes.
    """

    effects: tuple[Any, ...]
    slopes: Slopes
    varied: tuple[int, ...]


def _form(
    chain: Chain, effects: tuple[Any, ...], slopes: Slopes, varied: tuple[int, ...]
) -> tuple[_Form, tuple[Scalar, ...]]:
    """Return the form of a piece, which other pieces share, and its run-time parameters.

    These are zero for each direction, then the numbers of parametric effects, and their slopes in
    each direction that is `varied`.
    """
    places = _parametric(chain, effects)
    numbers = numbers_in((chain, effects))[0]
    parameters: list[Scalar] = [0.0] * len(slopes) + _parameters(effects)
    for direction in varied:
        parameters += [slopes[direction][k] for k in places]
    others: list[Any] = [0.0 if k in places else x for k, x in enumerate(numbers)]
    blank = with_numbers((chain, effects), iter(others))[1] if places else effects
    rest = tuple(tuple(0.0 if k in places else x for k, x in enumerate(row)) for row in slopes)
    return _Form(blank, rest, varied), tuple(parameters)


def _parameters(effects: tuple[Any, ...]) -> list[Scalar]:
    """Return the numbers of parametric effects, in the order of `numbers_in`.

    Those of a piece may have more digits than the floats in its fields.
    """
    found: list[Scalar] = []
    for effect in effects:
        if isinstance(effect, ParametricEffect):
            floats = numbers_in(effect)[0]
            found += effect.numbers if list(map(float, effect.numbers)) == floats else floats
    return found


def _parametric(chain: Chain, effects: tuple[Any, ...]) -> tuple[int, ...]:
    """Return the places among all numbers of those of parametric effects."""
    found: list[int] = []
    place = len(numbers_in(chain)[0])
    for effect in effects:
        count = len(numbers_in(effect)[0])
        found += range(place, place + count) if isinstance(effect, ParametricEffect) else ()
        place += count
    return tuple(found)


@functools.lru_cache(maxsize=64)
def _compiled(
    chain: Content,
    effects: Content,
    slopes: Slopes,
    varied: tuple[int, ...],
    formulation: EquationsName,
    precision: PrecisionName,
    code: Code,
) -> tuple[IntegratorPool, Any]:
    """Return compiled integrators, cached for scenes that differ only in their start."""
    hy = heyoka()
    own = PRECISIONS[precision]
    form = _Form(effects.objects, slopes, varied)
    equations = _equations(chain.objects[0], form, formulation, own.number)
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
    effects = pieces_at(scene.effects, 0.0)
    try:
        slopes = (slopes_of_pieces(scene, direction)(0.0),)
        varied = (0,) if varies_pieces(scene, direction) else ()
        form, _ = _form(scene.moving_chain, effects, slopes, varied)
        for formulation in EQUATIONS:
            _equations(scene.moving_chain, form, formulation, float)
    except (TypeError, ValueError, AttributeError, TwolinkError) as error:
        raise SimulationError(
            f"{name} must be a number by which the equations can be differentiated; got one that"
            " has to be a float in them"
        ) from error


def _equations(
    chain: Chain, form: _Form, formulation: EquationsName, kind: Any
) -> list[tuple[Any, Any]]:
    """Return the equations of motion in heyoka's symbols, with parameters in the numbers."""
    return expressions_of(formulation, *_moved(chain, form, kind), kind)


def _moved(chain: Chain, form: _Form, kind: Any) -> tuple[Any, Any]:
    """Return chain and effects with numbers that depend on the run-time parameters."""
    exact, effects, par = chain.convert(kind), form.effects, heyoka().par
    places = _parametric(chain, effects)
    if not places and not any(map(any, form.slopes)):
        return exact, effects
    numbers = [*_leaves(exact), *numbers_in(effects)[0]]
    for k, along in enumerate(form.slopes):
        for place, slope in enumerate(along):
            if slope:
                numbers[place] = numbers[place] + kind(slope) * par[k]
    parameters = itertools.count(len(form.slopes))
    for place in places:
        numbers[place] = par[next(parameters)]
    for k in form.varied:
        for place in places:
            numbers[place] = numbers[place] + par[next(parameters)] * par[k]
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
