"""Compiled modes: where their event functions are, and their copies for other directions."""

from dataclasses import replace

import numpy as np

from tests.simulation.hybrid import BALANCED, system_of
from tests.simulation.hybrid.test_compile import FLOOR, compiled
from twolink.contact.states import ContactState as S
from twolink.contact.states import EventKind as E
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.simulation.hybrid.compiled import Watched
from twolink.simulation.hybrid.mode import Trigger


def test_the_layout_locates_the_event_functions():
    """A gap is a variable; the force of a contact that rests is known by an integral."""
    system = system_of(Gravity(), FLOOR)
    mode = compiled(system, S.OPEN, S.CLOSED)
    triggers, variables, is_plain, reverse = mode.layout
    assert [trigger.kind for trigger in triggers] == [E.HITS, E.LEAVES]
    assert variables == slice(4, 6)
    assert not is_plain
    assert [watched.integral for watched in mode.watched] == [False, True]
    assert reverse == frozenset()
    free = compiled(system, S.OPEN, S.OPEN)
    assert free.layout.is_plain
    assert not any(watched.integral for watched in free.watched)


def test_the_terms_give_the_coefficients_of_the_event_functions():
    """A gap is a variable, a force the derivative of one, and a slide backward its negative."""
    system = system_of(Gravity(), FLOOR)
    mode = compiled(system, S.OPEN, S.CLOSED)
    assert not mode.layout.is_plain
    assert compiled(system, S.OPEN, S.OPEN).layout.is_plain
    watched = tuple(
        replace(w, variable=place, factor=factor)
        for w, place, factor in zip(mode.watched, (2, 0), (-1.0, 1.0), strict=True)
    )
    places, factors = replace(mode, watched=watched).terms(4, np.dtype(np.longdouble))
    coefficients = np.arange(12.0).reshape(3, 4)
    found = coefficients.reshape(-1)[places] * factors
    assert found.tolist() == [[-8, -9, -10, -11], [1, 2 * 2, 3 * 3, 0]]
    assert factors.dtype == np.longdouble
    assert mode.terms(4, np.dtype(float)) is mode.terms(4, np.dtype(float))


def test_only_a_mode_whose_event_functions_are_variables_shows_its_events():
    system = system_of(Gravity(), FLOOR)
    assert compiled(system, S.OPEN, S.OPEN).shows_events
    assert not compiled(system, S.OPEN, S.CLOSED).shows_events
    assert not compiled(system_of(Gravity())).shows_events


def test_a_mode_turned_backward_has_the_negative_speeds_of_its_slides():
    """Those of elements that stick are as they were, and so are all other event functions."""
    system = system_of(JointFriction((0.6, 0.2)), Gravity(), chain=BALANCED)
    mode = compiled(system, S.FORWARD, S.FORWARD)
    turned = mode.turned((S.FORWARD, S.BACKWARD))
    assert turned is mode.turned((S.FORWARD, S.BACKWARD)) is not mode
    assert mode.turned((S.FORWARD, S.FORWARD)) is mode
    (first, second), (same, other) = mode.watched, turned.watched
    assert same == first
    assert other == replace(second, trigger=Trigger(E.STOPS, 1, -1), factor=-1.0)
    assert turned.layout.reversed == {1}
    assert turned.pool is mode.pool


def test_variables_that_do_not_follow_each_other_are_an_array():
    system = system_of(Gravity(), FLOOR)
    mode = compiled(system, S.OPEN, S.OPEN)
    trigger = mode.watched[0].trigger
    apart = replace(mode, watched=tuple(Watched(trigger, k, 1.0, False) for k in (2, 5)))
    assert apart.layout.variables.tolist() == [2, 5]
    assert apart.falling == (2, 5)
