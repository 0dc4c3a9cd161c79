"""The runs of a smooth scene: one after the other, or side by side."""

from dataclasses import replace
from threading import current_thread

import numpy as np
import pytest

from twolink.chain import Chain
from twolink.effects.gravity import Gravity
from twolink.scene import Scene
from twolink.simulation.smooth import runs as module
from twolink.simulation.smooth.runs import Runs
from twolink.simulation.smooth.taylor import taylor_run

TIMES = np.linspace(0, 10, 41)
SCENE = Scene(Chain.uniform_bars(), (0.3, -0.4), (0.1, 0.2), 10.0, (Gravity(),))


@pytest.mark.parametrize(("precision", "threads"), [("double", 1), ("quadruple", 2)])
def test_two_runs_in_113_bits_are_made_in_two_threads(monkeypatch, precision, threads):
    """They are those that are made one after the other, to the last bit."""
    used = set()

    def made(*given, **options):
        used.add(current_thread())
        return taylor_run(*given, **options)

    monkeypatch.setattr(module, "taylor_run", made)
    short, times = replace(SCENE, duration=0.2), np.linspace(0.0, 0.2, 5)
    runs = Runs(short, times, "momenta", lambda name: lambda share: None, 0.1)
    *found, apart = runs.pair(precision, (21, 25))
    assert len(used) == threads
    assert (current_thread() in used) == (threads == 1)
    assert len(runs.made) == 2
    for order, run in zip((21, 25), found, strict=True):
        alone = taylor_run(
            short, times, formulation="momenta", precision=precision, order=order, longest_step=0.1
        )
        assert run is runs.known[precision, order]
        assert run.order == order
        assert np.array_equal(run.q, alone.q)
        assert np.array_equal(run.u, alone.u)
    first, second, again = runs.pair(precision, (21, 25))
    assert [first, second] == found
    ends = np.array([0.1, 0.2])
    assert np.array_equal(again.until(ends), apart.until(ends))


@pytest.mark.parametrize(
    ("precision", "known", "ahead"),
    [("double", (), [15]), ("double", (11,), []), ("quadruple", (), [])],
)
def test_the_second_of_two_runs_is_compiled_beside_the_first(monkeypatch, precision, known, ahead):
    """Runs in 113 bits have a thread each."""
    requested = []
    runs = Runs(replace(SCENE, duration=0.2), np.linspace(0.0, 0.2, 5), "momenta",
                lambda name: lambda share: None, 0.1)  # fmt: skip
    for order in known:
        runs.run(precision, order)
    monkeypatch.setattr(runs, "expect", lambda precision, order: requested.append(order))
    runs.pair(precision, (11, 15))
    assert requested == ahead


@pytest.mark.parametrize(("precision", "orders"), [("double", (9, 13)), ("quadruple", (25, 29))])
def test_two_runs_are_compared_in_each_step(precision, orders):
    """The tip of a light first link turns back in a thousandth of a swing."""
    whip = Scene(Chain.point_masses((1e-3, 1.0), (1.0, 1.0)), (0.3, 2.5), (0.0, 0.0), 2.4,
                 (Gravity(),))  # fmt: skip
    runs = Runs(whip, np.linspace(0.0, 2.4, 5), "momenta", lambda name: lambda share: None, 0.1)
    first, second, common = runs.pair(precision, orders)
    assert common.resolves(first.visited)
    # Where one was made before the ends of the other's steps were known, it is made again.
    assert len(runs.made) == (2 if precision == "double" else 4)
    shortest = np.diff(first.visited.ends).min()
    assert shortest < 0.02 * np.diff(first.visited.ends).max()
    compared = np.unique(np.concatenate([common.times, common.ends]))
    assert np.diff(compared).min() <= shortest
    seen = np.abs(first.visited.at_ends.astype(float)).max()
    assert seen > 3 * max(np.abs(first.q.astype(float)).max(), np.abs(first.u.astype(float)).max())
    for run in (first, second):
        assert run.q.shape == (2, 5)


@pytest.mark.parametrize("resolved_after", [1, 2, None])
def test_a_difference_is_unknown_where_runs_are_never_compared_in_each_step(
    monkeypatch, resolved_after
):
    asked = []

    def resolves(common, run):
        asked.append(run)
        return len(asked) == resolved_after

    monkeypatch.setattr(module.Common, "resolves", resolves)
    runs = Runs(replace(SCENE, duration=0.2), np.linspace(0.0, 0.2, 5), "momenta",
                lambda name: lambda share: None, 0.1)  # fmt: skip
    *pair, common = runs.pair("double", (9, 13))
    assert np.isfinite(common.until(np.array([0.2]))).all() == (resolved_after is not None)
    # The pair that is returned is the last one that was made.
    assert pair == runs.made[-2:]
    assert len(asked) == (resolved_after or 3)


def test_runs_visit_the_ends_of_the_last_one_in_double_precision():
    runs = Runs(SCENE, TIMES, "momenta", lambda name: lambda share: None, 0.1)
    first, second = (runs.run("double", order) for order in (9, 13))
    assert set(first.visited.ends) <= set(second.visited.times)
    third = runs.new("quadruple", 25)
    middles = (second.visited.ends[1:] + second.visited.ends[:-1]) / 2
    assert {*second.visited.ends, *middles} <= set(third.visited.times)


def test_an_interrupted_run_in_113_bits_ends_the_other():
    def interrupting(share):
        raise ZeroDivisionError

    runs = Runs(SCENE, TIMES, "momenta", lambda name: interrupting, 1.0)
    with pytest.raises(ZeroDivisionError):
        runs.pair("quadruple", (31, 35))
    assert not runs.known
