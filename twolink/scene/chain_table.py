"""The chain that a [chain] table describes: by numbers, or by a URDF."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from twolink.arithmetic import Pair
from twolink.chain import Chain
from twolink.coordinates import JointConvention
from twolink.effects import EFFECTS, Effect
from twolink.names import JOINT_PROPERTIES
from twolink.urdf.spatial import STANDARD_GRAVITY

if TYPE_CHECKING:
    from twolink.urdf import PlanarUrdf


@dataclass(frozen=True)
class DescribedChain:
    """The chain of a [chain] table, with further properties of its URDF or its numbers.

    `joints` ties the joint angles of `start.theta` to absolute angles; None if they are unknown.
    `asked` are the effects of the joints of the URDF that the table names, and `read` is the URDF.
    """

    chain: Chain
    joints: JointConvention | None = None
    asked: tuple[str, ...] = ()
    read: PlanarUrdf | None = None

    def effects(self, given: list[Effect]) -> tuple[Effect, ...]:
        """Return the effects of the scene as they act on this chain, and those of the URDF."""
        if self.read is None:
            return tuple(given)
        acting = [in_plane(self.read, effect) for effect in given]
        return (*(effect for effect in acting if effect is not None), *self._of_joints())

    def notes(self, given: list[Effect]) -> tuple[str, ...]:
        """Return a sentence for each property of the URDF that is assumed or not simulated."""
        if self.read is None:
            return ()
        both = [(effect, in_plane(self.read, effect)) for effect in given]
        acting = [own for effect, own in both if own is not effect]
        notes = [
            _with_gravity(self.read, note, acting) if note == self.read.gravity_note else note
            for note in self.read.notes
        ]
        return tuple(filter(None, [*notes, not_simulated(self.read, self.asked)]))

    def _of_joints(self) -> tuple[Effect, ...]:
        if self.read is None or not self.asked:
            return ()
        from twolink.effects import of_urdf

        return of_urdf.effects_of(self.read, self.asked)


def in_plane(read: PlanarUrdf, effect: Effect) -> Effect | None:
    """Return gravity as it acts in the chain's plane: its component there, None if there is none.

    `read` is the file under standard gravity. Only gravity of the default direction is gravity of
    the world; with a direction of its own in the plane, and for other effects, the effect is
    returned as it is.
    """
    gravity: Any = type(effect)
    if (gravity.__module__, gravity.__name__) != EFFECTS["gravity"]:
        return effect
    share = read.gravity / STANDARD_GRAVITY
    given: Any = effect
    if share == 1 or not _are_parallel(given.direction, gravity().direction):
        return effect
    return gravity(given.g * share) if share else None


def _with_gravity(read: PlanarUrdf, note: str, acting: list[Any]) -> str:
    """Return the note on gravity with the components (m/s²) that act; empty if all of it acts."""
    components = [own.g for own in acting if own is not None]
    if not components:
        return note if acting else ""
    from twolink.urdf.plane import note_on_gravity

    return note_on_gravity(read.world_gravity, read.axes[2], sum(components))


def _are_parallel(one: Pair, other: Pair) -> bool:
    """Return whether two vectors, of any length, have one direction."""
    (x1, y1), (x2, y2) = one, other
    return bool(x1 * y2 == y1 * x2 and x1 * x2 + y1 * y2 > 0)


def not_simulated(read: PlanarUrdf, asked: tuple[str, ...]) -> str:
    """Return the sentence that properties of the file's joints do not act; empty if all do."""
    left = [name for name in JOINT_PROPERTIES if any(getattr(read, name)) and name not in asked]
    if not left:
        return ""
    plural = len(left) > 1 or left == ["limits"]
    words = ", ".join(f'"{name}"' for name in (*asked, *left))
    return (
        f"Of the URDF's joints, {_enumerated(left)} {'are' if plural else 'is'} not simulated;"
        f" effects = [{words}] in [chain] adds {'them' if plural else 'it'}."
    )


def _enumerated(words: list[str]) -> str:
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)
