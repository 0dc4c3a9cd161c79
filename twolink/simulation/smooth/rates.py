"""The rates of a scene's variables and their derivatives at many states, by compiled code."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np

from twolink.integration.precisions import PRECISIONS, PrecisionName
from twolink.names import EquationsName
from twolink.optional import heyoka
from twolink.scene import Scene
from twolink.simulation.compilation_thread import CompilationThread
from twolink.simulation.memo import Memo
from twolink.simulation.smooth.equations import expressions_of
from twolink.values import Content

# Levels of optimisation. For quadruple numbers the highest level takes 10 ms more to compile, and
# halves the time of a call. In float64 it takes as much, and saves 0.02 ms of a call.
_LEVELS: dict[PrecisionName, int] = {"double": 0, "long double": 1, "quadruple": 3}

Rates = Callable[[Any, Any], Any]
"""A function of states, shape (4, …), and of times (s), shape (…): the rates, shape (4, …)."""

Jacobians = Callable[[Any, Any], Any]
"""A function of the same: derivatives of the rates by the states, in float64, shape (4, 4, …)."""


def rates_of(
    scene: Scene, formulation: EquationsName, precision: PrecisionName, *, alone: bool = False
) -> Rates:
    """Return the rates of a scene's variables as a function of arrays in a precision.

    In double precision their derivatives are computed as well, unless they are wanted `alone`.
    """
    derived = precision == "double" and not alone
    function = _COMPILED(*_key(scene, formulation, precision, derived))
    return lambda states, t: _at(function, states, t)[:4].reshape(states.shape)


def jacobians_of(scene: Scene, formulation: EquationsName) -> Jacobians:
    """Return the derivatives of the rates of a scene's variables by these, in float64."""
    function = _COMPILED(*_key(scene, formulation, "double", True))
    return lambda states, t: _at(function, states, t)[4:].reshape(4, *states.shape)


def compile_jacobians_ahead(
    thread: CompilationThread, scene: Scene, formulation: EquationsName
) -> None:
    """Compile the derivatives of the rates of a scene in a thread, unless they are there."""
    key = _key(scene, formulation, "double", True)
    if key not in _COMPILED and key[1].is_value:
        thread.request(key, functools.partial(_COMPILED, *key))


def wait_for_jacobians(thread: CompilationThread, scene: Scene, formulation: EquationsName) -> None:
    """Wait until a thread has compiled the derivatives, if it is to."""
    thread.wait(_key(scene, formulation, "double", True))


def _key(
    scene: Scene, formulation: EquationsName, precision: PrecisionName, derived: bool
) -> tuple[Any, ...]:
    chain, effects = Content((scene.moving_chain,)), Content(scene.effects)
    return chain, effects, formulation, precision, derived


def _at(function: Any, states: Any, t: Any) -> Any:
    """Return the values of a compiled function at states, shape (values, number of states)."""
    flat = np.ascontiguousarray(states.reshape(4, -1))
    moments = np.ascontiguousarray(t.reshape(-1))
    return function(flat, time=moments, batch_parallel=False)


def _compile(
    chain: Content,
    effects: Content,
    formulation: EquationsName,
    precision: PrecisionName,
    derived: bool,
) -> Any:
    """Return code for the rates, for scenes that differ only in their start.

    It computes their derivatives as well if they are `derived`: one compilation takes half as long
    as two.
    """
    hy, number = heyoka(), PRECISIONS[precision].number
    (given,) = chain.objects
    pairs = expressions_of(formulation, given.convert(number), effects.objects, number)
    variables, rates = zip(*pairs, strict=True)
    every = hy.subs(list(rates), of_differences(*variables[:2]))
    if derived:
        tensors = hy.diff_tensors(every, diff_args=list(variables), diff_order=1)
        every += tensors.jacobian.ravel().tolist()
    return hy.cfunc(every, variables, fp_type=number, opt_level=_LEVELS[precision])


_COMPILED = Memo(_compile, 64)


def of_differences(q1: Any, q2: Any) -> dict[Any, Any]:
    """Return sin(q2 − q1) and cos(q2 − q1), and equal expressions in functions of q1 and q2.

    In longer precisions sines and cosines take most of the time, and the rates have these as well.
    """
    hy = heyoka()
    s1, c1, s2, c2 = hy.sin(q1), hy.cos(q1), hy.sin(q2), hy.cos(q2)
    return {hy.sin(q2 - q1): s2 * c1 - c2 * s1, hy.cos(q2 - q1): c2 * c1 + s2 * s1}
