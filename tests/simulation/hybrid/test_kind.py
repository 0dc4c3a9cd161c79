"""Kinds of modes: which of them may be compiled in another thread, and found by later runs."""

from dataclasses import dataclass

from tests.simulation.hybrid import mode_of, system_of
from twolink.contact.states import ContactState as S
from twolink.effects.effect import Effect
from twolink.effects.gravity import Gravity
from twolink.effects.joint_stop import JointStop
from twolink.simulation.hybrid.kind import Kind
from twolink.values import Content


@dataclass(frozen=True)
class Wind(Effect):
    """An effect of the user: a value, whose code may need the thread of the run."""

    def loads(self, chain, q, u, t):
        return ()


class Mutable:
    """Not a value: another run may find it changed."""


def kind_of(*effects):
    """Return the kind of a mode of free motion, or of a chain of other effects."""
    system = system_of(Gravity(), JointStop("A", lower=-1.0))
    effects = Content(effects) if effects else system.content
    mode = mode_of(system, S.OPEN).kind
    return Kind(Content((system.scene_chain,)), effects, mode, (), optimised=False)


def test_kinds_of_built_in_values_are_shared():
    assert kind_of().is_shared
    assert kind_of() == kind_of()
    assert len({kind_of(), kind_of()}) == 1


def test_kinds_with_effects_of_the_user_or_that_may_change_are_not_shared():
    assert not kind_of(Wind()).is_shared
    assert not kind_of(Mutable()).is_shared
    assert not kind_of(Gravity(), Mutable()).is_shared
    assert kind_of(Gravity()).is_shared
