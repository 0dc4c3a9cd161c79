"""Missing, hanging and crashing browsers: each is ended, without leftover files."""

import os
import signal
import tempfile
import time
from pathlib import Path

import pytest

from tests.viz.films import gone, need_browser, processes_with
from twolink.errors import BrowserError, PictureError
from twolink.viz.browser import BROWSER, Browser, find_browser


@pytest.fixture
def scratch(monkeypatch):
    """A folder of its own for all that is temporary; its path is short, as a browser wants it."""
    with tempfile.TemporaryDirectory(prefix="t-", dir="/tmp") as folder:
        monkeypatch.setattr(tempfile, "tempdir", folder)
        yield Path(folder)


def pretender(tmp_path, script, monkeypatch):
    """Put a program of a few lines in the browser's place."""
    folder = tmp_path / "programs"
    folder.mkdir()
    file = folder / "browser"
    file.write_text(f"#!/bin/sh\n{script}\n")
    file.chmod(0o755)
    monkeypatch.setenv(BROWSER, str(file))


@pytest.mark.slow
def test_a_browser_starts_with_a_long_temporary_path(scratch, monkeypatch):
    """A browser's socket stands in it, and the path of a socket is short."""
    need_browser()
    long = scratch / ("long" * 20)
    long.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(long))
    with Browser() as browser:
        assert browser.page(640, 480).value("1 + 1") == 2


def left_in(scratch):
    return [path.name for path in scratch.iterdir() if path.name != "programs"]


def test_a_missing_browser_is_reported_with_the_package(scratch, monkeypatch):
    monkeypatch.setenv(BROWSER, "/nowhere/chromium")
    assert find_browser() is None
    with (
        pytest.raises(PictureError, match=r"'/nowhere/chromium'.*\.html file.*apt install"),
        Browser(),
    ):
        pass
    monkeypatch.delenv(BROWSER)
    monkeypatch.setenv("PATH", str(scratch))
    assert find_browser() is None


@pytest.mark.slow
def test_a_silent_browser_is_ended_with_its_children(scratch, monkeypatch):
    pretender(scratch, "sleep 1000 & sleep 1000", monkeypatch)
    start = time.monotonic()
    with pytest.raises(BrowserError, match=r"no sign for 0\.5 s"), Browser(patience=0.5):
        pass
    assert time.monotonic() - start < 5
    assert left_in(scratch) == []
    assert gone(str(scratch))


def test_a_browser_that_ends_at_once_is_quoted(scratch, monkeypatch):
    pretender(scratch, "echo 'No usable sandbox!' >&2; exit 7", monkeypatch)
    with pytest.raises(BrowserError, match=r"code 7 .*No usable sandbox!"), Browser():
        pass
    assert left_in(scratch) == []


def test_a_browser_that_refuses_a_command_is_quoted(scratch, monkeypatch):
    answer = r'{"id":1,"error":{"message":"no such thing"}}\0'
    pretender(scratch, f"printf '{answer}' >&4; sleep 1000", monkeypatch)
    with pytest.raises(BrowserError, match="no such thing"), Browser():
        pass
    assert gone(str(scratch))


def test_an_error_of_the_caller_ends_the_browser(scratch, monkeypatch):
    answer = r'{"id":1,"result":{}}\0'
    pretender(scratch, f"printf '{answer}' >&4; sleep 1000", monkeypatch)
    with pytest.raises(ZeroDivisionError), Browser():
        raise ZeroDivisionError
    assert left_in(scratch) == []
    assert gone(str(scratch))


@pytest.mark.slow
def test_a_real_browser_leaves_nothing(scratch):
    need_browser()
    with Browser() as browser:
        assert browser.page(640, 480).value("[innerWidth, innerHeight]") == [640, 480]
        assert processes_with(str(scratch))
    assert left_in(scratch) == []
    assert gone(str(scratch))


def struck(browser, number):
    """Send all of a browser's processes a signal, and ask it something."""
    page = browser.page(640, 480)
    browser.patience = 2.0
    os.killpg(browser.process.pid, number)
    page.value("1 + 1")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "words"),
    [(signal.SIGKILL, "ended with code -9"), (signal.SIGSTOP, "no sign for 2 s")],
)
def test_a_real_browser_that_dies_or_hangs_is_cleared_away(scratch, number, words):
    need_browser()
    with pytest.raises(BrowserError, match=words), Browser() as browser:
        struck(browser, number)
    assert left_in(scratch) == []
    assert gone(str(scratch))


@pytest.mark.slow
def test_errors_of_a_page_are_reported(scratch):
    need_browser()
    with Browser() as browser:
        page = browser.page(640, 480)
        with pytest.raises(BrowserError, match=r"the page failed .*nothing is not defined"):
            page.value("nothing")
        page.value("console.error('loud', 3); setTimeout(() => { throw Error('thrown'); }, 0); 1")
        browser.wait_for_events(0.3)
        complaints = page.complaints()
    assert any("loud 3" in words for words in complaints)
    assert any("thrown" in words for words in complaints)
