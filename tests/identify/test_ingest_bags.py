"""Bags of ROS 1 and ROS 2, whole and cut, without ROS."""

import importlib
import random
import shutil
import sqlite3
import struct
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bags_made import FORMS, LATE_NS, ROS1, ROS2, START_NS, STEP_NS, header, store_of, swim, write_bag
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from soak import rest_in_soak

from bridge import exit_codes
from bridge.errors import LogError
from identify.ingest.files.streams import Stream, Streams
from identify.ingest.mapping.proposal_of_runs import propose
from identify.ingest.open import read_dive
from identify.ingest.ros.bags import bag_files, read_bag
from identify.ingest.ros.db3 import rows_in
from identify.ingest.ros.recorded import ZSTD_MAGIC
from tui import cli

COUNT = 200
LATER = (
    "`stamp` is when the log got a message, later by what the way takes; a diagnosis shows that as a delay."
)
ROWS = np.arange(COUNT)


def topics(recorded: Streams) -> dict[str, Stream]:
    return {stream.name: stream for stream in recorded.streams}


def read_or_refused(file: Path) -> tuple[Streams, str]:
    """What a bag holds, or nothing and the sentence that refuses it."""
    try:
        return read_bag([file]), ""
    except LogError as error:
        return Streams(()), str(error)


@pytest.mark.parametrize("form", FORMS)
def test_a_bag_of_any_form_gives_every_number_of_every_topic(tmp_path: Path, form: str) -> None:
    recorded = read_bag([write_bag(tmp_path, form, swim(store_of(form), COUNT))])
    read = topics(recorded)
    assert set(read) == {"/imu", "/thrusters", "/dvl/twist"}
    assert read["/imu"].columns["angular_velocity.z"].tolist() == (ROWS / 8).tolist()
    assert read["/imu"].columns["angular_velocity_covariance.5"].tolist() == [5.0] * COUNT
    assert read["/imu"].columns["linear_acceleration.z"].tolist() == [-9.8] * COUNT
    assert read["/dvl/twist"].columns["twist.linear.x"].tolist() == (ROWS / 64).tolist()
    assert read["/thrusters"].columns["data.5"].tolist() == (ROWS + 5.0).tolist()
    assert "data.6" not in read["/thrusters"].columns
    assert recorded.notes == (f"No header time in /thrusters: {LATER}",)


@pytest.mark.parametrize("form", ["bag", "mcap", "db3"])
def test_stamp_is_the_headers_time_and_received_the_logs(tmp_path: Path, form: str) -> None:
    read = topics(read_bag([write_bag(tmp_path, form, swim(store_of(form), COUNT))]))
    stamp_s = START_NS * 1e-9 + ROWS * (STEP_NS * 1e-9)
    for name in ("/imu", "/dvl/twist"):
        assert read[name].columns["stamp"] == pytest.approx(stamp_s, abs=1e-6, rel=0)
    for stream in read.values():
        assert stream.columns["received"] == pytest.approx(stamp_s + LATE_NS * 1e-9, abs=1e-6, rel=0)
    assert (read["/thrusters"].columns["stamp"] == read["/thrusters"].columns["received"]).all()


def test_a_message_whose_header_is_not_filled_in_has_no_stamp(tmp_path: Path) -> None:
    messages = swim(ROS2, 4)
    for name, _, _, message in messages[:3]:
        if name != "/thrusters":
            message.header.stamp.sec = message.header.stamp.nanosec = 0
    stamp_s = topics(read_bag([write_bag(tmp_path, "mcap", messages)]))["/imu"].columns["stamp"]
    assert np.isnan(stamp_s).tolist() == [True, False, False, False]


@pytest.mark.parametrize("form", ["bag", "mcap"])
@pytest.mark.parametrize("unmeasured", ["orientation", "angular_velocity", "linear_acceleration"])
def test_what_an_imu_says_by_its_covariance_that_it_does_not_measure_is_unknown(
    tmp_path: Path, form: str, unmeasured: str
) -> None:
    messages = swim(store_of(form), 4)
    for name, _, _, message in messages[:6]:
        if name == "/imu":
            getattr(message, f"{unmeasured}_covariance")[0] = -1.0
    recorded = read_bag([write_bag(tmp_path, form, messages)])
    columns = topics(recorded)["/imu"].columns
    for field in ("orientation.w", "orientation.x", "angular_velocity.z", "linear_acceleration.z"):
        is_unknown = field.startswith(unmeasured)
        assert np.isnan(columns[field]).tolist() == [is_unknown, is_unknown, False, False]
    said = f"By its covariance, /imu does not measure {unmeasured}: taken for no reading."
    assert [note for note in recorded.notes if "covariance" in note] == [said]


def test_an_orientation_that_no_sensor_measured_is_proposed_for_no_attitude(tmp_path: Path) -> None:
    messages = swim(ROS2, COUNT)
    for k, (name, _, _, message) in enumerate(messages):
        if name == "/imu":
            message.orientation.y, message.orientation.w = np.sin(k / 300), np.cos(k / 300)
    assert "quaternion" in proposed_signals(tmp_path / "measured", messages)
    for name, _, _, message in messages:
        if name == "/imu":
            message.orientation_covariance[0] = -1.0
    assert "quaternion" not in proposed_signals(tmp_path / "unmeasured", messages)


def proposed_signals(folder: Path, messages: list[Any]) -> set[str]:
    folder.mkdir()
    file = write_bag(folder, "mcap", messages)
    return set(propose(read_bag([file]).streams, file).columns.signals())


def test_a_header_that_is_never_filled_in_gives_the_time_of_the_log(tmp_path: Path) -> None:
    twist, vector = (ROS2.types[f"geometry_msgs/msg/{name}"] for name in ("Twist", "Vector3"))
    stamped = ROS2.types["geometry_msgs/msg/TwistStamped"]
    still = twist(vector(1.0, 0.0, 0.0), vector(0.0, 0.0, 0.0))
    messages = [
        (
            "/dvl",
            "geometry_msgs/msg/TwistStamped",
            START_NS + k * STEP_NS,
            stamped(header(ROS2, 0, ""), still),
        )
        for k in range(3)
    ]
    recorded = read_bag([write_bag(tmp_path, "mcap", messages)])
    columns = recorded.streams[0].columns
    assert columns["stamp"].tolist() == columns["received"].tolist()
    assert recorded.notes == (f"No header time in /dvl: {LATER}",)


WILD = """
bool flag
string name
int8 small
float64 wide
uint16[3] three
string[] names
float32[] many
byte octet
uint64 big
std_msgs/Header[] heads
float64 last
int32[<=4] few
time_like/Pair pair
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: time_like/Pair
uint8 a
int64 b
"""


def wild_store(base: Stores) -> Any:
    store = get_typestore(base)
    text = WILD if base is Stores.ROS2_HUMBLE else WILD.replace("builtin_interfaces/Time", "uint32 seq\ntime")
    text = text.replace("<=", "") if base is Stores.ROS1_NOETIC else text
    types = get_types_from_msg(text, "pkg/msg/Wild")
    store.register({name: made for name, made in types.items() if name not in store.fielddefs})
    return store


@pytest.mark.parametrize("form", ["bag", "mcap"])
def test_texts_and_lists_of_any_length_leave_every_field_in_its_place(tmp_path: Path, form: str) -> None:
    """Each message has lengths of its own, and the library's own decoder is asked beside ours."""
    rng = random.Random(3)
    base = Stores.ROS1_NOETIC if form == "bag" else Stores.ROS2_HUMBLE
    store = wild_store(base)
    wild, pair = store.types["pkg/msg/Wild"], store.types["time_like/msg/Pair"]
    head, time = store.types["std_msgs/msg/Header"], store.types["builtin_interfaces/msg/Time"]
    messages = []
    for k in range(300):
        number = (1,) if form == "bag" else ()
        heads = [
            head(*number, time(rng.randrange(99), 5), "f" * rng.randrange(9)) for _ in range(rng.randrange(3))
        ]
        few = [rng.randrange(-9, 9) for _ in range(4 if form == "bag" else rng.randrange(4))]
        made = wild(
            bool(k % 2), "n" * rng.randrange(5), -k % 100, rng.random(), np.arange(3, dtype=np.uint16) + k,
            ["x" * rng.randrange(6) for _ in range(rng.randrange(4))],
            np.arange(rng.randrange(19), dtype=np.float32), k % 128, k * 2**33, heads, k / 3,
            np.array(few, np.int32), pair(k % 7, -k),
        )  # fmt: skip
        messages.append(("/wild", "pkg/msg/Wild", START_NS + k, made))
    file = write_bag(tmp_path, form, messages, store)
    columns = read_bag([file]).streams[0].columns
    with AnyReader([file]) as reader:
        decoded: list[Any] = [
            reader.deserialize(raw, connection.msgtype) for connection, _, raw in reader.messages()
        ]
    assert len(decoded) == 300
    for k, message in enumerate(decoded):
        for name in ("flag", "small", "wide", "octet", "big", "last"):
            assert columns[name][k] == getattr(message, name), (k, name)
        assert [columns[f"three.{j}"][k] for j in range(3)] == message.three.tolist()
        many = [columns[f"many.{j}"][k] for j in range(16)]
        held = message.many.tolist() if len(message.many) <= 16 else []
        assert many[: len(held)] == held
        assert np.isnan(many[len(held) :]).all()
        assert columns["pair.b"][k] == message.pair.b
        for j, sub in enumerate(message.heads):
            assert columns[f"heads.{j}.stamp"][k] == sub.stamp.sec + 5e-9
    assert not any(name.startswith("many.16") for name in columns)


def test_messages_of_one_size_and_hundreds_of_layouts_are_all_read(tmp_path: Path) -> None:
    """The lengths of two texts differ from message to message, their sum does not, and a number is between them."""
    array, status = (ROS2.types[f"diagnostic_msgs/msg/Diagnostic{name}"] for name in ("Array", "Status"))
    kind = "diagnostic_msgs/msg/DiagnosticArray"
    messages = [
        (
            "/health",
            kind,
            START_NS + k,
            array(
                header(ROS2, START_NS, "f"),
                [
                    status(1, "a" * (4 * (k % 300)), "", "", []),
                    status(k % 100, "b" * (4 * (299 - k % 300)), "", "", []),
                ],
            ),
        )
        for k in range(600)
    ]
    columns = read_bag([write_bag(tmp_path, "mcap", messages)]).streams[0].columns
    assert columns["status.1.level"].tolist() == (np.arange(600) % 100).tolist()


def test_big_endian_messages_are_read(tmp_path: Path) -> None:
    vector = ROS2.types["geometry_msgs/msg/Vector3"]
    store = get_typestore(Stores.ROS2_HUMBLE)
    plain = store.serialize_cdr
    store.serialize_cdr = lambda message, kind: plain(message, kind, little_endian=False)
    messages = [
        ("/v", "geometry_msgs/msg/Vector3", START_NS + k, vector(1.0 * k, 2.0, -3.5)) for k in range(4)
    ]
    columns = read_bag([write_bag(tmp_path, "mcap", messages, store)]).streams[0].columns
    assert columns["x"].tolist() == [0.0, 1.0, 2.0, 3.0]
    assert columns["z"].tolist() == [-3.5] * 4


def image(k: int) -> tuple[str, str, int, Any]:
    made = ROS2.types["sensor_msgs/msg/Image"]
    pixels = np.zeros(12, np.uint8)
    return (
        "/camera",
        "sensor_msgs/msg/Image",
        START_NS + k,
        made(header(ROS2, START_NS, "c"), 2, 2, "rgb8", 0, 6, pixels),
    )


def text(k: int) -> tuple[str, str, int, Any]:
    return "/words", "std_msgs/msg/String", START_NS + k, ROS2.types["std_msgs/msg/String"]("hello")


def test_images_and_words_are_left_out(tmp_path: Path) -> None:
    messages = [*swim(ROS2, 3), image(0), text(0)]
    assert set(topics(read_bag([write_bag(tmp_path, "mcap", messages)]))) == {
        "/imu",
        "/thrusters",
        "/dvl/twist",
    }


def test_a_bag_without_numbers_is_refused_in_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"bag\.mcap: holds no message with numbers"):
        read_bag([write_bag(tmp_path, "mcap", [text(0), image(1)])])


def without_definitions(file: Path) -> Path:
    """A `.db3` as ROS 2 Humble writes it."""
    with sqlite3.connect(file) as database:
        database.execute("DROP TABLE message_definitions")
    database.close()
    return file


def test_a_db3_whose_killed_recorder_left_messages_in_the_log_beside_it_is_not_read_without_them(
    tmp_path: Path,
) -> None:
    """ROS 2 records so with `--storage-preset-profile resilient`."""
    written = write_bag(tmp_path, "db3", swim(ROS2, COUNT))
    killed = tmp_path / "killed.db3"
    with closing(sqlite3.connect(written)) as database:
        database.execute("PRAGMA journal_mode=WAL")
        database.execute("CREATE TABLE later AS SELECT * FROM messages WHERE id > 10")
        database.execute("DELETE FROM messages WHERE id > 10")
        database.commit()
        database.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        database.execute("INSERT INTO messages SELECT * FROM later")
        database.commit()
        for end in ("", "-wal"):
            shutil.copy(f"{written}{end}", f"{killed}{end}")
    with pytest.raises(LogError, match=r"killed\.db3: lacks the messages in killed\.db3-wal"):
        read_bag([killed])
    with closing(sqlite3.connect(killed)) as database:
        database.execute("PRAGMA journal_mode=delete")
    yaws = topics(read_bag([killed]))["/imu"].columns["angular_velocity.z"]
    assert yaws.tolist() == (ROWS / 8).tolist()


def test_types_of_ros_need_no_definition_in_the_bag(tmp_path: Path) -> None:
    file = without_definitions(write_bag(tmp_path, "db3", swim(ROS2, COUNT)))
    assert topics(read_bag([file]))["/imu"].columns["angular_velocity.z"].tolist() == (ROWS / 8).tolist()


def test_a_topic_of_a_type_that_nothing_defines_is_left_out_and_named(tmp_path: Path) -> None:
    store = get_typestore(Stores.ROS2_HUMBLE)
    store.register(get_types_from_msg("float64 depth", "deep_msgs/msg/Depth"))
    depth = store.types["deep_msgs/msg/Depth"]
    messages = [*swim(store, 5), ("/depth", "deep_msgs/msg/Depth", START_NS, depth(1.0))]
    file = write_bag(tmp_path, "db3", messages, store)
    assert topics(read_bag([file]))["/depth"].columns["depth"].tolist() == [1.0]
    recorded = read_bag([without_definitions(file)])
    assert set(topics(recorded)) == {"/imu", "/thrusters", "/dvl/twist"}
    assert (
        "Left out, since the bag does not define what they hold: /depth (deep_msgs/msg/Depth). Put the "
        "definition beside the bag, as deep_msgs/msg/Depth.msg, or record it as .mcap, which has the definitions."
    ) in recorded.notes
    definition = file.parent / "deep_msgs" / "msg" / "Depth.msg"
    definition.parent.mkdir(parents=True)
    definition.write_text("float64 depth\n", encoding="utf-8")
    for place in (file.parent, file.parent.parent):
        definition.parents[1].rename(place / "deep_msgs")
        definition = place / "deep_msgs" / "msg" / "Depth.msg"
        recorded = read_bag([file])
        assert topics(recorded)["/depth"].columns["depth"].tolist() == [1.0]
        assert not any("Left out" in note for note in recorded.notes)
    columns = tmp_path / "columns.yaml"
    columns.write_text(
        "time: {column: stamp}\ndepth: {columns: [/depth.depth], unit: m}\n"
        "gyro: {columns: [null, null, /imu.angular_velocity.z], unit: rad/s}\n",
        encoding="utf-8",
    )
    words = ["import", str(file), "--columns", str(columns), "--out", str(tmp_path / "dive")]
    assert cli.main(words) == exit_codes.DONE
    assert (tmp_path / "dive" / "deep_msgs" / "msg" / "Depth.msg").read_text(
        encoding="utf-8"
    ) == "float64 depth\n"
    assert read_dive(tmp_path / "dive").depth.value.tolist() == [[1.0]]
    definition.write_text("float64", encoding="utf-8")
    with pytest.raises(LogError, match=r"Depth\.msg: can't be read as the definition of a type"):
        read_bag([file])


def test_a_constant_of_any_name_is_no_field_of_a_message(tmp_path: Path) -> None:
    """ROS allows small letters in the name of a constant."""
    definition = "# the bus\nuint8 BUS_Motors = 16\nuint8 BUS_kill =\t32\nstring Said=a = b\nuint8 bus\nuint8[<=8] data"
    store = get_typestore(Stores.ROS2_HUMBLE)
    store.register(get_types_from_msg("uint8 bus\nuint8[<=8] data", "bus_msgs/msg/Sent"))
    sent = store.types["bus_msgs/msg/Sent"](16, np.array([100, 87], np.uint8))
    file = write_bag(tmp_path, "db3", [("/bus", "bus_msgs/msg/Sent", START_NS, sent)], store)
    beside = without_definitions(file).parent / "bus_msgs" / "msg" / "Sent.msg"
    beside.parent.mkdir(parents=True)
    beside.write_text(definition, encoding="utf-8")
    read = topics(read_bag([file]))["/bus"].columns
    assert {name: read[name].tolist() for name in ("bus", "data.0", "data.1")} == {
        "bus": [16.0], "data.0": [100.0], "data.1": [87.0]
    }  # fmt: skip


def test_a_message_that_contradicts_its_definition_is_counted(tmp_path: Path) -> None:
    file = write_bag(tmp_path, "db3", swim(ROS2, 5))
    with sqlite3.connect(file) as database:
        database.execute("UPDATE messages SET data = substr(data, 1, length(data) - 20) WHERE id = 1")
        database.commit()
        said = "1 message of /imu doesn't fit the definition of sensor_msgs/msg/Imu and was left out."
        assert said in read_bag([file]).notes
        database.execute("UPDATE messages SET data = CAST(data || zeroblob(20) AS BLOB) WHERE id = 4")
    database.close()
    recorded = read_bag([file])
    assert topics(recorded)["/imu"].columns["angular_velocity.z"].tolist() == [0.25, 0.375, 0.5]
    assert (
        "2 messages of /imu don't fit the definition of sensor_msgs/msg/Imu and were left out."
        in recorded.notes
    )


@pytest.mark.parametrize("form", rest_in_soak(FORMS, keep=3))
def test_a_bag_that_is_cut_anywhere_gives_what_is_before_or_one_sentence(tmp_path: Path, form: str) -> None:
    file = write_bag(tmp_path, form, swim(store_of(form), COUNT))
    data, cut = file.read_bytes(), tmp_path / f"cut{file.suffix}"
    longest = 0
    for share in range(40):
        cut.write_bytes(data[: len(data) * share // 40])
        recorded, said = read_or_refused(cut)
        assert "\n" not in said
        assert said == "" or said.startswith(f"{cut}: ")
        for stream in recorded.streams:
            if stream.name == "/imu":
                rates = stream.columns["angular_velocity.z"]
                assert rates.tolist() == (ROWS / 8)[: len(rates)].tolist()
                assert len(rates) >= longest
                longest = len(rates)
    assert longest > COUNT / 3
    if form not in ("bag", "bag.bz2", "bag.lz4"):
        return
    # A ROS 1 bag ends in an index, which may be all that is lost.
    assert longest == COUNT


def test_a_cut_database_gives_all_rows_that_it_still_holds(tmp_path: Path) -> None:
    """Rows of a few bytes and of several pages, whose index to them is lost: SQLite itself reads none of them."""
    file = tmp_path / "rows.db3"
    numbers = range(1, 3001)
    held = [(n, n % 3, n * 10**9, random.Random(n).randbytes(40 if n % 50 else 20_000)) for n in numbers]
    with sqlite3.connect(file) as database:
        database.execute("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id, timestamp, data)")
        database.execute("CREATE TABLE other(id INTEGER PRIMARY KEY, word)")
        database.executemany("INSERT INTO messages VALUES (?, ?, ?, ?)", held)
        database.execute("INSERT INTO other VALUES (1, 'word')")
    database.close()
    data = file.read_bytes()
    assert rows_in(data, 4096, 4) == held
    for share in (0.3, 0.6, 0.9):
        rows = rows_in(data[: int(share * len(data))], 4096, 4)
        assert rows == held[: len(rows)]
        assert abs(len(rows) / len(held) - share) < 0.03
    assert rows_in(data, 16, 4) == []


def test_of_a_chunk_that_is_cut_the_beginning_is_read(tmp_path: Path) -> None:
    file = write_bag(tmp_path, "bag", swim(ROS1, 1), chunk_bytes=1 << 20)
    data = file.read_bytes()
    file.write_bytes(data[: data.rindex(b"base_link")])
    recorded, said = read_or_refused(file)
    assert said == ""
    assert topics(recorded)["/imu"].columns["angular_velocity.z"].tolist()[:1] == [0.0]
    assert "/dvl/twist" not in topics(recorded)


LZ4_MAGIC = b"\x04\x22\x4d\x18"
ZSTD, CRC_BEFORE = b"zstd", 8


@pytest.mark.parametrize(
    ("form", "mark", "at"),
    [("bag.lz4", LZ4_MAGIC, 0), ("mcap.zstd", ZSTD_MAGIC, 0), ("mcap.zstd", ZSTD, -CRC_BEFORE)],
    ids=["packed data of ROS 1", "packed data of MCAP", "checksum of MCAP"],
)
def test_damage_in_the_middle_of_a_bag_costs_its_chunk_alone(
    tmp_path: Path, form: str, mark: bytes, at: int
) -> None:
    count = 4500
    file = write_bag(tmp_path, form, swim(store_of(form), count))
    data = bytearray(file.read_bytes())
    hole = data.index(mark, data.index(mark) + 1) + at
    data[hole : hole + 4] = b"\1\1\1\1"
    file.write_bytes(data)
    recorded = read_bag([file])
    turned = (8 * topics(recorded)["/imu"].columns["angular_velocity.z"]).tolist()
    lost = sorted(set(range(count)) - set(turned))
    assert turned == sorted(turned)
    assert 0 < len(lost) == lost[-1] - lost[0] + 1 < count / 2
    assert turned[-1] == count - 1
    assert f"{file.name} is cut off or damaged: all that is whole was read." in recorded.notes


def test_a_damaged_message_that_its_recorder_packed_by_itself_costs_no_other(tmp_path: Path) -> None:
    file = write_bag(tmp_path, "db3.zstd", swim(ROS2, COUNT))
    with closing(sqlite3.connect(file)) as database:
        (packed,) = database.execute("SELECT data FROM messages WHERE id = 1").fetchone()
        database.execute("UPDATE messages SET data = ? WHERE id = 1", (packed[:8] + b"\1" * 8 + packed[16:],))
        database.commit()
    recorded = read_bag([file])
    read = [len(stream.columns["received"]) for stream in recorded.streams]
    assert sorted(read) == [COUNT - 1, COUNT, COUNT]
    assert f"{file.name} is cut off or damaged: all that is whole was read." in recorded.notes


@pytest.mark.parametrize("form", ["bag", "mcap", "db3"])
def test_a_cut_is_said(tmp_path: Path, form: str) -> None:
    file = write_bag(tmp_path, form, swim(store_of(form), COUNT))
    data = file.read_bytes()
    file.write_bytes(data[: len(data) * 7 // 10])
    notes = read_bag([file]).notes
    assert f"{file.name} is cut off or damaged: all that is whole was read." in notes


@pytest.mark.parametrize("form", ["bag", "mcap", "db3"])
def test_a_cut_before_the_first_message_says_that_nothing_can_be_read(tmp_path: Path, form: str) -> None:
    file = write_bag(tmp_path, form, swim(store_of(form), COUNT))
    file.write_bytes(file.read_bytes()[:120])
    _, said = read_or_refused(file)
    assert said.startswith(
        f"{file}: is cut off or damaged before its first message with numbers, so nothing can be"
    )


@pytest.mark.parametrize("form", rest_in_soak(FORMS, keep=3))
def test_damage_anywhere_is_never_more_than_a_sentence(tmp_path: Path, form: str) -> None:
    file = write_bag(tmp_path, form, swim(store_of(form), 20))
    data, rng = file.read_bytes(), random.Random(form)
    for _ in range(60):
        damaged = bytearray(data)
        for _ in range(rng.randrange(1, 6)):
            damaged[rng.randrange(len(damaged))] = rng.randrange(256)
        file.write_bytes(damaged)
        recorded, said = read_or_refused(file)
        assert "\n" not in said
        assert all(len(column) for stream in recorded.streams for column in stream.columns.values())


@pytest.mark.parametrize(
    ("name", "said"),
    [("a.bag", "no bag of ROS 1"), ("a.mcap", "no MCAP file"), ("a.db3", "no database of a ROS 2 bag")],
)
@pytest.mark.parametrize("held", [b"", b"something else entirely, and long enough to be read"])
def test_a_file_that_is_no_bag_is_refused(tmp_path: Path, name: str, said: str, held: bytes) -> None:
    file = tmp_path / name
    file.write_bytes(held)
    with pytest.raises(LogError, match=said):
        read_bag([file])


def test_an_mcap_of_json_is_refused_with_its_encoding(tmp_path: Path) -> None:
    def words(*said: str) -> bytes:
        return b"".join(struct.pack("<I", len(word)) + word.encode() for word in said)

    def record(kind: int, content: bytes) -> bytes:
        return struct.pack("<BQ", kind, len(content)) + content

    file = tmp_path / "web.mcap"
    schema = struct.pack("<H", 1) + words("Depth", "jsonschema", "{}")
    channel = struct.pack("<HH", 1, 1) + words("/depth", "json") + struct.pack("<I", 0)
    message = struct.pack("<HIQQ", 1, 0, START_NS, START_NS) + b'{"depth": 1}'
    records = (
        record(1, words("", "")),
        record(3, schema),
        record(4, channel),
        record(5, message),
        record(15, b""),
    )
    file.write_bytes(b"\x89MCAP0\r\n" + b"".join(records))
    with pytest.raises(
        LogError, match="Topic /depth is in json, which is not read; only messages of ROS are"
    ):
        read_bag([file])


def test_the_parts_of_a_bag_follow_each_other_by_number(tmp_path: Path) -> None:
    parts = []
    for number in (2, 10):
        (tmp_path / str(number)).mkdir()
        messages = swim(ROS2, 10)[(number > 2) * 15 : 15 + (number > 2) * 15]
        made = write_bag(tmp_path / str(number), "mcap", messages)
        parts.append(made.rename(tmp_path / f"run_{number}.mcap"))
    assert list(bag_files(tmp_path)) == parts
    assert (
        topics(read_bag(parts))["/imu"].columns["angular_velocity.z"].tolist() == (np.arange(10) / 8).tolist()
    )


def test_without_the_library_the_way_to_install_it_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = write_bag(tmp_path, "mcap", swim(ROS2, 2))
    real = importlib.import_module

    def lacking(name: str) -> Any:
        if name.startswith("rosbags"):
            raise ModuleNotFoundError(name=name)
        return real(name)

    monkeypatch.setattr("identify.ingest.files.optional_libraries.import_module", lacking)
    with pytest.raises(
        LogError, match=r"needs rosbags, which is not installed; pip install 'seatrial\[bags\]'"
    ):
        read_bag([file])
