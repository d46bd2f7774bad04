"""A device that speaks at another rate than its port listens at is named, whatever the wire makes of its words."""

from typing import Any

import pytest
from device_streams import ON_A_LINE
from service_rig import vehicle

from bridge.clock import SimulatedClock
from bridge.parameters import ParameterServer, vehicle_table
from bridge.service import Bridge
from bridge.vehicle.config import Device

NAMED_WITHIN_S = 5.0
STEP_S = 0.05


def heard_at(data: bytes, times: float) -> bytes:
    """What a receiver of 8N1 makes of `data` whose bits last `times` as long as it takes them to."""
    levels = [level for byte in data for level in (0, *(byte >> bit & 1 for bit in range(8)), 1)]

    def level(at: float) -> int:
        sent = int(at / times)
        return levels[sent] if sent < len(levels) else 1

    found, sent = bytearray(), 0
    while (fallen := next((n for n in range(sent, len(levels)) if not levels[n]), None)) is not None:
        begun = fallen * times
        found.append(sum(level(begun + 1.5 + bit) << bit for bit in range(8)))
        sent = int((begun + 9.5) / times)
        # A line that is still low where it should stand high begins nothing before it has risen.
        while sent < len(levels) and not levels[sent]:
            sent += 1
    return bytes(found)


def told_within(slot: str, kind: Any, say: Any, rate_hz: float, times: float) -> tuple[float, str] | None:
    """When, after it was well for 4 s, and with what words a bridge names the device; None where it does not."""
    craft = vehicle(**{slot: Device(kind, port="/dev/ttyX")})
    clock = SimulatedClock()
    bridge = Bridge(craft, clock, [], ParameterServer(None, vehicle_table(craft)))
    said, wrong_s = 0, 4.0
    while clock.now_s < wrong_s + NAMED_WITHIN_S:
        clock.advance_to(clock.now_s + STEP_S)
        while said < clock.now_s * rate_hz:
            data = say(said)
            bridge.receive(slot, heard_at(data, times) if clock.now_s > wrong_s else data, clock.now_s)
            said += 1
        bridge.step()
        fault = bridge.device_faults.get(slot)
        assert clock.now_s > wrong_s or not fault
        if fault:
            return clock.now_s - wrong_s, fault
    return None


def test_at_the_right_rate_the_wire_changes_nothing() -> None:
    for _, _, say, _ in ON_A_LINE.values():
        data = b"".join(map(say, range(5)))
        assert heard_at(data, 1.0) == data


@pytest.mark.parametrize("times", [12.0, 2.0, 0.5, 1 / 12])
@pytest.mark.parametrize("name", ON_A_LINE)
def test_a_device_at_a_wrong_rate_is_named_within_five_seconds(name: str, times: float) -> None:
    slot = ON_A_LINE[name][0]
    found = told_within(*ON_A_LINE[name], times)
    assert found is not None
    assert found[1] in (f"{slot} makes no sense: check its baud", f"{slot} silent: check cable")
