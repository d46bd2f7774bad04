"""A UDP link through which a vehicle and its ground hear each other badly, as a random generator has it."""

import random
import select
import socket
import threading
import time
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.wire.framing import Encoder

FAULT_EVERY_S = 1.0
LONGEST_CUT_S = 3.0
LOSS = 0.3
CROWD, BETWEEN_S = 300, 0.005


class BadLink:
    """Between a vehicle that sends to `port` of this computer, and a ground that listens on `ground_port`.

    By turns it is good, cut, loses 30 %, doubles, damages, and brings what strangers make up, aimed at either side.
    """

    def __init__(self, ground_port: int, seed: int) -> None:
        self._rng, self._ground = random.Random(seed), ("127.0.0.1", ground_port)
        self._near, self._far = (socket.socket(type=socket.SOCK_DGRAM) for _ in range(2))
        self._near.bind(("127.0.0.1", 0))
        self._far.bind(("127.0.0.1", 0))
        self.port = self._near.getsockname()[1]
        self._vehicle: Any = None
        self._stop, self._mending = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._run)

    def start(self) -> None:
        self._thread.start()

    def crowd(self) -> None:
        """As many strangers as fill every table, of whom more come later."""
        for number in range(CROWD):
            encoder = Encoder(2 + number % 250, 1 + number // 250)
            for message in self._messages():
                self._send(True, encoder.encode(message))
            self._stop.wait(BETWEEN_S)

    def mend(self) -> None:
        """No more faults."""
        self._mending.set()

    def close(self) -> None:
        self._stop.set()
        self._thread.join()
        self._near.close()
        self._far.close()

    def _run(self) -> None:
        fault, until_s = "", 0.0
        while not self._stop.is_set():
            if self._mending.is_set():
                fault = ""
            elif time.monotonic() >= until_s:
                fault = self._rng.choice(("", "", "cut", "loses", "doubles", "damages", "strangers"))
                until_s = time.monotonic() + min(LONGEST_CUT_S, self._rng.expovariate(1 / FAULT_EVERY_S))
            ready, _, _ = select.select([self._near, self._far], [], [], 0.05)
            for sock in ready:
                data, sender = sock.recvfrom(65536)
                if sock is self._near:
                    self._vehicle = sender
                self._pass(sock is self._near, data, fault)

    def _pass(self, to_ground: bool, data: bytes, fault: str) -> None:
        if fault == "cut" or (fault == "loses" and self._rng.random() < LOSS):
            return
        if fault == "damages" and self._rng.random() < LOSS:
            at = self._rng.randrange(len(data))
            data = data[:at] + bytes((data[at] ^ 1 << self._rng.randrange(8),)) + data[at + 1 :]
        self._send(to_ground, data)
        if fault == "doubles":
            self._send(to_ground, data)
        if fault == "strangers":
            self._send(self._rng.random() < 0.5, self._made_up())

    def _made_up(self) -> bytes:
        """Noise, or good frames of an address that nobody has."""
        rng = self._rng
        if rng.random() < 0.3:
            return rng.randbytes(rng.randrange(1, 300))
        return Encoder(rng.randrange(2, 255), rng.randrange(1, 255)).encode(rng.choice(self._messages()))

    def _messages(self) -> tuple[Any, ...]:
        rng = self._rng
        return (
            dialect.MAVLink_heartbeat_message(
                rng.randrange(40), rng.randrange(20), rng.choice((0, 128)), 0, 4, 3
            ),
            dialect.MAVLink_system_time_message(0, rng.randrange(1 << 32)),
            dialect.MAVLink_statustext_message(rng.randrange(8), rng.randbytes(50), rng.randrange(9), 0),
            dialect.MAVLink_param_set_message(1, 1, b"FF_MODE", 3.0, 9),
            dialect.MAVLink_param_request_list_message(1, 1),
            dialect.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0),
        )

    def _send(self, to_ground: bool, data: bytes) -> None:
        if to_ground:
            self._far.sendto(data, self._ground)
        elif self._vehicle is not None:
            self._near.sendto(data, self._vehicle)
