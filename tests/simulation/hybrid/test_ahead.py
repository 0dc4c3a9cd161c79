"""Compilation ahead of use: what is requested, cancelled, and found."""

import threading
from dataclasses import replace

import pytest

from tests.simulation.hybrid import mode_of, system_of
from twolink.contact.states import ContactState as S
from twolink.effects.gravity import Gravity
from twolink.effects.joint_stop import JointStop
from twolink.simulation.hybrid import ahead as ahead_module
from twolink.simulation.hybrid.ahead import Ahead
from twolink.simulation.hybrid.compile import Compiler, Kind, Target
from twolink.simulation.hybrid.configurations import configurations
from twolink.values import Content

OWN = Target("lagrange", "double", 15)
JUDGE = Target("kane", "long double", 21)
LATER = Target("kane", "quadruple", 25)
HERE = threading.get_ident()


EFFECTS = Gravity(), JointStop("A", lower=-1.0)


def kind_of(*states):
    system = system_of(*EFFECTS)
    chain = Content((system.scene_chain,))
    return Kind(chain, system.content, mode_of(system, *states).kind, (), optimised=False)


OPEN, CLOSED = kind_of(S.OPEN), kind_of(S.CLOSED)


class Compilations:
    """A compiler that notes the thread of each compilation, and waits for permission elsewhere."""

    def __init__(self):
        self.made, self.may_go_on, self.begun = [], threading.Event(), threading.Event()

    def __call__(self, kind, target):
        is_ahead = threading.get_ident() != HERE
        if is_ahead:
            self.begun.set()
            assert self.may_go_on.wait(10.0)
        self.made.append((kind, target, is_ahead))
        return len(self.made)

    def ahead(self):
        return [(kind, target) for kind, target, is_ahead in self.made if is_ahead]

    def wait_for(self, count):
        for _ in range(1000):
            if len(self.ahead()) >= count:
                return
            threading.Event().wait(0.01)
        raise AssertionError(f"{count} compilations ahead were expected, and {self.made} made")


@pytest.fixture
def compilations(monkeypatch):
    found = Compilations()
    monkeypatch.setattr(ahead_module, "compiled_kind", found)
    yield found
    found.may_go_on.set()


def test_a_kind_that_a_run_enters_is_compiled_for_its_judge_in_the_thread(compilations):
    compilations.may_go_on.set()
    with Ahead() as ahead:
        ahead.expect(OWN, JUDGE)
        ahead.compiled(OPEN, OWN)
        compilations.wait_for(1)
    assert (OPEN, OWN, False) in compilations.made
    assert compilations.ahead() == [(OPEN, JUDGE)]


def test_kinds_that_earlier_runs_have_entered_are_compiled_for_the_first_of_the_next_runs_first(
    compilations,
):
    compilations.may_go_on.set()
    with Ahead() as ahead:
        ahead.compiled(OPEN, OWN)
        ahead.compiled(CLOSED, OWN)
        assert compilations.ahead() == []
        ahead.expect(JUDGE, LATER)
        compilations.wait_for(4)
    assert compilations.ahead() == [
        (OPEN, JUDGE),
        (CLOSED, JUDGE),
        (OPEN, LATER),
        (CLOSED, LATER),
    ]


def test_a_run_waits_for_the_compilation_in_progress_and_makes_those_not_begun(compilations):
    with Ahead() as ahead:
        ahead.expect(OWN, JUDGE)
        ahead.compiled(OPEN, OWN)
        ahead.compiled(CLOSED, OWN)
        assert compilations.begun.wait(10.0)
        ahead.compiled(CLOSED, JUDGE)
        assert (CLOSED, JUDGE, False) in compilations.made
        threading.Timer(0.1, compilations.may_go_on.set).start()
        ahead.compiled(OPEN, JUDGE)
        # The cache of `compiled_kind` returns the one that the thread has made.
        assert compilations.made.index((OPEN, JUDGE, True)) < compilations.made.index(
            (OPEN, JUDGE, False)
        )
    assert compilations.ahead() == [(OPEN, JUDGE)]


def test_nothing_more_is_compiled_for_runs_that_are_not_expected(compilations):
    with Ahead() as ahead:
        ahead.expect(OWN, JUDGE)
        ahead.compiled(OPEN, OWN)
        assert compilations.begun.wait(10.0)
        ahead.compiled(CLOSED, OWN)
        ahead.expect(LATER)
        compilations.may_go_on.set()
        compilations.wait_for(3)
    # That in progress is completed.
    assert compilations.ahead() == [(OPEN, JUDGE), (OPEN, LATER), (CLOSED, LATER)]


def test_the_end_of_the_context_cancels_and_does_not_wait(compilations):
    with Ahead() as ahead:
        ahead.expect(JUDGE)
        ahead.compiled(OPEN, OWN)
        assert compilations.begun.wait(10.0)
        ahead.compiled(CLOSED, OWN)
    assert compilations.ahead() == []
    compilations.may_go_on.set()
    compilations.wait_for(1)
    ahead._thread.shutdown(wait=True)
    assert compilations.ahead() == [(OPEN, JUDGE)]


class Mutable:
    """Not a value: another run may find it changed."""


def test_kinds_that_others_cannot_find_or_may_not_need_are_not_requested(compilations):
    compilations.may_go_on.set()
    own = replace_effects(OPEN, Mutable())
    optimised = OPEN._replace(optimised=True)
    assert OPEN.is_shared
    assert not own.is_shared
    with Ahead() as ahead:
        ahead.expect(OWN, JUDGE)
        ahead.compiled(own, OWN)
        ahead.compiled(optimised, OWN)
        ahead.compiled(OPEN, OWN)
        compilations.wait_for(1)
    assert compilations.ahead() == [(OPEN, JUDGE)]


def replace_effects(kind, *effects):
    return kind._replace(effects=Content(effects))


def test_a_compilation_that_fails_raises_where_the_mode_is_needed(monkeypatch):
    def failing(kind, target):
        raise ValueError("no code")

    monkeypatch.setattr(ahead_module, "compiled_kind", failing)
    with Ahead() as ahead:
        ahead.expect(JUDGE)
        for target in (OWN, JUDGE):
            with pytest.raises(ValueError, match="no code"):
                ahead.compiled(OPEN, target)


def test_the_key_of_a_kind_is_the_same_in_every_precision():
    """Otherwise judges would not find the code that is compiled for them."""
    asked = []

    def compiled(kind, target):
        asked.append((kind, target))
        return ahead_module.compiled_kind(kind, target)

    for precision in ("double", "long double", "quadruple"):
        system = replace(system_of(*EFFECTS, precision=precision), order=25)
        Compiler("kane", compiled).mode(system, mode_of(system, S.CLOSED))
    assert len({kind for kind, _ in asked}) == 1
    assert [target.precision for _, target in asked] == ["double", "long double", "quadruple"]


def test_the_orders_of_runs_and_judges_are_safe_for_every_law():
    """Otherwise `safe_order` would change them, and judges would not find their code."""
    for accuracy in (1e-3, 1e-9, 1e-14):
        for found in configurations(accuracy):
            assert found.order % 5 != 4
            assert found.judging_order % 5 != 4
