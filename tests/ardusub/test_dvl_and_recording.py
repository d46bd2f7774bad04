"""A DVL aboard: the autopilot gets its deltas, and the companion's own recording holds both sides on one clock."""

import math
from dataclasses import replace

import numpy as np
import pytest
from fakes.ardusub import MANUAL
from fakes.firmware import Firmware
from pymavlink.dialects.v20 import ardupilotmega as dialect
from rig import FILE, Aboard, Pilot, arm, ready

from bridge.links.link import memory_pair
from bridge.onboard.ring import RingSize, ring_in
from bridge.sensors.samples import DvlSample
from bridge.vehicle.config import Device, Sensors
from bridge.vehicle.mode import Mode
from bridge.wire.framing import Framer, decode
from identify.ingest.open import read_dive

NAN = float("nan")
WITH_DVL = replace(FILE, vehicle=replace(FILE.vehicle, sensors=Sensors(dvl=Device("a50"))))


class Dvl:
    """A reading of the body's velocity ten times a second, from the body where there is one."""

    def __init__(self, autopilot, aboard, velocity=(0.4, -0.1, 0.05), noise_m_s=0.0):
        self.noise_m_s, self.rng = noise_m_s, np.random.default_rng(1)
        self.autopilot, self.aboard, self.velocity, self.due_s = autopilot, aboard, velocity, 0.0
        self.alive = True

    def __call__(self):
        now_s = self.autopilot.clock.boot_s()
        if now_s >= self.due_s and self.alive:
            self.due_s = now_s + 0.1
            if self.autopilot.is_firmware:
                noise = self.noise_m_s * self.rng.standard_normal(3)
                self.velocity = tuple((self.autopilot.body.state[7:10] + noise).tolist())
            self.aboard.bridge.accept("dvl", (DvlSample(now_s, self.velocity, NAN, 3.0),))


def deltas(fake):
    """The VISION_POSITION_DELTAs that reached the autopilot's second link, decoded."""
    heard, hear = [], fake.hear

    def listen(number, frame, now_s):
        if frame.message_id == dialect.MAVLINK_MSG_ID_VISION_POSITION_DELTA:
            heard.append(decode(frame))
        hear(number, frame, now_s)

    fake.hear = listen
    return heard


def test_each_delta_is_the_velocity_times_the_time_between_two_readings(fake):
    aboard, pilot, heard = Aboard(fake, file=WITH_DVL), Pilot(fake), deltas(fake)
    fake.run(3.0, aboard, pilot, Dvl(fake, aboard))
    assert len(heard) > 10
    last = heard[-1]
    assert last.time_delta_usec == pytest.approx(1e5, abs=1e4)
    np.testing.assert_allclose(
        last.position_delta, np.array((0.4, -0.1, 0.05)) * last.time_delta_usec * 1e-6, rtol=1e-5
    )
    assert last.confidence == 100


def test_the_companions_own_odometry_goes_to_other_links_and_never_to_the_autopilot(fake):
    """ArduSub takes ODOMETRY in these frames for a velocity north and east, and bends its heading to it."""
    ground, far = memory_pair()
    aboard, pilot, reached = Aboard(fake, file=WITH_DVL, more_links=(far,)), Pilot(fake), set()
    hear = fake.hear

    def listen(number, frame, now_s):
        reached.add((number, frame.message_id))
        hear(number, frame, now_s)

    fake.hear = listen
    fake.run(3.0, aboard, pilot, Dvl(fake, aboard))
    numbers = {number for _, number in reached}
    assert dialect.MAVLINK_MSG_ID_VISION_POSITION_DELTA in numbers
    assert dialect.MAVLINK_MSG_ID_ODOMETRY not in numbers
    heard = b"".join(iter(lambda: ground.read(0.0), b""))
    assert dialect.MAVLINK_MSG_ID_ODOMETRY in {frame.message_id for frame in Framer().feed(heard)}


def test_a_loss_of_the_bottom_is_not_bridged(fake):
    aboard, pilot, heard = Aboard(fake, file=WITH_DVL), Pilot(fake), deltas(fake)
    dvl = Dvl(fake, aboard)
    fake.run(2.0, aboard, pilot, dvl)
    dvl.velocity = (NAN, NAN, NAN)
    fake.run(1.5, aboard, pilot, dvl)
    lost = len(heard)
    dvl.velocity = (0.4, 0.0, 0.0)
    fake.run(0.15, aboard, pilot, dvl)
    assert len(heard) <= lost + 1
    assert max(m.time_delta_usec for m in heard) < 1.1e6


def test_settings_that_leave_the_dvl_unused_are_named(fake):
    fake.parameters["EK3_SRC1_POSXY"] = 3.0
    aboard, pilot = Aboard(fake, file=WITH_DVL), Pilot(fake)
    fake.run(8.0, aboard, pilot)
    assert "DVL unused: EK3_SRC1_POSXY is 3, set 0" in pilot.texts()


def test_the_recording_aboard_is_a_dive_of_both(autopilot, tmp_path):
    ring = ring_in(tmp_path / "ring", RingSize(100_000_000, 50_000_000), autopilot.clock)
    aboard = Aboard(autopilot, file=WITH_DVL, ring=ring)
    pilot, dvl = Pilot(autopilot), Dvl(autopilot, aboard)
    assert autopilot.until(lambda: aboard.companion.rates.settled, 20.0, aboard, pilot, dvl)
    ready(autopilot, aboard, pilot, dvl)
    autopilot.run(1.0, aboard, pilot, dvl)
    autopilot.set_mode(MANUAL)
    arm(autopilot, aboard, pilot, dvl)
    pilot.sticks["x"] = 300

    def move():
        # A reading that stands still is left out of a dive.
        dvl.velocity = (0.4 + 0.1 * math.sin(autopilot.clock.boot_s()), -0.1, 0.05)

    autopilot.run(8.0, move, aboard, pilot, dvl)
    ring.write_waiting()
    ring.close()
    dive = read_dive(sorted((tmp_path / "ring").iterdir())[0])
    assert dive.pwm is not None
    assert dive.velocity is not None
    assert dive.armed is not None
    assert dive.pwm.value[-1, 2] == pytest.approx(1560, abs=1.5)
    assert not dive.velocity_is_filtered
    senders = set()
    for path in (tmp_path / "ring").iterdir():
        framer = Framer()
        data = path.read_bytes()
        senders |= {(f.system, f.component) for f in framer.feed(data)}
    assert {(1, 1), (1, 191), (255, 190)} <= senders


def test_with_the_dvl_alone_the_firmware_knows_how_fast_it_is(tmp_path):
    """VISION_POSITION_DELTA with EK3_SRC1_POSXY 0 and no GPS."""
    autopilot = Firmware(tmp_path / "sitl")
    try:
        aboard, pilot = Aboard(autopilot, file=WITH_DVL), Pilot(autopilot)
        dvl = Dvl(autopilot, aboard)
        assert autopilot.until(lambda: aboard.companion.rates.settled, 20.0, aboard, pilot, dvl)
        pilot.send(dialect.MAVLink_command_long_message(1, 1, 511, 0, 32, 1e5, 0, 0, 0, 0, 0))
        assert autopilot.until(lambda: pilot.of("LOCAL_POSITION_NED"), 60.0, aboard, pilot, dvl)
        ready(autopilot, aboard, pilot, dvl)
        autopilot.set_mode(MANUAL)
        arm(autopilot, aboard, pilot, dvl)
        pilot.sticks["x"] = 300
        autopilot.run(6.0, aboard, pilot, dvl)
        position = pilot.of("LOCAL_POSITION_NED")[-1]
        assert math.hypot(position.vx, position.vy) == pytest.approx(
            math.hypot(*autopilot.body.state[7:9]), abs=0.05
        )
    finally:
        autopilot.close()


def test_a_shadow_that_was_flown_before_the_vehicle_was_disarmed_counts_no_more(fake):
    """Also where no stick comes meanwhile, as of an autopilot that disarms for just that."""
    aboard, pilot = Aboard(fake, Mode.SHADOW, file=WITH_DVL), Pilot(fake)
    dvl = Dvl(fake, aboard, (0.2, 0.0, 0.0))
    ready(fake, aboard, pilot, dvl)
    assert fake.until(lambda: aboard.companion.law, 20.0, aboard, pilot, dvl)
    arm(fake, aboard, pilot, dvl)
    fake.run(9.0, aboard, pilot, dvl)
    assert aboard.companion.unproven() in [f"shadow: {flown} of 60 s flown" for flown in (4, 6, 8)]
    pilot.flies = False
    assert fake.until(lambda: not fake.armed, 10.0, aboard, pilot, dvl)
    fake.run(2.0, aboard, pilot, dvl)
    assert aboard.companion.unproven() == "shadow: 0 of 60 s flown since a doubt"
