"""Every parser of bytes from a wire, with good and crafted input."""

import json
import random
import socket
import struct
import weakref
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from fastcrc import crc8, crc32
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import SimulatedClock
from bridge.links.link import memory_pair
from bridge.onboard.file_server import FileServer
from bridge.onboard.parameters import ParameterServer
from bridge.onboard.service import Bridge
from bridge.sensors.drivers import make_parser
from bridge.sensors.esc import encode_esc
from bridge.sensors.kvh1750 import encode_kvh1750
from bridge.sensors.kvh1760 import encode_kvh1760
from bridge.sensors.samples import GnssSample
from bridge.sensors.ublox import encode_nav_pvt, encode_nmea, encode_ubx
from bridge.sensors.waterlink import encode_sentence
from bridge.sensors.wayfinder import encode_packet, encode_wayfinder
from bridge.sensors.xsens import encode_message, encode_mtdata2, encode_xsens
from bridge.vehicle.config import Device, load_vehicle
from bridge.vehicle.parameters import vehicle_table
from bridge.wire import readings
from bridge.wire.framing import FULL_BYTES, Encoder, Framer, decode
from bridge.wire.ftp import Op, Packet
from gcs_plugin.peers import Peers
from gcs_plugin.recording.hub import Hub
from gcs_plugin.watch.channels import TELLING, StatusTexts
from gcs_plugin.watch.watcher import Watcher

Feed = Callable[[bytes, float], Sequence[Any]]
NUMBERS = (0.0, -1.0, 1e-30, 3e38, float("nan"), float("inf"), -float("inf"))


@dataclass(frozen=True)
class Stream:
    """`make` gives what is fed bytes and a time and answers with what it found; `good` is found whole each time."""

    name: str
    make: Callable[[], Feed]
    good: bytes
    craft: Callable[[random.Random], bytes]


def payload(rng: random.Random, size: int) -> bytes:
    """Noise, numbers that are none or too large, or bytes that steer."""
    kind = rng.random()
    if kind < 0.4:
        return rng.randbytes(size)
    if kind < 0.7:
        return b"".join(struct.pack("<f", rng.choice(NUMBERS)) for _ in range(size // 4 + 1))[:size]
    return bytes(rng.choices((0, 0, 1, 1, 0x1B, 0x7F, 0x80, 0xBF, 0xC0, 0xFF), k=size))


def mavlink(rng: random.Random) -> bytes:
    """Frames of any message with a right CRC, many of them cut, and aimed at system and component 1."""
    encoder = Encoder(rng.choice((1, 1, 7, 255)), rng.choice((1, 190)))
    out = b""
    for _ in range(20):
        number = rng.choice(
            (*OFTEN, *rng.choices(TOLD, k=len(OFTEN)), rng.choice(tuple(dialect.mavlink_map)))
        )
        body = payload(rng, FULL_BYTES.get(number, 57))
        if rng.random() < 0.5:
            body = body.replace(b"\x00", b"\x01")
        out += encoder.frame(number, body[: rng.randrange(1, len(body) + 1)] if rng.random() < 0.3 else body)
    return out


OFTEN = (
    0, 0, 2, 20, 21, 22, 23, 44, 66, 69, 70, 75, 76, 76, 110, 111, 147, 251, 253, 253, 256, 290, 291, 331, 350,
)  # fmt: skip
TOLD = sorted(TELLING)
HEARTBEAT = Encoder(1, 1).encode(dialect.MAVLink_heartbeat_message(12, 0, 128, 0, 4, 3))
REQUEST = Encoder(255, 190).encode(dialect.MAVLink_param_request_read_message(1, 1, b"FF_MODE", -1))


def framer() -> Feed:
    parser = Framer()

    def feed(data: bytes, _: float) -> list[Any]:
        frames = parser.feed(data) or parser.flush()
        for frame in frames:
            decode(frame)
            readings.decode(frame)
        return frames

    return feed


def ground() -> Feed:
    """The ground's side: watcher, table of senders, texts."""
    parser, watcher, peers = Framer(), Watcher(None), Peers()
    said: list[str] = []
    texts = StatusTexts(lambda _source, _severity, text: said.append(text.words))

    def feed(data: bytes, time_s: float) -> list[Any]:
        frames = parser.feed(data) or parser.flush()
        for frame in frames:
            # Who sends is taken from few: a table of all there could be is no question of parsing.
            watcher.feed(frame, time_s, "link")
            peers.on_frame(frame, "link", time_s)
            texts.hear(frame)
        assert all(text.isprintable() for text in said)
        said.clear()
        watcher.picture(time_s)
        return frames

    return feed


def bridge() -> Feed:
    """The vehicle's side: parameters, files, orders."""
    vehicle, clock = load_vehicle("ruvifist").vehicle, SimulatedClock()
    near, far = memory_pair()
    service = Bridge(vehicle, clock, [near], ParameterServer(None, vehicle_table(vehicle)))
    parser = Framer()

    def feed(data: bytes, time_s: float) -> list[Any]:
        far.write(data)
        clock.advance_to(max(time_s, clock.now_s))
        service.step()
        heard = b""
        while said := far.read(0.0):
            heard += said
        return [
            frame for frame in parser.feed(heard) if frame.message_id == dialect.MAVLINK_MSG_ID_PARAM_VALUE
        ]

    return feed


class OneFile:
    """The file server's folder."""

    def sizes(self) -> list[tuple[str, int]]:
        return [(RING_FILE, 1000)]

    def read(self, name: str, offset: int, size: int) -> bytes:
        if name != RING_FILE:
            raise FileNotFoundError(name)
        return bytes(1000)[offset : offset + size]


def files() -> Feed:
    """Requests of MAVLink FTP."""
    server = FileServer(OneFile(), lambda _: 1e6)

    def feed(data: bytes, time_s: float) -> list[Any]:
        server.hear((0, 255, 190), data, time_s)
        return server.due(time_s)

    return feed


def hub() -> Feed:
    """A client of the recorder's hub."""
    clock = SimulatedClock()
    listening = Hub(clock)
    _, host, port = listening.address.split(":")

    def feed(data: bytes, time_s: float) -> list[Any]:
        clock.advance_to(max(time_s, clock.now_s))
        with socket.create_connection((host, int(port))) as client:
            client.sendall(data)
            result = listening.taken()
        result += listening.taken()
        assert listening.clients <= 1
        return result

    weakref.finalize(feed, listening.close)
    return feed


def asked(rng: random.Random) -> bytes:
    names = (RING_FILE.encode(), b"/", b"../../etc/passwd", b"\x00", b"@PARAM/param.pck", payload(rng, 40))
    size, offset = rng.choice((0, 1, 239, 255)), rng.choice((0, 1, 999, 1000, 2**31, 2**32 - 1))
    session, op = rng.choice((0, 1, 2, 255)), rng.choice((*Op, rng.randrange(256)))
    return Packet(rng.randrange(65536), session, op, size, offset=offset, data=rng.choice(names)).encode()


def sensor(kind: str, port: str = "/dev/ttyUSB0") -> Callable[[], Feed]:
    def make() -> Feed:
        parser = make_parser(Device(kind, port=port), 2)
        return parser.feed

    return make


def floats(rng: random.Random, count: int) -> tuple[float, ...]:
    return tuple(rng.choice((*NUMBERS, rng.gauss(0, 1))) for _ in range(count))


def wayfinder(rng: random.Random) -> bytes:
    return encode_packet(rng.randrange(8), payload(rng, rng.randrange(120)))


def waterlink_json(rng: random.Random) -> bytes:
    values = (None, True, "x", 1e400, -1, [], {}, [1], {"id": 0}, 10**400, "\x1b[2J", 0.5, float("nan"))
    report = {
        **A50,
        rng.choice(tuple(A50)): rng.choice(values),
        "type": rng.choice(("velocity", "response", 3)),
    }
    deep = "[" * rng.choice((0, 0, 0, 3000))
    return (json.dumps(report) if rng.random() < 0.9 else deep).encode() + b"\r\n"


def waterlink_serial(rng: random.Random) -> bytes:
    fields = [
        rng.choice(("1", "-0.5", "nan", "y", "n", "", "1e999", "1;2;3", "\x1b", "9" * 300)) for _ in range(11)
    ]
    return encode_sentence(",".join([rng.choice(("wrz", "wru", "wrp", "wr?", "")), *fields]))


def xsens(rng: random.Random) -> bytes:
    kind = rng.choice((0x1020, 0x1060, 0x4020, 0x8020, 0x2010, 0xE020, rng.randrange(65536)))
    items = [
        (kind | rng.randrange(4), payload(rng, rng.choice((0, 1, 2, 4, 12, 16, 18, 32)))) for _ in range(3)
    ]
    return (
        encode_mtdata2(items) if rng.random() < 0.7 else encode_message(rng.randrange(256), payload(rng, 300))
    )


def kvh1750(rng: random.Random) -> bytes:
    return encode_kvh1750([rng.uniform(-9, 9) for _ in range(20)], rng.randrange(4), rng.random() < 0.8)


def kvh1760(rng: random.Random) -> bytes:
    body = b"\xfe\x81\xff" + rng.choice((b"\x55", b"\x56")) + struct.pack(">6f", *floats(rng, 6))
    body += payload(rng, rng.choice((4, 8)))
    return body + crc32.mpeg_2(body).to_bytes(4, "big")


def esc(rng: random.Random) -> bytes:
    body = payload(rng, 9)
    return body + bytes((crc8.smbus(body),))


def ublox(rng: random.Random) -> bytes:
    if rng.random() < 0.5:
        words = (rng.choice(("", "1", "-1", "nan", "A", "4807.038", "N", "9" * 60)) for _ in range(12))
        return encode_nmea(",".join((rng.choice(("GPGGA", "GPRMC", "GNGGA", "PUBX", "")), *words)))
    kinds = (b"\x01\x07", b"\x01\x02", b"\x01\x06", b"\x01\x12", b"\x0a\x04", rng.randbytes(2))
    return encode_ubx(rng.choice(kinds), payload(rng, rng.choice((0, 16, 28, 36, 52, 92, 200))))


BEAM = {"id": 0, "velocity": 0.1, "distance": 0.5, "rssi": -30, "nsd": -88, "beam_valid": True}
A50 = {
    "time": 106.4, "vx": 0.1, "vy": 0.0, "vz": 0.0, "fom": 1e-3, "covariance": [[0.0] * 3] * 3, "altitude": 0.5,
    "transducers": [BEAM | {"id": n} for n in range(4)], "velocity_valid": True, "status": 0, "format": "json_v3.1",
    "type": "velocity", "time_of_validity": 1638191471563017, "time_of_transmission": 1638191471752336,
}  # fmt: skip
WRZ = "wrz,0.120,-0.400,2.000,y,1.30,1.855,1e-07;0;1.4;0;1.2;0;0.2;0;1e+09,7,14,123.00,1"
FIX = GnssSample(0.0, 3, 59.91, -10.75, 12.5, 2.1, 0.5, 1.0, 9)
WHEN = datetime(2026, 11, 20, 9, 12, 3, tzinfo=UTC)
PING = encode_wayfinder((0.5, 0.0, 0.0), (3.0, 3.0, 3.0, 3.0), 2.6, WHEN)
RING_FILE = "000001-3f9a1c00-000001-0000000000.tlog"
LEVEL = (1.0, 0.0, 0.0, 0.0)

STREAMS = (
    Stream("frames of MAVLink", framer, HEARTBEAT, mavlink),
    Stream("what the ground hears", ground, HEARTBEAT, mavlink),
    Stream("what the vehicle is told", bridge, REQUEST, mavlink),
    Stream("clients of the recorder", hub, HEARTBEAT, mavlink),
    Stream("files the vehicle is asked for", files, Packet(0, 0, Op.LIST, 1, data=b"/").encode(), asked),
    Stream("Wayfinder", sensor("wayfinder"), PING, wayfinder),
    Stream("A50, JSON", sensor("a50", "tcp:dvl:16171"), json.dumps(A50).encode() + b"\r\n", waterlink_json),
    Stream("A50, serial", sensor("a50"), encode_sentence(WRZ), waterlink_serial),
    Stream(
        "MTi-300", sensor("mti300"), encode_xsens(7, 1.25, (0.5, 0.0, 9.8), (0.1, 0.0, 0.0), LEVEL), xsens
    ),
    Stream("DSP-1750", sensor("kvh1750"), encode_kvh1750([0.1] * 40), kvh1750),
    Stream("DSP-1760", sensor("kvh1760"), encode_kvh1760(0.1, 0), kvh1760),
    Stream("ESC", sensor("esc"), encode_esc(2000.0, 14, 16.0, 5.0, 30.0, 100.0), esc),
    Stream("u-blox", sensor("ublox"), encode_nav_pvt(FIX, 1000), ublox),
)
