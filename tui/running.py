"""Verbs that run until they are stopped: Ctrl-C and SIGTERM end them between two writes, never within one."""

import signal
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from bridge.clock import Clock

LOOK_EVERY_S = 0.25


def until_stopped(
    work: Callable[[threading.Event], None],
    clock: Clock,
    seconds: float | None,
    each: Callable[[float], None],
) -> None:
    """Run `work` in a thread of its own until the user stops it, `seconds` have passed, or it ends.

    `work` returns soon after its event is set. `each` is called a few times a second with the time since the
    start. Whatever `work` raises is raised here.
    """
    stop = threading.Event()
    start_s = clock.boot_s()
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, signal.default_int_handler)
    with ThreadPoolExecutor(1) as pool:
        job = pool.submit(work, stop)
        try:
            while not job.done() and (seconds is None or clock.boot_s() - start_s < seconds):
                stop.wait(LOOK_EVERY_S)
                each(clock.boot_s() - start_s)
        except KeyboardInterrupt:
            pass
        finally:
            stop.set()
        job.result()
