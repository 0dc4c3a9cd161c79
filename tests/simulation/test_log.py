"""The log of a motion: sequences of bounces are one entry, with all their impacts inside."""

import re

import pytest

from twolink.scene import Scene
from twolink.simulation import simulate


@pytest.fixture(scope="module")
def drop():
    return simulate(Scene.load("drop"))


@pytest.mark.slow
def test_bounces_are_one_entry_with_units(drop):
    free, bounces, slides = drop.log[:3]
    assert free.words == "moves freely"
    count = len(drop.impacts) - 1
    assert count > 20
    assert bounces.words.startswith(
        f"D hits floor {count} times: normal speed −5.507 m/s at first, "
    )
    assert bounces.words.endswith("the remaining bounces end here")
    assert bounces.time == drop.impacts[0].time
    assert bounces.until == drop.impacts[-1].time < slides.time
    assert [part.time for part in bounces.parts] == [impact.time for impact in drop.impacts]
    assert bounces.parts[0].words == (
        "D hits floor: normal speed −5.507 → 2.203 m/s, slides, energy −5.874 J"
    )
    assert re.search(r"\(below \S+ m/s\) end here$", bounces.parts[-1].words)
    assert slides.words == "D on floor slips backward"


def test_every_impact_and_event_is_in_the_log(drop):
    every = [part.time for entry in drop.log for part in entry.parts or (entry,)]
    assert sorted(every) == sorted(e.time for e in (*drop.impacts, *drop.events))
    assert every == sorted(every)


@pytest.mark.slow
def test_joint_stops_have_angular_speeds():
    log = simulate(Scene.load("joint_stops"), samples=2).log
    (first,) = [entry for entry in log if "lower" in entry.words][:1]
    assert first.words == (
        "B hits its lower stop: normal speed −0.8134 → 0.5694 rad/s, frictionless, "
        "energy −0.02307 J"
    )


def test_a_smooth_motion_has_no_log():
    assert simulate(Scene.load("free_fall"), samples=2).log == ()
