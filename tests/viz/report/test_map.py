"""The page of a map: its numbers, its refusals, and its use in a real browser."""

from __future__ import annotations

import base64
import json
import re
import shutil
import struct
import zlib

import numpy as np
import pytest
import zarr

from tests.ensembles.cases import axis, ensemble
from tests.viz.accessibility import violations
from tests.viz.films import need_browser
from tests.viz.surroundings import press, surround
from twolink import sweep
from twolink.chain import Chain
from twolink.data import data_path
from twolink.ensembles.first_time import HAPPENS
from twolink.errors import PictureError, SceneError
from twolink.urdf import read_planar_urdf
from twolink.viz.browser import Browser
from twolink.viz.report import map as map_module
from twolink.viz.report.map import map_page

GRID = {"first": -1.4, "last": 4.2, "count": 5}
KEEP = {"samples": 31, "first": [{"name": "flip", "of": "either"}]}
RUNS = {"duration": 2.0, "accuracy": 1e-6}
LENGTHS = axis("chain.length.1", 1.0, 0.5, -1.0, name="L2")


def swept(folder, **tables):
    asked = ensemble(**{"runs": RUNS, "keep": KEEP, "title": "<Flips>", **tables})
    return sweep(asked, folder / "a.zarr", workers=1)


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    folder = tmp_path_factory.mktemp("map")
    return swept(folder, axes=[axis("start.q.0", grid=GRID, name="q1"), LENGTHS])


@pytest.fixture(scope="module")
def page(found):
    return map_page(found)


def numbers_of(page):
    packed = re.search(r'application/x-twolink-map">([^<]*)<', page)[1]
    message = zlib.decompress(base64.b64decode(packed))
    (length,) = struct.unpack("<I", message[:4])
    head = json.loads(message[4 : 4 + length])
    parts = np.frombuffer(message[4 + length :], "<i4").reshape(-1, head["samples"], 2)
    return head, parts


def test_the_page_has_the_motion_of_each_run(found, page):
    head, parts = numbers_of(page)
    assert head["names"] == ["q1", "L2"]
    assert head["units"] == ["rad", "m"]
    assert head["places"][1] == [-1.0, 0.5, 1.0]
    grid = found.grid().sortby("L2")
    motions = grid["q_samples"].transpose("L2", "q1", "sample", "link").values.reshape(15, 31, 2)
    angles = parts.cumsum(axis=1) * (2 * np.pi / head["turn"])
    assert not np.isnan(motions[5:]).any()
    assert np.abs(angles[5:] - motions[5:]).max() < 5e-5
    assert np.abs(motions[5:]).max() > np.pi


def test_runs_have_their_own_lengths_and_results(found, page):
    head, parts = numbers_of(page)
    assert head["lengths"] == [[0.0, 0.0]] * 5 + [[1.0, 0.5]] * 5 + [[1.0, 1.0]] * 5
    assert all(words.startswith("failed: link 2: ") for words in head["words"][:5])
    assert (parts[:5, 1:] == 0).all()
    flips = np.flatnonzero(found.grid()["flip_verdict"].sel(L2=1.0).values == HAPPENS)
    assert 0 < len(flips) < 5
    for column in range(5):
        row = found.grid().isel(q1=column).sel(L2=1.0)
        time, bound = float(row["flip_time"]), float(row["flip_bound"])
        flip = f"flip at {time:.6f} s, within {bound:.1e} s"
        assert head["words"][10 + column] == (flip if column in flips else "no flip until 2 s")


@pytest.mark.slow
def test_runs_have_their_notes(tmp_path):
    """The pixel in which two points strike at once has the other motion in its words."""
    found = swept(
        tmp_path,
        scene="elbow_and_tip",
        axes=[axis("start.q.0", 0.5, 0.51), axis("start.u.0", 2.0, 2.1)],
        keep={"samples": 3, "first": [{"name": "turns", "of": "q1", "level": 1.0}]},
    )
    one, *others = numbers_of(map_page(found))[0]["words"]
    assert re.fullmatch(r"turns at .* s\. At 0\.535.* by 3\.58 rad/s\.", one)
    assert not any("determine the order" in words for words in others)
    group = zarr.open_group(found.path, mode="r+")
    del group["notes"]
    older = numbers_of(map_page(found))[0]["words"]
    assert older == [one.partition(". ")[0], *others]


def test_one_pair_of_lengths_serves_equal_chains(tmp_path):
    speeds = axis("start.u.0", 0.0, 1.0, name="u1")
    made = swept(tmp_path, axes=[axis("start.q.0", grid=GRID, name="q1"), speeds])
    assert numbers_of(map_page(made))[0]["lengths"] == [[1.0, 1.0]]


def test_a_random_length_of_one_draw_is_the_drawn_one(tmp_path):
    axes = [
        axis("start.q.0", 0.5, 1.0, name="q1"),
        axis("start.u.0", 0.0, 1.0, name="u1"),
        axis("chain.length.1", uniform={"low": 0.5, "high": 0.7}, name="L2"),
    ]
    made = swept(tmp_path, axes=axes, runs={**RUNS, "draws": 1})
    (length,) = set(made.array("L2").tolist())
    assert 0.5 < length < 0.7
    assert numbers_of(map_page(made))[0]["lengths"] == [[1.0, length]] * 4


SWEEP_OF_URDF = """
axes = [
    {parameter = "start.theta.0", values = [-1.0, 1.0]},
    {parameter = "start.theta.1", values = [-1.0, 1.0]},
]
keep = {samples = 2, first = [{name = "flip", of = "either"}]}
[scene]
chain = {urdf = "arm.urdf"}
start = {theta = [0.0, 0.0]}
run = {duration = 0.5}
effects = {gravity = {}}
"""


@pytest.mark.slow
def test_the_lengths_of_a_urdf_are_known_wherever_the_store_is(tmp_path):
    """Its name is relative to the folder of the sweep, and it may be gone."""
    for folder in ("sweep", "store"):
        (tmp_path / folder).mkdir()
    urdf = tmp_path / "sweep" / "arm.urdf"
    shutil.copy(data_path("twolink.urdf"), urdf)
    file = tmp_path / "sweep" / "sweep.toml"
    file.write_text(SWEEP_OF_URDF)
    made = sweep(file, tmp_path / "store" / "a.zarr", workers=1)
    chain = Chain.from_links(read_planar_urdf(urdf).links)
    urdf.unlink()
    assert numbers_of(map_page(made))[0]["lengths"] == [[chain.L1, chain.L2]]


@pytest.mark.slow
def test_a_start_of_any_size_is_right_but_for_whole_turns(tmp_path):
    """Also one whose number of parts of a turn needs more than 4 bytes."""
    axes = [axis("start.q.0", -1e9, 1e9, name="q1"), axis("start.u.0", 0.0, 1.0, name="u1")]
    made = swept(tmp_path, axes=axes, runs={"duration": 0.1, "accuracy": 1e-3})
    _, parts = numbers_of(map_page(made))
    motions = made.grid()["q_samples"].transpose("u1", "q1", ...).values.reshape(4, 31, 2)
    assert not np.isnan(motions).any()
    angles = parts.cumsum(axis=1) * (2 * np.pi / 2**16)
    assert np.abs(np.exp(1j * angles) - np.exp(1j * motions)).max() < 5e-5


def test_fast_turns_between_samples_fit_their_numbers():
    angles = np.array([[[0.0, 3.0], [1e6, -1e7], [-1e9, 2.0]]])
    parts = map_module._differences(angles)
    assert np.abs(parts).max() < 2**31
    shown = parts.cumsum(axis=1) * (2 * np.pi / 2**16)
    assert np.abs(np.exp(1j * shown) - np.exp(1j * angles)).max() < 5e-5


@pytest.mark.slow
@pytest.mark.parametrize("values", [(1.0, 0.5, 2.0), (2.0, 1.0, 0.5), (0.5, 1.0, 0.5, 2.0, 1.0)])
def test_values_in_any_order_or_twice_have_the_motion_of_their_pixel(values, tmp_path):
    axes = [axis("start.q.0", *values, name="q1"), axis("chain.length.1", *values, name="L2")]
    head, parts = numbers_of(map_page(swept(tmp_path, axes=axes)))
    assert head["places"] == [[0.5, 1.0, 2.0]] * 2
    assert head["lengths"] == [[1.0, L2] for L2 in head["places"][1] for _ in range(3)]
    starts = parts[:, 0, 0].reshape(3, 3) * (2 * np.pi / head["turn"])
    assert np.abs(starts - head["places"][0]).max() < 5e-5


def test_titles_are_text(page):
    assert "<h1>&lt;Flips&gt;</h1>" in page


@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    ("keep", "axes", "words"),
    [
        ({"first": KEEP["first"]}, 2, r"must have the motions of its runs .*; got none"),
        ({"samples": 3}, 2, "must have first times for a picture"),
        (KEEP, 1, "must have first times over two axes; got others"),
    ],
)
def test_results_that_make_no_map_are_refused(keep, axes, words, tmp_path):
    made = swept(tmp_path, keep=keep, axes=[axis("start.q.0", grid=GRID), LENGTHS][:axes])
    with pytest.raises(PictureError, match=words):
        map_page(made)


def test_an_axis_of_one_value_twice_is_none_of_two_axes(tmp_path):
    made = swept(tmp_path, axes=[axis("start.q.0", 1.0, 1.0), LENGTHS])
    with pytest.raises(PictureError, match="must have first times over two axes; got others"):
        map_page(made)


def test_chains_that_are_refused_have_no_lengths(monkeypatch):
    def refused(*_):
        raise SceneError("refused")

    family = ensemble(axes=[LENGTHS]).family
    monkeypatch.setattr(type(family), "parts", refused)
    assert map_module._chain(family, [1.0]) is None


def test_motions_beyond_the_limit_of_memory_are_refused(found, monkeypatch):
    monkeypatch.setattr(map_module, "_MOST", 1000.0)
    with pytest.raises(PictureError, match="at most 1e\\+03 bytes; got 15 runs of 31 samples, "):
        map_page(found)


@pytest.fixture(scope="module")
def shown(page, tmp_path_factory):
    need_browser()
    file = tmp_path_factory.mktemp("page") / "map.html"
    file.write_text(page, encoding="utf-8")
    with Browser() as browser:
        opened = browser.page(900, 700)
        opened.call("Page.navigate", {"url": file.as_uri()})
        opened.wait_until("document.querySelector('.explorer[data-ready]') !== null")
        yield opened
        assert opened.complaints() == []


def words_of(shown):
    return shown.value("document.querySelector('.chosen').textContent")


def click(shown, across, down):
    """Click at a place of the map's axes, in parts of their size."""
    x, y, width, height = shown.value(
        "(({x, y, width, height}) => [x, y, width, height])"
        "(document.querySelector('.chooser .frame').getBoundingClientRect())"
    )
    left, right, top, bottom = shown.box
    place = {
        "x": x + width * (left + across * (right - left)),
        "y": y + height * (top + down * (bottom - top)),
    }
    for kind in ("mousePressed", "mouseReleased"):
        about = {"type": kind, "button": "left", "clickCount": 1}
        shown.call("Input.dispatchMouseEvent", {**about, **place})


@pytest.mark.slow
def test_a_click_shows_the_motion_of_its_run(shown, page):
    head, _ = numbers_of(page)
    shown.box = head["box"]
    surround(shown, prefers_reduced_motion="no-preference")
    click(shown, 0.1, 0.1)
    # The first column, and the highest row.
    assert words_of(shown) == f"q1 = -1.4 rad, L2 = 1 m: {head['words'][10]}"
    shown.wait_until("parseFloat(document.querySelector('.clock').textContent) > 0.2")
    shown.value("document.querySelector('.play').click()")
    stopped = shown.value("document.querySelector('.clock').textContent")
    assert shown.value("document.querySelector('.play').getAttribute('aria-label')") == "Play"
    assert shown.value("document.querySelector('.clock').textContent") == stopped
    colours = shown.value(
        "(() => { const c = document.querySelector('canvas'); const found = new Set();"
        " const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;"
        " for (let k = 0; k < d.length; k += 4)"
        " if (d[k + 3] === 255) found.add(d.slice(k, k + 3).join());"
        " return found.size; })()"
    )
    assert colours >= 3


@pytest.mark.slow
def test_the_arrow_keys_choose_and_reduced_motion_rests(shown, page):
    head, _ = numbers_of(page)
    shown.box = head["box"]
    surround(shown, prefers_reduced_motion="reduce")
    click(shown, 0.5, 0.5)
    shown.value("document.querySelector('.chooser').focus()")
    press(shown, "ArrowRight")
    press(shown, "ArrowUp")
    run = 2 * 5 + 3
    assert words_of(shown).endswith(f": {head['words'][run]}")
    assert shown.value("document.querySelector('.clock').textContent") == "0.00 s"
    press(shown, "ArrowUp")
    assert words_of(shown).endswith(f": {head['words'][run]}")


@pytest.mark.slow
def test_the_page_is_accessible(shown):
    assert violations(shown) == []
