"""Devices that are unplugged, or speak at another rate than their port."""

import os
import random
import resource
import threading
from contextlib import suppress
from dataclasses import dataclass

import pytest
from device_streams import ON_A_LINE
from figures import keep
from plugged_devices import Devices
from service_rig import in_real_time, vehicle
from soak import rest_in_soak
from waiting import until

from bridge.clock import SimulatedClock, SystemClock
from bridge.onboard.parameters import ParameterServer
from bridge.onboard.service import Bridge
from bridge.vehicle.config import Device
from bridge.vehicle.parameters import vehicle_table

SHORT, LONG = 3, 100
BACK_WITHIN_S = 3.0
MOST_MORE_MEMORY = 0.05
SETTLED = 20
PATIENCE_S = 60.0
HANDLES = "/dev/fd"


def targets():
    """Targets of the open handles of this process."""
    result = set()
    for handle in os.listdir(HANDLES):
        with suppress(FileNotFoundError):  # the listing's own
            result.add(os.readlink(f"{HANDLES}/{handle}"))
    return result


def peak_memory():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


@dataclass(frozen=True)
class Came:
    """Longest absence of each device, and the share by which memory grew once it had settled."""

    back_after_s: dict[str, float]
    more_memory: float


def pull_and_plug(folder, dvl, times, seed):
    """Every device is pulled and plugged so often; what is held meanwhile stays what it was."""
    rng, clock = random.Random(seed), SystemClock()
    devices = Devices(folder, dvl)
    craft = vehicle(**devices.sensors.present())
    back_after_s = dict.fromkeys(devices.fakes, 0.0)
    held, settled = [], 0
    with (
        devices.speaking(),
        in_real_time(craft, [], lambda _: devices.fakes["depth"].bus) as (bridge, _),
    ):
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
def test_every_device_that_is_unplugged_and_back_speaks_again_and_nothing_leaks(dvl, tmp_path):
    threads, handles = set(threading.enumerate()), targets()
    came = pull_and_plug(tmp_path, dvl, SHORT, 0)
    assert set(came.back_after_s) == {"dvl", "imu", "fog", "depth", "esc", "gnss"}
    # Others' may end meanwhile: what was there before is not asked for.
    assert set(threading.enumerate()) <= threads
    assert targets() <= handles


@pytest.mark.soak
def test_a_hundred_times_unplugged_every_device_speaks_within_three_seconds_and_memory_stays(tmp_path):
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


NAMED_WITHIN_S = 5.0
STEP_S = 0.05


def heard_at(data, times):
    """`data` as received by 8N1 if its bits last `times` as long as expected."""
    levels = [level for byte in data for level in (0, *(byte >> bit & 1 for bit in range(8)), 1)]

    def level(at):
        sent = int(at / times)
        return levels[sent] if sent < len(levels) else 1

    result, sent = bytearray(), 0
    while (fallen := next((n for n in range(sent, len(levels)) if not levels[n]), None)) is not None:
        begun = fallen * times
        result.append(sum(level(begun + 1.5 + bit) << bit for bit in range(8)))
        sent = int((begun + 9.5) / times)
        # A line that is still low where it should stand high begins nothing before it has risen.
        while sent < len(levels) and not levels[sent]:
            sent += 1
    return bytes(result)


def told_within(slot, kind, say, rate_hz, times):
    """Time, after 4 s in order, and words with which a bridge names the device; None if it does not."""
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


def test_at_the_right_rate_the_wire_changes_nothing():
    for _, _, say, _ in ON_A_LINE.values():
        data = b"".join(map(say, range(5)))
        assert heard_at(data, 1.0) == data


@pytest.mark.parametrize("times", rest_in_soak([2.0, 0.5, 12.0, 1 / 12], keep=2))
@pytest.mark.parametrize("name", ON_A_LINE)
def test_a_device_at_a_wrong_rate_is_named_within_five_seconds(name, times):
    slot = ON_A_LINE[name][0]
    result = told_within(*ON_A_LINE[name], times)
    assert result[1] in (f"{slot} makes no sense: check its baud", f"{slot} silent: check cable")
