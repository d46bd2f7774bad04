# SPDX-License-Identifier: GPL-3.0-or-later
"""Run `seatrial identify` and `diagnose` in a process of their own and show their output line by line."""

import contextlib
from collections.abc import Callable
from pathlib import Path
from typing import Final

from bridge.clock import Clock
from bridge.errors import ConfigError
from bridge.new_file import clear_way
from gcs_plugin.dives.folder import DiveFolder
from gcs_plugin.job import Job, as_wide, seatrial_command

LEAVES: Final = {
    "identify": (("--json", "identified.json"), ("--param", "identified.param")),
    "diagnose": (("--json", "diagnosis.json"), ("--report", "diagnosis.html")),
}
"""Files in which each command leaves its result, in or next to the dive, unless the user names others."""
ENDED: Final = {0: "done", 1: "done, and there is something to read before its values are used", 4: "stopped"}


class Work:
    """Runs at most one command at a time."""

    def __init__(self, clock: Clock, say: Callable[[str], None]) -> None:
        self._clock, self._say = clock, say
        self._job: Job | None = None
        self._left, self._written_ns = Path(), 0

    def begin(self, verb: str, dive: Path, options: list[str], vehicle: str) -> None:
        """Run `verb` on `dive`. Raises ConfigError if a command is running, or no vehicle file is known."""
        self.check_idle()
        if not dive.exists():
            raise ConfigError(f"{dive}: no such dive; check the name")
        words = [*seatrial_command(), verb, str(dive), *options]
        if "--vehicle" not in options:
            words += ["--vehicle", vehicle or _vehicle_of(dive)]
        for option, name in LEAVES[verb]:
            if option not in options:
                place = dive / name if dive.is_dir() else dive.with_name(f"{dive.stem}-{name}")
                with contextlib.suppress(OSError):  # the command itself will report why it can't write there
                    clear_way(place)
                words += [option, str(place)]
        self._left = Path([*words, ""][words.index(LEAVES[verb][1][0]) + 1])
        self._written_ns = _written_ns(self._left)
        self._job = Job(f"{verb} {dive}", words, as_wide(), self._clock.boot_s())
        self._say(f"{verb}: {dive}, in a process of its own; `seatrial cancel` ends it")

    def check_idle(self) -> None:
        """Raise ConfigError if a command is running."""
        if self._job is not None:
            raise ConfigError(f"{self._job.title} runs; wait for it, or `seatrial cancel`")

    def tick(self) -> None:
        """Show the new lines of the command's output, and its result once it has ended."""
        job, now_s = self._job, self._clock.boot_s()
        if job is None:
            return
        for line in job.lines(now_s):
            self._say(line)
        if job.code is not None:
            self._job = None
            ending = (
                "stopped by the user"
                if job.cancelled
                else ENDED.get(job.code, f"failed, exit code {job.code}")
            )
            self._say(f"{job.title}: {ending}, after {now_s - job.began_s:.0f} s")
            if job.code in (0, 1) and not job.cancelled and _written_ns(self._left) != self._written_ns:
                self._say(
                    f"{'seatrial params upload' if self._left.suffix == '.param' else 'report:'} {self._left}"
                )

    def cancel(self) -> bool:
        """Stop the command; False if none is running."""
        if self._job is None:
            return False
        self._job.cancel(self._clock.boot_s())
        return True

    def status(self) -> list[str]:
        """A line about the command that is running, if any."""
        if self._job is None:
            return []
        return [f"{self._job.title}: runs for {self._clock.boot_s() - self._job.began_s:.0f} s"]

    def kill(self) -> None:
        """End the command at once, as when MAVProxy ends."""
        if self._job is not None:
            self._job.kill()
            self._job = None


def _vehicle_of(dive: Path) -> str:
    """The vehicle file that a dive folder names. Raises ConfigError if it names none that exists."""
    about = DiveFolder(dive).about() if dive.is_dir() else None
    if about is None or about.vehicle_path is None:
        raise ConfigError(
            f"{dive}: names no vehicle file that is there; say which with `seatrial file NAME`, or give --vehicle NAME"
        )
    return f"{about.vehicle_file}:{about.configuration}" if about.configuration else about.vehicle_file


def _written_ns(path: Path) -> int:
    """Time of a file's last change, in ns; 0 if there is no file."""
    return path.stat().st_mtime_ns if path.is_file() else 0
