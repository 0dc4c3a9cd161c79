"""Why the laws admit no motion, in sentences."""

import math

import pytest

from tests.simulation.hybrid import state_of, system_of
from twolink.effects.gravity import Gravity
from twolink.effects.joint_stop import JointStop
from twolink.effects.surface import Surface
from twolink.simulation.hybrid.no_motion import sentence_on, sentence_on_endless
from twolink.simulation.hybrid.select import select

BELOW, ABOVE = (0.0, 1.0), (0.0, -1.0)
LEFT, RIGHT = (-1.0, 0.0), (1.0, 0.0)

# A chain folded at 1.1 rad, one that stands on a horizontal link 1, and a horizontal one.
FOLDED, STANDS, LIES = (1.1, 1.1 + math.pi), (0.0, math.pi / 2), (0.0, 0.0)


def on_contacts(*effects, q, u=(0.0, 0.0)):
    """Return a chain that touches all of its contacts."""
    system = system_of(*effects)
    touching = frozenset(i for i, e in enumerate(system.elements) if e.normal is not None)
    state = state_of(system, q, u)._replace(touching=touching)
    return system, state, system.pose(state.q)


@pytest.mark.parametrize(
    ("effects", "q", "u", "cause"),
    [
        ([Surface((2.0, 0.0), LEFT)], LIES, (0.0, 0.0), "D on surface is wedged: in this"),
        (
            [JointStop("A", upper=0.0), Surface((1.0, 1.0), BELOW)], STANDS, (0.0, 2.0),
            "wedged between A on its upper stop and D on surface: the links turn",
        ),
        ([Surface((0.0, 0.0), ABOVE, friction=0.5)], FOLDED, (1.0, 1.0), "D on surface is pinned"),
        (
            [JointStop("A", upper=0.0), JointStop("A", lower=0.0)], (0.0, 1.0), (0.0, 0.0),
            "allow no motion; elements in contact: A on its upper stop, A on its lower stop",
        ),
    ],
)  # fmt: skip
def test_the_cause_is_named(effects, q, u, cause):
    sentence = sentence_on(*on_contacts(*effects, q=q, u=u))
    assert sentence.startswith("at 0 s ")
    assert cause in sentence


def test_modes_without_end_of_a_chain_that_turns_about_its_end_have_that_cause():
    contact = Surface((0.0, 0.0), ABOVE, friction=0.5)
    for q, words in [
        (
            FOLDED,
            "at 0 s the folded links can turn together about A, and the laws do not",
        ),
        (LIES, "modes follow each other without end at 0 s: slides, then rests"),
    ]:
        system, state, _ = on_contacts(contact, q=q)
        assert words in sentence_on_endless(system, state, "slides, then rests")


def test_a_link_that_only_a_grip_could_hold_is_refused():
    """Link 1 stands between walls, and link 2 could fall only through one of them.

    The end of link 2, which is level, moves up or down at first, and then into its wall. The walls
    could press on the chain with any force, and friction hold link 2.
    """
    walls = (
        Surface((0.0, -0.5), LEFT, on=("C1",), friction=0.5, name="left"),
        Surface((1.0, -1.0), RIGHT, on=("D",), friction=1.0, name="right"),
    )
    system, state, pose = on_contacts(Gravity(), *walls, q=(-math.pi / 2, 0.0))
    assert select(system, state, pose, {}) is None
    assert "only contacts that press against each other" in sentence_on(system, state, pose)
    # Without the left wall it falls.
    system, state, pose = on_contacts(Gravity(), walls[1], q=(-math.pi / 2, 0.0))
    assert select(system, state, pose, {}) is not None
