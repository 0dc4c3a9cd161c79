"""Writing of a scene as the text of a scene file."""

from __future__ import annotations

import json
from dataclasses import fields
from typing import Any, Protocol

from twolink.arithmetic import Pair
from twolink.chain import Chain
from twolink.coordinates import JointConvention
from twolink.effects import EFFECTS, Effect
from twolink.errors import ParameterError, SceneError


class Written(Protocol):
    """The parts of a `Scene` that have tables of their own."""

    @property
    def chain(self) -> Chain: ...  # noqa: D102
    @property
    def q(self) -> Pair: ...  # noqa: D102
    @property
    def u(self) -> Pair: ...  # noqa: D102
    @property
    def effects(self) -> tuple[Effect, ...]: ...  # noqa: D102
    @property
    def joints(self) -> JointConvention | None: ...  # noqa: D102


def written(scene: Written) -> str:
    """Return a scene as TOML, without default values."""
    title, run = (
        _non_default(scene, "title", "shows"),
        _non_default(scene, "duration", "accuracy", "method"),
    )
    tables = [
        *([_lines(title, "")] if title else []),
        "[chain]\n" + _lines(_chain_entries(scene.chain) | _joint_entries(scene), "chain."),
        "[start]\n" + _lines({"q": scene.q, "u": scene.u}, "start."),
        "[run]\n" + _lines(run, "run."),
        *_effect_tables(scene.effects),
    ]
    return "\n".join(tables)


def _non_default(described: Any, *names: str) -> dict[str, Any]:
    """Return the fields of a dataclass, or those of these names, with non-default values."""
    changed = {}
    for field in fields(described):
        value = getattr(described, field.name)
        wanted = field.init and (not names or field.name in names)
        # Zeros of either sign compare equal, so representations are compared.
        if wanted and repr(value) != repr(field.default):
            changed[field.name] = value
    return changed


def _chain_entries(chain: Chain) -> dict[str, Any]:
    """Return the entries of a [chain] table: mass and length alone for uniform bars."""
    if chain.rotors:
        raise SceneError(
            "the chain must have no rotors to be written, as motor_inertia among the effects adds"
            f" them; got {len(chain.rotors)}"
        )
    bars = {"mass": chain.mass, "length": chain.length}
    if _of_uniform_bars(chain):
        return bars
    return {**bars, "centre": chain.centre, "inertia": chain.inertia}


def _joint_entries(scene: Written) -> dict[str, Any]:
    """Return the entries of a [chain] table that relate joint angles to absolute ones."""
    if scene.joints is None:
        return {}
    return {"joint_sign": scene.joints.sign, "joint_offset": scene.joints.offset}


def _of_uniform_bars(chain: Chain) -> bool:
    """Return whether mass and length determine the whole chain, and its inertia as a rational."""
    try:
        bars = Chain.uniform_bars(chain.mass, chain.length)
    except ParameterError:
        return False
    return chain == bars and chain._exact_inertia == bars._exact_inertia


def _effect_tables(effects: tuple[Effect, ...]) -> list[str]:
    """Return the tables of effects by kind, and their order if it differs."""
    names = [_registered_name(effect) for effect in effects]
    kinds = list(dict.fromkeys(names))
    tables = []
    if names != sorted(names, key=kinds.index):
        tables.append("[effects]\n" + _lines({"order": tuple(names)}, "effects."))
    for kind in kinds:
        header = f"[effects.{kind}]" if names.count(kind) == 1 else f"[[effects.{kind}]]"
        for name, effect in zip(names, effects, strict=True):
            if name == kind:
                tables.append(f"{header}\n" + _lines(_non_default(effect), f"effects.{kind}."))
    return tables


def _registered_name(effect: Effect) -> str:
    """Return the name of an effect in scene files."""
    home = type(effect).__module__, type(effect).__name__
    for name, registered in EFFECTS.items():
        if registered == home:
            return name
    raise SceneError(
        f"effects of a scene file must be among {', '.join(EFFECTS)}; got an effect of type"
        f" {type(effect).__name__}"
    )


def _lines(entries: dict[str, Any], place: str) -> str:
    """Return entries in TOML, one a line; `place` is the prefix of their keys in errors."""
    return "".join(f"{key} = {_in_toml(value, place + key)}\n" for key, value in entries.items())


def _in_toml(value: Any, key: str) -> str:
    """Return a value in TOML."""
    if isinstance(value, tuple):
        return f"[{', '.join(_in_toml(entry, key) for entry in value)}]"
    if isinstance(value, str):
        # TOML strings are JSON strings with one more character that must be escaped.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, bool):
        return "true" if value else "false"
    for kind in (int, float):
        if isinstance(value, kind):
            # Not the repr of a subclass: that of NumPy's floats is np.float64(…).
            return kind.__repr__(value)
    received = " ".join(repr(value).split())
    raise SceneError(
        f"{key} must be a number that float64 holds, a word, true, false, or a tuple;"
        f" got {received}"
    )
