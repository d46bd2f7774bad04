"""Run verbs until they are stopped: Ctrl-C and SIGTERM end them between two writes, never within a write."""

import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

from bridge.clock import Clock

LOOK_EVERY_S = 0.25


def until_stopped(
    work: Callable[[threading.Event], None],
    clock: Clock,
    seconds: float | None,
    each: Callable[[float], bool | None],
) -> None:
    """Run `work` in a thread of its own until the user stops it, `seconds` have passed, or it ends.

    `work` returns soon after its event is set. `each` is called a few times a second with the time since the start,
    and ends the run by returning True. An exception of `work` is raised here.
    """
    stop = threading.Event()
    start_s = clock.boot_s()
    with _set_by_signals(stop), ThreadPoolExecutor(1) as pool:
        job = pool.submit(work, stop)
        try:
            while not (job.done() or stop.is_set()) and (
                seconds is None or clock.boot_s() - start_s < seconds
            ):
                stop.wait(LOOK_EVERY_S)
                if each(clock.boot_s() - start_s):
                    break
        finally:
            stop.set()
        job.result()


@contextmanager
def _set_by_signals(stop: threading.Event) -> Iterator[None]:
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {
        number: signal.signal(number, lambda *_: stop.set()) for number in (signal.SIGINT, signal.SIGTERM)
    }
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
