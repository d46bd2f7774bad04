"""Opening a bag of ROS: from the file to a dive's arrays, compared with its library's bare iteration over the file."""

import shutil
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from rosbags import rosbag1, rosbag2
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from bench.remembered import Data, Remembered
from bench.stamp import reached, stamp
from bench.words import blocks, in_a_word, paragraph, table
from identify.ingest.open import read_dive

SOURCES = (reached("bench/speed/bags.py"),)
RATE_HZ, HOUR_S = 100, 3600
START_NS = 1_700_000_000_000_000_000
ROUNDS = 3
GOAL = 3.0
FORMS = (".bag", ".mcap", ".db3")
BARE, OURS, DECODED = "iterated bare", "`read_dive`", "decoded by the library"
MAP = """
time: {column: stamp}
velocity: {columns: [/dvl.twist.linear.x, /dvl.twist.linear.y, /dvl.twist.linear.z], unit: m/s}
gyro: {columns: [/imu.angular_velocity.x, /imu.angular_velocity.y, /imu.angular_velocity.z], unit: rad/s}
specific_force:
  columns: [/imu.linear_acceleration.x, /imu.linear_acceleration.y, /imu.linear_acceleration.z]
  unit: m/s2
quaternion: {columns: [/imu.orientation.w, /imu.orientation.x, /imu.orientation.y, /imu.orientation.z], unit: "1"}
pwm: {columns: [/thrusters.data.0, /thrusters.data.1, /thrusters.data.2, /thrusters.data.3], unit: us}
"""


def page(cache: Path) -> str:
    kept = Remembered(cache / f"bags-{stamp(*SOURCES)}.jsonl")
    return words_of({form: kept.get(form, lambda form=form: measured(form, cache)) for form in FORMS})


def measured(form: str, cache: Path) -> Data:
    """Median seconds of each way over ROUNDS turns, in which all meet the same load; the decoding takes one turn."""
    bag, columns = hour(form, cache), cache / "bags.yaml"
    columns.write_text(MAP, encoding="utf-8")
    ways: dict[str, Callable[[], int]] = {
        BARE: lambda: _bare(bag),
        OURS: lambda: sum(len(signal) for signal in read_dive(bag, columns).signals().values()),
    }
    seconds: dict[str, list[float]] = {name: [] for name in (*ways, DECODED)}
    messages = 0
    for _ in range(ROUNDS):
        for name, way in ways.items():
            began = time.perf_counter()
            count = way()
            seconds[name].append(time.perf_counter() - began)
            messages = count if name == BARE else messages
    began = time.perf_counter()
    _decoded(bag)
    seconds[DECODED].append(time.perf_counter() - began)
    medians = {name: float(np.median(each)) for name, each in seconds.items()}
    return {"bytes": bag.stat().st_size, "messages": messages, "seconds": medians}


def _bare(bag: Path) -> int:
    with AnyReader([bag]) as reader:
        return sum(1 for _ in reader.messages())


def _decoded(bag: Path) -> None:
    with AnyReader([bag]) as reader:
        for connection, _, raw in reader.messages():
            reader.deserialize(raw, connection.msgtype)


def hour(form: str, cache: Path, seconds: int = HOUR_S) -> Path:
    """A bag of that form: an inertial unit, a DVL and four thrusters, at 100 Hz each; written once."""
    folder = cache / f"bag-{seconds}-{form.removeprefix('.')}-{stamp('bench/speed/bags.py')}"
    bag = folder / "hour.bag" if form == ".bag" else folder / "hour" / f"hour{form}"
    done = folder / "whole"
    if done.exists():
        return bag
    # What a killed run left is no whole bag, and no writer goes on with it.
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    store = get_typestore(Stores.ROS1_NOETIC if form == ".bag" else Stores.ROS2_HUMBLE)
    written: dict[str, Any] = {}
    with _writer(form, folder) as writer:
        for topic, kind, time_ns, message in _messages(store, seconds):
            if topic not in written:
                written[topic] = writer.add_connection(topic, kind, typestore=store)
            serialize = store.serialize_ros1 if form == ".bag" else store.serialize_cdr
            writer.write(written[topic], time_ns, serialize(message, kind))
    done.touch()
    return bag


def _writer(form: str, folder: Path) -> Any:
    if form == ".bag":
        return rosbag1.Writer(folder / "hour.bag")
    plugin = rosbag2.StoragePlugin.MCAP if form == ".mcap" else rosbag2.StoragePlugin.SQLITE3
    return rosbag2.Writer(folder / "hour", version=9, storage_plugin=plugin)


def _messages(store: Any, seconds: int) -> Iterator[tuple[str, str, int, Any]]:
    """Topic, type, time of the log in ns, and message, in the order of their times."""
    stamp_of, header = store.types["builtin_interfaces/msg/Time"], store.types["std_msgs/msg/Header"]
    kind = {name.rpartition("/")[2]: made for name, made in store.types.items()}
    vector, number = kind["Vector3"], (0,) if "seq" in header.__dataclass_fields__ else ()
    known = np.zeros(9)
    for k in range(seconds * RATE_HZ):
        time_ns = START_NS + k * (10**9 // RATE_HZ)
        t = k / RATE_HZ
        head = header(*number, stamp_of(time_ns // 10**9, time_ns % 10**9), "base_link")
        heading = 0.3 * np.sin(0.1 * t)
        turn = kind["Quaternion"](0.0, 0.0, float(np.sin(heading / 2)), float(np.cos(heading / 2)))
        rate = vector(0.0, 0.0, float(0.03 * np.cos(0.1 * t)))
        felt = vector(0.001 * (k % 7), 0.0, -9.81)
        yield "/imu", "sensor_msgs/msg/Imu", time_ns, kind["Imu"](head, turn, known, rate, known, felt, known)
        pulses = 1500.0 + 100.0 * np.sin(t + np.arange(4.0))
        layout = kind["MultiArrayLayout"]([], 0)
        yield (
            "/thrusters",
            "std_msgs/msg/Float64MultiArray",
            time_ns,
            kind["Float64MultiArray"](layout, pulses),
        )
        twist = kind["Twist"](
            vector(float(0.4 * np.sin(0.2 * t)), 0.001 * (k % 5), 0.0), vector(0.0, 0.0, 0.0)
        )
        yield "/dvl", "geometry_msgs/msg/TwistStamped", time_ns, kind["TwistStamped"](head, twist)


def words_of(by_form: dict[str, Data]) -> str:
    messages = next(iter(by_form.values()))["messages"]
    ratios, rows = [], []
    for form, data in by_form.items():
        bare_s, ours_s, decoded_s = (data["seconds"][name] for name in (BARE, OURS, DECODED))
        ratios.append(ours_s / bare_s)
        cells = (
            f"`{form}`",
            f"{data['bytes'] / 1e6:.0f}",
            f"{bare_s:.3g}",
            f"{ours_s:.3g}",
            f"{ratios[-1]:.2g}",
            f"{decoded_s:.3g}",
        )
        rows.append(cells)
    head = ("bag", "MB", "iterated bare, s", "`read_dive`, s", "times bare", "decoded by the library, s")
    verdict = in_a_word(max(ratios) <= GOAL)
    return blocks(
        "## Opening a bag",
        paragraph(
            f"An hour of three topics at {RATE_HZ} Hz, {messages} messages, in each form: the library rosbags iterates",
            "over the messages without decoding them, and `read_dive` makes a dive of the file; each in turn in one",
            f"run, the median of {ROUNDS}. Beside them, once, all messages decoded by the library.",
        ),
        table(head, rows),
        f"Goal of {GOAL:g} times bare: {max(ratios):.2g} at most, {verdict}.",
    )
