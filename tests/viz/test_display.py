"""Pictures from Python: plots, films and pages of trajectories, drawings of scenes."""

import webbrowser
import xml.etree.ElementTree as ET
from pathlib import Path
from urllib.parse import unquote, urlparse

import pytest

from twolink.chain import Chain
from twolink.errors import ParameterError, PictureError
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.viz import display


@pytest.fixture(scope="module")
def fall():
    return simulate(Scene.load("free_fall"), samples=101)


def test_a_plot_from_a_trajectory(fall):
    above, below = fall.plot("angles", theme="dark").axes
    assert above.get_ylabel() == "angle (rad)"
    assert below.lines
    with pytest.raises(PictureError, match="kind must be one of"):
        fall.plot("speeds")


def test_several_trajectories_have_different_names(fall):
    above, _ = fall.plot("angles", fall, fall).axes
    names = {line.get_label() for line in above.lines if line.get_label().startswith("$q_1")}
    assert len(names) == 3
    named, _ = fall.plot("angles", fall, names=["again"]).axes
    assert "$q_1$, again" in {line.get_label() for line in named.lines}


@pytest.mark.parametrize("names", [["x (4)", "x", "x"], ["x", "x", "x"], ["x", "x", "x (2)"]])
def test_every_motion_is_drawn_whatever_its_name(fall, names):
    above, _ = fall.plot("angles", fall, fall, fall, names=names).axes
    labels = {line.get_label() for line in above.lines}
    assert len({label for label in labels if label.startswith("$q_1")}) == 4


@pytest.mark.parametrize("others", [0, 1])
def test_more_names_than_motions_are_refused(fall, others):
    wanted = f"names must be at most {others}, one for each further motion; got 2"
    with pytest.raises(ParameterError, match=wanted):
        fall.plot("path", *[fall] * others, names=("one", "two"))


def test_motions_of_one_film_have_different_names(fall):
    title = fall.scene.title
    assert display.film(fall, fall, fall).names == (title, f"{title} (2)", f"{title} (3)")


@pytest.mark.slow
def test_a_page_of_a_long_motion_has_a_bounded_number_of_frames(fall):
    # 10 s at 30 frames per second are 301 frames.
    assert display.page(fall).count("twolink-player") > 0
    assert len(display.film(fall).times) == 301
    long = simulate(Scene.load("acrobot"), samples=3)
    assert long.t[-1] >= 10


@pytest.mark.slow
def test_the_player_of_a_cell_is_a_page_of_its_own(fall):
    frame = ET.fromstring(display.player(fall).replace(" allowfullscreen", ""))
    assert frame.tag == "iframe"
    assert frame.get("title") == "Motion: Free fall from the horizontal"
    assert frame.get("srcdoc").startswith("<!DOCTYPE html>")


@pytest.mark.slow
def test_show_opens_a_page_outside_of_notebooks(fall, monkeypatch):
    opened = []
    monkeypatch.setattr(webbrowser, "open", opened.append)
    fall.show()
    (address,) = opened
    file = Path(unquote(urlparse(address).path))
    assert file.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    file.unlink()


def test_a_page_is_recorded(fall, tmp_path):
    fall.record(tmp_path / "fall.html", fps=5)
    assert (tmp_path / "fall.html").stat().st_size > 100_000
    with pytest.raises(PictureError, match="the suffix must be one of"):
        fall.record(tmp_path / "fall.avi")


def test_drawings_are_svg_of_the_start():
    scene = Scene.load("bounce_to_rest")
    for thing in (scene, Chain.uniform_bars()):
        drawn = ET.fromstring(display.drawing(thing))
        assert drawn.tag.endswith("svg")


@pytest.mark.slow
def test_scenes_and_chains_in_notebooks_have_a_drawing_and_a_table():
    scene = Scene.load("bounce_to_rest")
    for thing, words in ((scene, "Surface(point="), (scene.chain, "mass (kg)")):
        page = ET.fromstring(f"<div>{thing._repr_html_()}</div>")
        assert page[0].tag.endswith("svg")
        assert words in "".join(page[1].itertext())
