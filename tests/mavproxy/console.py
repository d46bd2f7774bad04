"""A real MAVProxy in a pseudo-terminal: commands are typed into it, and its output is read."""

import os
import pty
import re
import select
import shutil
import subprocess
import sys
from pathlib import Path
from time import monotonic

MAVPROXY = shutil.which("mavproxy.py", path=str(Path(sys.executable).parent)) or shutil.which("mavproxy.py")
DEADLINE_S = 120.0
_ESCAPES = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]|[\r\x07]")


class Console:
    """MAVProxy with our module on the masters given, its files in `folder`. Close it, or use it as a context."""

    def __init__(self, folder, masters, *options):
        mine, its = pty.openpty()
        self._fd = mine
        self.text = ""
        self._from = 0
        self.process = subprocess.Popen(
            [
                MAVPROXY,
                *(f"--master={master}" for master in masters),
                "--load-module=gcs_plugin.mavproxy",
                "--default-modules=link,param",
                f"--state-basedir={folder}",
                "--streamrate=-1",
                *options,
            ],
            cwd=folder,
            env={
                **os.environ,
                "HOME": str(folder),
                "PYTHONUNBUFFERED": "1",
                "TERM": "dumb",
                "COLUMNS": "160",
                "OMP_NUM_THREADS": "1",
            },
            stdin=its,
            stdout=its,
            stderr=its,
            start_new_session=True,
        )
        os.close(its)

    def type(self, line, end="\n"):
        """Type a line; earlier output is not searched any more."""
        self._read(0.0)
        self._from = len(self.text)
        os.write(self._fd, (line + end).encode())

    def wait_for(self, pattern, seconds=DEADLINE_S):
        """Everything printed since the last line was typed, once `pattern` is in it; the match."""
        deadline_s = monotonic() + seconds
        while True:
            said = self.text[self._from :]
            result = re.search(pattern, said)
            if result:
                return result
            assert monotonic() < deadline_s, f"MAVProxy does not say '{pattern}', but:\n{said}"
            assert self._read(0.5), f"MAVProxy has ended:\n{self.text}"

    def ask(self, line, pattern, seconds=DEADLINE_S):
        """Type a line and wait for its answer."""
        self.type(line)
        return self.wait_for(pattern, seconds)

    def until(self, line, pattern, seconds=DEADLINE_S):
        """Type a line again and again, at most twice a second, until its answer holds `pattern`."""
        deadline_s, begun = monotonic() + seconds, len(self.text)
        while True:
            self.type(line)
            again_s = monotonic() + 0.5
            while (left_s := again_s - monotonic()) > 0:
                self._read(left_s)
                if match := re.search(pattern, self.text[self._from :]):
                    return match
            assert monotonic() < deadline_s, f"MAVProxy does not say '{pattern}', but:\n{self.text[begun:]}"

    def close(self):
        """End it with Ctrl-D, and see that it ended."""
        if self.process.poll() is None:
            os.write(self._fd, b"\x04")
        deadline_s = monotonic() + 10.0
        while self.process.poll() is None and monotonic() < deadline_s:
            self._read(0.1)
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        os.close(self._fd)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def _read(self, seconds):
        """Take its output; False if it has ended."""
        if not select.select([self._fd], [], [], seconds)[0]:
            return self.process.poll() is None
        try:
            data = os.read(self._fd, 65536)
        except OSError:
            return False
        self.text += _ESCAPES.sub("", data.decode(errors="replace"))
        return bool(data)


def write(folder, name, **values):
    (folder / name).write_text("".join(f"{key},{value}\n" for key, value in values.items()))
    return name


def upload(mavproxy, line):
    """Type an upload, then its code; its output."""
    code = mavproxy.ask(line, r"to write .* on vehicle \d:\n\s+seatrial params (yes \S+)\n")[1]
    return mavproxy.ask(f"seatrial params {code}", r"(?s)what became of it.*values before: (\S+)\n")
