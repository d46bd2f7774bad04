"""Links opened by name, signed where a key is named: the option `--sign-key` of every verb that opens one."""

import argparse
import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bridge.clock import Clock
    from bridge.link.base import Link
    from bridge.signing.gate import Gate, Trouble

OPTION = "--sign-key"


def add_argument(parser: argparse.ArgumentParser) -> None:
    """The option that names the key."""
    parser.add_argument(
        OPTION,
        metavar="FILE",
        help="sign the link with this key and hear nobody without it: one of `seatrial keys make`",
    )


class Opener:
    """Opens links, and opens them again; with a key each is signed, and goes on where it was.

    `tell` hears of a system of which nothing is let in, `warn` where the other side signs and this one has no key.
    `listed` hears of each socket once, as it is opened first: words go to the crew, but for who lists them later.
    `system` is whom the verb was told to speak with: whoever else is refused, the crew hears of that one.
    Raises ConfigError where the key can't be had.
    """

    def __init__(
        self,
        key_file: str | None,
        clock: "Clock",
        tell: "Callable[[Trouble], None]",
        warn: "Callable[[str], None] | None" = None,
        listed: "Callable[[str], None] | None" = None,
        system: int | None = None,
    ) -> None:
        self._warn = warn or say_warning
        self._listed = listed or say
        self._system = system
        self._opened: set[str] = set()
        self.gates: dict[str, Gate] = {}
        self._clock, self._tell = clock, tell
        self._key = None
        if key_file is not None:
            from bridge.signing.key import read_key

            self._key = read_key(Path(key_file))

    def open(self, spec: str) -> "Link":
        """The link of that name. Raises LinkSpecError, LinkError."""
        from bridge.link.open import open_link

        link = open_link(spec)
        if spec not in self._opened:
            from tui.sockets import of_link

            self._opened.add(spec)
            for sentence in of_link(spec, "the link"):
                self._listed(sentence)
        if self._key is None:
            from bridge.signing.keyless import KeylessLink

            return KeylessLink(link, self._warn)
        from bridge.signing.link import SignedLink

        return SignedLink(link, self._gate(spec), self._clock)

    def words(self, spec: str) -> str:
        """What was refused so far on the link of that name; "" for nothing."""
        gate = self.gates.get(spec)
        return gate.words if gate else ""

    def trouble(self, spec: str) -> str:
        """What the crew must do where nothing of a system is let in on that link; "" where all is well."""
        gate = self.gates.get(spec)
        return gate.trouble if gate else ""

    @property
    def way(self) -> str:
        """Whether links are signed, in a sentence; "" where they are not."""
        return f"links are signed with the key {self._key.fingerprint}" if self._key else ""

    def _gate(self, spec: str) -> "Gate":
        from bridge.signing.gate import Gate
        from bridge.signing.times import Times

        assert self._key is not None
        if spec not in self.gates:
            times = Times(self._clock, times_file(self._key.fingerprint, spec))
            number = len(self.gates)
            self.gates[spec] = Gate(spec, self._key, times, self._clock, self._tell, number, self._system)
        return self.gates[spec]


def on_words(trouble: "Trouble") -> None:
    """Tell the crew of it where words go."""
    say_warning(trouble.sentence)


def say_warning(sentence: str) -> None:
    """Warn the crew of something where words go."""
    say(f"warning: {sentence}")


def say(sentence: str) -> None:
    """Tell the crew of something where words go."""
    from tui import show

    show.say(show.words(), sentence)


def later(_: str) -> None:
    """What hears of the sockets of who lists them itself, once all that it begins with is open."""


def times_file(fingerprint: str, spec: str) -> Path:
    """Where the times of the signatures on a link are kept."""
    home = os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state"
    return Path(home) / "seatrial" / "signing" / f"{fingerprint}-{re.sub(r'[^A-Za-z0-9.]', '_', spec)}.json"
