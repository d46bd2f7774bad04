"""Bridge, recorder and app at ten times real time, with faults at random: they run on, and memory stays as it is."""

import os
import random
import signal
import statistics
import subprocess
import sys
import time
from pathlib import Path

import pytest
from bad_link import BadLink
from figures import keep
from replayed_vehicle import free_port
from tmux import NEEDS_TMUX, ROOT, Tmux, alone
from waiting import until

from bridge.wire.tlog import each_nonempty, read_tlog
from gcs_plugin.dives.folder import list_folders
from gcs_plugin.recording.state import held

pytestmark = [pytest.mark.slow, NEEDS_TMUX]
SEATRIAL = (sys.executable, "-P", "-m", "tui")
TIMES = 10.0
SHORT_MINUTES, LONG_MINUTES = 0.25, 60.0
MOST_MORE_MEMORY = 0.05
FAULT_EVERY_S = 3.0
NEXT_DIVE_EVERY = 20
SIZES = ((80, 24), (160, 50), (120, 30))
SOON_S = 120.0
PAGE_BYTES = os.sysconf("SC_PAGE_SIZE")


def memory_mb(pid):
    """What a process holds in memory."""
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * PAGE_BYTES / 1e6


class LongRun:
    """The three of them, each a process of its own, with a bad link between the vehicle and its ground."""

    def __init__(self, folder, seed):
        self.folder, self.rng, port = folder, random.Random(seed), free_port()
        self.link = BadLink(port, seed)
        self.memory_mb = {"bridge": [], "recorder": [], "app": []}
        environment = {**os.environ, "PYTHONPATH": f"{ROOT}:{ROOT / 'tests'}"}
        command = [sys.executable, str(Path(__file__).with_name("fast_bridge.py"))]
        self.bridge = subprocess.Popen(
            [*command, str(folder), f"udpout:127.0.0.1:{self.link.port}", str(TIMES), str(seed)],
            env=environment,
            stdin=subprocess.PIPE,
        )
        self.link.start()
        line = f"{' '.join(SEATRIAL)} tui --link udpin:127.0.0.1:{port} --out {folder}/dives"
        self.app = Tmux(f"seatrial-long-{os.getpid()}", 80, 24, "sh", alone(folder))
        self.app.keys(f"cd {folder}; exec {line}", "Enter")
        self.app.until("LINK 0.", "REC 00:")
        self.link.crowd()
        self.pids = {"bridge": self.bridge.pid, "recorder": held(time.time()).pid, "app": self.app.process()}

    def trouble(self):
        """One more fault of those that are not the link's or a device's."""
        fault = self.rng.randrange(4)
        if fault == 0:
            stopped = self.rng.choice(list(self.pids.values()))
            os.kill(stopped, signal.SIGSTOP)
            time.sleep(self.rng.uniform(0.0, 2.0))
            os.kill(stopped, signal.SIGCONT)
        elif fault == 1:
            self.app.resize(*self.rng.choice(SIZES))
        elif fault == 2:
            self.app.keys(*self.rng.choice((("?", "Escape"), ("c",), ("C-p", "Escape"))))
        elif self.rng.random() < 1 / NEXT_DIVE_EVERY:
            subprocess.run(
                [*SEATRIAL, "record", "--next"], env=alone(self.folder), check=False, capture_output=True
            )

    def last(self, minutes):
        """All of it for so long."""
        until_s = time.monotonic() + 60 * minutes
        while time.monotonic() < until_s:
            time.sleep(self.rng.expovariate(1 / FAULT_EVERY_S))
            self.trouble()
            if sys.platform == "linux":
                for name, pid in self.pids.items():
                    self.memory_mb[name].append(memory_mb(pid))

    def frames(self):
        """How many frames are in the dives by now."""
        return sum(
            sum(1 for _ in records)
            for folder in list_folders(self.folder / "dives")
            for records in each_nonempty(folder.telemetry(), read_tlog)
        )

    def growth(self):
        """By what share the memory of each grew from the second quarter of the run to its last."""
        grown = {}
        for name, seen in self.memory_mb.items():
            quarter = len(seen) // 4
            before = statistics.median(seen[quarter : 2 * quarter])
            grown[name] = statistics.median(seen[-quarter:]) / before - 1.0
        return grown

    def close(self):
        self.link.close()
        self.app.close()
        self.bridge.stdin.close()
        if holding := held(time.time()):
            os.kill(holding.pid, signal.SIGTERM)
        self.ended_with = self.bridge.wait(SOON_S)


@pytest.fixture
def run(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    going = LongRun(tmp_path, 1)
    yield going
    going.close()


def check_all_run_on(run):
    """The same three processes as at the start, and what the vehicle says comes through all of them."""
    run.link.mend()
    run.app.resize(80, 24)
    assert run.bridge.poll() is None
    assert held(time.time()).pid == run.pids["recorder"]
    assert run.app.process() == run.pids["app"]
    run.app.until("LINK 0.", "REC ", without=("LINK LOST",))
    before = run.frames()
    until(lambda: run.frames() > before + 100, SOON_S)


def test_bridge_recorder_and_app_run_on_whatever_happens(run):
    run.last(SHORT_MINUTES)
    check_all_run_on(run)


@pytest.mark.soak
def test_bridge_recorder_and_app_run_on_for_an_hour_and_their_memory_stays(run):
    run.last(LONG_MINUTES)
    check_all_run_on(run)
    grown = run.growth()
    growth = ", ".join(
        f"{name} {share:+.1%} of {run.memory_mb[name][-1]:.0f} MB" for name, share in grown.items()
    )
    assert max(grown.values()) <= MOST_MORE_MEMORY, growth
    keep("long_run", f"{LONG_MINUTES:.0f} min, {run.frames()} frames; memory: {growth}")
