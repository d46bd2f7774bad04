"""The bridge in real time: a thread a port reads bytes with their time of arrival, one loop does all else.

A port that goes away, or is not there yet, is tried again and again; the others go on.
"""

import queue
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from threading import Event, Thread
from typing import Final

from bridge.clock import Clock
from bridge.drivers import greeting, speaks_tcp
from bridge.errors import LinkError
from bridge.link.base import Link
from bridge.link.open import open_link
from bridge.link.reconnecting import FIRST_RETRY_S, Reconnecting, next_retry_s
from bridge.sensors.bar30 import Bar30, I2cBus, SmbusBus, parse_i2c_port
from bridge.sensors.samples import PressureSample
from bridge.service import Bridge
from bridge.vehicle.autopilot import RATE_HZ
from bridge.vehicle.config import Device, Vehicle

READ_S: Final = 0.2
MOST_WAITING: Final = 10_000
LONGEST_LAG_S: Final = 1.0
DEPTH_RATE_HZ: Final = 10.0
NO_PORT: Final = "the vehicle file names no port; add it there"

OpenBus = Callable[[int], I2cBus]


@dataclass(frozen=True, slots=True)
class Arrival:
    """What a port gave at `time_s`: bytes, a sample, or why it gives nothing ("": it works again)."""

    slot: str
    time_s: float
    data: bytes = b""
    sample: PressureSample | None = None
    fault: str | None = None


def run_ports(
    bridge: Bridge,
    vehicle: Vehicle,
    clock: Clock,
    stop: Event,
    *,
    act: Callable[[], None] = lambda: None,
    open_bus: OpenBus = SmbusBus,
) -> None:
    """Read every device of the vehicle file until `stop` is set; `act` runs before each step of the bridge.

    A device without a port is said and left out. Raises ConfigError where a port's name or a device's rate
    can't be used.
    """
    arrivals: queue.Queue[Arrival] = queue.Queue(MOST_WAITING)
    devices = vehicle.sensors.present()
    for slot, device in devices.items():
        if not device.port:
            bridge.port_fault(slot, NO_PORT)
    readers = [
        Thread(target=reader, name=f"read {slot}", daemon=True)
        for slot, device in devices.items()
        if device.port
        for reader in (_reader(slot, device, clock, stop, arrivals, open_bus),)
    ]
    for thread in readers:
        thread.start()
    try:
        _work(bridge, clock, stop, arrivals, act)
    finally:
        stop.set()
        for thread in readers:
            thread.join()


def port_spec(device: Device) -> str:
    """The link that a device's port names."""
    return device.port if speaks_tcp(device) else f"serial:{device.port}:{device.baud}"


def _work(
    bridge: Bridge, clock: Clock, stop: Event, arrivals: "queue.Queue[Arrival]", act: Callable[[], None]
) -> None:
    due_s = clock.boot_s()
    while not stop.is_set():
        # What has arrived comes first: steps that take longer than their period must not leave sensors unheard.
        for _ in range(arrivals.qsize()):
            _give(bridge, arrivals.get())
        wait_s = due_s - clock.boot_s()
        if wait_s <= 0:
            act()
            bridge.step()
            due_s = max(due_s + 1 / RATE_HZ, clock.boot_s() - LONGEST_LAG_S)
            continue
        with suppress(queue.Empty):
            _give(bridge, arrivals.get(timeout=wait_s))


def _give(bridge: Bridge, arrival: Arrival) -> None:
    if arrival.fault is not None:
        bridge.port_fault(arrival.slot, arrival.fault)
    elif arrival.sample is not None:
        bridge.accept(arrival.slot, (arrival.sample,))
    else:
        bridge.receive(arrival.slot, arrival.data, arrival.time_s)


def _reader(
    slot: str, device: Device, clock: Clock, stop: Event, arrivals: "queue.Queue[Arrival]", open_bus: OpenBus
) -> Callable[[], None]:
    def put(arrival: Arrival) -> None:
        # A loop that is this far behind is better served by what comes next than by all that it missed.
        with suppress(queue.Full):
            arrivals.put_nowait(arrival)

    if device.kind == "bar30":
        number, address = parse_i2c_port(device.port)
        return lambda: _poll_depth(slot, device, lambda: open_bus(number), address, clock, stop, put)
    words = greeting(device)
    return lambda: _read_stream(slot, device, words, clock, stop, put)


def _read_stream(
    slot: str, device: Device, words: bytes, clock: Clock, stop: Event, put: Callable[[Arrival], None]
) -> None:
    def connect() -> Link:
        link = open_link(port_spec(device))
        if words:
            link.write(words)
        return link

    spec = port_spec(device)
    port = Reconnecting(connect, clock, spec)
    told = ""
    while not stop.is_set():
        data = port.read(READ_S)
        if port.fault != told:
            told = port.fault
            put(Arrival(slot, clock.boot_s(), fault=told.removeprefix(f"{spec}: ")))
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
    put: Callable[[Arrival], None],
) -> None:
    period_s = 1 / (device.rate_hz or DEPTH_RATE_HZ)
    bus: I2cBus | None = None
    sensor: Bar30 | None = None
    retry_s, told = FIRST_RETRY_S, ""
    while not stop.is_set():
        begun_s = clock.boot_s()
        try:
            bus = bus or connect()
            sensor = sensor or Bar30(bus, time.sleep, address)
            sample = sensor.measure(clock)
        except LinkError as error:
            # The bus too is opened anew: an adapter that was unplugged leaves a dead one behind.
            if bus is not None:
                bus.close()
            bus = sensor = None
            if str(error) != told:
                told = str(error)
                put(Arrival(slot, clock.boot_s(), fault=told))
            stop.wait(retry_s)
            retry_s = next_retry_s(retry_s)
            continue
        if told:
            put(Arrival(slot, clock.boot_s(), fault=""))
        retry_s, told = FIRST_RETRY_S, ""
        if sample is not None:
            put(Arrival(slot, sample.time_s, sample=sample))
        stop.wait(max(0.0, begun_s + period_s - clock.boot_s()))
    if bus is not None:
        bus.close()
