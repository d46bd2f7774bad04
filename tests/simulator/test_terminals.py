"""The simulated devices through pseudo-terminals into the real ports, by the computer's own clock."""

import math
from threading import Event

import pytest

from bridge.clock import SystemClock
from bridge.link.memory import memory_pair
from bridge.navigation import Navigation
from bridge.parameters import ParameterServer, vehicle_table
from bridge.service import Bridge
from bridge.simulator.body import SimulatedBody
from bridge.simulator.missions import Leg, Mission
from bridge.simulator.terminals import dive_in_real_time
from bridge.vehicle.config import load_vehicle

FILE = load_vehicle("ruvifist")
LONGEST_S = 20.0


@pytest.fixture(scope="module")
def dived() -> tuple[Bridge, list[Navigation], float]:
    """The bridge after some seconds of real time, what it knew every tick, and how long the body swam."""
    clock, stop = SystemClock(), Event()
    known: list[Navigation] = []
    seen: list[tuple[Bridge, float]] = []

    def each_tick(bridge: Bridge, body: SimulatedBody) -> None:
        known.append(bridge.navigation)
        seen.append((bridge, body.time_s))
        enough = bridge.parsers["fog"].counts["good"] >= 2000 and bridge.parsers["gnss"].counts["good"] >= 2
        if enough or clock.boot_s() > LONGEST_S:
            stop.set()

    mission = Mission("ahead", (Leg("ahead", "steady", LONGEST_S, surge_m_s=0.3, transient_s=2.0),), 0.2, 1.0)
    near, _far = memory_pair()
    dive_in_real_time(
        FILE,
        "hovering",
        mission,
        seed=3,
        links=(near,),
        parameters=ParameterServer(None, vehicle_table(FILE.vehicle)),
        clock=clock,
        stop=stop,
        each_tick=each_tick,
    )
    bridge, swum_s = seen[-1]
    return bridge, known, swum_s


PER_SECOND = {"dvl": 10, "imu": 100, "fog": 1000, "esc": 80, "gnss": 1}


@pytest.mark.parametrize(("slot", "rate_hz"), PER_SECOND.items())
def test_every_byte_that_a_device_wrote_was_read_as_its_sample(
    dived: tuple[Bridge, list[Navigation], float], slot: str, rate_hz: float
) -> None:
    bridge, _, swum_s = dived
    counts = bridge.parsers[slot].counts
    assert counts["good"] == pytest.approx(rate_hz * swum_s, abs=max(0.4 * rate_hz, 1.5))
    assert not [reason for reason in ("checksum", "slip", "out of range", "lost") if counts[reason]]


def test_the_bridge_knows_heading_depth_and_speed_as_they_are(
    dived: tuple[Bridge, list[Navigation], float],
) -> None:
    _, known, _ = dived
    last = known[-1]
    assert last.heading_rad == pytest.approx(1.0, abs=math.radians(4))
    assert last.depth_m == pytest.approx(0.2, abs=0.08)
    assert 0.0 < last.velocity[0] < 0.4
    assert last.velocity_time_s > 1.0


def test_samples_are_dated_in_order_though_they_come_in_real_time(
    dived: tuple[Bridge, list[Navigation], float],
) -> None:
    _, known, _ = dived
    times = [
        navigation.rate_time_s for navigation in known if navigation.rate_time_s == navigation.rate_time_s
    ]
    assert len(times) > 20
    assert times == sorted(times)
