"""The limits of work of a run, and the work that it takes."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.simulation.hybrid import BARS
from tests.simulation.hybrid.test_run import BOUNCES, ONTO, scene
from twolink.chain import Chain
from twolink.contact.states import ContactState as S
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.effects.pd_control import PdControl
from twolink.effects.surface import Surface
from twolink.errors import IntegrationError
from twolink.integration.precisions import PRECISIONS
from twolink.limits import DEFAULT_LIMITS, UNLIMITED
from twolink.scene import Scene
from twolink.simulation.hybrid import effort as effort_module
from twolink.simulation.hybrid import history as history_module
from twolink.simulation.hybrid.effort import Effort, Work, effort_of, most_work
from twolink.simulation.hybrid.run import hybrid_run


@pytest.mark.parametrize("effort", [Effort(jumps=3), Effort(work=320), Effort(steps=30)])
def test_a_run_ends_where_it_exceeds_its_effort(effort):
    with pytest.raises(IntegrationError, match=r"modes by .* s, and is not followed further"):
        hybrid_run(BOUNCES, [0.0, 4.0], effort=effort)
    run = hybrid_run(BOUNCES, [0.0, 4.0], effort=effort, partial=True)
    assert run.exhausted
    assert 0 < run.reached <= 3
    assert "is not followed further within the limit of work (--force lifts it" in run.failure
    assert "in Python): moves freely, then" in run.failure


def test_the_limits_of_work_grow_from_short_to_long_motions():
    def effort(precision, duration):
        return effort_of(precision, duration, DEFAULT_LIMITS)

    found = {t: effort("long double", t).work for t in (0.5, 3.0, 4.5, 6.0, 1e3)}
    assert found == {0.5: 35_000, 3.0: 35_000, 4.5: 112_500, 6.0: 190_000, 1e3: 190_000}
    assert [effort("double", t).work for t in (0.1, 1e3)] == [32_812.5, 178_125]
    assert [effort("quadruple", t).jumps for t in (1.0, 1e3)] == [1_500, 2_250]
    assert [effort("quadruple", t).steps for t in (1.0, 1e3)] == [6_000, 9_000]
    assert [most_work(t) for t in (1.0, 4.0, 1e3)] == [6_000, 7_000, 9_000]


def test_runs_in_vain_leave_less_work_to_others():
    """Not to those in 113 bits, whose steps are limited as a whole."""
    left = {p: effort_of(p, 1.0, DEFAULT_LIMITS, 2_000.0) for p in PRECISIONS}
    assert left["long double"].work == 33_000
    assert left["double"].work == 15 / 16 * 33_000
    assert left["quadruple"] == effort_of("quadruple", 1.0, DEFAULT_LIMITS)
    assert effort_of("double", 1.0, DEFAULT_LIMITS, 1e6).work == 0


def work_of(*arcs, tried=0):
    """Return the work of arcs, in steps."""
    found = Work(Effort(), DEFAULT_LIMITS, "double", 0.1, 4.0)
    for arc in arcs:
        found.add(arc, tried)
    return found.in_steps


def test_a_jump_takes_longer_with_more_elements_and_more_modes_to_try():
    arc = hybrid_run(BOUNCES, [0.0, 4.0]).arcs[0]
    assert work_of(arc, arc, tried=6) == work_of(arc, arc) + 2
    more = arc._replace(mode=replace(arc.mode, states=arc.mode.states * 5))
    assert work_of(more) == work_of(arc) + len(arc.mode.states)


def test_the_modes_that_a_selection_tries_count():
    """A run ends where they exceed its limit."""
    sticks = replace(BOUNCES, effects=(Gravity(), JointFriction((1.0, 1.0))))
    run = hybrid_run(sticks, [0.0, 4.0])
    assert len(run.arcs) > 2
    without = work_of(*run.arcs)
    assert run.work > without + len(run.arcs) / 6
    assert run.work == pytest.approx(without + round(6 * (run.work - without)) / 6)


def test_work_is_that_of_jumps_the_first_steps_of_arcs_and_compilations():
    """A run ends with the arc in which it exceeds its limit."""
    *arcs, before_last, _ = hybrid_run(BOUNCES, [0.0, 4.0]).arcs
    assert {arc.step_count for arc in arcs} == {1, 2}
    known = (*arcs, before_last)
    assert work_of(*known) == 300 + sum(arc.step_count + 3.25 for arc in known)
    enough = Effort(work=work_of(*known))
    assert not hybrid_run(BOUNCES, [0.0, 4.0], effort=enough, partial=True).exhausted
    less = enough._replace(work=enough.work - 1)
    cut = hybrid_run(BOUNCES, [0.0, 4.0], effort=less, partial=True)
    assert cut.exhausted
    assert len(cut.arcs) == len(known)


def test_the_many_steps_of_one_arc_hardly_count():
    """A long motion may take any number of them."""
    free = Scene(BARS, (0.4, 0.7), (0.3, 0.2), 50.0, (Gravity(), JointStop("A", lower=-1e9)))
    (arc,) = hybrid_run(free, [0.0, 50.0]).arcs
    assert arc.step_count > 200
    assert work_of(arc) == 300 + 3.25 + 8


def test_compilations_count_once_for_each_kind_wherever_the_code_comes_from():
    """Another thread may have compiled a copy of the code."""
    own = hybrid_run(BOUNCES, [0.0, 4.0]).arcs[0]
    copied = own._replace(compiled=replace(own.compiled))
    optimised = replace(own.compiled, kind=own.compiled.kind._replace(optimised=True))
    once = work_of(own)
    assert work_of(own, copied) == 2 * once - 300
    assert work_of(own, own._replace(compiled=optimised)) == 2 * once + 700


@pytest.mark.parametrize("precision", PRECISIONS)
def test_without_limits_a_run_may_take_any_work(precision):
    limited = effort_of(precision, 1.0, DEFAULT_LIMITS)
    assert effort_of(precision, 1.0, UNLIMITED) == Effort(jumps=math.inf, patience=math.inf)
    assert limited.steps == (6_000 if precision == "quadruple" else math.inf)
    assert limited.jumps < 2_000 or limited.work <= 35_000


def test_a_run_ends_early_that_would_exceed_its_steps_at_its_pace():
    lossless = scene(ONTO, JointStop("A", lower=0.0, restitution=1.0), q=(1.0, 0.0), duration=100.0)
    whole = hybrid_run(lossless, [0.0, 100.0])
    enough = hybrid_run(lossless, [0.0, 100.0], effort=Effort(steps=whole.steps))
    assert enough.steps == whole.steps
    few = hybrid_run(lossless, [0.0, 100.0], effort=Effort(steps=whole.steps // 3), partial=True)
    assert few.exhausted
    assert few.steps < whole.steps // 4


def test_a_run_that_has_reached_its_end_has_not_taken_too_much():
    """However many steps it took: nothing is left to follow."""
    free = Scene(BARS, (0.4, 0.7), (0.3, 0.2), 2.0, (Gravity(), JointStop("A", lower=-1e9)))
    whole = hybrid_run(free, [0.0, 2.0])
    assert len(whole.arcs) == 1
    assert not hybrid_run(free, [0.0, 2.0], effort=Effort(steps=whole.steps - 1)).exhausted


def test_the_code_of_a_mode_is_optimised_that_will_take_enough_steps(monkeypatch):
    taken = []

    def spied(*arguments):
        taken.append(arguments[-1])
        return flow(*arguments)

    flow = history_module.flow
    double = replace(PRECISIONS["double"], steps_worth_optimising=40)
    monkeypatch.setattr(effort_module, "PRECISIONS", {**PRECISIONS, "double": double})
    monkeypatch.setattr(history_module, "flow", spied)
    stop = JointStop("A", lower=0.0, restitution=1.0)
    run = hybrid_run(scene(ONTO, stop, q=(1.0, 0.0), duration=100.0), [0.0, 100.0])
    counts = np.cumsum([0, *(arc.step_count for arc in run.arcs[:-1])])
    begins = np.array([float(arc.start.t) for arc in run.arcs])
    alike = {arc.mode.states for arc in run.arcs} == {(S.OPEN,)}
    assert alike
    soon = (counts > 0.3 * 40) & (counts * 100.0 > 2 * 40 * begins)
    assert taken == list((counts > 40) | soon)
    assert sum(taken) > sum(counts > 40)


def test_only_short_steps_are_limited_by_their_number():
    """A ball of 1e12 N/m^1.5 is pressed for a few microseconds at a time."""
    ball = CompliantSurface((0.0, 1.3), (0.0, -1.0), "hertz", 1e12, on=("D",))
    scene = Scene(BARS, (0.4, 0.7), (0.3, 0.2), 1.5, (Gravity(), ball))
    times, effort = [0.0, 1.5], Effort(short_steps=20)
    pressed = hybrid_run(scene, times, effort=effort, partial=True)
    assert pressed.exhausted
    assert "is not followed further" in pressed.failure
    assert hybrid_run(scene, times, partial=True).reached > pressed.reached
    free = Scene(BARS, (0.4, 0.7), (0.3, 0.2), 100.0, (Gravity(), JointStop("A", lower=-1e9)))
    run = hybrid_run(free, [0.0, 100.0], effort=effort)
    assert run.steps > 100
    assert not run.exhausted


def test_the_power_series_of_a_selection_count():
    """D slides between two walls in one place: derivatives decide each of its modes."""
    arc = hybrid_run(BOUNCES, [0.0, 4.0]).arcs[0]
    found = Work(Effort(), DEFAULT_LIMITS, "double", 0.1, 4.0)
    found.add(arc, expanded=3)
    assert found.in_steps == work_of(arc) + 12

    place = -3.464101615137755, 2.0
    toggle = Scene(
        chain=Chain.point_masses((1.0, 0.5), (2.0, 2.0)),
        q=(5 * math.pi / 6, 5 * math.pi / 6),
        u=(0.0, 0.0),
        duration=1.0,
        effects=(
            JointTorque((5.0, 1.0)),
            PdControl((-2 * math.pi / 3, 0.0), (100.0, 20.0), (10.0, 2.0)),
            Surface(place, (1.0, 0.0), on=("C2",), name="left"),
            Surface(place, (-1.0, 0.0), restitution=0.5, friction=1.0, static=1.5, name="right"),
        ),
    )
    run = hybrid_run(toggle, [0.0, 1.0], effort=Effort(work=2_000), partial=True)
    assert run.exhausted
    assert 10 < len(run.arcs) < 120
