"""Method configurations: each a method with one parameter that trades time for accuracy."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

from numpy.typing import NDArray

from twolink.errors import SimulationError
from twolink.integration.method import Parameter
from twolink.integration.methods import NUMERIC_METHODS, NumericName
from twolink.integration.operations import Operations
from twolink.integration.precisions import PRECISIONS, PrecisionName
from twolink.limits import UNLIMITED, Limits
from twolink.names import EquationsName, FormulationName
from twolink.scene import Scene
from twolink.simulation.hybrid.mode import Event, Impact
from twolink.simulation.motion import has_events, has_modes, motion_run
from twolink.simulation.run import MotionRun
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.simulation.smooth.numeric import numeric_run
from twolink.simulation.smooth.taylor import taylor_run
from twolink.text import choice

# Parameter values, from coarse to fine. Orders are odd (see `simulation.smooth.taylor`); orders
# above a precision's full order would only repeat its rounding.
_ORDERS: dict[PrecisionName, tuple[int, ...]] = {
    "double": (7, 9, 11, 13, 15, 17, 19, 21),
    "long double": (15, 19, 23),
    "quadruple": (21, 31, 41),
}
# Compiling an order takes longer than its run; other formulations use fewer orders.
_FEW_ORDERS = (9, 13, 17, 21)
# Events are located to rounding, which the lowest orders do not reach.
_LOWEST_WITH_MODES = 13
TOLERANCES = tuple(10.0**-digits for digits in range(3, 14))
STEPS = tuple(0.1 / 2**halvings for halvings in range(15))
_SWEEPS: dict[Parameter, tuple[float, ...]] = {"tolerance": TOLERANCES, "step": STEPS}
# The method that runs on every formulation; the others run on momenta, for which symplectic
# methods are symplectic.
_WITH_ALL_EQUATIONS: NumericName = "DOP853"

# The engine name of this library's own methods.
OWN = "twolink"


@dataclass(frozen=True)
class MeasuredRun:
    """The result of one run: states at the requested times, and cost.

    `q` (rad) and `u` (rad/s) have shape (2, n), in the scalar type of the run; `seconds` is the
    time of the run and `compile_seconds` the time before it. `evaluations` of the rates, or of a
    series' terms, have `operations` each; `arithmetic` are the floating-point operations of the
    whole run. They are None if the engine does not report them.
    """

    q: Any
    u: Any
    seconds: float
    compile_seconds: float
    steps: int | None
    evaluations: int | None
    operations: int | None = None
    events: tuple[Event, ...] = ()
    impacts: tuple[Impact, ...] = ()
    warnings: tuple[str, ...] = ()
    arithmetic: Operations | None = None


@dataclass(frozen=True)
class MethodConfiguration:
    """A method for a formulation in an engine, and the parameter values to try.

    `order` is the declared order of the method, or None. `run` takes a parameter value and times
    (s) that start with 0.
    """

    engine: str
    method: str
    equations: str
    precision: str
    order: int | None
    parameter: str
    sweep: tuple[float, ...]
    run: Callable[[float, NDArray[Any]], MeasuredRun]

    @property
    def name(self) -> str:
        """The name of the configuration in tables."""
        precise = "" if self.precision == "double" else f", {self.precision}"
        own = self.engine == OWN
        return (
            f"{self.method}{precise} on {self.equations}"
            if own
            else (f"{self.engine} {self.method}")
        )


def own_configurations(scene: Scene, limits: Limits = UNLIMITED) -> tuple[MethodConfiguration, ...]:
    """Return this library's method configurations for a scene.

    Taylor series with each formulation, SciPy's methods, and the fixed-step ones in momenta, for
    which symplectic methods are symplectic. A scene with modes has only Taylor series, which events
    restrict to formulations in speeds. A run that would exceed the `limits` raises `TooMuchError`.
    """
    by_rates = () if has_modes(scene) else _by_rates(scene, limits)
    return (*_by_series(scene, limits), *by_rates)


def _by_series(scene: Scene, limits: Limits) -> Iterator[MethodConfiguration]:
    modal, eventful = has_modes(scene), has_events(scene)
    for precision in PRECISIONS:
        every = precision == "double"
        for equations in _in_speeds(every=every) if eventful else _equations(every=every):
            integrate = _through_events if eventful else _smooth
            run = partial(integrate, scene, limits, equations, precision)
            orders = _ORDERS[precision] if eventful or equations == "momenta" else _FEW_ORDERS
            if modal:
                orders = tuple(order for order in orders if order >= _LOWEST_WITH_MODES)
            yield MethodConfiguration(
                OWN, "taylor", equations, precision, None, "order", orders, run
            )


def _smooth(
    scene: Scene,
    limits: Limits,
    equations: EquationsName,
    precision: PrecisionName,
    order: float,
    times: Any,
) -> MeasuredRun:
    """Run a scene that is smooth throughout, by code that is optimised."""
    return _of_series(
        taylor_run(
            scene,
            times,
            formulation=equations,
            precision=precision,
            order=int(order),
            code=PRECISIONS[precision].codes[-1],
            progress=limits.timed(f"a run at order {order:g}"),
        )
    )


def _through_events(
    scene: Scene,
    limits: Limits,
    equations: EquationsName,
    precision: PrecisionName,
    order: float,
    times: Any,
) -> MeasuredRun:
    """Run a scene with modes or discontinuities."""
    return _of_series(
        motion_run(
            scene,
            times,
            formulation=equations,
            precision=precision,
            order=int(order),
            limits=limits,
        )
    )


def _equations(*, every: bool) -> Iterable[EquationsName]:
    """Return the names of all equations, or of the cheapest alone."""
    return tuple(EQUATIONS) if every else tuple(EQUATIONS)[:1]


def _in_speeds(*, every: bool) -> Iterable[FormulationName]:
    """Return the names of all formulations that modes can have, or of the cheapest alone."""
    names = tuple(dict.fromkeys(equations.in_speeds for equations in EQUATIONS.values()))
    return names if every else names[:1]


def _of_series(found: MotionRun) -> MeasuredRun:
    return MeasuredRun(
        q=found.q,
        u=found.u,
        seconds=found.run_seconds,
        compile_seconds=found.compile_seconds,
        steps=found.steps,
        evaluations=found.steps * found.order,
        operations=found.operations,
        events=found.events,
        impacts=found.log,
        arithmetic=found.arithmetic,
    )


def _by_rates(scene: Scene, limits: Limits) -> Iterator[MethodConfiguration]:
    for name in NUMERIC_METHODS:
        for equations in _equations(every=name == _WITH_ALL_EQUATIONS):
            yield _numeric(scene, limits, name, equations)


def _numeric(
    scene: Scene,
    limits: Limits,
    name: NumericName,
    equations: EquationsName,
) -> MethodConfiguration:
    method = NUMERIC_METHODS[name]

    def run(value: float, times: Any) -> MeasuredRun:
        found = numeric_run(
            scene,
            times,
            method=name,
            formulation=equations,
            setting=value,
            progress=limits.timed(f"a run with {method.parameter} {value:.3g}"),
        )
        return MeasuredRun(
            q=found.q,
            u=found.u,
            seconds=found.run_seconds,
            compile_seconds=0.0,
            steps=found.steps,
            evaluations=found.evaluations,
            arithmetic=found.arithmetic,
        )

    sweep = _SWEEPS[method.parameter]
    return MethodConfiguration(
        OWN, name, equations, "double", method.order, method.parameter, sweep, run
    )


def chosen(
    configurations: tuple[MethodConfiguration, ...], methods: tuple[str, ...]
) -> tuple[MethodConfiguration, ...]:
    """Return the configurations of the named methods; all, if no method is named.

    Raises `SimulationError` for an unknown name.
    """
    known = list(dict.fromkeys(configuration.method for configuration in configurations))
    for name in methods:
        if name not in known:
            raise SimulationError(choice("method, for this scene,", name, known))
    return tuple(
        configuration
        for configuration in configurations
        if not methods or configuration.method in methods
    )
