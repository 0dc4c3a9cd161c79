"""Mistakes in conventions, in the equations, and in the layout and units of answers."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np
from numpy.typing import NDArray

from twolink.arithmetic import Matrix, Pair
from twolink.conformance.mistakes import (
    Mistake,
    Question,
    of_answers,
    of_questions,
    of_states,
    of_systems,
)
from twolink.conformance.spatial import FLOATS, SpatialState
from twolink.urdf.spatial import Vector3

Array = NDArray[np.float64]
States = Mapping[str, Array]

_FORCES = ("velocity_terms", "gravity_terms", "inverse_dynamics")
_IN_SPACE = ("position", "velocity", "acceleration", "jacobian")
_STATES = ("angles", "speeds", "accelerations")
_MOVING = ("velocity_terms", "inverse_dynamics", "forward_dynamics", "kinetic_energy")

# Joint angles of absolute ones: θ = T q, and M over q is Tᵀ M T.
_T = np.array([[1.0, 0.0], [-1.0, 1.0]])


def _absolute(states: States, names: tuple[str, ...]) -> dict[str, Array]:
    """Return states whose given fields were absolute angles, speeds or accelerations."""
    return {name: rows @ _T.T if name in names else rows for name, rows in states.items()}


def _over_absolute(question: Question, values: Array) -> Array:
    """Return an answer over joint angles as one over absolute angles."""
    if question.name == "mass_matrix":
        return np.asarray(_T.T @ values @ _T)
    if question.name in _FORCES:
        return np.asarray(values @ _T)
    if question.name == "forward_dynamics":
        return np.asarray(values @ np.linalg.inv(_T).T)
    if question.name == "jacobian":
        return np.asarray(values @ _T)
    return values


def _taken_as_absolute(question: Question, names: tuple[str, ...]) -> Array:
    """Return the answer to states whose given fields are taken as absolute."""
    return question.answer(states=_absolute(question.states, names))


def _angles_and_answers_absolute(question: Question) -> Array:
    """Return the answer over absolute angles to states taken as absolute."""
    states = _absolute(question.states, _STATES)
    if "torques" in states:
        # Absolute generalized forces of joint torques are T⁻ᵀ τ.
        states = {**states, "torques": states["torques"] @ np.linalg.inv(_T)}
    return _over_absolute(question, question.answer(states=states))


def _answers_absolute(question: Question) -> Array:
    return _over_absolute(question, question.truth)


def _radians(states: States, names: tuple[str, ...]) -> States:
    """Return states whose given fields were taken as degrees."""
    return {name: np.radians(rows) if name in names else rows for name, rows in states.items()}


def _exchanged(question: Question) -> Array:
    """Return the answer of an engine whose first joint is the elbow."""
    states = {name: rows[:, ::-1] for name, rows in question.states.items()}
    values = question.answer(states=states)
    if question.name == "mass_matrix":
        return values[:, ::-1, ::-1]
    if question.name == "jacobian":
        return values[:, :, ::-1]
    if question.name in (*_FORCES, "forward_dynamics"):
        return values[:, ::-1]
    return values


class _FirstSpeedInSecond(SpatialState):
    """The angular velocity of link 2 is that of link 1."""

    def angular_velocity(self, link: int) -> Vector3:
        """Return ω1."""
        return super().angular_velocity(1)

    def angular_bias(self, link: int) -> Vector3:
        """Return zero."""
        return super().angular_bias(1)


class _NoVelocityTerms(SpatialState):
    """Coriolis and centrifugal torques are left out."""

    def velocity_terms(self) -> Pair:
        """Return wrong velocity terms."""
        return 0.0, 0.0


class _VelocitySign(SpatialState):
    """Coriolis and centrifugal torques have the wrong sign."""

    def velocity_terms(self) -> Pair:
        """Return wrong velocity terms."""
        first, second = super().velocity_terms()
        return -first, -second


class _FirstVelocitySign(SpatialState):
    """Only the first one has the wrong sign."""

    def velocity_terms(self) -> Pair:
        """Return wrong velocity terms."""
        first, second = super().velocity_terms()
        return -first, second


class _SecondVelocitySign(SpatialState):
    """Only the second one has the wrong sign."""

    def velocity_terms(self) -> Pair:
        """Return wrong velocity terms."""
        first, second = super().velocity_terms()
        return first, -second


class _AbsoluteDamper(SpatialState):
    """The damper of the elbow acts between link 2 and the ground."""

    def resistance(self) -> Pair:
        """Return wrong torques in both joints."""
        first, second = super().resistance()
        by_link_1 = self.model.damping[1] * self.speeds[0]
        absolute = self.model.damping[1] * (self.speeds[0] + self.speeds[1])
        return first + absolute, second + by_link_1


class _AbsoluteDamperOfJoint(SpatialState):
    """The torque of the damper, in the elbow, follows the absolute speed of link 2."""

    def resistance(self) -> Pair:
        """Return a wrong torque in the elbow."""
        first, second = super().resistance()
        return first, second + self.model.damping[1] * self.speeds[0]


class _CentrifugalOnly(SpatialState):
    """The Coriolis term 2 θ̇1 θ̇2 is left out."""

    def velocity_terms(self) -> Pair:
        """Return wrong velocity terms."""
        return _without_product(self, 0.0)


class _SingleCoriolis(SpatialState):
    """The Coriolis term has θ̇1 θ̇2 instead of 2 θ̇1 θ̇2."""

    def velocity_terms(self) -> Pair:
        """Return wrong velocity terms."""
        return _without_product(self, 0.5)


def _without_product(state: SpatialState, share: float) -> Pair:
    """Return velocity terms with a share of the product of both speeds."""
    parts = []
    for speeds in (state.speeds, (state.speeds[0], 0.0), (0.0, state.speeds[1])):
        placed = object.__new__(SpatialState)
        placed.__dict__.update(state.__dict__)
        placed.speeds = speeds
        parts.append(placed.velocity_terms())
    both, first, second = (np.array(part) for part in parts)
    found = first + second + share * (both - first - second)
    return float(found[0]), float(found[1])


class _Decoupled(SpatialState):
    """The coupling of both joints in M is left out."""

    def mass_matrix(self) -> Matrix:
        """Return the diagonal of M."""
        (M11, _), (_, M22) = super().mass_matrix()
        return (M11, 0.0), (0.0, M22)


class _NoBias(SpatialState):
    """The part of an acceleration that is due to speeds is left out."""

    def bias(self, link: int, point: Vector3) -> Vector3:
        """Return zero."""
        return 0.0, 0.0, 0.0


def _half(truth: Array) -> Array:
    return truth / 2


def _double(truth: Array) -> Array:
    return truth * 2


def _upper(truth: Array) -> Array:
    return np.triu(truth)


def _lower(truth: Array) -> Array:
    return np.tril(truth)


def _transposed(truth: Array) -> Array:
    return np.swapaxes(truth, 1, 2)


def _inverted(truth: Array) -> Array:
    """Return M⁻¹, NaN if it is singular."""
    with np.errstate(all="ignore"):
        try:
            return np.asarray(np.linalg.inv(truth), dtype=float)
        except np.linalg.LinAlgError:
            return np.full_like(truth, np.nan)


def _negated(truth: Array) -> Array:
    return -truth


def _y_upward(truth: Array) -> Array:
    return truth * np.array([1.0, -1.0]).reshape(1, 2, *(1,) * (truth.ndim - 2))


def _degrees(truth: Array) -> Array:
    return truth * (180 / np.pi)


def _with_gravity(question: Question) -> Array:
    """Return velocity terms that include gravity, as `h` or the bias force of many engines."""
    values = question.truth.copy()
    for index, angles in enumerate(question.states["angles"]):
        state = SpatialState(question.model, FLOATS, (float(angles[0]), float(angles[1])))
        values[index] += state.gravity_terms()
    return values


ANSWER_MISTAKES: tuple[Mistake, ...] = (
    of_answers("factor-half", "the answer is half of the right one", _half),
    of_answers("factor-two", "the answer is twice the right one", _double),
    of_answers("upper-triangle", "only the upper triangle of M is filled", _upper, "mass_matrix"),
    of_answers("lower-triangle", "only the lower triangle of M is filled", _lower, "mass_matrix"),
    of_answers("inverted-mass-matrix", "the answer is M⁻¹, not M", _inverted, "mass_matrix"),
    of_answers("transposed-jacobian", "the Jacobian is transposed", _transposed, "jacobian"),
    of_answers("negated", "the answer has the opposite sign", _negated),
    of_answers("y-upward", "y points upwards in the answer", _y_upward, *_IN_SPACE),
    of_answers("degrees-out", "the answer is in degrees", _degrees, "forward_dynamics"),
    of_questions(
        "gravity-in-velocity-terms",
        "velocity terms include gravity",
        _with_gravity,
        quantities=("velocity_terms",),
    ),
    of_questions(
        "absolute-angles",
        "θ2 is taken as an absolute angle, not relative to link 1",
        partial(_taken_as_absolute, names=_STATES),
        partial(_taken_as_absolute, names=_STATES[:1]),
        _angles_and_answers_absolute,
    ),
    of_questions(
        "absolute-answers",
        "the answer is over absolute angles, not joint angles",
        _answers_absolute,
        quantities=(*_FORCES, "mass_matrix", "forward_dynamics", "jacobian"),
    ),
    of_states(
        "absolute-speeds",
        "θ̇2 is taken as an absolute angular velocity",
        *(partial(_absolute, names=names) for names in (_STATES[1:2], _STATES[1:])),
    ),
    of_states(
        "degrees-in",
        "angles are read as degrees",
        *(partial(_radians, names=_STATES[:count]) for count in (1, 2, 3)),
    ),
    of_questions("joints-exchanged", "the joints are in the opposite order", _exchanged),
    of_systems(
        "first-speed-for-second", "ω1 stands where ω2 must", _FirstSpeedInSecond, quantities=_MOVING
    ),
    of_systems(
        "velocity-terms-missing",
        "Coriolis and centrifugal torques are left out",
        _NoVelocityTerms,
        quantities=_MOVING[:3],
    ),
    of_systems(
        "velocity-terms-sign",
        "Coriolis and centrifugal torques have the wrong sign",
        _VelocitySign,
        _FirstVelocitySign,
        _SecondVelocitySign,
        quantities=_MOVING[:3],
    ),
    of_systems(
        "coriolis-term",
        "the Coriolis term has no 2, or is left out",
        _SingleCoriolis,
        _CentrifugalOnly,
        quantities=_MOVING[:3],
    ),
    of_systems(
        "decoupled",
        "the coupling of both joints is missing in M",
        _Decoupled,
        quantities=("mass_matrix", "inverse_dynamics", "forward_dynamics"),
    ),
    of_systems(
        "absolute-damper",
        "the damper of the elbow acts on the absolute speed of link 2",
        _AbsoluteDamper,
        _AbsoluteDamperOfJoint,
        quantities=("inverse_dynamics", "forward_dynamics"),
    ),
    of_systems(
        "acceleration-without-bias",
        "the acceleration of a point lacks the part due to speeds",
        _NoBias,
        quantities=("acceleration",),
    ),
)
