"""Validation of user-defined effects: their type, and loads that can be compiled.

A simulation compiles the formulas of `loads` from one evaluation on symbolic numbers. This module
evaluates loads on placeholders that accept only `+ − × ÷ **` and the functions of
`twolink.arithmetic`, and names any other operation.
"""

from __future__ import annotations

import copy
import linecache
import math
import sys
from collections.abc import Callable
from itertools import pairwise
from operator import attrgetter
from types import FrameType
from typing import Any, NoReturn

from twolink.chain import Chain
from twolink.effects.custom_elements import ELEMENTS, check_elements
from twolink.effects.effect import (
    ConservativeEffect,
    ContactEffect,
    Effect,
    PiecewiseEffect,
    RotorEffect,
)
from twolink.errors import ParameterError
from twolink.inputs import as_number, as_pair, as_tuple, check_instance, refuse
from twolink.loads import Force, Torque
from twolink.points import as_link, as_point
from twolink.text import quoted
from twolink.values import is_value

_FUNCTIONS = "+, -, *, / and the functions of twolink.arithmetic (sin, cos, sqrt, exp, tanh)"
_PIECES = (
    "an effect that is smooth only piece by piece must be a PiecewiseEffect or a ContactEffect"
)

# The methods that act only in a class of their own.
_CONTRACTS = {
    "contact_elements": ContactEffect,
    "piece_at": PiecewiseEffect,
    "potential_energy": ConservativeEffect,
    "with_rotors": RotorEffect,
}

# A piece has loads alone.
_NO_PIECES = (ContactEffect, PiecewiseEffect, RotorEffect)


class _NotSymbolicError(Exception):
    """An operation that cannot be compiled."""


def checked(effect: Any, chain: Chain) -> Any:
    """Return a validated user-defined effect, or a copy of a mutable one.

    Raises `ParameterError` for an object that is not an effect, cannot be copied or compared, has
    loads that cannot be compiled, declares a time that is not positive, or mixes contracts.
    """
    name = type(effect).__name__
    if not isinstance(effect, Effect):
        raise ParameterError(
            "effects must be a sequence of instances of twolink.effects.Effect; got "
            f"{quoted(effect)} in it"
        )
    _check_contracts(effect, name)
    shortest = _called(name, "shortest_time", attrgetter("shortest_time"), effect)
    if not as_number(f"effect {name}: shortest_time", shortest) > 0:
        refuse(f"effect {name}: shortest_time", shortest, "a positive time in s")
    kept = effect if _called(name, "a field", is_value, effect) else _copy(effect, name)
    _try(kept, name, chain)
    return kept


def _check_contracts(effect: Effect, name: str) -> None:
    """Require the class of each method that acts, and no contact in pieces."""
    for method, contract in _CONTRACTS.items():
        if hasattr(type(effect), method) and not isinstance(effect, contract):
            raise ParameterError(
                f"effect {name}: must inherit from {contract.__name__} for its {method}; it"
                " would have no effect"
            )
    if isinstance(effect, ContactEffect) and isinstance(effect, PiecewiseEffect):
        raise ParameterError(
            f"effect {name}: must be a ContactEffect or a PiecewiseEffect, not both; use two"
            " effects, one for the contact and one for the loads that jump"
        )


def _copy(effect: Any, name: str) -> Any:
    """Return a deep copy."""
    try:
        kept = copy.deepcopy(effect)
    except Exception as error:
        raise ParameterError(
            f"effect {name} must be an object that copy.deepcopy can copy, or a frozen dataclass of"
            f" numbers; got {type(error).__name__}: {_line(error)}"
        ) from error
    try:
        bool(kept == effect)
    except Exception as error:
        raise ParameterError(
            f"effect {name} must be an object that can be compared by ==; got "
            f"{type(error).__name__}: {_line(error)}"
        ) from error
    return kept


def _try(effect: Any, name: str, chain: Chain) -> None:
    """Raise `ParameterError` if the loads or the potential energy cannot be compiled."""
    try:
        plain = chain.convert(float)
    except (TypeError, ValueError):
        # A chain with symbolic parameters is not simulated.
        return
    q, u, t = (Symbolic(), Symbolic()), (Symbolic(), Symbolic()), Symbolic()
    pieces = _pieces(effect, name) if isinstance(effect, PiecewiseEffect) else (effect,)
    for acting in pieces:
        smooth = isinstance(acting, ContactEffect)
        method = ("smooth_loads", acting.smooth_loads) if smooth else ("loads", acting.loads)
        _check_loads(name, _tried(name, *method, plain, q, u, t))
        if isinstance(acting, ConservativeEffect):
            energy = _tried(name, "potential_energy", acting.potential_energy, plain, q)
            as_number(f"effect {name}: potential_energy", energy)
    if isinstance(effect, RotorEffect):
        moved = _called(name, "with_rotors", effect.with_rotors, plain)
        check_instance(f"effect {name}: with_rotors", moved, Chain)
    if isinstance(effect, ContactEffect):
        elements = _called(name, "contact_elements", effect.contact_elements, plain)
        check_elements(name, as_tuple(f"effect {name}: contact_elements", elements, ELEMENTS))


def _pieces(effect: PiecewiseEffect, name: str) -> tuple[Effect, ...]:
    """Return the pieces of an effect. Raises `ParameterError` unless they are smooth loads."""
    declared = _called(name, "discontinuities", attrgetter("discontinuities"), effect)
    times = as_tuple(f"effect {name}: discontinuities", declared, "a tuple of times")
    known = [as_number(f"effect {name}: a discontinuity", t) for t in times]
    rises = all(early < late for early, late in pairwise(known))
    if not (rises and all(math.isfinite(t) for t in known)):
        refuse(f"effect {name}: discontinuities", times, "increasing finite times in s")
    pieces = tuple(_called(name, "piece_at", effect.piece_at, t) for t in (0.0, *known))
    for piece in pieces:
        if not isinstance(piece, Effect) or isinstance(piece, _NO_PIECES):
            raise ParameterError(
                f"effect {name}: piece_at must return an effect of smooth loads, without friction, "
                f"contact, rotors or pieces; got {quoted(piece)}"
            )
    return pieces


def _called(name: str, method: str, function: Callable[..., Any], argument: Any) -> Any:
    """Return the result of a method, or raise its error as a sentence."""
    try:
        return function(argument)
    except Exception as error:
        raise ParameterError(
            f"effect {name}: {method} raised {type(error).__name__}: {_line(error)}"
        ) from error


def _tried(name: str, method: str, function: Callable[..., Any], *state: Any) -> Any:
    """Return the result of a method for symbolic numbers, with generators exhausted."""
    try:
        found = function(*state)
        return found if method == "potential_energy" else _entries(name, found)
    except ParameterError:
        raise
    except _NotSymbolicError as error:
        raise ParameterError(
            f"effect {name}: {method} {error}; it must use {_FUNCTIONS} on q, u and t, and no "
            f"`if`: {_PIECES}"
        ) from None
    except Exception as error:
        raise ParameterError(
            f"effect {name}: {method} must work on numbers of any kind, with {_FUNCTIONS}; it "
            f"raised {type(error).__name__}: {_line(error)}"
        ) from error


def _entries(name: str, loads: Any) -> tuple[Any, ...]:
    return as_tuple(f"effect {name}: loads", loads, "a tuple of Force and Torque")


def _check_loads(name: str, loads: tuple[Any, ...]) -> None:
    """Require that each load is a force at a point of a link or a torque on a link."""
    for load in loads:
        if isinstance(load, Torque):
            as_link(f"effect {name}: link", load.link)
            as_number(f"effect {name}: moment", load.moment)
        elif isinstance(load, Force):
            as_point(f"effect {name}: point", load.point)
            as_pair(f"effect {name}: components", load.components)
        else:
            raise ParameterError(
                f"effect {name}: loads must be a tuple of Force and Torque; got "
                f"{quoted(load)} in it"
            )


def _line(error: Exception) -> str:
    return " ".join(str(error).split())[:200]


def _refuse(operation: str) -> NoReturn:
    """Raise an error that quotes the expression of an unsupported operation."""
    frame: FrameType | None = sys._getframe(2)
    while frame is not None and frame.f_globals.get("__name__") == __name__:
        frame = frame.f_back
    where = _expression(frame) if frame is not None else ""
    raise _NotSymbolicError(f"{operation} in `{where}`" if where else operation)


def _expression(frame: FrameType) -> str:
    """Return the source text of the current expression of a frame, if available."""
    positions = list(frame.f_code.co_positions())[frame.f_lasti // 2]
    first, last, start, stop = positions
    line = linecache.getline(frame.f_code.co_filename, first or 0)
    if first is None or first != last or start is None or stop is None:
        return line.strip()
    return line.encode()[start:stop].decode()


class Symbolic:
    """A number without a value: operations give another one, and comparisons raise an error."""

    __array_priority__ = 1000

    def _operation(self, *_: Any) -> Symbolic:
        return Symbolic()

    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = _operation
    __truediv__ = __rtruediv__ = __neg__ = __pos__ = _operation

    def __pow__(self, exponent: Any) -> Symbolic:
        if not isinstance(exponent, int) or not 0 <= exponent <= 64:
            _refuse("takes a power other than a whole number from 0 to 64")
        return Symbolic()

    def _question(self, *_: Any) -> NoReturn:
        _refuse("asks for the value of a number that has none yet,")

    def _comparison(self, *_: Any) -> NoReturn:
        _refuse("compares a number that has no value yet,")

    __float__ = __int__ = __index__ = __complex__ = __bool__ = __round__ = _question
    __floor__ = __ceil__ = __trunc__ = __divmod__ = __mod__ = __floordiv__ = _question
    __rmod__ = __rfloordiv__ = __rpow__ = __abs__ = _question
    __lt__ = __le__ = __gt__ = __ge__ = _comparison
    __eq__ = __ne__ = _comparison
    __hash__ = object.__hash__

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        """Accept NumPy floats in arithmetic; refuse NumPy functions by name."""
        if ufunc.__name__ in _OPERATORS and method == "__call__":
            return Symbolic()
        _refuse(f"calls numpy.{ufunc.__name__}")


_OPERATORS = ("add", "subtract", "multiply", "divide", "true_divide", "negative")


def sin(x: Symbolic) -> Symbolic:
    """Return a number without a value; `twolink.arithmetic` finds this function by the class."""
    return Symbolic()


cos = sqrt = exp = tanh = sin


def sign(x: Symbolic) -> NoReturn:
    """Raise an error: the sign is not smooth."""
    _refuse("takes a sign, which is not smooth,")
