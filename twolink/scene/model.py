"""What a scene file may hold: pydantic's model of it, and its complaints in our words."""

from __future__ import annotations

import reprlib
from dataclasses import MISSING, fields
from functools import lru_cache
from typing import TYPE_CHECKING, Any, get_type_hints

from twolink.effects import EFFECTS, effect_class
from twolink.errors import SceneError
from twolink.urdf.planar import JOINT_PROPERTIES

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


def checked(model: type[BaseModel], table: dict[str, Any], source: str) -> dict[str, Any]:
    """Return a table's values, all of the right shape, or raise one sentence on the first fault."""
    from pydantic import ValidationError

    try:
        return model.model_validate(_with_tuples(table)).model_dump()
    except ValidationError as error:
        fault = error.errors()[0]
        raise SceneError(f"{source}: {_sentence(fault)}") from error


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
