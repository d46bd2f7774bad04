"""While a verb runs: until the user or a signal ends it, and a question to the user beside a connected vehicle."""

import signal
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import TYPE_CHECKING

from bridge.clock import Clock
from tui.exit_codes import UsageError
from tui.show import harmless

if TYPE_CHECKING:
    from gcs_plugin.params.client import ParameterClient


LOOK_EVERY_S = 0.25


def asked(client: "ParameterClient", question: str, to_do: str) -> str:
    """Return the answer typed. Raises UsageError if stdin is no terminal; `to_do` says what --yes would do."""
    if not sys.stdin.isatty():
        raise UsageError(
            f"nobody to ask, standard input is no terminal; give --yes to {to_do} without asking"
        )
    print(harmless(question), end="", file=sys.stderr, flush=True)
    with _listening(client):
        return sys.stdin.readline().strip()


@contextmanager
def _listening(client: "ParameterClient") -> Iterator[None]:
    """Keep reading the link meanwhile: otherwise old data passes for new later, or a hub drops this program as slow."""
    stop = threading.Event()
    thread = threading.Thread(target=client.listen, args=(stop,), name="listen", daemon=True)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()


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
