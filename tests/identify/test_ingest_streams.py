"""Dives of foreign files: what a column map makes of their streams, and the folders that hold them."""

import subprocess
import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from bags_made import FORMS, LATE_NS, ROS2, START_NS, STEP_NS, store_of, swim, write_bag
from built_recordings import npz

from bridge import exit_codes
from bridge.errors import LogError
from gcs_plugin.dives.recordings import MADE_ELSEWHERE, recordings
from identify.batch.recordings import find_recordings, name_of
from identify.ingest.open import FORMS as SAID_FORMS
from identify.ingest.open import MAPPED, date_of, read_dive, read_streams, recording_files
from identify.ingest.ros.recorded import ZSTD as ZSTD_MODULE
from identify.ingest.same_dive import SAME, of_one_dive
from tui import cli

ZSTD = import_module(ZSTD_MODULE)
COUNT = 100
ROWS = np.arange(COUNT)
SWIM = """
time: {column: stamp}
velocity: {columns: [/dvl/twist.twist.linear.x, /dvl/twist.twist.linear.y, "-"], unit: m/s}
gyro: {columns: ["-", "-", /imu.angular_velocity.z], unit: deg/s}
pwm: {columns: [/thrusters.data.0, /thrusters.data.1], unit: us}
"""


def column_map(tmp_path: Path, text: str = SWIM) -> Path:
    (tmp_path / "map.yaml").write_text(text, encoding="utf-8")
    return tmp_path / "map.yaml"


def bag(tmp_path: Path, form: str = "mcap") -> Path:
    return write_bag(tmp_path, form, swim(store_of(form), COUNT))


@pytest.mark.parametrize("form", FORMS)
def test_signals_of_a_bag_have_the_times_of_their_topics(tmp_path: Path, form: str) -> None:
    dive = read_dive(bag(tmp_path, form), column_map(tmp_path))
    assert dive.velocity.time_s == pytest.approx(ROWS * (STEP_NS * 1e-9), abs=1e-6)
    assert dive.pwm.time_s == pytest.approx(ROWS * (STEP_NS * 1e-9) + LATE_NS * 1e-9, abs=1e-6)
    assert dive.velocity.value[:, 0].tolist() == (ROWS / 64).tolist()
    assert dive.velocity.value[:, 2].tolist() == [0.0] * COUNT
    assert dive.gyro.value[:, 2] == pytest.approx(np.radians(ROWS / 8))
    assert dive.counts == {"rows of /imu": COUNT, "rows of /thrusters": COUNT, "rows of /dvl/twist": COUNT}


def test_a_bag_is_dated_by_its_times(tmp_path: Path) -> None:
    dive = read_dive(bag(tmp_path), column_map(tmp_path))
    assert dive.unix_at_boot_s == START_NS * 1e-9
    assert date_of(dive)[0] == pytest.approx(START_NS * 1e-9)


def test_a_file_of_another_clock_keeps_its_times(tmp_path: Path) -> None:
    path = npz(tmp_path, t=ROWS + 40.0, u=ROWS / 64)
    dive = read_dive(
        path, column_map(tmp_path, "time: {column: t}\nvelocity: {columns: [u, '-', '-'], unit: m/s}\n")
    )
    assert dive.velocity.time_s[0] == 40.0
    assert dive.unix_at_boot_s is None
    assert dive.name == "made"


@pytest.mark.parametrize(
    ("line", "said"),
    [
        (
            "velocity: {columns: [/dvl/twist.twist.linear.x, /imu.linear_acceleration.y, '-'], unit: m/s}",
            "velocity is made of columns of /dvl/twist and /imu, which have times of their own",
        ),
        ("velocity: {columns: ['-', '-', '-'], unit: m/s}", "velocity names no column"),
        (
            "depth: {columns: [/dvl/twist.linear.z], unit: m}",
            "has no column '/dvl/twist.linear.z'; near it are ",
        ),
    ],
)
def test_a_map_that_does_not_fit_the_bag_is_refused_in_a_sentence(
    tmp_path: Path, line: str, said: str
) -> None:
    with pytest.raises(LogError, match=said):
        read_dive(bag(tmp_path), column_map(tmp_path, f"time: {{column: stamp}}\n{line}\n"))


def test_of_many_columns_at_most_ten_near_the_missing_are_named(tmp_path: Path) -> None:
    path = npz(tmp_path, t=ROWS * 1.0, **{f"thruster_{k}": ROWS * 1.0 for k in range(100)})
    with pytest.raises(LogError) as refused:
        read_dive(
            path, column_map(tmp_path, "time: {column: t}\ndepth: {columns: [thruster_101], unit: m}\n")
        )
    named = str(refused.value).partition("near it are ")[2].partition(":")[0].split(", ")
    assert named[0] == "thruster_11"
    assert len(named) == 10
    with pytest.raises(LogError, match=r"it has t, thruster_0, .* and 91 more: mend"):
        read_dive(path, column_map(tmp_path, "time: {column: t}\ndepth: {columns: [QQQ], unit: m}\n"))


def test_a_topic_without_the_time_column_is_named(tmp_path: Path) -> None:
    text = SWIM.replace("stamp", "layout.data_offset")
    with pytest.raises(LogError, match=r"topic /imu has no column 'layout.data_offset'; near it are|it has"):
        read_dive(bag(tmp_path), column_map(tmp_path, text))


def test_times_that_run_backwards_are_sorted_and_said(tmp_path: Path) -> None:
    t = ROWS * 1.0
    t[[10, 11]], t[50] = t[[11, 10]], t[49]
    path = npz(tmp_path, t=t, u=ROWS / 64)
    dive = read_dive(
        path, column_map(tmp_path, "time: {column: t}\nvelocity: {columns: [u, '-', '-'], unit: m/s}\n")
    )
    assert (np.diff(dive.velocity.time_s) > 0).all()
    assert dive.velocity.value[[9, 10, 11], 0].tolist() == [9 / 64, 11 / 64, 10 / 64]
    assert len(dive.velocity) == COUNT - 1
    assert "The times run backwards once: the rows were sorted." in dive.notes
    assert "1 row without a time of its own was left out." in dive.notes


def test_a_clock_that_begins_anew_is_refused_and_rows_that_come_late_are_sorted(tmp_path: Path) -> None:
    text = column_map(tmp_path, "time: {column: t}\nvelocity: {columns: [u, '-', '-'], unit: m/s}\n")
    t = np.arange(COUNT) / 10.0
    twice = npz(tmp_path, t=np.concatenate([t, t + 0.05]), u=np.arange(2.0 * COUNT))
    with pytest.raises(LogError, match=r"its clock falls back from 9.90 to 0.05 s and goes on from there"):
        read_dive(twice, text)
    late = np.concatenate([t[:20], t[80:], t[20:80]])
    dive = read_dive(npz(tmp_path, t=late, u=late), text)
    assert dive.velocity.value[:, 0].tolist() == t.tolist()


TWO = """
time: {column: t}
velocity: {columns: [dvl.u, "-", "-"], unit: m/s}
gyro: {columns: ["-", "-", imu.r], unit: rad/s}
"""


def two_clocks(tmp_path: Path, apart_s: float) -> Path:
    from scipy.io import savemat

    held = {
        "dvl": {"t": ROWS * 0.1, "u": ROWS / 64},
        "imu": {"t": ROWS[:50] * 0.1 + apart_s, "r": ROWS[:50] / 8},
    }
    savemat(tmp_path / "two.mat", held)
    return tmp_path / "two.mat"


def test_topics_on_two_clocks_are_refused_with_both_spans(tmp_path: Path) -> None:
    said = (
        r"dvl runs from 0\.0 to 9\.9 s and imu from 1700000000\.0 to 1700000004\.9 s: they are on two clocks"
    )
    with pytest.raises(LogError, match=said):
        read_dive(two_clocks(tmp_path, 1.7e9), column_map(tmp_path, TWO))


def test_topics_without_a_time_in_common_are_said_with_both_spans(tmp_path: Path) -> None:
    dive = read_dive(two_clocks(tmp_path, 60.0), column_map(tmp_path, TWO))
    said = "dvl runs from 0.0 to 9.9 s and imu from 60.0 to 64.9 s: they have no time in common"
    assert any(note.startswith(said) for note in dive.notes)
    overlapping = read_dive(two_clocks(tmp_path, 6.0), column_map(tmp_path, TWO))
    assert not any("in common" in note for note in overlapping.notes)


def test_words_are_no_signal(tmp_path: Path) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    path = tmp_path / "made.parquet"
    pq.write_table(pa.table({"t": ROWS * 1.0, "mode": ["auto"] * COUNT}), path)
    with pytest.raises(LogError, match="column 'mode' holds words, and a signal is numbers"):
        read_dive(path, column_map(tmp_path, "time: {column: t}\ndepth: {columns: [mode], unit: m}\n"))


@pytest.mark.parametrize("ending", MAPPED)
def test_every_form_asks_for_its_column_map(tmp_path: Path, ending: str) -> None:
    (tmp_path / f"dive{ending}").write_bytes(b"t,u\n0,1\n")
    with pytest.raises(LogError, match=rf"a {ending} needs a column map; give one with --columns FILE"):
        read_dive(tmp_path / f"dive{ending}")


def test_the_folder_of_a_ros_2_bag_is_read(tmp_path: Path) -> None:
    folder = bag(tmp_path).parent
    assert read_dive(folder, column_map(tmp_path)).velocity.value[:, 0].tolist() == (ROWS / 64).tolist()
    assert [stream.name for stream in read_streams(folder).streams] == ["/imu", "/thrusters", "/dvl/twist"]
    assert [recording.path for recording in find_recordings([str(tmp_path)]).recordings] == [folder]


def test_a_bag_in_parts_needs_no_metadata_as_its_recorder_may_have_been_killed(tmp_path: Path) -> None:
    file = bag(tmp_path)
    folder = file.parent
    parts = [folder / "swim_0.mcap", folder / "swim_1.mcap"]
    for part in parts:
        part.write_bytes(file.read_bytes())
    file.unlink()
    (folder / "metadata.yaml").unlink()
    assert recording_files(folder) == parts


@pytest.mark.parametrize("form", ["mcap", "db3"])
def test_a_bag_whose_parts_are_packed_is_read_as_if_they_were_not(tmp_path: Path, form: str) -> None:
    file = bag(tmp_path, form)
    plain = read_dive(file, column_map(tmp_path)).velocity.value
    folder, layout, made = file.parent, column_map(tmp_path), tmp_path / "dive"
    (folder / f"bag_0.{form}.zstd").write_bytes(ZSTD.compress(file.read_bytes()))
    file.unlink()
    assert read_dive(folder / f"bag_0.{form}.zstd", layout).velocity.value.tolist() == plain.tolist()
    assert cli.main(["import", str(folder), "--columns", str(layout), "--out", str(made)]) == exit_codes.DONE
    assert recordings(made) == [made / f"telemetry.{form}.zstd"]
    assert read_dive(made).velocity.value.tolist() == plain.tolist()


@pytest.mark.parametrize("form", ["mcap", "db3"])
def test_of_a_packed_bag_that_is_cut_the_beginning_is_read(tmp_path: Path, form: str) -> None:
    file = write_bag(tmp_path, form, swim(ROS2, 10 * COUNT))
    packed = file.with_name(f"bag_0.{form}.zstd")
    data = ZSTD.compress(file.read_bytes())
    packed.write_bytes(data[: len(data) * 3 // 4])
    file.unlink()
    recorded = read_streams(packed)
    assert {stream.name for stream in recorded.streams} == {"/imu", "/thrusters", "/dvl/twist"}
    assert f"{packed.name} is cut off or damaged: all that is whole was read." in recorded.notes
    packed.write_bytes(data[:20])
    with pytest.raises(LogError, match=r"is cut off or damaged before its first message with numbers"):
        read_streams(packed)


def test_what_a_killed_recorder_of_ros_1_leaves_is_read(tmp_path: Path) -> None:
    file = bag(tmp_path, "bag")
    left = file.with_name("swim.bag.active")
    left.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    assert 20 < len(read_dive(left, column_map(tmp_path)).velocity) < COUNT


def test_a_folder_of_two_bags_is_no_dive(tmp_path: Path) -> None:
    file = bag(tmp_path)
    (tmp_path / "one.mcap").write_bytes(file.read_bytes())
    (tmp_path / "two.mcap").write_bytes(file.read_bytes())
    with pytest.raises(
        LogError, match=r"holds several recordings \(one\.mcap, two\.mcap\); name one of them"
    ):
        recording_files(tmp_path)


@pytest.mark.parametrize("form", ["bag", "mcap", "db3"])
def test_import_makes_a_dive_folder_that_is_read_without_naming_the_map(
    tmp_path: Path, form: str, capsys: pytest.CaptureFixture[str]
) -> None:
    file, layout, made = bag(tmp_path, form), column_map(tmp_path), tmp_path / "dive"
    assert cli.main(["import", str(file), "--columns", str(layout), "--out", str(made)]) == exit_codes.DONE
    assert f"filed in {made}" in capsys.readouterr().out
    assert (made / f"telemetry.{form}").read_bytes() == file.read_bytes()
    assert recordings(made) == recording_files(made) == [made / f"telemetry.{form}"]
    assert read_dive(made).velocity.value.tolist() == read_dive(file, layout).velocity.value.tolist()
    assert of_one_dive(recording_files(made), recording_files(file)) == SAME


def test_import_copies_every_part_of_a_bag(tmp_path: Path) -> None:
    folder = tmp_path / "bag"
    bag(tmp_path)
    (folder / "bag.mcap").unlink()
    for number, part in enumerate(("early", "late")):
        (tmp_path / part).mkdir()
        half = swim(ROS2, COUNT)[number * 150 : (number + 1) * 150]
        write_bag(tmp_path / part, "mcap", half).rename(folder / f"bag_{number}.mcap")
    layout, made = column_map(tmp_path), tmp_path / "dive"
    assert cli.main(["import", str(folder), "--columns", str(layout), "--out", str(made)]) == exit_codes.DONE
    assert [file.name for file in recording_files(made)] == ["telemetry.mcap", "telemetry.2.mcap"]
    assert read_dive(made).velocity.value[:, 0].tolist() == (ROWS / 64).tolist()


def test_two_bags_are_one_dive_only_if_they_are_the_same(tmp_path: Path) -> None:
    (tmp_path / "other").mkdir()
    first = [bag(tmp_path)]
    other = [write_bag(tmp_path / "other", "mcap", swim(ROS2, COUNT - 1))]
    assert of_one_dive(first, first) == SAME
    assert of_one_dive(first, other) == ""
    (tmp_path / "half.mcap").write_bytes(first[0].read_bytes()[:5000])
    assert of_one_dive([tmp_path / "half.mcap"], first) == ""


def test_all_lists_of_forms_agree() -> None:
    assert set(MADE_ELSEWHERE) == {".bin", *MAPPED}
    assert [ending for ending in MAPPED if ending not in SAID_FORMS] == []
    assert [name_of(Path(f"lake{ending}")) for ending in MAPPED] == ["lake"] * len(MAPPED)


def test_opening_recordings_loads_no_library_of_another_form() -> None:
    heavy = ("rosbags", "pyulog", "pyarrow", "h5py", "lz4", "scipy.io")
    code = f"import sys, identify.ingest.open; print([name for name in {heavy!r} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
