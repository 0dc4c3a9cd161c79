"""The player in a real browser: contents, buttons and keys."""

from __future__ import annotations

import base64
from dataclasses import replace
from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from tests.viz.accessibility import violations
from tests.viz.films import film_of, need_browser, trajectory_of
from tests.viz.surroundings import press, surround, tabbed
from twolink import kinematics
from twolink.viz.browser import Browser
from twolink.viz.film import Film
from twolink.viz.page import player_body, player_head, player_page
from twolink.viz.run import Run

pytestmark = pytest.mark.slow

WIDTH, HEIGHT = 800, 600


@pytest.fixture(scope="module")
def browser():
    need_browser()
    with Browser() as found:
        yield found


@pytest.fixture(scope="module")
def film_page(tmp_path_factory):
    file = tmp_path_factory.mktemp("page") / "film.html"
    file.write_text(player_page(film_of("bounce_to_rest", 2.0)), encoding="utf-8")
    return file.as_uri()


@pytest.fixture
def page(browser, film_page):
    found = browser.page(WIDTH, HEIGHT)
    found.open(film_page)
    yield found
    assert found.complaints() == []
    found.call("Page.close")


def state(page):
    data = page.value("({...document.querySelector('.twolink-player').dataset})")
    return int(data["frame"]), data["playing"] == "true", float(data["speed"])


def click(page, selector, share=0.5):
    """Press and let go the mouse on an element, at a share of its width."""
    x, y, width, height = page.value(
        f"(({{x, y, width, height}}) => [x, y, width, height])"
        f"(document.querySelector('{selector}').getBoundingClientRect())"
    )
    at = {"x": x + share * width, "y": y + height / 2, "button": "left", "clickCount": 1}
    for kind in ("mousePressed", "mouseReleased"):
        page.call("Input.dispatchMouseEvent", {"type": kind, **at})


def settled(page):
    """Wait until a frame has been drawn."""
    page.value("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")


def picture(page, number):
    url = page.value(f"document.querySelector('.twolink-player').twolink.picture({number})")
    return np.array(Image.open(BytesIO(base64.b64decode(url.partition(",")[2]))).convert("RGB"))


def test_the_page_makes_no_network_requests(page, film_page):
    asked = {event["request"]["url"] for event in page.events("Network.requestWillBeSent")}
    # The page itself; its parts have no address of another host.
    assert film_page in asked
    assert all(url == film_page or url.startswith(("data:", "blob:")) for url in asked)


def test_the_player_waits_at_the_start(page):
    assert state(page) == (0, False, 1.0)
    assert page.value("document.title") == "Bounce to rest"


@pytest.mark.parametrize("means", ["click", "key"])
def test_play_and_pause(page, means):
    def toggle():
        click(page, "button.play") if means == "click" else press(page, " ", "Space")

    toggle()
    page.wait_until("Number(document.querySelector('.twolink-player').dataset.frame) > 3")
    assert state(page)[1]
    toggle()
    frame, playing, _ = state(page)
    assert not playing
    page.browser.wait_for_events(0.3)
    assert state(page)[0] == frame


@pytest.mark.parametrize("bare", [False, True])
def test_a_page_has_the_notes_of_its_motions(browser, tmp_path, bare):
    """Above all those on choices that the laws leave; a film of pictures has no room for them."""
    fall = trajectory_of("free_fall", 0.1, 3)
    one, other = (replace(fall, notes=("one <b>", name)) for name in ("two", "three"))
    file = tmp_path / "film.html"
    film = Film((Run("a", one), Run("b", other)))
    file.write_text(player_page(film, bare=bare), encoding="utf-8")
    page = browser.page(WIDTH, HEIGHT)
    page.open(file.as_uri())
    settled(page)
    notes = page.value("[...document.querySelectorAll('.remarks p')].map(p => p.textContent)")
    assert notes == ["one <b>", "two", "three"]
    shown = page.value("document.querySelector('.remarks').getBoundingClientRect().height")
    assert (shown > 30) == (not bare)
    assert violations(page) == []
    page.call("Page.close")


def test_the_player_plays_in_real_time(page):
    """By its own clock: between two pictures as many frames as the time between them has."""
    press(page, " ", "Space")
    watched = page.value(
        """new Promise(done => {
          const player = document.querySelector('.twolink-player'), seen = [];
          player.addEventListener('twolink-time', () => {
            seen.push([performance.now(), Number(player.dataset.frame)]);
            if (seen.at(-1)[1] >= seen[0][1] + 20) done([seen[0], seen.at(-1)]);
          });
        })"""
    )
    (begun, first), (ended, last) = watched
    assert first + 20 <= last < 60
    # Frames are whole, and a busy machine may pause between the picture and its time.
    assert last - first == pytest.approx(30 * (ended - begun) / 1000, abs=3)


def test_the_player_stops_at_the_end_and_restarts(page):
    press(page, "End")
    assert state(page) == (60, False, 1.0)
    click(page, "button.play")
    page.wait_until("Number(document.querySelector('.twolink-player').dataset.frame) < 60")
    press(page, "End")
    page.wait_until("document.querySelector('.twolink-player').dataset.playing === 'false'")


def test_scrubbing_by_clicks_and_keys(page):
    click(page, "input.scrub", 0.5)
    assert state(page)[0] == pytest.approx(30, abs=1)
    click(page, "input.scrub", 0.999)
    assert state(page)[0] >= 59
    press(page, "Home")
    assert state(page)[0] == 0
    for _ in range(3):
        press(page, "ArrowRight")
    assert state(page)[0] == 3
    press(page, "ArrowLeft")
    assert state(page)[0] == 2
    assert page.value("document.querySelector('.scrub').value") == "2"
    assert page.value("document.querySelector('output').textContent") == "0.07 / 2.00 s"


def test_speed_by_clicks_and_keys(page):
    click(page, "button.slower")
    assert state(page)[2] == 0.5
    click(page, "button.faster")
    click(page, "button.faster")
    assert state(page)[2] == 2
    press(page, "-")
    assert state(page)[2] == 1
    press(page, "+")
    assert state(page)[2] == 2
    for _ in range(9):
        press(page, "+")
    assert state(page)[2] == 4
    assert page.value("document.querySelector('span.speed').textContent") == "× 4"


def test_the_view_can_be_turned_and_set_back(page):
    where = (
        "document.querySelector('.twolink-player').twolink.stage.viewer.camera.position.toArray()"
    )
    before = page.value(where)
    for kind, x in (("mousePressed", 300), ("mouseMoved", 400), ("mouseReleased", 400)):
        at = {"x": x, "y": 250, "button": "left", "buttons": 1, "clickCount": 1}
        page.call("Input.dispatchMouseEvent", {"type": kind, **at})
    settled(page)
    turned = page.value(where)
    assert np.abs(np.array(turned) - before).max() > 1
    press(page, "0", "Digit0")
    settled(page)
    assert page.value(where) == pytest.approx(before, abs=1e-9)


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("size", [(1280, 720), (640, 480)])
def test_the_end_is_at_its_pixel(browser, tmp_path, theme, size):
    trajectory, film = trajectory_of("free_fall", 2.0), film_of("free_fall", 2.0, theme=theme)
    file = tmp_path / "film.html"
    file.write_text(player_page(film, bare=True), encoding="utf-8")
    page = browser.page(*size)
    page.open(file.as_uri())
    colour = [int(film.theme.end[k : k + 2], 16) for k in (1, 3, 5)]
    for number in range(2, 60, 3):
        pixels = picture(page, number)
        assert pixels.shape == (size[1], size[0], 3)
        # The trail, which is translucent, has this colour nowhere.
        rows, columns = np.nonzero((pixels == colour).all(axis=2))
        found = np.array([columns.mean(), rows.mean()]) + 0.5
        q, _ = trajectory.at([film.times[number]])
        D = kinematics.position(trajectory.chain, tuple(q[:, 0]), trajectory.chain.D)
        assert np.abs(found - film.framing(*size).pixel(np.array(D))).max() <= 3
    page.call("Page.close")


def test_the_player_follows_the_colour_scheme_of_the_reader(browser, tmp_path):
    """And becomes light with the surroundings: the same pixels as of a film in that theme."""
    pages = {name: tmp_path / f"{name}.html" for name in ("either", "light", "dark")}
    for name, file in pages.items():
        film = film_of("bounce_to_rest", 1.0, theme="dark" if name == "dark" else "light")
        body = player_body(film, dark=name == "either")
        file.write_text(f"<!DOCTYPE html>{player_head()}<body>{body}</body>", encoding="utf-8")
    page = browser.page(640, 480)

    def opened(name):
        page.open(pages[name].as_uri())
        page.wait_until("document.querySelectorAll('.twolink-player[data-ready]').length === 1")
        # With a trail, and with an impulse's mark.
        return picture(page, 16)

    def surrounded(by):
        feature = {"name": "prefers-color-scheme", "value": by}
        page.call("Emulation.setEmulatedMedia", {"features": [feature]})

    light, dark = opened("light"), opened("dark")
    assert (light != dark).any()
    surrounded("dark")
    assert (opened("either") == dark).all()
    theme = "document.querySelector('.twolink-player').dataset.theme"
    for name, expected in (("light", light), ("dark", dark)):
        surrounded(name)
        page.wait_until(f"{theme} === '{name}'")
        assert (picture(page, 16) == expected).all()
    assert page.complaints() == []
    page.call("Page.close")


def test_a_picture_depends_on_its_frame_alone(browser, film_page):
    one, other = browser.page(640, 480), browser.page(640, 480)
    for page in (one, other):
        page.open(film_page)
    straight = [picture(one, number) for number in (10, 13, 40)]
    jumping = [picture(other, number) for number in (40, 3, 13, 59, 10)]
    assert (straight[0] == jumping[4]).all()
    assert (straight[1] == jumping[2]).all()
    assert (straight[2] == jumping[0]).all()
    assert (straight[0] != straight[1]).any()
    for page in (one, other):
        page.call("Page.close")


def test_players_stand_in_a_page_of_text(browser, tmp_path):
    """Two of them, with one viewer; a wheel over them scrolls the page."""
    body = "".join(player_body(film_of(name, 1.0)) for name in ("drop", "bounce_to_rest"))
    text = "<p style='height: 700px'>text</p>"
    file = tmp_path / "report.html"
    file.write_text(
        f"<!DOCTYPE html><html><head><meta charset='utf-8'>{player_head()}</head>"
        f"<body>{body}{text}</body></html>",
        encoding="utf-8",
    )
    page = browser.page(400, 700)
    page.open(file.as_uri())
    page.wait_until("document.querySelectorAll('.twolink-player[data-ready]').length === 2")
    widths = page.value("[...document.querySelectorAll('.stage')].map(s => s.clientWidth)")
    assert widths == [384, 384]
    assert page.value("document.documentElement.scrollWidth") <= 400
    at = {"type": "mouseWheel", "x": 200, "y": 120, "deltaX": 0, "deltaY": 200}
    page.call("Input.dispatchMouseEvent", at)
    page.wait_until("scrollY > 100")
    page.value("document.querySelectorAll('.twolink-player')[1].focus()")
    press(page, "ArrowRight")
    frames = "[...document.querySelectorAll('.twolink-player')].map(p => p.dataset.frame)"
    assert page.value(frames) == ["0", "1"]
    assert page.complaints() == []
    page.call("Page.close")


def test_a_focused_button_is_pressed_by_space(page):
    page.value("document.querySelector('.faster').focus()")
    press(page, " ", "Space")
    settled(page)
    _, playing, speed = state(page)
    assert speed == 2
    assert not playing


def test_the_speed_of_the_film_is_shown_once(browser, tmp_path):
    file = tmp_path / "slow.html"
    file.write_text(player_page(film_of("bounce_to_rest", 1.0, speed=0.5)), encoding="utf-8")
    page = browser.page(WIDTH, HEIGHT)
    page.open(file.as_uri())
    assert page.value("document.querySelector('span.speed').textContent") == "× 0.5"
    assert page.value("document.querySelector('.twolink-player').closest('.bare')") is None
    page.call("Page.close")


def test_a_phone_has_a_wide_slider_and_all_buttons(browser, film_page):
    page = browser.page(390, 844)
    page.open(film_page)
    assert page.value("document.querySelector('.scrub').getBoundingClientRect().width") > 300
    for name in ("play", "slower", "faster", "view"):
        box = page.value(
            f"(() => {{ const b = document.querySelector('.{name}').getBoundingClientRect();"
            "return [b.left, b.right, b.width] })()"
        )
        assert 0 <= box[0] < box[1] <= 390
        assert box[2] >= 36
    page.call("Page.close")


def test_without_webgl_there_is_a_still(browser, tmp_path):
    blind = (
        "<script>const own = HTMLCanvasElement.prototype.getContext;"
        "HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {"
        "return kind.includes('webgl') ? null : own.call(this, kind, ...rest) };</script>"
    )
    content = player_page(film_of("bounce_to_rest", 1.0))
    file = tmp_path / "blind.html"
    file.write_text(content.replace("<head>", f"<head>{blind}", 1), encoding="utf-8")
    page = browser.page(WIDTH, HEIGHT)
    page.call("Page.navigate", {"url": file.as_uri()})
    page.wait_until("document.querySelector('.broken') !== null")
    still = "document.querySelector('.twolink-player .still')"
    assert page.value(f"getComputedStyle({still}).display") == "block"
    assert page.value(f"{still}.naturalWidth") > 100
    page.call("Page.close")


def test_a_page_follows_the_scheme_of_its_reader(browser, tmp_path):
    file = tmp_path / "film.html"
    file.write_text(player_page(film_of("bounce_to_rest", 1.0), dark=True), encoding="utf-8")
    page = browser.page(WIDTH, HEIGHT)
    for scheme in ("dark", "light"):
        page.call(
            "Emulation.setEmulatedMedia",
            {"features": [{"name": "prefers-color-scheme", "value": scheme}]},
        )
        page.open(file.as_uri())
        assert page.value("document.querySelector('.twolink-player').dataset.theme") == scheme
    page.call("Page.close")


@pytest.mark.parametrize(
    ("name", "duration"),
    [
        ("drop", 3.0),
        ("stick_slip", 3.0),
        ("joint_stops", 2.5),
        ("painleve", 0.5),
        ("slide_and_stop", 3.0),
        ("elbow_and_tip", 1.5),
        ("bounce_to_rest", 3.0),
    ],
)
def test_no_label_lies_on_a_mark_or_on_another_label(browser, tmp_path, name, duration):
    """Marks are rings, arrows, links, stops and the edges of surfaces."""
    file = tmp_path / "film.html"
    file.write_text(player_page(film_of(name, duration), bare=True), encoding="utf-8")
    page = browser.page(960, 600)
    page.open(file.as_uri())
    crowded = page.value(
        """(() => {
          const { source, stage } = document.querySelector('.twolink-player').twolink;
          return source.frames.map(({ words }) => {
            stage.words = words;
            stage.write();
            return stage.crowded.length;
          });
        })()"""
    )
    assert len(crowded) == 30 * duration + 1
    # Where rings of many impacts and a fold of the chain leave no place, a label covers a mark.
    assert sum(map(bool, crowded)) <= 0.05 * len(crowded)
    page.call("Page.close")


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [390, 1280])
def test_the_player_is_accessible(browser, tmp_path, width, scheme):
    file = tmp_path / "film.html"
    file.write_text(player_page(film_of("bounce_to_rest", 1.0), dark=True), encoding="utf-8")
    page = browser.page(width, 800)
    surround(page, prefers_color_scheme=scheme)
    page.open(file.as_uri())
    assert violations(page) == []
    page.call("Page.close")


def test_the_keyboard_alone_reaches_everything_in_order(page):
    # The player itself, which has no buttons of its own, is first.
    assert tabbed(page, 6) == [
        "motion: Bounce to rest",
        "play",
        "time",
        "slower",
        "faster",
        "reset view",
    ]
    page.value("document.querySelector('.scrub').focus()")
    press(page, "ArrowRight")
    assert state(page)[0] == 1
    ring = "getComputedStyle(document.querySelector('.play')).outlineStyle"
    page.value("document.querySelector('.scrub').focus()")
    press(page, "Tab", shift=True)
    assert page.value("document.activeElement.className") == "play"
    assert page.value(ring) != "none"


def test_the_player_stands_still_if_reduced_motion_is_preferred(browser, tmp_path):
    """A film in a page waits; `test_live` has a stream."""
    file = tmp_path / "film.html"
    file.write_text(player_page(film_of("bounce_to_rest", 1.0)), encoding="utf-8")
    page = browser.page(WIDTH, HEIGHT)
    surround(page, prefers_reduced_motion="reduce")
    page.open(file.as_uri())
    page.browser.wait_for_events(0.3)
    assert state(page)[:2] == (0, False)
    moving = "document.getAnimations().length"
    assert page.value(moving) == 0
    page.call("Page.close")
