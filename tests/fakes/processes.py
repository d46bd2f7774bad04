"""`seatrial` in a process of its own, and a vehicle that sends it frames which all differ."""

import os
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path

from pymavlink.dialects.v20 import ardupilotmega as dialect
from waiting import until

from bridge.wire.framing import Encoder

ROOT = Path(__file__).resolve().parents[2]
SOON_S = 120.0


class Running:
    """`seatrial WORDS`, and the lines that it says on either stream; `before` are words before the command."""

    def __init__(self, *words, before=()):
        self.process = subprocess.Popen(
            [*before, sys.executable, "-m", "tui", *words],
            cwd=ROOT,
            env={**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "1000"},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self._lines, self._awaited = [], 0
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        for line in self.process.stdout:
            self._lines.append((time.monotonic(), line.rstrip()))

    def said(self, words):
        return [line for _, line in self._lines if words in line]

    def until(self, words):
        """When it said a line with these words, after the line that was waited for before."""

        def next_such():
            for number, (time_s, line) in enumerate(self._lines[self._awaited :], start=self._awaited):
                if words in line:
                    self._awaited = number + 1
                    return time_s
            assert self._reader.is_alive(), "it has ended by itself"
            return None

        return until(next_such, SOON_S)

    def end(self):
        """Ctrl-C; the exit code."""
        self.process.send_signal(signal.SIGINT)
        return self._ended()

    def kill(self):
        self.process.kill()
        self._ended()

    def _ended(self):
        code = self.process.wait(SOON_S)
        self._reader.join(SOON_S)
        self.process.stdout.close()
        return code


class TalkingVehicle:
    """Sends frames to whoever connects over TCP, one every 2 ms, until it is told to stop."""

    def __init__(self):
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._listener.settimeout(SOON_S)
        self.link = f"tcp:127.0.0.1:{self._listener.getsockname()[1]}"
        self.sent = []
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self):
        encoder = Encoder(1, 1)
        # Nobody may come, and who comes may leave before it is told to stop.
        with suppress(OSError), self._listener.accept()[0] as peer:
            while not self._stop.wait(0.002):
                raw = encoder.encode(dialect.MAVLink_system_time_message(1, 1000 + len(self.sent)))
                peer.sendall(raw)
                self.sent.append(raw)

    def close(self):
        self._stop.set()
        self._thread.join()
        self._listener.close()
