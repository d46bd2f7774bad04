"""Devices of a vehicle on real ports, each of which can be unplugged and plugged in again."""

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from device_streams import ON_A_LINE, Say, a50_report
from fakes.ports import open_pty
from waiting import over_and_over

from bridge.links.link import Link
from bridge.sensors.bar30 import FakeBar30
from bridge.vehicle.config import Device, Sensors

EVERY_S = 0.02
A50_HZ = 10.0


class Words:
    """A device's messages, so often a second."""

    def __init__(self, say: Say, rate_hz: float) -> None:
        self._say, self._rate_hz, self._said, self._owed = say, rate_hz, 0, 0.0

    def due(self, seconds: float) -> Iterator[bytes]:
        """Its bytes of so long a time."""
        self._owed += seconds * self._rate_hz
        while self._owed >= 1.0:
            yield self._say(self._said)
            self._said += 1
            self._owed -= 1.0


class Cable:
    """A device on a serial port that comes and goes as its name does."""

    def __init__(self, name: Path, words: Words) -> None:
        self.port, self._name, self._words = str(name), name, words
        self._device: Link | None = None

    def plug(self) -> None:
        self._device, path = open_pty()
        self._name.symlink_to(path)

    def unplug(self) -> None:
        self._name.unlink()
        device, self._device = self._device, None
        if device is not None:
            device.close()

    def speak(self, seconds: float) -> None:
        for data in self._words.due(seconds):
            if self._device is not None:
                self._device.write(data)

    def babble(self, noise: bytes) -> None:
        if self._device is not None:
            self._device.write(noise)


class Network:
    """A device on the network that comes and goes with its listener."""

    def __init__(self, words: Words) -> None:
        self._words = words
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

    def speak(self, seconds: float) -> None:
        for data in self._words.due(seconds):
            self.babble(data)

    def babble(self, noise: bytes) -> None:
        if self._listener is None:
            return
        with suppress(BlockingIOError):
            self._peers.append(self._listener.accept()[0])
        for peer in self._peers:
            # A bridge that ends hangs up.
            with suppress(OSError):
                peer.send(noise)


class Wires:
    """A Bar30 that comes and goes on its bus."""

    port = "i2c:1:0x76"

    def __init__(self) -> None:
        self.bus = FakeBar30(unplugged=True)

    def plug(self) -> None:
        self.bus.unplugged = False

    def unplug(self) -> None:
        self.bus.unplugged = True

    def speak(self, seconds: float) -> None:
        """It is asked."""

    def babble(self, noise: bytes) -> None:
        """Its bus carries nothing but what it is asked for."""


class Devices:
    """All devices of a vehicle, spoken for by one thread."""

    def __init__(self, folder: Path, dvl: str) -> None:
        self.fakes: dict[str, Any] = {"depth": Wires()}
        kinds: dict[str, Any] = {"depth": "bar30"}
        for name in ("MTi-300", "DSP-1750", "ESC", "u-blox", *(() if dvl == "network" else (dvl,))):
            slot, kind, say, rate_hz = ON_A_LINE[name]
            kinds[slot] = kind
            self.fakes[slot] = Cable(folder / f"tty-{slot}", Words(say, rate_hz))
        if dvl == "network":
            self.fakes["dvl"], kinds["dvl"] = Network(Words(a50_report, A50_HZ)), "a50"
        self.sensors = Sensors(**{slot: Device(kinds[slot], port=self.fakes[slot].port) for slot in kinds})
        self._lock = threading.Lock()

    @contextmanager
    def speaking(self, times: float = 1.0) -> Iterator[None]:
        """They speak, so many times as fast as they do."""

        def speak() -> None:
            with self._lock:
                for fake in self.fakes.values():
                    fake.speak(times * EVERY_S)

        with over_and_over(speak, EVERY_S):
            yield

    def plug(self, slot: str) -> None:
        with self._lock:
            self.fakes[slot].plug()

    def unplug(self, slot: str) -> None:
        with self._lock:
            self.fakes[slot].unplug()

    def babble(self, slot: str, noise: bytes) -> None:
        with self._lock:
            self.fakes[slot].babble(noise)
