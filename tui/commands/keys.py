"""`seatrial keys`: make a key for signing links, and show a key's fingerprint."""

import argparse
from pathlib import Path

from bridge import exit_codes
from bridge.command_line import actions_of

EXAMPLE = "seatrial keys make seatrial.key"
ACTIONS = {
    "make": ("make a key in a new file that nobody else can read", EXAMPLE),
    "show": ("say which key a file holds, by its fingerprint", "seatrial keys show seatrial.key"),
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    for name, action in actions_of(parser, ACTIONS):
        action.add_argument("key", metavar="FILE", help="the file of the key")
        if name == "make":
            action.add_argument(
                "--passphrase",
                action="store_true",
                help="ask for a passphrase, and make the key that MAVProxy and QGroundControl make of it",
            )


def run(arguments: argparse.Namespace) -> int:
    from bridge.signing.key import new_key, of_passphrase, read_key, write_key
    from tui import show

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
    import getpass

    try:
        phrase = getpass.getpass("passphrase: ")
        again = getpass.getpass("again: ")
    except EOFError:
        raise exit_codes.UsageError("no passphrase was typed; no key was made") from None
    if not phrase or phrase != again:
        raise exit_codes.UsageError("the two differ, or are empty; no key was made, try again")
    return phrase
