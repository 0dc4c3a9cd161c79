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

from twolink.data import data_path
from twolink.errors import TwolinkError
from twolink.files import scratch_folder
from twolink.formulations import EquationsName
from twolink.hardcases.record import Result

if TYPE_CHECKING:
    from twolink.engines.sandbox import TaskResult
    from twolink.engines.simulation_engine import SimulationEngine

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
    `urdf` of a name in `URDFS`, or `state`, keywords of their forward dynamics; `harmless` input
    may also be loaded within the limits.
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

    def unsupported(self, engine: SimulationEngine) -> str | None:
        """Return why an engine cannot be tried with this, or None if it can."""
        if self.state is not None:
            return None
        if not self.urdf:
            return "scene files are this library's own"
        return None if engine.name in READERS else f"{engine.name} reads no URDF"

    def external(
        self, engine: SimulationEngine, seconds: float
    ) -> tuple[Result | None, TaskResult, str]:
        """Return whether an engine rejects it; any answer counts as accepted."""
        from twolink.engines.sandbox import run_sandboxed

        limit, memory = min(seconds, _SECONDS), 2 * _MEMORY
        if self.state is not None:
            done = run_sandboxed(
                engine_answers, engine.name, self.state, seconds=limit, memory=memory
            )
            call = f"{engine.name}.accelerations(uniform bars, **{self.state!r})"
        else:
            done = run_sandboxed(engine_reads, engine.name, self.urdf, seconds=limit, memory=memory)
            call = f"{engine.name} reads the URDF '{self.urdf}' of twolink.hardcases.input_trial"
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


def engine_answers(name: str, state: dict[str, Any]) -> tuple[float, float]:
    """Return an engine's du (rad/s²) for uniform bars; runs in a sandbox."""
    from twolink.chain import Chain
    from twolink.engines.registry import simulator_named

    keywords = {"q": (0.3, -0.4), "u": (0.1, -0.2), **state}
    q, u = keywords.pop("q"), keywords.pop("u")
    du1, du2 = simulator_named(name).accelerations(Chain.uniform_bars(), q, u, **keywords)
    return float(du1), float(du2)


def engine_reads(name: str, urdf: str) -> list[float]:
    """Return an engine's accelerations (PyBullet: torques) for a URDF that it has loaded.

    Runs in a sandbox.
    """
    return READERS[name](URDFS[urdf]())


def _pinocchio(text: str) -> list[float]:
    import numpy as np
    import pinocchio

    model = pinocchio.buildModelFromXML(text)
    q = pinocchio.neutral(model)
    v = np.full(model.nv, 0.1)
    found = pinocchio.aba(model, model.createData(), q, v, 0 * v)
    return [float(x) for x in found]


def _mujoco(text: str) -> list[float]:
    import mujoco

    model: Any = mujoco.MjModel.from_xml_string(text)
    data: Any = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return [float(x) for x in data.qacc]


def _drake(text: str) -> list[float]:
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import MultibodyPlant

    plant = MultibodyPlant(0.0)
    Parser(plant).AddModelsFromString(text, "urdf")
    plant.Finalize()
    context = plant.CreateDefaultContext()
    rates = plant.EvalTimeDerivatives(context).CopyToVector()
    return [float(x) for x in rates[plant.num_positions() :]]


def _pybullet(text: str) -> list[float]:
    import pybullet

    with scratch_folder("input") as folder:
        file = folder / "robot.urdf"
        file.write_text(text, encoding="utf-8")
        client = pybullet.connect(pybullet.DIRECT)
        robot = pybullet.loadURDF(str(file), useFixedBase=True)
        joints = range(pybullet.getNumJoints(robot))
        free = [j for j in joints if pybullet.getJointInfo(robot, j)[2] != pybullet.JOINT_FIXED]
        zeros = [0.0] * len(free)
        found = pybullet.calculateInverseDynamics(robot, zeros, zeros, zeros)
        pybullet.disconnect(client)
        return [float(x) for x in found]


READERS: dict[str, Callable[[str], list[float]]] = {
    "SciPy over Pinocchio": _pinocchio,
    "MuJoCo": _mujoco,
    "Drake": _drake,
    "PyBullet": _pybullet,
}


def _shipped_urdf() -> str:
    return data_path("twolink.urdf").read_text(encoding="utf-8")


def _edited(old: str, new: str) -> Callable[[], str]:
    def text() -> str:
        original = _shipped_urdf()
        assert old in original
        return original.replace(old, new)

    return text


def _with_entities() -> str:
    """Return a URDF whose entities would expand to a billion characters."""
    names = "abcdefghij"
    lines = [
        f'<!ENTITY {first} "{f"&{second};" * 10}">'
        for first, second in zip(names[1:], names, strict=False)
    ]
    entities = "\n".join(['<!ENTITY a "aaaaaaaaaa">', *lines])
    body = _shipped_urdf().partition("<robot")[2]
    start = f'<?xml version="1.0"?>\n<!DOCTYPE robot [\n{entities}\n]>\n<robot'
    return start + body.replace("</robot>", "<note>&j;</note></robot>")


def _with_a_file() -> str:
    body = _shipped_urdf().partition("<robot")[2]
    entity = '<!DOCTYPE robot [<!ENTITY secret SYSTEM "file:///etc/passwd">]>'
    return f'<?xml version="1.0"?>\n{entity}\n<robot' + body.replace(
        "</robot>", "<note>&secret;</note></robot>"
    )


URDFS: dict[str, Callable[[], str]] = {
    "empty": lambda: "",
    "truncated": lambda: _shipped_urdf()[: len(_shipped_urdf()) // 2],
    "NaN mass": _edited('<mass value="1.0"/>', '<mass value="nan"/>'),
    "infinite mass": _edited('<mass value="1.0"/>', '<mass value="1e999"/>'),
    "negative mass": _edited('<mass value="1.0"/>', '<mass value="-1"/>'),
    "negative inertia": _edited('iyy="0.08', 'iyy="-0.08'),
    "no axis": _edited('<axis xyz="0 1 0"/>', '<axis xyz="0 0 0"/>'),
    "a loop": lambda: (
        "<robot name='r'><link name='a'/><link name='b'/>"
        "<joint name='j' type='continuous'><parent link='a'/><child link='b'/></joint>"
        "<joint name='k' type='continuous'><parent link='b'/><child link='a'/></joint></robot>"
    ),
    "entities": _with_entities,
    "a file": _with_a_file,
    "deep": lambda: "<robot name='r'>" + "<a>" * 1_000_000 + "</a>" * 1_000_000 + "</robot>",
    "100 MB": lambda: _shipped_urdf() + "<!--" + "x" * 100_000_000 + "-->",
    "noise": lambda: bytes(range(1, 256)).decode("latin-1") * 100,
}
