"""`twolink view` and `twolink record`: options, errors, and exit codes."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.viz.films import film_of, gone, need_browser, processes_with, trajectory_of
from tests.viz.test_live import listening
from twolink.cli import app
from twolink.cli.showing import film_of as film_asked_for
from twolink.data import data_path
from twolink.viz.browser import BROWSER, Browser
from twolink.viz.run import TRAIL_RATE

SCENES = data_path("scenes")


def run(*words):
    return CliRunner().invoke(app, [str(word) for word in words])


def asked(motion, **others):
    options = {
        "ghosts": [], "nearby": None, "urdf": None, "fps": 30.0, "speed": 1.0, "theme": "light",
    }  # fmt: skip
    return film_asked_for(motion, **{**options, **others})


@pytest.fixture
def short(tmp_path):
    """A scene that lasts a second."""
    file = tmp_path / "short.toml"
    text = (SCENES / "general.toml").read_text().replace("duration = 10.0", "duration = 1.0")
    file.write_text(text)
    return file


@pytest.fixture
def scratch():
    with tempfile.TemporaryDirectory(prefix="t-", dir="/tmp") as folder:
        yield Path(folder)


def test_record_writes_a_page(short, tmp_path):
    result = run("record", short, "--out", tmp_path / "film.html", "--theme", "dark")
    assert result.exit_code == 0, result.output
    assert "31 frames" in result.output
    assert 'data-theme="dark"' in (tmp_path / "film.html").read_text()


@pytest.mark.parametrize("suffix", [".npz", ".csv"])
def test_trajectories_are_shown_as_they_are_kept(suffix, tmp_path):
    trajectory = trajectory_of("bounce_to_rest", 1.0)
    trajectory.save(tmp_path / f"kept{suffix}")
    film = asked(tmp_path / f"kept{suffix}")
    assert (film.runs[0].trajectory.q == trajectory.q).all()
    # Samples of every 2 ms: frames of 0.1 s are the same frames.
    dense = film_of("bounce_to_rest", 1.0)
    for k in (0, 15, 30):
        assert film.frame(k).words["T"] == pytest.approx(dense.frame(k).words["T"], abs=2e-4)


def metres_in(words):
    """The distance (m) in words such as "D is 1.5 · 10⁻⁶ m away"."""
    digits, power = re.fullmatch(r"D is ([\d.]+)(?: · 10(\S+))? m away", words).groups()
    raised = (power or "0").translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789"))
    return float(digits) * 10.0 ** int(raised)


def test_ghosts_by_formulation_engine_and_file(short):
    film = asked(short, ghosts=["kane", "pinocchio", str(SCENES / "drop.toml")], nearby=1e-6)
    assert film.names == (
        "short, momenta", "kane", "Pinocchio, by SciPy's DOP853", "drop", "q1 +1e-06 rad",
    )  # fmt: skip
    distances = [metres_in(words) for words in film.frame(30).words["apart"]]
    # Two formulations agree, and Pinocchio by another integrator to its tolerance.
    assert distances[0] < 1e-11
    assert distances[1] < 1e-10
    assert distances[2] > 1e-2
    assert 1e-7 < distances[3] < 1e-4
    # Its samples are the frames, and the points of a slow motion's trail between them.
    assert film.runs[2].trajectory.t == pytest.approx(np.linspace(0.0, 1.0, TRAIL_RATE + 1))


def test_a_scene_s_own_urdf_is_shown(tmp_path):
    (tmp_path / "robot.urdf").write_text(data_path("twolink.urdf").read_text())
    text = (SCENES / "general.toml").read_text().replace("duration = 10.0", "duration = 0.2")
    chain = re.sub(r"mass = .*\nlength = .*\n", 'urdf = "robot.urdf"\n', text)
    (tmp_path / "scene.toml").write_text(chain)
    assert asked(tmp_path / "scene.toml").bodies
    result = run(
        "record", SCENES / "drop.toml", "--urdf", tmp_path / "none.urdf", "--out",
        tmp_path / "a.html",
    )  # fmt: skip
    assert result.exit_code == 2
    assert "none.urdf" in result.output


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["none.toml"], "none.toml: there is no file"),
        (["none.npz"], "none.npz: there is no file"),
        ([data_path("twolink.urdf")], "got a URDF, which has no motion: name it in a scene file"),
        ([SCENES / "drop.toml", "--fps", "0"], "fps must be 0.01 to 240; got 0.0"),
        ([SCENES / "drop.toml", "--speed", "-1"], "speed must be 1e-06 to 1e+06; got -1"),
        ([SCENES / "drop.toml", "--fps", "1e-9"], "fps must be 0.01 to 240; got 1e-09"),
        ([SCENES / "drop.toml", "--speed", "1e-12"], "speed must be 1e-06 to 1e+06; got 1e-12"),
        ([SCENES / "drop.toml", "--speed", "1e-5"], "a speed of 1e-05 would take about"),
        ([SCENES / "drop.toml", "--at", "3"], "at must be left out with a .html file; got 3 s"),
        (
            [SCENES / "drop.toml", "--ghost", "newton"],
            "must be one of momenta, lagrange, kane, pinocchio; got 'newton'",
        ),
        ([SCENES / "drop.toml", "--ghost", "pinocchio"], "surface"),
    ],
)
def test_bad_input_is_one_sentence(words, said, tmp_path, monkeypatch):
    check_refused(words, said, "film.html", tmp_path, monkeypatch)


@pytest.mark.parametrize(
    ("size", "said"),
    [
        ("wide", "--size must be width x height in pixels"),
        ("9x9", "must be 160 to 7680 pixels"),
    ],
)
def test_bad_sizes_are_refused_before_a_browser_is_sought(size, said, tmp_path, monkeypatch):
    check_refused([SCENES / "drop.toml", "--size", size], said, "a.png", tmp_path, monkeypatch)


def check_refused(words, said, out, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = run("record", *words, "--out", out)
    assert result.exit_code == 2, result.output
    assert said in result.output
    assert len(result.output.strip().splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


def test_missing_programs_are_reported_before_work_begins(tmp_path, monkeypatch):
    monkeypatch.setenv(BROWSER, "/nowhere")
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    result = run("record", SCENES / "drop.toml", "--out", tmp_path / "film.mp4")
    assert result.exit_code == 2
    assert 'pip install "twolink[record]"' in result.output
    monkeypatch.delitem(sys.modules, "imageio_ffmpeg")
    result = run("record", "none.toml", "--out", tmp_path / "film.mp4")
    assert result.exit_code == 2
    assert "apt install chromium" in result.output


@pytest.mark.parametrize("out", ["film.avi", "nowhere/film.mp4", "film"])
def test_targets_that_cannot_be_written_are_refused(out, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = run("record", SCENES / "drop.toml", "--out", out)
    assert result.exit_code == 2
    assert "--out" in result.output


def test_a_browser_that_dies_is_exit_code_1(short, tmp_path, monkeypatch):
    program = tmp_path / "browser"
    program.write_text("#!/bin/sh\nexit 9\n")
    program.chmod(0o755)
    monkeypatch.setenv(BROWSER, str(program))
    result = run("record", short, "--out", tmp_path / "film.png")
    assert result.exit_code == 1
    assert "the browser ended with code 9" in result.output
    assert not (tmp_path / "film.png").exists()


def started(scratch, *words):
    """Start the command, with a folder of its own for all that is temporary."""
    return subprocess.Popen(
        [sys.executable, "-m", "twolink.cli", *(str(word) for word in words)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "TMPDIR": str(scratch)},
    )


def address(process):
    """Return the address that the command prints, and its port."""
    url = process.stdout.readline().strip()
    return url, int(re.fullmatch(r"http://[\d.]+:(\d+)/([\w-]{22}/)?", url)[1])


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_view_ends_cleanly(number, short, scratch):
    process = started(scratch, "view", short, "--no-browser")
    try:
        _, port = address(process)
        assert listening(port) == ["0100007F"]
        process.send_signal(number)
        _, err = process.communicate(timeout=20)
    finally:
        process.kill()
    assert (process.returncode, err.strip()) == (0, "")
    assert listening(port) == []
    assert list(scratch.iterdir()) == []
    assert gone(str(scratch))


@pytest.mark.slow
def test_view_on_another_address_prints_a_warning(short, scratch):
    process = started(scratch, "view", short, "--no-browser", "--host", "0.0.0.0")
    try:
        url, port = address(process)
        assert len(url.split("/")) == 5
        assert listening(port) == ["00000000"]
        process.send_signal(signal.SIGTERM)
        _, err = process.communicate(timeout=20)
    finally:
        process.kill()
    assert "can watch the motion" in err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--port", "70000"], "--port must be 0 to 65535; got 70000"),
        (["--host", "192.0.2.1"], "must be an address of this machine and a free port"),
    ],
)
def test_view_refuses_where_it_cannot_listen(words, said, short):
    result = run("view", short, "--no-browser", *words)
    assert result.exit_code == 2
    assert said in result.output


@pytest.mark.slow
def test_view_in_two_browsers(scratch):
    """Both move, on loopback alone; a command to one moves both; nothing is left."""
    need_browser()
    process = started(scratch, "view", SCENES / "general.toml", "--no-browser")
    time_shown = "Number(document.querySelector('.twolink-player').dataset.time)"
    try:
        url, port = address(process)
        with Browser() as one, Browser() as other:
            pages = [one.page(640, 480), other.page(800, 600)]
            for page in pages:
                page.open(url)
                page.wait_until(f"{time_shown} > 0")
            seen = [page.value(time_shown) for page in pages]
            for page, before in zip(pages, seen, strict=True):
                page.wait_until(f"{time_shown} > {before}")
            assert listening(port) == ["0100007F"]
            pages[1].value("document.querySelector('button.play').click()")
            for page in pages:
                page.wait_until(
                    "document.querySelector('.twolink-player').dataset.playing === 'false'"
                )
            pages[0].value(
                "(s => { s.value = 300; s.dispatchEvent(new Event('input')); })"
                "(document.querySelector('.scrub'))"
            )
            for page in pages:
                page.wait_until(f"{time_shown} === 5")
                assert page.complaints() == []
                asked_for = [e["request"]["url"] for e in page.events("Network.requestWillBeSent")]
                assert all(address.startswith((url, "data:")) for address in asked_for)
            process.send_signal(signal.SIGTERM)
            for page in pages:
                page.wait_until(
                    "document.querySelector('output').textContent.includes('has ended')"
                )
        _, err = process.communicate(timeout=20)
    finally:
        process.kill()
    assert (process.returncode, err.strip()) == (0, "")
    assert listening(port) == []
    assert list(scratch.iterdir()) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGTERM, 143), (signal.SIGINT, 130), (signal.SIGKILL, -9)]
)
def test_a_recording_that_is_ended_leaves_nothing(number, code, scratch, tmp_path):
    need_browser()
    process = started(
        scratch, "record", SCENES / "general.toml", "--fps", "60", "--out", tmp_path / "film.mp4"
    )
    try:
        end = time.monotonic() + 60
        while not any("ffmpeg" in read(p) for p in processes_with(str(scratch))):
            assert time.monotonic() < end
            time.sleep(0.05)
        time.sleep(0.5)
        process.send_signal(number)
        process.communicate(timeout=30)
    finally:
        process.kill()
    assert process.returncode == code
    # Even after SIGKILL no process is left: the browser's pipe has closed, and the encoder's.
    assert gone(str(scratch))
    if number != signal.SIGKILL:
        assert list(scratch.iterdir()) == []
        assert list(tmp_path.iterdir()) == []


def read(process):
    try:
        return Path(f"/proc/{process}/cmdline").read_text()
    except OSError:
        return ""
