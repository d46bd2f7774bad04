"""Runs the real ArduSub firmware as a process on a simulated body, if SEATRIAL_ARDUSUB names its program.

ArduSub's simulator waits for the body after every step, so the body sets the time: on a loaded computer a dive takes
longer, and is the same dive.
"""

import os
import queue
import socket
import subprocess
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from bridge.errors import LinkError
from bridge.links.link import Link
from bridge.links.open import open_link
from bridge.simulator.json_plant import PORT, JsonBody, serve

VARIABLE: Final = "SEATRIAL_ARDUSUB"
WHY_NOT: Final = f"needs {VARIABLE}=/path/to/ardusub, a simulated ArduSub"
LINKS_PORT: Final = 5760
"""Where the first link of the first instance listens, the second 2 higher; each further instance 10 higher."""
START_S: Final = 60.0
SPEEDUP: Final = 20
"""The firmware may run at so many times real time; the computer of the body is slower than that."""
SETTINGS: Final[Mapping[str, float]] = {
    "FRAME_CONFIG": 1, "ARMING_CHECK": 0, "BRD_OPTIONS": 0, "SYSID_MYGCS": 255, "FS_GCS_ENABLE": 2,
    "FS_PILOT_INPUT": 2, "JS_GAIN_DEFAULT": 0.5, "VISO_TYPE": 1, "EK3_SRC1_POSXY": 0, "EK3_SRC1_VELXY": 6,
    "EK3_SRC1_POSZ": 1, "EK3_SRC1_VELZ": 0, "EK3_SRC1_YAW": 1, "GPS_TYPE": 0, "SIM_GPS_DISABLE": 1,
    "SIM_BARO_RND": 0.002, "SIM_BAR2_RND": 0.002, "SERVO1_FUNCTION": 33, "SERVO2_FUNCTION": 34, "SERVO3_FUNCTION": 35,
    "SERVO4_FUNCTION": 36, "SERVO5_FUNCTION": 37, "SERVO6_FUNCTION": 38, "LOG_DISARMED": 0, "MOT_FV_CPLNG_K": 0,
    "COMPASS_AUTODEC": 0, "COMPASS_DEC": 0.2025,
}  # fmt: skip
"""A BlueROV2 with a DVL and no GPS, ready to arm at once. Without a GPS it does not know where it is, so the crew gives
the declination there, rad."""


def firmware_path() -> Path | None:
    """Path that SEATRIAL_ARDUSUB names, None if it is not set. Raises FileNotFoundError if no file is there."""
    named = os.environ.get(VARIABLE)
    if not named:
        return None
    path = Path(named)
    if not path.is_file():
        raise FileNotFoundError(f"{VARIABLE}={path}: no such file")
    return path


def free_instance() -> int:
    """The lowest instance number whose ports are all free: the body's, and those of the two links.

    The links are tried too because a firmware whose body has gone still holds them.
    """
    for number in range(20):
        base = LINKS_PORT + 10 * number
        with (
            socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as body,
            socket.socket() as ground,
            socket.socket() as aboard,
        ):
            ground.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            aboard.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                body.bind(("127.0.0.1", PORT + 10 * number))
                ground.bind(("127.0.0.1", base))
                aboard.bind(("127.0.0.1", base + 2))
            except OSError:
                continue
            return number
    raise LinkError(f"ports {PORT} to {PORT + 190}: none is free; end the simulators that run")


def link_when_up(spec: str) -> Link:
    """A link to a firmware that is starting. Raises LinkError if it does not start."""
    for _ in range(round(START_S / 0.1)):
        try:
            return open_link(spec)
        except LinkError:
            time.sleep(0.1)
    raise LinkError(f"{spec}: the firmware did not start")


def started(
    path: Path, folder: Path, number: int, settings: Mapping[str, float], speedup: float, step_hz: float
) -> "subprocess.Popen[bytes]":
    """Instance `number` of the firmware in `folder`, with `settings` for its parameters.

    Its body takes `step_hz` steps a second.
    """
    lines = [f"{name} {value}" for name, value in settings.items()]
    (folder / "defaults.parm").write_text("\n".join(lines) + "\n", encoding="utf-8")
    with (folder / "out.txt").open("wb") as log:
        return subprocess.Popen(
            [
                str(path), "--model", "JSON:127.0.0.1", "-I", str(number), "-w",
                "--defaults", "defaults.parm", "--home", "33.81,-118.39,0,0", "--rate", f"{step_hz:.0f}",
                "--speedup", str(speedup), "--serial0", "tcp:0:nowait", "--serial1", "tcp:2:nowait",
            ],
            cwd=folder,
            stdout=log,
            stderr=subprocess.STDOUT,
            stdin=subprocess.DEVNULL,
        )  # fmt: skip


@dataclass(frozen=True)
class BodyClock:
    """Time of the body; its date is that of a day in 2026."""

    body: JsonBody

    def boot_s(self) -> float:
        return self.body.time_s

    def unix_s(self) -> float:
        return 1_790_000_000.0 + self.body.time_s


Script = Iterator[None]
Act = Callable[[], object]
TICK_S: Final = 0.005


class Firmware:
    """`ardusub --model JSON` in `folder`; `ground` and `aboard` are its two links.

    `fly` runs a script: every TICK_S of the body's time it goes on to its next `yield`, while the firmware waits.
    """

    def __init__(
        self,
        path: Path,
        folder: Path,
        body: JsonBody,
        settings: Mapping[str, float] = SETTINGS,
        speedup: float = SPEEDUP,
    ) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.body, self.clock = body, BodyClock(body)
        number = free_instance()
        self._stop, self._ended = threading.Event(), threading.Event()
        self._script: Script | None = None
        self._error: BaseException | None = None
        self._due_s = 0.0
        self._physics = threading.Thread(
            target=serve, args=(body, PORT + 10 * number, self._stop, self._tick), daemon=True
        )
        self._physics.start()
        self._process = started(path, folder, number, settings, speedup, body.step_hz)
        base = LINKS_PORT + 10 * number
        self._links: list[Link] = []
        try:
            for port in (base, base + 2):
                self._links.append(link_when_up(f"tcp:127.0.0.1:{port}"))
        except LinkError:
            self.close()
            raise
        self.ground, self.aboard = self._links

    def fly(self, script: Script) -> None:
        """Run a script to its end; raises its exceptions."""
        self._ended.clear()
        self._script = script
        while not self._ended.wait(1.0):
            if self._process.poll() is not None:
                raise LinkError(f"the firmware ended by itself, code {self._process.returncode}")
        if self._error is not None:
            raise self._error

    def close(self) -> None:
        self._process.kill()
        self._process.wait()
        self._stop.set()
        self._physics.join(10.0)
        for link in self._links:
            link.close()

    def _tick(self) -> None:
        if self._script is None or self.body.time_s < self._due_s:
            return
        self._due_s = self.body.time_s + TICK_S
        try:
            next(self._script)
        except StopIteration:
            self._script = None
            self._ended.set()
        except BaseException as error:  # noqa: BLE001 (raised again in the caller's thread)
            self._script, self._error = None, error
            self._ended.set()


class SteppedFirmware:
    """A firmware whose clock runs only within `run` and `until`: slow work between two calls costs no flight time."""

    def __init__(self, process: Firmware) -> None:
        self.process, self.clock = process, process.clock
        self.ground, self.aboard = process.ground, process.aboard
        self._work: queue.Queue[Iterator[Any] | None] = queue.Queue()
        self._results: queue.Queue[tuple[Any, Exception | None]] = queue.Queue()
        self.begin()

    def begin(self) -> None:
        """Stop the clock until the first call."""
        threading.Thread(target=self._work_on, daemon=True).start()

    def run(self, seconds: float, *acts: Act) -> None:
        """Let the clock run for so long, and each of `acts` every TICK_S."""
        self.until(lambda: False, seconds, *acts)

    def until(self, met: Act, seconds: float, *acts: Act) -> Any:
        """Let the clock run until a condition is met, for `seconds` at most; return the condition's value."""

        def script() -> Iterator[Any]:
            until_s = self.clock.boot_s() + seconds
            while not (result := met()) and self.clock.boot_s() < until_s:
                for act in acts:
                    act()
                yield
            return result

        self._work.put(script())
        result, error = self._results.get(timeout=600)
        if error is not None:
            raise error
        return result

    def close(self) -> None:
        self._work.put(None)
        self.process.close()

    def _work_on(self) -> None:
        try:
            self.process.fly(self._forever())
        except LinkError as error:  # the firmware ended
            self._results.put((None, error))

    def _forever(self) -> Script:
        """One piece of work after the other; the body, and with it the firmware, waits for each."""
        while (work := self._work.get()) is not None:
            try:
                self._results.put(((yield from work), None))
            except Exception as error:  # noqa: BLE001 (raised again in the caller's thread)
                self._results.put((None, error))


class SteppedLink(Link):
    """The ground's link to a stepped firmware: a read lets the firmware's clock run, and `acts` meanwhile."""

    name = "tcp:autopilot"

    def __init__(self, firmware: SteppedFirmware, *acts: Act) -> None:
        self._firmware, self._acts = firmware, acts

    def read(self, timeout_s: float) -> bytes:
        self._firmware.run(timeout_s, *self._acts)
        return b"".join(iter(lambda: self._firmware.ground.read(0.0), b""))

    def write(self, data: bytes) -> None:
        self._firmware.ground.write(data)

    def close(self) -> None:
        """The firmware's own link stays open."""


def wait_until(clock: BodyClock, met: Callable[[], object], seconds: float, awaited: str) -> Script:
    """Wait for a condition. Raises LinkError with `awaited` did not come if it takes longer."""
    until_s = clock.boot_s() + seconds
    while not met():
        if clock.boot_s() > until_s:
            raise LinkError(f"{awaited} did not come within {seconds:g} s")
        yield
