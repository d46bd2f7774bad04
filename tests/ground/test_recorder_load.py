"""The recorder under load: a pty and UDP at many times the rate of a vehicle, from a process of its own."""

import struct
import subprocess
import sys
import threading
import time

import pytest
from fakes.ports import open_pty
from figures import keep

from bridge.clock import SystemClock
from bridge.links.open import open_link
from bridge.wire.framing import Encoder
from bridge.wire.tlog import TlogWriter, read_tlog
from gcs_plugin.recording.recorder import Recorder

STEADY, BURST = "2000:600", "10000:5"
STEADY_SHORT, BURST_SHORT = "2000:1", "10000:0.5"
MOST_OF_A_CORE = 0.35
QUIET_S, AT_LAST_S = 1.0, 60.0

SENDER = """
import os, select, socket, struct, sys, time
from bridge.wire.framing import Encoder
kind, where = sys.argv[1:3]
if kind == "udp":
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sock.connect(("127.0.0.1", int(where)))
    send = sock.send
else:
    descriptor = int(where)
    def send(raw):
        while raw:
            select.select([], [descriptor], [])
            raw = raw[os.write(descriptor, raw):]
encoder, n = Encoder(1, 1), 0
def more(count):
    global n
    for n in range(n + 1, n + count + 1):
        send(encoder.frame(2, struct.pack("<QI", 1, n)))
for phase in sys.argv[3:]:
    rate, seconds = map(float, phase.split(":"))
    total, sent, start = round(rate * seconds), 0, time.monotonic()
    while sent < total:
        due = min(total, int((time.monotonic() - start) * rate) + 1) - sent
        more(due)
        sent += due
        time.sleep(0.005)
    print(n, flush=True)
# What the system dropped last is known with the next datagram.
time.sleep(1.0)
more(1)
print(n, flush=True)
"""


class Load:
    """A recorder under load: its counts, and in `shares` the part of a core that each phase took."""

    def __init__(self, folder, kind, *phases):
        self.notices: list[str] = []
        device = None
        if kind == "udp":
            link = open_link("udpin:127.0.0.1:0")
            where, passed = str(link.port), ()
        else:
            device, path = open_pty()
            link = open_link(f"serial:{path}:115200")
            where, passed = str(device._descriptor), (device._descriptor,)
        self.path = folder / "1.tlog"
        recorder = Recorder(
            [link],
            lambda n: TlogWriter(folder / f"{n}.tlog"),
            SystemClock(),
            lambda: 1 << 40,
            lambda notice: self.notices.append(notice.sentence),
        )
        stop = threading.Event()
        loop = threading.Thread(target=recorder.run, args=(stop,))
        loop.start()
        self.shares: list[float] = []
        try:
            with subprocess.Popen(
                [sys.executable, "-c", SENDER, kind, where, *phases],
                stdout=subprocess.PIPE,
                text=True,
                pass_fds=passed,
            ) as sender:
                for _ in phases:
                    cpu_s, since_s = time.process_time(), time.monotonic()
                    sender.stdout.readline()
                    self.shares.append((time.process_time() - cpu_s) / (time.monotonic() - since_s))
                self.sent = int(sender.stdout.readline())
            waited_s = 0.0
            while recorder.kept.frames + recorder.lost_here < self.sent and waited_s < AT_LAST_S:
                stop.wait(0.05)
                waited_s += 0.05
        finally:
            stop.set()
            loop.join(QUIET_S + AT_LAST_S)
            if device is not None:
                device.close()
        self.recorded, self.lost, self.lost_here = (
            recorder.kept.frames,
            recorder.kept.lost,
            recorder.lost_here,
        )

    @property
    def is_whole(self):
        """Whether the file holds all that was sent, once each and in order."""
        encoder = Encoder(1, 1)
        sent = (encoder.frame(2, struct.pack("<QI", 1, n + 1)) for n in range(self.sent))
        return all(frame.raw == raw for raw, (_, frame) in zip(sent, read_tlog(self.path), strict=True))


def test_a_burst_on_a_pty_is_recorded_whole(tmp_path):
    load = Load(tmp_path, "pty", STEADY_SHORT, BURST_SHORT)
    assert (load.sent, load.lost, load.lost_here) == (7001, 0, 0)
    assert load.is_whole


@pytest.mark.skipif(sys.platform != "linux", reason="the system does not count")
def test_a_burst_over_udp_is_recorded_or_told_as_lost_by_this_computer(tmp_path):
    load = Load(tmp_path, "udp", STEADY_SHORT, BURST_SHORT)
    assert load.sent == 7001
    assert (load.recorded + load.lost_here, load.lost) == (load.sent, 0)
    assert bool(load.notices) == bool(load.lost_here)
    assert load.is_whole or load.lost_here


@pytest.mark.soak
def test_ten_minutes_and_a_burst_are_recorded_whole_on_a_pty_and_over_udp(tmp_path):
    reports = []
    for kind in ("pty", "udp"):
        (tmp_path / kind).mkdir()
        load = Load(tmp_path / kind, kind, STEADY, BURST)
        assert (load.recorded, load.lost, load.lost_here) == (load.sent, 0, 0), kind
        assert load.is_whole
        steady, burst = load.shares
        assert steady <= MOST_OF_A_CORE, kind
        reports.append(
            f"{kind}: {load.recorded} of {load.sent} frames, {steady:.0%} of a core, {burst:.0%} in the burst"
        )
    keep("recorder_load", "; ".join(reports))
