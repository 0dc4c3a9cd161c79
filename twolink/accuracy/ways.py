"""The ways to integrate a scene: each a method with one knob that trades time for accuracy."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import chain as joined
from typing import Any

from numpy.typing import NDArray

from twolink.errors import SimulationError
from twolink.scene import Scene
from twolink.simulation.hybrid.mode import Event, Impact
from twolink.simulation.motion import has_modes, motion_run
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.simulation.smooth.fixed_step import FIXED_STEP
from twolink.simulation.smooth.numeric import SCIPY, numeric_run
from twolink.simulation.smooth.taylor import PRECISIONS, taylor_run

# The knobs, from coarse to fine. Orders are odd, as `simulation.smooth.taylor` says; those beyond a
# precision's full order would only repeat its rounding.
_ORDERS = {
    "double": (7, 9, 11, 13, 15, 17, 19, 21),
    "long double": (15, 19, 23),
    "quadruple": (21, 31, 41),
}
# Every order is compiled, which takes longer than it runs; other equations are shown by fewer.
_FEW_ORDERS = (9, 13, 17, 21)
# The events of a mode are kept to rounding, which the lowest orders do not give.
_LOWEST_WITH_MODES = 13
TOLERANCES = tuple(10.0**-digits for digits in range(3, 14))
STEPS = tuple(0.1 / 2**halvings for halvings in range(15))

# The name of what is our own, where others' engines stand beside it.
OWN = "twolink"


@dataclass(frozen=True)
class Outcome:
    """What one run left: states at the times asked for, and its cost.

    `q` (rad) and `u` (rad/s) have shape (2, n), in the numbers of the run; `seconds` is the run
    itself and `compile_seconds` all that went before. `evaluations` are those of the rates, or of
    a series' terms, each of `operations`; None is what an engine does not tell.
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


@dataclass(frozen=True)
class Way:
    """A method on a set of equations, in an engine, and the values of its knob to try.

    `order` is the order that the method declares, where it has one. `run` takes a value of the
    knob, and times (s) of which the first is 0.
    """

    engine: str
    method: str
    equations: str
    precision: str
    order: int | None
    knob: str
    ladder: tuple[float, ...]
    run: Callable[[float, NDArray[Any]], Outcome]

    @property
    def name(self) -> str:
        """How the way is called in a table."""
        precise = "" if self.precision == "double" else f", {self.precision}"
        own = self.engine == OWN
        return (
            f"{self.method}{precise} on {self.equations}"
            if own
            else (f"{self.engine} {self.method}")
        )


def own_ways(scene: Scene) -> tuple[Way, ...]:
    """Return the ways of this library that can follow a scene.

    Taylor series on each set of equations, SciPy's methods, and the fixed-step ones on momenta,
    in which the symplectic ones are so. A scene with modes is followed by Taylor series alone.
    """
    if has_modes(scene):
        return tuple(_taylor_with_modes(scene))
    return tuple(joined(_taylor(scene), _scipy(scene), _fixed_steps(scene)))


def _taylor(scene: Scene) -> Iterator[Way]:
    for precision in PRECISIONS:
        for equations in EQUATIONS if precision == "double" else ("momenta",):

            def run(
                order: float, times: Any, precision: str = precision, equations: str = equations
            ) -> Outcome:
                found = taylor_run(
                    scene,
                    times,
                    formulation=equations,
                    precision=precision,
                    order=int(order),
                    optimised=True,
                )
                return _of_series(found)

            orders = _ORDERS[precision] if equations == "momenta" else _FEW_ORDERS
            yield Way(OWN, "taylor", equations, precision, None, "order", orders, run)


def _taylor_with_modes(scene: Scene) -> Iterator[Way]:
    for precision in PRECISIONS:
        for equations in ("lagrange", "kane") if precision == "double" else ("lagrange",):

            def run(
                order: float, times: Any, precision: str = precision, equations: str = equations
            ) -> Outcome:
                found = motion_run(
                    scene, times, formulation=equations, precision=precision, order=int(order)
                )
                return _of_series(found)

            orders = tuple(n for n in _ORDERS[precision] if n >= _LOWEST_WITH_MODES)
            yield Way(OWN, "taylor", equations, precision, None, "order", orders, run)


def _of_series(found: Any) -> Outcome:
    return Outcome(
        q=found.q,
        u=found.u,
        seconds=found.run_seconds,
        compile_seconds=found.compile_seconds,
        steps=found.steps,
        evaluations=found.steps * found.order,
        operations=found.operations,
        events=found.events,
        impacts=found.log,
    )


def _scipy(scene: Scene) -> Iterator[Way]:
    for method, order in SCIPY.items():
        for equations in EQUATIONS if method == "DOP853" else ("momenta",):
            yield _numeric(scene, method, equations, order, "tolerance", TOLERANCES)


def _fixed_steps(scene: Scene) -> Iterator[Way]:
    for name, method in FIXED_STEP.items():
        yield _numeric(scene, name, "momenta", method.order, "step", STEPS)


def _numeric(
    scene: Scene,
    method: str,
    equations: str,
    order: int | None,
    knob: str,
    ladder: tuple[float, ...],
) -> Way:
    def run(fineness: float, times: Any) -> Outcome:
        found = numeric_run(scene, times, method=method, formulation=equations, fineness=fineness)
        return Outcome(found.q, found.u, found.run_seconds, 0.0, found.steps, found.evaluations)

    return Way(OWN, method, equations, "double", order, knob, ladder, run)


def chosen(ways: tuple[Way, ...], methods: tuple[str, ...]) -> tuple[Way, ...]:
    """Return the ways whose method is named; all, if none is.

    Raises `SimulationError` for a name that is none of theirs.
    """
    known = list(dict.fromkeys(way.method for way in ways))
    for name in methods:
        if name not in known:
            raise SimulationError(
                f"method is '{name}'; allowed for this scene are {', '.join(known)}"
            )
    return tuple(way for way in ways if not methods or way.method in methods)
