# SPDX-License-Identifier: GPL-3.0-or-later
"""seatrial inside MAVProxy: `mavproxy.py --load-module=gcs_plugin.mavproxy`, then `seatrial status|record|params`.

Licence of this one file: GPL-3.0-or-later, because it adapts MAVProxy, which is. Nothing else imports it.
"""

import shutil
import time
from pathlib import Path
from typing import Any

from MAVProxy.modules.lib import mp_module

from bridge.errors import SeatrialError
from bridge.framing import Framer
from bridge.tlog import TlogWriter
from gcs_plugin.folder import new_folder
from gcs_plugin.link_health import LinkHealth
from gcs_plugin.params.files import read_parameters
from gcs_plugin.params.plan import make_plan, printable

LOAD_NAME = "gcs_plugin.mavproxy"
USAGE = "usage: seatrial status | record start [FOLDER] | record stop | params FILE"


class SeatrialModule(mp_module.MPModule):  # type: ignore[misc]
    """Link health, a recording in a dive folder, and what a parameter file would change."""

    def __init__(self, mpstate: Any) -> None:
        super().__init__(mpstate, LOAD_NAME, "sea trials", public=True, multi_vehicle=True)
        self._health, self._framer = LinkHealth(), Framer()
        self._writer: TlogWriter | None = None
        self.add_command(
            "seatrial", self.command, USAGE, ["status", "record (start|stop)", "params (FILENAME)"]
        )

    def command(self, words: list[str]) -> None:
        """The console command."""
        try:
            self.say_lines(self._answer(words))
        except SeatrialError as error:
            self.say_lines([str(error)])

    def mavlink_packet(self, message: Any) -> None:
        """Every message that MAVProxy hears."""
        raw = bytes(message.get_msgbuf())
        for frame in self._framer.feed(raw):
            self._health.on_frame(frame, time.monotonic())
        if self._writer is not None:
            try:
                self._writer.write(round(time.time() * 1e6), raw)
            except SeatrialError as error:
                self._stop()
                self.say_lines([str(error)])

    def unload(self) -> None:
        """MAVProxy takes the module out."""
        self._stop()

    def say_lines(self, lines: list[str]) -> None:
        for line in lines:
            self.console.writeln(line)

    def _answer(self, words: list[str]) -> list[str]:
        match words:
            case ["status"]:
                return self._status()
            case ["record", "start", *folder] if len(folder) <= 1:
                return self._start(Path(folder[0] if folder else "dives"))
            case ["record", "stop"]:
                self._stop()
                return ["recording stopped"]
            case ["params", file]:
                present = {str(name): float(value) for name, value in self.mav_param.items()}
                plan = make_plan(read_parameters(Path(file)), present)
                return [*("  ".join(row) for row in printable(plan)), plan.summary()]
        return [USAGE]

    def _status(self) -> list[str]:
        health = self._health.snapshot(time.monotonic())
        return [
            f"{s.system}/{s.component}: {s.received} frames, {s.loss:.1%} lost as seen here, {s.age_s:.1f} s ago"
            for s in health.sources
        ] or ["nothing heard yet"]

    def _start(self, root: Path) -> list[str]:
        self._stop()
        folder = new_folder(root, time.time(), "")
        self._writer = folder.open_telemetry(1)
        free_gb = shutil.disk_usage(folder.path).free / 1e9
        return [f"recording into {folder.path}, {free_gb:.1f} GB free"]

    def _stop(self) -> None:
        if self._writer is not None:
            self._writer.close()
            self._writer = None


def init(mpstate: Any) -> SeatrialModule:
    """What MAVProxy calls."""
    return SeatrialModule(mpstate)
