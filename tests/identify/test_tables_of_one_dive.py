"""A folder that holds one dive in several tables, as exports of a log write a file a topic."""

import gzip

import numpy as np
import pytest
from turning_vehicle import readings

from bridge.errors import LogError
from identify.ingest.files.tables_of_one_dive import tables_of_one_dive, topic_names
from identify.ingest.mapping.proposal_of_runs import propose
from identify.ingest.open import read_dive, read_streams
from identify.run.recordings import runs_in
from tui.cli import main

READ = readings()


def written(path, columns):
    """A table of columns, gzipped if its name says so; NaN is an empty cell."""
    rows = [
        ",".join("" if np.isnan(cell) else f"{cell:.9g}" for cell in row)
        for row in np.column_stack([*columns.values()])
    ]
    text = "\n".join([",".join(columns), *rows, ""])
    path.write_bytes(gzip.compress(text.encode()) if path.suffix == ".gz" else text.encode())


def dive_in(folder):
    """A dive in two tables of other rates, with an empty cell where one has no sample."""
    sway = READ["velocity"][::2, 1].copy()
    sway[5] = np.nan
    surge, heave = READ["velocity"][::2, 0], READ["velocity"][::2, 2]
    dvl = {"t": READ["t"][::2], "u_m_s": surge, "v_m_s": sway, "w_m_s": heave}
    pwm = {"t": READ["t"], **{f"thruster_{k + 1}": READ["pulses"][:, k] for k in range(2)}}
    written(folder / "dvl_20260110_192211.csv", dvl)
    written(folder / "thrusters_20260110_192215.csv.gz", pwm)
    return folder


def test_tables_with_other_columns_are_one_dive_with_a_topic_each(tmp_path):
    folder = dive_in(tmp_path)
    assert runs_in(folder) == [folder]
    proposal = propose(read_streams(folder).streams, folder)
    assert proposal.columns.velocity.columns == ("dvl.u_m_s", "dvl.v_m_s", "dvl.w_m_s")
    assert proposal.columns.pwm.columns == ("thrusters.thruster_1", "thrusters.thruster_2")
    assert main(["import", str(folder), "--map", str(folder / "columns.yaml")]) == 0
    dive = read_dive(folder)
    assert len(dive.pwm) == len(READ["t"])
    assert len(dive.velocity) == len(READ["t"][::2])
    assert dive.pwm.value == pytest.approx(READ["pulses"][:, :2], rel=1e-6)


def test_tables_of_the_same_columns_are_runs_and_what_has_no_time_is_no_topic(tmp_path):
    dive_in(tmp_path)
    (tmp_path / "notes.txt").write_text("wind from the west\n")
    written(tmp_path / "gains.csv", {"kp": np.ones(3), "ki": np.zeros(3)})
    assert [file.name for file in tables_of_one_dive(tmp_path)] == [
        "dvl_20260110_192211.csv",
        "thrusters_20260110_192215.csv.gz",
    ]
    assert "Left out, since no column is named a time: gains.csv, notes.txt." in read_streams(tmp_path).notes
    written(tmp_path / "dvl_20260110_200000.csv", {"t": READ["t"], "u_m_s": READ["t"], "v_m_s": READ["t"]})
    assert tables_of_one_dive(tmp_path) == []
    with pytest.raises(LogError, match="is no dive folder, but holds"):
        read_streams(tmp_path)


def test_a_topic_has_the_name_of_its_table_without_the_recordings_number_where_that_tells_it_from_others(
    tmp_path,
):
    assert topic_names([tmp_path / "nav_3.csv", tmp_path / "wrench_3.csv.gz"]) == ["nav", "wrench"]
    assert topic_names([tmp_path / "imu_0.csv", tmp_path / "imu_1.csv"]) == ["imu_0", "imu_1"]


def test_a_folder_of_topics_is_a_dive_folder_as_it_is(tmp_path, capsys):
    folder = dive_in(tmp_path)
    assert main(["import", str(folder), "--map", str(folder / "columns.yaml")]) == 0
    assert main(["import", str(folder)]) == 0
    assert main(["import", str(folder), "--out", str(tmp_path / "made")]) == 2
    assert "is a dive folder as it is" in capsys.readouterr().err
