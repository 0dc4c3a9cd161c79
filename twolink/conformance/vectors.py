"""Test vectors: groups of tests on one model, with certified values, as data and as JSON.

A group is one model; a test asks for one quantity in a few states. Ids are never reused. Values are
decimal strings of 30 digits; `bound` is the largest error of a right engine in binary64.
"""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from twolink.engines.messages import (
    Effect,
    Message,
    Model,
    Number,
    Pair,
    Parameters,
    Row,
    States,
    Understood,
)

RELEASE = "2026.11"
"""Version of the vectors: year and month. A changed value is an erratum in `ERRATA`."""

ERRATA: tuple[str, ...] = ()
"""Changes of values since the first release, each with its proof."""

DIGITS = 30

Level = Literal["lower", "average", "higher"]
Expect = Literal["value", "refuse", "either"]


class Flag(Message):
    """The subject of a flagged test: the kind of mistake, and reports of it in released engines."""

    kind: Literal["import", "dynamics", "input", "numbers"]
    description: str
    effect: str
    first_seen: tuple[str, ...] = ()


class Frame(Message):
    """The chain's frame in the root link's: A (m), and the unit vectors x and y."""

    origin: tuple[Number, Number, Number]
    x: tuple[Number, Number, Number]
    y: tuple[Number, Number, Number]


class Vector(Message):
    """One test: a quantity in states, its values and the bound of their errors.

    `needs` are effects that the engine must have declared.
    """

    id: str
    comment: str = ""
    flags: tuple[str, ...] = ()
    level: Level = "average"
    quantity: str
    unit: str
    needs: tuple[Effect, ...] = ()
    states: States
    values: list[Any]
    bound: list[Any]


class Motion(Message):
    """A motion from a state: its angles and speeds at times.

    `digits` is the number of correct digits, decimal places if there are events. `values` has θ1,
    θ2, θ̇1 and θ̇2 at each of the `times` but the first, at which it starts.
    """

    id: str
    comment: str = ""
    flags: tuple[str, ...] = ()
    level: Level = "average"
    needs: tuple[Effect, ...] = ()
    angles: Pair
    speeds: Pair
    times: Row
    digits: int = DIGITS
    values: list[list[str]]

    @property
    def smooth(self) -> bool:
        """Whether the motion has no events: no stops, surfaces and dry friction."""
        return not {"joint_friction", "joint_stop", "surface"} & set(self.needs)


class Group(Message):
    """One model with its tests.

    A model has a URDF text, parameters, or both; an engine is sent the first form that it reads.
    `expect` is "value" for a model that must be read, "refuse" for one that must be rejected, and
    "either" where standards differ. `frame` places the chain in the URDF's root frame.
    """

    id: str
    comment: str
    flags: tuple[str, ...]
    level: Level = "average"
    expect: Expect = "value"
    reason: tuple[str, ...] = ()
    urdf: str | None = None
    gravity: tuple[Number, Number, Number] | None = None
    frame: Frame | None = None
    parameters: Parameters | None = None
    understood: Understood | None = None
    tests: tuple[Vector, ...] = ()
    motions: tuple[Motion, ...] = ()

    def request(self, reads: tuple[str, ...]) -> Model | None:
        """Return the message that loads the model in the first form an engine reads, or None."""
        for form in reads:
            if form == "urdf" and self.urdf is not None:
                return Model(
                    id=self.id,
                    urdf=self.urdf,
                    gravity=self.gravity,
                    joints=("shoulder", "elbow"),
                    tip="D",
                )
            if form == "parameters" and self.parameters is not None:
                return Model(id=self.id, parameters=self.parameters)
        return None


class VectorFile(Message):
    """A file of vectors: one group, with the notes on its flags."""

    schema_: str = Field("../schema/vectors.json", alias="schema")
    version: str = RELEASE
    suite: str
    about: str
    notes: dict[str, Flag]
    bound_reason: str
    group: Group
