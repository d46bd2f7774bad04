"""The messages of the telemetry contract, and the codes of its status texts."""

import math
import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.arrays import NAN3
from bridge.errors import FrameError
from bridge.onboard import telemetry
from bridge.sensors.samples import DvlSample, GnssSample, ImuSample
from bridge.vehicle.autopilot import Actuation
from bridge.vehicle.references import Reference
from bridge.wire.framing import Encoder, Framer
from bridge.wire.framing import decode as message_of
from bridge.wire.readings import TABLE, Reading, decode, encode
from bridge.wire.status_codes import CrewText, Topic, coded, decoded, status_texts
from bridge.wire.tlog import read_tlog
from identify.ingest.mavlink.frames import Fields, Frames

SHARED = Path(__file__).resolve().parents[3] / "shared"
NAN = math.nan

number = st.floats(-1e4, 1e4, width=32)
temperature = st.integers(-200, 4000).map(lambda n: n / 100)
small = st.integers(0, 30000).map(lambda n: n / 100)
sigma = st.sampled_from((0.0, 0.25, 0.5, NAN))
fix = st.sampled_from((2.0, 3.0, 4.0))
course = st.just(NAN) | st.integers(0, 35999).map(lambda c: math.radians(c / 100))
satellites = st.just(NAN) | st.integers(0, 40).map(float)


def numbers(n):
    return st.tuples(*[number] * n)


VALUES: dict[str, st.SearchStrategy[tuple[float, ...]]] = {
    "imu": st.tuples(*[number] * 6, st.just(NAN) | number),
    "fog": numbers(1),
    "dvl": st.one_of(st.tuples(number, number, number, sigma), st.just((NAN, NAN, NAN, NAN))),
    "altitude": small.map(lambda a: (a,)),
    "pressure": st.tuples(number.map(lambda p: 100 * p), temperature),
    "attitude": numbers(7),
    "pwm": st.integers(1, 32).flatmap(numbers),
    "rpm": numbers(58),
    "flight": numbers(6),
    "tau_pid": numbers(6),
    "tau_ff": numbers(6),
    "tau_cmd": numbers(6),
    "nu_fb": numbers(6),
    "nu_ref": numbers(14),
    "ff_mode": numbers(1),
    "veh_cfg": numbers(1),
    "battery": st.tuples(st.just(NAN) | small.map(lambda v: v / 10), st.just(NAN) | small),
    "gnss": st.tuples(
        fix, st.just(45.4408), st.just(12.3155), small, small.map(lambda s: s + 1), small, course, satellites
    ),
    "alive": st.tuples(st.sampled_from((0.0, 1.0)), st.just(12.0), st.just(0.0)),
    "clock": st.integers(1_700_000_000, 1_900_000_000).map(lambda t: (float(t),)),
}


def over_the_wire(reading):
    """The reading as it comes back from its frame, and the fields of the pymavlink message."""
    (frame,) = Framer().feed(Encoder(1, 1).frame(*encode(reading)))
    message = message_of(frame)
    return decode(frame), message.to_dict()


def same(a, b):
    return (math.isnan(a) and math.isnan(b)) or math.isclose(a, b, rel_tol=2e-7, abs_tol=1e-9)


def test_the_table_and_this_test_name_the_same_signals():
    assert {row.name for row in TABLE} == set(VALUES)


@pytest.mark.parametrize("row", TABLE, ids=lambda row: row.name)
@settings(max_examples=25)
@given(data=st.data())
def test_what_is_encoded_is_decoded_as_float32_and_has_the_bytes_that_pymavlink_packs(row, data):
    values = data.draw(VALUES[row.name])
    time_s = data.draw(st.integers(0, 4_000_000)) / 1000
    raw = Encoder(1, 1).frame(*encode(Reading(row.name, time_s, values)))
    (frame,) = Framer().feed(raw)
    reading = decode(frame)
    assert reading.signal == row.name
    assert reading.time_s == time_s or (math.isnan(reading.time_s) and row.name in ("battery", "alive"))
    assert all(same(a, b) for a, b in zip(reading.values, values, strict=True))
    message = message_of(frame)
    # Its objects cut char fields to text when they decode, so the name goes back in as bytes.
    fields = [getattr(message, name) for name in message.fieldnames]
    fields = [f.encode() if isinstance(f, str) else f for f in fields]
    assert raw == Encoder(1, 1).encode(row.message(*fields))


def test_the_imu_is_highres_imu_0_with_force_rates_and_temperature():
    _, m = over_the_wire(Reading("imu", 1.5, (0.5, 0.25, -9.75, 0.125, 0.0625, 1.0, 18.5)))
    assert (m["mavpackettype"], m["id"], m["time_usec"], m["fields_updated"]) == (
        "HIGHRES_IMU",
        0,
        1_500_000,
        4159,
    )
    assert (m["xacc"], m["yacc"], m["zacc"]) == (0.5, 0.25, -9.75)
    assert (m["xgyro"], m["ygyro"], m["zgyro"], m["temperature"]) == (0.125, 0.0625, 1.0, 18.5)


def test_the_fog_is_highres_imu_1_with_its_yaw_rate_alone():
    _, m = over_the_wire(Reading("fog", 2.0, (0.5,)))
    assert (m["id"], m["zgyro"], m["xgyro"], m["fields_updated"]) == (1, 0.5, 0.0, 32)


def test_a_battery_that_lists_its_cells_has_the_voltage_of_all_of_them():
    cells = [4100, 4090, 4080, 4110, *[65535] * 6]
    (frame,) = Framer().feed(
        Encoder(1, 1).encode(dialect.MAVLink_battery_status_message(0, 0, 0, 32767, cells, 250, -1, -1, 90))
    )
    assert decode(frame).values == (16.38, 2.5)


def test_the_dvl_is_odometry_without_a_pose():
    _, m = over_the_wire(Reading("dvl", 2.0, (0.5, 0.25, -0.125, 0.25)))
    assert (m["frame_id"], m["child_frame_id"], m["time_usec"]) == (20, 12, 2_000_000)
    assert all(math.isnan(m[axis]) for axis in ("x", "y", "z", "rollspeed", "yawspeed"))
    assert (m["vx"], m["vy"], m["vz"]) == (0.5, 0.25, -0.125)
    assert (m["velocity_covariance"][0], m["velocity_covariance"][6], m["velocity_covariance"][11]) == (
        0.0625,
    ) * 3
    assert math.isnan(m["pose_covariance"][0])
    assert 1 <= m["quality"] <= 100


def test_no_bottom_lock_is_nan_and_quality_minus_1_even_if_one_axis_still_speaks():
    reading, m = over_the_wire(Reading("dvl", 2.0, (0.5, NAN, 0.0, 0.1)))
    assert m["quality"] == -1
    assert all(math.isnan(m[axis]) for axis in ("vx", "vy", "vz"))
    assert all(math.isnan(v) for v in reading.values[:3])


def test_a_foreign_dvl_that_says_zero_velocity_and_failed_has_no_velocity():
    lost = [0.0] * 21
    odometry = dialect.MAVLink_odometry_message(
        1, 20, 12, 0, 0, 0, [1, 0, 0, 0], 0.0, 0.0, 0.0, 0, 0, 0, lost, lost, quality=-1
    )
    (frame,) = Framer().feed(Encoder(1, 1).encode(odometry))
    reading = decode(frame)
    assert all(math.isnan(v) for v in reading.values[:3])


def test_altitude_looks_down_in_centimetres_and_pressure_is_hectopascal():
    _, m = over_the_wire(Reading("altitude", 2.0, (3.21,)))
    assert (m["orientation"], m["current_distance"], m["time_boot_ms"]) == (25, 321, 2000)
    _, m = over_the_wire(Reading("pressure", 2.0, (125_000.0, 18.5)))
    assert (m["press_abs"], m["temperature"]) == (1250.0, 1850)


@pytest.mark.parametrize(("metres", "cm"), [(120.0, 12000), (1000.0, 65534), (NAN, 65535)])
def test_an_altitude_beyond_60_m_is_within_what_the_message_calls_farthest_and_none_comes_back_as_none(
    metres, cm
):
    reading, m = over_the_wire(Reading("altitude", 2.0, (metres,)))
    assert m["current_distance"] == cm
    assert math.isnan(reading.values[0]) if math.isnan(metres) else cm <= m["max_distance"]


@pytest.mark.parametrize(("degrees", "cog"), [(359.997, 35999), (-0.5, 35950), (360.0, 0), (NAN, 65535)])
def test_a_course_over_ground_stays_below_a_whole_turn(degrees, cog):
    _, m = over_the_wire(Reading("gnss", 2.0, (3.0, 45.0, 12.0, 0.0, 1.0, 0.5, math.radians(degrees), 9.0)))
    assert m["cog"] == cog


def test_a_control_tick_is_told_whole():
    six = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
    reference = Reference(six, tuple(2 * v for v in six), 7.5, 0.5)
    tick = Actuation(3.0, six, six, six, six, reference, (1500.0, 1600.0), 2, 1)
    by_signal = {r.signal: r for r in telemetry.actuation_readings(tick)}
    assert set(by_signal) == {"pwm", "tau_pid", "tau_ff", "tau_cmd", "nu_fb", "nu_ref"}
    reading, m = over_the_wire(by_signal["nu_ref"])
    assert reading.values == (*six, 2.0, 4.0, 6.0, 8.0, 10.0, 12.0, 7.5, 0.5)
    assert (m["name"], m["array_id"], m["time_usec"]) == ("NU_REF", 256, 3_000_000)
    _, m = over_the_wire(by_signal["pwm"])
    assert (m["active"], m["actuator"][:3]) == (3, [1500.0, 1600.0, 0.0])


def test_samples_become_the_readings_that_tell_them():
    assert telemetry.attitude_reading(ImuSample(1.0, NAN3, NAN3)) is None
    assert [r.signal for r in telemetry.dvl_readings(DvlSample(1.0, NAN3, NAN, NAN))] == ["dvl"]
    assert [r.signal for r in telemetry.dvl_readings(DvlSample(1.0, NAN3, NAN, 2.0))] == ["dvl", "altitude"]
    fix = telemetry.gnss_reading(GnssSample(1.0, 3, 45.0, 12.0, 1.0, 2.5, 0.5, 1.0, 9))
    assert fix.values == (3.0, 45.0, 12.0, 1.0, 2.5, 0.5, 1.0, 9.0)


@pytest.mark.parametrize("values", [(1e39,) * 6, (math.inf,) * 5])
def test_a_value_that_fits_no_field_is_refused_in_words(values):
    with pytest.raises(FrameError, match="does not fit"):
        encode(Reading("attitude", 1.0, values))


def test_messages_of_other_contracts_are_left_alone():
    array = dialect.MAVLink_debug_float_array_message(1, b"TAU_CMD", 512, [0.0] * 58)
    upward = dialect.MAVLink_distance_sensor_message(1, 5, 600, 100, 1, 0, 24, 255)
    words = dialect.MAVLink_statustext_message(6, b"TAU_CMD")
    encoder, framer = Encoder(1, 1), Framer()
    for message in (array, upward, words):
        (frame,) = framer.feed(encoder.encode(message))
        assert decode(frame) is None


def test_a_foreign_recording_of_the_contract_is_understood_signal_by_signal():
    path = SHARED / "sealed" / "open_1" / "dive.tlog.gz"
    if not path.exists():
        pytest.skip(f"{path} is not here")
    first: dict[str, Reading] = {}
    for _, frame in read_tlog(path):
        reading = decode(frame)
        first.setdefault(reading.signal, reading)
        if len(first) == len(TABLE) - 2:
            break
    assert set(first) == set(VALUES) - {"gnss", "flight"}
    assert first["battery"].values == (16.407, 2.5)
    assert first["alive"].values == (1.0, 12.0, 0.0)
    assert first["nu_ref"].values[12:] == struct.unpack("<2f", struct.pack("<2f", 2.78066086769104, 2.5))
    assert len(first["pwm"].values) == 8
    assert first["clock"] == Reading("clock", 5.0, (1_790_060_600.0,))


CONTRACT = (
    "HEARTBEAT", "SYSTEM_TIME", "TIMESYNC", "HIGHRES_IMU", "ODOMETRY", "DISTANCE_SENSOR", "SCALED_PRESSURE2",
    "ATTITUDE_QUATERNION", "ACTUATOR_OUTPUT_STATUS", "BATTERY_STATUS", "DEBUG_FLOAT_ARRAY", "NAMED_VALUE_FLOAT",
    "NAMED_VALUE_INT", "GPS_RAW_INT", "STATUSTEXT", "PARAM_VALUE", "PARAM_SET",
)  # fmt: skip
BITS = {"int8_t": 7, "int16_t": 15, "int32_t": 31, "int64_t": 63}
BITS |= {"uint8_t": 8, "uint16_t": 16, "uint32_t": 32, "uint64_t": 64}
FLOAT32_MAX = struct.unpack("<f", b"\xff\xff\x7f\x7f")[0]
FLOATS = st.sampled_from((math.nan, math.inf, -math.inf, 0.0, -0.0, FLOAT32_MAX, 1e-45, 1.5)) | st.floats(
    width=32
)
PRINTED = st.characters(min_codepoint=0x20, max_codepoint=0x7E)


def message_class(name):
    return getattr(dialect, f"MAVLink_{name.lower()}_message")


def value_of(wire, count):
    if wire == "char":
        return st.text(PRINTED, max_size=count).map(lambda text: text.encode("ascii"))
    if wire == "float":
        element = FLOATS
    else:
        low, high = (-(1 << BITS[wire]) if wire[0] == "i" else 0), (1 << BITS[wire]) - 1
        element = st.sampled_from((low, 0, 1, high)) | st.integers(low, high)
    # Arrays that end in zeros are cut on the wire, those that do not are not.
    return st.lists(element, min_size=count, max_size=count) if count else element


def values_of(name):
    kind = message_class(name)
    counts = dict(zip(kind.ordered_fieldnames, kind.array_lengths, strict=True))
    wires = zip(kind.fieldnames, kind.fieldtypes, strict=True)
    return st.tuples(*[value_of(wire, counts[field]) for field, wire in wires])


def exact(value):
    """What is equal only where the value is the same to the bit; one NaN is as good as another."""
    if isinstance(value, bytes):
        return value.rstrip(b"\0").decode("ascii")
    if isinstance(value, str):
        return value
    if isinstance(value, float | np.floating):
        return "nan" if math.isnan(value) else struct.pack("<f", value)
    if isinstance(value, list | tuple | np.ndarray):
        return [exact(item) for item in value]
    return int(value)


def check_that_it_is_read_to_the_bit(name, data):
    values = data.draw(values_of(name))
    kind = message_class(name)
    raw = bytes(kind(*values).pack(dialect.MAVLink(None, srcSystem=1, srcComponent=191)))
    framer = Framer()
    (frame,) = framer.feed(raw) or framer.flush()
    message = message_of(frame)
    assert exact([getattr(message, field) for field in kind.fieldnames]) == exact(values)
    # Where the payload begins, its length, system, component and message of the frame.
    places = [np.array([number]) for number in (10, raw[1], 1, 191, kind.id)]
    frames = Frames(np.frombuffer(raw, np.uint8), np.zeros(1), *places, counts={})
    fields = Fields(frames, name, frames.rows(name))
    assert exact([fields[field][0] for field in kind.fieldnames]) == exact(values)


@pytest.mark.parametrize("name", CONTRACT)
@settings(max_examples=20)
@given(data=st.data())
def test_what_pymavlink_writes_we_read_to_the_bit(name, data):
    check_that_it_is_read_to_the_bit(name, data)


@pytest.mark.soak
@pytest.mark.parametrize("name", CONTRACT)
@settings(max_examples=1000)
@given(data=st.data())
def test_whatever_pymavlink_writes_we_read_to_the_bit(name, data):
    check_that_it_is_read_to_the_bit(name, data)


@given(st.sampled_from(Topic), st.text(max_size=80), st.none() | st.integers(0, 2**32 - 1))
def test_a_coded_text_is_decoded(topic, words, number):
    assert decoded(coded(topic, words, number)) == CrewText(words, topic, number)


@pytest.mark.parametrize(
    "text",
    ["", "F5", "F9 x", "F5: x", "F5:x y", "F5:-1 x", "F5:1:2 x", "F5:12345678901 x", "FF set 1 active"],
)
def test_any_other_text_is_words_alone(text):
    assert decoded(text) == CrewText(text)


def test_codes_keep_their_meaning():
    assert {topic.name: topic.value for topic in Topic} == {
        "NO_SET": "F1", "UNPROVEN": "F2", "SHADOW": "F3", "STRANGER": "F4", "SET_ACTIVE": "F5",
        "SET_FAULT": "F6", "OBSTACLE": "F7", "ONCE_ARMED": "F8",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("length", "pieces"), [(0, 1), (1, 1), (50, 1), (51, 2), (99, 2), (100, 3), (150, 4)]
)
def test_a_long_text_ends_with_a_piece_that_is_not_full(length, pieces):
    """MAVLink: a NUL in a piece says that it is the last; a full one has none, and its receiver would wait on."""
    text = "ab" * 75
    messages = status_texts(text[:length], 4, 7)
    assert "".join(message.text for message in messages) == text[:length]
    assert [message.chunk_seq for message in messages] == list(range(pieces))
    assert {message.id for message in messages} == {0 if pieces == 1 else 7}
    assert pieces == 1 or len(messages[-1].text) < 50
