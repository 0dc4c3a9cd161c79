"""A trial of input that must be rejected: with one sentence, in bounded time and memory.

Hostile input runs in a process of its own, also for this library. An external engine gets the same
state, or the same URDF through its own reader; only this library reads scene files.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from twolink.chain import Chain
from twolink.engines.child import value_of
from twolink.engines.contract import Engine
from twolink.engines.faults import CannotError, EngineFault
from twolink.engines.marks import Result
from twolink.engines.messages import Model
from twolink.engines.remote_engine import RemoteEngine
from twolink.errors import EngineError, TwolinkError
from twolink.hardcases.hostile_urdf import URDFS
from twolink.hardcases.state_trial import accelerations, without_accelerations
from twolink.names import EquationsName

# A message may quote the received value, with this limit on its length (characters).
_LONGEST_SENTENCE = 500
# A message states the requirement: "<name> must be …; got …".
_REQUIREMENT = re.compile(r"\b(must|allowed)\b")

_HOSTILE = "twolink.hardcases.input"
_SECONDS, _MEMORY = 20.0, 2 * 2**30


@dataclass(frozen=True)
class InputTrial:
    """Input that must be rejected.

    `attempt` takes a formulation and must raise `TwolinkError`. With a `hostile` name,
    `twolink.hardcases.input` is run on it instead. External engines get the
    `urdf` of a name in `hostile_urdf.URDFS`, or `state`, keywords of their forward dynamics;
    `harmless` input may also be loaded within the limits.
    """

    attempt: Callable[[EquationsName], object] | None = None
    hostile: str = ""
    urdf: str = ""
    state: dict[str, Any] | None = None
    harmless: bool = False
    _found: dict[str, Result] = field(default_factory=dict, repr=False, compare=False)

    def ours(self, formulation: EquationsName, check: Callable[[], None]) -> Result:
        """Return whether the library rejects it with one sentence."""
        if self.attempt is not None:
            return refused(lambda: self.attempt(formulation))  # type: ignore[misc]
        # Reading a file does not depend on the formulation.
        if self.hostile not in self._found:
            self._found[self.hostile] = self._hostile_result()
        return self._found[self.hostile]

    def _hostile_result(self) -> Result:
        try:
            factor, said = value_of(_HOSTILE, self.hostile, seconds=_SECONDS, memory=_MEMORY)
        except EngineFault as fault:
            factor, said = math.inf, str(fault)
        return Result(factor, said=said)

    def unsupported(self, engine: Engine) -> str | None:
        """Return why an engine cannot be tried with this, or None if it can."""
        if self.state is not None:
            return without_accelerations(engine)
        if not self.urdf:
            return "scene files are this library's own"
        return None if "urdf" in engine.reads else f"{engine.name} reads no URDF"

    def call(self, engine: Engine) -> str:
        """Return the input of an engine."""
        if self.state is not None:
            return f"{engine.name}: forward_dynamics(uniform bars, **{self.state!r})"
        return f"{engine.name} reads the URDF '{self.urdf}' of twolink.hardcases.hostile_urdf"

    def external(self, engine: RemoteEngine) -> Result:
        """Return whether an engine rejects it; any answer counts as accepted."""
        try:
            numbers = self._answer(engine)
        except CannotError:
            raise
        except EngineError as error:
            return Result(0.0, said=str(error))
        finite = all(map(math.isfinite, numbers))
        said = f"it is accepted; the answer is {numbers}"
        factor = 0.0 if self.harmless else math.inf
        return Result(factor, bool(engine.captured_warnings), said, finite=finite)

    def _answer(self, engine: Engine) -> list[float]:
        """Return the accelerations that an engine answers, none if it only reads."""
        if self.state is not None:
            state: dict[str, Any] = {"q": (0.3, -0.4), "u": (0.1, -0.2), **self.state}
            chain = Chain.uniform_bars()
            return list(accelerations(engine, chain, state["q"], state["u"], 9.81, (0.0, 0.0)))
        engine.load(
            Model(
                id=self.urdf,
                urdf=URDFS[self.urdf](),
                gravity=(0.0, 0.0, -9.81),
                joints=("joint1", "joint2"),
                tip="D",
            )
        )
        if "forward_dynamics" not in engine.answers:
            return []
        rest, turning = np.zeros((1, 2)), np.full((1, 2), 0.1)
        states = {"angles": rest, "speeds": turning, "torques": rest}
        return [float(x) for x in engine.evaluate("forward_dynamics", states)[0]]


def refused(attempt: Callable[[], object]) -> Result:
    """Return whether an attempt is rejected with a clear sentence."""
    try:
        attempt()
    except TwolinkError as error:
        sentence = str(error)
        one_line = "\n" not in sentence and len(sentence) <= _LONGEST_SENTENCE
        if not one_line or not _REQUIREMENT.search(sentence):
            return Result(math.inf, said=f"no clear sentence: {sentence[:_LONGEST_SENTENCE]!r}")
        return Result(0.0, said=sentence)
    return Result(math.inf, said="it is not rejected")
