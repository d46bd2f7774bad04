"""What runs in a terminal that goes away, as that of an ssh session that drops: it ends in order, as by Ctrl-C."""

import json
import os
import signal
import subprocess
import sys
from contextlib import suppress

from fakes.processes import ROOT, SOON_S, TalkingVehicle
from waiting import until

from bridge import exit_codes


class InTerminal:
    """`seatrial WORDS` on a terminal of its own."""

    def __init__(self, *words):
        self._side, other = os.openpty()
        os.set_blocking(self._side, False)
        self._seen = b""
        self.process = subprocess.Popen(
            [sys.executable, "-m", "tui", *words],
            cwd=ROOT,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            stdin=other,
            stdout=other,
            stderr=other,
            start_new_session=True,
        )
        os.close(other)

    def until(self, words):
        def shown():
            with suppress(BlockingIOError):
                self._seen += os.read(self._side, 1 << 16)
            return words in self._seen

        until(shown, SOON_S)

    def goes_away(self):
        """The exit code."""
        os.close(self._side)
        self.process.send_signal(signal.SIGHUP)
        try:
            return self.process.wait(SOON_S)
        finally:
            self.process.kill()


def test_a_recording_whose_terminal_goes_away_is_ended_and_counted(tmp_path):
    vehicle = TalkingVehicle()
    places = ("--out", str(tmp_path / "dives"), "--json", str(tmp_path / "counts.json"))
    recorder = InTerminal("record", "--link", vehicle.link, *places)
    recorder.until(b"recording into")
    until(lambda: any(path.stat().st_size for path in tmp_path.glob("dives/*/telemetry.tlog")))
    assert recorder.goes_away() == exit_codes.DONE
    vehicle.close()
    counts = json.loads((tmp_path / "counts.json").read_text(encoding="utf-8"))
    (telemetry,) = tmp_path.glob("dives/*/telemetry.tlog")
    assert telemetry.stat().st_size == counts["bytes"] + 8 * counts["frames"] > 0


def test_a_bridge_whose_terminal_goes_away_ends_as_it_does_by_ctrl_c(tmp_path):
    options = ["--link", "udpout:127.0.0.1:9", "--parameters", str(tmp_path / "parameters.json")]
    bridge = InTerminal("bridge", "--vehicle", "ruvifist:hovering", *options)
    bridge.until(b"gnss: ")
    assert bridge.goes_away() == exit_codes.LINK


def test_a_verb_whose_standard_output_is_closed_does_its_work_all_the_same(tmp_path):
    (tmp_path / "dives").mkdir()
    line = ["dives", str(tmp_path / "dives"), "--json", str(tmp_path / "dives.json")]
    closed = ["sh", "-c", 'exec "$@" >&-', "sh"]
    done = subprocess.run([*closed, sys.executable, "-m", "tui", *line], cwd=ROOT, check=False)
    assert done.returncode == exit_codes.DONE
    assert (tmp_path / "dives.json").exists()
