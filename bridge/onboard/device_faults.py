"""Reports to the crew which device has no port, is silent, sends bytes that make no sense, or is back."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from bridge.sensors.drivers import speaks_tcp
from bridge.vehicle.config import Device

SILENT_S = 3.0


@dataclass
class _Device:
    """State of one device. `to_check`: what to check if its bytes make no sense.

    `open_s`: when its port opened, inf while it has none. `heard`: whether anything ever came of it. `reported`: the
    kind of fault that the crew knows of.
    """

    to_check: str
    bytes_s: float
    sample_s: float
    open_s: float
    port_fault: str = ""
    fault: str = ""
    reported: str = ""
    heard: bool = False


class SensorWatch:
    """Watches the devices in the vehicle's slots: port, bytes and samples of each, separately."""

    def __init__(self, devices: Mapping[str, Device], now_s: float) -> None:
        self._devices = {
            slot: _Device(_to_check(device), now_s, now_s, now_s) for slot, device in devices.items()
        }

    @property
    def faults(self) -> dict[str, str]:
        """Current faults by slot, as sentences; healthy devices are left out."""
        return {slot: device.fault for slot, device in self._devices.items() if device.fault}

    @property
    def unread(self) -> frozenset[str]:
        """Slots whose device's port can't be read, and of which nothing ever came."""
        return frozenset(s for s, device in self._devices.items() if device.port_fault and not device.heard)

    def port_failed(self, slot: str, fault: str) -> None:
        """Note that a device's port can't be opened or was lost; `fault` says why and what to do."""
        self._devices[slot].port_fault, self._devices[slot].open_s = fault, math.inf

    def port_opened(self, slot: str, time_s: float) -> None:
        self._devices[slot].port_fault, self._devices[slot].open_s = "", time_s

    def bytes_came(self, slot: str, time_s: float) -> None:
        self._devices[slot].bytes_s, self._devices[slot].heard = time_s, True

    def sample_came(self, slot: str, time_s: float) -> None:
        self._devices[slot].sample_s, self._devices[slot].heard = time_s, True

    def texts(self, now_s: float) -> list[str]:
        """Return a short sentence for each slot that lost its port, fell silent or came back since the last call."""
        texts = []
        for slot, device in self._devices.items():
            kind, text = _judged(slot, device, now_s)
            if kind is None:
                continue
            device.fault = text
            # The wording of a fault may change while it lasts; the crew hears of each kind once.
            if kind != device.reported:
                texts.append(text or f"{slot} is back")
            device.reported = kind
        return texts


def _to_check(device: Device) -> str:
    """Say what to check: kind and address of a network device, which has no baud rate, otherwise the baud rate."""
    return f"that {device.port} is its {device.kind}" if speaks_tcp(device) else "its baud"


def _judged(slot: str, device: _Device, now_s: float) -> tuple[str | None, str]:
    """Return the kind of fault and its sentence, "" for none.

    The kind is None while a port that just opened may yet speak.
    """
    if device.port_fault:
        return "port", f"{slot}: {device.port_fault}"
    if now_s - max(device.sample_s, device.open_s) > SILENT_S:
        speaks = now_s - device.bytes_s <= SILENT_S
        silent = f"{slot} silent: check cable"
        return "silent", f"{slot} makes no sense: check {device.to_check}" if speaks else silent
    if device.sample_s < device.open_s:
        return None, ""
    return "", ""
