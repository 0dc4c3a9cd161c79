"""An engine in a session, by the contract: each call is a message, its answer is checked."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from twolink.engines.contract import Array, Engine
from twolink.engines.faults import CannotError, EngineFault, FaultKind, ModelRefusedError
from twolink.engines.messages import (
    Errored,
    Loaded,
    Model,
    Move,
    Moved,
    Refused,
    Skipped,
    States,
    Understood,
    Values,
)
from twolink.engines.quantities import QUANTITIES
from twolink.engines.session import Session
from twolink.errors import EngineError


class RemoteEngine(Engine):
    """An engine of any language, isolated from this process, with the capabilities that it names.

    `captured_warnings` are the warnings that came with its answers. In addition to the errors of
    the contract, a call raises `EngineError` for a question that failed in the engine, and
    `EngineFault` where no answer came.
    """

    def __init__(self, session: Session, identity: str) -> None:
        """Take a session; `identity` names the test in its messages."""
        about = session.engine
        self._session, self._identity = session, identity
        self.captured_warnings: list[str] = []
        self.name, self.precision, self.issues = about.name, about.precision, about.issues
        self.reads, self.effects, self.methods = about.reads, about.effects, about.methods

    @property
    def version(self) -> str:
        """The version that the engine names."""
        return self._session.engine.version

    @property
    def answers(self) -> tuple[str, ...]:
        """The quantities that the engine names."""
        return self._session.engine.answers

    @property
    def has_urdf(self) -> bool:
        """Whether the loaded model is a URDF, whose vectors have three components."""
        return self._session.model is not None and self._session.model.urdf is not None

    def load(self, model: Model) -> Understood | None:
        """Load a model, and return its parameters as the engine has read them."""
        answer = self._session.load(model)
        if isinstance(answer, Refused):
            raise ModelRefusedError(answer.refused)
        assert isinstance(answer, Loaded)
        self.captured_warnings += answer.warnings
        return answer.understood

    def _evaluated(self, quantity: str, inputs: Sequence[Array]) -> Array:
        asked = QUANTITIES[quantity]
        rows: Any = dict(zip(asked.inputs, map(_rows, inputs), strict=True))
        question = States.model_construct(None, **rows)
        answer = self._answered(self._session.ask(self._identity, quantity, question))
        assert isinstance(answer, Values)
        self.captured_warnings += answer.warnings
        return asked.array(answer.values, len(rows["angles"]), from_urdf=self.has_urdf)

    def move(self, request: Move) -> Moved:
        """Return a motion of the model."""
        answer = self._answered(self._session.move(request))
        assert isinstance(answer, Moved)
        self.captured_warnings += answer.warnings
        for name in ("angles", "speeds"):
            if (got := len(getattr(answer, name))) != len(request.times):
                said = f"{name} must be {len(request.times)} rows; got {got}"
                raise EngineFault(FaultKind.WRONG_LENGTH, said)
        return answer

    @staticmethod
    def _answered(answer: object) -> object:
        if isinstance(answer, Skipped):
            raise CannotError(answer.message or "skipped", answer.issue_url)
        if isinstance(answer, Errored):
            error = EngineError(answer.message or "an error")
            for note in answer.context.values():
                error.add_note(str(note))
            raise error
        return answer


def _rows(values: Array) -> tuple[tuple[float, ...], ...]:
    return tuple(map(tuple, values.tolist()))
