"""`seatrial record`: record links into a dive folder, and share them with other programs on this computer."""

import argparse
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bridge import exit_codes
from bridge.command_line import seconds
from bridge.links import secured

if TYPE_CHECKING:
    import threading
    from collections.abc import Sequence

    from bridge.clock import Clock
    from gcs_plugin.recording.hub import Hub
    from gcs_plugin.recording.recorder import Notice, Recorder
    from tui.recording import RecordedDive

EXAMPLE = "seatrial record --link udpin:127.0.0.1:14550 --out dives"
NO_HUB = "none"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    actions = parser.add_mutually_exclusive_group(required=True)
    actions.add_argument("--link", action="append", metavar="SPEC", help="a link; may be given again")
    actions.add_argument(
        "--next", action="store_true", help="let the recording that runs go on in a new dive folder"
    )
    actions.add_argument("--end", action="store_true", help="end the recording that runs")
    parser.add_argument(
        "--out", default="dives", metavar="FOLDER", help="takes the dive folder (default: dives)"
    )
    parser.add_argument("--name", default="", help="the end of the dive folder's name")
    parser.add_argument(
        "--vehicle", metavar="FILE[:CONFIGURATION]", help="the vehicle file to name in dive.yaml"
    )
    parser.add_argument(
        "--same-conditions",
        action="store_true",
        help="water, tether, ballast and so on as in the dive before",
    )
    parser.add_argument(
        "--seconds", type=seconds, metavar="N", help="stop after so long (default: at Ctrl-C)"
    )
    parser.add_argument(
        "--heartbeat",
        action="store_true",
        help="beat as a ground station, for a vehicle that waits to hear one",
    )
    secured.add_argument(parser)
    parser.add_argument(
        "--hub",
        type=hub_port,
        default=0,
        metavar="PORT",
        help="where params, doctor, ff and others find the links: a port of this computer alone, or none "
        "(default: a free one)",
    )
    parser.add_argument(
        "--json", metavar="FILE", help="write what was recorded as JSON; - for standard output"
    )


def hub_port(text: str) -> int | None:
    """Parse the hub's port: 0 for a free port, None for `none`."""
    if text == NO_HUB:
        return None
    if not text.isdecimal() or int(text) > 65535:
        raise argparse.ArgumentTypeError(f"'{text}' is no port from 0 to 65535, and not {NO_HUB}")
    return int(text)


def run(arguments: argparse.Namespace) -> int:
    from bridge.clock import SystemClock
    from bridge.command_line import check_folder
    from gcs_plugin.recording.hub import Hub
    from tui.files import check_file
    from tui.links import refuse_second

    check_file("--json", arguments.json)
    clock = SystemClock()
    if arguments.next or arguments.end:
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


def order(arguments: argparse.Namespace, clock: "Clock") -> int:
    """Order the running recording to start the next dive, or to end."""
    import time

    from gcs_plugin.recording import orders
    from tui import show

    finished: Path
    present: Path | None = None
    if arguments.next:
        finished, present = orders.next_dive(clock, time.sleep)
    else:
        finished = orders.end(clock, time.sleep)
    console = show.results(arguments.json)
    show.say(console, orders.became(finished, present))
    outcome = {
        "finished": str(finished),
        "folder": str(present) if present else None,
    }
    show.write_json(outcome, arguments.json)
    return exit_codes.DONE


def record(arguments: argparse.Namespace, clock: "Clock", hub: "Hub | None") -> int:
    """Record until stopped, and report the result."""
    from bridge.command_line import until_stopped
    from bridge.errors import LogError
    from bridge.vehicle.config import load_vehicle
    from gcs_plugin.dives.folder import About, about_vehicle
    from gcs_plugin.peers import GROUND_STATION
    from gcs_plugin.recording import orders
    from gcs_plugin.recording.recorder import Notice
    from tui import show
    from tui.recording import RecordedDives, RecordingState, TellingRecorder

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
    name, same = arguments.name or configuration, arguments.same_conditions
    dives = RecordedDives(Path(arguments.out), name, about, clock, same_conditions=same)
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

    def notice(said: "Notice") -> None:
        state.notice(said)
        show.say(words, f"{said.level}: {said.sentence}")

    def warn(sentence: str) -> None:
        notice(Notice(recorder.unix_us(), "warning", sentence))

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

        def work(stop: "threading.Event") -> None:
            show.say(words, f"recording into {dives.folder.path}; Ctrl-C ends it")
            show.say(words, state.way)
            for sentence in sockets(arguments.link, hub):
                show.say(words, sentence)
            if opener.way:
                show.say(words, opener.way)
            recorder.run(stop)

        def each(since_s: float) -> bool:
            status.update(_line(recorder, since_s))
            asked = orders.ordered()
            if asked is orders.Order.NEXT:
                try:
                    dives.go_on(recorder, state.begin)
                except LogError as error:
                    notice(Notice(recorder.unix_us(), "error", f"no next dive: {error}"))
            return asked is orders.Order.END

        try:
            state.tell(recorder)
            until_stopped(work, clock, arguments.seconds, each)
        finally:
            state.end()
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


def sockets(links: "Sequence[str]", hub: "Hub | None") -> list[str]:
    """Sentences on the open network sockets."""
    from bridge.links.addresses import of_links, of_served

    served = [of_served(hub.address)] if hub else []
    return [*of_links(links, "a link that is recorded"), *served]


def summary(recorder: "Recorder", dives: "list[RecordedDive]") -> dict[str, Any]:
    """Summary of the recording as plain data: the last dive, the earlier dives, and the links over all of them."""
    *earlier, last = ({"folder": str(dive.folder) if dive.folder else None} | _counts(dive) for dive in dives)
    return last | {
        "earlier": earlier,
        "lost_here": recorder.lost_here,
        "links": {
            name: [asdict(reception) for reception in receptions]
            for name, receptions in recorder.receptions.items()
        },
    }


def _counts(dive: "RecordedDive") -> dict[str, int]:
    count = dive.count
    return {key: value for key, value in asdict(count).items() if key != "heard"}


def _line(recorder: "Recorder", since_s: float) -> str:
    return f"{since_s:.0f} s, {recorder.recorded} frames, {recorder.recorded_bytes / 1e3:.0f} kB"
