"""Runs the fenced `sh` blocks of a page in their order, in one folder, as somebody would who types them."""

import os
import pty
import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PATIENCE_S = 900.0
RUNS_ON = (
    (re.compile(r"seatrial record (?!.*--seconds)"), "go by way of it"),
    (re.compile(r"seatrial simulate .*--mission idle"), "is afloat"),
    (re.compile(r"seatrial tui"), "Watch"),
)
"""What runs until it is stopped, and what it says once it does its work."""

DIFFERS = re.compile(r"seatrial params diff")
"""Its exit code is 1 where an upload would change something."""


def blocks(page):
    """The `sh` blocks of a page, each with its terminal, "" where none is named: (terminal, lines)."""
    text = (ROOT / page).read_text(encoding="utf-8")
    for block in re.findall(r"^```sh\n(.*?)^```", text, re.M | re.S):
        named = re.match(r"# (terminal \d)\n", block)
        yield (named[1] if named else ""), block.removeprefix(named[0] if named else "")


class Running:
    """A command that runs on, in a terminal of its own."""

    def __init__(self, line, ready, folder, environment):
        self._terminal, inner = pty.openpty()
        self.process = subprocess.Popen(
            ["bash", "-c", f"exec {line}"],
            cwd=folder, env=environment, stdin=inner, stdout=inner, stderr=inner, start_new_session=True,
        )  # fmt: skip
        os.close(inner)
        self._said, self._is_app = b"", " tui" in line
        threading.Thread(target=self._read, daemon=True).start()
        until_s = time.monotonic() + PATIENCE_S
        while ready.encode() not in self._said:
            assert self.process.poll() is None, f"{line} ended: {self._said.decode(errors='replace')}"
            assert time.monotonic() < until_s, f"{line} is not ready: {self._said.decode(errors='replace')}"
            time.sleep(0.05)

    def _read(self):
        try:
            while data := os.read(self._terminal, 65536):
                self._said += data
        except OSError:
            return

    def end(self):
        """As its user ends it: Ctrl-Q for the app, Ctrl-C for all else."""
        if self.process.poll() is None:
            if self._is_app:
                os.write(self._terminal, b"\x11")
            else:
                self.process.send_signal(signal.SIGINT)
        code = self.process.wait(PATIENCE_S)
        os.close(self._terminal)
        return code


class Typist:
    """Types lines; `port` stands in for the one that the pages name, so that tests beside it keep theirs."""

    def __init__(self, folder, port):
        self.folder, self._port = folder, port
        bin_ = folder / "bin"
        bin_.mkdir()
        (folder / "configs").symlink_to(ROOT / "configs")
        command = bin_ / "seatrial"
        command.write_text(f'#!/bin/sh\nexec {sys.executable} -m tui "$@"\n', encoding="utf-8")
        command.chmod(0o755)
        self.environment = os.environ | {
            "PATH": f"{bin_}:{os.environ['PATH']}",
            "PYTHONPATH": str(ROOT),
            "XDG_STATE_HOME": str(folder / "state"),
            "XDG_CONFIG_HOME": str(folder / "config"),
            "TERM": "xterm-256color",
            "COLUMNS": "100",
            "LINES": "30",
            "LANG": "C.UTF-8",
        }
        self._running = {}

    def follow(self, page, but=()):
        """Every block of a page, but for the lines that begin with one of `but`; at its end, what runs is ended."""
        for terminal, block in blocks(page):
            if terminal in self._running:
                self.end(terminal)
            self.type(block, terminal, but)
        for terminal in tuple(self._running):
            self.end(terminal)

    def type(self, block, terminal="", but=()):
        """One block, line by line; a loop is one."""
        for line in re.findall(r"^for [\s\S]*?^done$|^.+$", block, re.M):
            if line.startswith(tuple(but)):
                continue
            line = line.replace("14550", str(self._port))
            ready = next((words for pattern, words in RUNS_ON if pattern.match(line)), None)
            if ready is not None:
                self._running[terminal or line] = Running(line, ready, self.folder, self.environment)
            else:
                self._run(line)

    def begin(self, line, terminal):
        """A line that ends by itself, while others are typed; `finish` waits for it."""
        line = line.strip().replace("14550", str(self._port))
        self._running[terminal] = Running(line, "", self.folder, self.environment)

    def finish(self, terminal):
        """Wait for the end of that line; it must have done its work."""
        assert self._running.pop(terminal).process.wait(PATIENCE_S) == 0, terminal

    def end(self, terminal):
        """End what runs there; it must have done its work."""
        assert self._running.pop(terminal).end() == 0, terminal

    def close(self):
        for running in self._running.values():
            running.end()
        self._running.clear()

    def _run(self, line):
        terminal, inner = pty.openpty()
        os.write(terminal, b"yes\n")
        done = subprocess.run(
            ["bash", "-c", line], cwd=self.folder, env=self.environment, stdin=inner,
            capture_output=True, text=True, timeout=PATIENCE_S, check=False,
        )  # fmt: skip
        os.close(inner)
        os.close(terminal)
        assert done.returncode in ((0, 1) if DIFFERS.match(line) else (0,)), (
            f"{line}\n{done.stdout}\n{done.stderr}"
        )
        self.said = done.stdout + done.stderr
