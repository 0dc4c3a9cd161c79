"""The messages of protocol 1 between the kit and an engine: frozen types and their JSON schemas.

A message is one JSON object on one line. Numbers are JSON numbers; those that are not finite are
the strings "nan", "inf" and "-inf". Arrays have one entry for each state. SI units and radians.
"""

from __future__ import annotations

import json
import math
from typing import Annotated, Any, Literal, NoReturn

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from twolink.errors import EngineError
from twolink.text import one_line, quoted

PROTOCOL = 1

Precision = Literal["binary32", "binary64", "extended"]
Reads = Literal["urdf", "parameters", "scene"]
Effect = Literal[
    "joint_damping", "joint_friction", "joint_spring", "joint_stop", "surface", "armature"
]


# Whole numbers of so many characters are numbers of float64.
_MOST_DIGITS = 300


class ProtocolError(EngineError):
    """An engine's answer is not a message of the protocol."""


def _number(value: Any) -> Any:
    words = {"nan": math.nan, "inf": math.inf, "-inf": -math.inf}
    return words.get(value, value) if isinstance(value, str) else value


Number = Annotated[
    float,
    BeforeValidator(
        _number,
        json_schema_input_type=float | Literal["nan", "inf", "-inf"],
    ),
]


def _counted(value: Any) -> Any:
    # JSON has one kind of numbers: 7.0 is a whole number, and some languages write it so.
    return int(value) if isinstance(value, float) and value.is_integer() else value


Whole = Annotated[int, BeforeValidator(_counted, json_schema_input_type=int)]
# Text that is printed in sentences and tables.
Line = Annotated[str, AfterValidator(one_line)]
Pair = tuple[Number, Number]
Row = tuple[Number, ...]


class Message(BaseModel):
    """Base class of all messages: frozen, with no other keys, and with no conversion of types."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    def line(self) -> str:
        """Return the message as one line of JSON, without keys that are not given."""
        return json.dumps(
            _as_words(self.model_dump(exclude_none=True)), ensure_ascii=False, allow_nan=False
        )


class Start(Message):
    """Ask an engine for its name and its capabilities."""

    cmd: Literal["start"] = "start"
    version: int = PROTOCOL


class StoppedJoint(Message):
    """Rigid stops of joint 1 or 2: bounds of its angle (rad), and their restitution."""

    joint: Literal[1, 2]
    lower: Number | None = None
    upper: Number | None = None
    restitution: Number = 0.0


class HalfPlane(Message):
    """A rigid half-plane that points of the chain cannot enter: B, the elbow, or D, the end.

    `point` (m) and the outward `normal` are in the chain's frame. `restitution` is that of
    Stronge's law, which differs from others with friction alone. `friction` is Coulomb's
    coefficient when sliding, `static` when sticking (the same unless given).
    """

    point: Pair
    normal: Pair
    on: tuple[Literal["B", "D"], ...] = ("D",)
    restitution: Number = 0.0
    friction: Number = 0.0
    static: Number | None = None


class Parameters(Message):
    """Parameters of a planar chain: joint angles from x, and from link 1; y points down.

    Entries belong to link 1 and 2. `centre` is the mass centre along and across a link from its
    joint, `inertia` is about the mass centre; `gravity` (m/s²) points along y. Damping (N m s/rad),
    friction (N m; `static_friction` at rest), springs (`stiffness` in N m/rad, `rest` in rad) and
    armature (kg m²) belong to the joints. An engine is sent keys of effects only if it has them.
    """

    mass: Pair
    length: Pair
    centre: tuple[Pair, Pair]
    inertia: Pair
    gravity: Number
    damping: Pair = (0.0, 0.0)
    friction: Pair = (0.0, 0.0)
    armature: Pair = (0.0, 0.0)
    static_friction: Pair | None = None
    stiffness: Pair | None = None
    rest: Pair | None = None
    stops: tuple[StoppedJoint, ...] | None = None
    surfaces: tuple[HalfPlane, ...] | None = None


class Model(Message):
    """Load a model, from a URDF text, parameters or a scene; it replaces the one before.

    `gravity` is a vector in the root link's frame (m/s²), `joints` are the names of the moving
    joints in order, and `tip` is the name of the link whose frame's origin is D. `scene` is the
    text of a scene file of twolink.
    """

    cmd: Literal["model"] = "model"
    id: str
    urdf: str | None = None
    gravity: tuple[Number, Number, Number] | None = None
    joints: tuple[str, str] | None = None
    tip: str | None = None
    parameters: Parameters | None = None
    scene: str | None = None


class States(Message):
    """States of a message: a row of two numbers for each state, in joint coordinates."""

    angles: tuple[Pair, ...]
    speeds: tuple[Pair, ...] | None = None
    accelerations: tuple[Pair, ...] | None = None
    torques: tuple[Pair, ...] | None = None

    def arrays(self) -> dict[str, NDArray[np.float64]]:
        """Return the given quantities as arrays, shape (n, 2)."""
        given = self.model_dump(exclude_none=True)
        return {name: np.array(rows, dtype=float) for name, rows in given.items()}


class Ask(Message):
    """Ask for a quantity in many states of the model."""

    cmd: Literal["ask"] = "ask"
    seq: int
    test: str
    quantity: str
    states: States


class Move(Message):
    """Ask for a motion of the model from a state at the first of the times (s)."""

    cmd: Literal["move"] = "move"
    seq: int
    test: str
    angles: Pair
    speeds: Pair
    method: str
    parameter: Number
    times: Row


class Stop(Message):
    """Ask an engine to end. It gives no answer."""

    cmd: Literal["stop"] = "stop"


class Method(Message):
    """An integration method: its order, and the parameter that makes it finer."""

    name: Line
    order: Number | None = None
    parameter: Literal["step", "tolerance"] = "step"


class About(Message):
    """An engine: name, version, precision, and its capabilities.

    `reads` has the kinds of model, the preferred one first; `answers` the quantities; `effects`
    the effects that its dynamics include beside rigid bodies and gravity.
    """

    name: Line = Field(min_length=1)
    version: Line
    language: Line = ""
    issues: Line = ""
    precision: Precision = "binary64"
    reads: tuple[Reads, ...] = Field(min_length=1)
    answers: tuple[str, ...] = ()
    effects: tuple[Effect, ...] = ()
    methods: tuple[Method, ...] = ()


class Started(Message):
    """The answer to `start`."""

    version: Whole
    engine: About


class Understood(Message):
    """The parameters of a model as an engine has them; entries are for link or joint 1, 2.

    `reach` is the distance of the mass centre from the link's joint axis (m), `inertia` is about
    the mass centre and the axis of rotation (kg m²), with everything that is fixed to the link.
    """

    mass: Pair | None = None
    reach: Pair | None = None
    inertia: Pair | None = None
    damping: Pair | None = None
    friction: Pair | None = None
    armature: Pair | None = None
    limits: tuple[Pair | None, Pair | None] | None = None


class Loaded(Message):
    """The answer to `model` of an engine that has loaded it."""

    ok: Literal[True] = True
    understood: Understood | None = None
    warnings: tuple[str, ...] = ()


class Refused(Message):
    """The answer to `model` of an engine that rejects it, and why."""

    refused: str


class Values(Message):
    """The answer to `ask`: an entry for each state."""

    seq: Whole
    values: list[Any]
    warnings: tuple[str, ...] = ()


class Skipped(Message):
    """The answer to `ask` or `move` of an engine that cannot, and why."""

    seq: Whole
    skipped: Literal[True] = True
    message: str = ""
    issue_url: str = ""


class Errored(Message):
    """The answer to `ask` or `move` of an engine that failed, and how."""

    seq: Whole
    errored: Literal[True] = True
    message: str = ""
    context: dict[str, Any] = Field(default_factory=dict)


class Event(Message):
    """An event of a motion, such as an impact."""

    t: Number
    kind: str
    impulse: Row = ()


class Moved(Message):
    """The answer to `move`: angles (rad) and speeds (rad/s) at each of the times, and the cost."""

    seq: Whole
    angles: tuple[Pair, ...]
    speeds: tuple[Pair, ...]
    events: tuple[Event, ...] = ()
    seconds: Number = 0.0
    setup_seconds: Number = 0.0
    warnings: tuple[str, ...] = ()


REQUESTS: dict[str, type[Message]] = {
    "start": Start,
    "model": Model,
    "ask": Ask,
    "move": Move,
    "stop": Stop,
}

Request = Start | Model | Ask | Move
Answer = Started | Loaded | Refused | Values | Moved | Skipped | Errored

_ANSWERS: dict[str, type[Answer]] = {
    "start": Started,
    "model": Loaded,
    "ask": Values,
    "move": Moved,
}
_SIGNS: dict[str, type[Answer]] = {"refused": Refused, "skipped": Skipped, "errored": Errored}
_MAY: dict[str, tuple[str, ...]] = {
    "start": (),
    "model": ("refused",),
    "ask": ("skipped", "errored"),
    "move": ("skipped", "errored"),
}


def schemas() -> dict[str, dict[str, Any]]:
    """Return the JSON schema of each message, by its name."""
    answers = {"started": Started, "loaded": Loaded, "values": Values, "moved": Moved, **_SIGNS}
    kinds: dict[str, type[Message]] = {**REQUESTS, **answers}
    return {name: kind.model_json_schema(mode="validation") for name, kind in kinds.items()}


def answer_of(cmd: str, line: str) -> Answer:
    """Return the answer to a command in a line of text. Raises `ProtocolError`."""
    table = table_of(line)
    sign = next((key for key in _MAY[cmd] if key in table), None)
    return _checked(_ANSWERS[cmd] if sign is None else _SIGNS[sign], table)


def request_of(line: str) -> Request | Stop:
    """Return the request in a line of text. Raises `ProtocolError`."""
    table = table_of(line)
    cmd = table.get("cmd")
    if not isinstance(cmd, str) or cmd not in REQUESTS:
        raise ProtocolError(f"cmd must be one of {', '.join(REQUESTS)}; got {quoted(cmd)}")
    return _checked(REQUESTS[cmd], table)


def table_of(line: str) -> dict[str, Any]:
    """Return the JSON object in a line of text. Raises `ProtocolError`."""
    try:
        table = json.loads(line, parse_constant=_no_constant, parse_int=_whole)
    except ProtocolError:
        raise
    except (ValueError, RecursionError) as error:
        raise ProtocolError(
            f"an answer must be one JSON object on one line; got {one_line(line, 120)!r} ({error})"
        ) from error
    if not isinstance(table, dict):
        raise ProtocolError(f"an answer must be a JSON object; got {one_line(line, 120)!r}")
    return table


def _whole(digits: str) -> int | float:
    """Return a whole number; beyond float64 infinity, as JSON's numbers with a power of ten are."""
    return int(digits) if len(digits) <= _MOST_DIGITS else float(digits)


def _no_constant(word: str) -> NoReturn:
    raise ProtocolError(f'numbers must be JSON, with "nan" and "inf" as strings; got {word}')


def _checked(kind: type[Any], table: dict[str, Any]) -> Any:
    try:
        # JSON has lists only, which the strict types of Python would refuse as tuples.
        return kind.model_validate_json(json.dumps(table))
    except ValidationError as error:
        raise ProtocolError(sentence_of(error, kind.__name__.lower())) from error


def sentence_of(error: ValidationError, message: str = "message") -> str:
    """Return the first fault of a message, named if it is of the whole, in one sentence."""
    fault = error.errors()[0]
    place = ".".join(str(part) for part in fault["loc"]) or message
    return f"{place}: {fault['msg'][0].lower()}{fault['msg'][1:]}; got {quoted(fault['input'])}"


def _as_words(value: Any) -> Any:
    """Return a value with NaN and infinities as the strings of the protocol."""
    if isinstance(value, dict):
        return {key: _as_words(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_as_words(entry) for entry in value]
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value
