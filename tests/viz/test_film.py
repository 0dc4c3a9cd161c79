from dataclasses import replace

import numpy as np
import pytest

from tests.viz.films import commands, corners, film_of, in_plane, matrix, trajectory_of
from twolink import kinematics
from twolink.errors import PictureError
from twolink.viz.film import Film, metres
from twolink.viz.run import Run
from twolink.viz.themes import recoloured, theme_named


def test_gravity_points_down_on_the_screen():
    """From rest D falls, in meshcat's frame along −z, in the window to larger rows."""
    film = film_of("free_fall", 2.0)
    start, later = (matrix(commands(film.frame(k).commands), "/twolink/run0/link2") for k in (0, 6))
    assert later[2, 3] < start[2, 3]
    a, b = film.framing(640, 480).pixel(np.array([[0.0, 0.0], [0.0, 1.0]]))
    assert b[1] > a[1]


def test_a_frame_does_not_depend_on_previous_frames():
    """Each names the same paths, so nothing of another frame can remain."""
    film = film_of("bounce_to_rest", 2.0)
    shown = [{path.removesuffix("/<object>") for path, _, _ in commands(film.frame(k).commands)}
             for k in range(len(film.times))]  # fmt: skip
    assert all(paths == shown[0] for paths in shown)


def test_equal_films_are_equal_bytes():
    one, other = (film_of("bounce_to_rest", 2.0) for _ in range(2))
    assert one.setup == other.setup
    assert one.about == other.about
    assert [one.frame(k) for k in (0, 20, 40)] == [other.frame(k) for k in (40, 20, 0)][::-1]


def test_frames_between_frames_are_the_motion_at_that_time():
    trajectory = trajectory_of("free_fall", 2.0)
    found = commands(film_of("free_fall", 2.0).at(1.2345).commands)
    q, _ = trajectory.at([1.2345])
    assert matrix(found, "/twolink/run0/link1")[0, 0] == pytest.approx(np.cos(q[0, 0]), abs=1e-14)


def test_surfaces_are_hatched_behind_their_edge():
    film = film_of("bounce_to_rest", 1.0)
    found = corners(commands(film.setup), "/twolink/surfaces")
    # The floor is at y = 1.2, and its inside is below: at larger y.
    assert found[:, 1].min() == pytest.approx(1.2)
    assert found[:, 1].max() < 1.2 + film._hatch
    assert found[:, 0].min() < film.box.left
    assert found[:, 0].max() > film.box.right
    assert film.about["surfaces"][0][0] == "floor (for D)"


def test_the_lowest_energy_is_that_of_the_motion_and_not_of_the_frames():
    many, one = (film_of("free_fall", 1.0, fps=fps).about["energy"]["most"] for fps in (30.0, 0.5))
    assert many == pytest.approx(one, rel=1e-3)
    assert many > 5.0


def test_a_scene_without_surfaces_draws_none():
    paths = {path for path, _, _ in commands(film_of("free_fall", 2.0).setup)}
    assert not any("surface" in path or "contact" in path for path in paths)


def test_an_impact_is_marked_with_its_impulse_where_it_was():
    trajectory = trajectory_of("bounce_to_rest", 1.0)
    film = film_of("bounce_to_rest", 1.0)
    impact = trajectory.impacts[0]
    before, after = int(impact.time * 30), int(impact.time * 30) + 1
    hidden = commands(film.frame(before).commands)
    assert hidden["/twolink/impacts/<object>", "set_property", "visible"]["value"] is False
    frame = film.frame(after)
    words = [label for label in frame.words["labels"] if label[5] == "impulse"]
    size = np.hypot(impact.normal_impulse, impact.tangential_impulse)
    assert [label[0] for label in words] == [f"impulse {size:.3g} N s"]
    chain = trajectory.chain
    q, _ = trajectory.at([impact.time])
    place = np.array(kinematics.position(chain, tuple(q[:, 0]), chain.D))
    # The number stands at the arrow's head: along −y, out of the floor, and against the sliding.
    head = np.array(words[0][1:3])
    way = (head - place) / np.hypot(*(head - place))
    # Normal −y; tangent +x.
    assert way == pytest.approx(
        np.array([impact.tangential_impulse, -impact.normal_impulse]) / size, abs=1e-3
    )
    marked = corners(commands(frame.commands), "/twolink/impacts")
    assert np.hypot(*(marked - place).T).max() == pytest.approx(np.hypot(*(head - place)), rel=0.02)


def test_marks_of_impacts_go_with_time():
    film = film_of("slide_and_stop", 2.0)
    assert not any(label[5] == "impulse" for label in film.frame(50).words["labels"])


@pytest.mark.parametrize("frame", range(5, 60, 9))
def test_contacts_are_marked_while_they_last(frame):
    trajectory = trajectory_of("slide_and_stop", 2.0)
    film = film_of("slide_and_stop", 2.0)
    time = float(film.times[frame])
    event = [event for event in trajectory.events if event.entered <= time][-1]
    found = commands(film.frame(frame).commands)
    shown = {
        name: found[f"/twolink/contact0/{name}", "set_property", "visible"]["value"]
        for name in ("held", "slipping", "pushed-on", "pushed-back")
    }
    words = [label[0] for label in film.frame(frame).words["labels"] if label[5] == "contact"]
    assert film.frame(frame).words["mode"] == event.description
    if "slips" in event.description:
        assert shown["slipping"]
        # Friction acts against the sliding of D along x.
        chain = trajectory.chain
        q, u = trajectory.at([time])
        vx, _ = kinematics.velocity(chain, tuple(q[:, 0]), tuple(u[:, 0]), chain.D)
        # The words point where D slides, and the arrow of friction has its size.
        assert words == ["slips →" if vx > 0 else "slips ←"]
        (friction,) = trajectory.contact_forces([time])
        (label,) = [x for x in film.frame(frame).words["labels"] if x[5] == "friction"]
        assert label[0] == f"friction {abs(friction.tangential[0]):.3g} N"
        x, _ = kinematics.position(chain, tuple(q[:, 0]), chain.D)
        assert (label[1] - x) * vx < 0
        assert shown["pushed-on" if vx < 0 else "pushed-back"]
        assert not shown["pushed-back" if vx < 0 else "pushed-on"]
    else:
        assert words == ["sticks"]
        assert shown == {"held": True, "slipping": False, "pushed-on": False, "pushed-back": False}


def test_an_instantaneous_contact_is_marked_for_a_minimum_time():
    trajectory = trajectory_of("hertz_bounce", 1.0)
    film = film_of("hertz_bounce", 1.0)
    left = next(e.entered for e in trajectory.events[2:] if e.description == "moves freely")
    labels = film.at(left + 0.05).words["labels"]
    assert [label[0] for label in labels if label[5] == "contact"] == ["touched"]
    assert not any(label[5] == "contact" for label in film.at(left - 0.1).words["labels"])


def test_joint_friction_is_shown_at_the_joints():
    """With the sense of rotation: angles grow clockwise, since y points down."""
    trajectory = trajectory_of("stick_slip", 2.0)
    film = film_of("stick_slip", 2.0)
    for frame in (2, 20, 40, 50):
        labels = [x[0] for x in film.frame(frame).words["labels"] if x[5] == "contact"]
        _, u = trajectory.at([float(film.times[frame])])
        mode = film.frame(frame).words["mode"]
        speeds = {"A": u[0, 0], "B": u[1, 0] - u[0, 0]}
        expected = [
            "sticks" if f"{joint} sticks" in mode else f"slips {'↻' if speed > 0 else '↺'}"
            for joint, speed in speeds.items()
        ]
        assert labels == expected


def test_the_energies_are_the_trajectory_s():
    trajectory = trajectory_of("bounce_to_rest", 1.0)
    film = film_of("bounce_to_rest", 1.0, fps=50)
    drawn = film.moments[0].potential_energy
    lowest = min(drawn.min(), trajectory.potential_energy.min())
    # Samples are 2 ms apart: frames of 20 ms are every tenth.
    for k in range(0, 51, 10):
        words = film.frame(k).words
        assert words["T"] == pytest.approx(trajectory.kinetic_energy[10 * k], abs=1e-4)
        above = trajectory.potential_energy[10 * k] - lowest
        assert words["V"] == pytest.approx(above, rel=1e-5, abs=1e-9)
    energy = film.about["energy"]
    assert energy["loses"]
    assert energy["most"] == pytest.approx(trajectory.energy[0] - lowest, rel=1e-6)
    assert not film_of("free_fall", 2.0).about["energy"]["loses"]


def test_ghosts_have_links_trails_and_distances_of_their_own():
    first = trajectory_of("free_fall", 2.0)
    other = trajectory_of("general", 2.0)
    film = Film((Run("one", first), Run("other", other)))
    found = commands(film.frame(30).commands)
    chain = other.chain
    q, _ = other.at([1.0])
    pose = matrix(found, "/twolink/run1/link2")
    D = np.array(kinematics.position(chain, tuple(q[:, 0]), chain.D))
    assert in_plane(pose, float(chain.L2)) == pytest.approx(D, abs=1e-13)
    assert ("/twolink/trail1", "set_object", "") in found
    mine = in_plane(matrix(found, "/twolink/run0/link2"), 1.0)
    assert film.frame(30).words["apart"] == [f"D is {metres(np.hypot(*(D - mine)))} away"]
    assert film.about["names"] == ["one", "other"]
    assert film.framing(640, 480).rows == 2


def test_a_film_lasts_as_long_as_its_shortest_run():
    film = Film((Run("a", trajectory_of("free_fall", 2.0)), Run("b", trajectory_of("drop", 1.0))))
    assert film.times[-1] == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("distance", "words"),
    [
        (0, "0 m"),
        (0.5, "0.5 m"),
        (1.234e-10, "1.2 · 10⁻¹⁰ m"),
        (0.00314, "0.0031 m"),
        (0.2, "0.2 m"),
    ],
)
def test_distances_in_words(distance, words):
    assert metres(distance) == words


def test_themes_differ_in_every_surrounding():
    light, dark = (commands(film_of("drop", 1.0, theme=name).setup) for name in ("light", "dark"))
    for found, theme in ((light, theme_named("light")), (dark, theme_named("dark"))):
        colour = [int(theme.background[k : k + 2], 16) for k in (1, 3, 5)]
        parts = found["/Background", "set_property", "top_color"]["value"]
        # As the viewer makes bytes of them: cut off.
        assert [int(255 * part) for part in parts] == colour
        material = found["/twolink/run0/link1/bar", "set_object", ""]["object"]["materials"][0]
        assert material["color"] == int(theme.links[0][1:], 16)


@pytest.mark.parametrize(
    "rates", [{"fps": 0}, {"fps": -1}, {"fps": 1e9}, {"speed": 0}, {"speed": float("nan")}]
)
def test_invalid_rates_are_rejected(rates):
    with pytest.raises(PictureError, match="must be "):
        film_of("free_fall", 2.0, **rates)


def test_each_colour_of_a_theme_has_one_place_in_the_other():
    light, dark = theme_named("light"), theme_named("dark")
    found = recoloured(light, dark)
    for name in ("background", "ink", "pin", "end", "impulse", "contact"):
        assert found[getattr(light, name)] == getattr(dark, name)
    assert [found[colour] for colour in (*light.links, *light.ghosts)] == [
        *dark.links,
        *dark.ghosts,
    ]


def test_unknown_themes_are_refused():
    with pytest.raises(PictureError, match="theme must be one of light, dark; got 'pink'"):
        theme_named("pink")


def test_a_still_is_a_frame_at_exactly_its_time():
    film = replace(film_of("bounce_to_rest", 1.0), still=0.44)
    number = int(np.searchsorted(film.times, 0.44))
    assert film.times[number] == 0.44
    assert film.frame(number).words["t"] == 0.44
    assert film.about["still"] == 0.44
    with pytest.raises(PictureError, match=r"at must be 0 to 1 s; got 1\.5 s"):
        replace(film, still=1.5)


def test_the_letter_of_D_does_not_lie_on_the_arrow_of_friction():
    film = film_of("slide_and_stop", 2.0)
    labels = {label[0]: label for label in film.frame(5).words["labels"]}
    # Below the floor, whose normal is −y.
    assert labels["D"][3:5] == [0.0, 1.0]


def test_the_label_of_a_surface_names_its_points():
    film = film_of("slide_and_stop", 2.0)
    assert [label[0] for label in film.about["surfaces"]] == ["floor (for D)"]


def test_small_energies_beside_a_large_potential_add_up():
    """Painlevé's wedge has 5 mJ above a potential energy of some −18 J."""
    film = film_of("painleve", 0.02, fps=240, speed=0.1)
    for number in range(0, len(film.times), 20):
        words = film.frame(number).words
        assert words["T"] + words["V"] == pytest.approx(film.about["energy"]["most"], rel=1e-4)


def covers(mark, point):
    """Whether a mark covers a point."""
    start, end, radius = np.array(mark[:2]), np.array(mark[2:4]), mark[4]
    way = end - start
    along = np.clip((point - start) @ way / ((way @ way) or 1.0), 0, 1)
    return np.hypot(*(point - start - along * way)) <= radius


def test_drawings_of_contacts_and_impacts_lie_inside_their_marks():
    film = film_of("bounce_to_rest", 2.0)
    for number in (14, 20, 30):
        frame = film.frame(number)
        points = corners(commands(frame.commands), "/twolink/impacts")
        # Numbers of marks are rounded.
        grown = [[*mark[:4], mark[4] + 2e-3] for mark in frame.words["marks"]]
        assert all(any(covers(mark, point) for mark in grown) for point in points)
    (floor,) = film.about["marks"]
    assert covers(floor, np.array([0.3, 1.2]))
    assert not covers(floor, np.array([0.3, 1.1]))
    assert film_of("free_fall", 2.0).frame(20).words["marks"] == []


def test_the_mark_of_a_joint_s_impulse_moves_with_the_joint():
    film = film_of("joint_stops", 1.0)
    trajectory = trajectory_of("joint_stops", 1.0)
    impact = trajectory.impacts[0]
    frame = film.at(impact.time + 0.2)
    ring = corners(commands(frame.commands), "/twolink/impacts")
    elbow = matrix(commands(frame.commands), "/twolink/run0/link2")
    assert ring.mean(axis=0) == pytest.approx(in_plane(elbow, 0), abs=1e-6)
    # The stops of B turn with link 1, and labels keep clear of them.
    assert any(covers(mark, np.array(mark[:2])) for mark in frame.words["marks"])
    assert len(frame.words["marks"]) == 1 + 4


def test_the_label_of_an_impulse_ends_before_its_mark_fades():
    film = film_of("bounce_to_rest", 1.4)
    time = trajectory_of("bounce_to_rest", 1.4).impacts[0].time

    def labelled(after):
        labels = film.at(time + after).words["labels"]
        return any(label[5] == "impulse" and "2.65" in label[0] for label in labels)

    assert labelled(0.6)
    assert not labelled(0.7)
