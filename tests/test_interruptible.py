"""Calls beside which the caller waits: results, errors, and Ctrl-C."""

import os
import signal
import threading
import time

import pytest

from twolink.interruptible import side_by_side


def test_results_come_in_order():
    assert side_by_side(lambda go_on: 1, lambda go_on: 2) == [1, 2]


def test_the_first_error_ends_the_others():
    ended = threading.Event()

    def fails(go_on):
        raise ValueError("wrong")

    def waits(go_on):
        try:
            while True:
                go_on()
                time.sleep(0.001)
        finally:
            ended.set()

    with pytest.raises(ValueError, match="wrong"):
        side_by_side(waits, fails)
    assert ended.wait(5)


def test_ctrl_c_is_answered_while_a_call_answers_nothing():
    released = threading.Event()
    ended = threading.Event()

    def deaf(go_on):
        released.wait(30)
        try:
            go_on()
        finally:
            ended.set()

    threading.Timer(0.2, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    start = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        side_by_side(deaf)
    assert time.monotonic() - start < 5
    assert not ended.is_set()
    released.set()
    assert ended.wait(5)
