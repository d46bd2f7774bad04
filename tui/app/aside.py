"""Blocking work in a daemon thread: an app that is left or dies ends at once.

`asyncio.to_thread` uses threads that the interpreter joins at exit.
"""

import asyncio
import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import TypeVar

Answer = TypeVar("Answer")


async def aside(work: Callable[[], Answer]) -> Answer:
    """Return the result of `work`, or raise its exception."""
    future: Future[Answer] = Future()

    def run() -> None:
        try:
            future.set_result(work())
        except BaseException as error:  # noqa: BLE001 (re-raised in the waiting task)
            future.set_exception(error)

    threading.Thread(target=run, name="aside", daemon=True).start()
    # Shielded: a cancelled caller stops waiting, and the work can still deliver its result.
    return await asyncio.shield(asyncio.wrap_future(future))
