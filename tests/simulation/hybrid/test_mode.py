"""Modes, events and impacts as data, and their words."""

from dataclasses import replace

import pytest

from twolink.contact.force_laws import Phase, PlasticState
from twolink.contact.impact_laws import Regime
from twolink.contact.states import ContactState as S
from twolink.contact.states import EventKind
from twolink.simulation.hybrid.mode import (
    Event,
    Impact,
    Leaving,
    Mode,
    Remark,
    Trigger,
    doubt_of_change,
    doubt_of_rate,
    sentences,
)

DENT = PlasticState(Phase.DENTED, 3.0, 0.25, 0.5)
MODE = Mode(("A", "D on floor", "B on wall"), (S.STICKS, S.FORWARD, S.OPEN))
DENTED = Mode(("A", "D on steel"), (S.STICKS, S.CLOSED), (None, DENT))

IMPACT = Impact(
    time=1.5, index=0, name="D on floor", speeds=(-2.0, 1.0), sliding=(0.5, 0.25),
    normal_impulse=3.0, tangential_impulse=-1.0, regime=Regime.SLIDES, u=((1.0, 0.0), (0.5, 0.0)),
    kinetic_energy=(4.0, 3.0), link_energies=((3.0, 1.0), (2.0, 1.0)),
)  # fmt: skip


def test_a_mode_gives_the_state_of_an_element_by_name():
    assert MODE["D on floor"] is S.FORWARD
    with pytest.raises(ValueError, match="not in tuple"):
        MODE["C"]


def test_the_text_of_a_mode_omits_free_elements():
    assert str(MODE) == "A sticks, D on floor slips forward"
    assert str(Mode(("A",), (S.OPEN,))) == "moves freely"
    assert str(DENTED) == "A sticks, D on steel rests and is in its dent"
    whole = Mode(("D on steel",), (S.CLOSED,), (PlasticState(Phase.WHOLE),))
    assert str(whole) == "D on steel rests"


def test_modes_of_one_kind_differ_in_the_numbers_of_their_dents_only():
    assert DENTED.numbers == (3.0, 0.25, 0.5)
    other = DENTED.with_numbers((7.0, 8.0, 9.0))
    assert other.dent(1) == PlasticState(Phase.DENTED, 7.0, 8.0, 9.0)
    assert other != DENTED
    assert other.kind == DENTED.kind
    assert hash(other.kind) == hash(DENTED.kind)
    again = replace(DENTED, dents=(None, PlasticState(Phase.FLOWS)))
    assert again.kind != DENTED.kind


def test_a_mode_that_slides_backward_is_of_the_kind_of_the_forward_one():
    back = replace(MODE, states=(S.PRESSED_BACKWARD, S.BACKWARD, S.OPEN))
    assert back.kind == replace(MODE, states=(S.PRESSED_FORWARD, S.FORWARD, S.OPEN))
    assert replace(DENTED, states=(S.BACKWARD, S.CLOSED)).kind.numbers == (0.0, 0.0, 0.0)


def test_a_mode_without_dents_is_its_own_kind():
    assert MODE.kind is MODE
    assert MODE.numbers == ()
    assert MODE.dent(1) is None


def test_a_mode_in_floats_has_no_dent_that_no_point_lies_in():
    away = replace(DENTED, states=(S.STICKS, S.OPEN))
    assert away.in_floats.dents == (None, None)
    assert DENTED.in_floats.dents == (None, DENT)
    assert MODE.in_floats is MODE


def test_the_description_of_an_event_is_its_mode():
    assert Event(1.0, MODE, 1.0).description == "A sticks, D on floor slips forward"
    assert Trigger(EventKind.HITS, 2) == Trigger(EventKind.HITS, 2, 0)


def test_an_impact_has_its_energy_change_and_a_description():
    assert IMPACT.energy_change == -1.0
    assert not IMPACT.creates_energy
    assert IMPACT.description == "D hits floor: normal speed −2 → 1, slides, energy −1 J"


def test_an_impact_that_creates_energy_is_described_as_such():
    gaining = replace(IMPACT, kinetic_energy=(3.0, 4.0))
    assert gaining.creates_energy
    assert gaining.description.endswith("; this law of restitution creates energy here")
    rounded = replace(IMPACT, kinetic_energy=(3.0, 3.0 + 4e-16))
    assert not rounded.creates_energy


def test_bounces_that_are_summed_up_create_no_energy():
    last = replace(IMPACT, regime=Regime.BOUNCES_DIE_AWAY, kinetic_energy=(3.0, 4.0))
    assert not last.creates_energy
    assert last.description == "D on floor: the remaining bounces (below 2) end here"


def test_remarks_of_one_kind_are_one_sentence():
    many = [Remark("bounces of D", t, f"From {t} s on bounces are left out.") for t in (1, 2, 4.5)]
    other = Remark("choice", 3.0, "At 3 s there is a choice.")
    assert sentences([many[0], other, *many]) == (
        "From 1 s on bounces are left out. This happens 2 more times until 4.5 s.",
        "At 3 s there is a choice.",
    )
    assert sentences(many[:2]) == (
        "From 1 s on bounces are left out. This happens 1 more time until 2 s.",
    )
    assert sentences([]) == ()


def test_the_remark_of_the_largest_change_is_the_one_that_is_shown():
    changes = {1.0: 1e-7, 2.5: 3.0, 4.0: 0.2}
    given = [Remark("order", t, f"At {t} s u changes by {x}.", x) for t, x in changes.items()]
    assert sentences(given) == (
        "At 2.5 s u changes by 3.0. This happens 2 more times from 1 s until 4 s.",
    )


def test_a_change_goes_on_as_by_the_worst_of_several_modes():
    every = Leaving(0.0, 3.0, 5.0), Leaving(2.0, 1.0, 2.0), Leaving(0.0, 9.0, 9.0)
    assert Leaving.worst(every) == (2.0, 1.0, 9.0)


def test_only_a_doubt_that_leaves_out_an_acceleration_goes_on_in_other_modes():
    trigger, later = Trigger(EventKind.BREAKS, 0, 1), Leaving(2.0, 1.0, 2.0)
    doubt = doubt_of_rate(1.0, trigger, 1e-9, Leaving(0.0, 3.0, 5.0))
    moved = doubt.since(2.0, later)
    assert not doubt.may_be_endless
    assert moved.may_be_endless
    assert moved.later == ((2.0, later),)
    # It goes on as before.
    assert moved.since(3.0, later) == moved
    assert doubt.since(0.5, later) == doubt.since(1.0, later) == doubt
    other = doubt_of_change(1.0, trigger, 1e-9)
    assert other.since(2.0, later) == other
