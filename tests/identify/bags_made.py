"""Bags as ROS writes them: a turn rate, six thrusters and a velocity, the k-th message of each 10 ms after the last."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from rosbags import rosbag1, rosbag2
from rosbags.typesys import Stores, get_typestore

START_NS = 1_700_000_000_000_000_000
STEP_NS = 10_000_000
LATE_NS = 3_000_000
"""The log has a message this long after its header's time."""

ROS1, ROS2 = get_typestore(Stores.ROS1_NOETIC), get_typestore(Stores.ROS2_HUMBLE)
FORMS = ("bag", "bag.bz2", "bag.lz4", "mcap", "mcap.zstd", "db3", "db3.zstd")

Message = tuple[str, str, int, Any]
"""Topic, type, time of the log in ns, message."""


def header(store: Any, time_ns: int, frame: str) -> Any:
    time = store.types["builtin_interfaces/msg/Time"](time_ns // 10**9, time_ns % 10**9)
    number = (7,) if store is ROS1 else ()
    return store.types["std_msgs/msg/Header"](*number, time, frame)


def swim(store: Any, count: int) -> list[Message]:
    kind = {name.rpartition("/")[2]: made for name, made in store.types.items()}
    vector, layout = kind["Vector3"], kind["MultiArrayLayout"]
    messages: list[Message] = []
    for k in range(count):
        time_ns = START_NS + k * STEP_NS
        head = header(store, time_ns, "base" if k % 3 else "base_link")
        imu = kind["Imu"](
            head, kind["Quaternion"](0.0, 0.0, 0.0, 1.0), np.zeros(9), vector(0.1, 0.2, k / 8), np.arange(9.0),
            vector(0.0, 0.0, -9.8), np.zeros(9),
        )  # fmt: skip
        thrusters = kind["Float64MultiArray"](layout([], 0), np.arange(6.0) + k)
        twist = kind["TwistStamped"](head, kind["Twist"](vector(k / 64, 0.5, -0.25), vector(0.0, 0.0, 0.0)))
        log_ns = time_ns + LATE_NS
        messages += [
            ("/imu", "sensor_msgs/msg/Imu", log_ns, imu),
            ("/thrusters", "std_msgs/msg/Float64MultiArray", log_ns, thrusters),
            ("/dvl/twist", "geometry_msgs/msg/TwistStamped", log_ns, twist),
        ]
    return messages


def store_of(form: str) -> Any:
    return ROS1 if form.startswith("bag") else ROS2


def write_bag(
    folder: Path, form: str, messages: list[Message], store: Any = None, chunk_bytes: int = 4096
) -> Path:
    """The file, of a ROS 2 bag within its folder `bag`."""
    form, _, packing = form.partition(".")
    store = store or store_of(form)
    if form == "bag":
        bag = rosbag1.Writer(folder / "made.bag")
        bag.chunk_threshold = chunk_bytes
        if packing:
            bag.set_compression(bag.CompressionFormat[packing.upper()])
        with bag:
            _write(bag, messages, store, store.serialize_ros1)
        return folder / "made.bag"
    plugin = rosbag2.StoragePlugin.MCAP if form == "mcap" else rosbag2.StoragePlugin.SQLITE3
    two = rosbag2.Writer(folder / "bag", version=9, storage_plugin=plugin)
    if packing:
        mode = rosbag2.CompressionMode.STORAGE if form == "mcap" else rosbag2.CompressionMode.MESSAGE
        two.set_compression(mode, rosbag2.CompressionFormat[packing.upper()])
    with two:
        _write(two, messages, store, store.serialize_cdr)
    return folder / "bag" / f"bag.{form}"


def _write(writer: Any, messages: list[Message], store: Any, serialize: Callable[[Any, str], Any]) -> None:
    topics: dict[str, Any] = {}
    for name, kind, time_ns, message in messages:
        if name not in topics:
            topics[name] = writer.add_connection(name, kind, typestore=store)
        writer.write(topics[name], time_ns, serialize(message, kind))
