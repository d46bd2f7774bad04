"""The operator's station: time from a finished dive to an upload verified by the vehicle's own values.

The app itself runs without a terminal, driven by its keys. The vehicle is simulated; the recorder that runs next to
the app is the real recorder.
"""

import asyncio
import contextlib
import os
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from textual.pilot import Pilot

from bench.campaigns import dived
from bench.remembered import Data, Remembered
from bench.stamp import PAPERS_VEHICLE, reached, stamp
from bench.words import blocks, paragraph, table
from bridge.clock import SystemClock
from bridge.errors import LinkError, LinkTimeout
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.mode import Mode
from gcs_plugin.feedforward.switch import Switch
from gcs_plugin.recording.state import held
from gcs_plugin.watch.watcher import Watcher
from tui import links
from tui.app import recorder
from tui.app.app import SeatrialApp
from tui.app.desk import Desk
from tui.app.station import LinkSource, Station

STARTED = ("tui/commands/simulate.py", "tui/commands/record.py", "identify/estimators/table.py")
"""What the app and this start as programs of their own."""

SOURCES = (reached("bench/operation/station.py", "tui/app/screens", *STARTED), "gcs_plugin", *PAPERS_VEHICLE)
CONFIGURATION = "hovering"
VEHICLE = f"ruvifist:{CONFIGURATION}"
SIZE = (80, 24)
GOAL_S, GOAL_KEYS = 60.0, 6
PATIENCE_S = 600.0
STEPS = ("identified", "what is to be confirmed", "written and read back")


def page(cache: Path, seed: int) -> str:
    kept = Remembered(cache / f"station-{stamp(*SOURCES)}.jsonl")
    campaign = dived(CONFIGURATION, CONFIGURATION, seed, cache / "dives")
    dive_s = float(campaign.time_s[-1])
    return words_of(kept.get(f"{CONFIGURATION} {seed}", lambda: measured(campaign.dive.source)), dive_s)


def measured(log: Path) -> Data:
    """Seconds from the first key to each step on the screen, the number of keys, and the number of lines written."""
    with tempfile.TemporaryDirectory() as name, _afloat(Path(name)) as dives:
        folder = dives / "2026-01-01T0000Z-finished"
        folder.mkdir()
        shutil.copy(log, folder / "telemetry.tlog")
        station = by_the_recording()
        desk = Desk(VEHICLE, dives, dives.parent / "receipts", recorded=recorder.recorded)
        station.start()
        try:
            return asyncio.run(_flown(SeatrialApp(station, keep_theme=lambda _: None, desk=desk)))
        finally:
            station.stop()


def by_the_recording() -> Station:
    """The app's station for the vehicle that is being recorded."""
    clock = SystemClock()
    return Station(
        LinkSource(lambda: links.of_recording(links.holding_now()), "hub", clock),
        Watcher(load_vehicle(VEHICLE)),
        clock,
        recorder.recording,
        lambda known: Switch(Mode.OFF, known=known),
    )


async def _flown(app: SeatrialApp) -> Data:
    """Run from Identify to the receipt, pressing each key as soon as the screen asks for it."""
    async with app.run_test(size=SIZE) as pilot:
        await _seen(app, pilot, "LINK 0")
        began_s, reached, keys = time.monotonic(), [], 0

        async def press(*pressed: str) -> None:
            nonlocal keys
            keys += len(pressed)
            await pilot.press(*pressed)

        async def until(pattern: str) -> re.Match[str]:
            match = await _seen(app, pilot, pattern)
            reached.append(time.monotonic() - began_s)
            return match

        await press("i")
        await until("converged")
        await press("p", "u")
        lines = (await until(r"type (\d+) and Enter"))[1]
        await press(*lines, "enter")
        await until(r"applied: \d+ parameters written and read back")
    return {"reached": reached, "keys": keys, "lines": int(lines)}


async def _seen(app: SeatrialApp, pilot: Pilot[None], pattern: str) -> re.Match[str]:
    """Wait for text on the screen that matches, and return the match. Raises LinkTimeout."""
    until_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < until_s:
        await pilot.pause(0.05)
        strips = app.screen._compositor.render_strips()
        said = " ".join(" ".join(strip.text for strip in strips).split())
        if match := re.search(pattern, said):
            return match
    raise LinkTimeout(f"'{pattern}' was not seen within {PATIENCE_S:.0f} s, but: {said}")


@contextlib.contextmanager
def _afloat(folder: Path) -> Iterator[Path]:
    """Run the simulated vehicle and a recording of it; yields the folder of the dives."""
    with socket.socket(type=socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        link = f"udpout:127.0.0.1:{probe.getsockname()[1]}"
    os.environ["XDG_STATE_HOME"] = str(folder / "state")
    dives = folder / "dives"
    dives.mkdir()
    simulate = f"simulate --vehicle {VEHICLE} --mission idle --link {link}"
    words = [sys.executable, "-P", "-m", "tui", *simulate.split()]
    records = recorder.record_command(
        ["--link", link.replace("udpout", "udpin"), "--vehicle", VEHICLE, "--out", str(dives)]
    )
    with _running(words, folder), _running(records, folder) as recording:
        while held(time.time()) is None:
            if recording.poll() is not None:
                raise LinkError(f"the recording ended with {recording.returncode} before it had begun")
            time.sleep(0.1)
        yield dives


@contextlib.contextmanager
def _running(words: Sequence[str], folder: Path) -> "Iterator[subprocess.Popen[bytes]]":
    """A program that ends with the block, however that ends."""
    with subprocess.Popen(words, cwd=folder, stderr=subprocess.DEVNULL) as process:
        try:
            yield process
        finally:
            process.terminate()


def words_of(timed: Data, dive_s: float) -> str:
    whole_s, keys = timed["reached"][-1], timed["keys"]
    verdict = "met" if whole_s <= GOAL_S and keys <= GOAL_KEYS else "missed"
    rows = [(name, f"{seconds:.1f}") for name, seconds in zip(STEPS, timed["reached"], strict=True)]
    return blocks(
        "## From a dive to a verified upload",
        paragraph(
            f"The paper's hovering dive of {dive_s:.0f} s, its simulated vehicle afloat and recorded beside it, and",
            f"the app by its keys at {SIZE[0]} x {SIZE[1]}: {keys} keys, digits and Enter counted, to write",
            f"{timed['lines']} parameters.",
        ),
        table(("on the screen", "seconds since the first key"), rows),
        f"Goal of {GOAL_KEYS} keys and {GOAL_S:.0f} s: {verdict}.",
    )
