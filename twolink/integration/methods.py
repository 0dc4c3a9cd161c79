"""The integration methods, in one registry.

Scenes, simulation, the command line and accuracy studies take them from here. A new method is its
name in `MethodName` and an entry in `METHODS`.
"""

from __future__ import annotations

from typing import Literal

from twolink.errors import SimulationError
from twolink.integration import operations
from twolink.integration.fixed_step import FixedStepMethod, explicit, implicit, semi_implicit_euler
from twolink.integration.method import Method, NumericMethod, TaylorSeries
from twolink.integration.scipy_method import SciPyMethod
from twolink.integration.tableaus import GAUSS_LEGENDRE, RK4
from twolink.text import choice

NumericName = Literal[
    "DOP853",
    "RK45",
    "Radau",
    "LSODA",
    "rk4",
    "semi-implicit-euler",
    "implicit-midpoint",
    "gauss-legendre-4",
    "gauss-legendre-6",
]
MethodName = Literal["taylor"] | NumericName


def _gauss_legendre(order: int) -> FixedStepMethod:
    tableau = GAUSS_LEGENDRE[order]
    return FixedStepMethod(
        order=order,
        step=implicit(tableau),
        beside=operations.implicit(tableau),
        implicit=True,
        symplectic=True,
    )


NUMERIC_METHODS: dict[NumericName, NumericMethod] = {
    "DOP853": SciPyMethod(
        name="DOP853", order=8, beside=operations.embedded(12, operations.estimate_of_two(12))
    ),
    "RK45": SciPyMethod(
        name="RK45", order=5, beside=operations.embedded(6, operations.estimate_of_one(6))
    ),
    "Radau": SciPyMethod(name="Radau", order=5, implicit=True),
    "LSODA": SciPyMethod(name="LSODA"),
    "rk4": FixedStepMethod(order=4, step=explicit(RK4), beside=operations.explicit(RK4)),
    "semi-implicit-euler": FixedStepMethod(
        order=1,
        step=semi_implicit_euler,
        beside=operations.semi_implicit_euler,
        symplectic=True,
    ),
    "implicit-midpoint": _gauss_legendre(2),
    "gauss-legendre-4": _gauss_legendre(4),
    "gauss-legendre-6": _gauss_legendre(6),
}
"""The methods that evaluate only rates, by their names."""

METHODS: dict[MethodName, Method] = dict([("taylor", TaylorSeries()), *NUMERIC_METHODS.items()])
"""All methods by their names."""


def method_named(name: str) -> MethodName:
    """Return the name of a method, or raise `SimulationError`."""
    for known in METHODS:
        if known == name:
            return known
    raise SimulationError(choice("method", name, METHODS))
