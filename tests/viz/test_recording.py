"""Recordings by a real browser: every frame once, at its time, in the requested size."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.viz.films import film_of, gone, need_browser, pretended_browser, processes_with
from twolink.errors import BrowserError, PictureError
from twolink.viz import recording
from twolink.viz.browser import BROWSER
from twolink.viz.encoding import decoded
from twolink.viz.recording import check_recording, record

SIZE = (320, 240)


@pytest.fixture
def scratch(monkeypatch):
    """A folder of its own for all that is temporary; its path is short, as a browser wants it."""
    with tempfile.TemporaryDirectory(prefix="t-", dir="/tmp") as folder:
        monkeypatch.setattr(tempfile, "tempdir", folder)
        yield Path(folder)


@pytest.mark.slow
def test_pages_need_no_browser(tmp_path, monkeypatch):
    monkeypatch.setenv(BROWSER, "/nowhere")
    reports = []
    record(film_of("drop", 1.0), tmp_path / "a.html", progress=lambda *stage: reports.append(stage))
    assert (tmp_path / "a.html").read_text().startswith("<!DOCTYPE html>")
    assert reports[-1] == ("frames", 1.0)


@pytest.mark.parametrize("suffix", [".mp4", ".webm", ".gif", ".png"])
def test_without_a_browser_no_file_is_written(suffix, tmp_path, monkeypatch):
    monkeypatch.setenv(BROWSER, "/nowhere")
    with pytest.raises(PictureError, match="no Chromium or Chrome was found"):
        record(film_of("drop", 1.0, fps=25), tmp_path / f"a{suffix}")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "size", "words"),
    [("a.avi", SIZE, "must be one of .mp4, .webm, .gif, .png, .html"),
     ("a.mp4", (10, 10), "must be 160 to 7680"), ("a.mp4", (641, 480), "even")],
)  # fmt: skip
def test_invalid_recordings_are_rejected(name, size, words):
    with pytest.raises(PictureError, match=words):
        check_recording(Path(name), size, 30.0)


def test_a_time_outside_the_film_is_refused_also_without_a_browser(tmp_path, monkeypatch):
    monkeypatch.setenv(BROWSER, "/nowhere")
    with pytest.raises(PictureError, match=r"at must be 0 to 1 s; got 3 s"):
        record(film_of("drop", 1.0), tmp_path / "a.png", at=3.0)


@pytest.mark.parametrize("suffix", [".mp4", ".webm", ".gif", ".html"])
def test_a_time_goes_with_a_picture_alone(suffix, tmp_path):
    """As a frame it would be off the grid of the others."""
    wanted = f"at must be left out with a {suffix} file; got 0.01 s"
    with pytest.raises(PictureError, match=wanted):
        record(film_of("drop", 1.0, fps=25), tmp_path / f"a{suffix}", at=0.01)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
@pytest.mark.parametrize(("suffix", "fps"), [(".mp4", 30.0), (".webm", 24.0), (".gif", 20.0)])
def test_a_film_has_every_frame_once_at_its_time(suffix, fps, scratch, tmp_path):
    need_browser()
    file = tmp_path / f"film{suffix}"
    film = film_of("drop", 1.0, fps=fps, speed=0.5)
    record(film, file, size=SIZE)
    found = decoded(file)
    count = int(2 * fps) + 1
    assert (found.width, found.height) == SIZE
    assert len(film.times) == len(found.times) == count
    assert [float(t) for t in found.times] == pytest.approx(
        [k / fps for k in range(count)], abs=1e-3
    )
    assert float(found.duration) == pytest.approx(count / fps, abs=2e-3)
    # All of them show something else: the first frames move least, and more than nothing.
    assert len(set(found.pictures)) > 0.9 * count
    assert list(scratch.iterdir()) == []
    assert [path.name for path in tmp_path.iterdir()] == [file.name]


@pytest.mark.slow
def test_a_second_recording_is_the_same_to_the_pixel(scratch, tmp_path):
    need_browser()
    pictures = []
    for name in ("one.mp4", "other.mp4"):
        record(film_of("bounce_to_rest", 1.0), tmp_path / name, size=SIZE)
        pictures.append(decoded(tmp_path / name).pictures)
    assert len(pictures[0]) == 31
    assert pictures[0] == pictures[1]


@pytest.mark.slow
@pytest.mark.parametrize("fps", [30.0, 1.5])
def test_a_picture_is_the_frame_at_its_time(fps, scratch, tmp_path):
    need_browser()
    # At 1.5 frames a second, the last frame is at 2/3 s.
    film = replace(film_of("bounce_to_rest", 1.0), fps=fps)
    for name, at in (("end.png", None), ("same.png", 1.0), ("middle.png", 0.5)):
        record(film, tmp_path / name, size=SIZE, at=at)
    end, same, middle = (
        np.array(Image.open(tmp_path / f"{n}.png")) for n in ("end", "same", "middle")
    )
    assert end.shape[:2] == (SIZE[1], SIZE[0])
    assert (end == same).all()
    assert (end != middle).any()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "words"), [(signal.SIGKILL, "ended"), (signal.SIGSTOP, "no sign")]
)
def test_a_browser_that_dies_or_hangs_leaves_no_file(number, words, scratch, tmp_path):
    need_browser()
    struck = []

    def strike(stage, share):
        if stage == "pictures" and share > 0.2 and not struck:
            browsers = [p for p in processes_with(str(scratch)) if os.getpgid(p) == p]
            struck.extend(browsers)
            os.killpg(browsers[0], number)

    film = replace(film_of("bounce_to_rest", 1.0), fps=60.0)
    (tmp_path / "film.mp4").write_bytes(b"the old film")
    with pytest.raises(BrowserError, match=words):
        record(film, tmp_path / "film.mp4", size=SIZE, patience=3.0, progress=strike)
    assert struck
    assert (tmp_path / "film.mp4").read_bytes() == b"the old film"
    assert [path.name for path in tmp_path.iterdir()] == ["film.mp4"]
    assert list(scratch.iterdir()) == []
    assert gone(str(scratch))


@pytest.mark.slow
def test_the_decoded_film_is_the_requested_one(scratch, tmp_path, monkeypatch):
    """A frame that the encoder loses is noticed, and the file goes."""
    need_browser()

    def losing(file):
        found = decoded(file)
        return replace(found, times=(*found.times[:-2], found.times[-1] + Fraction(1, 30)))

    monkeypatch.setattr(recording, "decoded", losing)
    with pytest.raises(BrowserError, match="30 frames and not 31"):
        record(film_of("drop", 1.0), tmp_path / "film.mp4", size=SIZE)
    assert list(tmp_path.iterdir()) == []


def record_process(target, scratch, browser):
    """Start `twolink record` to a target, with all that is temporary in a folder."""
    words = ("record", "bounce_to_rest", "--fps", "10", "--size", "320x240", "--out", str(target))
    environment = {**os.environ, "TMPDIR": str(scratch)}
    if browser is not None:
        environment[BROWSER] = str(browser)
    return subprocess.Popen(
        [sys.executable, "-m", "twolink.cli", *words],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment,
    )  # fmt: skip


def wait_until(condition, seconds=60.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


@pytest.mark.slow
@pytest.mark.parametrize("real", [False, True])
def test_a_killed_recording_is_cleaned_up_by_the_next(real, tmp_path, scratch):
    """Killed while the encoder writes frames: its files stay, and nobody else's go."""
    if real:
        need_browser()
    target, browsers = tmp_path / "film.mp4", [None, None]
    target.write_bytes(b"the old film")
    if not real:
        programs = tmp_path / "programs"
        for number, pause in enumerate((0.3, 0.0)):
            (programs / str(number)).mkdir(parents=True)
            browsers[number] = pretended_browser(programs / str(number), pause)
    (scratch / "twolinkish").mkdir()

    def left():
        beside = [path.name for path in tmp_path.glob(".twolink-*")]
        return beside, [path.name for path in scratch.glob("twolink-*")]

    def writes():
        """Whether the encoder has been started, and with it the pictures."""
        return any("ffmpeg" in command(p) for p in processes_with(str(tmp_path / ".twolink-")))

    killed = record_process(target, scratch, browsers[0])
    wait_until(writes)
    time.sleep(0.5)
    assert killed.poll() is None
    killed.kill()
    killed.communicate()
    assert target.read_bytes() == b"the old film"
    beside, folders = left()
    assert len(beside) == 1
    assert {name.rpartition("-")[0] for name in folders} == {"twolink-web", "twolink-page"}
    # Browser and encoder end by themselves.
    wait_until(lambda: not processes_with(str(scratch)))
    following = record_process(target, scratch, browsers[1])
    said = following.communicate(timeout=120)
    assert following.returncode == 0, said
    assert left() == ([], [])
    assert [path.name for path in scratch.iterdir()] == ["twolinkish"]
    assert len(decoded(target).times) > 10


def command(process):
    try:
        return Path(f"/proc/{process}/cmdline").read_text(errors="replace")
    except OSError:
        return ""
