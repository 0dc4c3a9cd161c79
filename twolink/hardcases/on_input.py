"""A trial of input that must be refused: in one sentence, in bounded time and memory.

What is hostile is tried in a process of its own, with limits, also of this library. A peer is given
the same state, or the same URDF through its own reader; the scene files are this library's alone.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from twolink.errors import TwolinkError
from twolink.hardcases.record import Finding
from twolink.shipped import shipped

if TYPE_CHECKING:
    from twolink.engines.isolated import Outcome as Isolated
    from twolink.engines.peer import Peer

# A sentence may quote what was received, and is short enough to be read.
_LONGEST_SENTENCE = 500

_SECONDS, _MEMORY = 20.0, 2 * 2**30


@dataclass(frozen=True)
class OnInput:
    """Something that must be refused.

    `attempt` takes a formulation and must raise `TwolinkError`. With a `hostile` name it is instead
    the attempt of that name in `HOSTILE`, in a process of its own. Peers are given the `urdf` of a
    name in `URDFS`, or `state`, keywords of their forward dynamics; `harmless` input they may also
    load, if it costs them nothing.
    """

    attempt: Callable[[str], object] | None = None
    hostile: str = ""
    urdf: str = ""
    state: dict[str, Any] | None = None
    harmless: bool = False
    _found: dict[str, Finding] = field(default_factory=dict, repr=False, compare=False)

    def ours(self, formulation: str, check: Callable[[], None]) -> Finding:
        """Return whether the library refuses it, in one sentence."""
        if self.attempt is not None:
            return refused(lambda: self.attempt(formulation))  # type: ignore[misc]
        # What reads a file knows of no formulation.
        if self.hostile not in self._found:
            self._found[self.hostile] = _hostile_finding(self.hostile)
        return self._found[self.hostile]

    def cannot(self, peer: Peer) -> str | None:
        """Return why a peer cannot be given this; None if it can."""
        if self.state is not None:
            return None
        if not self.urdf:
            return "scene files are this library's own"
        return None if peer.name in READERS else f"{peer.name} reads no URDF"

    def peers(self, peer: Peer, seconds: float) -> tuple[Finding | None, Isolated, str]:
        """Return whether a peer refuses it: one that answers has not."""
        from twolink.engines.isolated import run_isolated

        limit, memory = min(seconds, _SECONDS), 2 * _MEMORY
        if self.state is not None:
            done = run_isolated(peer_answers, peer.name, self.state, seconds=limit, memory=memory)
            call = f"{peer.name}.accelerations(uniform bars, **{self.state!r})"
        else:
            done = run_isolated(peer_reads, peer.name, self.urdf, seconds=limit, memory=memory)
            call = f"{peer.name} reads the URDF '{self.urdf}' of twolink.hardcases.on_input"
        if done.kind == "refused":
            return Finding(0.0, said=done.said), done, call
        if done.kind != "finished":
            return None, done, call
        numbers = [float(x) for x in done.result]
        finite = all(map(math.isfinite, numbers))
        said = f"it is taken, and the answer is {numbers}"
        factor = 0.0 if self.harmless else math.inf
        return Finding(factor, bool(done.warnings), said, finite=finite), done, call


def refused(attempt: Callable[[], object]) -> Finding:
    """Return whether an attempt is refused as it should be."""
    try:
        attempt()
    except TwolinkError as error:
        sentence = str(error)
        if "\n" in sentence or len(sentence) > _LONGEST_SENTENCE or "allowed" not in sentence:
            return Finding(math.inf, said=f"no clear sentence: {sentence[:_LONGEST_SENTENCE]!r}")
        return Finding(0.0, said=sentence)
    return Finding(math.inf, said="it is not refused")


def _hostile_finding(name: str) -> Finding:
    from twolink.engines.isolated import run_isolated

    done = run_isolated(hostile_attempt, name, seconds=_SECONDS, memory=_MEMORY)
    if done.kind != "finished":
        return Finding(math.inf, said=f"{done.kind}: {done.said}")
    finding: Finding = done.result
    return finding


def hostile_attempt(name: str) -> Finding:
    """Return what comes of a hostile attempt; the task of a process of its own."""
    from twolink.hardcases.input import HOSTILE

    with tempfile.TemporaryDirectory() as folder:
        return refused(lambda: HOSTILE[name](Path(folder)))


def peer_answers(name: str, state: dict[str, Any]) -> tuple[float, float]:
    """Return a peer's du (rad/s²) of uniform bars; the task of a process of its own."""
    from twolink.chain import Chain
    from twolink.engines.peers import peer_named

    keywords = {"q": (0.3, -0.4), "u": (0.1, -0.2), **state}
    q, u = keywords.pop("q"), keywords.pop("u")
    du1, du2 = peer_named(name).accelerations(Chain.uniform_bars(), q, u, **keywords)
    return float(du1), float(du2)


def peer_reads(name: str, urdf: str) -> list[float]:
    """Return what a peer computes of what it made of a URDF: accelerations, or PyBullet's torques.

    It is the task of a process of its own.
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

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "robot.urdf"
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
    return shipped("twolink.urdf").read_text(encoding="utf-8")


def _edited(old: str, new: str) -> Callable[[], str]:
    def text() -> str:
        original = _shipped_urdf()
        assert old in original
        return original.replace(old, new)

    return text


def _with_entities() -> str:
    """Return a URDF whose entities would expand to a billion letters."""
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
