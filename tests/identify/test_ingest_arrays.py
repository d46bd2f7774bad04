"""Files of named arrays, of NumPy, MATLAB and Parquet, as streams."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from built_recordings import npz
from scipy.io import savemat

from bridge.errors import LogError
from identify.ingest.files.arrays import read_npz
from identify.ingest.files.matlab import read_matlab
from identify.ingest.files.parquet import read_parquet
from identify.ingest.files.streams import Streams

TIME_S = np.arange(20) / 10
VELOCITY = np.column_stack([TIME_S, -TIME_S, 0 * TIME_S])


def columns(recorded: Streams) -> dict[str, dict[str, list[float]]]:
    return {
        stream.name: {name: values.tolist() for name, values in stream.columns.items()}
        for stream in recorded.streams
    }


def mat(tmp_path: Path, **held: Any) -> Path:
    savemat(tmp_path / "made.mat", held)
    return tmp_path / "made.mat"


def test_arrays_of_one_length_are_one_table(tmp_path: Path) -> None:
    read = columns(read_npz(npz(tmp_path, t=TIME_S, velocity=VELOCITY, armed=TIME_S > 1, mass=11.5)))
    assert list(read) == [""]
    assert read[""]["t"] == TIME_S.tolist()
    assert read[""]["velocity.1"] == (-TIME_S).tolist()
    assert read[""]["armed"] == (TIME_S > 1).astype(float).tolist()
    assert set(read[""]) == {"t", "velocity.0", "velocity.1", "velocity.2", "armed"}


def test_the_longer_side_of_an_array_is_time(tmp_path: Path) -> None:
    read = columns(read_npz(npz(tmp_path, t=TIME_S[None, :], velocity=VELOCITY.T)))
    assert read[""]["velocity.0"] == TIME_S.tolist()
    assert read[""]["t"] == TIME_S.tolist()


def test_a_long_array_that_holds_a_whole_run_is_read_and_a_wide_image_is_not(tmp_path: Path) -> None:
    run = np.arange(24 * 240.0).reshape(240, 24)
    recorded = read_npz(npz(tmp_path, t=np.arange(240.0), run=run, image=run[:200], wide=np.zeros((900, 65))))
    read = columns(recorded)
    assert read[""]["run.23"] == run[:, 23].tolist()
    assert recorded.notes == ("Not read, as they are no arrays of numbers over time: image, wide.",)


def test_dates_are_unix_seconds(tmp_path: Path) -> None:
    dates = np.array(["2026-01-01T00:00:00.5", "NaT", "2026-01-01T00:00:01.5"], "datetime64[ns]")
    read = columns(read_npz(npz(tmp_path, t=dates)))[""]["t"]
    assert [read[0], read[2]] == [1767225600.5, 1767225601.5]
    assert np.isnan(read[1])


def test_arrays_of_two_lengths_are_two_streams(tmp_path: Path) -> None:
    read = columns(read_npz(npz(tmp_path, t=TIME_S, u=TIME_S, tf=TIME_S[:5], f=TIME_S[:5])))
    assert {name: set(held) for name, held in read.items()} == {
        "length20": {"t", "u"},
        "length5": {"tf", "f"},
    }


def test_images_words_and_objects_are_left_out_and_named(tmp_path: Path) -> None:
    made = npz(
        tmp_path,
        t=TIME_S,
        pixels=np.zeros((20, 40)),
        words=np.array(["a", "b"]),
        any=np.array([{}, 3], object),
    )
    recorded = read_npz(made)
    assert set(columns(recorded)[""]) == {"t"}
    assert recorded.notes == ("Not read, as they are no arrays of numbers over time: pixels, words, any.",)


def test_structs_of_different_lengths_are_streams_with_their_names(tmp_path: Path) -> None:
    dvl = {"t": TIME_S, "v": VELOCITY, "info": {"rate": 10.0}}
    imu = {"t": TIME_S[:7], "gyro": {"x": TIME_S[:7], "z": 2 * TIME_S[:7]}}
    read = columns(read_matlab(mat(tmp_path, log={"dvl": dvl, "imu": imu}, vehicle="test")))
    assert set(read) == {"log.dvl", "log.imu"}
    assert set(read["log.dvl"]) == {"t", "v.0", "v.1", "v.2"}
    assert read["log.imu"]["gyro.z"] == (2 * TIME_S[:7]).tolist()


def test_structs_of_one_length_are_one_table(tmp_path: Path) -> None:
    read = columns(read_matlab(mat(tmp_path, time=TIME_S, signals=[{"values": TIME_S}, {"values": -TIME_S}])))
    assert read == {
        "": {
            "time": TIME_S.tolist(),
            "signals.0.values": TIME_S.tolist(),
            "signals.1.values": (-TIME_S).tolist(),
        }
    }


def test_structs_within_one_are_a_table_with_its_name_so_that_names_are_known(tmp_path: Path) -> None:
    read = columns(read_matlab(mat(tmp_path, log={"dive": {"t": TIME_S, "u": TIME_S, "imu": {"r": TIME_S}}})))
    assert {name: set(held) for name, held in read.items()} == {"log.dive": {"t", "u", "imu.r"}}
    alone = columns(read_matlab(mat(tmp_path, log={"u": TIME_S})))
    assert {name: set(held) for name, held in alone.items()} == {"log": {"u"}}


def test_matlab_7_3_is_read_as_older_versions_are(tmp_path: Path) -> None:
    path = tmp_path / "new.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        group = file.create_group("dvl")
        group["t"], group["v"] = TIME_S[None, :], VELOCITY.T
        file["imu/t"] = TIME_S[None, :7]
        file["#refs#/a"] = TIME_S[:3]
        words = file.create_dataset("name", data=np.array([[116], [101]], np.uint16))
        words.attrs["MATLAB_class"] = np.bytes_("char")
    read = columns(read_matlab(path))
    old = columns(read_matlab(mat(tmp_path, dvl={"t": TIME_S, "v": VELOCITY}, imu={"t": TIME_S[:7]})))
    assert read == old
    assert set(read) == {"dvl", "imu"}


def test_a_parquet_table_keeps_what_is_empty_apart_from_what_is_unknown(tmp_path: Path) -> None:
    path = tmp_path / "made.parquet"
    held = {
        "t": pa.array([0, 1_500, None], pa.timestamp("ms")),
        "u": pa.array([1.0, float("nan"), None]),
        "on": pa.array([True, None, False]),
        "n": pa.array([1, 2, 3], pa.int32()),
        "v": pa.array([{"x": 1.0}, {"x": 2.0}, {"x": 3.0}]),
        "mode": pa.array(["manual", None, "auto"]),
        "kind": pa.array(["calm", "sea", None]).dictionary_encode(),
        "many": pa.array([[1], [2], [3]]),
    }
    pq.write_table(pa.table(held), path)
    recorded = read_parquet(path)
    (stream,) = recorded.streams
    assert stream.columns["t"][:2].tolist() == [0.0, 1.5]
    assert stream.columns["n"].tolist() == [1.0, 2.0, 3.0]
    assert stream.columns["v.x"].tolist() == [1.0, 2.0, 3.0]
    assert stream.columns["on"][[0, 2]].tolist() == [1.0, 0.0]
    assert np.isnan(stream.columns["u"]).tolist() == [False, True, True]
    assert {name: mask.tolist() for name, mask in recorded.empty.items()} == {
        "t": [False, False, True], "u": [False, False, True], "on": [False, True, False],
    }  # fmt: skip
    assert stream.text == {"mode": ("manual", "", "auto"), "kind": ("calm", "sea", "")}
    assert stream.dates == {"t"}
    assert recorded.notes == ("Not read, as they are no columns of numbers: many.",)


def parquet(tmp_path: Path) -> Path:
    pq.write_table(pa.table({"t": TIME_S}), tmp_path / "made.parquet")
    return tmp_path / "made.parquet"


def hdf5(tmp_path: Path) -> Path:
    with h5py.File(tmp_path / "new.mat", "w", userblock_size=512) as file:
        file["t"] = np.random.default_rng(1).normal(size=4000)
    return tmp_path / "new.mat"


@pytest.mark.parametrize(
    ("made", "read"),
    [
        (lambda folder: npz(folder, t=TIME_S), read_npz),
        (lambda folder: mat(folder, t=TIME_S), read_matlab),
        (hdf5, read_matlab),
        (parquet, read_parquet),
    ],
    ids=["npz", "mat", "mat 7.3", "parquet"],
)
@pytest.mark.parametrize("share", [0.0, 0.02, 0.3, 0.6, 0.95])
def test_a_file_that_is_cut_is_refused_in_a_sentence(
    tmp_path: Path, made: Any, read: Any, share: float
) -> None:
    path = made(tmp_path)
    data = path.read_bytes()
    path.write_bytes(data[: int(share * len(data))])
    with pytest.raises(LogError, match=r"made|new") as refused:
        read(path)
    assert str(refused.value).startswith(f"{path}: ")
    assert "\n" not in str(refused.value)


def test_a_file_without_arrays_is_refused(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="holds no arrays of numbers over time"):
        read_matlab(mat(tmp_path, name="test", mass=11.5))
