"""The pydantic model of a scene file, and its validation errors as sentences."""

from __future__ import annotations

import re
from dataclasses import MISSING, fields
from functools import lru_cache
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args, get_type_hints

from twolink.effects import EFFECTS, effect_class
from twolink.errors import SceneError
from twolink.integration.methods import METHODS
from twolink.names import JOINT_PROPERTIES
from twolink.text import choice, quoted

if TYPE_CHECKING:
    from pydantic import BaseModel


@lru_cache(maxsize=64)
def scene_model(effects: tuple[str, ...] = tuple(EFFECTS)) -> type[BaseModel]:
    """Return the pydantic model of a scene file with these effects."""
    from pydantic import Field

    return table_model(
        "Scene",
        title=(str, "untitled"),
        shows=(str, Field("", description="one line on the subject of the scene")),
        chain=(_chain_table(), ...),
        start=(_start_table(), ...),
        run=(_run_table(), ...),
        effects=(_effects_table(effects), Field(default_factory=dict, validate_default=True)),
    )


# An effect may have a field of any name, so `title` is positional only.
def table_model(title: str, /, **entries: Any) -> type[BaseModel]:
    """Return the model of a table, which has no other keys."""
    from pydantic import ConfigDict, create_model

    strict = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)
    return create_model(title, __config__=strict, **entries)


def list_of_tables(table: type[BaseModel]) -> Any:
    """Return the type of a list of tables, which may be empty."""
    from pydantic import BeforeValidator

    # A list without tables has become a tuple, as lists of numbers have.
    return Annotated[list[table], BeforeValidator(lambda given: [] if given == () else given)]  # type: ignore[valid-type]


_Pair = tuple[float, float]


def _chain_table() -> type[BaseModel]:
    from pydantic import AfterValidator, Field

    return table_model(
        "Chain",
        mass=(_Pair | None, Field(None, description="masses of links 1 and 2, kg")),
        length=(_Pair | None, Field(None, description="lengths, m")),
        centre=(
            tuple[_Pair, _Pair] | None,
            Field(None, description="mass centres along and across the links, m; default: bars"),
        ),
        inertia=(_Pair | None, Field(None, description="central inertias, kg m²; default: bars")),
        joint_sign=(
            tuple[Literal[1, -1], Literal[1, -1]] | None,
            Field(None, description="s1, s2 of the joint angles: q1 = s1 θ1 + φ1; see start.theta"),
        ),
        joint_offset=(_Pair | None, Field(None, description="φ1, φ2 of the joint angles, rad")),
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


def _start_table() -> type[BaseModel]:
    from pydantic import Field

    return table_model(
        "Start",
        q=(
            _Pair | None,
            Field(None, description="absolute angles from the x-axis, y downward, rad"),
        ),
        u=(_Pair | None, Field(None, description="their speeds, rad/s; default: 0")),
        theta=(_Pair | None, Field(None, description="instead of q: the URDF's joint angles, rad")),
        omega=(_Pair | None, Field(None, description="instead of u: the joints' speeds, rad/s")),
    )


def _run_table() -> type[BaseModel]:
    from pydantic import Field

    positive = Annotated[float, Field(gt=0)]
    return table_model(
        "Run",
        duration=(positive, Field(description="s")),
        accuracy=(
            positive,
            Field(1e-9, description="global error in all angles (rad) and speeds (rad/s)"),
        ),
        method=(Literal[tuple(METHODS)], Field("taylor", description="integration method")),
    )


def _effects_table(effects: tuple[str, ...]) -> type[BaseModel]:
    from pydantic import Field

    order = Field(None, description="all effects by name as they act; default: kind by kind")
    entries: dict[str, Any] = {"order": (tuple[str, ...] | None, order)}
    for name in effects:
        one = table_model(f"{name} table", **_entries(effect_class(name)))
        entries[name] = (one | list[one] | None, None)  # type: ignore[valid-type]
    return table_model("Effects", **entries)


def _each_once(words: tuple[str, ...]) -> tuple[str, ...]:
    """Validate that the items are unique."""
    from pydantic_core import PydanticCustomError

    if len(set(words)) < len(words):
        raise PydanticCustomError("repeated", "a list of words, each at most once")
    return words


def _entries(effect: Any) -> dict[str, Any]:
    """Return the fields of an effect, as arguments of `create_model`."""
    hints = get_type_hints(effect)
    return {
        field.name: (hints[field.name], ... if field.default is MISSING else field.default)
        for field in fields(effect)
    }


def checked(model: type[BaseModel], table: dict[str, Any], source: str) -> dict[str, Any]:
    """Return the validated values of a table, or raise `SceneError` on the first error."""
    from pydantic import ValidationError

    try:
        return model.model_validate(_with_tuples(table)).model_dump()
    except ValidationError as error:
        fault = error.errors()[0]
        raise SceneError(f"{source}: {_sentence(fault, model)}") from error


def _with_tuples(value: Any) -> Any:
    """Return nested lists of numbers as tuples, since TOML has only lists."""
    if isinstance(value, dict):
        return {key: _with_tuples(entry) for key, entry in value.items()}
    if isinstance(value, list) and not any(isinstance(entry, dict) for entry in value):
        return tuple(_with_tuples(entry) for entry in value)
    return [_with_tuples(entry) for entry in value] if isinstance(value, list) else value


def _sentence(fault: Any, model: type[BaseModel]) -> str:
    """Return a validation error of pydantic as a sentence."""
    # Places that are not keys, such as "gravity table", are names of pydantic models.
    place = [str(part) for part in fault["loc"]]
    key = ".".join(part for part in place if part.isidentifier() or part.isdigit())
    if fault["type"] == "extra_forbidden":
        return _unknown_key(place, model)
    if fault["type"] == "too_long" or (fault["type"] == "missing" and place[-1].isdigit()):
        return f"{key.removesuffix('.1')} must be two numbers; got {quoted(fault['input'])}"
    if fault["type"] == "missing":
        return f"key '{key}' is missing; it must be given"
    if fault["type"] == "literal_error" and isinstance(fault["input"], str):
        return choice(key, fault["input"], re.findall("'([^']*)'", fault["ctx"]["expected"]))
    if fault["type"] == "float_type" and isinstance(fault["input"], str):
        return f"{key} must be a number, without quotes; got {quoted(fault['input'])}"
    return f"{key} must be {_required(fault)}; got {quoted(fault['input'])}"


def _required(fault: Any) -> str:
    """Return the requirement of a validation error in the words of TOML, whose lists are tuples."""
    if fault["type"] == "list_type":
        # All other lists are tuples of pydantic.
        return "a list of tables"
    if fault["type"] == "model_type":
        return "a table"
    message: str = fault["msg"]
    return message.removeprefix("Input should be ").replace("a valid tuple", "a list")


def _unknown_key(place: list[str], model: type[BaseModel]) -> str:
    """Return the sentence that rejects a key."""
    if place[:-1] == ["effects"]:
        return choice("effect", place[-1], EFFECTS)
    of_all = f"the {model.__name__.lower()}"
    where = ".".join(part for part in place[:-1] if part.isidentifier()) or of_all
    return choice(f"a key of {where}", place[-1], _keys_beside(place, model))


def _keys_beside(place: list[str], model: type[BaseModel]) -> list[str]:
    """Return the valid keys of the table of an unknown key."""
    if place[0] == "effects" and len(place) > 2 and place[1] in EFFECTS:
        return [field.name for field in fields(effect_class(place[1]))]
    table: Any = model
    for part in place[:-1]:
        if not part.isdigit():
            table = _table_in(table, part)
    return list(getattr(table, "model_fields", ()))


def _table_in(table: Any, key: str) -> Any:
    """Return the model of the table, or of the tables in a list, that a key has."""
    field = getattr(table, "model_fields", {}).get(key)
    if field is None:
        return None
    waiting = [field.annotation]
    while waiting:
        kind = waiting.pop()
        if hasattr(kind, "model_fields"):
            return kind
        waiting += get_args(kind)
    return None
