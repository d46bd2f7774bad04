"""Every device of a vehicle unplugged and back, over real ports: data again soon, each time, and nothing leaks."""

import os
import random
import resource
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from device_streams import ON_A_LINE, Say, a50_report
from figures import keep
from service_rig import vehicle
from waiting import until

from bridge.clock import SystemClock
from bridge.link.base import Link
from bridge.link.pseudo import open_pty
from bridge.parameters import ParameterServer, vehicle_table
from bridge.ports import run_ports
from bridge.sensors.bar30 import FakeBar30
from bridge.service import Bridge
from bridge.vehicle.config import Device

SHORT, LONG = 3, 100
BACK_WITHIN_S = 3.0
MOST_MORE_MEMORY = 0.05
SETTLED = 20
SAY_EVERY_S = 0.02
PATIENCE_S = 60.0
HANDLES = "/dev/fd"


class Cable:
    """A device on a serial port that comes and goes as its name does."""

    def __init__(self, name: Path, say: Say) -> None:
        self.port, self._name, self._say, self._said = str(name), name, say, 0
        self._device: Link | None = None

    def plug(self) -> None:
        self._device, path = open_pty()
        self._name.symlink_to(path)

    def unplug(self) -> None:
        self._name.unlink()
        device, self._device = self._device, None
        if device is not None:
            device.close()

    def speak(self) -> None:
        if self._device is not None:
            self._device.write(self._say(self._said))
            self._said += 1


class Network:
    """A device on the network that comes and goes with its listener."""

    def __init__(self, say: Say) -> None:
        self._say, self._said = say, 0
        self._listener: socket.socket | None = None
        self._peers: list[socket.socket] = []
        with socket.create_server(("127.0.0.1", 0)) as first:
            self._where = first.getsockname()
        self.port = f"tcp:127.0.0.1:{self._where[1]}"

    def plug(self) -> None:
        self._listener = socket.create_server(self._where)
        self._listener.setblocking(False)

    def unplug(self) -> None:
        for sock in (self._listener, *self._peers):
            if sock is not None:
                sock.close()
        self._listener, self._peers = None, []

    def speak(self) -> None:
        if self._listener is None:
            return
        with suppress(BlockingIOError):
            self._peers.append(self._listener.accept()[0])
        for peer in self._peers:
            peer.send(self._say(self._said))
        self._said += 1


class Wires:
    """A Bar30 that comes and goes on its bus."""

    port = "i2c:1:0x76"

    def __init__(self) -> None:
        self.bus = FakeBar30(unplugged=True)

    def plug(self) -> None:
        self.bus.unplugged = False

    def unplug(self) -> None:
        self.bus.unplugged = True

    def speak(self) -> None:
        """It is asked."""


class Devices:
    """All devices of a vehicle, spoken for by one thread."""

    def __init__(self, folder: Path, dvl: str) -> None:
        self.fakes: dict[str, Any] = {"depth": Wires()}
        kinds: dict[str, Any] = {"depth": "bar30"}
        for name in ("MTi-300", "DSP-1750", "ESC", "u-blox", *(() if dvl == "network" else (dvl,))):
            slot, kind, say, _ = ON_A_LINE[name]
            kinds[slot] = kind
            self.fakes[slot] = Cable(folder / f"tty-{slot}", say)
        if dvl == "network":
            self.fakes["dvl"], kinds["dvl"] = Network(a50_report), "a50"
        self.vehicle = vehicle(**{slot: Device(kinds[slot], port=self.fakes[slot].port) for slot in kinds})
        self._lock = threading.Lock()

    @contextmanager
    def speaking(self) -> Iterator[None]:
        enough = threading.Event()

        def speak() -> None:
            while not enough.wait(SAY_EVERY_S):
                with self._lock:
                    for fake in self.fakes.values():
                        fake.speak()

        thread = threading.Thread(target=speak)
        thread.start()
        try:
            yield
        finally:
            enough.set()
            thread.join()

    def plug(self, slot: str) -> None:
        with self._lock:
            self.fakes[slot].plug()

    def unplug(self, slot: str) -> None:
        with self._lock:
            self.fakes[slot].unplug()


@contextmanager
def bridging(devices: Devices) -> Iterator[Bridge]:
    """A bridge that reads the devices in real time."""
    clock, stop = SystemClock(), threading.Event()
    bridge = Bridge(devices.vehicle, clock, [], ParameterServer(None, vehicle_table(devices.vehicle)))
    loop = threading.Thread(
        target=run_ports,
        args=(bridge, devices.vehicle, clock, stop),
        kwargs={"open_bus": lambda _: devices.fakes["depth"].bus},
    )
    loop.start()
    try:
        yield bridge
    finally:
        stop.set()
        loop.join(PATIENCE_S)
        assert not loop.is_alive()


def peak_memory() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


@dataclass(frozen=True)
class Came:
    """What came of it: how long each device was away at most, and by what share memory grew once it had settled."""

    back_after_s: dict[str, float]
    more_memory: float


def pull_and_plug(folder: Path, dvl: str, times: int, seed: int) -> Came:
    """Every device is pulled and plugged so often; what is held meanwhile stays what it was."""
    rng, clock = random.Random(seed), SystemClock()
    devices = Devices(folder, dvl)
    back_after_s = dict.fromkeys(devices.fakes, 0.0)
    held, settled = [], 0
    with devices.speaking(), bridging(devices) as bridge:
        for cycle in range(times):
            until(lambda: set(bridge.device_faults) == set(devices.fakes), PATIENCE_S)
            threading.Event().wait(rng.uniform(0.0, BACK_WITHIN_S) if times > SHORT else 0.0)
            plugged_s = clock.boot_s()
            for slot in devices.fakes:
                devices.plug(slot)
            away = set(devices.fakes)
            while away:
                back = until(lambda: away - set(bridge.device_faults), PATIENCE_S)  # noqa: B023
                for slot in back:
                    back_after_s[slot] = max(back_after_s[slot], clock.boot_s() - plugged_s)
                away -= back
            held.append((threading.active_count(), len(os.listdir(HANDLES))))
            if cycle == SETTLED:
                settled = peak_memory()
            for slot in devices.fakes:
                devices.unplug(slot)
    assert held == [held[0]] * times
    return Came(back_after_s, peak_memory() / settled - 1.0 if settled else 0.0)


@pytest.mark.parametrize("dvl", ["network", "Wayfinder"])
def test_every_device_that_is_unplugged_and_back_speaks_again_and_nothing_leaks(
    dvl: str, tmp_path: Path
) -> None:
    before = threading.active_count(), len(os.listdir(HANDLES))
    came = pull_and_plug(tmp_path, dvl, SHORT, 0)
    assert set(came.back_after_s) == {"dvl", "imu", "fog", "depth", "esc", "gnss"}
    assert (threading.active_count(), len(os.listdir(HANDLES))) == before


@pytest.mark.soak
def test_a_hundred_times_unplugged_every_device_speaks_within_three_seconds_and_memory_stays(
    tmp_path: Path,
) -> None:
    came = pull_and_plug(tmp_path, "network", LONG, 1)
    assert max(came.back_after_s.values()) <= BACK_WITHIN_S
    assert came.more_memory <= MOST_MORE_MEMORY
    slowest = max(came.back_after_s, key=lambda slot: came.back_after_s[slot])
    keep(
        "device_unplugged",
        f"{LONG} times each of {len(came.back_after_s)} devices, data again after "
        f"{came.back_after_s[slowest]:.1f} s at most ({slowest}); threads and handles unchanged, "
        f"memory {came.more_memory:+.1%}",
    )
