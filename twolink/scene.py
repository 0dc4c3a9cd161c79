"""A scene: what the chain is, where it starts, for how long, and which effects act.

A scene is read from a TOML file, and written to one. What the file does not name does not exist: an
effect that is left out is not imported, not evaluated, not compiled.
"""

from __future__ import annotations

import json
import re
import reprlib
import tomllib
from collections import Counter
from dataclasses import MISSING, dataclass, fields
from functools import lru_cache
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_type_hints

from twolink.arithmetic import Pair
from twolink.chain import Chain
from twolink.effects import EFFECTS, Effect, effect_class
from twolink.errors import ParameterError, SceneError, TwolinkError
from twolink.finite import check_finite
from twolink.urdf.planar import JOINT_PROPERTIES, read_planar_urdf

if TYPE_CHECKING:
    from pydantic import BaseModel

METHODS = (
    "taylor",
    "DOP853",
    "RK45",
    "Radau",
    "LSODA",
    "rk4",
    "semi-implicit-euler",
    "implicit-midpoint",
    "gauss-legendre-4",
    "gauss-legendre-6",
)


@dataclass(frozen=True)
class Scene:
    """A chain, its start, a duration (s), and the tuple of effects that act.

    `q` (rad) and `u` (rad/s) are the start. `accuracy` is the global error that is allowed in q
    (rad) and u (rad/s) over the whole run; `method` names an integration method. `shows` is one
    line on what the scene is for.
    """

    chain: Chain
    q: Pair
    u: Pair
    duration: float
    effects: tuple[Effect, ...] = ()
    accuracy: float = 1e-9
    method: str = "taylor"
    title: str = "untitled"
    shows: str = ""

    def __post_init__(self) -> None:
        """Refuse a start that is no place, and a run that has no end."""
        check_finite("start", q=self.q, u=self.u)
        for name in ("duration", "accuracy"):
            value = getattr(self, name)
            if isinstance(value, (int, float)) and not 0 < value < float("inf"):
                raise ParameterError(f"run: {name} is {value!r}; allowed is a positive number")

    @property
    def equipped(self) -> Chain:
        """The chain that moves: with the rotors that effects put on it."""
        chain = self.chain
        for effect in self.effects:
            if hasattr(effect, "equipped"):
                chain = effect.equipped(chain)
        return chain

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Scene:
        """Return the scene in a TOML file.

        Raises `SceneError`, in one sentence with the file, the key, what was received and what is
        allowed.
        """
        file = Path(path)
        return cls.parse(_read(file), source=str(file), folder=file.parent)

    @classmethod
    def parse(cls, text: str, *, source: str = "<string>", folder: Path = Path()) -> Scene:
        """Return the scene in a TOML text; `urdf = "…"` is looked for from `folder`."""
        try:
            if _LONG_KEY.search(text):
                raise RecursionError
            table = tomllib.loads(text)
        except RecursionError as error:
            raise SceneError(
                f"{source}: this is nested too deeply; allowed is a scene file"
            ) from error
        except ValueError as error:
            # Python's int() refuses thousands of digits with an error that is not TOML's.
            reason = " ".join(str(error).split())
            raise SceneError(
                f"{source}: this is not TOML ({reason}); allowed is a scene file"
            ) from error
        if _is_deep(table):
            raise SceneError(f"{source}: this is nested too deeply; allowed is a scene file")
        named = table.get("effects")
        known = [name for name in named if name in EFFECTS] if isinstance(named, dict) else []
        checked = _checked(scene_model(tuple(known)), table, source)
        try:
            chain, of_urdf = _chain(checked["chain"], folder)
            return cls(
                chain=chain,
                q=checked["start"]["q"],
                u=checked["start"]["u"],
                effects=(*_effects(checked["effects"]), *of_urdf),
                title=checked["title"],
                shows=checked["shows"],
                **checked["run"],
            )
        except TwolinkError as error:
            raise SceneError(f"{source}: {error}") from error

    def to_toml(self) -> str:
        """Return a TOML text that `Scene.parse` reads back to an equal scene, to the last bit.

        What is as by default is left out. Raises `SceneError` for what no scene file can say:
        effects of one's own, rotors that no effect has put there, values that are not allowed.
        """
        text = "\n".join(_tables(self))
        in_a_file = text.encode("utf-8", errors="replace").decode("utf-8")
        if Scene.parse(in_a_file, source="the scene as TOML") != self:
            raise SceneError(
                "the scene as TOML reads back otherwise; allowed are numbers that float64 can hold "
                "and words that UTF-8 can"
            )
        return text


@lru_cache(maxsize=64)
def scene_model(effects: tuple[str, ...] = tuple(EFFECTS)) -> type[BaseModel]:
    """Return the pydantic model of a scene file with these effects."""
    from typing import Annotated, Literal

    from pydantic import AfterValidator, ConfigDict, Field, create_model

    strict = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)
    positive = Annotated[float, Field(gt=0)]
    pair = tuple[float, float]

    # An effect may have a field of any name, so the model's own is given by its place.
    def model(title: str, /, **entries: Any) -> type[BaseModel]:
        return create_model(title, __config__=strict, **entries)

    chain = model(
        "Chain",
        mass=(pair | None, Field(None, description="masses of links 1 and 2, kg")),
        length=(pair | None, Field(None, description="lengths, m")),
        centre=(
            tuple[pair, pair] | None,
            Field(None, description="mass centres along and across the links, m; default: bars"),
        ),
        inertia=(pair | None, Field(None, description="central inertias, kg m²; default: bars")),
        urdf=(str | None, Field(None, description="a URDF file instead, from the scene's folder")),
        effects=(
            Annotated[
                tuple[Literal[JOINT_PROPERTIES], ...],  # type: ignore[valid-type]
                AfterValidator(_each_once),
                Field(json_schema_extra={"uniqueItems": True}),
            ]
            | None,
            Field(None, description="which of the URDF's own act, limits as stops; default: none"),
        ),
    )
    start = model(
        "Start",
        q=(pair, Field(description="absolute angles from the x-axis, y downward, rad")),
        u=(pair, Field((0.0, 0.0), description="their speeds, rad/s")),
    )
    run = model(
        "Run",
        duration=(positive, Field(description="s")),
        accuracy=(positive, Field(1e-9, description="global error in q (rad) and u (rad/s)")),
        method=(Literal[METHODS], Field("taylor", description="integration method")),
    )
    order = Field(None, description="all effects by name as they act; default: kind by kind")
    tables: dict[str, Any] = {"order": (tuple[str, ...] | None, order)}
    for name in effects:
        table = model(f"{name} table", **_entries(effect_class(name)))
        tables[name] = (table | list[table] | None, None)  # type: ignore[valid-type]
    return model(
        "Scene",
        title=(str, "untitled"),
        shows=(str, Field("", description="one line on what the scene shows")),
        chain=(chain, ...),
        start=(start, ...),
        run=(run, ...),
        effects=(model("Effects", **tables), Field(default_factory=dict, validate_default=True)),
    )


def _each_once(words: tuple[str, ...]) -> tuple[str, ...]:
    """Return words of which none is given twice, or raise pydantic's error."""
    from pydantic_core import PydanticCustomError

    if len(set(words)) < len(words):
        raise PydanticCustomError("repeated", "each word at most once")
    return words


def _entries(effect: Any) -> dict[str, Any]:
    """Return the fields of an effect, as pydantic wants them."""
    hints = get_type_hints(effect)
    return {
        field.name: (hints[field.name], ... if field.default is MISSING else field.default)
        for field in fields(effect)
    }


# A table of effects, a list of tables, one table, a list, a list in it.
_DEEPEST = 10

LARGEST_FILE = 4 * 2**20
"""Bytes of the largest scene file read: a hundred thousand samples of a torque are fewer."""

# A key of fifty names with dots between; tomllib takes memory by the square of their number.
_LONG_KEY = re.compile(r"""(?<![\w-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')\s*+\.\s*+){50}""")


def _read(file: Path) -> str:
    try:
        if not file.is_file():
            # Devices and pipes may have no end.
            what = "this is no plain file" if file.exists() else "there is no file of this name"
            raise SceneError(f"{_named(file)}: {what}; allowed is the path of a scene file")
        with file.open("rb") as stream:
            content = stream.read(LARGEST_FILE + 1)
        if len(content) > LARGEST_FILE:
            raise SceneError(
                f"{file}: is larger than {LARGEST_FILE // 2**20} MB; allowed is a smaller file"
            )
        # Line ends as Python reads them from text.
        return content.decode("utf-8").replace("\r\n", "\n")
    except (OSError, ValueError) as error:
        reason = (isinstance(error, OSError) and error.strerror) or error
        raise SceneError(
            f"{_named(file)}: cannot be read ({reason}); allowed is a TOML file in UTF-8"
        ) from error


def _named(file: Path) -> str:
    """Return a file's name for a sentence: as it is, unless it is long or cannot be printed."""
    name = str(file)
    return name if name.isprintable() and len(name) <= 300 else _short.repr(name)


def _checked(model: type[BaseModel], table: dict[str, Any], source: str) -> dict[str, Any]:
    """Return a table's values, all of the right shape, or raise one sentence on the first fault."""
    from pydantic import ValidationError

    try:
        return model.model_validate(_with_tuples(table)).model_dump()
    except ValidationError as error:
        fault = error.errors()[0]
        raise SceneError(f"{source}: {_sentence(fault)}") from error


def _is_deep(value: Any) -> bool:
    """Return whether tables and lists are nested deeper than any scene's; without recursion."""
    level = [value]
    for _ in range(_DEEPEST):
        inner = [list(x.values()) if isinstance(x, dict) else x for x in level]
        level = [x for entries in inner for x in entries if isinstance(x, (dict, list))]
        if not level:
            return False
    return True


def _with_tuples(value: Any) -> Any:
    """Return nested lists of numbers as tuples: pairs are tuples here, and lists in TOML."""
    if isinstance(value, dict):
        return {key: _with_tuples(entry) for key, entry in value.items()}
    if isinstance(value, list) and not any(isinstance(entry, dict) for entry in value):
        return tuple(_with_tuples(entry) for entry in value)
    return [_with_tuples(entry) for entry in value] if isinstance(value, list) else value


def _sentence(fault: Any) -> str:
    """Return one of pydantic's errors in our words."""
    # Of the places that pydantic names, those that are no keys are its own: "gravity table".
    place = [str(part) for part in fault["loc"]]
    key = ".".join(part for part in place if part.isidentifier() or part.isdigit())
    if fault["type"] == "extra_forbidden":
        if place[:-1] == ["effects"]:
            return f"effect '{place[-1]}' is unknown; allowed are {', '.join(EFFECTS)}"
        return f"key '{key}' is unknown; allowed are the keys that `twolink scenes --schema` lists"
    if fault["type"] == "too_long" or (fault["type"] == "missing" and place[-1].isdigit()):
        return f"{key.removesuffix('.1')} is {_shown(fault['input'])}; allowed are two numbers"
    if fault["type"] == "missing":
        return f"key '{key}' is missing; allowed is a scene that gives it"
    # What pydantic calls a tuple is a list in TOML.
    allowed = fault["msg"].removeprefix("Input should be ").replace("a valid tuple", "a list")
    return f"{key} is {_shown(fault['input'])}; allowed is {allowed}"


def _shown(value: Any) -> str:
    """Return what was received in words, shortened where it is long."""
    try:
        return _short.repr(value)
    except ValueError:
        # Python writes no integer of more than some thousand digits.
        return "an integer of thousands of digits"


_short = reprlib.Repr()
_short.maxstring = _short.maxother = _short.maxlong = 100
_short.maxtuple = _short.maxlist = _short.maxdict = 12


def _chain(table: dict[str, Any], folder: Path) -> tuple[Chain, tuple[Effect, ...]]:
    """Return the chain that a [chain] table describes, and the effects it asks of its URDF."""
    given = {key: value for key, value in table.items() if value is not None}
    asked = given.pop("effects", None)
    if "urdf" in given:
        if len(given) > 1:
            others = ", ".join(sorted(set(given) - {"urdf"}))
            raise SceneError(f"chain has both urdf and {others}; allowed is one of them")
        return _of_urdf(folder / given["urdf"], asked or ())
    if asked is not None:
        raise SceneError(
            f"chain.effects is {asked!r} and there is no chain.urdf; allowed are effects of a URDF"
        )
    return _chain_of_numbers(given), ()


def _of_urdf(file: Path, asked: tuple[str, ...]) -> tuple[Chain, tuple[Effect, ...]]:
    """Return the chain that a URDF file describes, and what is asked for of its joints."""
    read = read_planar_urdf(file)
    chain = Chain.from_links(read.links)
    if not asked:
        return chain, ()
    from twolink.effects.of_urdf import effects_of

    return chain, effects_of(read, asked)


def _chain_of_numbers(given: dict[str, Any]) -> Chain:
    """Return the chain of the parameters that are given."""
    for key in ("mass", "length"):
        if key not in given:
            raise SceneError(f"chain.{key} is missing; allowed is a pair of numbers, or urdf")
    if ("centre" in given) != ("inertia" in given):
        raise SceneError("chain has only one of centre and inertia; allowed are both, or neither")
    return Chain(**given) if "centre" in given else Chain.uniform_bars(**given)


def _effects(tables: dict[str, Any]) -> list[Effect]:
    """Return the effects that are named, in the file's order or the one that it asks for."""
    order = tables.pop("order", None)
    found = []
    for name, value in tables.items():
        for table in value if isinstance(value, list) else [value]:
            if table is not None:
                found.append((name, effect_class(name)(**table)))
    return [effect for _, effect in (found if order is None else _ordered(found, order))]


def _ordered(found: list[tuple[str, Effect]], order: tuple[str, ...]) -> list[tuple[str, Effect]]:
    """Return named effects in an order of their names; those of one name stay as they are."""
    if Counter(order) != Counter(name for name, _ in found):
        raise SceneError(
            f"effects.order is {order!r}; allowed is each effect's name as often as it is given"
        )
    waiting = {name: iter([pair for pair in found if pair[0] == name]) for name in order}
    return [next(waiting[name]) for name in order]


def _tables(scene: Scene) -> list[str]:
    """Return the tables of a scene file in TOML, each ending with a line break."""
    title, run = _told(scene, "title", "shows"), _told(scene, "duration", "accuracy", "method")
    return [
        *([_lines(title, "")] if title else []),
        "[chain]\n" + _lines(_chain_entries(scene.chain), "chain."),
        "[start]\n" + _lines({"q": scene.q, "u": scene.u}, "start."),
        "[run]\n" + _lines(run, "run."),
        *_effect_tables(scene.effects),
    ]


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
