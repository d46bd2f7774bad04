"""`python -m docs.make.pictures`: the app on dives of the simulated vehicle, as SVG into docs/images. Takes minutes."""

import asyncio
import re
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from bridge.tlog import read_tlog
from bridge.vehicle.config import load_vehicle
from gcs_plugin.watch.watcher import Watcher
from tui.app.app import SeatrialApp
from tui.app.desk import Desk
from tui.app.view import Recording, View

IMAGES = Path(__file__).resolve().parents[1] / "images"
VEHICLE = "ruvifist:hovering"
DISK_LEFT_S = 41 * 3600.0
LINK = "udpin:127.0.0.1:14550"
WATCHED_S = 78.0
"""Of the validation dive: in the middle of its second leg."""

Size = tuple[int, int]
WIDE: Size = (132, 38)


@dataclass(frozen=True)
class Picture:
    """A screen after these keys; `waits_for` is a verb whose job must have ended."""

    name: str
    keys: tuple[str, ...] = ()
    waits_for: str = ""
    size: Size = WIDE


PICTURES = (
    Picture("watch"),
    Picture("dives", ("2",), "dives"),
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


def at(telemetry: Path, seconds: float) -> View:
    """What the watcher makes of a recording up to `seconds` after its beginning."""
    watcher = Watcher(load_vehicle(VEHICLE))
    began_us, now_s = 0, 0.0
    for unix_us, frame in read_tlog(telemetry):
        began_us = began_us or unix_us
        now_s = (unix_us - began_us) / 1e6
        if now_s > seconds:
            break
        watcher.feed(frame, now_s, LINK)
    unix_s = began_us / 1e6
    return View(watcher.picture(now_s), unix_s + now_s, Recording(unix_s, DISK_LEFT_S, 0))


def seatrial(folder: Path, *words: str) -> None:
    """Run a verb in `folder`; what it answers is on the disk."""
    subprocess.run([sys.executable, "-m", "tui", *words], cwd=folder, check=True, stdout=subprocess.DEVNULL)


def dive(folder: Path) -> Path:
    """Three dives of the simulated vehicle, the first of them identified; the telemetry of the last."""
    simulate = ("simulate", "--vehicle", VEHICLE, "--parameters", "memory.json")
    seatrial(folder, *simulate, "--mission", "hovering", "--seed", "1")
    (first,) = (folder / "dives").iterdir()
    beside = (f"--json={first}/identified.json", f"--param={first}/identified.param")
    seatrial(folder, "identify", str(first), "--vehicle", "ruvifist", *beside)
    for seed, mode in enumerate(("off", "shadow"), 2):
        seatrial(folder, *simulate, "--mission", "validation", "--mode", mode, "--seed", str(seed))
    (last,) = (folder / "dives").glob("*-shadow")
    return last / "telemetry.tlog"


def drawn(picture: Picture, view: View, folder: Path) -> str:
    """The screen as SVG."""

    async def work() -> str:
        desk = Desk(VEHICLE, folder / "dives", folder / "receipts")
        app = SeatrialApp(Still(view), keep_theme=lambda _: None, desk=desk)
        async with app.run_test(size=picture.size) as pilot:
            await pilot.pause()
            for key in picture.keys:
                await pilot.press(key)
                await pilot.pause()
            while picture.waits_for and desk.jobs.runs(picture.waits_for):
                await pilot.pause(0.1)
            for _ in range(5):
                await pilot.pause(0.1)
            return app.export_screenshot(title="seatrial tui")

    # No net is needed to look at a picture: fonts are those of whoever looks.
    return re.sub(r"@font-face \{.*?\}\s*|<!--.*?-->\s*", "", asyncio.run(work()), flags=re.S)


def main(names: Sequence[str]) -> None:
    """Draw the named pictures, all where none is named."""
    IMAGES.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        view = at(dive(folder), WATCHED_S)
        for picture in PICTURES:
            if not names or picture.name in names:
                (IMAGES / f"{picture.name}.svg").write_text(drawn(picture, view, folder), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
