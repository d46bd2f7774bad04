"""The module in a real MAVProxy that hears its vehicle by way of `seatrial record`, which records it."""

import subprocess
import sys
from pathlib import Path

import pytest
from console import MAVPROXY, Console
from fakes.ports import free_port
from second_vehicle import SecondVehicle

from bridge.clock import SystemClock
from bridge.wire.tlog import read_tlog
from gcs_plugin.dives.folder import load_folder
from gcs_plugin.recording.state import held


@pytest.fixture
def vehicle():
    with SecondVehicle() as vehicle:
        yield vehicle.master


@pytest.fixture
def recorder(vehicle, tmp_path):
    """`seatrial record`, and the address of its hub."""
    port = free_port()
    words = [sys.executable, "-P", "-m", "tui", *f"record --link {vehicle} --out dives --hub {port}".split()]
    with subprocess.Popen(words, cwd=tmp_path, stderr=subprocess.PIPE, text=True) as running:
        try:
            assert "recording into" in running.stderr.readline()
            yield running, f"tcp:localhost:{port}"
        finally:
            running.kill()
            running.stderr.close()


def folder_now():
    holding = held(SystemClock().unix_s())
    return None if holding is None else Path(holding.folder)


@pytest.mark.slow
@pytest.mark.skipif(MAVPROXY is None, reason="MAVProxy is not installed: pip install -e '.[dev]'")
def test_it_says_who_records_where_and_the_next_dive_and_notes_go_there(recorder, tmp_path):
    running, hub = recorder
    with Console(tmp_path, [hub]) as console:
        console.wait_for("Detected vehicle 2:1")
        first = folder_now()
        how = r"\d\d:\d\d:\d\d, [1-9]\d* frames, "
        console.until("seatrial status", rf"recorded by process {running.pid} into {first}: {how}")
        console.ask(
            "seatrial record stop", rf"process {running.pid} records, not MAVProxy; `seatrial record --end`"
        )
        console.ask("seatrial record note leaves the harbour", f"noted in {first}")
        console.until("seatrial status", "00:00:([1-5][0-9]|0[6-9])")
        console.ask("seatrial record next", r"is\s+finished;\s+the\s+next\s+dive\s+goes\s+into\s+\S+")
        second = folder_now()
        assert second != first
        # So many that not all are the ground's own: a dive in which nothing was heard keeps no folder.
        heard = r"\d\d:\d\d:\d\d, [1-9]\d\d+ frames, "
        console.until("seatrial status", rf"recorded by process {running.pid} into {second}: {heard}")
        console.ask("seatrial identify --vehicle ruvifist", rf"identify: {first}, in a process of its own")
        console.ask("seatrial cancel", "stopped by the user")
        running.terminate()
        running.wait()
        console.until("seatrial status", "NOT RECORDING\n")
    assert [event.text for event in load_folder(first).about().events] == ["leaves the harbour"]
    before, after = (
        [frame for path in load_folder(folder).telemetry() for _, frame in read_tlog(path)]
        for folder in (first, second)
    )
    numbers = [frame.sequence for frame in (*before, *after) if frame.system == 2]
    assert numbers == [(numbers[0] + n) % 256 for n in range(len(numbers))], (
        "a frame is in neither dive, or in both"
    )
