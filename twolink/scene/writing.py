"""From a scene to the text of a scene file."""

from __future__ import annotations

import json
from dataclasses import fields
from typing import TYPE_CHECKING, Any

from twolink.chain import Chain
from twolink.effects import EFFECTS, Effect
from twolink.errors import ParameterError, SceneError

if TYPE_CHECKING:
    from twolink.scene.scene import Scene


def written(scene: Scene) -> str:
    """Return a scene as TOML, a table after the other; what is as by default is left out."""
    title, run = _told(scene, "title", "shows"), _told(scene, "duration", "accuracy", "method")
    tables = [
        *([_lines(title, "")] if title else []),
        "[chain]\n" + _lines(_chain_entries(scene.chain), "chain."),
        "[start]\n" + _lines({"q": scene.q, "u": scene.u}, "start."),
        "[run]\n" + _lines(run, "run."),
        *_effect_tables(scene.effects),
    ]
    return "\n".join(tables)


def _told(described: Any, *names: str) -> dict[str, Any]:
    """Return the fields of a dataclass, or those of these names, that are not as by default."""
    told = {}
    for field in fields(described):
        value = getattr(described, field.name)
        wanted = field.init and (not names or field.name in names)
        # Zeros of either sign are equal, and not alike.
        if wanted and repr(value) != repr(field.default):
            told[field.name] = value
    return told


def _chain_entries(chain: Chain) -> dict[str, Any]:
    """Return the entries of a [chain] table: mass and length alone for uniform bars."""
    if chain.rotors:
        raise SceneError(
            f"the chain has {len(chain.rotors)} rotors; allowed are none, and motor_inertia among "
            "the effects"
        )
    bars = {"mass": chain.mass, "length": chain.length}
    if _of_uniform_bars(chain):
        return bars
    return {**bars, "centre": chain.centre, "inertia": chain.inertia}


def _of_uniform_bars(chain: Chain) -> bool:
    """Return whether mass and length give back all of a chain, and its inertia as a rational."""
    try:
        bars = Chain.uniform_bars(chain.mass, chain.length)
    except ParameterError:
        return False
    return chain == bars and chain._exact_inertia == bars._exact_inertia


def _effect_tables(effects: tuple[Effect, ...]) -> list[str]:
    """Return the tables of effects, kind by kind, and their order where that is another."""
    names = [_registered_name(effect) for effect in effects]
    kinds = list(dict.fromkeys(names))
    tables = []
    if names != sorted(names, key=kinds.index):
        tables.append("[effects]\n" + _lines({"order": tuple(names)}, "effects."))
    for kind in kinds:
        header = f"[effects.{kind}]" if names.count(kind) == 1 else f"[[effects.{kind}]]"
        for name, effect in zip(names, effects, strict=True):
            if name == kind:
                tables.append(f"{header}\n" + _lines(_told(effect), f"effects.{kind}."))
    return tables


def _registered_name(effect: Effect) -> str:
    """Return the name of an effect in scene files."""
    home = type(effect).__module__, type(effect).__name__
    for name, registered in EFFECTS.items():
        if registered == home:
            return name
    raise SceneError(
        f"effect {type(effect).__name__} is not one of scene files; allowed are "
        f"{', '.join(EFFECTS)}"
    )


def _lines(entries: dict[str, Any], place: str) -> str:
    """Return entries in TOML, one a line; `place` is what their keys begin with in errors."""
    return "".join(f"{key} = {_in_toml(value, place + key)}\n" for key, value in entries.items())


def _in_toml(value: Any, key: str) -> str:
    """Return a value in TOML."""
    if isinstance(value, tuple):
        return f"[{', '.join(_in_toml(entry, key) for entry in value)}]"
    if isinstance(value, str):
        # TOML's strings are JSON's, but for one more character that must be escaped.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, bool):
        return "true" if value else "false"
    for kind in (int, float):
        if isinstance(value, kind):
            # Not that of a subclass: NumPy's floats call themselves np.float64(…).
            return kind.__repr__(value)
    received = " ".join(repr(value).split())
    raise SceneError(f"{key} is {received}; allowed are numbers, words, true, false, and tuples")
