"""`seatrial record`: record links into a dive folder, and share them with other programs on this computer."""

import argparse
import os
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, Final

from bridge import clock as clocks
from bridge import command_line, exit_codes
from bridge.clock import Clock, EvenClock, utc_text
from bridge.command_line import check_folder
from bridge.errors import LogError
from bridge.links import secured
from bridge.links.addresses import of_links, of_served
from bridge.links.secured import Opener
from bridge.vehicle.config import load_vehicle
from gcs_plugin.dives.conditions import NOTHING_SAID
from gcs_plugin.dives.folder import About, DiveFolder, about_vehicle, last_conditions
from gcs_plugin.dives.recorded_dives import FULL, RecordedDive, RecordedDives
from gcs_plugin.peers import GROUND_STATION
from gcs_plugin.recording import orders
from gcs_plugin.recording.hub import Hub
from gcs_plugin.recording.recorder import Notice, Recorded, Recorder
from gcs_plugin.recording.state import HeardVehicle, Holding, held, release, write_holding
from gcs_plugin.watch.channels import StatusTexts
from tui import show
from tui.links import refuse_second, words_of

MOST_NOTICES = 5
OF_BEGINNING: Final = ("name", "vehicle", "same_conditions", "seconds", "heartbeat")
"""Options that say how a recording begins: one that runs already can't take them."""


def run(arguments: argparse.Namespace) -> int:
    clock = clocks.SystemClock()
    if arguments.next or arguments.end:
        given = [f"--{name.replace('_', '-')}" for name in OF_BEGINNING if getattr(arguments, name)]
        if given:
            raise exit_codes.UsageError(
                f"{', '.join(given)}: the recording that runs keeps what it was begun with; leave it out, or end that "
                "one and begin another"
            )
        return order(arguments, clock)
    check_folder("--out", arguments.out)
    refuse_second(arguments.link)
    if arguments.hub is None:
        return record(arguments, clock, None)
    hub = Hub(clock, arguments.hub)
    try:
        return record(arguments, clock, hub)
    finally:
        hub.close()


def order(arguments: argparse.Namespace, clock: Clock) -> int:
    """Order the running recording to start the next dive, or to end."""
    finished: Path
    present: Path | None = None
    if arguments.next:
        finished, present = orders.next_dive(clock)
    else:
        finished = orders.end(clock)
    console = show.results(arguments.json)
    show.say(console, orders.became(finished, present))
    outcome = {"finished": str(finished), "folder": str(present) if present else None}
    show.write_json(outcome, arguments.json)
    return exit_codes.DONE


def record(arguments: argparse.Namespace, clock: Clock, hub: Hub | None) -> int:
    """Record until stopped, and report the result."""
    file = load_vehicle(arguments.vehicle) if arguments.vehicle else None
    opener = secured.Opener(
        arguments.sign_key,
        clock,
        lambda trouble: warn(trouble.sentence),
        lambda said: warn(said),
        secured.later,
    )
    links = [opener.open(spec) for spec in arguments.link]
    configuration = (file.configuration or "") if file else ""
    about = about_vehicle(file, configuration) if file else About()
    root = Path(arguments.out)
    describe = described(about, root, same_conditions=arguments.same_conditions)
    dives = RecordedDives(root, arguments.name or configuration, describe, clock)
    words = show.words()
    state = RecordingState(
        clock,
        tuple(arguments.link),
        dives.folder.path,
        hub.address if hub else "",
        opener,
        arguments.sign_key or "",
    )
    orders.forget()

    def notice(said: Notice) -> None:
        state.notice(said)
        show.say(words, f"{said.level}: {said.sentence}")

    def warn(sentence: str) -> None:
        notice(Notice(recorder.unix_us(), "warning", sentence))

    def begun(before: RecordedDive) -> None:
        following = dives.folder.path
        state.begin(following)
        for sentence in filter(None, (before.words, before.advice, f"the next dive goes into {following}")):
            show.say(words, sentence)

    def refused() -> str:
        return "; ".join(filter(None, map(opener.words, arguments.link)))

    recorder: TellingRecorder = TellingRecorder(
        lambda text: show.say(words, text),
        links,
        dives.open_file(),
        clock,
        dives.free_bytes,
        notice,
        opener.open,
        GROUND_STATION if arguments.heartbeat else None,
        hub,
        lambda: state.tell(recorder),
    )
    if hub is not None:
        hub.tell = warn
    with words.status("waiting for the first frame") as status:

        def work(stop: threading.Event) -> None:
            show.say(words, f"recording into {dives.folder.path}; Ctrl-C ends it")
            show.say(words, state.way)
            show.say(words, *sockets(arguments.link, hub))
            if opener.way:
                show.say(words, opener.way)
            recorder.run(stop)

        def each(since_s: float) -> bool:
            kept = recorder.kept
            status.update(f"{since_s:.0f} s, {kept.frames} frames, {kept.bytes / 1e3:.0f} kB")
            asked = orders.ordered()
            try:
                if asked is orders.Order.NEXT:
                    dives.go_on(recorder, begun)
                elif dives.go_on_if_full(recorder, begun):
                    warn(FULL)
            except LogError as error:
                notice(Notice(recorder.unix_us(), "error", f"no next dive: {error}"))
            return asked is orders.Order.END

        try:
            state.tell(recorder)
            command_line.until_stopped(work, clock, arguments.seconds, each)
        finally:
            release()
    last = dives.end(recorder.count)
    show.say(show.results(arguments.json), last.words)
    if last.advice:
        show.say(words, last.advice)
    if refused():
        show.say(words, f"frames refused: {refused()}")
    show.write_json(summary(recorder, dives.finished), arguments.json)
    if last.folder is None:
        path = dives.folder.path
        kept = f"{path} keeps its notes alone" if path.exists() else "no dive folder is kept"
        named = ", ".join(arguments.link)
        why, to_do = (
            (f"all that arrived on {named} was refused", "check the keys of both sides")
            if refused()
            else (f"nothing arrived on {named}", "check vehicle, cable and port")
        )
        show.say(words, f"{why}, so {kept}; {to_do}")
    if all(dive.folder is None for dive in dives.finished):
        return exit_codes.LINK
    lost = recorder.lost_here or any(dive.count.lost for dive in dives.finished)
    return exit_codes.NO if lost else exit_codes.DONE


def sockets(links: Sequence[str], hub: Hub | None) -> list[str]:
    """Sentences on the open network sockets."""
    served = [of_served(hub.address)] if hub else []
    return [*of_links(links, "a link that is recorded"), *served]


def summary(recorder: Recorder, dives: list[RecordedDive]) -> dict[str, Any]:
    """Summary of the recording as plain data: the last dive, the earlier dives, and the links over all of them."""
    *earlier, last = (
        {"folder": str(dive.folder) if dive.folder else None}
        | {key: value for key, value in asdict(dive.count).items() if key != "heard"}
        for dive in dives
    )
    return last | {
        "earlier": earlier,
        "lost_here": recorder.lost_here,
        "links": {
            name: [asdict(reception) for reception in receptions]
            for name, receptions in recorder.receptions.items()
        },
    }


def described(about: About, root: Path, *, same_conditions: bool) -> Callable[[DiveFolder], About]:
    """The `dive.yaml` of each new dive: `about`, with the conditions of the dive before if `same_conditions`."""

    def describe(folder: DiveFolder) -> About:
        before = last_conditions(root, folder.path)
        if before == NOTHING_SAID:
            return about
        note = "taken" if same_conditions else "`seatrial conditions --same` takes that"
        show.say(show.words(), f"conditions of the dive before: {before.words}; {note}")
        return replace(about, conditions=before) if same_conditions else about

    return describe


class RecordingState:
    """State of the recording of `links` into `folder`; in a second file while another recording is the default.

    `hub` is the address at which it serves its links, "" if it serves nobody; `opener` opened them, with the key in
    `sign_key`.
    """

    def __init__(
        self, clock: Clock, links: tuple[str, ...], folder: Path, hub: str, opener: Opener, sign_key: str = ""
    ) -> None:
        self._opener = opener
        self._sign_key = str(Path(sign_key).absolute()) if sign_key else ""
        self._clock, self._links, self._hub = clock, links, hub
        self._recording_clock = EvenClock(clock)
        self.begin(folder)
        self._notices: tuple[str, ...] = ()
        self._fault = ""

    @property
    def way(self) -> str:
        """How other programs reach the links of this recording, in a sentence."""
        first = self._other()
        if first is not None:
            links_here = (
                f"; the links of this one are at {self._hub}, or by their names with --link"
                if self._hub
                else ""
            )
            return f"params, doctor, ff and note go by way of {words_of(first)}{links_here}"
        if not self._hub:
            return "its links serve nobody else"
        return f"params, doctor, ff and note go by way of it, at {self._hub}"

    def begin(self, folder: Path) -> None:
        # A single assignment, because another thread may be writing the state.
        self._dive = (folder, utc_text(self._recording_clock.unix_s()))

    def notice(self, said: Notice) -> None:
        """Keep a notice that an operator must read."""
        self._notices = (*self._notices, f"{said.level}: {said.sentence}")[-MOST_NOTICES:]

    def tell(self, recorder: Recorder) -> None:
        """Write the state now; if that fails, say so once."""
        folder, began_utc = self._dive
        kept = recorder.kept
        holding = Holding(
            os.getpid(),
            self._hub,
            self._links,
            str(folder.absolute()),
            began_utc,
            kept.frames,
            kept.bytes,
            kept.lost,
            recorder.disk_left_s,
            self._notices,
            self._clock.unix_s(),
            "; ".join(filter(None, map(self._opener.words, self._links))),
            next(filter(None, map(self._opener.trouble, self._links)), ""),
            self._sign_key,
            recorder.unwritten.replace(f"{folder}/", ""),
            recorder.waiting,
            round(self._clock.unix_s() - self._recording_clock.unix_s(), 3),
            self._vehicles(recorder),
            time.monotonic(),
        )
        try:
            write_holding(holding, second=self._other() is not None)
            self._fault = ""
        except LogError as error:
            if not self._fault:
                show.say(show.words(), f"warning: {error}")
            self._fault = str(error)

    def _vehicles(self, recorder: Recorder) -> tuple[HeardVehicle, ...]:
        boot_s, unix_s = self._clock.boot_s(), self._clock.unix_s()
        return tuple(
            HeardVehicle(
                *vehicle.source, vehicle.holds, round(unix_s - boot_s + vehicle.heard_s, 3), vehicle.behind
            )
            for vehicle in recorder.vehicles
        )

    def _other(self) -> Holding | None:
        holding = held(self._clock.unix_s())
        return holding if holding is not None and holding.pid != os.getpid() else None


class TellingRecorder(Recorder):
    """A recorder that passes on the texts of vehicles."""

    def __init__(self, tell: Callable[[str], None], *of_recorder: Any) -> None:
        self._texts = StatusTexts(lambda source, _severity, text: tell(f"vehicle {source[0]}: {text.words}"))
        super().__init__(*of_recorder)

    def step(self, timeout_s: float) -> list[Recorded]:
        taken = super().step(timeout_s)
        for item in taken:
            self._texts.hear(item.frame)
        return taken
