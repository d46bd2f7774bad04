"""Questions to whoever sits at the terminal, while a vehicle is on the line."""

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from gcs_plugin.params.client import ParameterClient
from tui.exit_codes import UsageError
from tui.show import harmless


def asked(client: ParameterClient, question: str, to_do: str) -> str:
    """What is typed. Raises UsageError where nobody is there, `to_do` being what --yes would do."""
    if not sys.stdin.isatty():
        raise UsageError(
            f"nobody to ask, standard input is no terminal; give --yes to {to_do} without asking"
        )
    print(harmless(question), end="", file=sys.stderr, flush=True)
    with _listening(client):
        return sys.stdin.readline().strip()


@contextmanager
def _listening(client: ParameterClient) -> Iterator[None]:
    """The link is read meanwhile: nothing that waited in it is later taken for new, and no hub drops who stalls."""
    stop = threading.Event()
    thread = threading.Thread(target=client.listen, args=(stop,), name="listen", daemon=True)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()
