"""Input: what is no number, no chain, no scene and no file is refused, and costs nothing."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import fields, replace
from functools import partial
from pathlib import Path
from typing import Any

from twolink.chain import Chain
from twolink.effects import effect_class
from twolink.effects.gravity import Gravity
from twolink.errors import TwolinkError
from twolink.hardcases.on_input import URDFS, OnInput, refused
from twolink.hardcases.record import Case
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.urdf import parse_planar_urdf, read_planar_urdf

_EXPECTED = "refused in one sentence that says what was received and what is allowed"
_BOUND = (
    "a sentence of 500 letters at most, on one line; what is hostile has 20 s and 2 GB, in a "
    "process of its own; a peer may refuse in any words"
)


def _case(name: str, hard: str, trial: OnInput, expected: str = _EXPECTED) -> Case:
    return Case(name, "input", hard, expected, "what the input is", _BOUND, trial)


def _simulated(**changes: Any) -> Callable[[str], object]:
    """Return the attempt to simulate a scene of uniform bars with some fields changed."""

    def attempt(formulation: str) -> object:
        scene: dict[str, Any] = {
            "chain": Chain.uniform_bars(),
            "q": (0.3, -0.4),
            "u": (0.1, -0.2),
            "duration": 0.1,
            "effects": (Gravity(9.81),),
        }
        return simulate(Scene(**{**scene, **changes}), formulation=formulation, samples=2)

    return attempt


def _made(**changes: Any) -> Callable[[str], object]:
    """Return the attempt to make a chain of uniform bars with some fields changed."""
    return lambda _: replace(Chain.uniform_bars(), **changes)


# An effect of each kind, whose every number is replaced in turn.
_EFFECTS: dict[str, dict[str, Any]] = {
    "gravity": {"g": 9.81, "direction": (0.0, 1.0)},
    "end_force": {"normal": -5.0, "friction": 0.3, "static": 0.4},
    "joint_torque": {
        "torque": (1.0, 1.0),
        "amplitude": (1.0, 1.0),
        "frequency": (1.0, 1.0),
        "phase": (0.0, 0.0),
    },
    "sampled_torque": {
        "times": (0.0, 0.1),
        "A": (1.0, 2.0),
        "B": (1.0, 2.0),
        "interpolation": "linear",
    },
    "joint_damping": {"coefficient": (0.1, 0.1)},
    "joint_friction": {"kinetic": (0.1, 0.1), "static": (0.2, 0.2)},
    "motor_inertia": {"inertia": (0.1, 0.1), "ratio": (2.0, 2.0)},
    "joint_stop": {"joint": "A", "lower": -1.0, "upper": 1.0, "restitution": 0.5},
    "surface": {
        "point": (0.0, 3.0),
        "normal": (0.0, -1.0),
        "restitution": 0.5,
        "friction": 0.2,
        "static": 0.3,
    },
    "compliant_surface": {
        "point": (0.0, 3.0),
        "normal": (0.0, -1.0),
        "law": "kelvin-voigt",
        "stiffness": 1e4,
        "loss": 1.0,
        "friction": 0.2,
        "static": 0.3,
    },
    "joint_spring": {"stiffness": (1.0, 1.0), "rest": (0.0, 0.0)},
    "pd_control": {"target": (0.0, 0.0), "proportional": (1.0, 1.0), "derivative": (1.0, 1.0)},
    "end_drag": {"coefficient": 0.1},
}


def _spoilt(value: Any, number: float) -> list[Any]:
    """Return a value with each of its numbers replaced by another in turn."""
    if isinstance(value, float):
        return [number]
    if isinstance(value, tuple):
        return [(*value[:i], number, *value[i + 1 :]) for i in range(len(value))]
    return []


def _spoilt_effects(numbers: tuple[float, ...]) -> Callable[[str], object]:
    """Return the attempt to simulate effects of which one number is none, each in turn."""

    def attempt(formulation: str) -> object:
        last: TwolinkError | None = None
        for name, entries in _EFFECTS.items():
            for key, value in entries.items():
                for number in numbers:
                    for wrong in _spoilt(value, number):
                        last = _refusal(formulation, name, {**entries, key: wrong})
        assert last is not None
        raise last

    return attempt


def _refusal(formulation: str, name: str, entries: dict[str, Any]) -> TwolinkError:
    """Return the error with which an effect is refused; what is not refused is another error."""

    def attempt() -> object:
        effect = effect_class(name)(**entries)
        return _simulated(effects=(effect,))(formulation)

    finding = refused(attempt)
    if finding.factor > 0:
        raise AssertionError(f"{name} with {entries}: {finding.said}")
    return TwolinkError(finding.said)


def _every_chain_number(numbers: tuple[float, ...]) -> Callable[[str], object]:
    """Return the attempt to make chains of which one number is none, each in turn."""

    def attempt(_: str) -> object:
        chain, last = Chain.uniform_bars(), None
        for entry in fields(chain):
            value = getattr(chain, entry.name)
            if entry.name in ("mass", "length", "inertia"):
                changes = [_spoilt(value, number) for number in numbers]
            elif entry.name == "centre":
                changes = [
                    [(wrong, value[1]) for wrong in _spoilt(value[0], number)]
                    + [(value[0], wrong) for wrong in _spoilt(value[1], number)]
                    for number in numbers
                ]
            else:
                continue
            for wrong in (wrong for row in changes for wrong in row):
                finding = refused(partial(replace, chain, **{entry.name: wrong}))
                if finding.factor > 0:
                    raise AssertionError(f"{entry.name} {wrong}: {finding.said}")
                last = TwolinkError(finding.said)
        assert last is not None
        raise last

    return attempt


_SCENE = """
[chain]
mass = [1.0, 1.0]
length = [1.0, 1.0]
[start]
q = [0.3, -0.4]
[run]
duration = 0.1
"""


def _scene_file(folder: Path, text: str) -> Scene:
    file = folder / "scene.toml"
    file.write_text(text, encoding="utf-8")
    return Scene.load(file)


def _large(folder: Path, name: str) -> Path:
    """Return a file of 100 MB, of which a reader that is careful reads a part."""
    file = folder / name
    with file.open("wb") as stream:
        for _ in range(100):
            stream.write(b"#" * 1_000_000)
    return file


def _truncated_scene(_: Path) -> object:
    """Cut a scene after each of its letters: what is left of it is a scene, or refused."""
    text = _SCENE + "[effects.gravity]\ng = 9.81\n"
    last = None
    for end in range(text.index("duration")):
        finding = refused(partial(Scene.parse, text[:end]))
        if finding.factor > 0:
            raise AssertionError(f"{text[:end]!r}: {finding.said}")
        last = TwolinkError(finding.said)
    assert last is not None
    raise last


def _path_tricks(folder: Path) -> object:
    """Name files that are none of a robot: none is read for ever, and none is shown."""
    last = None
    for path in (
        "../" * 30 + "etc/passwd",
        "/dev/zero",
        "/proc/self/mem",
        ".",
        "a\\u0000b",
        "x" * 9999,
    ):
        text = _SCENE.replace("mass = [1.0, 1.0]\nlength = [1.0, 1.0]", f'urdf = "{path}"')
        finding = refused(partial(_scene_file, folder, text))
        if finding.factor > 0 or "root:" in finding.said:
            raise AssertionError(f"{path[:50]}: {finding.said}")
        last = TwolinkError(finding.said)
    assert last is not None
    raise last


def _urdf(name: str) -> Callable[[Path], object]:
    return lambda _: Chain.from_links(parse_planar_urdf(URDFS[name]()).links)


HOSTILE: dict[str, Callable[[Path], object]] = {
    "scene: nested lists": lambda folder: _scene_file(folder, "x = " + "[" * 1_000_000),
    "scene: dotted keys": lambda folder: _scene_file(folder, ".".join(["a"] * 1_000_000) + " = 1"),
    "scene: long number": lambda folder: _scene_file(folder, "x = " + "9" * 1_000_000),
    "scene: 100 MB": lambda folder: Scene.load(_large(folder, "scene.toml")),
    "scene: device": lambda _: Scene.load("/dev/zero"),
    "scene: truncated": _truncated_scene,
    "scene: paths": _path_tricks,
    "scene: noise": lambda folder: _scene_file(folder, "".join(map(chr, range(1, 2000)))),
    "URDF: file of 100 MB": lambda folder: read_planar_urdf(_large(folder, "robot.urdf")),
    **{f"URDF: {name}": _urdf(name) for name in URDFS},
}


def _of_urdf(name: str, urdf: str, hard: str, *, harmless: bool = False) -> Case:
    trial = OnInput(hostile=f"URDF: {urdf}", urdf=urdf, harmless=harmless)
    expected = _EXPECTED + ("; a peer may also leave it unread" if harmless else "")
    return _case(name, hard, trial, expected)


_NAN, _INF = math.nan, math.inf

CASES = (
    _case(
        "nan-angle",
        "an angle that is not a number: it makes everything one, in silence",
        OnInput(_simulated(q=(_NAN, -0.4)), state={"q": (_NAN, -0.4)}),
    ),
    _case(
        "infinite-angle",
        "an angle without end has no sine",
        OnInput(_simulated(q=(0.3, _INF)), state={"q": (0.3, _INF)}),
    ),
    _case(
        "nan-speed",
        "a speed that is not a number",
        OnInput(_simulated(u=(_NAN, 0.0)), state={"u": (_NAN, 0.0)}),
    ),
    _case(
        "infinite-speed",
        "a speed without end",
        OnInput(_simulated(u=(0.0, -_INF)), state={"u": (0.0, -_INF)}),
    ),
    _case(
        "speed-beyond-float64",
        "1e200 rad/s is a number; its square is none",
        OnInput(_simulated(u=(1e200, 0.0)), state={"u": (1e200, 0.0)}),
    ),
    _case(
        "no-duration",
        "a run of 0 s",
        OnInput(_simulated(duration=0.0)),
    ),
    _case(
        "negative-duration", "a run that ends before it begins", OnInput(_simulated(duration=-1.0))
    ),
    _case("nan-duration", "a run whose end is not a number", OnInput(_simulated(duration=_NAN))),
    _case(
        "no-number-in-any-effect",
        "NaN and both infinities in each number of each effect, one after the other",
        OnInput(_spoilt_effects((_NAN, _INF, -_INF))),
    ),
    _case(
        "no-number-in-any-link",
        "NaN and both infinities in each number of the chain, one after the other",
        OnInput(_every_chain_number((_NAN, _INF, -_INF))),
    ),
    _case(
        "negative-mass",
        "a link of −1 kg: M has two signs, and numbers come out all the same",
        OnInput(hostile="URDF: negative mass", urdf="negative mass"),
    ),
    _case(
        "negative-inertia",
        "a published parameter set has one; M may stay positive, and the motion is nobody's",
        OnInput(hostile="URDF: negative inertia", urdf="negative inertia"),
    ),
    _case("no-mass", "links that weigh nothing", OnInput(_made(mass=(0.0, 0.0)))),
    _case("no-length", "a first link from A to A", OnInput(_made(length=(0.0, 1.0)))),
    _case(
        "mass-beyond-float64",
        "1e200 kg: det M overflows",
        OnInput(_made(mass=(1e200, 1e200))),
    ),
    _of_urdf("nan-mass", "NaN mass", "a URDF whose mass is `nan`, which C and Python read"),
    _of_urdf(
        "infinite-mass", "infinite mass", "a URDF whose mass is 1e999, which reads as infinity"
    ),
    _of_urdf("urdf-empty", "empty", "no text at all"),
    _of_urdf("urdf-truncated", "truncated", "half of a file"),
    _of_urdf("urdf-noise", "noise", "bytes of all kinds"),
    _of_urdf("urdf-loop", "a loop", "two links, each the child of the other"),
    _of_urdf("urdf-axis-of-no-direction", "no axis", "joints that turn about (0, 0, 0)"),
    _of_urdf(
        "urdf-entities",
        "entities",
        "entities of entities: 1 kB that expands to 10 GB",
        harmless=True,
    ),
    _of_urdf(
        "urdf-external-entity",
        "a file",
        "an entity that names another file of the machine",
        harmless=True,
    ),
    _of_urdf("urdf-deep", "deep", "a million elements, each in the one before it"),
    _of_urdf("urdf-100-mb", "100 MB", "100 MB of comment around a robot", harmless=True),
    _case("urdf-file-100-mb", "a file of 100 MB", OnInput(hostile="URDF: file of 100 MB")),
    _case(
        "scene-nested",
        "a million lists, each in the one before it",
        OnInput(hostile="scene: nested lists"),
    ),
    _case(
        "scene-dotted",
        "a key of a million names with dots: tomllib alone takes memory by their square",
        OnInput(hostile="scene: dotted keys"),
    ),
    _case(
        "scene-long-number",
        "an integer of a million digits",
        OnInput(hostile="scene: long number"),
    ),
    _case("scene-100-mb", "a scene file of 100 MB", OnInput(hostile="scene: 100 MB")),
    _case(
        "scene-device", "a device without end for a scene file", OnInput(hostile="scene: device")
    ),
    _case(
        "scene-truncated",
        "a scene file, cut after each of its letters",
        OnInput(hostile="scene: truncated"),
    ),
    _case("scene-noise", "letters of all kinds", OnInput(hostile="scene: noise")),
    _case(
        "scene-paths",
        "a scene whose urdf is /etc/passwd, a device, the process's memory, a folder, a name with "
        "a zero byte, a name of 10 000 letters",
        OnInput(hostile="scene: paths"),
        "each refused in one sentence, and nothing of another file is shown",
    ),
)
