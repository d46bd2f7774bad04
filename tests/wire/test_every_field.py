"""Every field of every message of the contract, to its extremes: what we write pymavlink reads, and the other way."""

import math
import struct
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.framing import Encoder, Framer, decode
from identify.ingest.frames import Fields, Frames

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


def kind_of(name: str) -> Any:
    return getattr(dialect, f"MAVLink_{name.lower()}_message")


def value_of(wire: str, count: int) -> st.SearchStrategy[Any]:
    if wire == "char":
        return st.text(PRINTED, max_size=count).map(lambda text: text.encode("ascii"))
    if wire == "float":
        one = FLOATS
    else:
        low, high = (-(1 << BITS[wire]) if wire[0] == "i" else 0), (1 << BITS[wire]) - 1
        one = st.sampled_from((low, 0, 1, high)) | st.integers(low, high)
    # Arrays that end in zeros are cut on the wire, those that do not are not.
    return st.lists(one, min_size=count, max_size=count) if count else one


def values_of(name: str) -> st.SearchStrategy[tuple[Any, ...]]:
    kind = kind_of(name)
    counts = dict(zip(kind.ordered_fieldnames, kind.array_lengths, strict=True))
    wires = zip(kind.fieldnames, kind.fieldtypes, strict=True)
    return st.tuples(*[value_of(wire, counts[field]) for field, wire in wires])


def exact(value: Any) -> Any:
    """What is equal only where the value is the same to the bit; one NaN is as good as another."""
    if isinstance(value, bytes):
        return value.rstrip(b"\0").decode("ascii")
    if isinstance(value, str):
        return value
    if isinstance(value, float | np.floating):
        return "nan" if math.isnan(value) else struct.pack("<f", value)
    if isinstance(value, list | tuple | np.ndarray):
        return [exact(one) for one in value]
    return int(value)


@pytest.mark.parametrize("name", CONTRACT)
@settings(deadline=None, max_examples=60)
@given(data=st.data())
def test_what_we_write_pymavlink_reads_to_the_bit(name: str, data: st.DataObject) -> None:
    values = data.draw(values_of(name))
    raw = Encoder(1, 191).encode(kind_of(name)(*values))
    (message,) = dialect.MAVLink(None).parse_buffer(raw)
    assert message.get_type() == name
    assert (message.get_srcSystem(), message.get_srcComponent()) == (1, 191)
    told = {field: getattr(message, field) for field in message.fieldnames}
    assert exact(list(told.values())) == exact(values)


@pytest.mark.parametrize("name", CONTRACT)
@settings(deadline=None, max_examples=60)
@given(data=st.data())
def test_what_pymavlink_writes_we_read_to_the_bit(name: str, data: st.DataObject) -> None:
    values = data.draw(values_of(name))
    kind = kind_of(name)
    raw = bytes(kind(*values).pack(dialect.MAVLink(None, srcSystem=1, srcComponent=191)))
    framer = Framer()
    (frame,) = framer.feed(raw) or framer.flush()
    message = decode(frame)
    assert exact([getattr(message, field) for field in kind.fieldnames]) == exact(values)
    one = [np.array([number]) for number in (10, raw[1], 1, 191, kind.id)]
    frames = Frames(np.frombuffer(raw, np.uint8), np.zeros(1), *one, counts={})
    fields = Fields(frames, name, frames.rows(name))
    assert exact([fields[field][0] for field in kind.fieldnames]) == exact(values)
