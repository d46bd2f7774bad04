"""`seatrial ff`: switch the feed-forward and wait until the vehicle confirms the mode."""

import argparse
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Final, Self

from rich.console import Console

from bridge import clock as clocks
from bridge import exit_codes
from bridge.clock import Clock
from bridge.errors import LinkError, ParamRejected
from bridge.exit_codes import UsageError
from bridge.links import secured
from bridge.links.link import Link
from bridge.vehicle.mode import BY_WORD, Mode, word_of
from bridge.vehicle.parameters import ACTIVE, MODE
from bridge.wire.framing import Encoder, Framer
from gcs_plugin.feedforward.off_orders import OffMarks, OffOrders
from gcs_plugin.feedforward.switch import Switch, caution
from gcs_plugin.feedforward.switched_vehicle import sent_text
from gcs_plugin.params.client import ParameterClient
from gcs_plugin.params.plan import make_plan
from gcs_plugin.peers import GROUND_STATION, Peers, ground_heartbeat
from gcs_plugin.watch.channels import StatusTexts
from tui import links, show
from tui.files import Files

PATIENCE_S: Final = 15.0
SILENT_S: Final = 10.0
"""Delay before silence is spoken of."""
FIND_S: Final = 5.0
TELL_EVERY_S: Final = 2.0
POLL_S: Final = 0.02
BEAT_EVERY_S: Final = 1.0
REOPEN_EVERY_S: Final = 0.5
Tell = Callable[[str], None]


def run(arguments: argparse.Namespace) -> int:
    mode = BY_WORD[arguments.mode]
    clock = clocks.SystemClock()
    opener = secured.Opener(arguments.sign_key, clock, secured.on_words)
    link = links.link_for(arguments.link, opener.open)
    if mode is Mode.OFF:
        return switch_off(arguments, link, clock, opener)
    try:
        return switch_to(mode, arguments, link, clock)
    finally:
        link.close()


def switch_off(arguments: argparse.Namespace, link: Link, clock: Clock, opener: secured.Opener) -> int:
    """Switch the feed-forward off, and keep sending: only the vehicle's confirmation, the user or --seconds ends it."""
    words = show.words()
    switch = Switch(Mode.OFF, arguments.system, links.known_now(clock, arguments.link))

    def tell(sentence: str) -> None:
        show.say(words, sentence)

    def line_on(link: Link) -> SwitchLink:
        return SwitchLink(link, clock, switch, arguments.system, tell)

    with Progress(words, switch, clock, arguments.seconds) as progress:
        try:
            drive_through_losses(
                line_on(link),
                progress.over,
                lambda: line_on(links.link_for(arguments.link, opener.open)),
                tell,
            )
        except KeyboardInterrupt:
            progress.stopped = True
    return progress.outcome(arguments.json)


def switch_to(mode: Mode, arguments: argparse.Namespace, link: Link, clock: Clock) -> int:
    """Switch to a mode that may move the vehicle: ask first, refuse if the vehicle can't, and give up after a time."""
    words, orders = show.words(), OffOrders(arguments.began_unix_s)
    allowed = permitted(mode, arguments, link, clock)
    if allowed is None:
        show.say(words, "nothing was sent")
        return exit_codes.INTERRUPTED
    system, was, while_disarmed = allowed
    switch = Switch(mode, system, was=was, while_disarmed=while_disarmed)
    line = SwitchLink(link, clock, switch, system, lambda sentence: show.say(words, sentence))

    def over() -> bool:
        if switch.twins:
            raise LinkError(switch.twins)
        switch.overruled = switch.overruled or orders.has_ordered_off(system)
        return progress.over() or bool(switch.refusal)

    with Progress(words, switch, clock, arguments.seconds or PATIENCE_S) as progress:
        while not over():
            line.step()
    return progress.outcome(arguments.json)


def permitted(
    mode: Mode, arguments: argparse.Namespace, link: Link, clock: Clock
) -> tuple[int, float, bool] | None:
    """Return the vehicle's system and mode, and whether that was allowed while it is disarmed alone; None if the user
    declines. Raises ParamError if it refuses the mode."""
    client = ParameterClient(link, clock)
    system, _ = client.find_vehicle(FIND_S, arguments.system)
    present = client.read_all()
    make_plan({MODE: float(mode)}, present).check()
    if mode.applies_feedforward and present.get(ACTIVE) == 0.0:
        raise ParamRejected(
            f"vehicle {system} has no parameters in force to feed forward; nothing was sent, upload some first"
        )
    if warning := caution(mode, system, present[MODE], present.get(ACTIVE), armed=client.armed):
        show.say(show.words(), warning)
    if arguments.yes:
        return system, present[MODE], arguments.disarmed
    change = f"feed-forward of vehicle {system} from {word_of(present[MODE])} to {word_of(mode)}"
    if not client.armed:
        agreed = show.agreed(client, f"{change}?", "switch")
        if agreed and client.armed:
            raise ParamRejected(f"vehicle {system} was armed meanwhile; nothing was sent, look and ask again")
        return (system, present[MODE], True) if agreed else None
    typed = show.asked(client, f"{change}, and it is ARMED; type {word_of(mode)} to do it: ", "switch")
    return (system, present[MODE], False) if typed == word_of(mode) else None


class Progress:
    """Progress of a switch, on a status line of the terminal or every few seconds in a pipe, and its outcome."""

    def __init__(self, console: Console, switch: Switch, clock: Clock, seconds: float | None) -> None:
        self.stopped = False
        self._switch, self._clock, self._seconds = switch, clock, seconds
        # The console that also shows the vehicles' messages: a line from another console would break into the status
        # line.
        self._console = console
        self._status = self._console.status("")
        self._start_s = self._tell_s = clock.boot_s()
        self._says_silent = False

    def __enter__(self) -> Self:
        self._tell_s = self._clock.boot_s() + TELL_EVERY_S
        self._status.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._status.stop()

    def over(self) -> bool:
        """Show the progress; return whether the switch is done, its time is up, or no vehicle has a feed-forward."""
        now_s = self._clock.boot_s()
        self._status.update(self._switch.words)
        if not self._console.is_terminal and now_s >= self._tell_s:
            self._tell_s = now_s + TELL_EVERY_S
            show.say(self._console, self._switch.words)
        silent = self._switch.silent
        if silent and now_s - self._start_s >= SILENT_S and not self._says_silent:
            self._says_silent = True
            show.say(self._console, _not_heard(silent))
        return (
            self._switch.done
            or (self._seconds is not None and now_s - self._start_s >= self._seconds)
            or self._switch.hopeless(now_s)
        )

    def outcome(self, json: str | None) -> int:
        """Report the outcome and return the exit code."""
        switch, took_s = self._switch, self._clock.boot_s() - self._start_s
        show.say(show.results(json), f"{switch.words} ({sent_text(switch.sent)} in {took_s:.1f} s)")
        outcome = {
            "mode": word_of(switch.mode),
            "done": switch.done,
            "sent": switch.sent,
            "seconds": took_s,
            "seen": switch.words,
        }
        with Files() as files:
            files.json(outcome, json)
        return files.code(self._answered())

    def _answered(self) -> int:
        """The exit code by what the vehicles say."""
        if self._switch.done:
            return exit_codes.DONE
        if self.stopped:
            return exit_codes.INTERRUPTED
        return exit_codes.NO if self._switch.heard or self._switch.refusal else exit_codes.LINK


def _not_heard(systems: tuple[int, ...]) -> str:
    """Advice where every vehicle that is heard is off, and others are silent."""
    subject = (
        f"vehicle {systems[0]} is" if len(systems) == 1 else f"vehicles {' and '.join(map(str, systems))} are"
    )
    it, is_ = ("it", "is") if len(systems) == 1 else ("they", "are")
    return f"{subject} not heard; OFF is sent until an answer comes. If {it} {is_} powered down, Ctrl-C ends this"


class SwitchLink:
    """A link with a switch on it; `tell` gets the texts of vehicles."""

    def __init__(self, link: Link, clock: Clock, switch: Switch, system: int | None, tell: Tell) -> None:
        self._link, self._clock, self._switch, self._system = link, clock, switch, system
        self._framer, self._encoder, self._peers = Framer(), Encoder(*GROUND_STATION), Peers(link)
        self._texts = StatusTexts(lambda source, _severity, text: tell(f"vehicle {source[0]}: {text.words}"))
        self._marks = OffMarks()
        self._beat_s = clock.boot_s()

    def step(self) -> None:
        """Send the messages due and take the frames that have come. Raises LinkError if the link is lost."""
        now_s = self._clock.boot_s()
        # Two vehicles seen once stay reported: drifting sequence numbers can hide them for a while.
        self._switch.twins = self._switch.twins or self._peers.fault(self._system)
        messages = self._switch.tick(now_s)
        if not self._switch.heard and now_s >= self._beat_s:
            # A vehicle that listens on UDP learns the ground's address from this.
            self._beat_s = now_s + BEAT_EVERY_S
            messages.append(ground_heartbeat())
        self._marks.mark(messages)
        for message in messages:
            self._link.write(self._encoder.encode(message))
        for frame in self._framer.feed(self._link.read(POLL_S)):
            arrived_s = self._clock.boot_s()
            self._peers.on_frame(frame, self._link.name, arrived_s)
            self._switch.on_frame(frame, arrived_s)
            self._texts.hear(frame)

    def close(self) -> None:
        self._link.close()


def drive_through_losses(
    line: SwitchLink, over: Callable[[], bool], again: Callable[[], SwitchLink], tell: Tell
) -> None:
    """Step until `over`, through every loss of the link, then close it; `tell` gets each new reason for a loss."""
    pause, reported = threading.Event(), ""
    now: SwitchLink | None = line
    try:
        while not over():
            if now is None:
                pause.wait(REOPEN_EVERY_S)
                with suppress(LinkError, UsageError):  # not possible yet
                    now = again()
                continue
            try:
                now.step()
            except LinkError as error:
                now.close()
                now = None
                if str(error) != reported:
                    reported = str(error)
                    tell(reported)
    finally:
        if now is not None:
            now.close()
