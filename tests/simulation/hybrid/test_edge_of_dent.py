"""A point that leaves its dent and another surface of the same plane at one instant."""

from dataclasses import replace

import numpy as np
import pytest

from tests.simulation.hybrid import BARS, system_of
from tests.simulation.hybrid.test_doubts import cushioned
from twolink.contact.states import EventKind as E
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.gravity import Gravity
from twolink.effects.joint_stop import JointStop
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.hybrid.edge_of_dent import doubts_with_rise
from twolink.simulation.hybrid.mode import Trigger
from twolink.simulation.hybrid.run import hybrid_run
from twolink.simulation.hybrid.state import put


def on_a_mat(*others, deeper=0.0):
    """Return a scene in which D falls onto a yielding floor with a mat of rubber on its plane."""
    bare = cushioned(0.0, 0.0, 1.51, 0.02, 0.3, 1e8, 0.1)
    mat = CompliantSurface((0.0, 1.51 + deeper), (0.0, -1.0), "hertz", stiffness=1e7, name="mat")
    return replace(bare, effects=(*bare.effects, mat, *others))


def on_edges(doubts):
    return [doubt for doubt in doubts if doubt.trigger.kind is E.CLEARS]


def leaving(scene):
    """Return the system of a scene, and the arc that ends as D leaves its dent."""
    run = hybrid_run(scene, np.linspace(0.0, 0.1, 3))
    (arc,) = [arc for arc in run.arcs if arc.event and arc.event.kind is E.CLEARS]
    return system_of(*scene.effects), arc


def test_only_an_error_as_large_as_its_rise_keeps_a_point_in_its_dent():
    """It is that of a flight from there, v²/(2 a); round-off was enough before."""
    scene = on_a_mat()
    run = hybrid_run(scene, np.linspace(0.0, 0.1, 3))
    _, arc = leaving(scene)
    (doubt,) = on_edges(run.doubts)
    free = simulate(Scene(BARS, arc.end.q, arc.end.u, 0.1, (Gravity(9.81),)), samples=501)
    down = np.sin(free.q).sum(axis=0)
    rise = (down[0] - down.min()) / np.cos(arc.end.q).sum()
    assert doubt.within == pytest.approx(rise, rel=0.1)
    assert on_edges(arc.doubts)[0].within < 1e-15


@pytest.mark.parametrize(
    "change",
    [
        lambda arc: arc._replace(end=arc.end._replace(gaps=put(arc.end.gaps, 2, 0.0))),
        lambda arc: arc._replace(end=arc.end._replace(u=tuple(-u for u in arc.end.u))),
        lambda arc: arc._replace(event=Trigger(E.HITS, 2)),
        lambda arc: arc._replace(event=None),
        lambda arc: arc._replace(
            doubts=tuple(doubt._replace(until=doubt.time - 1e-9) for doubt in arc.doubts)
        ),
    ],
    ids=["an impact at once", "it falls", "another event", "no event", "earlier"],
)
def test_doubts_stay_where_the_point_may_stay_in_its_dent(change):
    system, arc = leaving(on_a_mat(JointStop("B", upper=0.5)))
    assert doubts_with_rise(system, arc) != arc.doubts
    changed = change(arc)
    assert doubts_with_rise(system, changed) == changed.doubts


@pytest.mark.slow
def test_a_mat_on_the_plane_of_a_yielding_floor_is_one_a_little_above_or_below():
    motion = simulate(on_a_mat(), samples=41)
    assert motion.met
    for deeper in (-1e-9, 1e-9):
        near = simulate(on_a_mat(deeper=deeper), samples=41)
        assert near.met
        assert np.abs(near.q - motion.q).max() < 1e-8
