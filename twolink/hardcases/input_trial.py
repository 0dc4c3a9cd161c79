"""A trial of input that must be rejected: with one sentence, in bounded time and memory.

Hostile input runs in a sandbox, also for this library. An external engine gets the same state, or
the same URDF through its own reader; only this library reads scene files.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from twolink.chain import Chain
from twolink.errors import TwolinkError
from twolink.formulations import EquationsName
from twolink.hardcases.record import Result, Subject

if TYPE_CHECKING:
    from twolink.engines.sandbox import TaskResult

# A message may quote the received value, with this limit on its length (characters).
_LONGEST_SENTENCE = 500
# A message states the requirement: "<name> must be …; got …".
_REQUIREMENT = re.compile(r"\b(must|allowed)\b")

_SECONDS, _MEMORY = 20.0, 2 * 2**30


@dataclass(frozen=True)
class InputTrial:
    """Input that must be rejected.

    `attempt` takes a formulation and must raise `TwolinkError`. With a `hostile` name,
    `hostile_attempt` returns the finding on it instead, in a sandbox. External engines get the
    `urdf` of a name in `hostile_urdf.URDFS`, or `state`, keywords of their forward dynamics;
    `harmless` input may also be loaded within the limits.
    """

    attempt: Callable[[EquationsName], object] | None = None
    hostile: str = ""
    hostile_attempt: Callable[[str], Result] | None = None
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
        from twolink.engines.sandbox import run_sandboxed

        assert self.hostile_attempt is not None
        done = run_sandboxed(self.hostile_attempt, self.hostile, seconds=_SECONDS, memory=_MEMORY)
        if done.kind != "finished":
            return Result(math.inf, said=f"{done.kind}: {done.said}")
        result: Result = done.result
        return result

    def unsupported(self, subject: Subject) -> str | None:
        """Return why an engine cannot be tried with this, or None if it can."""
        if self.state is not None:
            return None
        if not self.urdf:
            return "scene files are this library's own"
        return None if subject.reads_urdf else f"{subject.name} reads no URDF"

    def external(self, subject: Subject, seconds: float) -> tuple[Result | None, TaskResult, str]:
        """Return whether an engine rejects it; any answer counts as accepted."""
        limit = min(seconds, _SECONDS)
        if self.state is not None:
            state: dict[str, Any] = {"q": (0.3, -0.4), "u": (0.1, -0.2), **self.state}
            done = subject.accelerations(
                Chain.uniform_bars(), state["q"], state["u"], 9.81, (0.0, 0.0), limit
            )
            call = f"{subject.name}.accelerations(uniform bars, **{self.state!r})"
        else:
            done = subject.reading(self.urdf, limit)
            call = f"{subject.name} reads the URDF '{self.urdf}' of twolink.hardcases.hostile_urdf"
        if done.kind == "refused":
            return Result(0.0, said=done.said), done, call
        if done.kind != "finished":
            return None, done, call
        numbers = [float(x) for x in done.result]
        finite = all(map(math.isfinite, numbers))
        said = f"it is accepted; the answer is {numbers}"
        factor = 0.0 if self.harmless else math.inf
        return Result(factor, bool(done.warnings), said, finite=finite), done, call


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
