"""The fields of message types, as bags define them, or as ROS itself does."""

import re
from functools import lru_cache
from pathlib import Path
from typing import Any

from bridge.errors import LogError
from bridge.files import read_small
from identify.ingest.files.optional_libraries import library
from identify.ingest.ros.recorded import EXTRA, Topic

Fields = list[tuple[str, Any]]
"""Name and description of each field of a type, as the library rosbags has them."""
Types = dict[str, Fields]

LARGE = re.compile(r"Image|PointCloud|Compressed|Video|OccupancyGrid|Costmap|Marker|Mesh|LaserScan")
"""In the names of types without signals of a vehicle, which fill most of a bag."""
_OLD_IDL = "=" * 80 + "\n"
_CONSTANT = re.compile(r"^[ \t]*\S+[ \t]+\w+[ \t]*=.*$", re.MULTILINE)


def is_large(topic: Topic) -> bool:
    return bool(LARGE.search(topic.type.rpartition("/")[2]))


def full_type(name: str) -> str:
    """`sensor_msgs/msg/Imu` for the `sensor_msgs/Imu` of ROS 1."""
    package, _, last = name.rpartition("/")
    return name if package.endswith(("/msg", "/action", "/srv")) else f"{package}/msg/{last}"


def types_of(topic: Topic, path: Path) -> Types:
    """The types that a topic's type is made of, itself included, by name.

    The bag's own definition comes first, then those in files next to the bag, then those of ROS. Types defined nowhere
    are missing. Raises LogError for a file that defines nothing, or if the library is missing.
    """
    known = _of_ros(topic.encoding, path) | _of_files(path)
    if topic.definition:
        typesys = library("rosbags.typesys", EXTRA, path)
        try:
            if topic.language == "msg":
                held = typesys.get_types_from_msg(_of_fields_alone(topic.definition), full_type(topic.type))
            else:
                held = {}
                for part in topic.definition.split(_OLD_IDL):
                    text = part.partition("\n")[2] if part.startswith("IDL: ") else part
                    held |= typesys.get_types_from_idl(text) if text.strip() else {}
        except (typesys.TypesysError, RecursionError):
            return {}
        known |= {name: fields for name, (_, fields) in held.items()}
    return known


def _of_fields_alone(definition: str) -> str:
    """A definition without its constants, which no message holds. The library takes one whose name has small letters,
    as ROS allows, for a field, and then finds no field of a message at its place."""
    return _CONSTANT.sub("", definition)


def definition_file(kind: str) -> str:
    """Where the definition of a type is looked for, from the folder of a bag on: as ROS packages have it."""
    return f"{kind}.msg"


def files_beside(path: Path) -> list[Path]:
    """The files that define types, as `our_msgs/msg/Dvl.msg`, beside a file of a bag, or beside its folder, as a bag of
    ROS 2 is one. Those nearest come last."""
    folders = (path.parent.parent, path.parent) if path.suffix != ".bag" else (path.parent,)
    return [file for folder in folders for file in sorted(folder.glob(definition_file("*/msg/*")))]


def _of_files(path: Path) -> Types:
    """The types that files beside a bag define."""
    known: Types = {}
    for file in files_beside(path):
        typesys = library("rosbags.typesys", EXTRA, path)
        try:
            held = typesys.get_types_from_msg(
                _of_fields_alone(read_small(file)), f"{file.parts[-3]}/msg/{file.stem}"
            )
        except (typesys.TypesysError, RecursionError, UnicodeDecodeError, OSError) as error:
            raise LogError(f"can't be read as the definition of a type ({error}); mend it", file) from None
        known |= {name: fields for name, (_, fields) in held.items()}
    return known


@lru_cache
def _of_ros(encoding: str, path: Path) -> Types:
    """Types that come with ROS. A bag of ROS 2 without definitions is none of a release after Humble."""
    typesys = library("rosbags.typesys", EXTRA, path)
    store = typesys.Stores.ROS1_NOETIC if encoding == "ros1" else typesys.Stores.ROS2_HUMBLE
    return {name: fields for name, (_, fields) in typesys.get_typestore(store).fielddefs.items()}
