"""Hard cases of input: invalid numbers, chains, scenes and files must be rejected at low cost."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from dataclasses import fields, replace
from functools import partial
from pathlib import Path
from typing import Any

from twolink.chain import Chain
from twolink.effects import effect_class
from twolink.effects.gravity import Gravity
from twolink.engines.child import tell
from twolink.errors import TwolinkError
from twolink.files import scratch_folder
from twolink.hardcases.hostile_urdf import URDFS
from twolink.hardcases.input_trial import InputTrial, refused
from twolink.hardcases.record import Case
from twolink.names import EquationsName
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.urdf import parse_planar_urdf, read_planar_urdf

_SECONDS = 20.0

_EXPECTED = "rejected with one sentence that states the received value and the requirement"
_BOUND = (
    "one line of at most 500 characters; hostile input runs in a sandbox with 20 s and 2 GB; an "
    "external engine may reject in any words"
)


def _case(name: str, hard: str, trial: InputTrial, expected: str = _EXPECTED) -> Case:
    return Case(name, "input", hard, expected, "the input itself", _BOUND, trial, _SECONDS)


def _simulated(**changes: Any) -> Callable[[EquationsName], object]:
    """Return a function that simulates a scene of uniform bars with some fields changed."""

    def attempt(formulation: EquationsName) -> object:
        scene: dict[str, Any] = {
            "chain": Chain.uniform_bars(),
            "q": (0.3, -0.4),
            "u": (0.1, -0.2),
            "duration": 0.1,
            "effects": (Gravity(9.81),),
        }
        return simulate(Scene(**{**scene, **changes}), formulation=formulation, samples=2)

    return attempt


def _made(**changes: Any) -> Callable[[EquationsName], object]:
    """Return a function that creates a chain of uniform bars with some fields changed."""
    return lambda _: replace(Chain.uniform_bars(), **changes)


# An effect of each kind; each of its numbers is replaced in turn.
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
    """Yield copies of a value with one of its numbers replaced."""
    if isinstance(value, float):
        return [number]
    if isinstance(value, tuple):
        return [(*value[:i], number, *value[i + 1 :]) for i in range(len(value))]
    return []


def _spoilt_effects(numbers: tuple[float, ...]) -> Callable[[EquationsName], object]:
    """Return a function that simulates effects with one invalid number, each in turn."""

    def attempt(formulation: EquationsName) -> object:
        last: TwolinkError | None = None
        for name, entries in _EFFECTS.items():
            for key, value in entries.items():
                for number in numbers:
                    for wrong in _spoilt(value, number):
                        last = _refusal(formulation, name, {**entries, key: wrong})
        assert last is not None
        raise last

    return attempt


def _refusal(formulation: EquationsName, name: str, entries: dict[str, Any]) -> TwolinkError:
    """Return the error that rejects an effect, or an error that it was accepted."""

    def attempt() -> object:
        effect = effect_class(name)(**entries)
        return _simulated(effects=(effect,))(formulation)

    result = refused(attempt)
    if result.factor > 0:
        raise AssertionError(f"{name} with {entries}: {result.said}")
    return TwolinkError(result.said)


def _every_chain_number(numbers: tuple[float, ...]) -> Callable[[EquationsName], object]:
    """Return a function that creates chains with one invalid number, each in turn."""

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
                result = refused(partial(replace, chain, **{entry.name: wrong}))
                if result.factor > 0:
                    raise AssertionError(f"{entry.name} {wrong}: {result.said}")
                last = TwolinkError(result.said)
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
    """Return a file of 100 MB, of which a careful reader reads only a part."""
    file = folder / name
    with file.open("wb") as stream:
        for _ in range(100):
            stream.write(b"#" * 1_000_000)
    return file


def _truncated_scene(_: Path) -> object:
    """Truncate a scene after each character: the rest must be a scene or be rejected."""
    text = _SCENE + "[effects.gravity]\ng = 9.81\n"
    last = None
    for end in range(text.index("duration")):
        result = refused(partial(Scene.parse, text[:end]))
        if result.factor > 0:
            raise AssertionError(f"{text[:end]!r}: {result.said}")
        last = TwolinkError(result.said)
    assert last is not None
    raise last


def _path_tricks(folder: Path) -> object:
    """Use file names that are not robots: no endless reading, and no disclosure of contents."""
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
        result = refused(partial(_scene_file, folder, text))
        if result.factor > 0 or "root:" in result.said:
            raise AssertionError(f"{path[:50]}: {result.said}")
        last = TwolinkError(result.said)
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


def hostile_attempt(name: str) -> tuple[float, str]:
    """Return factor and sentence of one of `HOSTILE`, which may crash, hang or fill the memory."""
    with scratch_folder("input") as folder:
        found = refused(lambda: HOSTILE[name](folder))
    return found.factor, found.said


def _hostile(name: str, *, urdf: str = "", harmless: bool = False) -> InputTrial:
    return InputTrial(hostile=name, urdf=urdf, harmless=harmless)


def _of_urdf(name: str, urdf: str, hard: str, *, harmless: bool = False) -> Case:
    trial = _hostile(f"URDF: {urdf}", urdf=urdf, harmless=harmless)
    expected = _EXPECTED + ("; an external engine may also ignore it" if harmless else "")
    return _case(name, hard, trial, expected)


_NAN, _INF = math.nan, math.inf

CASES = (
    _case(
        "nan-angle",
        "an angle that is NaN, which silently propagates to every result",
        InputTrial(_simulated(q=(_NAN, -0.4)), state={"q": (_NAN, -0.4)}),
    ),
    _case(
        "infinite-angle",
        "an infinite angle, which has no sine",
        InputTrial(_simulated(q=(0.3, _INF)), state={"q": (0.3, _INF)}),
    ),
    _case(
        "nan-speed",
        "a speed that is NaN",
        InputTrial(_simulated(u=(_NAN, 0.0)), state={"u": (_NAN, 0.0)}),
    ),
    _case(
        "infinite-speed",
        "a speed without end",
        InputTrial(_simulated(u=(0.0, -_INF)), state={"u": (0.0, -_INF)}),
    ),
    _case(
        "speed-beyond-float64",
        "1e200 rad/s is finite; its square overflows",
        InputTrial(_simulated(u=(1e200, 0.0)), state={"u": (1e200, 0.0)}),
    ),
    _case(
        "no-duration",
        "a run of 0 s",
        InputTrial(_simulated(duration=0.0)),
    ),
    _case(
        "negative-duration", "a run with a negative duration", InputTrial(_simulated(duration=-1.0))
    ),
    _case("nan-duration", "a run with the duration NaN", InputTrial(_simulated(duration=_NAN))),
    _case(
        "no-number-in-any-effect",
        "NaN and both infinities in each number of each effect",
        InputTrial(_spoilt_effects((_NAN, _INF, -_INF))),
    ),
    _case(
        "no-number-in-any-link",
        "NaN and both infinities in each number of the chain",
        InputTrial(_every_chain_number((_NAN, _INF, -_INF))),
    ),
    _case(
        "negative-mass",
        "a link of −1 kg: M is indefinite, yet every formula gives a number",
        _hostile("URDF: negative mass", urdf="negative mass"),
    ),
    _case(
        "negative-inertia",
        "a published parameter set has one; M may stay positive, but the motion is unphysical",
        _hostile("URDF: negative inertia", urdf="negative inertia"),
    ),
    _case("no-mass", "links without mass", InputTrial(_made(mass=(0.0, 0.0)))),
    _case("no-length", "a first link of zero length", InputTrial(_made(length=(0.0, 1.0)))),
    _case(
        "mass-beyond-float64",
        "1e200 kg: det M overflows",
        InputTrial(_made(mass=(1e200, 1e200))),
    ),
    _of_urdf("nan-mass", "NaN mass", "a URDF whose mass is `nan`, which C and Python read"),
    _of_urdf(
        "infinite-mass", "infinite mass", "a URDF whose mass is 1e999, which reads as infinity"
    ),
    _of_urdf("urdf-empty", "empty", "an empty file"),
    _of_urdf("urdf-truncated", "truncated", "a truncated file"),
    _of_urdf("urdf-noise", "noise", "arbitrary bytes"),
    _of_urdf("urdf-loop", "a loop", "two links, each the child of the other"),
    _of_urdf("urdf-axis-of-no-direction", "no axis", "joints with the axis (0, 0, 0)"),
    _of_urdf(
        "urdf-entities",
        "entities",
        "nested XML entities: 1 kB that expands to 10 GB",
        harmless=True,
    ),
    _of_urdf(
        "urdf-external-entity",
        "a file",
        "an external entity that names another file of the machine",
        harmless=True,
    ),
    _of_urdf("urdf-deep", "deep", "a million nested elements"),
    _of_urdf("urdf-100-mb", "100 MB", "100 MB of comments after a robot", harmless=True),
    _case("urdf-file-100-mb", "a file of 100 MB", _hostile("URDF: file of 100 MB")),
    _case(
        "scene-nested",
        "a million nested lists",
        _hostile("scene: nested lists"),
    ),
    _case(
        "scene-dotted",
        "a dotted key of a million names: tomllib's memory grows with their square",
        _hostile("scene: dotted keys"),
    ),
    _case(
        "scene-long-number",
        "an integer of a million digits",
        _hostile("scene: long number"),
    ),
    _case("scene-100-mb", "a scene file of 100 MB", _hostile("scene: 100 MB")),
    _case("scene-device", "an endless device as scene file", _hostile("scene: device")),
    _case(
        "scene-truncated",
        "a scene file, truncated after each character",
        _hostile("scene: truncated"),
    ),
    _case("scene-noise", "arbitrary characters", _hostile("scene: noise")),
    _case(
        "scene-paths",
        "a scene whose urdf is /etc/passwd, a device, the process's memory, a folder, a name with "
        "a zero byte, a name of 10 000 characters",
        _hostile("scene: paths"),
        "each rejected with one sentence that shows no contents of another file",
    ),
)


if __name__ == "__main__":
    tell(lambda: hostile_attempt(sys.argv[1]))
