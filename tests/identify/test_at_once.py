"""Work on several items at once: a failure ends it, and the largest begins first."""

import gc
import os
import subprocess
import sys
import threading
import weakref

import numpy as np
import pytest

from identify.threads import side_by_side

SOON_S = 60.0


@pytest.fixture(autouse=True)
def two_processors(monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 1})


def test_results_come_in_the_order_of_the_items_though_the_largest_begin_first():
    begun, lock = [], threading.Lock()

    def work(item):
        with lock:
            begun.append(item)
        return 10 * item

    assert side_by_side(work, [1, 3, 2, 4], float) == [10, 30, 20, 40]
    assert set(begun[:2]) == {3, 4}


def test_after_a_failure_nothing_more_begins():
    done, failed = [], threading.Event()

    def work(item):
        if item == 0:
            failed.set()
            raise ValueError("the first")
        failed.wait(SOON_S)
        done.append(item)

    with pytest.raises(ValueError, match="the first"):
        side_by_side(work, range(50))
    assert len(done) <= 2


def test_the_first_of_two_failures_is_raised():
    begun = threading.Barrier(2)

    def work(item):
        begun.wait(SOON_S)
        raise ValueError(f"item {item}")

    with pytest.raises(ValueError, match="item 0"):
        side_by_side(work, range(2))


def test_an_interrupt_goes_before_an_error_of_an_earlier_item():
    begun = threading.Barrier(2)

    def work(item):
        begun.wait(SOON_S)
        raise KeyboardInterrupt if item else ValueError("item 0")

    with pytest.raises(KeyboardInterrupt):
        side_by_side(work, range(2))


def test_a_call_that_has_ended_keeps_none_of_its_items():
    class Item:
        pass

    both_busy = threading.Barrier(2)

    def outer(_):
        # The only helper is busy with the other outer item, so no inner call finds one.
        both_busy.wait(SOON_S)
        items = [Item(), Item()]
        kept = [weakref.ref(item) for item in items]
        side_by_side(lambda item: item, items)
        del items
        gc.collect()
        both_busy.wait(SOON_S)
        return [reference() is not None for reference in kept]

    assert side_by_side(outer, range(2)) == [[False, False], [False, False]]


def test_calls_within_calls_end_though_every_helper_is_busy():
    def within(item):
        return side_by_side(lambda other: item + other, range(20))

    def deeper(item):
        return side_by_side(within, range(item, item + 5))

    assert side_by_side(deeper, range(10))[3][4] == [7 + other for other in range(20)]


def test_a_caller_that_waits_helps_with_the_calls_within_the_last_item():
    threads, both_at_work = set(), threading.Barrier(2)

    def within(_):
        # Passed by two threads alone: the helper that makes this call, and the caller that waits for it.
        both_at_work.wait(SOON_S)
        threads.add(threading.get_ident())

    def outer(_):
        if threading.current_thread() is threading.main_thread():
            begun.wait(SOON_S)
        else:
            begun.set()
            side_by_side(within, range(2))

    begun = threading.Event()
    side_by_side(outer, range(2))
    assert len(threads) == 2


def test_a_child_process_has_helpers_of_its_own():
    side_by_side(abs, range(4))
    words = "import os; from identify.threads import side_by_side as s; s(abs, range(4)); child = os.fork(); "
    words += "s(abs, range(-9, 0)) if not child else None; os._exit(0) if not child else None; "
    words += "raise SystemExit(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))"
    assert subprocess.run([sys.executable, "-W", "ignore", "-c", words], timeout=60).returncode == 0


def test_a_helper_works_under_the_floating_point_settings_of_its_caller():
    """A reading of 1e200 m/s squared warned in one thread and not in the other."""
    begun = threading.Barrier(2)

    def work(value):
        begun.wait(SOON_S)
        return np.square(np.float64(value))

    with np.errstate(over="ignore"):
        assert side_by_side(work, [1e200, 1e200]) == [np.inf, np.inf]
