"""The course of an arc: its mode and its start, in an integrator that is set to them."""

from __future__ import annotations

from typing import Any, NamedTuple

from twolink.simulation.hybrid.compiled import CompiledMode
from twolink.simulation.hybrid.mode import Mode
from twolink.simulation.hybrid.state import HybridState
from twolink.simulation.hybrid.stepper import Stepper
from twolink.simulation.hybrid.system import HybridSystem


class Course(NamedTuple):
    """An arc to be integrated: its mode, its start, and its latest end (s)."""

    system: HybridSystem
    compiled: CompiledMode
    stepper: Stepper
    mode: Mode
    state: HybridState
    until: Any
    compile_seconds: float


def set_up(course: Course) -> None:
    """Set the integrator of a mode to the start of an arc."""
    system, compiled, (integrator, _, variables, _, parameters, _), mode, state, *_ = course
    compliant = state.compliant
    vector = [*state.q, *state.u]
    for index in compiled.gaps:
        vector.append(state.gaps[index])
    for index in compiled.recovering:
        vector.append(compliant[index].residual_depth)  # type: ignore[union-attr]
    for index in compiled.roots:
        vector.append(compliant[index].sqrt_depth)  # type: ignore[union-attr]
    if len(vector) < len(variables):
        vector += [system.number(0)] * (len(variables) - len(vector))
    variables[:] = vector
    integrator.time = system.number(0) if compiled.clock is not None else state.t
    if count := len(parameters):
        own = [system.number(n) for n in mode.numbers]
        own += (*system.frictions(mode.states), *system.places)
        scales = system.scales
        scale, rate = system.number(scales.moment), system.number(scales.stabilisation)
        every = [*system.effect_numbers, *own, scale, state.t, rate]
        # The last parameters may not occur in the expressions of this mode.
        parameters[:] = every[:count]


def now(course: Course) -> Any:
    """Return the time (s) that the integrator has reached."""
    stepper, clock = course.stepper, course.compiled.clock
    return stepper.integrator.time if clock is None else course.state.t + stepper.state[clock]


def springing_back(state: HybridState) -> tuple[int, ...]:
    """Return the surfaces that are not in contact and have not recovered."""
    if not any(state.compliant):
        return ()
    return tuple(
        i for i, own in enumerate(state.compliant) if own is not None and own.residual_depth != 0
    )
