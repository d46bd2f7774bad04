"""Every reader of a file that others may have written, with good and crafted input."""

import json
import random
import struct
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import yaml
from autopilot_log import Turning, heard, logged
from fuzz_streams import RING_FILE, payload
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.onboard import store
from bridge.simulator.missions import load_mission
from bridge.vehicle.config import CONFIGS, ThrustCurve, load_vehicle
from bridge.vehicle.controller import load_gains
from bridge.wire.framing import Encoder
from bridge.wire.tlog import read_tlog
from gcs_plugin.dives.folder import DiveFolder
from gcs_plugin.fetch.merging import newest_frames
from gcs_plugin.params.files import read_parameters
from gcs_plugin.params.last_accepted import last_accepted
from gcs_plugin.params.receipt import next_number
from gcs_plugin.params.sidecar import read_sidecar, write_sidecar
from gcs_plugin.params.unfinished import unfinished
from identify.ingest.mapping.column_map import column_map
from identify.ingest.open import read_dive
from tui.accepted_priors import accepted_in
from tui.app.keys import load_keymap
from tui.app.screens.table import PLACES
from tui.commands.merge import merge
from tui.commands.params import targets_of_identification
from tui.parameter_files import Leave

UNIX_US = 1_790_000_000_000_000
COLUMNS = b"""time: {column: t, unit: s}
velocity: {columns: [u, v, w], unit: m/s}
euler: {columns: [r, p, y], unit: deg}
"""


@dataclass(frozen=True)
class Reader:
    """`read` is given a folder of its own, with the hostile bytes in its file `name`."""

    name: str
    read: Callable[[Path], Any]
    good: tuple[bytes, ...]
    craft: Callable[[random.Random], bytes]


def tlog() -> bytes:
    encoder, data = Encoder(1, 1), b""
    for n in range(60):
        for message in (
            dialect.MAVLink_highres_imu_message(n * 20_000, 0, 0, -9.8, 0.1, n % 7, *[0] * 8, 63),
            dialect.MAVLink_actuator_output_status_message(n * 20_000, 3, [1500.0, 1600.0, *[0.0] * 30]),
            dialect.MAVLink_attitude_message(n * 20, 0, 0, n / 60, 0, 0, 0.1),
        ):
            data += struct.pack(">Q", UNIX_US + n * 20_000) + encoder.encode(message)
    return data


def crafted_tlog(rng: random.Random) -> bytes:
    """Frames with right CRCs and payloads of noise; many say when they were sent, some wildly."""
    encoder, data = Encoder(1, 1), b""
    for n in range(80):
        number = rng.choice((*TELEMETRY, rng.choice(tuple(dialect.mavlink_map))))
        body = payload(rng, dialect.mavlink_map[number].unpacker.size)
        if rng.random() < 0.8 and len(body) > 8:
            body = struct.pack("<Q", n * 20_000 if rng.random() < 0.9 else rng.getrandbits(60)) + body[8:]
        stamp = UNIX_US + n * 20_000 if rng.random() < 0.95 else rng.getrandbits(63)
        data += struct.pack(">Q", stamp) + encoder.frame(number, body)
    return data


TELEMETRY = (0, 2, 24, 26, 27, 29, 30, 31, 32, 33, 36, 74, 105, 132, 137, 147, 251, 253, 331, 350, 375)
SIZES = dict.fromkeys("bBM", 1) | dict.fromkeys("hHgcC", 2) | dict.fromkeys("iIfeELn", 4)
SIZES |= dict.fromkeys("qQd", 8) | {"N": 16, "Z": 64, "a": 64}
RECORDS = (
    ("ATT", "QccC", "TimeUS,Roll,Pitch,Yaw"),
    ("IMU", "QBffffff", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ"),
    ("RCOU", "QHHHH", "TimeUS,C1,C2,C3,C4"),
    ("XKF1", "QBfff", "TimeUS,C,VN,VE,VD"),
    ("XKQ", "QBffff", "TimeUS,C,Q1,Q2,Q3,Q4"),
    ("VISO", "Qffff", "TimeUS,dt,PosDX,PosDY,PosDZ"),
    ("ARM", "QB", "TimeUS,ArmState"),
    ("GPS", "QBBLLff", "TimeUS,I,Status,Lat,Lng,Spd,GCrs"),
    ("BAT", "QBf", "TimeUS,Instance,Volt"),
    ("CTUN", "Qf", "TimeUS,Alt"),
    ("RFND", "QBf", "TimeUS,Orient,Dist"),
)


def dataflash(rng: random.Random, hostile: bool = True) -> bytes:
    """A log with its own formats; a hostile one of letters, columns, lengths and numbers of types at random."""
    data, kinds = b"", []
    for number, (name, letters, columns) in enumerate(RECORDS, 10):
        kind = number
        if hostile and rng.random() < 0.3:
            letters = "".join(rng.choice(tuple(SIZES)) if rng.random() < 0.3 else item for item in letters)
        if hostile and rng.random() < 0.2:
            names = columns.split(",")
            names[rng.randrange(len(names))] = rng.choice((*names, "", "f0", "\x1b[2J", "TimeUS"))
            columns = ",".join(names)
        if hostile and rng.random() < 0.1:
            kind = rng.choice((0x80, 0, 255, 11))
        length = 3 + sum(SIZES[item] for item in letters)
        stated = rng.randrange(256) if hostile and rng.random() < 0.05 else length & 0xFF
        head = struct.pack("<BB4s16s64s", kind, stated, name.encode(), letters.encode(), columns.encode())
        data += b"\xa3\x95\x80" + head
        kinds.append((kind, letters))
    for n in range(80):
        kind, letters = rng.choice(kinds)
        body = b""
        for letter in letters:
            wild = hostile and rng.random() < 0.02
            if letter == "Q":
                body += struct.pack("<Q", rng.getrandbits(64) if wild else n * 50_000)
            elif letter in "fd":
                body += struct.pack(
                    f"<{letter}", rng.choice((float("nan"), float("inf"), -1e38)) if wild else 0.5
                )
            else:
                body += payload(rng, SIZES[letter])
        data += b"\xa3\x95" + bytes((kind,)) + body
    return data


def table(rng: random.Random, hostile: float = 0.05) -> bytes:
    words = ("1.5", "", "nan", "inf", "1e400", "1_000", "0x10", "\u0663", ' "4"', "\x1b[2J", "1e308", "-1e15")
    rows = [
        ",".join(rng.choice(words) if rng.random() < hostile else f"{n / 10:.2f}" for _ in range(7))
        for n in range(30)
    ]
    return "\n".join(("t,u,v,w,r,p,y", *rows)).encode()


HOSTILE_YAML = (
    '!!python/object/apply:os.system ["true"]', "!!int x", '!!float ""', "!!timestamp x", "!!binary a", "!local 1",
    "&a [*a]", "*nobody", "[" * 2000, "{a: " * 1500, "- " * 60, ".inf", ".nan", "{}", "[]", "2026-99-99", "1:99:99",
    "0x" + "f" * 5000, "9" * 5000, "? [1]\n: 2", "<<: [1]", "=", "~", '"\\e[2J"', "../../etc/passwd", "'\u2028'",
    "&b [*b0, *b0]", "|\n  x", "true", "-1", "1e400", "%YAML 9", "---\n---",
)  # fmt: skip
DEEP_JSON = ("[" * 100_000, '{"a":' * 50_000)
HOSTILE_JSON = (
    "NaN", "1e999", "9" * 5000, "null", "[]", '"\\u001b[2J"', "{}", "-0", "-1", "1e308", "9" * 299, "Infinity", '"inf"',
    '"1e400"', "true",
)  # fmt: skip


def in_yaml(*good: bytes) -> Callable[[random.Random], bytes]:
    """A good file in which a value, or a line, is something hostile."""

    def craft(rng: random.Random) -> bytes:
        lines = rng.choice(good).decode().split("\n")
        for _ in range(rng.randrange(1, 3)):
            at = rng.randrange(len(lines))
            key, colon, _ = lines[at].partition(":")
            lines[at] = f"{key}{colon} {rng.choice(HOSTILE_YAML)}" if colon else rng.choice(HOSTILE_YAML)
        return "\n".join(lines).encode()

    return craft


def in_json(*good: bytes) -> Callable[[random.Random], bytes]:
    """A good file in which a value, at any depth, is something hostile."""

    def craft(rng: random.Random) -> bytes:
        holder = data = json.loads(rng.choice(good))
        while isinstance(holder, dict | list) and holder and rng.random() < 0.8:
            key = rng.choice(tuple(holder) if isinstance(holder, dict) else range(len(holder)))
            if not isinstance(holder[key], dict | list) or rng.random() < 0.3:
                holder[key] = "@"
            holder = holder[key]
        # Few of what is long, so that many fit into so many bytes.
        hostile = rng.choice(DEEP_JSON if rng.random() < 0.002 else HOSTILE_JSON)
        return json.dumps(data).replace('"@"', hostile).encode()

    return craft


def parameters(rng: random.Random) -> bytes:
    words = (
        "FF0_M_U", "1", "nan", "-inf", "1e400", "1e39", "#", ",", "\t", "\x1b[2J", "\u0661", "9" * 400, "A" * 17, "",
    )  # fmt: skip
    lines = (" ".join(rng.choices(words, k=rng.randrange(1, 6))) for _ in range(rng.randrange(1, 4)))
    return ("FF0_D_U,42.25\n" * rng.randrange(2) + "\n".join(lines)).encode()


def with_file(name: str, data: bytes, read: Callable[[Path], Any]) -> Callable[[Path], Any]:
    """A reader that also wants another file, which is as it should be."""

    def both(folder: Path) -> Any:
        (folder / name).write_bytes(data)
        return read(folder)

    return both


def merging(folder: Path) -> Any:
    """Another recorder's file, put to a dive."""
    dive = DiveFolder(folder / "dive")
    dive.path.mkdir()
    (dive.path / "telemetry.tlog").write_bytes(HEARD)
    return merge(dive, folder / "laptop.tlog")


def recorded_beside() -> tuple[bytes, bytes]:
    """A dive of 40 s, and the autopilot's log of it."""
    with TemporaryDirectory() as folder:
        telemetry, log = Path(folder) / "t.tlog", Path(folder) / "1.BIN"
        heard(telemetry, Turning(), seconds=40.0)
        logged(log, Turning(), lambda boot_s: boot_s + 7.0, start_s=100.0, seconds=40.0)
        return telemetry.read_bytes(), log.read_bytes()


def stored(folder: Path) -> Any:
    return store.load(folder / "stored.json")


def receipts(folder: Path) -> Any:
    (folder / RECEIPT.replace("receipt.json", "accepted.param")).write_bytes(PARAM)
    return last_accepted(folder), unfinished(folder), next_number(folder)


def identification(folder: Path) -> Any:
    """All that an upload and a prior take from it, and the sidecar that is written of it."""
    path, leave = folder / "i.json", Leave(any_vehicle=True, doubts=True)
    accepted = accepted_in(path, None, leave)
    targets = targets_of_identification(path, "ruvifist:hovering", leave)
    assert targets.sidecar is not None
    write_sidecar(folder / "i.param", targets.sidecar)
    return accepted, targets


def yaml_of(data: Any) -> bytes:
    return yaml.safe_dump(data, sort_keys=False).encode()


PARAM = b"FF0_M_U,24.4\n1\t1\tA\t3\t9\n"
RECEIPT = "2026-11-20T091203Z-receipt.json"
VEHICLES = tuple(
    (CONFIGS / "vehicles" / f"{name}.yaml").read_bytes() for name in ("ruvifist", "bluerov2_heavy")
)
GAINS = (CONFIGS / "gains.yaml").read_bytes()
KEYMAP = (CONFIGS / "keymap.yaml").read_bytes()
MISSION = yaml_of(
    {"name": "m", "legs": [{"name": "rest", "phase": "rest", "duration_s": 5}], "start_depth_m": 1.0}
)
ABOUT = yaml_of(
    {"vehicle_file": "v.yaml", "vehicle_sha256": "ab", "configuration": "hovering", "notes": "n",
     "events": [{"utc": "2026-11-20T09:12:03Z", "text": "x"}], "conditions": {}}
)  # fmt: skip
INTERVAL = {"coefficient": "M_u", "unit": "kg", "low95": 1.0, "high95": 2.0}
SIDECAR = json.dumps(
    {"dive_sha256": "a", "vehicle_sha256": "b", "configuration": "h", "method": "pinn", "version": "1",
     "intervals": {"FF0_M_U": INTERVAL}, "effects": [], "doubted": {"M_u": "x"}, "prior_dives": ["d"]}
).encode()  # fmt: skip
STORED = json.dumps({"hulls": {"": {"mode": 1.0, "active": {"FF0_M_U": 24.4}}}}).encode()
KEPT = tuple(
    json.dumps(
        {"vehicle": {"system": 1}, "outcome": outcome, "restores": restores, "number": 3, "active_crc": 7,
         "parameters": [{"name": "FF0_M_U", "target": 24.5, "outcome": outcome}]}
    ).encode()
    for outcome, restores in (("applied", None), ("begun", "2026-11-20T081203Z-before.param"))
)  # fmt: skip
IDENTIFIED = json.dumps(
    {"outcome": "converged", "method": "pinn", "configuration": "hovering", "notes": ["n"],
     "doubts": [{"sentence": "M_u is low: so", "about": ["M_u"], "outcome": "disagrees", "culprit": "recording"}],
     "parameters": [INTERVAL | {"name": "M_u", "value": 150.5, "identifiable": True, "given_thrust": 150.0,
                                "given_thrust_std": 1.0}],
     "thrust_scale": {"shift": 0.01}, "prior_dives": ["d"], "dive": {"name": "d", "sha256": "ab"},
     "vehicle": {"name": "ruvifist", "sha256": "ab"}}
).encode()  # fmt: skip
CURVE = b"voltage_v,pwm_us,thrust_n\n16,1100,-40\n16,1500,0\n16,1900,50\n"
FLIGHT = dataflash(random.Random(0), hostile=False)
ROWS = table(random.Random(0), 0.0)
TLOG = tlog()
HEARD, LOGGED = recorded_beside()
TABLE = ThrustCurve("table", "curve.csv", 16.0)

READERS = (
    Reader("dive.tlog", lambda folder: list(read_tlog(folder / "dive.tlog")), (TLOG,), crafted_tlog),
    Reader("telemetry.tlog", read_dive, (TLOG,), crafted_tlog),
    Reader(RING_FILE, lambda folder: newest_frames([folder / RING_FILE], 1_000_000), (TLOG,), crafted_tlog),
    Reader("1.BIN", with_file("telemetry.tlog", HEARD, read_dive), (LOGGED,), dataflash),
    Reader("laptop.tlog", merging, (HEARD[len(HEARD) // 3 :],), crafted_tlog),
    Reader("telemetry.BIN", read_dive, (FLIGHT,), dataflash),
    Reader("telemetry.csv", with_file("columns.yaml", COLUMNS, read_dive), (ROWS,), table),
    Reader("columns.yaml", with_file("telemetry.csv", ROWS, read_dive), (COLUMNS,), in_yaml(COLUMNS)),
    Reader("map.yaml", lambda folder: column_map(folder / "map.yaml"), (COLUMNS,), in_yaml(COLUMNS)),
    Reader("v.yaml", lambda folder: load_vehicle(str(folder / "v.yaml")), VEHICLES, in_yaml(*VEHICLES)),
    Reader(
        "gains.yaml", lambda folder: load_gains("survey", folder / "gains.yaml"), (GAINS,), in_yaml(GAINS)
    ),
    Reader("m.yaml", lambda folder: load_mission(folder / "m.yaml"), (MISSION,), in_yaml(MISSION)),
    Reader(
        "keymap.yaml", lambda folder: load_keymap(folder / "keymap.yaml", PLACES), (KEYMAP,), in_yaml(KEYMAP)
    ),
    Reader("dive.yaml", lambda folder: DiveFolder(folder).about(), (ABOUT,), in_yaml(ABOUT)),
    Reader(
        "a.param",
        lambda folder: read_parameters(folder / "a.param"),
        (PARAM,),
        parameters,
    ),
    Reader("a.param.json", lambda folder: read_sidecar(folder / "a.param"), (SIDECAR,), in_json(SIDECAR)),
    Reader("stored.json", stored, (STORED,), in_json(STORED)),
    Reader(RECEIPT, receipts, KEPT, in_json(*KEPT)),
    Reader("i.json", identification, (IDENTIFIED,), in_json(IDENTIFIED)),
)
