"""Results of functions that are kept: which, in which order they are dropped, and by threads."""

from threading import Barrier, Thread

import pytest

from twolink.simulation.memo import Memo


@pytest.fixture
def made():
    return []


@pytest.fixture
def squares(made):
    def square(x):
        made.append(x)
        return x * x

    return Memo(square, 2)


def test_a_result_is_computed_once(squares, made):
    assert [squares(3), squares(3)] == [9, 9]
    assert made == [3]


def test_it_is_known_which_results_are_there(squares):
    assert (3,) not in squares
    squares(3)
    assert (3,) in squares
    assert (4,) not in squares


def test_the_result_that_was_used_first_is_dropped(squares, made):
    squares(1)
    squares(2)
    squares(1)
    squares(3)
    assert [(k,) in squares for k in (1, 2, 3)] == [True, False, True]
    assert made == [1, 2, 3]


def test_results_may_be_dropped_all_together(squares, made):
    squares(1)
    squares.clear()
    assert (1,) not in squares
    squares(1)
    assert made == [1, 1]


def test_a_function_that_fails_leaves_nothing():
    def failing(x):
        raise ValueError(x)

    memo = Memo(failing, 2)
    for _ in range(2):
        with pytest.raises(ValueError, match="5"):
            memo(5)
    assert (5,) not in memo


def test_threads_that_compute_the_same_at_once_keep_one_result():
    both = Barrier(2)

    def computed(x):
        both.wait(10.0)
        return object()

    memo = Memo(computed, 1)
    threads = [Thread(target=memo, args=(1,)) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert (1,) in memo
    assert len(memo._kept) == 1
