"""Compile a formula to straight-line Python by tracing.

The formulas of this project are written for readability: in steps, with vectors, for any chain. A
formula is evaluated once with tracing numbers that record their operations, and the recording is
compiled: a flat function of the state, with the chain's parameters as constants and each common
subexpression computed once. Operations with an exact 0 or 1 (a mass centre on the axis, a mass of
1 kg) are omitted. All other operations keep their order, so the result for a state of floats equals
that of the formula to the last bit.

`compiled.batch` takes arrays of states, and processes them in blocks that fit the processor's
cache. It differs from the formula in one respect: sine and cosine are computed together from the
tangent of the half angle, which NumPy vectorises, in contrast to sine and cosine. They are within
2⁻⁵² of the exact values.
"""

from __future__ import annotations

import inspect
import math
import re
from collections import Counter
from collections.abc import Callable
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from twolink.arithmetic import Scalar
from twolink.errors import ParameterError

# Large enough to amortise NumPy's cost per call, small enough that the dozen arrays in use at a
# time (8 bytes per number) fit the cache.
_BLOCK = 16384

_VARIABLE = re.compile(r"\b[a-z]\w*")

# Python limits nested parentheses to about a hundred; this many characters stay below that.
_LONGEST_TEXT = 400


class Operation(NamedTuple):
    """One line of a recording: the variable and its operation."""

    name: str
    symbol: str
    operands: tuple[str, ...]

    @property
    def is_of_an_angle(self) -> bool:
        """Whether this is a sine or a cosine."""
        return self.symbol in ("sin", "cos")


class Recording:
    """The recorded operations: one line for each distinct operation, in order."""

    def __init__(self) -> None:
        """Create an empty recording."""
        self._operations: dict[tuple[str, ...], Operation] = {}

    def write(self, symbol: str, *operands: str) -> str:
        """Return the variable of an operation, which is recorded if it is new."""
        # Addition and multiplication are commutative to the last bit.
        key = (symbol, *(sorted(operands) if symbol in ("+", "*") else operands))
        name = f"t_{len(self._operations)}"
        return self._operations.setdefault(key, Operation(name, symbol, operands)).name

    def has(self, *key: str) -> bool:
        """Return whether an operation on these operands, in this order, is recorded."""
        return key in self._operations

    def needed_for(self, result: str) -> list[Operation]:
        """Return the operations that a result depends on, in order."""
        needed = set(_VARIABLE.findall(result))
        kept = []
        for operation in reversed(self._operations.values()):
            if operation.name in needed:
                needed.update(operation.operands)
                kept.append(operation)
        return kept[::-1]


class TracingNumber:
    """A tracing number that records its operations.

    It represents a variable or its negative. Signs are propagated and never computed: rounding is
    symmetric, so −(a b) has the bits of (−a) b, and a − b those of a + (−b).
    """

    __slots__ = ("name", "negative", "recording")

    # NumPy's floats defer to the operators of this class.
    __array_ufunc__ = None

    def __init__(self, recording: Recording, name: str, negative: bool = False) -> None:
        """Represent the variable of this name."""
        self.recording = recording
        self.name = name
        self.negative = negative

    def _result(self, name: str, negative: bool) -> TracingNumber:
        return TracingNumber(self.recording, name, negative)

    def __neg__(self) -> TracingNumber:
        return self._result(self.name, not self.negative)

    def __add__(self, other: Any) -> TracingNumber:
        if _is(other, 0):
            return self
        word, negative = _signed(other)
        if self.negative == negative:
            return self._result(self.recording.write("+", self.name, word), negative)
        # a - b and b - a are one operation: the one recorded first.
        if self.recording.has("-", word, self.name):
            return self._result(self.recording.write("-", word, self.name), negative)
        return self._result(self.recording.write("-", self.name, word), self.negative)

    def __radd__(self, other: Any) -> TracingNumber:
        return self + other

    def __sub__(self, other: Any) -> TracingNumber:
        return self + (-other)

    def __rsub__(self, other: Any) -> TracingNumber:
        return -self + other

    def __mul__(self, other: Any) -> Any:
        if _is(other, 0):
            return 0
        word, negative = _signed(other)
        negative = negative != self.negative
        if _is(abs(other) if _is_number(other) else other, 1):
            return self._result(self.name, negative)
        return self._result(self.recording.write("*", self.name, word), negative)

    def __rmul__(self, other: Any) -> Any:
        return self * other

    def __truediv__(self, other: Any) -> TracingNumber:
        word, negative = _signed(other)
        return self._result(self.recording.write("/", self.name, word), negative != self.negative)

    def __rtruediv__(self, other: Any) -> Any:
        if _is(other, 0):
            return 0
        word, negative = _signed(other)
        return self._result(self.recording.write("/", word, self.name), negative != self.negative)

    def __abs__(self) -> TracingNumber:
        return self._result(self.recording.write("abs", self.name), False)

    def __pow__(self, exponent: int) -> Any:
        if not isinstance(exponent, int) or exponent < 0:
            return NotImplemented
        power: Any = 1.0
        for bit in f"{exponent:b}":
            power = power * power
            if bit == "1":
                power = self * power
        return power


def sin(x: TracingNumber) -> TracingNumber:
    """Record a sine (`twolink.arithmetic` finds this function in the module of the class)."""
    return TracingNumber(x.recording, x.recording.write("sin", x.name), x.negative)


def cos(x: TracingNumber) -> TracingNumber:
    """Record a cosine."""
    return TracingNumber(x.recording, x.recording.write("cos", x.name))


def sqrt(x: TracingNumber) -> TracingNumber:
    """Write down a square root."""
    return _function_of("sqrt", x)


def exp(x: TracingNumber) -> TracingNumber:
    """Write down a power of e."""
    return _function_of("exp", x)


def tanh(x: TracingNumber) -> TracingNumber:
    """Write down a hyperbolic tangent."""
    return _function_of("tanh", x)


def _function_of(name: str, x: TracingNumber) -> TracingNumber:
    argument = x.recording.write("-", "0.0", x.name) if x.negative else x.name
    return TracingNumber(x.recording, x.recording.write(name, argument))


class Compiled:
    """A formula compiled for a state of floats, and for arrays of states.

    `source` is the generated Python, and `of_floats` its function; `operations` counts each kind of
    operation in it (sin, cos, sqrt, exp, tanh, abs, +, -, *, /); `depth` is the longest chain of
    them from a state to a result.
    """

    def __init__(self, text: Callable[..., Any]) -> None:
        """Trace `text`, a function of pairs, and compile the recording."""
        self.arguments = tuple(inspect.signature(text).parameters)
        recording = Recording()
        pairs = (
            (TracingNumber(recording, f"{a}1"), TracingNumber(recording, f"{a}2"))
            for a in self.arguments
        )
        result = text(*pairs)
        self._shape = np.shape(_nested_zeros(result))
        operations = recording.needed_for(_word(result))
        self.operations = dict(sorted(Counter(line.symbol for line in operations).items()))
        self.depth = _depth(operations)
        self.source = _source(self.arguments, operations, _word(result), _one_by_one)
        functions = {name: getattr(math, name) for name in ("sin", "cos", "sqrt", "exp", "tanh")}
        self.of_floats = _function(self.source, **functions)
        self._in_pairs = _source(self.arguments, operations, _word(result), _in_pairs)

    def __call__(self, *state: Any) -> Any:
        """Return the formula's value for one state; each argument is a pair of floats."""
        return self.of_floats(*state)

    @cached_property
    def _of_arrays(self) -> Callable[..., Any]:
        functions = {"sqrt": np.sqrt, "exp": np.exp, "tanh": np.tanh}
        return _function(self._in_pairs, sin_and_cos=_sin_and_cos, **functions)

    def batch(self, *states: Any) -> np.ndarray:
        """Return the values for many states, as an array with the states along its last axis.

        Each argument has shape (2, n), real or complex. A formula that returns a pair gives
        shape (2, n), a matrix (2, 2, n), a number (n,).
        """
        arrays = [np.asarray(state) for state in states]
        shapes = {array.shape for array in arrays}
        if len(arrays) != len(self.arguments) or len(shapes) != 1 or arrays[0].shape[:1] != (2,):
            raise ParameterError(
                f"a batch of states must have one shape (2, n) for each of "
                f"{', '.join(self.arguments)}; got {[array.shape for array in arrays]}"
            )
        n = arrays[0].shape[1]
        values = np.empty((*self._shape, n), dtype=np.result_type(float, *arrays))
        for start in range(0, n, _BLOCK):
            block = slice(start, min(start + _BLOCK, n))
            result = self._of_arrays(*(array[:, block] for array in arrays))
            _store(values[..., block], result)
        return values


def _store(target: np.ndarray, result: Any) -> None:
    """Copy nested tuples of arrays (or constants) into an array without stacking."""
    if isinstance(result, tuple):
        for row, entry in zip(target, result, strict=True):
            _store(row, entry)
    else:
        target[...] = result


def _source(
    arguments: tuple[str, ...],
    operations: list[Operation],
    result: str,
    sines_and_cosines: Callable[[list[Operation]], dict[str, str]],
) -> str:
    """Return the Python source of the compiled function.

    An expression that is used once is inlined, which saves a variable.
    """
    uses = Counter(_VARIABLE.findall(result))
    uses.update(operand for operation in operations for operand in operation.operands)
    texts: dict[str, str] = {}
    lines = [f"{a}1, {a}2 = {a}" for a in arguments]
    statements = sines_and_cosines([line for line in operations if line.is_of_an_angle])
    for name, symbol, operands in operations:
        words = [texts.get(operand, operand) for operand in operands]
        if name in statements:
            lines.append(statements[name].format(words[0]))
        elif symbol not in ("sin", "cos"):
            text = f"{symbol}({words[0]})" if len(words) == 1 else f" {symbol} ".join(words)
            if uses[name] == 1 and len(text) < _LONGEST_TEXT:
                texts[name] = f"({text})"
            else:
                lines.append(f"{name} = {text}")
    value = _VARIABLE.sub(lambda found: texts.get(found[0], found[0]), result)
    header = f"def compiled({', '.join(arguments)}):"
    return "\n    ".join([header, *lines, f"return {value}"])


def _one_by_one(of_angles: list[Operation]) -> dict[str, str]:
    """Return a statement for each sine and each cosine, by name; {} is the angle's placeholder."""
    return {line.name: f"{line.name} = {line.symbol}({{}})" for line in of_angles}


def _in_pairs(of_angles: list[Operation]) -> dict[str, str]:
    """Return a statement for the sine and cosine of each angle, by the name of the first."""
    by_angle: dict[str, dict[str, str]] = {}
    for line in of_angles:
        by_angle.setdefault(line.operands[0], {})[line.symbol] = line.name
    return {
        next(iter(names.values())): (
            f"{names.get('sin', '_')}, {names.get('cos', '_')} = sin_and_cos({{}})"
        )
        for names in by_angle.values()
    }


def _function(source: str, **functions: Callable[..., Any]) -> Callable[..., Any]:
    """Return the function that a source defines, with the given functions as globals."""
    names: dict[str, Any] = dict(functions)
    exec(compile(source, "<compiled formula>", "exec"), names)
    compiled: Callable[..., Any] = names["compiled"]
    return compiled


def _sin_and_cos(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return sine and cosine, for real angles by the tangent of the half angle."""
    if np.iscomplexobj(x):
        return np.sin(x), np.cos(x)
    tangent = np.tan(0.5 * x)
    square = tangent * tangent
    divisor = 1.0 + square
    return (tangent + tangent) / divisor, (1.0 - square) / divisor


def _depth(operations: list[Operation]) -> int:
    """Return the length of the longest chain of dependent operations."""
    depth: dict[str, int] = {}
    for operation in operations:
        depth[operation.name] = 1 + max(depth.get(operand, 0) for operand in operation.operands)
    return max(depth.values(), default=0)


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float))


def _is(value: Scalar, constant: int) -> bool:
    """Return whether a value is an ordinary number equal to a constant."""
    return _is_number(value) and bool(value == constant)


def _signed(value: Any) -> tuple[str, bool]:
    """Return the source text of a value's magnitude, and whether the value is negative."""
    if isinstance(value, TracingNumber):
        return value.name, value.negative
    if _is_number(value) and math.isfinite(value):
        return repr(abs(float(value))), value < 0
    raise ParameterError(
        f"numbers in a compiled formula must be finite floats; got {value!r} of type "
        f"{type(value).__name__}; convert the chain and the loads to float first"
    )


def _word(value: Any) -> str:
    """Return the source text of a number, a tracing number, or nested tuples of them."""
    if isinstance(value, tuple):
        return f"({', '.join(_word(entry) for entry in value)},)"
    word, negative = _signed(value)
    return f"-{word}" if negative else word


def _nested_zeros(value: Any) -> Any:
    """Return nested tuples of zeros with the structure of the value."""
    return tuple(_nested_zeros(entry) for entry in value) if isinstance(value, tuple) else 0
