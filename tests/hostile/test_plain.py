"""YAML and JSON of others: plain values, of bounded depth and size, and a sentence for all else."""

import time

import numpy as np
import pytest
from fuzz_files import RECORDS, SIZES

from bridge.errors import ConfigError
from bridge.plain import from_json, from_yaml
from bridge.schema import load_yaml
from identify.checks.readings.impossible import tame
from identify.ingest.open import read_dive


def refused(tmp_path, text):
    path = tmp_path / "dive.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        load_yaml(path)
    said = str(caught.value)
    assert said.startswith(f"{path}: ")
    assert "\n" not in said
    return said.removeprefix(f"{path}: ")


@pytest.mark.parametrize(
    ("tag", "shown"),
    [
        ('!!python/object/apply:os.system ["touch x"]', "!!python/object/apply:os.system"),
        ("!!python/name:os.system", "!!python/name:os.system"),
        ("!!int x", "!!int"),
        ("!!set {a}", "!!set"),
        ("!mine 1", "!mine"),
        ("!<tag:yaml.org,2002:binary> aaa", "!!binary"),
    ],
)
def test_a_tag_is_named_with_its_place_and_never_followed(tmp_path, tag, shown):
    said = refused(tmp_path, f"a: 1\nnotes: {tag}\n")
    assert said == (
        f"not valid YAML at line 2, column 8 (the tag '{shown}' is not read; write the plain value); mend that line"
    )


def test_depth_is_bounded(tmp_path):
    assert from_yaml("[" * 30 + "]" * 30) is not None
    for text in ("[" * 5000, "{a: " * 5000, "- " * 5000, "[" * 31 + "]" * 31):
        assert "(it nests deeper than 30)" in refused(tmp_path, text)
    with pytest.raises(ValueError, match="nests too deeply"):
        from_json("[" * 200_000)


@pytest.mark.parametrize("text", ["1e400", "-1e400", '[{"a": 1e999}]', "9" * 301, "NaN", "[-Infinity]"])
def test_a_number_that_no_float64_holds_is_no_json_of_ours(text):
    with pytest.raises(ValueError, match="a number "):
        from_json(text)
    assert from_json("[1e308, 1e-400, -0.5]") == [1e308, 0.0, -0.5]


def test_a_name_may_be_used_again_but_not_to_stand_for_a_mountain(tmp_path):
    assert from_yaml("a: &a [1, 2]\nb: *a\n") == {"a": [1, 2], "b": [1, 2]}
    bomb = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n"
    bomb += "".join(f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 10)}]\n" for n in range(1, 9))
    before_s = time.process_time()
    assert "stands for more than 200000 values" in refused(tmp_path, bomb)
    assert "'*a' stands for what it stands in" in refused(tmp_path, "a: &a [*a]")
    assert time.process_time() - before_s < 5.0


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a" * 1_000_001, "is longer than the 1000 kB"),
        ("a: 2026-99-99", "a value in it can't be read ("),
        (f"a: {'9' * 5000}", "not valid YAML at line 1, column 4 (a number of 500"),
        (f"a: 0x{'f' * 5000}", "not valid YAML at line 1, column 4 (a number of 500"),
    ],
    ids=["size", "date", "number", "number to base 16"],
)
def test_what_no_value_of_ours_is_like_is_said(tmp_path, text, words):
    assert refused(tmp_path, text).startswith(words)


def log(name, letters, columns, count=3):
    """A DataFlash log of one record type, and one of a type that is read."""
    good = next(record[1:] for record in RECORDS if record[0] == "ATT")
    data = b""
    for kind, (title, kinds, names) in enumerate((("ATT", *good), (name, letters, columns)), 10):
        size = 3 + sum(SIZES[record] for record in kinds)
        data += b"\xa3\x95\x80" + bytes((kind, size)) + title.encode().ljust(4, b"\0")
        data += kinds.encode().ljust(16, b"\0") + names.encode().ljust(64, b"\0")
        for n in range(count):
            body = (n * 50_000).to_bytes(8, "little") if kinds[0] == "Q" else b"x" * SIZES[kinds[0]]
            data += b"\xa3\x95" + bytes((kind,)) + body + bytes(size - 3 - len(body))
    return data


@pytest.mark.parametrize(
    ("name", "letters", "columns"),
    [
        ("IMU", "Qfff", "TimeUS,GyrX,GyrX,GyrZ"),
        ("IMU", "Qfff", "TimeUS,GyrX,,GyrZ"),
        ("IMU", "QNNN", "TimeUS,GyrX,GyrY,GyrZ"),
        ("IMU", "Qafa", "TimeUS,GyrX,GyrY,GyrZ"),
        ("IMU", "Nfff", "TimeUS,GyrX,GyrY,GyrZ"),
        ("RCOU", "QNN", "TimeUS,C1,C2"),
        ("RCOU", "Qf", "TimeUS,X"),
    ],
)
def test_a_record_of_dataflash_that_is_laid_out_wrongly_is_left_out(tmp_path, name, letters, columns):
    path = tmp_path / "dive.BIN"
    path.write_bytes(log(name, letters, columns))
    dive = read_dive(path)
    assert dive.gyro is None
    assert dive.pwm is None
    assert dive.attitude.time_s == pytest.approx([0.0, 0.05, 0.1])


def test_a_second_format_of_another_length_changes_no_record(tmp_path):
    whole = log("IMU", "Qfff", "TimeUS,GyrX,GyrY,GyrZ")
    other = log("IMU", "Qffffff", "TimeUS,GyrX,GyrY,GyrZ,AccX,AccY,AccZ", 0)
    path = tmp_path / "dive.BIN"
    path.write_bytes(whole + other)
    dive = read_dive(path)
    assert dive.gyro is not None
    assert len(dive.gyro) == 3


def test_one_wild_time_in_dataflash_takes_its_own_record_alone(tmp_path):
    data = log("IMU", "Qfff", "TimeUS,GyrX,GyrY,GyrZ", 20)
    at = data.index((500_000).to_bytes(8, "little"))
    path = tmp_path / "dive.BIN"
    path.write_bytes(data[: at + 6] + b"\x01" + data[at + 7 :])
    dive = read_dive(path)
    assert dive.attitude is not None
    assert len(dive.attitude) == 19
    assert dive.span_s == pytest.approx((0.0, 0.95))


def test_a_step_of_the_clock_is_no_wild_time():
    steps = np.concatenate((np.arange(50.0), 1000.0 + np.arange(50.0)))
    assert tame(steps).all()
    steps[[0, 20, 21, 99]] = 1e12
    assert np.flatnonzero(~tame(steps)).tolist() == [0, 20, 21, 99]
