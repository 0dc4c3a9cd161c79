"""Trajectories in files: written whole or not at all, and read back to the last bit.

`formats` has the layout of each kind of file. The scene is part of the file as TOML. Joint angles
are written for other programs; `load` computes them again.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from enum import Enum
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple, get_args

import numpy as np

from twolink.effects import contact_elements
from twolink.errors import FileError, SceneError, SimulationError
from twolink.files import atomic_write, check_readable
from twolink.integration.precisions import PRECISIONS, PrecisionName
from twolink.names import FormulationName
from twolink.scene import Scene
from twolink.simulation.formats import LARGEST_FILE, Arrays, format_of
from twolink.simulation.hybrid.mode import Event, Impact
from twolink.simulation.run import Array, Lane, Recipe, Statistics
from twolink.simulation.smooth.bundles import FIRST, SECOND
from twolink.text import one_line


@dataclass(frozen=True)
class About:
    """The description of a trajectory in a file, by the field names of `Trajectory`.

    `scene` is a scene file in TOML, or None where there can be none for the reason `no_scene`.
    """

    title: str
    effects: tuple[str, ...]
    samples: int
    accuracy: float
    error: float
    holds_until: float
    method: str
    formulation: str
    precision: str
    statistics: Statistics
    notes: tuple[str, ...]
    events: tuple[Event, ...]
    impacts: tuple[Impact, ...]
    failure: str
    scene: str | None
    no_scene: str | None
    checksum: str
    recipe: Recipe | None = None


# Orders of Taylor series beyond this are not used in any precision.
_LARGEST_ORDER = 200
# A stored run of more steps is not repeated.
_MOST_STEPS = 1e7

# The fields that a Trajectory has under the same name.
FACTS = (
    "accuracy",
    "error",
    "holds_until",
    "method",
    "formulation",
    "precision",
    "statistics",
    "notes",
    "events",
    "impacts",
    "failure",
    "recipe",
)


def check_kind(file: Path) -> None:
    """Raise `SimulationError` if trajectories are not kept in files of this kind, or not here."""
    format_of(file).require(file)


class Stored(NamedTuple):
    """The content of a file: a scene, t of shape (n,), q and u of shape (2, n).

    `facts` are the values of `FACTS`, by their names.
    """

    scene: Scene
    t: Array
    q: Array
    u: Array
    facts: dict[str, Any]


def save(stored: Stored, file: Path) -> str | None:
    """Write a trajectory to a file, of the kind that its suffix says.

    Returns why the scene is not in the file, and so `load` refuses it; or None if it is. Raises
    `SimulationError` for other kinds, and `FileError` where the file cannot be written; it is then
    as it was before.
    """
    check_kind(file)
    about = _about(stored)
    arrays = Arrays(
        stored.t,
        stored.q,
        stored.u,
        json.loads(json.dumps(asdict(about), default=_in_json)),
        _joint_rows(stored),
    )
    arrays.about["checksum"] = _checksum(arrays)
    try:
        _check_numbers(*arrays[:3])
    except SimulationError as error:
        raise SimulationError(f"{file}: the trajectory cannot be saved, for {error}") from error
    with atomic_write(file) as temporary:
        format_of(file).write(temporary, arrays)
    return about.no_scene


def _joint_rows(stored: Stored) -> Array | None:
    """Return theta (rad) and omega (rad/s), of shape (4, n), if the chain has joint angles."""
    joints = stored.scene.joints
    if joints is None:
        return None
    theta = joints.joint_angles((stored.q[0], stored.q[1]))
    omega = joints.joint_speeds((stored.u[0], stored.u[1]))
    return np.array([*theta, *omega])


def load(file: Path) -> Stored:
    """Return the content of a file that `save` wrote.

    Raises `SimulationError` for any other file, and where the file has no scene.
    """
    check_kind(file)
    read = format_of(file).read
    with _in_one_sentence(file):
        check_readable(file, LARGEST_FILE)
        arrays = read(file)
        t, q, u, received, _ = arrays
        about = _checked(received)
        _check_arrays(t, q, u, about.samples)
        if about.checksum != _checksum(arrays):
            raise SimulationError(
                "its checksum is not that of its content; must be a file as `Trajectory.save` "
                "wrote it"
            )
        _check_numbers(t, q, u)
        scene = _scene(about)
        check_agreement(scene, arrays, about)
        return Stored(scene, t, q, u, {name: getattr(about, name) for name in FACTS})


def _about(stored: Stored) -> About:
    scene, no_scene = _written(stored.scene)
    return About(
        title=stored.scene.title,
        effects=tuple(type(effect).__name__ for effect in stored.scene.effects),
        samples=len(stored.t),
        scene=scene,
        no_scene=no_scene,
        checksum="",
        **stored.facts,
    )


def _written(scene: Scene) -> tuple[str | None, str | None]:
    """Return a scene in TOML, or else why it cannot be written."""
    try:
        return scene.to_toml(), None
    except SceneError as error:
        return None, str(error)


def _scene(about: About) -> Scene:
    """Return the scene in a description."""
    if about.scene is None:
        raise SimulationError(
            "the file must have the scene; got none, for `Scene.to_toml` could not write it "
            f"({about.no_scene})"
        )
    return Scene.parse(about.scene, source="its scene")


def _in_json(value: Any) -> Any:
    """Return the JSON form of an enumeration or of a NumPy number."""
    return value.value if isinstance(value, Enum) else value.item()


def _checked(received: Any) -> About:
    """Return a description with values of the right types."""
    from pydantic import TypeAdapter, ValidationError

    try:
        return TypeAdapter(About).validate_python(received)
    except ValidationError as error:
        fault = error.errors(include_input=False)[0]
        key = ".".join(str(part) for part in fault["loc"]) or "the trajectory"
        got = "none" if fault["type"] == "missing" else f"another value ({fault['msg']})"
        raise SimulationError(f"{key} must be as `Trajectory.save` writes it; got {got}") from error


def _check_arrays(t: Array, q: Array, u: Array, samples: int) -> None:
    """Raise `SimulationError` for arrays of another type, shape or length."""
    for name, array, rows in (("t", t, ()), ("q", q, (2,)), ("u", u, (2,))):
        if array.dtype != np.float64 or array.ndim == 0 or array.shape[:-1] != rows:
            raise SimulationError(
                f"{name} must be of float64 and shape {(*rows, samples)}; got {array.dtype} and "
                f"{array.shape}"
            )
        if array.shape[-1] != samples:
            raise SimulationError(
                f"{name} must have the {samples} samples that were saved; got {array.shape[-1]}"
            )


def _checksum(stored: Arrays) -> str:
    """Return a hash (SHA-256) of the arrays' numbers and of all that a file says beside them."""
    about = {key: value for key, value in stored.about.items() if key != "checksum"}
    found = hashlib.sha256(json.dumps(about, sort_keys=True).encode())
    arrays = [stored.t, stored.q, stored.u]
    for array in arrays if stored.joints is None else [*arrays, stored.joints]:
        found.update(np.ascontiguousarray(array, dtype="<f8").tobytes())
    return found.hexdigest()


def _check_numbers(t: Array, q: Array, u: Array) -> None:
    """Raise `SimulationError` for numbers that are not finite, and times that do not rise."""
    if t.size == 0:
        raise SimulationError("it has no samples; must have one or more")
    for name, array in (("t", t), ("q", q), ("u", u)):
        if not np.isfinite(array).all():
            first = np.argwhere(~np.isfinite(array.reshape(-1, len(t))))[0][-1]
            raise SimulationError(f"{name} is not finite at sample {first}; must be finite")
    falls = np.flatnonzero(np.diff(t) <= 0)
    if len(falls):
        raise SimulationError(
            f"t does not rise from sample {falls[0]} ({t[falls[0]]:.6g} s) to the next "
            f"({t[falls[0] + 1]:.6g} s); times must rise"
        )


def check_agreement(scene: Scene, stored: Arrays, about: About) -> None:
    """Raise `SimulationError` unless a scene, its arrays and its description agree."""
    t, q, u, *_ = stored
    end = t[-1]
    reached = end if about.failure else scene.duration
    # A run that fails may have events after its last sample.
    last = scene.duration if about.failure else end
    struck = [impact for impact in about.impacts if impact.time <= t[0]]
    elements = tuple(
        element.name for element in contact_elements(scene.effects, scene.moving_chain)
    )
    # Momenta, and back: the start is that of the scene but for rounding.
    near = partial(np.allclose, rtol=1e-6, atol=1e-9)
    faults = {
        "title": about.title == scene.title,
        "effects": about.effects == tuple(type(effect).__name__ for effect in scene.effects),
        "t at the start": t[0] == 0,
        "t at the end": end <= scene.duration and (end == scene.duration or bool(about.failure)),
        "q at the start": near(q[:, 0], scene.q),
        "u at the start": near(u[:, 0], scene.u) or bool(struck),
        "accuracy": 0 < about.accuracy < math.inf,
        "error": about.error >= 0,
        "holds_until": 0 <= about.holds_until <= scene.duration,
        "recipe": about.recipe is None or _is_repeatable(about, about.recipe, reached),
        "events": _in_order([event.time for event in about.events], last)
        and all(event.mode.names == elements for event in about.events),
        "impacts": _in_order([impact.time for impact in about.impacts], last)
        and all(
            elements[impact.index : impact.index + 1] == (impact.name,) for impact in about.impacts
        ),
    }
    wrong = [name for name, agrees in faults.items() if not agrees]
    if wrong:
        raise SimulationError(
            f"{', '.join(wrong)} and its scene do not agree; must be the trajectory of that scene"
        )


def _is_repeatable(about: About, recipe: Recipe, duration: float) -> bool:
    """Return whether a run with a recipe exists, and takes a bounded number of steps."""
    return (
        about.method == "taylor"
        and about.formulation in (*get_args(FormulationName), "momenta")
        and about.precision in PRECISIONS
        and recipe.evaluated_in in (None, *_not_shorter(about.precision))
        and 1 < recipe.order <= _LARGEST_ORDER
        and duration <= recipe.longest_step * _MOST_STEPS
        and (recipe.lane is None or _is_lane(about, recipe, recipe.lane))
    )


def _is_lane(about: About, recipe: Recipe, lane: Lane) -> bool:
    """Return whether a lane may be a result: the first two, in double precision, uncorrected."""
    is_there = lane.number in (FIRST, SECOND) and 1 <= lane.size < math.inf
    return is_there and about.precision == "double" and recipe.evaluated_in is None


def _not_shorter(precision: str) -> list[PrecisionName]:
    """Return the precisions that are not shorter than one of them."""
    names = list(PRECISIONS)
    return names[[str(name) for name in names].index(precision) :]


def _in_order(times: list[float], end: float) -> bool:
    """Return whether times do not fall, and none is after the end."""
    return all(a <= b for a, b in pairwise([-math.inf, *times, end]))


@contextmanager
def _in_one_sentence(file: Path) -> Iterator[None]:
    """Raise `SimulationError` for every error in reading a file."""
    try:
        yield
    except (SimulationError, SceneError, FileError) as error:
        raise SimulationError(f"{one_line(file, 300)}: {error}") from error
    except (MemoryError, RecursionError) as error:
        raise SimulationError(
            f"{one_line(file, 300)}: is too large or too deep to be read"
        ) from error
    # A file may hold anything, and readers raise errors of every kind for damaged ones.
    except Exception as error:
        reason = one_line(" ".join(str(error).split()), 200).rstrip(".") or type(error).__name__
        raise SimulationError(
            f"{one_line(file, 300)}: must be a file that `Trajectory.save` wrote; it cannot be "
            f"read ({reason})"
        ) from error
