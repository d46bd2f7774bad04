"""The fields of message types, as bags define them, or as ROS itself does."""

import re
from functools import lru_cache
from pathlib import Path
from typing import Any

from identify.ingest.extras import library
from identify.ingest.ros.recorded import EXTRA, Topic

Fields = list[tuple[str, Any]]
"""Name and description of each field of a type, as the library rosbags has them."""
Types = dict[str, Fields]

LARGE = re.compile(r"Image|PointCloud|Compressed|Video|OccupancyGrid|Costmap|Marker|Mesh|LaserScan")
"""In the names of types that hold no signal of a vehicle and most of the bytes of a bag."""
_OLD_IDL = "=" * 80 + "\n"


def is_large(topic: Topic) -> bool:
    return bool(LARGE.search(topic.type.rpartition("/")[2]))


def full_type(name: str) -> str:
    """`sensor_msgs/msg/Imu` for the `sensor_msgs/Imu` of ROS 1."""
    package, _, last = name.rpartition("/")
    return name if package.endswith(("/msg", "/action", "/srv")) else f"{package}/msg/{last}"


def types_of(topic: Topic, path: Path) -> Types:
    """The types that a topic's type is made of, itself included, by name.

    Its own definition comes first, those of ROS fill in what it lacks. Types that are nowhere are missing. Raises
    LogError if the library is.
    """
    known = dict(_of_ros(topic.encoding, path))
    if topic.definition:
        typesys = library("rosbags.typesys", EXTRA, path)
        try:
            if topic.language == "msg":
                held = typesys.get_types_from_msg(topic.definition, full_type(topic.type))
            else:
                held = {}
                for part in topic.definition.split(_OLD_IDL):
                    text = part.partition("\n")[2] if part.startswith("IDL: ") else part
                    held |= typesys.get_types_from_idl(text) if text.strip() else {}
        except (typesys.TypesysError, RecursionError):
            return {}
        known |= {name: fields for name, (_, fields) in held.items()}
    return known


@lru_cache
def _of_ros(encoding: str, path: Path) -> Types:
    """Types that come with ROS. A bag of ROS 2 without definitions is none of a release after Humble."""
    typesys = library("rosbags.typesys", EXTRA, path)
    store = typesys.Stores.ROS1_NOETIC if encoding == "ros1" else typesys.Stores.ROS2_HUMBLE
    return {name: fields for name, (_, fields) in typesys.get_typestore(store).fielddefs.items()}
