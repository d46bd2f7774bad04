"""`python -m docs.make.pictures`: the app on dives of the simulated vehicle, as SVG into docs/images. Takes minutes."""

import asyncio
import os
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

from bridge.clock import SystemClock
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.mode import Mode
from bridge.wire.tlog import read_tlog
from gcs_plugin.feedforward.switch import Switch
from gcs_plugin.params.last_accepted import accepted_values
from gcs_plugin.recording.state import Holding, held
from gcs_plugin.watch.watcher import Watcher
from tui import links
from tui.app.app import LOOK_EVERY_S, SeatrialApp
from tui.app.desk import Desk
from tui.app.recorder import recording
from tui.app.station import LinkSource, Station
from tui.app.view import View, Views

ROOT = Path(__file__).resolve().parents[2]
IMAGES = ROOT / "docs" / "images"
VEHICLE = "ruvifist:hovering"
RECEIPTS = Path("receipts")
DISK_LEFT_S = 41 * 3600.0
LINK = "udpin:127.0.0.1:14550"
WATCHED_S = 52.0
"""Of the dive with both: it has surged both ways, and sways."""
NEW, UPLOADED = "new.json", "memory.json"
PATIENCE_S, FLOWN_S = 60.0, 300.0
AFTER, UNTIL = "after ", "until "
LIMITS = """shallowest_m: 0.3
deepest_m: 4
altitude_m: 1
distance_m: 4
speed_m_s: 0.8
tilt_deg: 25
battery_v: 13
time_s: 900
"""

Size = tuple[int, int]


@dataclass(frozen=True)
class Picture:
    """A screen after these steps: keys, `after VERB`, which waits for that job's end, or `until WORD`, which waits for
    that word on the screen; of the chosen `dive`. `before`: the vehicle is the one of the first dive, and nothing was
    uploaded to it. `live`: it is the vehicle afloat, with the parameters in the file `memory`. `ends`: steps once the
    picture is taken."""

    name: str
    steps: tuple[str, ...] = ()
    size: Size = (124, 32)
    dive: str = ""
    before: bool = False
    live: bool = False
    memory: str = NEW
    ends: tuple[str, ...] = ()


OLDEST = ("2", "after dives", "end", "enter")
PICTURES = (
    Picture("watch"),
    Picture("dives", ("2", "after dives")),
    Picture("identify", (*OLDEST, "i", "after identify"), before=True),
    # The vehicle holds the values of the first dive, so that the picture has old and new ones.
    Picture(
        "parameters",
        ("2", "after dives", "home", "i", "after identify", "p", "after params diff"),
        memory=UPLOADED,
    ),
    Picture(
        "validate", ("2", "after dives", "down", "enter", "6", "c", "c", "v", "after validate"), (160, 50)
    ),
    Picture("diagnose", ("4",), (160, 50), "weak/*-both"),
    Picture(
        "fly",
        ("until DISARMED", "7", "p", "after calibrate plan", "f", *"FLY", "enter", "until KNOWN"),
        live=True,
        ends=("x", "x", "after calibrate"),
    ),
)


class Still:
    """Views of one instant of a recording."""

    def __init__(self, shown: View) -> None:
        self._shown = shown

    def view(self) -> View:
        return self._shown

    def set_period(self, period_s: float) -> None:
        """A still does not move."""

    def force_off(self) -> None:
        """Nobody is there to be switched."""


@contextmanager
def live() -> Iterator[Views]:
    """Views of the vehicle that is recorded."""
    clock = SystemClock()
    source = LinkSource(lambda: links.of_recording(links.holding_now()), LINK, clock, silent=True)
    watcher = Watcher(load_vehicle(VEHICLE))
    station = Station(source, watcher, clock, recording, lambda known: Switch(Mode.OFF, known=known))
    station.start()
    yield station
    station.stop()


def at(telemetry: Path, seconds: float) -> View:
    """The watcher's picture of a recording, `seconds` after its beginning."""
    file = load_vehicle(VEHICLE)
    watcher = Watcher(file, accepted=partial(accepted_values, RECEIPTS, file.vehicle.name))
    began_us, now_s = 0, 0.0
    for unix_us, frame in read_tlog(telemetry):
        began_us = began_us or unix_us
        now_s = (unix_us - began_us) / 1e6
        if now_s > seconds:
            break
        watcher.feed(frame, now_s, LINK)
    began = datetime.fromtimestamp(began_us / 1e6, UTC)
    unix_s = began_us / 1e6 + now_s
    was_recorded = Holding(0, "", (), "", began.isoformat(), 0, 0, 0, DISK_LEFT_S, (), unix_s)
    return View(watcher.picture(now_s), unix_s, was_recorded)


def seatrial(*words: str) -> None:
    subprocess.run([sys.executable, "-m", "tui", *words], check=True, stdout=subprocess.DEVNULL)


def simulate(mission: str, *words: str) -> tuple[str, ...]:
    return ("simulate", "--vehicle", VEHICLE, "--mission", mission, *words)


@contextmanager
def afloat(memory: str) -> Iterator[None]:
    """A vehicle that is afloat with that file of parameters, and a recording of it."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    words = (
        ("record", "--link", f"udpin:127.0.0.1:{port}", "--out", "afloat"),
        simulate("idle", "--link", f"udpout:127.0.0.1:{port}", "--parameters", memory),
    )
    running = [
        subprocess.Popen([sys.executable, "-m", "tui", *command], stdout=subprocess.DEVNULL)
        for command in words
    ]
    try:
        until_s = time.monotonic() + PATIENCE_S
        while held(time.time()) is None and time.monotonic() < until_s:
            time.sleep(0.1)
        yield
    finally:
        for process in running:
            process.send_signal(signal.SIGINT)
            process.wait()


def dives() -> tuple[Path, Path]:
    """The dives of the tutorial; the telemetry of the last, with both, and of the first."""
    seatrial(*simulate("validation", "--parameters", UPLOADED))
    (first,) = Path("dives").iterdir()
    seatrial("identify", str(first), "--vehicle", "ruvifist", "--param", "first.param")
    with afloat(UPLOADED):
        seatrial(
            "params", "upload", "first.param", "--vehicle", "ruvifist", "--yes", "--receipts", str(RECEIPTS)
        )
    for mode in ("shadow", "both"):
        seatrial(*simulate("validation", "--mode", mode, "--parameters", UPLOADED))
    weak = ("--onset", "0", "T1_gain=0.8", "--mode", "both", "--parameters", UPLOADED, "--out", "weak")
    for seed in ("3", "4"):
        seatrial(*simulate("validation", *weak, "--seed", seed))
    first_weak, other = sorted(Path("weak").iterdir())
    diagnosis = (
        "--check",
        str(other),
        "--json",
        str(first_weak / "diagnosis.json"),
        "--accept",
        str(first_weak / "diagnosed.param"),
    )
    seatrial("diagnose", str(first_weak), "--vehicle", VEHICLE, *diagnosis)
    (last,) = Path("dives").glob("*-both")
    return last / "telemetry.tlog", first / "telemetry.tlog"


def drawn(picture: Picture, views: Views) -> str:
    async def work() -> str:
        chosen = min(Path().glob(picture.dive)) if picture.dive else None
        out = Path("dives") if chosen is None else chosen.parent
        receipts = Path("none") if picture.before else RECEIPTS
        desk = Desk(VEHICLE, out, receipts, chosen, links=lambda: (LINK,))
        app = SeatrialApp(views, keep_theme=lambda _: None, desk=desk)
        async with app.run_test(size=picture.size) as pilot:

            async def take(steps: Sequence[str]) -> None:
                for step in steps:
                    if not step.startswith((AFTER, UNTIL)):
                        await pilot.press(step)
                    await pilot.pause(0.5)
                    while step.startswith(AFTER) and desk.jobs.runs(step.removeprefix(AFTER)):
                        await pilot.pause(0.1)
                    until_s = time.monotonic() + FLOWN_S
                    while step.startswith(UNTIL) and step.removeprefix(UNTIL) not in app.export_screenshot():
                        if time.monotonic() > until_s:
                            raise TimeoutError(f"{picture.name}: {step}")
                        await pilot.pause(0.5)

            await pilot.pause(0.5)
            await take(picture.steps)
            await pilot.pause(LOOK_EVERY_S + 0.5)  # what is to be done next is looked up anew
            shown = app.export_screenshot(title="seatrial tui")
            await take(picture.ends)
            return shown

    # No net is needed to look at a picture: fonts are those of whoever looks.
    return re.sub(r"@font-face \{.*?\}\s*|<!--.*?-->\s*", "", asyncio.run(work()), flags=re.S)


def main(names: Sequence[str]) -> None:
    """Draw the named pictures, all where none is named."""
    IMAGES.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as name:
        os.chdir(name)
        os.environ |= {"XDG_STATE_HOME": name, "PYTHONPATH": str(ROOT)}
        Path("limits.yaml").write_text(LIMITS, encoding="utf-8")
        wanted = [picture for picture in PICTURES if not names or picture.name in names]
        stills = [] if all(picture.live for picture in wanted) else [at(file, WATCHED_S) for file in dives()]
        Path("dives").mkdir(exist_ok=True)
        for memory in dict.fromkeys(picture.memory for picture in wanted):
            with afloat(memory), live() as now:
                for picture in wanted:
                    if picture.memory == memory:
                        views = now if picture.live else Still(stills[picture.before])
                        (IMAGES / f"{picture.name}.svg").write_text(drawn(picture, views), encoding="utf-8")
        os.chdir(ROOT)


if __name__ == "__main__":
    main(sys.argv[1:])
