"""The hard cases put to any engine, as questions and motions of the protocol.

The judge, the marks and the bounds are those of `twolink.hardcases`; the engine is isolated as in
any other suite.
"""

from __future__ import annotations

import math
from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np

from twolink.chain import Chain
from twolink.conformance.results import TestResult, faulty
from twolink.conformance.session import Session
from twolink.conformance.transport import EngineFault, FaultKind
from twolink.coordinates import JointConvention
from twolink.engines.contract import Array, CannotError
from twolink.engines.messages import (
    Answer,
    Errored,
    Loaded,
    Method,
    Model,
    Move,
    Moved,
    Parameters,
    Refused,
    Skipped,
    States,
    Values,
)
from twolink.engines.sandbox import TaskResult
from twolink.engines.scenes import joint_state, parameters_of
from twolink.errors import EngineError
from twolink.hardcases import Case, Mark
from twolink.hardcases.hostile_urdf import URDFS
from twolink.hardcases.run import of_subject
from twolink.scene import Scene

Numbers = tuple[float, float]

_JOINTS = JointConvention()


def hard_case(session: Session, suite: str, case: Case) -> TestResult:
    """Return the result of a hard case."""
    identity = f"{suite}/{case.name}"
    result = TestResult(identity, suite, identity, case.group, (), Mark.CANNOT)
    try:
        found = of_subject(case, _ByMessages(session, identity))
    except EngineFault as fault:
        return faulty(result, fault)
    except CannotError as error:
        return replace(result, said=str(error))
    factor = math.nan if found.factor is None else found.factor
    return replace(result, mark=found.mark, factor=factor, said=found.said, output=found.output)


class _RefusedError(Exception):
    """The engine refuses a model or a question; the message says why."""


class _ByMessages:
    """An engine in a session; see `twolink.hardcases.record.Subject`.

    The time limit is that of the session. Raises `EngineFault`, and `CannotError` for a question
    that the engine skips.
    """

    def __init__(self, session: Session, identity: str) -> None:
        self._session, self._identity = session, identity

    @property
    def name(self) -> str:
        """The engine's name."""
        return self._session.engine.name

    @property
    def methods(self) -> tuple[Method, ...]:
        """The engine's methods."""
        return self._session.engine.methods

    @property
    def reads_urdf(self) -> bool:
        """Whether the engine reads URDF."""
        return "urdf" in self._session.engine.reads

    def unsupported(self, scene: Scene) -> str | None:
        """Return why the engine cannot express a scene, or None if it can."""
        engine = self._session.engine
        if not engine.methods or "parameters" not in engine.reads:
            return "the engine has no motions of parameters"
        try:
            _, needs = parameters_of(scene)
        except EngineError as error:
            return str(error)
        missing = [effect for effect in needs if effect not in engine.effects]
        return f"the engine does not have {' and '.join(missing)}" if missing else None

    def accelerations(
        self, chain: Chain, q: Numbers, u: Numbers, g: float, torque: Numbers, seconds: float
    ) -> TaskResult:
        """Return du (rad/s²)."""
        engine = self._session.engine
        if "parameters" not in engine.reads or "forward_dynamics" not in engine.answers:
            raise CannotError("the engine has no forward dynamics of parameters")
        given = Parameters(
            mass=chain.mass,
            length=chain.length,
            centre=chain.centre,
            inertia=chain.inertia,
            gravity=g,
        )
        angles, speeds = _JOINTS.joint_angles(q), _JOINTS.joint_speeds(u)

        def ask() -> tuple[Any, tuple[str, ...]]:
            self._load(Model(id=self._identity, parameters=given))
            rates, warnings = self._forward(angles, speeds, torque)
            return _JOINTS.absolute_speeds(rates), warnings

        return _task(ask)

    def motions(
        self,
        scene: Scene,
        method: str,
        parameters: tuple[float, ...],
        times: Array,
        seconds: float,
    ) -> TaskResult:
        """Return q, u and warnings for each parameter value."""
        given, _ = parameters_of(scene)

        def ask() -> tuple[Any, tuple[str, ...]]:
            self._load(Model(id=self._identity, parameters=given))
            return [self._motion(scene, method, value, times) for value in parameters], ()

        return _task(ask)

    def reading(self, urdf: str, seconds: float) -> TaskResult:
        """Return the accelerations of a URDF that was loaded, if the engine has them."""

        def ask() -> tuple[Any, tuple[str, ...]]:
            self._load(
                Model(
                    id=self._identity,
                    urdf=URDFS[urdf](),
                    gravity=(0.0, 0.0, -9.81),
                    joints=("joint1", "joint2"),
                    tip="D",
                )
            )
            if "forward_dynamics" not in self._session.engine.answers:
                return [], ()
            return self._forward((0.0, 0.0), (0.1, 0.1), (0.0, 0.0))

        return _task(ask)

    def _load(self, model: Model) -> None:
        answer = self._session.load(model)
        if isinstance(answer, Refused):
            raise _RefusedError(answer.refused)
        assert isinstance(answer, Loaded)

    def _forward(self, *state: Any) -> tuple[Numbers, tuple[str, ...]]:
        angles, speeds, torques = state
        states = States(angles=(angles,), speeds=(speeds,), torques=(torques,))
        answer = self._session.question(self._identity, "forward_dynamics", states)
        _check_answered(answer)
        assert isinstance(answer, Values)
        found = np.array(answer.values, dtype=float)
        if found.shape != (1, 2):
            got = " × ".join(map(str, found.shape))
            said = f"values of forward_dynamics must be 1 × 2 numbers; got {got}"
            raise EngineFault(FaultKind.WRONG_LENGTH, said)
        return (float(found[0, 0]), float(found[0, 1])), answer.warnings

    def _motion(
        self, scene: Scene, method: str, parameter: float, times: Array
    ) -> tuple[Array, Array, tuple[str, ...]]:
        angles, speeds = joint_state(scene)
        answer = self._session.move(
            Move(
                seq=0,
                test=self._identity,
                angles=angles,
                speeds=speeds,
                method=method,
                parameter=parameter,
                times=tuple(times.tolist()),
            )
        )
        _check_answered(answer)
        assert isinstance(answer, Moved)
        theta, omega = (np.array(rows).T for rows in (answer.angles, answer.speeds))
        q = np.array(_JOINTS.absolute_angles((theta[0], theta[1])))
        u = np.array(_JOINTS.absolute_speeds((omega[0], omega[1])))
        return q, u, answer.warnings


def _check_answered(answer: Answer) -> None:
    """Raise `CannotError` for a question that was skipped, `_RefusedError` for one that failed."""
    if isinstance(answer, Skipped):
        raise CannotError(answer.message or "skipped")
    if isinstance(answer, Errored):
        raise _RefusedError(answer.message or "an error")


def _task(ask: Any) -> TaskResult:
    """Return the outcome of questions, with the engine's warnings."""
    begin = perf_counter()
    try:
        result, warnings = ask()
    except _RefusedError as error:
        return TaskResult("refused", perf_counter() - begin, said=str(error))
    return TaskResult("finished", perf_counter() - begin, result, warnings=warnings)
