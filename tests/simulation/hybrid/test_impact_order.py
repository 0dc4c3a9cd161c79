"""The order of simultaneous impacts: chosen by a rule, noted if it matters, a doubt if unknown."""

from dataclasses import replace

import pytest

from tests.simulation.hybrid import BALANCED
from tests.simulation.hybrid.test_impact import AT_A, AT_B, impacts_of, stop
from twolink.chain import Chain
from twolink.effects.gravity import Gravity
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.effects.surface import Surface
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.hybrid import impact_order
from twolink.simulation.hybrid.differences import differences
from twolink.simulation.hybrid.run import hybrid_run

# The mass centre of link 2 is at B, so that it keeps its direction: link 2 lands flat.
FLAT = Chain((1.0, 1.0), (1.0, 0.8), ((0.5, 0.0), (0.0, 0.0)), (0.1, 0.05))
OPEN = "do not determine the order of simultaneous impacts"


def landing(*, tilt=0.0, on=("B", "D"), restitution=0.5):
    floor = Surface((0.0, 0.3), (0.0, -1.0), on, restitution=restitution, name="floor")
    return Scene(FLAT, (-0.5, tilt), (0.0, 0.0), 1.0, (Gravity(9.81), floor))


@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_a_link_that_lands_flat_does_so_in_any_order_of_its_points(restitution):
    """Both points have the same energy of approach, and their names decide, not their places."""
    first, second = (
        simulate(landing(on=on, restitution=restitution)) for on in (("B", "D"), ("D", "B"))
    )
    assert first.u[:, -1] == pytest.approx(second.u[:, -1], abs=1e-9)
    for found in (first, second):
        assert any(OPEN in note for note in found.notes)


@pytest.mark.parametrize("length", [0.5, 1.0, 2.0])
def test_a_stop_and_a_surface_are_compared_in_one_unit(length):
    """Link 1 meets its stop and the floor at once: the same motion in any unit of length.

    The energies of approach are equal, and the contact with less restitution is taken.
    """
    chain = Chain((1.0, 1.0), (length, 0.8), ((0.5 * length, 0.0), (0.4, 0.0)), (0.1, 0.05))
    effects = (
        JointStop("A", None, 0.0, 0.0),
        Surface((0.0, 0.0), (0.0, -1.0), ("B",), restitution=0.8, name="floor"),
    )
    for own in (effects, effects[::-1]):
        found = simulate(Scene(chain, (-0.5, 0.3), (0.0, 0.0), 1.0, (Gravity(9.81), *own)))
        assert [impact.name for impact in found.impacts] == ["A on its upper stop"]
        assert any(OPEN in note for note in found.notes)


def test_a_later_order_that_matters_is_noted():
    """Link 1 rests on a stop and a block; the tip drives it into both, with one energy."""
    chain = Chain.uniform_bars()
    effects = (
        JointTorque((40.0, 0.0)),
        JointStop("A", upper=0.0, restitution=1.0),
        Surface((1.0, 0.0), (0.0, -1.0), on=("B",), restitution=0.0, name="block"),
        Surface((0.0, -0.95), (0.0, 1.0), on=("D",), restitution=0.5, name="ceiling"),
    )
    found = simulate(Scene(chain, (0.0, -2.3), (0.0, 6.0), 0.1, (Gravity(9.81), *effects)))
    assert [impact.name for impact in found.impacts[:2]] == ["D on ceiling", "B on block"]
    (note,) = found.notes
    assert f"{OPEN} (B on block, A on its upper stop): B on block is struck first" in note


def test_an_order_that_does_not_matter_is_not_noted():
    """Two floors at one height, each for one point of two links that move alike."""
    floor = Surface((0.0, 0.3), (0.0, -1.0), ("B",), restitution=0.5, name="floor")
    scene = replace(landing(), effects=(Gravity(9.81), floor, replace(floor, name="again")))
    assert simulate(scene).notes == ()


def test_an_order_that_matters_little_is_noted_too():
    """Restitutions that differ by 1e-6 change u by 4e-6 rad/s, above every accuracy."""
    floor = Surface((0.0, 0.3), (0.0, -1.0), ("B",), restitution=0.5, name="floor")
    other = replace(floor, name="again", restitution=0.500001)
    (note,) = simulate(replace(landing(), effects=(Gravity(9.81), floor, other))).notes
    assert OPEN in note
    assert float(note.split("u by ")[1].split()[0]) < 1e-5


@pytest.mark.parametrize(("tilt", "first"), [(-1e-9, "B on floor"), (1e-9, "D on floor")])
def test_a_tilt_decides_the_order(tilt, first):
    found = simulate(landing(tilt=tilt))
    assert found.met
    assert found.notes == ()
    assert found.impacts[0].name == first


def test_gaps_within_the_error_of_the_judge_are_a_doubt():
    """A tilt of 1e-10 rad is a doubt for an error of 1e-8, and none for one of 1e-12."""
    times = [0.0, 0.5]
    run = hybrid_run(landing(tilt=1e-10), times, order=21)
    (doubt,) = (doubt for doubt in run.doubts if doubt.time < 0.5)
    assert doubt.within == pytest.approx(4e-11, rel=0.5)
    assert doubt.change > 1
    for error, counts in ((1e-8, True), (1e-12, False)):
        moved = replace(landing(tilt=1e-10), q=(-0.5 + error, 1e-10))
        other = hybrid_run(moved, times, order=21)
        found = differences(other, run, run.polynomials.starts[:1].astype(float), 1e-6)
        assert found[0] <= 1.1 * error
        at_end = differences(other, run, other.polynomials.starts[-1:].astype(float), 1e-6)
        assert (at_end[0] > 1) == counts


def test_only_the_first_impacts_of_two_orders_are_compared(monkeypatch):
    """Impacts between nearly parallel walls answer each other hundreds of times."""
    impacts, made = impacts_of(stop(AT_A), stop(AT_B), chain=BALANCED), []
    monkeypatch.setattr(impact_order, "approach", lambda *given: -1.0)
    impact = impacts.impact
    monkeypatch.setattr(impacts, "impact", lambda *given: made.append(given) or impact(*given))
    for first in (0, 1):
        impact_order._speeds_after(impacts, (0, 1), (-2.0, -1.0), first)
    assert len(made) == 2 * impact_order._IMPACTS
