"""From a finished dive to a verified upload, all real but the water: six keys, and the vehicle is read by another.

The keys are counted as a finger counts them: one for each press, the digits of the number of lines and Enter included.
The dive tells ten lines or more, as most do, so that the number has two digits.
"""

import asyncio
import contextlib
import re
import signal
import subprocess
import sys
import time

import pytest
from replayed_vehicle import free_port
from screen_text import made, settled, text
from waiting import until

from bench.station import VEHICLE, by_the_recording
from bridge import exit_codes
from bridge.clock import SystemClock
from bridge.links.open import open_link
from gcs_plugin.params.client import ParameterClient
from gcs_plugin.params.files import read_parameters
from gcs_plugin.recording.state import held
from tui import cli
from tui.app import recorder
from tui.app.desk import Desk

LEGS = """
name: there and back
legs:
  - {name: rest, phase: rest, duration_s: 3}
  - {name: surge, duration_s: 3, push_surge_n: 24, alternate: 6}
  - {name: sway, duration_s: 3, push_sway_n: 24, alternate: 6}
  - {name: heave, duration_s: 3, push_heave_n: 16, alternate: 6}
  - {name: yaw, duration_s: 3, push_yaw_nm: 6, alternate: 6}
"""
MOST_KEYS = 6
PATIENCE_S = 120.0

pytestmark = pytest.mark.soak


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Where everything lies, a finished dive among it."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "legs.yaml").write_text(LEGS, encoding="utf-8")
    words = ["simulate", "--vehicle", VEHICLE, "--mission", "legs.yaml", "--seed", "100001", "--out", "dives"]
    assert cli.main(words) == exit_codes.DONE
    return tmp_path


@pytest.fixture
def recording(folder):
    """The vehicle afloat, and a recording of it that runs."""
    link = f"udpout:127.0.0.1:{free_port()}"
    words = [
        sys.executable,
        "-P",
        "-m",
        "tui",
        "simulate",
        "--vehicle",
        VEHICLE,
        "--mission",
        "idle",
        "--link",
        link,
    ]
    with subprocess.Popen(words, cwd=folder, stderr=subprocess.PIPE, text=True) as vehicle:
        try:
            assert "afloat" in vehicle.stderr.readline()
            options = ["--link", link.replace("udpout", "udpin"), "--vehicle", VEHICLE, "--out", "dives"]
            with subprocess.Popen(recorder.record_command(options), stderr=subprocess.DEVNULL) as records:
                until(lambda: held(time.time()) is not None)
                yield
                records.send_signal(signal.SIGINT)
        finally:
            vehicle.terminate()
            vehicle.stderr.close()


class Hand:
    """Presses keys and counts them."""

    def __init__(self, app, pilot):
        self.app, self.pilot, self.keys = app, pilot, []

    async def press(self, *keys):
        self.keys += keys
        await self.pilot.press(*keys)

    async def until(self, pattern):
        """The screen once it holds `pattern`: the match."""
        until_s = time.monotonic() + PATIENCE_S
        while time.monotonic() < until_s:
            await self.pilot.pause(0.2)
            if found := re.search(pattern, " ".join(text(self.app).split())):
                return found
        pytest.fail(f"'{pattern}' not seen within {PATIENCE_S:.0f} s:\n{text(self.app)}")


def vehicle_holds():
    """All parameters, as somebody else reads them."""
    with contextlib.closing(open_link(recorder.hub())) as link:
        client = ParameterClient(link, SystemClock())
        client.find_vehicle()
        return client.read_all()


async def fly(hand):
    """From Watch to the receipt."""
    await hand.until("LINK 0")
    await hand.press("i")
    await hand.until("converged")
    await hand.press("p", "u")
    lines = (await hand.until(r"type (\d+) and Enter"))[1]
    await hand.press(*lines, "enter")
    await hand.until(r"✓ applied: \d+ parameters written and read back, set \d+ is active")
    return int(lines)


@pytest.mark.usefixtures("recording")
def test_from_a_finished_dive_to_a_verified_upload_in_six_keys(folder):
    station = by_the_recording()
    desk = Desk(VEHICLE, folder / "dives", folder / "receipts", recorded=recorder.recorded)
    app = made(station, desk=desk)
    before = vehicle_holds()

    async def work():
        async with app.run_test(size=(80, 24)) as pilot:
            await settled(app, pilot)
            hand = Hand(app, pilot)
            return await fly(hand), hand.keys

    station.start()
    try:
        lines, keys = asyncio.run(work())
    finally:
        station.stop()
    (identified,) = (folder / "dives").glob("*/identified.param")
    wanted = read_parameters(identified)
    now = vehicle_holds()
    assert lines >= 10
    assert len(keys) <= MOST_KEYS
    assert len(wanted) == lines
    assert {name: now[name] for name in wanted} == wanted
    assert now["FF_ACTIVE"] not in (before["FF_ACTIVE"], 0.0)
    unchanged = {name for name in now if not name.startswith(("FF_ACTIVE", "FF_COMMIT"))} - set(wanted)
    assert {name: now[name] for name in unchanged} == {name: before[name] for name in unchanged}
    (accepted,) = (folder / "receipts").glob("*-accepted.param")
    assert read_parameters(accepted) == wanted
    assert held(time.time()) is not None, "the recording went on all along"
