"""The progress bar: drawn on a terminal only, after a moment, without markup."""

import io
import subprocess
import sys

import pytest
from rich.console import Console

from twolink.cli import progress
from twolink.cli.progress import progress_bar


@pytest.fixture
def terminal(monkeypatch):
    """Return what is drawn on a standard error that is a terminal."""
    stream = io.StringIO()
    page = Console(file=stream, force_terminal=True, width=80, color_system=None)
    monkeypatch.setattr(progress, "error_page", lambda: page)
    return stream


@pytest.fixture
def clock(monkeypatch):
    """Return the time that the bar reads, in a list of one entry (s)."""
    now = [100.0]
    monkeypatch.setattr(progress, "monotonic", lambda: now[0])
    return now


def test_the_bar_reads_no_markup(terminal):
    with progress_bar() as bar:
        bar.add_task("[/nope]\x1b[31m", total=1.0)
    assert "[/nope]\\x1b[31m" in terminal.getvalue()


def test_nothing_is_drawn_without_a_terminal(capsys):
    with progress_bar() as bar:
        task = bar.add_task("computing", total=1.0)
        bar.update(task, completed=0.5)
        bar.advance(task)
    assert capsys.readouterr() == ("", "")


def test_short_work_draws_nothing(terminal, clock):
    with progress_bar(patience=0.5) as bar:
        task = bar.add_task("computing", total=1.0)
        clock[0] += 0.4
        bar.update(task, completed=1.0)
    assert terminal.getvalue() == ""


def test_work_that_lasts_is_drawn_with_all_its_tasks(terminal, clock):
    """Each with its latest description and its time from its own beginning."""
    with progress_bar(patience=0.5) as bar:
        first = bar.add_task("reading", total=1.0)
        bar.update(first, completed=0.5, description="reading on")
        clock[0] += 7.0
        second = bar.add_task("computing", total=4.0)
        bar.advance(second)
        third = bar.add_task("drawing", total=2.0)
        bar.update(third, completed=1.0)
        drawn = bar._drawn
        tasks = [(task.description, task.completed, task.total) for task in drawn.tasks]
        elapsed = [task.elapsed for task in drawn.tasks]
    assert tasks == [("reading on", 0.5, 1.0), ("computing", 1.0, 4.0), ("drawing", 1.0, 2.0)]
    assert elapsed[0] == pytest.approx(7, abs=1)
    assert elapsed[1] == pytest.approx(0, abs=1)
    for words in ("reading on", "computing", "drawing", "0:00:07"):
        assert words in terminal.getvalue()


def test_an_interruption_leaves_the_terminal_without_a_bar(terminal):
    def interrupted():
        with progress_bar() as bar:
            bar.add_task("computing", total=1.0)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert terminal.getvalue().endswith("\x1b[2K")


def test_a_command_that_writes_to_a_file_imports_no_bar():
    code = (
        "import sys\n"
        "from twolink.cli.progress import progress_bar\n"
        "with progress_bar() as bar:\n"
        "    bar.advance(bar.add_task('computing', total=1.0))\n"
        "print('rich.progress' in sys.modules)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("False\n", "")
