"""Tells a crew which device has no port, which is silent, which speaks without sense, and which is back."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from bridge.drivers import speaks_tcp
from bridge.vehicle.config import Device

SILENT_S = 3.0


@dataclass
class _Device:
    """`to_check` is what to look at where it makes no sense; `open_s` is when its port opened, inf while it has none;
    `told` is what the crew knows of it."""

    to_check: str
    bytes_s: float
    sample_s: float
    open_s: float
    port_fault: str = ""
    fault: str = ""
    told: str = ""


class SensorWatch:
    """What the devices of the vehicle's slots last gave: port, bytes and samples apart."""

    def __init__(self, devices: Mapping[str, Device], now_s: float) -> None:
        self._devices = {
            slot: _Device(_to_check(device), now_s, now_s, now_s) for slot, device in devices.items()
        }

    @property
    def faults(self) -> dict[str, str]:
        """What is wrong with a device now, as a sentence, by slot; nothing for those that are well."""
        return {slot: device.fault for slot, device in self._devices.items() if device.fault}

    def port_failed(self, slot: str, fault: str) -> None:
        """The port of a device can't be opened, or went away; `fault` says why and what to do."""
        self._devices[slot].port_fault, self._devices[slot].open_s = fault, math.inf

    def port_opened(self, slot: str, time_s: float) -> None:
        self._devices[slot].port_fault, self._devices[slot].open_s = "", time_s

    def bytes_came(self, slot: str, time_s: float) -> None:
        self._devices[slot].bytes_s = time_s

    def sample_came(self, slot: str, time_s: float) -> None:
        self._devices[slot].sample_s = time_s

    def texts(self, now_s: float) -> list[str]:
        """One short sentence for each slot that lost its port, fell silent, or came back, since the last call."""
        texts = []
        for slot, device in self._devices.items():
            kind, text = _judged(slot, device, now_s)
            if kind is None:
                continue
            device.fault = text
            # The words of a fault may change while it lasts; the crew is told of each kind once.
            if kind != device.told:
                texts.append(text or f"{slot} is back")
            device.told = kind
        return texts


def _to_check(device: Device) -> str:
    """Of a device on the network its kind and address, which has no baud."""
    return f"that {device.port} is its {device.kind}" if speaks_tcp(device) else "its baud"


def _judged(slot: str, device: _Device, now_s: float) -> tuple[str | None, str]:
    """The kind of fault and its sentence, "" for none; None while a port that just opened may yet speak."""
    if device.port_fault:
        return "port", f"{slot}: {device.port_fault}"
    if now_s - max(device.sample_s, device.open_s) > SILENT_S:
        speaks = now_s - device.bytes_s <= SILENT_S
        silent = f"{slot} silent: check cable"
        return "silent", f"{slot} makes no sense: check {device.to_check}" if speaks else silent
    if device.sample_s < device.open_s:
        return None, ""
    return "", ""
