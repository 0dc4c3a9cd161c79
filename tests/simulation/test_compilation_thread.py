"""Compilation ahead of use: requests, their cancellation, waiting, and the end."""

import os
import threading
from contextlib import closing

import pytest

from twolink.simulation.compilation_thread import CompilationThread

HERE = threading.get_ident()


class Compilations:
    """Work that notes what is done in a thread, where it waits for permission."""

    def __init__(self):
        self.done, self.may_go_on, self.begun = [], threading.Event(), threading.Event()

    def of(self, key):
        def work():
            assert threading.get_ident() != HERE
            self.begun.set()
            assert self.may_go_on.wait(10.0)
            self.done.append(key)

        return work

    def begun_in(self, thread, *keys):
        """Request work, and return when the first is in progress."""
        for key in keys:
            thread.request(key, self.of(key))
        assert self.begun.wait(10.0)


@pytest.fixture
def compilations():
    found = Compilations()
    yield found
    found.may_go_on.set()


def test_work_is_done_in_the_order_of_the_requests_and_once(compilations):
    with closing(CompilationThread()) as thread:
        compilations.begun_in(thread, 1, 2, 3, 2, 1)
        compilations.may_go_on.set()
        # One that has not begun is left to the caller.
        while compilations.done != [1, 2, 3]:
            threading.Event().wait(0.001)
        thread.request(1, compilations.of(1))
    assert compilations.done == [1, 2, 3]


def test_a_caller_waits_for_work_in_progress_and_cancels_work_that_has_not_begun(compilations):
    with closing(CompilationThread()) as thread:
        compilations.begun_in(thread, 1, 2)
        thread.wait(2)
        thread.wait("never requested")
        assert compilations.done == []
        threading.Timer(0.1, compilations.may_go_on.set).start()
        thread.wait(1)
        assert compilations.done == [1]
    assert compilations.done == [1]


def test_requests_that_are_not_wanted_are_cancelled_and_may_be_made_again(compilations):
    with closing(CompilationThread()) as thread:
        compilations.begun_in(thread, 1, 2, 3)
        thread.keep(lambda key: key == 3)
        thread.request(2, compilations.of(2))
        compilations.may_go_on.set()
        while len(compilations.done) < 3:
            threading.Event().wait(0.001)
    assert compilations.done == [1, 3, 2]


def test_the_end_cancels_requests_and_waits_for_work_in_progress(compilations):
    with closing(CompilationThread()) as thread:
        compilations.begun_in(thread, 1, 2)
        threading.Timer(0.1, compilations.may_go_on.set).start()
    assert compilations.done == [1]
    assert not thread.works
    thread.request(3, compilations.of(3))
    thread.wait(3)
    assert compilations.done == [1]


@pytest.mark.parametrize("error", [ValueError, SystemExit])
def test_work_that_fails_ends_neither_the_thread_nor_the_waiting(compilations, error):
    def failing():
        raise error

    compilations.may_go_on.set()
    with closing(CompilationThread()) as thread:
        thread.request(1, failing)
        thread.request(2, compilations.of(2))
        assert compilations.begun.wait(10.0)
        thread.wait(1)
        thread.wait(2)
    assert compilations.done == [2]


def test_where_no_thread_can_be_started_nothing_is_waited_for(compilations, monkeypatch):
    def refuse(thread):
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(threading.Thread, "start", refuse)
    with closing(CompilationThread()) as thread:
        thread.request(1, compilations.of(1))
        thread.wait(1)
    assert compilations.done == []


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system has no fork")
def test_a_forked_process_waits_for_nothing(compilations):
    with closing(CompilationThread()) as thread:
        compilations.begun_in(thread, 1)
        # The fork waits for the work in progress.
        threading.Timer(0.1, compilations.may_go_on.set).start()
        child = os.fork()
        if child == 0:
            thread._coming[1] = threading.Event()
            thread.wait(1)
            thread.request(2, compilations.of(2))
            thread.close()
            os._exit(42 if compilations.done == [1] and not thread.works else 1)
        assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 42
