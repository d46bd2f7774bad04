"""While a verb runs: until the user or a signal ends it, and a question to the user beside a connected vehicle."""

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from bridge.exit_codes import UsageError
from tui.show import harmless

if TYPE_CHECKING:
    from gcs_plugin.params.client import ParameterClient


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
