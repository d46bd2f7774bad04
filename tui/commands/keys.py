"""`seatrial keys`: make a key for signing links, and show a key's fingerprint."""

import argparse
import getpass
from pathlib import Path

from bridge import exit_codes
from bridge.signing.key import new_key, of_passphrase, read_key, write_key
from tui import show


def run(arguments: argparse.Namespace) -> int:
    path = Path(arguments.key)
    if arguments.action == "show":
        show.say(show.results(), f"{path}: key {read_key(path).fingerprint}")
        return exit_codes.DONE
    key = of_passphrase(_asked()) if arguments.passphrase else new_key()
    write_key(path, key)
    show.say(
        show.results(),
        f"{path}: key {key.fingerprint}; copy the file to the other side by a way that nobody else sees, "
        "and name it there and here with --sign-key",
    )
    return exit_codes.DONE


def _asked() -> str:
    """Read a passphrase twice without echo. Raises UsageError if it is empty or the two differ."""
    try:
        phrase = getpass.getpass("passphrase: ")
        again = getpass.getpass("again: ")
    except EOFError:
        raise exit_codes.UsageError("no passphrase was typed; no key was made") from None
    if not phrase or phrase != again:
        raise exit_codes.UsageError("the two differ, or are empty; no key was made, try again")
    return phrase
