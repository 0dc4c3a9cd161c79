import multiprocessing
import os
import signal
import time
from concurrent.futures.process import BrokenProcessPool

import pytest

from twolink.workers import worker_processes


def test_calls_are_made_in_other_processes():
    with worker_processes(1) as pool:
        assert pool.submit(os.getpid).result() != os.getpid()
    assert not multiprocessing.active_children()


def interrupted():
    """Make two workers busy, and be interrupted."""
    with worker_processes(2) as pool:
        running = [pool.submit(time.sleep, 60) for _ in range(3)]
        while not any(future.running() for future in running):
            time.sleep(0.01)
        raise KeyboardInterrupt


@pytest.mark.slow
def test_an_error_stops_workers_that_are_busy():
    begun = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert time.monotonic() - begun < 30
    assert not multiprocessing.active_children()


def one_is_killed():
    """Kill a worker, and wait for another call."""
    with worker_processes(2) as pool:
        os.kill(pool.submit(os.getpid).result(), signal.SIGKILL)
        pool.submit(time.sleep, 60).result()


@pytest.mark.slow
def test_a_worker_that_is_killed_breaks_the_pool_and_leaves_none():
    with pytest.raises(BrokenProcessPool):
        one_is_killed()
    assert not multiprocessing.active_children()
