"""Plots of a motion: the lines are the trajectory's data, and texts are legible."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from matplotlib.text import Annotation

from twolink import kinematics
from twolink.contact.states import ContactState
from twolink.errors import ParameterError, PictureError
from twolink.simulation import Trajectory
from twolink.viz.plots.angles import angles
from twolink.viz.plots.contact import contact, phases
from twolink.viz.plots.energy import energy, in_words
from twolink.viz.plots.moments import moments, spans
from twolink.viz.plots.path import path, path_moments
from twolink.viz.plots.phase import phase
from twolink.viz.plots.style import save
from twolink.viz.themes import THEMES

PLOTS = {"angles": angles, "phase": phase, "path": path, "energy": energy, "contact": contact}
SCENES = (
    "free_fall",
    "bounce_to_rest",
    "slide_and_stop",
    "stick_slip",
    "hertz_bounce",
    "published/kane_levinson_impact",
)
EVERY = [
    (scene, kind) for scene in SCENES for kind in PLOTS if (scene, kind) != ("free_fall", "contact")
]


def labelled(axes):
    return {line.get_label(): line for line in axes.lines if not line.get_label().startswith("_")}


def words_at_lines(axes):
    """Return the annotations with words, outside of the axes at the right."""
    found = [text for text in axes.texts if isinstance(text, Annotation) and text.get_text()]
    return [text for text in found if text.xy[0] == 1.0 and text.xycoords == "axes fraction"]


@pytest.mark.slow
@pytest.mark.parametrize(("scene", "kind"), EVERY)
def test_axes_have_units_and_words_do_not_lie_on_each_other(run, scene, kind):
    made = PLOTS[kind](run(scene), "dark")
    made.draw_without_rendering()
    for axes in made.axes:
        below = axes.get_xlabel() or made.axes[-1].get_xlabel()
        for label in (below, axes.get_ylabel()):
            assert label.partition("(")[2].partition(")")[0] in (
                "s", "ms", "rad", "rad/s", "m", "N", "N m", "N s", "N m s", "J",
            ) or "work" in label  # fmt: skip
        words = words_at_lines(axes)
        assert [text.get_text() for text in words] == list(labelled(axes))
        for one, other in combinations(words, 2):
            assert not one.get_window_extent().overlaps(other.get_window_extent())
        for text in (*words, axes.title, axes.xaxis.label, axes.yaxis.label):
            box = text.get_window_extent()
            assert box.x0 >= -1 or not text.get_text()
            assert box.x1 <= made.bbox.x1 + 1 or not text.get_text()


@pytest.mark.slow_but_first
@pytest.mark.parametrize("scene", ["free_fall", "bounce_to_rest"])
def test_angles_and_speeds_are_the_trajectorys(run, scene):
    trajectory = run(scene)
    above, below = angles(trajectory).axes
    for axes, symbol, values in ((above, "q", trajectory.q), (below, "u", trajectory.u)):
        for link in (0, 1):
            times, drawn = labelled(axes)[f"${symbol}_{link + 1}$"].get_data()
            at_samples = drawn[np.searchsorted(times, trajectory.t)]
            assert np.array_equal(at_samples, values[link])
            assert np.all(np.diff(times) > 0)
    assert below.get_xlabel() == "time (s)"


def test_a_jump_is_drawn_where_it_is(run):
    """Both sides of an impact are on the line, nothing between them."""
    trajectory = run("bounce_to_rest")
    impact = trajectory.impacts[0]
    _, below = angles(trajectory).axes
    for link in (0, 1):
        times, drawn = labelled(below)[f"$u_{link + 1}$"].get_data()
        after = int(np.searchsorted(times, impact.time))
        assert times[after] == impact.time
        assert times[after - 1] == np.nextafter(impact.time, 0)
        assert drawn[after - 1] == pytest.approx(impact.u[0][link])
        assert drawn[after] == pytest.approx(impact.u[1][link])


def test_phase_portraits_are_speed_over_angle(run):
    trajectory = run("stick_slip")
    for link, axes in enumerate(phase(trajectory).axes):
        q, u = axes.lines[0].get_data()
        shown = moments(trajectory)
        assert np.array_equal(q, shown.q[link])
        assert np.array_equal(u, shown.u[link])
        named = [text for text in axes.texts if text.get_text()]
        assert {text.get_text() for text in named} == {"start", "end"}
        ends = [tuple(text.xy) for text in named]
        assert ends == [
            (trajectory.q[link, 0], trajectory.u[link, 0]),
            (trajectory.q[link, -1], trajectory.u[link, -1]),
        ]


@pytest.mark.slow_but_first
@pytest.mark.parametrize("scene", ["free_fall", "bounce_to_rest", "hertz_bounce"])
def test_the_path_is_where_kinematics_puts_D(run, scene):
    trajectory = run(scene)
    (axes,) = path(trajectory).axes
    (line,) = [line for line in axes.lines if line.get_label() == "_path"]
    shown = path_moments(trajectory)
    x, y = kinematics.position(trajectory.chain, tuple(shown.q), trajectory.chain.D)
    assert np.array_equal(line.get_xdata(), x)
    assert np.array_equal(line.get_ydata(), y)
    assert axes.yaxis_inverted()
    assert axes.get_aspect() == 1
    left, right = axes.get_xlim()
    bottom, top = axes.get_ylim()
    assert left < min(x) < max(x) < right
    assert top < min(y) < max(y) < bottom
    links = {
        line.get_label(): (line.get_xdata()[-1], line.get_ydata()[-1])
        for line in axes.lines
        if line.get_label().startswith("_link")
    }
    # Those at the end were drawn last.
    B = kinematics.position(trajectory.chain, tuple(trajectory.q[:, -1]), trajectory.chain.B)
    assert links == {"_link 1": B, "_link 2": (x[-1], y[-1])}


def test_the_path_shows_impacts(run):
    trajectory = run("bounce_to_rest")
    made = path(trajectory)
    (axes,) = made.axes
    circles = axes.collections[0]
    places = np.asarray(circles.get_offsets())
    assert len(places) == len(trajectory.impacts)
    assert places[:, 1] == pytest.approx(1.2, abs=1e-9)
    impulses = np.array([impact.normal_impulse for impact in trajectory.impacts])
    areas = circles.get_sizes() - 12
    assert areas / areas.max() == pytest.approx(impulses / impulses.max())
    assert "floor" in {text.get_text() for text in axes.texts}
    (edge,) = [line for line in axes.lines if line.get_label() == "_surface"]
    assert edge.get_ydata() == pytest.approx(1.2)
    # Hatching is on the side where nothing may be: below.
    hatches = [line for line in axes.lines if len(line.get_xdata()) == 2]
    hatches = [line.get_ydata()[-1] for line in hatches if line.get_linewidth() == 0.6]
    assert len(hatches) > 20
    assert min(hatches) > 1.2
    assert f"{len(trajectory.impacts)} impacts" in made.get_supxlabel()


def test_the_energy_of_a_short_contact_is_resolved(run):
    """A few milliseconds, between samples: at its depth T is least."""
    trajectory = run("hertz_bounce")
    line = labelled(energy(trajectory).axes[0])["$T$, kinetic"]
    first = next(span for span in spans(trajectory) if span.mode.states[0] is not ContactState.OPEN)
    times, values = line.get_data()
    during = (times > first.start) & (times < first.end)
    assert during.sum() > 20
    (before, after) = np.interp([first.start, first.end], times, values)
    assert values[during].min() < min(before, after) - 1


@pytest.mark.slow_but_first
@pytest.mark.parametrize("scene", ["slide_and_stop", "published/kane_levinson_impact"])
def test_the_balance_of_energy_closes(run, scene):
    trajectory = run(scene)
    made = energy(trajectory)
    stored, given = (labelled(axes) for axes in made.axes)
    times = stored["$T + V$"].get_xdata()
    samples = np.searchsorted(times, trajectory.t)
    assert np.array_equal(times[samples], trajectory.t)
    values = {name: line.get_ydata()[samples] for name, line in stored.items()}
    changes = "change" in made.axes[0].get_ylabel()
    for name, known in (
        ("$T$, kinetic", trajectory.kinetic_energy),
        ("$V$, potential", trajectory.potential_energy),
        ("$T + V$", trajectory.energy),
    ):
        assert np.array_equal(values[name], known - known[0] * changes)
    works = {name: line.get_ydata() for name, line in given.items()}
    for name, work in trajectory.work().items():
        assert works[in_words(name)][samples] == pytest.approx(work, abs=1e-12)
    change = works.pop("change of $T$")
    assert set(works) == {"gravity", "surface"}
    assert sum(works.values()) == pytest.approx(change, abs=1e-12)
    if scene == "slide_and_stop":
        assert change[0] == 0
    else:
        # The impact at the very start gains energy, which is the purpose of the scene.
        assert change[0] == pytest.approx(trajectory.impacts[0].energy_change)
        assert change[0] > 1e-3
    left = float(made.get_supxlabel().split("within ")[1].split(" J")[0])
    assert left < 1e-12


@pytest.mark.slow
def test_a_loaded_trajectory_reports_missing_works(run, tmp_path):
    replace(run("slide_and_stop"), recipe=None).save(tmp_path / "slide.npz")
    read = Trajectory.load(tmp_path / "slide.npz")
    made = energy(read)
    assert len(made.axes) == 1
    assert "works of the effects are unknown" in made.get_supxlabel()
    for kind in ("angles", "phase", "path", "contact"):
        made = PLOTS[kind](read)
        assert made.axes
    normal = labelled(made.axes[0])["normal"]
    assert np.array_equal(normal.get_xdata(), read.t)


def test_effects_are_named_in_words():
    assert in_words("CompliantSurface") == "compliant surface"
    assert in_words("JointStop A") == "joint stop A"


def bands(axes):
    """Return the shaded spans of time, with their hatching."""
    return [
        (patch.get_x(), patch.get_x() + patch.get_width(), patch.get_hatch())
        for patch in axes.patches
    ]


@pytest.mark.slow_but_first
@pytest.mark.parametrize("scene", ["slide_and_stop", "bounce_to_rest", "stick_slip"])
def test_modes_are_shaded_from_event_to_event(run, scene):
    trajectory = run(scene)
    made = contact(trajectory)
    names = trajectory.events[0].mode.names
    rows = [axes for axes in made.axes if bands(axes)]
    assert len(rows) == len(names)
    entered = {event.entered for event in trajectory.events} | {trajectory.t[-1]}
    for index, axes in enumerate(rows):
        shaded = bands(axes)
        for time in (time for start, end, _ in shaded for time in (start, end)):
            assert min(abs(time - event) for event in entered) < 1e-12
        for span in spans(trajectory):
            if span.end <= span.start:
                continue
            middle = (span.start + span.end) / 2
            hatches = [hatch for start, end, hatch in shaded if start <= middle <= end]
            state = span.mode.states[index]
            wanted = {
                ContactState.OPEN: [],
                ContactState.STICKS: [""],
                ContactState.FORWARD: ["///"],
                ContactState.BACKWARD: ["\\\\\\"],
            }[state]
            assert [hatch or "" for hatch in hatches] == wanted
        named = {text.get_text() for text in axes.get_legend().get_texts()}
        states = {phase.state for phase in phases(trajectory, index)}
        assert named == {state.value for state in states - {ContactState.OPEN}}


@pytest.mark.slow_but_first
@pytest.mark.parametrize("scene", ["slide_and_stop", "stick_slip", "hertz_bounce"])
def test_forces_are_the_trajectorys(run, scene):
    trajectory = run(scene)
    rows = [
        axes for axes in contact(trajectory).axes if axes.get_xlabel() != "time since then (ms)"
    ]
    shown = moments(trajectory)
    for axes, force in zip(rows, trajectory.contact_forces(shown.t), strict=True):
        lines = labelled(axes)
        if force.tangential is None:
            assert np.array_equal(lines["torque"].get_ydata(), force.normal)
        else:
            assert np.array_equal(lines["normal"].get_ydata(), force.normal)
            assert np.array_equal(lines["friction"].get_ydata(), force.tangential)


def test_a_short_contact_is_shown_close_up(run):
    trajectory = run("hertz_bounce")
    _, close = contact(trajectory).axes
    first = next(span for span in spans(trajectory) if span.mode.states[0] is not ContactState.OPEN)
    assert f"from {first.start:.6g} s" in close.get_title(loc="left")
    times, force = labelled(close)["normal"].get_data()
    assert times[0] == 0
    assert 0 < times[-1] <= (first.end - first.start) * 1e3
    assert force.max() > 100
    assert force[[0, -1]] == pytest.approx(0, abs=1e-3 * force.max())


def drawn(axes, label):
    """Return the points of all lines of a label, in order of time."""
    data = [line.get_data() for line in axes.lines if line.get_label() == label]
    times, values = (np.concatenate(each) for each in zip(*data, strict=True))
    order = np.argsort(times, kind="stable")
    return times[order], values[order]


def test_impulses_are_those_of_the_impacts(run):
    trajectory = run("bounce_to_rest")
    above, axes = contact(trajectory).axes
    times = [impact.time for impact in trajectory.impacts]
    normal = [impact.normal_impulse for impact in trajectory.impacts]
    rubbed = [impact.tangential_impulse for impact in trajectory.impacts]
    for label, impulses in (("_normal", normal), ("_friction", rubbed)):
        at, found = drawn(axes, label)
        assert at == pytest.approx(times)
        assert sorted(found) == pytest.approx(sorted(impulses))
    assert axes.get_ylabel() == "impulse (N s)"
    # Forces and impulses have one time axis.
    assert axes.get_xlim() == above.get_xlim()


def test_impacts_at_one_instant_are_side_by_side_and_no_friction_is_invented(run):
    *_, axes = contact(run("elbow_and_tip")).axes
    times, impulses = drawn(axes, "_normal")
    assert len(times) == len(impulses) == 2
    assert times[0] == times[1]
    places = [
        line.get_transform().transform(line.get_xydata())[0]
        for line in axes.lines
        if line.get_label() == "_normal"
    ]
    assert abs(places[0][0] - places[1][0]) > 4
    assert "side by side" in axes.get_title(loc="left")
    assert not [line for line in axes.lines if line.get_label() == "_friction"]
    assert "friction" not in {text.get_text() for text in axes.texts}


def test_a_motion_without_contact_has_no_contact_plot(run):
    with pytest.raises(ParameterError, match="must have friction or an obstacle"):
        contact(run("free_fall"))


def test_the_end_of_the_accuracy_is_marked(run):
    trajectory = replace(run("free_fall"), error=1.0, holds_until=6.5)
    made = angles(trajectory)
    said = [text for text in made.axes[0].texts if "until here" in text.get_text()]
    assert [text.xy[0] for text in said] == [6.5]
    assert all(6.5 in [line.get_xdata()[0] for line in axes.lines] for axes in made.axes)


@pytest.mark.slow
@pytest.mark.parametrize("kind", PLOTS)
def test_a_plot_is_the_same_file_twice(run, tmp_path, kind):
    for name in ("one", "two"):
        save(PLOTS[kind](run("bounce_to_rest")), tmp_path / f"{name}.svg")
    one = (tmp_path / "one.svg").read_bytes()
    assert one == (tmp_path / "two.svg").read_bytes()
    assert len(one) < 400_000


@pytest.mark.slow_but_first
@pytest.mark.parametrize("kind", ["phase", "contact"])
def test_themes_differ(run, kind):
    light, dark = (PLOTS[kind](run("bounce_to_rest"), theme) for theme in THEMES)
    assert light.get_facecolor() == (1, 1, 1, 1)
    assert max(dark.get_facecolor()[:3]) < 0.2
    with pytest.raises(PictureError, match="theme must be one of light, dark; got 'sepia'"):
        PLOTS[kind](run("bounce_to_rest"), "sepia")


def test_impulses_too_small_to_be_seen_are_drawn_at_their_time(run):
    """The last bounces of the drop end at one instant."""
    *_, axes = contact(run("drop")).axes
    assert "side by side" not in axes.get_title(loc="left")
    stems = [line for line in axes.lines if line.get_label() in ("_normal", "_friction")]
    assert len(stems) == 2
    for line in stems:
        drawn_at = line.get_transform().transform(line.get_xydata())
        assert drawn_at == pytest.approx(axes.transData.transform(line.get_xydata()))
