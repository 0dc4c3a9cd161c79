"""The links of each run are where its motion is, and the trail of D follows it."""

import numpy as np
import pytest

from tests.viz.films import commands, corners, film_of, in_plane, matrix, trajectory_of
from twolink import kinematics
from twolink.viz.links import Pen
from twolink.viz.themes import LIGHT


@pytest.mark.parametrize(("fps", "speed"), [(30, 1.0), (25, 0.5), (60, 3.0)])
def test_links_are_where_the_kinematics_puts_them_at_exact_times(fps, speed):
    trajectory = trajectory_of("free_fall", 2.0)
    film = film_of("free_fall", 2.0, fps=fps, speed=speed)
    assert len(film.times) == int(2.0 * fps / speed + 1e-9) + 1
    chain = trajectory.chain
    for k in range(0, len(film.times), 7):
        frame = film.frame(k)
        assert frame.time == pytest.approx(k * speed / fps, abs=1e-15)
        q, _ = trajectory.at([frame.time])
        B, D = (np.array(kinematics.position(chain, tuple(q[:, 0]), p)) for p in (chain.B, chain.D))
        found = commands(frame.commands)
        first, second = (matrix(found, f"/twolink/run0/link{link}") for link in (1, 2))
        assert in_plane(first, 0) == pytest.approx([0, 0], abs=1e-15)
        assert in_plane(first, float(chain.L1)) == pytest.approx(B, abs=1e-13)
        assert in_plane(second, 0) == pytest.approx(B, abs=1e-13)
        assert in_plane(second, float(chain.L2)) == pytest.approx(D, abs=1e-13)
        # Rotations about meshcat's y, which is the chain's z.
        assert np.linalg.det(first[:3, :3]) == pytest.approx(1)


def test_the_trail_follows_d_and_tapers():
    trajectory = trajectory_of("free_fall", 2.0)
    film = film_of("free_fall", 2.0)
    found = commands(film.frame(45).commands)
    points = corners(found, "/twolink/trail0")
    half = len(points) // 2
    middle, width = (
        (points[:half] + points[half:]) / 2,
        np.hypot(*(points[:half] - points[half:]).T),
    )
    times = 1.5 - 1 + np.arange(91) / 90
    chain = trajectory.chain
    D = np.array(kinematics.position(chain, tuple(trajectory.at(times)[0]), chain.D)).T
    # Rounded to a part of 2^14 of the reach, 0.12 mm.
    assert np.abs(middle - D[-half:]).max() < 1.3e-4
    assert width[-1] == pytest.approx(0.03 * film._length, rel=0.01)
    assert (np.diff(width) > 0).all()
    drawn = found["/twolink/trail0", "set_object", ""]["object"]
    colours = drawn["geometries"][0]["data"]["attributes"]["color"]["array"].reshape(-1, 4)
    # White, by which the viewer multiplies the material's colour.
    assert (colours[:, :3] == 1).all()
    assert drawn["materials"][0]["color"] == int(film.theme.end[1:], 16)
    opacity = colours[:half, 3]
    assert opacity[0] < 0.02
    assert opacity[-1] == pytest.approx(0.75)


def test_the_trail_touches_the_floor_where_the_end_did():
    """Impacts are points of it: a trail of even times alone would cut the corner."""
    film = film_of("bounce_to_rest", 1.0)
    found = commands(film.frame(14).commands)
    points = corners(found, "/twolink/trail0")
    half = len(points) // 2
    assert ((points[:half] + points[half:]) / 2)[:, 1].max() == pytest.approx(1.2, abs=2e-4)


def test_a_trail_is_smooth_where_the_chain_is_fast():
    trajectory = trajectory_of("free_fall", 10.0)
    film = film_of("free_fall", 10.0)
    (moments,) = film.moments
    turned = np.abs(np.diff(moments.q)).max()
    assert turned < 0.15
    # At a constant rate it would turn more between two points.
    every = np.linspace(0, 10, len(film.times) * 3)
    assert np.abs(np.diff(trajectory.at(every)[0])).max() > 0.15


def test_ghosts_are_thinner_and_of_a_colour_each():
    full, *ghosts = (Pen(number, 2.0, LIGHT) for number in range(7))
    assert all(0 < ghost.width < full.width for ghost in ghosts)
    (moments,) = film_of("free_fall", 2.0).moments
    now = moments.at(1.0)
    trails = [commands([pen.trail(now, moments, 1.0)]) for pen in ghosts]
    colours = [
        found[f"/twolink/trail{pen.number}", "set_object", ""]["object"]["materials"][0]["color"]
        for pen, found in zip(ghosts, trails, strict=True)
    ]
    assert len(set(colours[:5])) == 5
    assert colours[5] == colours[0]
