"""The app in a real headless Chromium, with a vehicle that is replayed: read, view-only, and with control."""

import asyncio
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from browser import CHROMIUM, PATIENCE_S, opened
from replayed_vehicle import ReplayedVehicle, free_port, record

from gcs_plugin.recording.state import held

ROOT = Path(__file__).resolve().parents[2]
CTRL_X = ("x", 88)

pytestmark = [pytest.mark.slow, pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed")]


@pytest.fixture
def vehicle(tmp_path):
    replayed = ReplayedVehicle(record(tmp_path / "telemetry.tlog"), f"udpout:127.0.0.1:{free_port()}")
    replayed.deaf = False
    replayed.start()
    yield replayed
    replayed.stop()


@pytest.fixture
def page(tmp_path, vehicle, monkeypatch):
    """Serve the page of that vehicle with further options; its address, and the words that were said before."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    monkeypatch.delenv("NO_COLOR", raising=False)
    started = []

    def serve(*options):
        link = vehicle.link.name.replace("udpout", "udpin")
        words = ["tui", "--web", "--port", "0", "--link", link, "--out", str(tmp_path / "dives"), *options]
        log = tmp_path / "words.txt"
        with log.open("wb") as file:
            started.append(
                subprocess.Popen(
                    [sys.executable, "-m", "tui", *words], stdout=file, stderr=file, cwd=tmp_path
                )
            )
        return _address(log, started[0]), log

    yield serve
    for process in started:
        process.send_signal(signal.SIGINT)
        assert process.wait(PATIENCE_S) == 0
    if (holding := held(time.time())) is not None:
        os.kill(holding.pid, signal.SIGTERM)


def _address(log, process):
    until_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < until_s:
        addresses = [word for word in log.read_text(encoding="utf-8").split() if word.startswith("http://")]
        if addresses:
            return addresses[0]
        assert process.poll() is None, log.read_text(encoding="utf-8")
    raise AssertionError("the page was not served")


@pytest.mark.soak
def test_the_page_shows_the_vehicle_takes_keys_at_once_and_lets_nobody_do_more_than_look(
    page, vehicle, tmp_path
):
    address, log = page()
    words = log.read_text(encoding="utf-8")
    assert "open: 127.0.0.1 port" in words
    assert "the page, view-only" in words
    assert "warning" not in words

    async def work():
        async with opened(address, tmp_path / "profile") as browser:
            # Keys are taken before anyone has clicked; to read the terminal is to click on it.
            await browser.until_true("document.querySelector('.-first-byte') !== null")
            await browser.until_true("document.activeElement.matches('#terminal textarea')")
            await browser.key(*CTRL_X, ctrl=True)
            await browser.until("nothing is done from here")
            await browser.until("VIEW ONLY", "■ ARMED", "LINK 0.", "FF both", "surge u", "ref   0.300", "DVL")
            assert vehicle.asked == 0
            assert vehicle.mode == 3.0
            return browser.requests

    requests = asyncio.run(work())
    assert {urlsplit(asked).netloc for asked in requests if not asked.startswith("data:")} == {
        urlsplit(address).netloc
    }
    assert any(asked.startswith("ws://") for asked in requests)
    assert not (tmp_path / "state" / "seatrial" / "tui.json").exists()


def test_with_control_the_off_key_reaches_the_vehicle_from_the_page(page, vehicle, tmp_path):
    address, log = page("--control")
    assert "the page, with every control" in log.read_text(encoding="utf-8")

    async def work():
        async with opened(address, tmp_path / "profile") as browser:
            await browser.until("■ ARMED", "FF both", without=("VIEW ONLY",))
            await browser.key(*CTRL_X, ctrl=True)
            await browser.until("FF OFF,")

    asyncio.run(work())
    assert vehicle.mode == 0.0
