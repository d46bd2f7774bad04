"""`seatrial record`: links into a dive folder, and to everyone else on this computer."""

import argparse
import contextlib
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tui import exit_codes, numbers

if TYPE_CHECKING:
    import threading

    from bridge.clock import Clock
    from gcs_plugin.folder import DiveFolder
    from gcs_plugin.hub import Hub
    from gcs_plugin.recorder import Notice, Recorder

EXAMPLE = "seatrial record --link udpin:127.0.0.1:14550 --out dives"
NO_HUB = "none"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--link", required=True, action="append", metavar="SPEC", help="a link; may be given again"
    )
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
        "--seconds", type=numbers.seconds, metavar="N", help="stop after so long (default: at Ctrl-C)"
    )
    parser.add_argument(
        "--heartbeat",
        action="store_true",
        help="beat as a ground station, for a vehicle that waits to hear one",
    )
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
    """The port of the hub, 0 for a free one, None for `none`."""
    if text == NO_HUB:
        return None
    if not text.isdecimal() or int(text) > 65535:
        raise argparse.ArgumentTypeError(f"'{text}' is no port from 0 to 65535, and not {NO_HUB}")
    return int(text)


def run(arguments: argparse.Namespace) -> int:
    from bridge.clock import SystemClock
    from gcs_plugin.hub import Hub
    from tui.links import refuse_second
    from tui.outputs import check_file, check_folder

    check_file("--json", arguments.json)
    check_folder("--out", arguments.out)
    refuse_second(arguments.link)
    clock = SystemClock()
    if arguments.hub is None:
        return record(arguments, clock, None)
    hub = Hub(clock, arguments.hub)
    try:
        return record(arguments, clock, hub)
    finally:
        hub.close()


def record(arguments: argparse.Namespace, clock: "Clock", hub: "Hub | None") -> int:
    """Record until told to stop, and say what came of it."""
    import shutil

    from bridge.link.open import open_link
    from bridge.vehicle.config import load_vehicle
    from gcs_plugin.asked_conditions import last_conditions
    from gcs_plugin.conditions import NOTHING_SAID
    from gcs_plugin.folder import About, about_vehicle, new_folder
    from gcs_plugin.station import GROUND_STATION
    from tui import show
    from tui.recording_state import RecordingState
    from tui.running import until_stopped
    from tui.status_texts import TellingRecorder

    file = load_vehicle(arguments.vehicle) if arguments.vehicle else None
    links = [open_link(spec) for spec in arguments.link]
    configuration = (file.configuration or "") if file else ""
    folder = new_folder(Path(arguments.out), clock.unix_s(), arguments.name or configuration)
    about = about_vehicle(file, configuration) if file else About()
    before = last_conditions(Path(arguments.out), folder.path)
    folder.describe(replace(about, conditions=before) if arguments.same_conditions else about)
    words = show.words()
    if before != NOTHING_SAID:
        taken = "taken" if arguments.same_conditions else "`seatrial conditions --same` takes that"
        show.say(words, f"conditions of the dive before: {before.words}; {taken}")
    state = RecordingState(clock, tuple(arguments.link), folder.path, hub.address if hub else "")

    def notice(said: "Notice") -> None:
        state.notice(said)
        show.say(words, f"{said.level}: {said.sentence}")

    recorder: TellingRecorder = TellingRecorder(
        lambda text: show.say(words, text),
        links,
        folder.open_telemetry,
        clock,
        lambda: shutil.disk_usage(folder.path).free,
        notice,
        open_link,
        GROUND_STATION if arguments.heartbeat else None,
        hub,
        lambda: state.tell(recorder),
    )
    with words.status("waiting for the first frame") as status:

        def work(stop: "threading.Event") -> None:
            show.say(words, f"recording into {folder.path}; Ctrl-C ends it")
            show.say(words, state.way)
            recorder.run(stop)

        def each(since_s: float) -> None:
            status.update(_line(recorder, since_s))

        try:
            state.tell(recorder)
            until_stopped(work, clock, arguments.seconds, each)
        finally:
            state.end()
    heard = bool(recorder.heard)
    if not heard:
        remove(folder)
    found = summary(recorder, folder.path if heard else None, clock.boot_s())
    counts = f"{found['frames']} frames, {found['bytes']} bytes, {found['lost']} lost"
    show.say(show.results(arguments.json), f"{counts}: {folder.path}" if heard else counts)
    show.write_json(found, arguments.json)
    if not heard:
        kept = f"{folder.path} keeps its notes alone" if folder.path.exists() else "no dive folder is kept"
        show.say(
            words,
            f"nothing arrived on {', '.join(arguments.link)}, so {kept}; check vehicle, cable and port",
        )
        return exit_codes.LINK
    return exit_codes.NO if recorder.lost else exit_codes.DONE


def remove(folder: "DiveFolder") -> None:
    """Take away the folder of a dive in which nothing was heard; notes, and whatever else lies in it, keep it."""
    from gcs_plugin.folder import ABOUT

    noted = bool(folder.about().events)
    for path in (*folder.telemetry(), *([] if noted else [folder.path / ABOUT])):
        path.unlink(missing_ok=True)
    with contextlib.suppress(OSError):
        folder.path.rmdir()


def summary(recorder: "Recorder", folder: Path | None, now_s: float) -> dict[str, Any]:
    """What was recorded, as plain data."""
    return {
        "folder": str(folder) if folder else None,
        "files": recorder.files,
        "frames": recorder.recorded,
        "bytes": recorder.recorded_bytes,
        "lost": recorder.lost,
        "links": {
            name: [asdict(source) for source in health.snapshot(now_s).sources]
            for name, health in recorder.health.items()
        },
    }


def _line(recorder: "Recorder", since_s: float) -> str:
    return f"{since_s:.0f} s, {recorder.recorded} frames, {recorder.recorded_bytes / 1e3:.0f} kB"
