"""The bridge in real time, over pseudo-terminals: bytes in, frames out, ports pulled and put back."""

import threading
import time
from contextlib import contextmanager

import numpy as np
import pytest
from fakes.ports import open_pty
from pymavlink.dialects.v20 import ardupilotmega as dialect
from service_rig import in_real_time, vehicle
from waiting import over_and_over

from bridge.clock import SystemClock
from bridge.errors import ConfigError, LinkError
from bridge.links.link import memory_pair
from bridge.onboard.parameters import ParameterServer
from bridge.onboard.ports import Inbox, port_spec, run_ports
from bridge.onboard.service import Bridge
from bridge.sensors.bar30 import FakeBar30
from bridge.sensors.drivers import make_parser, start_command
from bridge.sensors.kvh1750 import encode_kvh1750
from bridge.sensors.samples import Arrival
from bridge.vehicle.config import Device
from bridge.vehicle.parameters import vehicle_table
from bridge.wire import readings
from bridge.wire.framing import Frame, Framer, decode

WITHIN_S = 60.0


class Ground:
    """The other end of the bridge's link."""

    def __init__(self, link):
        self._link = link
        self._framer = Framer()
        self._waiting: list[Frame] = []

    def until(self, wanted):
        """The next frame that is wanted."""
        deadline_s = time.monotonic() + WITHIN_S
        while time.monotonic() < deadline_s:
            while self._waiting:
                frame = self._waiting.pop(0)
                if wanted(frame):
                    return frame
            self._waiting += self._framer.feed(self._link.read(0.5))
        raise AssertionError("it did not come in time")

    def silent(self, seconds):
        """Whether nothing comes for so long."""
        return not self._link.read(seconds)

    def text(self, part):
        """All texts up to the one with `part`, in however many pieces."""
        said = ""

        def says(frame):
            nonlocal said
            message = decode(frame) if frame.message_id == dialect.MAVLINK_MSG_ID_STATUSTEXT else None
            said += message.text if message is not None else ""
            return part in said

        self.until(says)
        return said

    def reading(self, signal):
        def carries(frame):
            reading = readings.decode(frame)
            return reading is not None and reading.signal == signal

        return readings.decode(self.until(carries))


@contextmanager
def bridging(craft, bus=None, act=lambda: None):
    def open_bus(number):
        if bus is None:
            raise LinkError(f"/dev/i2c-{number} can't be opened")
        return bus

    near, far = memory_pair()
    with in_real_time(craft, [near], open_bus, act) as (bridge, clock):
        yield bridge, Ground(far), clock


def feeding(device, data):
    """Writes `data` over and over: a port drops bytes that came before it was opened."""
    return over_and_over(lambda: device.write(data), 0.02)


def test_bytes_on_a_port_become_frames_dated_by_their_arrival():
    device, path = open_pty()
    craft = vehicle(fog=Device("kvh1750", port=path))
    with bridging(craft) as (_, ground, clock):
        begun_s = clock.boot_s()
        with feeding(device, encode_kvh1750(np.full(20, 0.25))):
            fog = ground.reading("fog")
            assert fog.values[0] == pytest.approx(0.25, abs=1e-5)
            assert begun_s - 0.2 < fog.time_s <= clock.boot_s()
            assert ground.reading("alive").values[1:] == (12.0, 0.0)
    device.close()


def test_steps_that_take_longer_than_their_period_leave_no_sensor_unheard():
    device, path = open_pty()
    craft = vehicle(fog=Device("kvh1750", port=path))
    busy = threading.Event()
    with (
        bridging(craft, act=lambda: busy.wait(0.08) and None) as (_, ground, _),
        feeding(device, encode_kvh1750(np.full(20, 0.25))),
    ):
        assert ground.reading("fog").values[0] == pytest.approx(0.25, abs=1e-5)
    device.close()


def test_what_arrives_while_the_loop_hangs_is_counted_and_told(monkeypatch):
    monkeypatch.setattr("bridge.onboard.ports.MOST_WAITING", 2)
    hung = threading.Event()
    device, path = open_pty()
    craft = vehicle(fog=Device("kvh1750", port=path))
    with (
        bridging(craft, act=lambda: hung.wait(0.3) and None) as (bridge, ground, _),
        feeding(device, encode_kvh1750(np.full(20, 0.25))),
    ):
        ground.text("sensor reads lost")
        assert bridge.counts["arrivals lost"] > 0
        hung.set()
    device.close()


def test_the_heart_beats_in_the_loop_that_does_the_work_and_stands_still_with_it():
    stuck, go_on = threading.Event(), threading.Event()
    device, path = open_pty()

    def work():
        stuck.set()
        assert go_on.wait(WITHIN_S)

    with (
        bridging(vehicle(fog=Device("kvh1750", port=path)), act=work) as (_, ground, _),
        feeding(device, encode_kvh1750(np.full(20, 0.25))),
    ):
        assert stuck.wait(WITHIN_S)
        # Ports are read all the while, by threads of their own, which must not pass for a bridge that lives.
        assert ground.silent(2.5)
        go_on.set()
        assert ground.reading("alive").values[0] == 0.0
        assert ground.reading("fog").values[0] == pytest.approx(0.25, abs=1e-5)
    device.close()


def test_an_inbox_drops_what_has_no_room_and_counts_it_once():
    inbox = Inbox(2)
    assert [inbox.put(Arrival("fog", float(i))) for i in range(5)] == [True, True, False, False, False]
    assert (inbox.take_lost(), inbox.take_lost()) == (3, 0)
    assert [arrival.time_s for arrival in inbox.take(0.0)] == [0.0, 1.0]
    assert list(inbox.take(0.01)) == []


class FullInbox(Inbox):
    """Has no room for the first word of a fault."""

    def put(self, arrival):
        if arrival.fault and not self.refused:
            self.refused = True
            return False
        return super().put(arrival)

    refused = False


def test_a_fault_that_found_no_room_is_told_again(monkeypatch, tmp_path):
    monkeypatch.setattr("bridge.onboard.ports.Inbox", FullInbox)
    with bridging(vehicle(fog=Device("kvh1750", port=str(tmp_path / "ttyFOG")))) as (_, ground, _):
        assert "fog: there is no port" in ground.text("there is no port")


def test_a_port_pulled_and_put_back_speaks_again_and_noise_ends_nothing(tmp_path):
    name = tmp_path / "ttyFOG"
    with bridging(vehicle(fog=Device("kvh1750", port=str(name)), imu=Device("mti300"))) as (_, ground, _):
        ground.text("imu: the vehicle file names no port; add it there")
        for rate in (0.5, 0.75):
            device, path = open_pty()
            name.symlink_to(path)
            noise = b"\xff\x00 no such frame"
            with feeding(device, noise + encode_kvh1750(np.full(100, rate))):
                assert ground.reading("fog").values[0] == pytest.approx(rate, abs=1e-5)
            name.unlink()
            device.close()
            ground.text("the other side has gone")


def test_the_depth_sensor_is_asked_over_i2c_and_one_that_was_unplugged_comes_back():
    bus = FakeBar30(pressure_pa=110_000.0)
    with bridging(vehicle(depth=Device("bar30", port="i2c:1:0x76", rate_hz=10.0)), bus) as (_, ground, _):
        assert ground.reading("pressure").values[0] == pytest.approx(110_000.0, abs=30.0)
        bus.unplugged = True
        ground.text("depth: nothing answers")
        bus.unplugged = False
        assert ground.reading("pressure").values[0] == pytest.approx(110_000.0, abs=30.0)
        closed = bus.closed
        assert closed >= 1
    assert bus.closed == closed + 1


def test_what_is_done_last_waits_for_no_port_that_is_still_being_opened():
    """A companion gives the sticks back then, and a device on a network that is gone may hold its port for seconds."""
    opening, given_back, in_time, stop = threading.Event(), threading.Event(), [], threading.Event()

    def open_bus(_):
        opening.set()
        in_time.append(given_back.wait(5.0))
        raise LinkError("nothing answers")

    craft, clock = vehicle(depth=Device("bar30", port="1")), SystemClock()
    bridge = Bridge(craft, clock, [], ParameterServer(None, vehicle_table(craft)))
    options = {"open_bus": open_bus, "last": given_back.set}
    loop = threading.Thread(target=run_ports, args=(bridge, craft, clock, stop), kwargs=options)
    loop.start()
    assert opening.wait(WITHIN_S)
    stop.set()
    loop.join(WITHIN_S)
    assert in_time == [True]


def test_a_bus_that_cannot_be_opened_is_told_and_the_rest_goes_on():
    with bridging(vehicle(depth=Device("bar30", port="1"))) as (_, ground, _):
        ground.text("/dev/i2c-1 can't be opened")
        assert ground.reading("alive").values[0] == 0.0


def test_a_port_name_that_cannot_be_read_is_refused_before_anything_starts():
    craft = vehicle(depth=Device("bar30", port="i2c:x"))
    clock = SystemClock()
    bridge = Bridge(craft, clock, [], ParameterServer(None, vehicle_table(craft)))
    with pytest.raises(ConfigError, match="names no I2C device"):
        run_ports(bridge, craft, clock, threading.Event())


@pytest.mark.parametrize(
    ("device", "spec"),
    [
        (Device("wayfinder", port="/dev/ttyDVL"), "serial:/dev/ttyDVL:115200"),
        (Device("ublox", port="/dev/ttyGPS", baud=9600), "serial:/dev/ttyGPS:9600"),
        (Device("a50", port="tcp:192.168.2.95:16171"), "tcp:192.168.2.95:16171"),
    ],
)
def test_a_devices_port_names_its_link(device, spec):
    assert port_spec(device) == spec


def test_devices_that_wait_to_be_asked_are_asked():
    assert start_command(Device("wayfinder")).startswith(b"\xaa\x10\x01")
    assert b"=dr,1000" in start_command(Device("kvh1760"))
    assert start_command(Device("mti300")) == b""
    assert make_parser(Device("bar30"), 8) is None
