"""`seatrial record`: links into a dive folder."""

import argparse
import contextlib
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tui import exit_codes, numbers

if TYPE_CHECKING:
    import threading

    from gcs_plugin.folder import DiveFolder
    from gcs_plugin.recorder import Notice, Recorder

EXAMPLE = "seatrial record --link udpin:127.0.0.1:14550 --out dives"


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
        "--seconds", type=numbers.seconds, metavar="N", help="stop after so long (default: at Ctrl-C)"
    )
    parser.add_argument(
        "--heartbeat",
        action="store_true",
        help="beat as a ground station, for a vehicle that waits to hear one",
    )
    parser.add_argument(
        "--json", metavar="FILE", help="write what was recorded as JSON; - for standard output"
    )


def run(arguments: argparse.Namespace) -> int:
    import shutil

    from bridge.clock import SystemClock
    from bridge.link.open import open_link
    from bridge.vehicle.config import load_vehicle
    from gcs_plugin.folder import About, about_vehicle, new_folder
    from gcs_plugin.station import GROUND_STATION
    from tui import show
    from tui.outputs import check_file, check_folder
    from tui.running import until_stopped
    from tui.status_texts import TellingRecorder

    check_file("--json", arguments.json)
    check_folder("--out", arguments.out)
    file = load_vehicle(arguments.vehicle) if arguments.vehicle else None
    links = [open_link(spec) for spec in arguments.link]
    clock = SystemClock()
    configuration = (file.configuration or "") if file else ""
    folder = new_folder(Path(arguments.out), clock.unix_s(), arguments.name or configuration)
    folder.describe(about_vehicle(file, configuration) if file else About())
    words = show.words()

    def notice(said: "Notice") -> None:
        show.say(words, f"{said.level}: {said.sentence}")

    recorder = TellingRecorder(
        lambda text: show.say(words, text),
        links,
        folder.open_telemetry,
        clock,
        lambda: shutil.disk_usage(folder.path).free,
        notice,
        open_link,
        GROUND_STATION if arguments.heartbeat else None,
    )
    with words.status("waiting for the first frame") as status:

        def work(stop: "threading.Event") -> None:
            show.say(words, f"recording into {folder.path}; Ctrl-C ends it")
            recorder.run(stop)

        def each(since_s: float) -> None:
            status.update(_line(recorder, since_s))

        until_stopped(work, clock, arguments.seconds, each)
    heard = bool(recorder.recorded or recorder.lost)
    if not heard:
        remove(folder)
    found = summary(recorder, folder.path if heard else None, clock.boot_s())
    counts = f"{found['frames']} frames, {found['bytes']} bytes, {found['lost']} lost"
    show.say(show.results(arguments.json), f"{counts}: {folder.path}" if heard else counts)
    show.write_json(found, arguments.json)
    if not heard:
        show.say(
            words,
            f"nothing arrived on {', '.join(arguments.link)}, so no dive folder is kept; "
            "check vehicle, cable and port",
        )
        return exit_codes.LINK
    return exit_codes.NO if recorder.lost else exit_codes.DONE


def remove(folder: "DiveFolder") -> None:
    """Take away the folder of a dive in which nothing was heard; whatever else lies in it keeps it."""
    from gcs_plugin.folder import ABOUT

    for path in (*folder.telemetry(), folder.path / ABOUT):
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
