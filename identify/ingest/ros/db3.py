"""Reads the messages of a ROS 2 bag's `.db3`, a database, also of one that is cut."""

import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from urllib.parse import quote

from bridge.errors import LogError
from identify.ingest.ros.recorded import CutOff, Message, Topic, Wanted, unpacked_message

MAGIC = b"SQLite format 3\0"


def read_db3(path: Path, wanted: Wanted) -> Iterator[Message]:
    """Messages of the wanted topics, as they were written. Raises CutOff, LogError (see `recorded.Reader`)."""
    with path.open("rb") as file:
        if file.read(len(MAGIC)) != MAGIC:
            raise LogError("is no database of a ROS 2 bag; check the file", path)
    with closing(sqlite3.connect(f"file:{quote(str(path))}?immutable=1", uri=True)) as database:
        try:
            topics = _topics(database, wanted)
            asked = database.execute("SELECT topic_id, timestamp, data FROM messages ORDER BY id")
            for number, time_ns, data in asked:
                if number in topics and isinstance(data, bytes) and isinstance(time_ns, int):
                    yield topics[number], time_ns, unpacked_message(data, path)
        except sqlite3.Error:
            raise CutOff from None


def _topics(database: sqlite3.Connection, wanted: Wanted) -> dict[int, Topic]:
    """The wanted topics by number. Bags up to ROS 2 Humble hold no definitions of their types."""
    has_definitions = database.execute("SELECT name FROM sqlite_master WHERE name = 'message_definitions'")
    definitions = {}
    if has_definitions.fetchone():
        rows = database.execute(
            "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
        )
        definitions = {kind: ("idl" if "idl" in form else "msg", text) for kind, form, text in rows if text}
    rows = database.execute("SELECT id, name, type, serialization_format FROM topics")
    topics = {
        number: Topic(name, kind, encoding, *definitions.get(kind, ("", "")))
        for number, name, kind, encoding in rows
    }
    return {number: topic for number, topic in topics.items() if wanted(topic)}
