"""Work that waits, in a thread that nobody waits for: an app that is left or dies is gone at once.

`asyncio.to_thread` takes threads that the end of the program waits for.
"""

import asyncio
import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import TypeVar

Answer = TypeVar("Answer")


async def aside(work: Callable[[], Answer]) -> Answer:
    """What `work` answers, or raises."""
    future: Future[Answer] = Future()

    def run() -> None:
        try:
            future.set_result(work())
        except BaseException as error:  # noqa: BLE001 (raised where it is waited for)
            future.set_exception(error)

    threading.Thread(target=run, name="aside", daemon=True).start()
    # Shielded: who is cancelled waits no longer, and the answer of the work finds its place all the same.
    return await asyncio.shield(asyncio.wrap_future(future))
