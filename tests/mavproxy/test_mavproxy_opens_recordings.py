"""MAVProxy takes a replayed recording of ours for a vehicle and logs its frames.

Its own `--master=FILE.tlog` dies of its heartbeat, which it writes to the log, with every tlog: the way in is a
replay.
"""

from collections import Counter

import pytest
from console import MAVPROXY, Console
from second_vehicle import free_port
from waiting import until

from bridge import exit_codes
from bridge.errors import LogError
from bridge.wire.tlog import read_tlog
from tui import cli

# UDP loses what comes while MAVProxy is not given the processor; without load it misses none.
MOST_MISSED = 0.05
SPEED = "4"


def frames(path):
    """How often each frame stands in a recording; none while nothing has been written yet."""
    try:
        return Counter(frame.raw for _, frame in read_tlog(path))
    except LogError:
        return Counter()


@pytest.mark.skipif(MAVPROXY is None, reason="MAVProxy is not installed: pip install -e '.[dev]'")
def test_mavproxy_detects_the_vehicle_of_a_replayed_recording_and_logs_its_frames(tmp_path, dive):
    recording, address = dive / "telemetry.tlog", f"127.0.0.1:{free_port()}"
    ours = frames(recording)
    assert ours.total() > 1000
    with Console(tmp_path, [f"udpin:{address}"]) as console:
        console.wait_for("Waiting for heartbeat")
        line = ["replay", str(recording), "--link", f"udpout:{address}", "--speed", SPEED]
        assert cli.main(line) == exit_codes.DONE
        console.wait_for("Detected vehicle 1:1")
        until(lambda: (ours - frames(tmp_path / "mav.tlog")).total() <= MOST_MISSED * ours.total())
