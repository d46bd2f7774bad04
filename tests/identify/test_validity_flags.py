"""Columns that say which velocities are none, and what else sensors and ground stations write."""

from pathlib import Path

import numpy as np
import pytest
from built_recordings import of_table, write
from turning_vehicle import readings

from identify.dive import Dive
from identify.ingest.files.streams import Stream, Streams
from identify.ingest.files.text_table import read_table
from identify.ingest.mapping.column_map import ColumnMap, Columns, TimeColumn
from identify.ingest.mapping.proposal_of_runs import propose
from identify.ingest.mapping.signals import dive_fields
from identify.ingest.rotation import to_earth

MAP = "time: {column: t}\nvelocity: {columns: [vx, vy, null], unit: m/s}\n"


@pytest.mark.parametrize(("yes", "no"), [("True", "False"), ("1", "0")])
def test_a_velocity_that_its_sensor_calls_invalid_is_unknown_and_no_standstill(tmp_path, yes, no):
    rows = f"0,0.5,0.1,{yes}\n0.1,0,0,{no}\n0.2,0.6,0.2,{yes}\n"
    dive = of_table(tmp_path, f"t,vx,vy,velocity_valid\n{rows}", MAP)
    np.testing.assert_array_equal(dive.velocity.value[:, :2], [[0.5, 0.1], [np.nan] * 2, [0.6, 0.2]])
    assert "By velocity_valid, 1 of 3 velocities are none: taken for no reading." in dive.notes


def test_a_flag_that_never_says_valid_is_one_that_nothing_fills(tmp_path):
    dive = of_table(tmp_path, "t,vx,vy,velocity_valid\n0,0.5,0.1,0\n0.1,0.6,0.2,0\n0.2,0.7,0.2,0\n", MAP)
    assert np.isfinite(dive.velocity.value[:, :2]).all()


def test_plain_valid_is_the_velocity_s_in_a_topic_of_it_and_anything_s_in_a_table():
    cells = {"stamp": np.arange(3.0), "x": np.array([0.5, 0.0, 0.6]), "valid": np.array([1.0, 0.0, 1.0])}
    for topic, count in (("/dvl", 2), ("", 3)):
        stream = Stream(topic, cells, {})
        columns = ColumnMap(TimeColumn("stamp"), velocity=Columns((stream.full_name("x"), None, None), "m/s"))
        dive = Dive("log", Path(), "", **dive_fields(Streams((stream,)), columns, Path()))
        assert np.count_nonzero(np.isfinite(dive.velocity.value[:, 0])) == count


def test_a_date_with_slashes_whose_year_is_first_is_a_time(tmp_path):
    rows = "\n".join(f"2026/07/19 10:15:{k / 10:05.2f},{0.01 * k}" for k in range(100))
    read = read_table(write(tmp_path / "log.csv", f"DateTime,depth\n{rows}\n".encode()))
    proposal = propose(read.streams, tmp_path / "log.csv")
    assert proposal.columns.time == TimeColumn("DateTime", "iso")
    dive = Dive("log", Path(), "", **dive_fields(read, proposal.columns, Path()))
    assert np.diff(dive.depth.time_s) == pytest.approx(0.1, abs=1e-5)


def test_the_local_position_s_velocity_of_a_ground_station_s_table_is_turned_from_the_earth_s_axes():
    read = readings(20.0)
    earth = to_earth(read["attitude"], read["velocity"])
    columns = {"t": read["t"]} | dict(zip(("roll", "pitch", "heading"), read["euler"].T, strict=True))
    columns |= {f"localPosition.v{axis}": earth[:, k] for k, axis in enumerate("xyz")}
    stream = Stream("", columns, {})
    proposal = propose((stream,), Path("log.csv"))
    assert proposal.columns.velocity.frame == "NED"
    dive = Dive("log", Path(), "", **dive_fields(Streams((stream,)), proposal.columns, Path()))
    assert dive.velocity.value == pytest.approx(read["velocity"], abs=1e-9)
