import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

import twolink.viz.browser
from tests.viz.films import need_browser, trajectory_of
from tests.viz.surroundings import surround
from twolink.viz.animation import animation
from twolink.viz.browser import Browser

ROOT = Path(__file__).parent.parent.parent
SHOWN = ROOT / "docs" / "drop.svg"


def keyframes(text, name):
    """Return the percentages and the values of an animation."""
    found = re.search(rf"@keyframes {name}\{{(.*?)\}}\}}", text)[1] + "}"
    pairs = re.findall(r"([\d.]+)%\{[a-z-]+:(?:rotate\()?(-?[\d.]+)", found)
    return np.array(pairs, dtype=float).T


def test_keyframes_are_states_of_the_motion():
    trajectory = trajectory_of("drop")
    share, link1 = keyframes(animation(trajectory), "link1")
    _, link2 = keyframes(animation(trajectory), "link2")
    # The motion has 5 s, and a pause of 1 s.
    times = np.minimum(share[:-1] / 100 * 6.0, 5.0)
    q, _ = trajectory.at(times)
    # Times are rounded to 0.3 ms, angles to 0.01 degrees.
    tolerance = np.degrees(3e-4 * 5 + 2e-4)
    assert link1[:-1] == pytest.approx(np.degrees(q[0]), abs=tolerance)
    assert link2[:-1] == pytest.approx(np.degrees(q[1] - q[0]), abs=2 * tolerance)
    assert link1[-1] == link1[-2]


def test_the_picture_of_the_readme_is_this_scene_and_small():
    shown, made = SHOWN.read_text(encoding="utf-8"), animation(trajectory_of("drop"))
    assert len(shown) < 100_000
    for name in ("link1", "link2", "trail"):
        assert keyframes(shown, name) == pytest.approx(keyframes(made, name), abs=0.02)
    # Numbers aside, it is the same text.
    assert re.sub(r"-?[\d.]+", "#", shown) == re.sub(r"-?[\d.]+", "#", made)


def test_an_animation_has_no_scripts_or_requests():
    root = ET.fromstring(animation(trajectory_of("drop")))
    tags = {element.tag.partition("}")[2] for element in root.iter()}
    assert tags <= {
        "svg", "title", "style", "rect", "g", "line", "path", "polyline", "circle"
    }  # fmt: skip
    assert "url(" not in animation(trajectory_of("drop"))
    # Five impacts are more than a fiftieth of the largest.
    rings = [one for one in root.iter() if one.get("class") == "impact"]
    assert len(rings) == 5


@pytest.mark.slow
def test_an_animation_moves_unless_reduced_motion_is_preferred():
    need_browser()
    running = "document.getAnimations().filter((each) => each.playState === 'running').length"
    with Browser() as browser:
        for preferred, count in (("no-preference", 3 + 5), ("reduce", 0)):
            page = browser.page(640, 480)
            surround(page, prefers_reduced_motion=preferred)
            page.call("Page.navigate", {"url": SHOWN.as_uri()})
            page.wait_until("document.documentElement.tagName === 'svg'")
            assert page.value(running) == count


@pytest.mark.slow
@pytest.mark.parametrize(
    ("flags", "moves"), [((), True), (("--force-prefers-reduced-motion",), False)]
)
def test_an_image_moves_unless_reduced_motion_is_preferred(monkeypatch, tmp_path, flags, moves):
    """A browser's own setting reaches images; the emulation of a page does not."""
    need_browser()
    monkeypatch.setattr(twolink.viz.browser, "_FLAGS", (*twolink.viz.browser._FLAGS, *flags))
    file = tmp_path / "page.html"
    file.write_text(f'<title>page</title><img alt="the drop" src="{SHOWN.as_uri()}">')
    with Browser() as browser:
        page = browser.page(640, 480)
        page.call("Page.navigate", {"url": file.as_uri()})
        page.wait_until("document.title === 'page' && document.readyState === 'complete'")
        shots = []
        for _ in range(3):
            shots.append(page.call("Page.captureScreenshot")["data"])
            page.value("new Promise((done) => setTimeout(done, 300))")
    assert len(set(shots)) == (3 if moves else 1)


@pytest.mark.slow
def test_the_module_writes_an_animation(tmp_path):
    file = tmp_path / "drop.svg"
    command = [sys.executable, "-m", "twolink.viz.animation", "drop", str(file)]
    subprocess.run(command, check=True, cwd=ROOT)
    assert file.read_text(encoding="utf-8") == animation(trajectory_of("drop", samples=201))
