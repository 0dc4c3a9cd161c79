"""Compilation ahead of use: what is requested, cancelled, and found."""

import os
import subprocess
import sys
import threading
from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest

from tests.simulation.hybrid import mode_of, system_of
from tests.simulation.hybrid.test_kind import Mutable, Wind
from twolink.chain import Chain
from twolink.contact.states import ContactState as S
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.gravity import Gravity
from twolink.effects.joint_stop import JointStop
from twolink.scene import Scene
from twolink.simulation.hybrid import ahead as ahead_module
from twolink.simulation.hybrid.ahead import Ahead
from twolink.simulation.hybrid.compile import Compiler, safe_order
from twolink.simulation.hybrid.configurations import configurations
from twolink.simulation.hybrid.kind import Kind, Target
from twolink.simulation.hybrid.measure import measured_run
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

    def begun_for(self, *targets):
        """Return requests for targets, of which the first is being compiled."""
        ahead = Ahead()
        ahead.expect(*targets)
        ahead.compiled(OPEN, OWN)
        assert self.begun.wait(10.0)
        return ahead

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
    with closing(Ahead()) as ahead:
        ahead.expect(OWN, JUDGE)
        ahead.compiled(OPEN, OWN)
        compilations.wait_for(1)
    assert (OPEN, OWN, False) in compilations.made
    assert compilations.ahead() == [(OPEN, JUDGE)]


def test_kinds_that_earlier_runs_have_entered_are_compiled_for_the_first_of_the_next_runs_first(
    compilations,
):
    compilations.may_go_on.set()
    with closing(Ahead()) as ahead:
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
    with closing(Ahead()) as ahead:
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
    with closing(compilations.begun_for(OWN, JUDGE)) as ahead:
        ahead.compiled(CLOSED, OWN)
        ahead.expect(LATER)
        compilations.may_go_on.set()
        compilations.wait_for(3)
    # That in progress is completed.
    assert compilations.ahead() == [(OPEN, JUDGE), (OPEN, LATER), (CLOSED, LATER)]


def test_the_end_of_the_context_cancels_requests_and_leaves_no_compilation(compilations):
    with closing(compilations.begun_for(JUDGE)) as ahead:
        ahead.compiled(CLOSED, OWN)
        assert compilations.ahead() == []
        threading.Timer(0.2, compilations.may_go_on.set).start()
    assert compilations.ahead() == [(OPEN, JUDGE)]
    assert not any(thread.name.startswith("compilation") for thread in threading.enumerate())


def test_kinds_that_others_cannot_find_or_may_not_need_are_not_requested(compilations):
    compilations.may_go_on.set()
    with closing(Ahead()) as ahead:
        ahead.expect(OWN, JUDGE)
        for effect in (Mutable(), Wind()):
            kind = OPEN._replace(effects=Content((effect,)))
            assert not kind.is_shared
            ahead.compiled(kind, OWN)
        ahead.compiled(OPEN._replace(optimised=True), OWN)
        assert OPEN.is_shared
        ahead.compiled(OPEN, OWN)
        compilations.wait_for(1)
    assert compilations.ahead() == [(OPEN, JUDGE)]


def test_a_compilation_that_fails_raises_where_the_mode_is_needed(monkeypatch):
    def failing(kind, target):
        raise ValueError("no code")

    monkeypatch.setattr(ahead_module, "compiled_kind", failing)
    with closing(Ahead()) as ahead:
        ahead.expect(JUDGE)
        for target in (OWN, JUDGE):
            with pytest.raises(ValueError, match="no code"):
                ahead.compiled(OPEN, target)


def test_a_thread_that_is_ended_keeps_no_run_waiting(monkeypatch):
    def ending(kind, target):
        if threading.get_ident() != HERE:
            raise SystemExit
        return "compiled here"

    monkeypatch.setattr(ahead_module, "compiled_kind", ending)
    with closing(Ahead()) as ahead:
        ahead.expect(JUDGE)
        for kind in (OPEN, CLOSED):
            assert ahead.compiled(kind, OWN) == "compiled here"
            assert ahead.compiled(kind, JUDGE) == "compiled here"


def test_a_cancelled_request_may_be_made_again(compilations):
    with closing(compilations.begun_for(JUDGE)) as ahead:
        ahead.compiled(CLOSED, OWN)
        ahead.expect(LATER)
        ahead.expect(JUDGE)
        compilations.may_go_on.set()
        compilations.wait_for(2)
    assert compilations.ahead() == [(OPEN, JUDGE), (CLOSED, JUDGE)]


@pytest.mark.parametrize("started", [False, True])
def test_where_no_thread_works_runs_compile_for_themselves(compilations, monkeypatch, started):
    """None can be started, or the context has ended."""

    def refuse(thread):
        raise RuntimeError("can't start new thread")

    ahead = Ahead()
    if not started:
        monkeypatch.setattr(threading.Thread, "start", refuse)
        ahead.expect(OWN, JUDGE)
    else:
        with closing(ahead):
            ahead.expect(OWN, JUDGE)
        ahead.expect(OWN, JUDGE)
    ahead.compiled(OPEN, OWN)
    ahead.compiled(OPEN, JUDGE)
    assert compilations.made == [(OPEN, OWN, False), (OPEN, JUDGE, False)]


SCRIPT = """
import heyoka, {module}, threading, time
from twolink import Chain, Scene, simulate
from twolink.effects.gravity import Gravity
from twolink.effects.joint_stop import JointStop

def motion():
    stop = JointStop("A", lower=-1.0, restitution=0.5)
    scene = Scene(Chain.uniform_bars(), (0.5, 0.2), (0.0, 0.0), 1.0, (Gravity(), stop))
    print(simulate(scene).met, flush=True)

{how}
"""
AT_EXIT = SCRIPT.format(module="atexit", how="atexit.register(motion)")
IN_THREAD = SCRIPT.format(
    module="atexit",
    how="threading.Thread(target=lambda: (time.sleep(0.5), motion())).start()",
)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("script", [AT_EXIT, IN_THREAD], ids=["at exit", "in a thread"])
def test_a_motion_is_simulated_while_the_interpreter_ends(script):
    """It accepts no more work for threads then."""
    found = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=False
    )
    assert found.stdout == "True\n"
    assert found.stderr == ""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system has no fork")
def test_a_child_that_is_forked_during_a_run_compiles_for_itself(compilations):
    """It has no copy of the thread, whose compilation never ends there."""
    with closing(compilations.begun_for(OWN, JUDGE)) as ahead:
        threading.Timer(0.2, compilations.may_go_on.set).start()
        # The fork waits for the compilation in progress.
        child = os.fork()
        if child == 0:
            ahead.compiled(CLOSED, OWN)
            ahead.compiled(CLOSED, JUDGE)
            ahead._thread._coming[OPEN, JUDGE] = threading.Event()
            ahead.compiled(OPEN, JUDGE)
            ahead.close()
            os._exit(42)
        assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 42
        assert compilations.ahead() == [(OPEN, JUDGE)]


def test_a_measured_run_requests_the_modes_of_its_judge(monkeypatch):
    """Which of them the thread has compiled when the judge needs them is a matter of time."""
    requested, taken = [], []

    def request(self, kind, target):
        requested.append((kind, target))
        _request(self, kind, target)

    def compiled(self, kind, target):
        taken.append((kind, target))
        return _compiled(self, kind, target)

    _request, _compiled = Ahead._request, Ahead.compiled
    monkeypatch.setattr(Ahead, "_request", request)
    monkeypatch.setattr(Ahead, "compiled", compiled)
    stop = JointStop("A", lower=-0.987, restitution=0.5)
    scene = Scene(Chain.uniform_bars(), (0.5, 0.2), (0.0, 0.0), 1.0, (Gravity(), stop))
    found = measured_run(scene, np.linspace(0, 1, 11), 1e-9, "lagrange", lambda name: None)
    _, judge = found.runs
    target = Target(judge.formulation, judge.precision, judge.order)
    kinds = {arc.compiled.kind for arc in judge.arcs}
    assert len(kinds) > 0
    for kind in kinds:
        assert (kind, target) in requested
        assert (kind, target) in taken


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
    rooted = system_of(CompliantSurface((0.0, 1.2), (0.0, -1.0), "hertz", 1000.0)).elements
    for accuracy in (1e-3, 1e-9, 1e-14):
        for found in configurations(accuracy):
            for order in (found.order, found.judging_order):
                assert safe_order(rooted, order) == order
