"""The protocol of `twolink conform` for adapters in Python: a loop over lines of JSON.

An adapter is a script with a class of `Engine` and `serve(MyEngine)`. It needs NumPy and the
engine's package alone, so that each engine can have an environment of its own. The answers are the
methods named as the quantities of docs/check_your_engine.md.
"""

from __future__ import annotations

import contextlib
import importlib.metadata
import itertools
import json
import math
import os
import sys
import tempfile
import time
import traceback
import warnings
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

QUANTITIES = (
    "mass_matrix",
    "velocity_terms",
    "gravity_terms",
    "inverse_dynamics",
    "forward_dynamics",
    "kinetic_energy",
    "potential_energy",
    "position",
    "velocity",
    "acceleration",
    "jacobian",
)
_INPUTS = {
    "velocity_terms": ("angles", "speeds"),
    "inverse_dynamics": ("angles", "speeds", "accelerations"),
    "forward_dynamics": ("angles", "speeds", "torques"),
    "kinetic_energy": ("angles", "speeds"),
    "velocity": ("angles", "speeds"),
    "acceleration": ("angles", "speeds", "accelerations"),
}
_NOT_FINITE = {"nan": math.nan, "inf": math.inf, "-inf": -math.inf}
_VECTORS = ("position", "velocity", "acceleration", "jacobian")


class RefusedError(Exception):
    """The engine rejects a model."""


class CannotError(Exception):
    """The engine cannot answer a question; the message says why."""


@dataclass(frozen=True)
class Model:
    """A model as a URDF text; `armature` (kg m²), which URDF lacks, is of both joints.

    `gravity` (m/s²) is in the root link's frame, `joints` and `tip` (a link) are names. `planar`
    states that the text was written from `parameters`, by `urdf_of`.
    """

    urdf: str
    gravity: tuple[float, float, float]
    joints: tuple[str, str]
    tip: str
    armature: tuple[float, float] = (0.0, 0.0)
    planar: bool = False
    parameters: dict[str, Any] | None = None


class Engine(ABC):
    """An engine: its capabilities, and methods for arrays with a row for each state."""

    name = ""
    package = ""
    version = ""
    precision = "binary64"
    reads: tuple[str, ...] = ("urdf", "parameters")
    effects: tuple[str, ...] = ()
    methods: tuple[dict[str, Any], ...] = ()
    issues = ""

    @abstractmethod
    def load(self, model: Model) -> dict[str, Any] | None:
        """Load a model; return its parameters as the engine reports them, or None."""

    def move(
        self, angles: Array, speeds: Array, method: str, parameter: float, times: list[float]
    ) -> tuple[Array, Array]:
        """Return angles and speeds at the times, shape (n, 2) each."""
        raise CannotError("it does not simulate")


def serve(kind: Callable[[], Engine]) -> None:
    """Answer requests on the standard input until `stop` or the end."""
    # Output of the engine, from C too, must not come between the messages.
    kept = os.dup(1)
    os.dup2(2, 1)
    engine = kind()
    server = _Server(engine)
    with os.fdopen(kept, "w", encoding="utf-8") as answers:
        for line in sys.stdin:
            request = numbers(json.loads(line))
            if request["cmd"] == "stop":
                break
            answers.write(json.dumps(server.answer(request), allow_nan=False) + "\n")
            answers.flush()
    # Some engines crash when they are torn down, after all has been said.
    os._exit(0)


class _Server:
    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self._planar = False

    def answer(self, request: dict[str, Any]) -> dict[str, Any]:
        try:
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always")
                found = getattr(self, "_" + request["cmd"])(request)
            if caught and "engine" not in found:
                found["warnings"] = sorted({f"{w.category.__name__}: {w.message}" for w in caught})
            return found
        except Exception as error:
            said = str(error) if isinstance(error, (RefusedError, CannotError)) else _last(error)
            if request["cmd"] == "model":
                return {"refused": said}
            if isinstance(error, CannotError):
                return {"seq": request["seq"], "skipped": True, "message": said}
            context = {"traceback": traceback.format_exc()}
            return {"seq": request["seq"], "errored": True, "message": said, "context": context}

    def _start(self, request: dict[str, Any]) -> dict[str, Any]:
        engine = self._engine
        about = {
            "name": engine.name,
            "version": engine.version or importlib.metadata.version(engine.package),
            "language": "python",
            "issues": engine.issues,
            "precision": engine.precision,
            "reads": engine.reads,
            "answers": [name for name in QUANTITIES if hasattr(engine, name)],
            "effects": engine.effects,
            "methods": engine.methods,
        }
        return {"version": 1, "engine": about}

    def _model(self, request: dict[str, Any]) -> dict[str, Any]:
        given = request.get("parameters")
        self._planar = given is not None
        if given is not None:
            model = Model(
                urdf_of(given),
                (0.0, 0.0, -given["gravity"]),
                ("shoulder", "elbow"),
                "D",
                tuple(given.get("armature", (0.0, 0.0))),
                planar=True,
                parameters=given,
            )
        else:
            model = Model(
                request["urdf"],
                tuple(request["gravity"]),
                tuple(request["joints"]),
                request["tip"],
            )
        understood = self._engine.load(model)
        return {"ok": True} if understood is None else {"ok": True, "understood": words(understood)}

    def _ask(self, request: dict[str, Any]) -> dict[str, Any]:
        name = request["quantity"]
        inputs = [
            np.array(request["states"][key], dtype=float) for key in _INPUTS.get(name, ("angles",))
        ]
        values = np.asarray(getattr(self._engine, name)(*inputs), dtype=float)
        if self._planar and name in _VECTORS:
            # Components along x and y, which points down, of vectors along x, y and z.
            values = np.stack([values[:, 0], -values[:, 2]], axis=1)
        return {"seq": request["seq"], "values": words(values.tolist())}

    def _move(self, request: dict[str, Any]) -> dict[str, Any]:
        start = time.perf_counter()
        angles, speeds = self._engine.move(
            np.array(request["angles"], dtype=float),
            np.array(request["speeds"], dtype=float),
            request["method"],
            request["parameter"],
            request["times"],
        )
        return {
            "seq": request["seq"],
            "angles": words(np.asarray(angles, dtype=float).tolist()),
            "speeds": words(np.asarray(speeds, dtype=float).tolist()),
            "seconds": time.perf_counter() - start,
        }


def stepped(times: list[float], step: float) -> Iterator[tuple[float, int]]:
    """Yield, for each time but the first, a step of at most `step` (s) and how many reach it."""
    for start, end in itertools.pairwise(times):
        count = max(1, math.ceil((end - start) / step - 1e-9))
        yield (end - start) / count, count


def each(function: Callable[..., Any], *rows: Array) -> Array:
    """Return the values of a function of one state, at all states."""
    return np.array([np.array(function(*state)) for state in zip(*rows, strict=True)])


def parameters_of(model: Model) -> dict[str, Any]:
    """Return the parameters of a model, with damping and friction, for engines without URDF."""
    if model.parameters is None:
        raise RefusedError("the model has no parameters")
    return {"damping": (0.0, 0.0), "friction": (0.0, 0.0), **model.parameters}


def child_of(urdf: str, joint: str) -> str:
    """Return the child link of a joint, for engines that name links alone."""
    for element in ElementTree.fromstring(urdf).findall("joint"):
        if element.get("name") == joint:
            child = element.find("child")
            return str(child.get("link")) if child is not None else ""
    raise RefusedError(f"there is no joint {joint}")


def springs_of(model: Model) -> Iterator[tuple[str, float, float]]:
    """Yield the joints with a spring, by name, its stiffness (N m/rad) and its rest angle (rad)."""
    given = model.parameters or {}
    rests = given.get("rest", (0.0, 0.0))
    for name, stiffness, rest in zip(
        model.joints, given.get("stiffness", (0.0, 0.0)), rests, strict=True
    ):
        if stiffness:
            yield name, stiffness, rest


@contextlib.contextmanager
def as_file(text: str) -> Iterator[str]:
    """Yield the path of a file with a URDF text, for engines that read files alone."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "model.urdf")
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
        yield path


def numbers(value: Any) -> Any:
    """Return a message with the numbers that JSON lacks in place of their words."""
    if isinstance(value, dict):
        return {key: numbers(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [numbers(entry) for entry in value]
    return _NOT_FINITE.get(value, value) if isinstance(value, str) else value


def words(value: Any) -> Any:
    """Return nested lists with NaN and infinities as strings, as JSON wants them."""
    if isinstance(value, dict):
        return {key: words(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [words(entry) for entry in value]
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return value


def urdf_of(parameters: dict[str, Any]) -> str:
    """Return the URDF of a chain from parameters: it turns about +y, and z points up.

    Bodies have the same moment about all axes, of which only that about y acts.
    """
    (L1, L2), gap = parameters["length"], (0.0, 0.0)
    damping, friction = (parameters.get(name, gap) for name in ("damping", "friction"))
    parts = ['<robot name="chain"><link name="ground"/>']
    for number, (link, parent, joint, place) in enumerate(
        [("link1", "ground", "shoulder", 0.0), ("link2", "link1", "elbow", L1)]
    ):
        mass, moment = parameters["mass"][number], parameters["inertia"][number]
        a, b = parameters["centre"][number]
        parts.append(
            f'<joint name="{joint}" type="continuous"><parent link="{parent}"/>'
            f'<child link="{link}"/><origin xyz="{place!r} 0 0"/><axis xyz="0 1 0"/>'
            f'<dynamics damping="{damping[number]!r}" friction="{friction[number]!r}"/></joint>'
            f'<link name="{link}"><inertial><origin xyz="{a!r} 0 {-b!r}"/><mass value="{mass!r}"/>'
            f'<inertia ixx="{moment!r}" iyy="{moment!r}" izz="{moment!r}"'
            ' ixy="0" ixz="0" iyz="0"/></inertial></link>'
        )
    parts.append(
        '<link name="D"/><joint name="tip" type="fixed"><parent link="link2"/><child link="D"/>'
        f'<origin xyz="{L2!r} 0 0"/></joint></robot>'
    )
    return "".join(parts)


def _last(error: Exception) -> str:
    return f"{type(error).__name__}: {error}".split("\n")[0]
