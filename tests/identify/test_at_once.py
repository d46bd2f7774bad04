"""Work on several items at once: a failure ends it, and the largest begins first."""

import os
import threading
from concurrent.futures import ThreadPoolExecutor

import pytest

from identify.side_by_side import side_by_side


@pytest.fixture(autouse=True)
def two_processors(monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 1})


def test_results_come_in_the_order_of_the_items_though_the_largest_begin_first():
    begun, lock = [], threading.Lock()

    def work(item: int) -> int:
        with lock:
            begun.append(item)
        return 10 * item

    assert side_by_side(work, [1, 3, 2, 4], float) == [10, 30, 20, 40]
    assert set(begun[:2]) == {3, 4}


def test_after_a_failure_what_has_not_begun_is_left_undone(monkeypatch):
    done, ended, end = [], threading.Event(), ThreadPoolExecutor.shutdown

    def shutdown(pool, **how):
        end(pool, wait=False, cancel_futures=how.get("cancel_futures", False))
        ended.set()
        end(pool)

    monkeypatch.setattr(ThreadPoolExecutor, "shutdown", shutdown)

    def work(item: int) -> None:
        if item == 0:
            raise ValueError("the first")
        ended.wait(5.0)
        done.append(item)

    with pytest.raises(ValueError, match="the first"):
        side_by_side(work, range(50))
    assert len(done) <= 2
