"""Diagnosis of motions: the mistakes whose motions are an engine's motion.

A mistake in the output changes the right motion. One in the model, the states or the equations
changes the accelerations, and is integrated by SciPy's DOP853.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from twolink.conformance.bounds import EPSILONS
from twolink.conformance.diagnosis import BINARY32, MISTAKES, flat_model
from twolink.conformance.mistakes import Question, Wrong
from twolink.conformance.quantities import QUANTITIES
from twolink.conformance.vectors import Group, Motion
from twolink.engines.messages import Precision

Array = NDArray[np.float64]
Accelerations = Callable[[Array], Array]

# A mistake must leave so little of the error of a motion unexplained, beside the change of the
# motion by the last setting, which must be so small a part of the error.
_UNEXPLAINED, _MOST_UNSURE = 0.01, 0.1

# Tolerances of the wrong motions, and the most evaluations of one.
_RELATIVE, _ABSOLUTE, _MOST = 1e-8, 1e-10, 20_000

# Of states (θ1, θ2, θ̇1, θ̇2): absolute angles and speeds of those of joints, and back.
_TO_ABSOLUTE: Array = np.asarray(np.kron(np.eye(2), [[1.0, 0.0], [1.0, 1.0]]))
_TO_JOINTS: Array = np.asarray(np.kron(np.eye(2), [[1.0, 0.0], [-1.0, 1.0]]))
_EXCHANGED = np.eye(4)[[1, 0, 3, 2]]
_AS_IT_IS = np.eye(4)
_DEGREES = 180 / math.pi
_IN_DEGREES: Array = np.diag(np.full(4, _DEGREES))


class _TooManyError(Exception):
    """A wrong motion takes too many evaluations."""


class MotionDiagnosis:
    """The mistakes that motions of engines may show, each of which is followed once."""

    def __init__(self, motion: Motion, group: Group) -> None:
        """Store a motion of the chain of a group."""
        self._truth = np.array(motion.values, dtype=float)
        self._start = np.array([*motion.angles, *motion.speeds])
        self._times, self._group, self._smooth = motion.times, group, motion.smooth

    def causes(self, rows: Array, unsure: float, precision: Precision) -> tuple[str, ...]:
        """Return the names of the mistakes whose motions are that of an engine.

        `rows` has θ1, θ2 (rad), θ̇1 and θ̇2 (rad/s) at all times but the first, shape (n, 4), at the
        finest setting, and `unsure` is its distance from the motion before. A motion with events is
        compared with mistakes in the output alone.
        """
        error = float(np.abs(rows - self._truth).max())
        if not (0 < error < math.inf and unsure <= _MOST_UNSURE * error):
            return ()
        if precision != BINARY32 and _is_rounded(rows, error, self._truth):
            return (BINARY32,)
        most = _UNEXPLAINED * error + unsure
        outputs = _outputs(self._start, self._truth)
        found = [name for name, wrong in outputs if np.abs(rows - wrong).max() <= most]
        found += [wrong.name for wrong in self._wrong if wrong.explains(rows, most)]
        return tuple(dict.fromkeys(found))

    @cached_property
    def _wrong(self) -> list[_WrongMotion]:
        """The motions of mistakes in the start, the forces, and the equations."""
        if not self._smooth:
            return []
        given = _given(self._start, self._group)
        return [_WrongMotion(each, self._times) for each in given]


def _is_rounded(rows: Array, error: float, truth: Array) -> bool:
    """Return whether all numbers are numbers of binary32, of half of whose digits they are right.

    Each of the numbers of a motion would be one with a chance of 2⁻²⁹.
    """
    with np.errstate(over="ignore"):
        single = bool((rows.astype(np.float32) == rows).all())
    return single and error <= math.sqrt(EPSILONS[BINARY32]) * float(np.abs(truth).max())


def _outputs(start: Array, truth: Array) -> Iterator[tuple[str, Array]]:
    """Yield mistakes in the output of the right motion."""
    yield "late-output", np.vstack([start, truth[:-1]])
    yield "absolute-answers", truth @ _TO_ABSOLUTE.T
    yield "degrees-out", truth * _DEGREES
    yield "joints-exchanged", truth @ _EXCHANGED.T
    yield "negated", -truth


class _Given(NamedTuple):
    """A mistake, as a start, accelerations, and a matrix that shows states, shape (4, 4)."""

    name: str
    start: Array
    accelerations: Accelerations
    shown: Array = _AS_IT_IS


def _given(start: Array, group: Group) -> Iterator[_Given]:
    """Yield mistakes in the start, the forces, and the equations."""
    right = _Chain(group)
    forces = right.accelerations
    yield _Given("absolute-angles", _TO_JOINTS @ start, forces, _TO_ABSOLUTE)
    yield _Given("absolute-angles", _TO_JOINTS @ start, forces)
    yield _Given("degrees-in", start / _DEGREES, forces)
    yield _Given("degrees-in", start / _DEGREES, forces, _IN_DEGREES)
    yield _Given("joints-exchanged", _EXCHANGED @ start, forces, _EXCHANGED)
    if right.has_springs:
        yield _Given("springs-dropped", start, _Chain(group, springs=False).accelerations)
    first = right.question(start)
    for mistake in MISTAKES.values():
        for wrong in mistake.applied(first):
            yield _Given(mistake.name, start, right.mistaken(wrong))


class _Chain:
    """The chain of a group, with its springs: questions on its accelerations."""

    def __init__(self, group: Group, springs: bool = True) -> None:
        """Build the model of a group's parameters."""
        parameters = group.parameters
        assert parameters is not None
        self._model = flat_model(group, from_urdf=False)
        stiffness = parameters.stiffness or (0.0, 0.0)
        self.has_springs = any(stiffness)
        self._stiffness = np.array(stiffness) * springs
        self._rest = np.array(parameters.rest or (0.0, 0.0))

    def question(self, state: Array) -> Question:
        """Return the question on the accelerations in a state."""
        torques = -self._stiffness * (state[:2] - self._rest)
        states = {"angles": state[None, :2], "speeds": state[None, 2:], "torques": torques[None]}
        quantity = QUANTITIES["forward_dynamics"]
        return Question(quantity, self._model, states)

    def accelerations(self, state: Array) -> Array:
        """Return the right joint accelerations (rad/s²)."""
        return np.asarray(self.question(state).truth[0])

    def mistaken(self, wrong: Wrong) -> Accelerations:
        """Return the joint accelerations (rad/s²) with a variant of a mistake."""
        return lambda state: np.asarray(wrong(self.question(state))[0])


class _WrongMotion:
    """The motion of an engine with a mistake, followed as far as it was needed."""

    def __init__(self, given: _Given, times: Sequence[float]) -> None:
        """Begin at the first of the times (s)."""
        self.name = given.name
        self._given, self._times = given, times
        self._states = [given.start]
        self._left = _MOST

    def explains(self, rows: Array, most: float) -> bool:
        """Return whether it is nowhere farther than that from an engine's rows."""
        with np.errstate(all="ignore"):
            return all(
                np.abs(self._shown(number) - row).max() <= most
                for number, row in enumerate(rows, start=1)
            )

    def _shown(self, number: int) -> Array:
        """Return the state at a time as the engine shows it, NaN if it cannot be followed."""
        if number == len(self._states):
            self._states.append(
                self._after(self._states[-1], *self._times[number - 1 : number + 1])
            )
        return np.asarray(self._given.shown @ self._states[number])

    def _after(self, state: Array, begin: float, end: float) -> Array:
        """Return the state at the end of an interval of time (s)."""
        try:
            found = solve_ivp(
                self._rates, (begin, end), state, "DOP853", rtol=_RELATIVE, atol=_ABSOLUTE
            )
        except (ArithmeticError, ValueError, IndexError, np.linalg.LinAlgError, _TooManyError):
            return np.full(4, np.nan)
        return np.asarray(found.y[:, -1] if found.success else np.full(4, np.nan))

    def _rates(self, time: float, state: Array) -> Array:
        self._left -= 1
        if self._left < 0:
            raise _TooManyError
        return np.concatenate([state[2:], self._given.accelerations(state)])
