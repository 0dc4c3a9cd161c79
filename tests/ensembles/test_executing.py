import subprocess
import sys
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager

import pytest

from tests.ensembles.cases import starts
from twolink.ensembles import executing
from twolink.ensembles.executing import Task, write_chunks
from twolink.ensembles.store import created
from twolink.errors import FileError, IntegrationError
from twolink.limits import DEFAULT_LIMITS

ASKED = starts(6, runs={"accuracy": 1e-6, "duration": 0.3}, keep={"final": True})


@pytest.fixture
def task(tmp_path):
    path = tmp_path / "a.zarr"
    created(path, ASKED, 4)
    return Task(ASKED, str(path), 4, DEFAULT_LIMITS)


class Backwards(Executor):
    """An executor of no library, which makes calls in another order."""

    def __init__(self):
        self.calls, self.cancelled = [], 0

    def submit(self, function, /, *args, **named):
        made = Future()
        self.calls.append((made, function, args))
        if len(self.calls) == 9:
            for future, call, given in self.calls[::-1]:
                future.set_result(call(*given))
        return made


@pytest.mark.slow_but_first
@pytest.mark.parametrize("executor", [None, Backwards(), ThreadPoolExecutor(3)])
def test_any_executor_makes_all_chunks(task, executor):
    seen = []
    write_chunks(task, range(9), seen.append, executor, workers=1)
    assert sorted(written.number for written in seen) == list(range(9))
    assert sum(written.runs for written in seen) == 36
    assert task_store(task).done().all()


def task_store(task):
    return executing.Store(executing.Path(task.path), task.ensemble.runs.count, task.chunk)


def test_after_an_error_no_chunk_is_begun(task):
    made = []

    class Failing(Executor):
        def submit(self, function, /, *args, **named):
            future = Future()
            made.append(future)
            if len(made) == 1:
                future.set_exception(FileError("the disk is full"))
            return future

    with pytest.raises(FileError, match="the disk is full"):
        write_chunks(task, range(9), print, Failing())
    assert all(future.cancelled() for future in made[1:])


def test_an_error_of_an_executor_is_one_sentence(task):
    class Lost(Executor):
        def submit(self, function, /, *args, **named):
            future = Future()
            future.set_exception(KeyError("three workers\ndied"))
            return future

    with pytest.raises(IntegrationError, match=r"got KeyError: .*: finished chunks are") as caught:
        write_chunks(task, range(9), print, Lost())
    assert "\n" not in str(caught.value)


def test_a_killed_process_loses_only_its_chunk(task, monkeypatch):
    asked = []

    class Dying(executing._Here):
        def submit(self, function, /, *args, **named):
            asked.append(args[0])
            if len(asked) == 4:
                future = Future()
                future.set_exception(BrokenProcessPool("killed"))
                return future
            return super().submit(function, *args, **named)

    @contextmanager
    def pool(count):
        yield Dying()

    monkeypatch.setattr(executing, "worker_processes", pool)
    seen = []
    write_chunks(task, range(9), seen.append, workers=2)
    assert sorted(written.number for written in seen) == list(range(9))
    assert task_store(task).done().all()


def test_processes_that_are_always_killed_end_the_sweep_in_one_sentence(task, monkeypatch):
    class Dead(Executor):
        def submit(self, function, /, *args, **named):
            future = Future()
            future.set_exception(BrokenProcessPool("killed"))
            return future

    @contextmanager
    def pool(count):
        yield Dead()

    monkeypatch.setattr(executing, "worker_processes", pool)
    with pytest.raises(IntegrationError, match="chunks are kept, and the same call continues"):
        write_chunks(task, range(9), print, workers=2)


@pytest.mark.slow
def test_a_script_without_a_guard_ends_in_one_sentence(tmp_path):
    """Its workers import it, and end in silence instead of starting workers of their own."""
    (tmp_path / "script.py").write_text(
        "from twolink import sweep\n"
        "axes = [{'parameter': 'q1', 'values': [0.1, 0.2, 0.3]}]\n"
        "runs = {'duration': 0.1}\n"
        "sweep({'scene': 'free_fall', 'axes': axes, 'runs': runs}, 'x.zarr', workers=2, chunk=1)\n"
    )
    ended = subprocess.run(
        [sys.executable, "script.py"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert ended.returncode == 1
    assert 'below `if __name__ == "__main__":`' in ended.stderr.splitlines()[-1]
    assert "bootstrapping" not in ended.stderr
