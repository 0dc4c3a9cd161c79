"""Calls of the Python API, in which one argument or two are something else."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import sys
import tomllib
import warnings
from collections.abc import Callable
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import sympy

from tests.effects.test_inputs_of_effects import GOOD
from tests.fuzz.dice import Dice, Input
from tests.fuzz.files import SWEEP, bad_file, damaged_trajectory
from twolink.accuracy.drift import energy_drift
from twolink.accuracy.enclosure import enclosure
from twolink.accuracy.reference import reference
from twolink.accuracy.study import study
from twolink.chain import Chain
from twolink.effects import Effect, EndForce, Gravity, JointDamping, JointStop, effect_class
from twolink.ensembles.run import sweep
from twolink.errors import TwolinkError
from twolink.limits import Limits
from twolink.loads import Force, Torque
from twolink.scene import Scene
from twolink.simulation import Trajectory, simulate
from twolink.urdf import parse_planar_urdf, read_planar_urdf
from twolink.variations.sensitivity import sensitivity
from twolink.variations.spectrum import lyapunov
from twolink.verification import verify
from twolink.verification.contact import verify_contact

CHAIN = Chain.uniform_bars()
SMOOTH = Scene(CHAIN, (0.3, 0.5), (0.0, 0.1), 0.05, (Gravity(),), accuracy=1e-6)
EVENTS = dataclasses.replace(SMOOTH, effects=(Gravity(), JointStop("B", -1.0, 0.21, 0.5)))
SWINGS = dataclasses.replace(SMOOTH, duration=1.0)

BAD_INPUT = 2


class Acting(Effect):
    """An effect of one's own, whose loads are a function and may be set."""

    def __init__(self, function: Callable[..., Any]) -> None:
        """Take the function."""
        self.function = function

    def loads(self, chain: Any, q: Any, u: Any, t: Any = 0.0) -> Any:
        """Return anything."""
        return self.function(chain, q, u, t)


class Liar:
    """An object whose methods break their contracts."""

    def __float__(self) -> float:
        raise OverflowError("too large")

    def __len__(self) -> int:
        raise ValueError("no length")

    def __repr__(self) -> str:
        return "a\nb\x1b[31m" * 500


LOADS = (
    lambda *_: None, lambda *_: 1.0, lambda *_: (1.0,), lambda *_: (Torque(1, float("nan")),),
    lambda *_: (Torque(5, 1.0),), lambda c, *_: (Force(c.D, 1.0),), lambda c, q, u, t: 1 / 0,
    lambda c, q, u, t: (Torque(1, np.sin(q[0])),), lambda c, q, u, t: (Torque(1, t if t else 1),),
    lambda c, q, u, t: (Torque(2, -0.1 * u[0]),), lambda: (), lambda *_: itertools.repeat(1),
    lambda c, q, u, t: (Torque(1, 1e308 * u[1] * 1e10),), lambda *_: (Torque(1, 10**400),),
)  # fmt: skip

NUMBERS = (
    0, 1, -1, 2, -0.0, 0.5, 5e-324, 1e-300, 1e308, float("nan"), float("inf"), -float("inf"), 2**70,
    10**308, 10**400, True, 1j, Decimal("0.5"), Decimal("NaN"), Fraction(1, 3), np.float32(0.5),
    np.float64("nan"), np.longdouble("1e4000"), np.int64(3), np.uint8(200), np.True_, np.array(0.5),
    np.datetime64("2020"), np.timedelta64(1, "s"), "1", "0.5", b"1",
    mpmath.mpf("0.3"), mpmath.nan, sympy.Symbol("x"), sympy.Rational(1, 3), sympy.oo,
)  # fmt: skip
THINGS = (
    None, "", "D", "taylor", "a\nb", "\x00", "\udcff", "x" * 5000, (), [], {}, set(), {1: 2}, [1],
    (1, 2, 3), ((1, 2), (3, 4)), object(), float, Scene, Gravity, Gravity(), hash, Ellipsis,
    NotImplemented, np.zeros(2), np.zeros(0), np.zeros((2, 2)), np.array(["a", "b"]),
    np.array([None, 1]), np.full(2, np.nan), np.ma.masked, range(2), slice(1), Path("none"),
    Path("\x00"), Limits(), SMOOTH, CHAIN, memoryview(b"ab"), bytearray(b"ab"), slice, Liar(),
)  # fmt: skip


def something(dice: Dice, folder: Path) -> object:
    """Return anything at all."""
    how = dice.randrange(10)
    if how < 4:
        return dice.choice(NUMBERS)
    if how < 7:
        return dice.choice(THINGS)
    pair = [dice.choice((*NUMBERS, *THINGS, 0.1, 0.2)) for _ in range(dice.choice((1, 2, 2, 2, 3)))]
    made: tuple[Callable[[], object], ...] = (
        lambda: tuple(pair), lambda: pair, lambda: iter(pair), lambda: (one for one in pair),
        itertools.count, lambda: dict(enumerate(pair)), lambda: (tuple(pair), (0.1, 0.2)),
        lambda: (Gravity(), Acting(dice.choice(LOADS))), lambda: [Acting(dice.choice(LOADS))],
        lambda: map(float, "12"), lambda: (Gravity(), EndForce(1e3, 0.5)),
        lambda: bad_file(dice, folder, dice.choice((".toml", ".npz", ".csv", ".urdf"))),
        lambda: folder / "fifo.toml", lambda: str(folder), dice.text,
    )  # fmt: skip
    return dice.choice(made)()


@functools.cache
def trajectories() -> tuple[Trajectory, ...]:
    """Return trajectories, smooth and with events."""
    return tuple(simulate(scene, samples=11) for scene in (SMOOTH, EVENTS))


def _simulated(
    *, mass: Any, q: Any, u: Any, g: Any, damping: Any, duration: Any, accuracy: Any
) -> Trajectory:
    """Simulate a scene whose numbers are those given, wherever a scene can have one."""
    effects = (Gravity(g), JointDamping((damping, 0.1)))
    made = Scene(Chain.uniform_bars((mass, 1.0)), (q, 0.2), (0.0, u), duration, effects, accuracy)
    return simulate(made, samples=3, limits=Limits(seconds=5.0))


def _mutated(scene: Scene, function: Callable[..., Any]) -> Trajectory:
    """Simulate a scene, change the load of its own effect, and simulate it again."""
    acting = Acting(lambda c, q, u, t: (Torque(1, 1.0),))
    made = dataclasses.replace(scene, effects=(acting, *scene.effects))
    before = simulate(made, samples=3)
    acting.function = function
    after = simulate(made, samples=3)
    assert np.array_equal(before.q, after.q), "a scene holds a copy of its effects"
    return simulate(dataclasses.replace(scene, effects=(acting,)), samples=3)


def _right(dice: Dice, folder: Path, out: Path) -> tuple[Callable[..., object], dict[str, Any]]:
    """Return a function and arguments that are right."""
    scene, trajectory = dice.choice((SMOOTH, EVENTS)), dice.choice(trajectories())
    name = dice.choice(list(GOOD))
    scene_fields = {f.name: getattr(scene, f.name) for f in dataclasses.fields(scene)}
    chain_fields = {f.name: getattr(CHAIN, f.name) for f in dataclasses.fields(CHAIN)}
    kept = {f.name: getattr(trajectory, f.name) for f in dataclasses.fields(trajectory)}
    table = {
        "chain": {"mass": [1, 1], "length": [1, 1]}, "start": {"q": [0, 1], "u": [0, 0]},
        "run": {"duration": 0.1}, "effects": {"gravity": {}}, "title": "t", "shows": "s",
    }  # fmt: skip
    urdf = (folder / "good.urdf").read_text()
    rights: tuple[tuple[Callable[..., object], dict[str, Any]], ...] = (
        (Scene, scene_fields), (Scene, scene_fields), (Chain, chain_fields),
        (effect_class(name), dict(GOOD[name])), (effect_class(name), dict(GOOD[name])),
        (Chain.uniform_bars, {"mass": (1, 1), "length": (1, 1)}),
        (Chain.point_masses, {"mass": (1, 1), "length": (1, 1)}),
        (Chain.from_urdf, {"path": folder / "good.urdf", "tip": None}),
        (CHAIN.to_urdf, {"path": out / "a.urdf", "name": "a"}),
        (simulate, {"scene": scene, "accuracy": 1e-6, "method": "taylor", "samples": 11,
                    "formulation": "momenta", "progress": None, "limits": Limits()}),
        (simulate, {"scene": SMOOTH, "accuracy": 1e-4, "method": dice.choice(("DOP853", "rk4"))}),
        (trajectory.at, {"times": (0.0, 0.01), "side": "left"}),
        (trajectory.contact_forces, {"times": (0.0, 0.01)}),
        (trajectory.position, {"point": CHAIN.D}), (trajectory.velocity, {"point": CHAIN.B}),
        (trajectory.save, {"path": out / f"a{dice.choice(('.npz', '.csv', '.parquet'))}"}),
        (Trajectory.load, {"path": folder / "good.npz"}), (Trajectory, kept),
        (Trajectory.load, {"path": damaged_trajectory(dice, folder)}),
        (verify, {"urdf": None, "states": 3, "seed": 1, "progress": float,
                  "limits": Limits()}),
        (verify_contact, {"urdf": read_planar_urdf(folder / "good.urdf"), "states": 3, "seed": 1}),
        (reference, {"scene": scene, "digits": 8, "times": (0.0, 0.01), "limits": Limits()}),
        (enclosure, {"scene": scene, "digits": 8, "times": (0.01,), "limits": Limits()}),
        (sensitivity, {"scene": SMOOTH, "by": ("q1", "m2"), "accuracy": 1e-6, "samples": 5,
                       "progress": None, "limits": Limits()}),
        (lyapunov, {"scene": SMOOTH, "seconds": 0.5, "blocks": 2, "progress": None,
                    "limits": Limits()}),
        (sweep, {"ensemble": {**tomllib.loads(SWEEP)}, "out": out / "s.zarr", "workers": 1,
                 "executor": None, "chunk": None, "progress": None, "limits": Limits()}),
        (energy_drift, {"scene": SWINGS, "seconds": 100.0, "methods": ("rk4",)}),
        (study, {"scene": SMOOTH, "methods": ("rk4",), "engines": False, "budget": 0.01}),
        (Scene.load, {"path": folder / "good.toml"}), (Scene.from_dict, {"table": table}),
        (Scene.parse, {"text": (folder / "good.toml").read_text(), "source": "x"}),
        (read_planar_urdf, {"path": folder / "good.urdf"}),
        (parse_planar_urdf, {"text": urdf}),
        (_simulated, {"mass": 1, "q": 0.1, "u": 0.0, "g": 9.8, "damping": 0.1, "duration": 0.1,
                      "accuracy": 1e-4}),
        (_mutated, {"scene": scene, "function": dice.choice(LOADS)}),
    )  # fmt: skip
    return dice.choice(rights)


def drawn_call(dice: Dice, folder: Path, out: Path) -> Input:
    """Return a call with one argument or two that are something else, or with none."""
    function, arguments = _right(dice, folder, out)
    changed = [] if function is _mutated else dice.sample(
        sorted(arguments), min(len(arguments), dice.choice((0, 1, 1, 1, 2)))
    )  # fmt: skip
    for name in changed:
        if isinstance(arguments[name], dict) and dice.happens(0.7):
            _spoil(dice, folder, arguments[name])
        else:
            arguments[name] = something(dice, folder)
    if dice.happens(0.02):
        arguments[dice.choice(("nope", "Scene", "x"))] = 1
    name = getattr(function, "__qualname__", str(function))
    words = [name, *(f"{key}={_shown(arguments.get(key))}" for key in changed)]
    # A name alone is that of a file in the folder in which the call is made.
    given = [path for path in arguments.values() if isinstance(path, (str, Path))]
    targets = tuple(path for path in (out / path for path in given) if path.parent == out)
    return Input(words, out=targets, call=functools.partial(_called, function, arguments))


def _spoil(dice: Dice, folder: Path, table: dict[str, Any]) -> None:
    """Change an entry somewhere in a table."""
    key = dice.choice(list(table))
    if isinstance(table[key], dict) and table[key] and dice.happens(0.7):
        _spoil(dice, folder, table[key])
    elif dice.happens(0.2):
        table[dice.choice(("nope", 1, None, "\x1b"))] = table.pop(key)
    else:
        table[key] = something(dice, folder)


def _shown(value: object) -> str:
    return repr(value)[:200] if type(value).__module__ != __name__ else type(value).__name__


def _called(function: Callable[..., object], arguments: dict[str, Any]) -> int:
    """Call the function, as a command would be: a refusal is a line and exit code 2."""
    warnings.simplefilter("error")
    try:
        function(**arguments)
    except TwolinkError as error:
        sentence = str(error)
    except TypeError as error:
        # Python itself refuses arguments that the function does not have.
        trace = error.__traceback__
        if trace is None or trace.tb_next is not None:
            raise
        sentence = str(error)
    else:
        return 0
    sys.stderr.write(f"{sentence}\n")
    return BAD_INPUT
