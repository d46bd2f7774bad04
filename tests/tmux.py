"""A real terminal in tmux: keys are sent to it, and its screen is read."""

import os
import shutil
import subprocess
import threading
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PATIENCE_S = 60.0
NEEDS_TMUX = pytest.mark.skipif(shutil.which("tmux") is None, reason="tmux is not installed")


class Tmux:
    """One terminal of its own server."""

    def __init__(self, name, columns, rows, command, environment, patience_s=PATIENCE_S):
        self._base, self._patience_s = ["tmux", "-L", name], patience_s
        size = ["-x", str(columns), "-y", str(rows)]
        subprocess.run(
            [*self._base, "-f", "/dev/null", "new-session", "-d", *size, command], env=environment, check=True
        )

    def keys(self, *keys):
        subprocess.run([*self._base, "send-keys", *keys], check=True)

    def process(self):
        """The number of the process that runs in it."""
        asked = [*self._base, "list-panes", "-F", "#{pane_pid}"]
        return int(subprocess.run(asked, capture_output=True, text=True, check=True).stdout)

    def keep(self, file):
        """Write every byte that comes from now on into `file` as well."""
        subprocess.run([*self._base, "pipe-pane", f"exec cat > {file}"], check=True)

    def screen(self):
        done = subprocess.run([*self._base, "capture-pane", "-p"], capture_output=True, text=True, check=True)
        return done.stdout

    def until(self, *words, without=()):
        """The screen once all `words` are on it; fails with the screen that is there instead."""
        until_s = time.monotonic() + self._patience_s
        looking = threading.Event()
        while time.monotonic() < until_s:
            screen = self.screen()
            if all(word in screen for word in words) and not any(word in screen for word in without):
                return screen
            # A look starts a process: without a rest between them they keep a core from what is waited for.
            looking.wait(0.1)
        pytest.fail(f"{words} not seen within {self._patience_s:.0f} s:\n{screen}")

    def resize(self, columns, rows):
        subprocess.run([*self._base, "resize-window", "-x", str(columns), "-y", str(rows)], check=True)

    def close(self):
        subprocess.run([*self._base, "kill-server"], check=False, capture_output=True)


def alone(folder):
    """The environment of a `seatrial` whose recording, state and settings lie in `folder`."""
    environment = {
        **os.environ,
        "PYTHONPATH": str(ROOT),
        "XDG_STATE_HOME": str(folder),
        "XDG_CONFIG_HOME": str(folder),
        "LANG": "C.UTF-8",
    }
    environment.pop("NO_COLOR", None)
    return environment
