"""Runs the bridge in real time: a thread per port reads bytes with their arrival time, one loop does the rest.

A port that is lost, or not there yet, is retried again and again; the other ports go on. If the loop is far behind,
new arrivals are dropped, counted in the bridge's `counts["arrivals lost"]`, and reported.
"""

import math
import queue
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from threading import Event, Lock, Thread
from typing import Final

from bridge.clock import Clock
from bridge.errors import LinkError
from bridge.links.link import Link
from bridge.links.open import open_link
from bridge.links.reconnecting import FIRST_RETRY_S, Reconnecting, next_retry_s
from bridge.onboard.service import Bridge
from bridge.sensors.bar30 import Bar30, I2cBus, SmbusBus, parse_i2c_port
from bridge.sensors.drivers import speaks_tcp, start_command
from bridge.sensors.samples import Arrival
from bridge.vehicle.autopilot import RATE_HZ
from bridge.vehicle.config import Device, Vehicle

READ_S: Final = 0.2
MOST_WAITING: Final = 10_000
LONGEST_LAG_S: Final = 1.0
TELL_LOST_EVERY_S: Final = 10.0
DEPTH_RATE_HZ: Final = 10.0
NO_PORT: Final = "the vehicle file names no port; add it there"

OpenBus = Callable[[int], I2cBus]


Put = Callable[[Arrival], bool]


class Inbox:
    """Bounded queue of arrivals from the ports' threads to the loop. Arrivals that find no room are counted."""

    def __init__(self, most: int) -> None:
        self._queue: queue.Queue[Arrival] = queue.Queue(most)
        self._lock = Lock()
        self._lost = 0

    def put(self, arrival: Arrival) -> bool:
        """Queue an arrival; False if there is no room. A loop that far behind is better off skipping some."""
        try:
            self._queue.put_nowait(arrival)
        except queue.Full:
            with self._lock:
                self._lost += 1
            return False
        return True

    def take(self, timeout_s: float) -> Iterator[Arrival]:
        """Yield the arrivals that are queued now; if there are none, the next if it comes in time."""
        with suppress(queue.Empty):
            if self._queue.empty() and timeout_s > 0:
                yield self._queue.get(timeout=timeout_s)
            for _ in range(self._queue.qsize()):
                yield self._queue.get_nowait()

    def take_lost(self) -> int:
        """Return the number of arrivals that found no room since the last call."""
        with self._lock:
            lost, self._lost = self._lost, 0
        return lost


def run_ports(
    bridge: Bridge,
    vehicle: Vehicle,
    clock: Clock,
    stop: Event,
    *,
    act: Callable[[], None] = lambda: None,
    open_bus: OpenBus = SmbusBus,
    rate_hz: float = RATE_HZ,
    last: Callable[[], None] = lambda: None,
) -> None:
    """Read all devices in the vehicle file until `stop` is set; `act` runs before each step of the bridge, of which
    there are `rate_hz` a second, and `last` after the last of them, however that ended.

    A device without a port is reported and left out. Raises ConfigError if a port's name or a device's rate can't be
    used.
    """
    inbox = Inbox(MOST_WAITING)
    devices = vehicle.sensors.present()
    for slot, device in devices.items():
        if not device.port:
            bridge.port_fault(slot, NO_PORT)
    readers = [
        Thread(target=reader, name=f"read {slot}", daemon=True)
        for slot, device in devices.items()
        if device.port
        for reader in (_reader(slot, device, clock, stop, inbox.put, open_bus),)
    ]
    for thread in readers:
        thread.start()
    try:
        _work(bridge, clock, stop, inbox, act, rate_hz)
    finally:
        stop.set()
        try:
            # A port that is just being opened may take seconds to end.
            last()
        finally:
            for thread in readers:
                thread.join()


def port_spec(device: Device) -> str:
    """Return the link name for a device's port."""
    return device.port if speaks_tcp(device) else f"serial:{device.port}:{device.baud}"


def _work(
    bridge: Bridge, clock: Clock, stop: Event, inbox: Inbox, act: Callable[[], None], rate_hz: float
) -> None:
    due_s = clock.boot_s()
    lost, tell_lost_s = 0, -math.inf
    while not stop.is_set():
        # Queued arrivals come first: steps that take longer than their period must not leave sensors unread.
        for arrival in inbox.take(due_s - clock.boot_s()):
            bridge.take(arrival)
        now_s = clock.boot_s()
        if now_s < due_s:
            continue
        lost += inbox.take_lost()
        if lost and now_s >= tell_lost_s:
            bridge.counts["arrivals lost"] += lost
            bridge.say(f"computer too slow: {lost} sensor reads lost")
            lost, tell_lost_s = 0, now_s + TELL_LOST_EVERY_S
        act()
        bridge.step()
        due_s = max(due_s + 1 / rate_hz, clock.boot_s() - LONGEST_LAG_S)


def _reader(
    slot: str, device: Device, clock: Clock, stop: Event, put: Put, open_bus: OpenBus
) -> Callable[[], None]:
    if device.kind == "bar30":
        number, address = parse_i2c_port(device.port)
        return lambda: _poll_depth(slot, device, lambda: open_bus(number), address, clock, stop, put)
    words = start_command(device)
    return lambda: _read_stream(slot, device, words, clock, stop, put)


def _fault_reports(slot: str, clock: Clock, put: Put) -> Callable[[str], None]:
    """Return a function that takes the present fault, "" for none, and puts it each time that it has changed."""
    reported = ""

    def report(fault: str) -> None:
        nonlocal reported
        # A fault that finds no room is put again: otherwise the crew would never hear of it.
        if fault != reported and put(Arrival(slot, clock.boot_s(), fault=fault)):
            reported = fault

    return report


def _read_stream(slot: str, device: Device, words: bytes, clock: Clock, stop: Event, put: Put) -> None:
    def connect() -> Link:
        link = open_link(port_spec(device))
        if words:
            link.write(words)
        return link

    port, report = Reconnecting(connect, clock, port_spec(device)), _fault_reports(slot, clock, put)
    while not stop.is_set():
        data = port.read(READ_S)
        report(port.reason)
        if data:
            put(Arrival(slot, clock.boot_s(), data))
    port.close()


def _poll_depth(
    slot: str,
    device: Device,
    connect: Callable[[], I2cBus],
    address: int,
    clock: Clock,
    stop: Event,
    put: Put,
) -> None:
    period_s = 1 / (device.rate_hz or DEPTH_RATE_HZ)
    bus: I2cBus | None = None
    sensor: Bar30 | None = None
    retry_s, report = FIRST_RETRY_S, _fault_reports(slot, clock, put)
    while not stop.is_set():
        begun_s = clock.boot_s()
        try:
            bus = bus or connect()
            sensor = sensor or Bar30(bus, time.sleep, address)
            sample = sensor.measure(clock)
        except LinkError as error:
            # The bus is reopened too: an adapter that was unplugged leaves a dead bus behind.
            if bus is not None:
                bus.close()
            bus = sensor = None
            report(str(error))
            stop.wait(retry_s)
            retry_s = next_retry_s(retry_s)
            continue
        retry_s = FIRST_RETRY_S
        report("")
        if sample is not None:
            put(Arrival(slot, sample.time_s, sample=sample))
        stop.wait(max(0.0, begun_s + period_s - clock.boot_s()))
    if bus is not None:
        bus.close()
