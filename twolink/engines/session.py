"""A session with an engine, which is started anew after each fault."""

from __future__ import annotations

from collections.abc import Callable
from types import TracebackType
from typing import Self

from twolink.engines.faults import EngineFault, FaultKind
from twolink.engines.messages import (
    PROTOCOL,
    About,
    Answer,
    Ask,
    Loaded,
    Model,
    Move,
    Request,
    Start,
    Started,
    States,
)
from twolink.engines.transport import Transport
from twolink.errors import EngineError


class Session:
    """An engine that is started anew, with its model, after each fault."""

    def __init__(self, start: Callable[[], Transport], seconds: float) -> None:
        """Start the engine. Raises `EngineError` if it does not start."""
        self._start, self._seconds = start, seconds
        self._transport: Transport | None = None
        self.model: Model | None = None
        self._seq = 0
        self.printed = (0, "")
        """Warnings that the engine printed while it answered, known when it was closed."""
        try:
            self.engine = self._started()
        except EngineFault as fault:
            self.close()
            raise EngineError(f"the engine does not start: {fault}") from fault

    def __enter__(self) -> Self:
        """Return the session."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Stop the engine."""
        self.close()

    def load(self, model: Model) -> Answer:
        """Load a model. Raises `EngineFault`."""
        self.model = None
        answer = self._asked(model)
        self.model = model if isinstance(answer, Loaded) else None
        return answer

    def ask(self, test: str, quantity: str, states: States) -> Answer:
        """Ask for a quantity in states. Raises `EngineFault`."""
        self._seq += 1
        return self._asked(Ask(seq=self._seq, test=test, quantity=quantity, states=states))

    def move(self, request: Move) -> Answer:
        """Ask for a motion. Raises `EngineFault`."""
        self._seq += 1
        return self._asked(request.model_copy(update={"seq": self._seq}))

    def stop(self, seconds: float) -> bool:
        """Ask the engine to stop; return whether it ends by itself within a time (s)."""
        if self._transport is None:
            self._started()
        assert self._transport is not None
        return self._transport.stop(seconds)

    def close(self) -> None:
        """Stop the engine."""
        if self._transport is not None:
            self._transport.close()
            count, first = self._transport.printed
            self.printed = self.printed[0] + count, self.printed[1] or first
            self._transport = None

    def _asked(self, request: Request) -> Answer:
        try:
            if self._transport is None:
                self._started()
                if self.model is not None:
                    self._told(self.model)
            return self._told(request)
        except EngineFault:
            self.close()
            raise

    def _started(self) -> About:
        self._transport = self._start()
        answer = self._told(Start())
        assert isinstance(answer, Started)
        if answer.version != PROTOCOL:
            raise EngineFault(
                FaultKind.NO_MESSAGE, f"version must be {PROTOCOL}; got {answer.version}"
            )
        return answer.engine

    def _told(self, request: Request) -> Answer:
        assert self._transport is not None
        return self._transport.ask(request, self._seconds)
