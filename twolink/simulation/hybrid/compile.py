"""Compilation of a mode to a heyoka integrator, in any precision, on first use.

The variables of the integrator are q and u, the gap of each open contact, the residual depth of
each damped surface that has not recovered, and √depth for each law that depends on it. With √depth
the independent variable is not time but s, with dt = √depth ds, in which the motion is analytic
from the first touch to the last; time is then a variable as well.

An event function f that is not one of these variables is computed from its integral, an additional
variable whose rate is f: the Taylor coefficients of f are those of the integral times 1, 2, 3, …
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from twolink.contact.elements import ContactElement
from twolink.contact.states import ContactState, EventKind
from twolink.effects import Effect, ParametricEffect, contact_elements
from twolink.formulations import FORMULATIONS
from twolink.integration.expressions import plain, precise
from twolink.integration.precisions import PRECISIONS
from twolink.names import FormulationName
from twolink.optional import heyoka
from twolink.simulation.hybrid.compiled import CompiledMode, Watched
from twolink.simulation.hybrid.dynamics import (
    Solution,
    held_coordinates,
    is_fixed,
    mode_solution,
)
from twolink.simulation.hybrid.event_functions import EDGES, OF_GAP, Surfaces, triggers, value
from twolink.simulation.hybrid.kind import Kind, Target
from twolink.simulation.hybrid.mode import Mode
from twolink.simulation.hybrid.pace import factors_of_pace, product
from twolink.simulation.hybrid.pose import Pose
from twolink.simulation.hybrid.stepper import Stepper
from twolink.simulation.hybrid.system import HybridSystem
from twolink.simulation.pool import IntegratorPool
from twolink.values import Content


@functools.lru_cache(maxsize=512)
def compiled_kind(kind: Kind, target: Target) -> CompiledMode:
    """Return the integrators of a kind of modes, cached for all arcs and runs."""
    hy, number = heyoka(), PRECISIONS[target.precision].number
    parameters = itertools.count()
    effects = _with_parameters(kind.effects.objects, parameters, number)
    (chain,) = kind.chain.objects
    own = chain.convert(number)
    elements = contact_elements(effects, own)
    system = HybridSystem(
        chain, own, FORMULATIONS[target.formulation].equations, effects, elements,
        target.precision, safe_order(elements, target.order), number, 0.0, 0.0,
    )  # fmt: skip
    mode = kind.mode
    mode = mode.with_numbers(tuple(precise(hy.par[next(parameters)], number) for _ in mode.numbers))
    elements = _with_frictions(system.elements, mode.states, parameters, number)
    system = replace(system, elements=_with_places(elements, parameters, number))
    builder = _Builder(system, mode, kind.recovering, next(parameters))
    return builder.compiled(kind)


Compilation = Callable[[Kind, Target], CompiledMode]
"""A function that returns the integrators of a kind of modes."""


@dataclass(frozen=True)
class Compiler:
    """The compiler of the modes that a run enters, by a formulation.

    `compiled` returns the code of a kind of modes, which may have been compiled before.
    """

    formulation: FormulationName
    compiled: Compilation = compiled_kind

    def mode(
        self,
        system: HybridSystem,
        mode: Mode,
        recovering: tuple[int, ...] = (),
        *,
        optimised: bool = False,
    ) -> CompiledMode:
        """Return the integrator of a mode, compiled on first use; `Kind` has the arguments."""
        # Two dents in one phase differ in parameters.
        phases = tuple([dent and dent.phase for dent in mode.dents]) if mode.dents else ()
        key = mode.states, phases, recovering, self.formulation, optimised
        found: CompiledMode | None = system.compiled.get(key)
        if found is None:
            # Systems whose effects differ only in parameters share integrators.
            chain, effects = Content((system.scene_chain,)), system.content
            kind = Kind(chain, effects, mode.kind, recovering, optimised)
            shared = self.compiled(kind, Target(self.formulation, system.precision, system.order))
            found = system.compiled[key] = shared.turned(mode.states)
        return found


def safe_order(elements: Sequence[ContactElement], order: int | None) -> int | None:
    """Return the order of Taylor series whose last two coefficients determine the steps.

    From a touch on, only every fifth coefficient in s is large, where dt/ds = √depth: those of u
    from 0, of √depth from 1, and of q and t from 2. If p is 4 modulo 5 none of them is p or p - 1,
    and the steps would be too long by far; the order is then p + 2.
    """
    if order is None or order % 5 != 4 or not any(map(_is_rooted, elements)):
        return order
    return order + 2


class _Builder:
    """The variables, rates and event functions of a mode, as heyoka's expressions."""

    def __init__(
        self, system: HybridSystem, mode: Mode, recovering: tuple[int, ...], numbers: int
    ) -> None:
        """Name the variables of a mode; the first parameter that is free is `numbers`."""
        hy = heyoka()
        self._system, self._mode, self._numbers = system, mode, numbers
        self._recovering = recovering
        self._q = self._named("q1"), self._named("q2")
        self._u = self._named("u1"), self._named("u2")
        states = list(enumerate(zip(system.elements, mode.states, strict=True)))
        self._gaps = {
            i: self._named(f"gap{i}")
            for i, (element, state) in states
            if element.normal is not None and state is ContactState.OPEN
        }
        self._depths = {i: self._named(f"recovering{i}") for i in recovering}
        self._roots = {
            i: self._named(f"root{i}")
            for i, (element, state) in states
            if _is_rooted(element) and state is not ContactState.OPEN
        }
        self._moving = {i: r for i, r in self._roots.items() if not self._is_held(i)}
        self._scale = hy.par[numbers]
        self._clock = self._named("clock")
        begins = hy.par[numbers + 1]
        self._stabilisation = precise(hy.par[numbers + 2], self._system.number)
        self._now = begins + self._clock if self._moving else precise(hy.time, system.number)

    def _named(self, name: str) -> Any:
        """Return a variable for the formulas."""
        return precise(heyoka().make_vars(name), self._system.number)

    def _is_held(self, index: int) -> bool:
        """Return whether a mode holds a point fixed along the normal of its surface."""
        elements, states = self._system.elements, self._mode.states
        held = held_coordinates(elements, states)
        normal = elements[index].normal
        assert normal is not None
        return is_fixed(normal, held, self._system.scene_chain)

    def compiled(self, kind: Kind) -> CompiledMode:
        """Return the compiled mode."""
        hy, system, mode = heyoka(), self._system, self._mode
        pose = Pose(system.chain, system.formulation, self._q)
        solution = mode_solution(
            pose, system.effects, system.elements, mode.states,
            [mode.dent(i) for i in range(len(mode.states))], self._u, self._now, self._roots,
            self._stabilisation,
        )  # fmt: skip
        variables, rates = self._motion(solution)
        watched, integrals = self._event_functions(pose, solution, variables)
        first = len(variables)
        for place, rate in enumerate(integrals):
            variables.append(self._named(f"integral{place}"))
            rates.append(rate)
        precision = system.precision
        integrator = hy.taylor_adaptive(
            list(zip(map(plain, variables), map(plain, rates), strict=True)),
            np.array([system.number(0)] * len(variables)),
            tol=system.number(PRECISIONS[precision].step_tolerance(system.order)),
            # An arc lasts for a few steps: optimising them takes longer than they do, unless the
            # mode is entered thousands of times. So does unrolling them where there is more than
            # free motion.
            opt_level=int(kind.optimised),
            compact_mode=precision != "double" or bool(integrals or self._roots),
            fp_type=system.number,
        )
        return CompiledMode(
            pool=IntegratorPool(integrator, Stepper.of),
            operations=len(integrator.decomposition) - 2 * len(variables),
            numbers=self._numbers,
            watched=tuple(watched),
            gaps=tuple(self._gaps),
            recovering=self._recovering,
            roots=tuple(self._roots),
            moving=tuple(self._moving),
            clock=first - 1 if self._moving else None,
            integrals=slice(first, first + len(integrals)),
            number=system.number,
            kind=kind,
        )

    def _motion(self, solution: Solution) -> tuple[list[Any], list[Any]]:
        """Return the variables of the motion, and their rates."""
        system, roots, moving = self._system, self._roots, self._moving
        springing = {
            i: -_relaxation(system.elements[i]) * self._depths[i] for i in self._recovering
        }
        gap_rates = [
            springing.get(i, 0.0) + (0.0 if self._is_held(i) else self._normal_speed(i))
            for i in self._gaps
        ]
        variables = [*self._q, *self._u, *self._gaps.values(), *self._depths.values()]
        rates = [*self._u, *solution.du, *gap_rates, *springing.values()]
        variables += roots.values()
        if not moving:
            return variables, [*rates, *(0.0 for _ in roots)]
        factors = factors_of_pace(list(moving.values()))
        pace = product(factors)
        rates = [rate * pace for rate in rates]
        places = {index: place for place, index in enumerate(moving)}
        for index in roots:
            # d√δ/ds = dδ/dt/(2√δ) dt/ds, in which the root cancels.
            others = [f for place, f in enumerate(factors) if place != places.get(index)]
            rate = -self._normal_speed(index) / 2 if index in moving else 0.0
            rates.append(product([rate, *others]))
        return [*variables, self._clock], [*rates, pace]

    def _normal_speed(self, index: int) -> Any:
        normal = self._system.elements[index].normal
        assert normal is not None
        return normal.speed(self._system.chain, self._q, self._u)

    def _event_functions(
        self, pose: Pose, solution: Solution, variables: list[Any]
    ) -> tuple[list[Watched], list[Any]]:
        """Return the event functions, and the rates of the integrals that they require."""
        watched: list[Watched] = []
        integrals: list[Any] = []
        surfaces = Surfaces(self._gaps, self._roots)
        place = {str(plain(variable)): row for row, variable in enumerate(variables)}
        for trigger in triggers(self._system, self._mode):
            index = trigger.index
            if (
                trigger.kind is EventKind.HITS
                and self._is_held(index)
                and index not in self._recovering
            ):
                continue
            own = self._gaps.get(index) if trigger.kind in OF_GAP else self._roots.get(index)
            by_variable = trigger.kind in (*OF_GAP, EventKind.REACHES) or (
                trigger.kind is EventKind.LEAVES and own is not None
            )
            if by_variable:
                factor = -1.0 if trigger.kind in EDGES else 1.0
                watched.append(Watched(trigger, place[str(plain(own))], factor, False))
                continue
            f = value(trigger, self._system, self._mode, pose, self._u, solution, surfaces)
            if _is_constant(f):
                continue
            if trigger.kind in (EventKind.LEAVES, EventKind.BREAKS):
                size = self._system.elements[index].principal.size(self._system.scene_chain)
                f = f * (self._scale * size)
            watched.append(Watched(trigger, len(variables) + len(integrals), 1.0, True))
            integrals.append(f)
        return watched, integrals


def _is_rooted(element: ContactElement) -> bool:
    return element.compliant is not None and element.compliant.uses_root


def _relaxation(element: ContactElement) -> float:
    assert element.compliant is not None
    assert element.compliant.relaxation is not None
    return element.compliant.relaxation


def _with_parameters(
    effects: tuple[Any, ...], parameters: itertools.count[int], number: Any
) -> tuple[Effect, ...]:
    """Return the effects with parameters for the numbers that differ from piece to piece."""
    par = heyoka().par
    return tuple(
        effect.with_numbers(tuple(precise(par[next(parameters)], number) for _ in effect.numbers))
        if isinstance(effect, ParametricEffect)
        else effect
        for effect in effects
    )


def _with_frictions(
    elements: tuple[Any, ...],
    states: tuple[ContactState, ...],
    parameters: itertools.count[int],
    number: Any,
) -> tuple[ContactElement, ...]:
    """Return the elements with a parameter for each known friction (`HybridSystem.frictions`)."""

    def with_friction(element: Any, friction: Any) -> ContactElement:
        return replace(element, kinetic=friction, static=friction)

    return tuple(
        with_friction(element, precise(heyoka().par[next(parameters)], number))
        if state.direction
        else element
        for element, state in zip(elements, states, strict=True)
    )


def _with_places(
    elements: tuple[Any, ...], parameters: itertools.count[int], number: Any
) -> tuple[ContactElement, ...]:
    """Return the elements with a parameter for the place of each (`HybridSystem.places`)."""
    return tuple(
        element
        if element.normal is None
        else replace(element, bound=precise(heyoka().par[next(parameters)], number))
        for element in elements
    )


def _is_constant(value: Any) -> bool:
    """Return whether a number or an expression is constant, so that its event cannot occur."""
    hy = heyoka()
    # Parameters do not change during an arc; heyoka does not list the time with the variables.
    return not hy.get_variables(hy.subs(plain(value), {hy.time: hy.make_vars("t")}))
