"""Logs of PX4, written byte by byte as its format says."""

import struct
from pathlib import Path

import numpy as np
import pytest

from bridge.errors import LogError
from identify.ingest.files.streams import Stream, Streams
from identify.ingest.files.ulog import read_ulog

COUNT = 100
FORMATS = (
    "vehicle_rates:uint64_t timestamp;float[3] xyz;uint8_t[4] _padding0;",
    "outputs:uint64_t timestamp;uint16_t[17] pwm;char[8] name;int16_t level;",
)


def message(kind: str, content: bytes) -> bytes:
    return struct.pack("<HB", len(content), ord(kind)) + content


def written(path: Path) -> Path:
    parts = [
        b"ULog\x01\x12\x35\x01",
        struct.pack("<Q", 5),
        *(message("F", text.encode()) for text in FORMATS),
    ]
    subscribed = ((0, 0, "vehicle_rates"), (1, 1, "vehicle_rates"), (0, 2, "outputs"))
    parts += [
        message("A", struct.pack("<BH", instance, number) + name.encode())
        for instance, number, name in subscribed
    ]
    for k in range(COUNT):
        for number in (0, 1):
            parts.append(message("D", struct.pack("<HQfff", number, 1000 * k, k / 4, number, -0.5)))
        parts.append(message("D", struct.pack("<HQ17H8sh", 2, 1000 * k, *range(17), b"thruster", -k)))
    path.write_bytes(b"".join(parts))
    return path


def topics(recorded: Streams) -> dict[str, Stream]:
    return {stream.name: stream for stream in recorded.streams}


def test_each_topic_and_each_further_instance_is_a_stream(tmp_path: Path) -> None:
    recorded = read_ulog(written(tmp_path / "flight.ulg"))
    read = topics(recorded)
    assert set(read) == {"vehicle_rates", "vehicle_rates_1", "outputs"}
    assert read["vehicle_rates"].columns["xyz.0"].tolist() == (np.arange(COUNT) / 4).tolist()
    assert read["vehicle_rates_1"].columns["xyz.1"].tolist() == [1.0] * COUNT
    assert read["vehicle_rates"].columns["timestamp"][-1] == 99_000.0
    assert read["vehicle_rates"].columns["stamp"] == pytest.approx(np.arange(COUNT) / 1000)
    assert recorded.notes == ()


def test_long_lists_and_words_are_no_columns(tmp_path: Path) -> None:
    read = topics(read_ulog(written(tmp_path / "flight.ulg")))["outputs"]
    assert set(read.columns) == {"timestamp", "stamp", "level"}
    assert read.columns["level"].tolist() == (-np.arange(COUNT)).tolist()


def test_a_log_that_is_cut_anywhere_gives_what_is_before_or_one_sentence(tmp_path: Path) -> None:
    path = written(tmp_path / "flight.ulg")
    data = path.read_bytes()
    most = 0
    for size in range(0, len(data), 97):
        path.write_bytes(data[:size])
        try:
            recorded = read_ulog(path)
        except LogError as error:
            said = str(error)
        else:
            said = f"{path}: "
            rates = topics(recorded)["vehicle_rates"].columns["xyz.0"]
            assert rates.tolist() == (np.arange(len(rates)) / 4).tolist()
            most = max(most, len(rates))
        assert said.startswith(f"{path}: ")
        assert "\n" not in said
    assert most > 0.9 * COUNT


def test_a_cut_is_said(tmp_path: Path) -> None:
    path = written(tmp_path / "flight.ulg")
    path.write_bytes(path.read_bytes()[:-5])
    assert read_ulog(path).notes == ("flight.ulg is cut off or damaged: what is intact was read.",)


@pytest.mark.parametrize("held", [b"", b"ULog", b"nothing of the kind" * 9])
def test_what_is_no_log_is_refused(tmp_path: Path, held: bytes) -> None:
    path = tmp_path / "flight.ulg"
    path.write_bytes(held)
    with pytest.raises(LogError, match=r"flight\.ulg: is no ULog"):
        read_ulog(path)
