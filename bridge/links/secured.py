"""Open links by name, signed if a key is given: the option `--sign-key` of every verb that opens a link."""

import argparse
import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from bridge.files import state_folder
from bridge.text import say, say_warning

if TYPE_CHECKING:
    from bridge.clock import Clock
    from bridge.links.link import Link
    from bridge.signing.link import Gate, Trouble

OPTION = "--sign-key"


def add_argument(parser: argparse.ArgumentParser) -> None:
    """Add the option that names the key."""
    parser.add_argument(
        OPTION,
        metavar="FILE",
        help="sign the link with this key and hear nobody without it: one of `seatrial keys make`",
    )


class Opener:
    """Opens links, also again; with a key each is signed, and a reopened link continues its signature times.

    `tell` is called about a system of which no frame is accepted, `warn` if the other side signs and this side has no
    key. `listed` gets a sentence about each socket when it is first opened; by default the sentence goes to the crew,
    `later` ignores it for a caller that lists its sockets afterwards. Raises ConfigError if the key can't be read.
    """

    def __init__(
        self,
        key_file: str | None,
        clock: "Clock",
        tell: "Callable[[Trouble], None]",
        warn: "Callable[[str], None] | None" = None,
        listed: "Callable[[str], None] | None" = None,
    ) -> None:
        self._warn = warn or say_warning
        self._listed = listed or say
        self._opened: set[str] = set()
        self.gates: dict[str, Gate] = {}
        self._clock, self._tell = clock, tell
        self._key = None
        if key_file is not None:
            from bridge.signing.key import read_key

            self._key = read_key(Path(key_file))

    def open(self, spec: str) -> "Link":
        """Open the link of that name. Raises LinkSpecError, LinkError."""
        from bridge.links.open import open_link

        link = open_link(spec)
        if spec not in self._opened:
            from bridge.links.addresses import of_link

            self._opened.add(spec)
            for sentence in of_link(spec, "the link"):
                self._listed(sentence)
        if self._key is None:
            from bridge.signing.link import KeylessLink

            return KeylessLink(link, self._warn)
        from bridge.signing.link import SignedLink

        return SignedLink(link, self._gate(spec), self._clock)

    def words(self, spec: str) -> str:
        """Number and kind of frames refused so far on the link of that name; "" for none."""
        gate = self.gates.get(spec)
        return gate.words if gate else ""

    def trouble(self, spec: str) -> str:
        """Advice for the crew if all frames of a system are refused on that link; "" otherwise."""
        gate = self.gates.get(spec)
        return gate.trouble if gate else ""

    @property
    def way(self) -> str:
        """Whether links are signed, in a sentence; "" if they are not."""
        return f"links are signed with the key {self._key.fingerprint}" if self._key else ""

    def _gate(self, spec: str) -> "Gate":
        from bridge.signing.link import Gate, Times

        assert self._key is not None
        if spec not in self.gates:
            times = Times(self._clock, times_file(self._key.fingerprint, spec))
            number = len(self.gates)
            self.gates[spec] = Gate(spec, self._key, times, self._clock, self._tell, number)
        return self.gates[spec]


def on_words(trouble: "Trouble") -> None:
    """Tell the crew of a system whose frames are refused, on standard error."""
    say_warning(trouble.sentence)


def later(_: str) -> None:
    """Ignore a socket: for a caller that lists all sockets itself once everything is open."""


def times_file(fingerprint: str, spec: str) -> Path:
    return state_folder() / "signing" / f"{fingerprint}-{re.sub(r'[^A-Za-z0-9.]', '_', spec)}.json"
