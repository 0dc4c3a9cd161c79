"""A scene: a chain, its start, the options of a run, and the effects that act.

A scene is read from a TOML file and written to one. An effect that the file omits is not imported,
evaluated or compiled.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, fields, is_dataclass
from fractions import Fraction
from numbers import Real
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from twolink import optional
from twolink.arithmetic import Pair
from twolink.chain import Chain
from twolink.coordinates import JointConvention
from twolink.effects import EFFECTS, Effect, is_registered, names_of, with_rotors
from twolink.errors import ParameterError, SceneError, TwolinkError
from twolink.inputs import (
    as_choice,
    as_duration,
    as_number,
    as_pair,
    as_path,
    as_tuple,
    as_word,
    as_words,
    check_instance,
    is_number,
    nearest_float,
    refuse,
)
from twolink.integration.methods import METHODS, MethodName
from twolink.scene.model import checked, scene_model
from twolink.scene.names import scene_file
from twolink.scene.reading import chain_of, effects_of, start_of
from twolink.scene.text import check_tables, read_text, tables
from twolink.scene.writing import written
from twolink.tables import table
from twolink.text import name_of_source
from twolink.values import is_value


@dataclass(frozen=True, repr=False)
class Scene:
    """A chain, its start, a duration (s), and the tuple of effects that act.

    `q` (rad) and `u` (rad/s) are the start. `accuracy` is the largest global error in q
    (rad) and u (rad/s) over the whole run; `method` names an integration method. `shows` is one
    line on its purpose. Sequences become tuples, and an effect that could change is
    copied. `joints` ties joint angles to q, for a chain that has them, such as that of a URDF.
    `notes` has a sentence for each property of a URDF that is assumed or not simulated. Raises
    `ParameterError` for an argument of the wrong kind or value.

    Start, duration and accuracy become float64. Chain and effects have floats, whole numbers and
    fractions; mpmath's and SymPy's are for formulas.
    """

    chain: Chain
    q: Pair
    u: Pair
    duration: float
    effects: tuple[Effect, ...] = ()
    accuracy: float = 1e-9
    method: MethodName = "taylor"
    title: str = "untitled"
    shows: str = ""
    joints: JointConvention | None = None
    notes: tuple[str, ...] = field(default=(), repr=False, compare=False)

    def __post_init__(self) -> None:
        """Copy mutable values; require a finite start, and positive duration and accuracy."""
        if not isinstance(self.chain, Chain):
            refuse("chain", self.chain, "a Chain")
        kept: dict[str, Any] = {name: _start(name, getattr(self, name)) for name in ("q", "u")}
        for name in ("duration", "accuracy"):
            kept[name] = _positive(name, getattr(self, name))
        as_duration("run: duration", kept["duration"])
        kept["method"] = as_choice("method", self.method, METHODS)
        for name in ("title", "shows"):
            kept[name] = as_word(name, getattr(self, name))
        kept["notes"] = as_words("notes", self.notes)
        if self.joints is not None:
            check_instance("joints", self.joints, JointConvention)
        wanted = "a sequence of effects, such as (Gravity(),)"
        kept["effects"] = as_tuple("effects", self.effects, wanted)
        for name, value in kept.items():
            object.__setattr__(self, name, value)
        own = tuple(e if is_registered(e) else self._checked(e) for e in self.effects)
        for name, thing in (("chain", self.chain), *zip(names_of(own), own, strict=True)):
            for number in _unfit(thing):
                refuse(name, number, "made of floats, whole numbers or fractions")
        object.__setattr__(self, "effects", own)

    def _checked(self, effect: Any) -> Effect:
        from twolink.effects import custom

        return custom.checked(effect, self.chain)

    def __repr__(self) -> str:
        """Return the title, the start and the effects in a line."""
        effects = ", ".join(type(effect).__name__ for effect in self.effects) or "no effects"
        start = f"q={_short(self.q)} rad, u={_short(self.u)} rad/s"
        return f"<Scene {self.title!r}: {start}, {self.duration!r} s with {effects}>"

    def _repr_html_(self) -> str:
        """Return the drawing at the start and a table of the keys, for notebooks."""
        rows = {
            "purpose": self.shows,
            "q at the start": f"{_short(self.q)} rad",
            "u at the start": f"{_short(self.u)} rad/s",
            "duration": f"{self.duration!r} s",
            "accuracy": f"{self.accuracy!r}",
            "chain": repr(self.chain),
        }
        effects = zip(names_of(self.effects), self.effects, strict=True)
        rows |= {name: repr(effect) for name, effect in effects}
        return optional.drawing(self) + table(self.title, ("", ""), rows.items()).html()

    @property
    def may_change(self) -> bool:
        """Whether an effect is an object whose attributes can be set; a copy has its own."""
        return not all(is_registered(effect) or is_value(effect) for effect in self.effects)

    @property
    def moving_chain(self) -> Chain:
        """The chain with the rotors that effects add."""
        return with_rotors(self.effects, self.chain)

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Scene:
        """Return the scene in a TOML file, or the shipped scene of a name such as "drop".

        Raises `SceneError`, in one sentence with the file, the key, the requirement and the
        received value.
        """
        file = scene_file(path)
        return cls.parse(read_text(file), source=str(file), folder=file.parent)

    @classmethod
    def parse(cls, text: str, *, source: str = "<string>", folder: Path = Path()) -> Scene:
        """Return the scene in a TOML text; `urdf = "…"` is relative to `folder`."""
        as_word("text", text)
        source = name_of_source(as_word("source", source))
        return cls.from_dict(tables(text, source), source=source, folder=as_path("folder", folder))

    @classmethod
    def from_dict(
        cls, table: dict[str, Any], *, source: str = "<dict>", folder: Path = Path()
    ) -> Scene:
        """Return the scene of the tables of a scene file, as `tomllib.load` returns them.

        `table` is left unchanged. Raises `SceneError` as `load` does; `source` begins its sentence.
        """
        source = name_of_source(as_word("source", source))
        given = checked_tables(table, source)
        try:
            return cls.from_checked(given, folder)
        except TwolinkError as error:
            raise SceneError(f"{source}: {error}") from error

    @classmethod
    def from_checked(cls, given: dict[str, Any], folder: Path = Path()) -> Scene:
        """Return the scene of tables that `checked_tables` returned; they are left unchanged.

        Raises `TwolinkError` for values that are wrong together or for their kind of object.
        """
        described = chain_of(given["chain"], folder)
        q, u = start_of(given["start"], described.joints)
        effects = effects_of(given["effects"])
        return cls(
            chain=described.chain,
            q=q,
            u=u,
            effects=described.effects(effects),
            joints=described.joints,
            notes=described.notes(effects),
            title=given["title"],
            shows=given["shows"],
            **given["run"],
        )

    def to_toml(self) -> str:
        """Return a TOML text that `Scene.parse` reads back to an equal scene, bit for bit.

        Default values are omitted. Raises `SceneError` if a scene file cannot represent the scene:
        user-defined effects, rotors that no effect adds, invalid values.
        """
        text = written(self)
        in_a_file = text.encode("utf-8", errors="replace").decode("utf-8")
        if Scene.parse(in_a_file, source="the scene as TOML") != self:
            raise SceneError(
                "the numbers of a scene must be held by float64 and its words by UTF-8; got a"
                " scene that differs when its TOML is read back"
            )
        return text


def checked_tables(table: Any, source: str) -> dict[str, Any]:
    """Return the tables of a scene file with values of the right types, and with all defaults.

    Raises `SceneError` on the first value of another type, in a sentence that begins with `source`.
    """
    check_tables(table, source)
    named = table.get("effects")
    known = [name for name in named if name in EFFECTS] if isinstance(named, dict) else []
    return checked(scene_model(tuple(known)), table, source)


def _start(name: str, value: Any) -> Pair:
    """Return a pair of finite numbers in float64."""
    pair = as_pair(name, value)
    first, second = (nearest_float(number) for number in pair)
    if not math.isfinite(first) or not math.isfinite(second):
        raise ParameterError(f"start: {name} must be finite numbers; got {pair!r}")
    return first, second


def _positive(name: str, value: Any) -> float:
    """Return a positive and finite number in float64."""
    given = as_number(name, value)
    number = nearest_float(given)
    if not 0 < number < math.inf:
        raise ParameterError(f"run: {name} must be positive and finite; got {given!r}")
    return number


def _unfit(value: Any) -> Iterator[Any]:
    """Yield each array, and each number that does not compute with float64, of a data class."""
    if is_dataclass(value):
        for part in fields(value):
            if part.init:
                yield from _unfit(getattr(value, part.name))
    elif isinstance(value, tuple):
        for entry in value:
            yield from _unfit(entry)
    elif isinstance(value, (complex, np.ndarray, np.complexfloating)) or (
        is_number(value) and not isinstance(value, (bool, int, float, Fraction, np.floating))
    ):
        yield value


def _short(pair: Pair) -> str:
    return f"({', '.join(f'{float(x):.6g}' if isinstance(x, Real) else repr(x) for x in pair)})"
