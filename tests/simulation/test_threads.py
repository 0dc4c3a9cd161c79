"""Threads and processes: parallel runs give the same bits as sequential ones."""

import functools
import gc
import multiprocessing
import sys
import threading
from collections import Counter
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest

from twolink.accuracy.reference import reference
from twolink.chain import Chain
from twolink.data import data_path
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.optional import heyoka
from twolink.scene import Scene
from twolink.simulation import pool, simulate
from twolink.simulation.pool import IntegratorPool
from twolink.urdf import read_planar_urdf
from twolink.verification import verify

THREADS = 8
SMOOTH = Scene(Chain.uniform_bars(), (0.3, 0.5), (0.0, 0.0), 20.0, (Gravity(),), accuracy=1e-6)
EVENTS = replace(
    SMOOTH,
    duration=2.0,
    effects=(Gravity(), JointFriction((0.1, 0.1)), JointStop("B", -1.0, 1.0, 0.5)),
)


@pytest.fixture(autouse=True)
def switching_often():
    """Let threads take turns a thousand times as often as usual."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(5e-6)
    yield
    sys.setswitchinterval(before)


def side_by_side(function, arguments):
    with ThreadPoolExecutor(THREADS) as threads:
        return list(threads.map(function, arguments))


def starts(scene, count=16):
    """Return scenes that share compiled code, and differ in their start."""
    return [replace(scene, q=(0.3 + 0.01 * k, 0.5), u=(0.2, -0.1 * k)) for k in range(count)]


def bits(started):
    """All numbers of a simulation; at the top level, so that processes can call it."""
    found = simulate(started)
    return found.q.tobytes() + found.u.tobytes(), found.error, found.notes


@pytest.mark.slow
@pytest.mark.parametrize("scene", [SMOOTH, EVENTS], ids=["smooth", "events"])
def test_simulations_race(scene):
    scenes = starts(scene)
    assert side_by_side(bits, scenes) == [bits(started) for started in scenes]


@pytest.mark.parametrize("scene", [SMOOTH, EVENTS], ids=["smooth", "events"])
def test_dense_output_races(scene):
    found = simulate(scene)
    times = [np.linspace(0, 0.1 * k, 50) for k in range(1, 17)]

    def bits(moments):
        q, u = found.at(moments)
        return q.tobytes() + u.tobytes()

    assert side_by_side(bits, times) == [bits(moments) for moments in times]


@pytest.mark.slow
def test_verifications_race():
    read = read_planar_urdf(data_path("twolink.urdf"))

    def verdict(seed):
        return verify(read, states=50, seed=seed).comparisons

    assert side_by_side(verdict, range(8)) == [verdict(seed) for seed in range(8)]


@pytest.mark.slow
def test_references_race():
    short = [replace(scene, duration=0.2) for scene in starts(SMOOTH, 4) + starts(EVENTS, 4)]

    def states(scene):
        return reference(scene, 20).states

    assert side_by_side(states, short) == [states(scene) for scene in short]


def test_a_run_inside_the_progress_of_another():
    """A callback may simulate the very scene that is on its way."""
    scene, expected = replace(EVENTS, duration=1.0), []

    def progress(stage, share):
        if len(expected) < 3:
            expected.append(simulate(replace(scene, q=(0.1, 0.9))).q.tobytes())

    found = simulate(scene, progress=progress)
    assert expected
    assert found.q.tobytes() == simulate(scene).q.tobytes()
    assert set(expected) == {simulate(replace(scene, q=(0.1, 0.9))).q.tobytes()}


@pytest.mark.slow_but_first
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
@pytest.mark.parametrize(
    ("start", "count"), [("fork", 16), pytest.param("spawn", 4, marks=pytest.mark.slow)]
)
@pytest.mark.parametrize("scene", [SMOOTH, EVENTS], ids=["smooth", "events"])
def test_processes_compute_the_same_bits(scene, start, count):
    """The parent has used its integrators, of which forked children have copies."""
    scenes = starts(scene, count)
    expected = [bits(started) for started in scenes]
    context = multiprocessing.get_context(start)
    with ProcessPoolExecutor(4, context) as processes:
        assert list(processes.map(bits, scenes)) == expected
    assert [bits(started) for started in scenes[:2]] == expected[:2]


def test_a_fork_inside_the_progress_of_a_run():
    """The integrator is in use when the child gets its copy; both go on by themselves."""
    scene, other, found = replace(EVENTS, duration=1.0), replace(EVENTS, q=(0.1, 0.9)), []

    def progress(run, share):
        if not found:
            with ProcessPoolExecutor(1, multiprocessing.get_context("fork")) as processes:
                found.append(processes.submit(bits, other).result(timeout=60))

    simulate(scene, progress=progress)
    assert found == [bits(other)]


def integrators_in(roots):
    """Return the integrators that are reachable from objects, each with its owner."""
    hy = heyoka()
    kinds = (hy.taylor_adaptive_dbl, hy.taylor_adaptive_ldbl, hy.taylor_adaptive_f128)
    seen, waiting, found = set(), list(roots), []
    while waiting:
        owner = waiting.pop()
        for thing in gc.get_referents(owner):
            if isinstance(thing, kinds):
                found.append((owner, thing))
            elif id(thing) not in seen and not isinstance(thing, (type(sys), type)):
                seen.add(id(thing))
                waiting.append(thing)
    return found


def module_state():
    """Return the values that outlive a run: variables of all modules of twolink, and caches."""
    return [
        value
        for name, module in list(sys.modules.items())
        if name.partition(".")[0] == "twolink"
        for value in vars(module).values()
        if isinstance(value, (dict, list, tuple, set, functools._lru_cache_wrapper))
        or type(value).__module__.startswith("twolink")
    ]


def owners_of_integrators():
    """Return the types of the owners of integrators that outlive a run."""
    pools = [thing for thing in gc.get_objects() if isinstance(thing, IntegratorPool)]
    lendable = {id(integrator) for _, integrator in integrators_in(pools)}
    found = integrators_in(module_state())
    assert len(found) > 2
    return {"a pool" if id(one) in lendable else repr(owner)[:100] for owner, one in found}


@pytest.mark.slow
def test_no_integrator_is_shared_between_runs(monkeypatch):
    """The property on which interpreters without a global lock rely, too.

    Everything that outlives a run and has an integrator is an `IntegratorPool`: it lends each copy
    to one run at a time, by `list.pop` and `list.append`, which are atomic in each build of Python
    (free-threaded ones lock each list). This interpreter may have a global lock, so a race without
    one is not run here; which integrators are shared does not depend on it.
    """
    for scene in (SMOOTH, EVENTS):
        simulate(scene)
    assert owners_of_integrators() == {"a pool"}
    x = heyoka().make_vars("x")
    monkeypatch.setattr(pool, "SHARED", [heyoka().taylor_adaptive([(x, x)], [1.0])], raising=False)
    assert len(owners_of_integrators()) == 2


@pytest.mark.slow
def test_no_integrator_is_lent_twice_at_a_time(monkeypatch):
    """And the one from which copies are made has no user at all."""
    lock, held, most = threading.Lock(), Counter(), Counter()
    lend = IntegratorPool.lend

    @contextmanager
    def counted(lender):
        with lend(lender) as integrator:
            assert integrator is not lender.original
            with lock:
                held[id(integrator)] += 1
                most["of one"] = max(most["of one"], held[id(integrator)])
                most["of all"] = max(most["of all"], sum(held.values()))
            yield integrator
            with lock:
                held[id(integrator)] -= 1

    monkeypatch.setattr(IntegratorPool, "lend", counted)
    side_by_side(bits, starts(EVENTS))
    assert most["of one"] == 1
    assert most["of all"] > 1
