"""Columns that say which velocities are none, and what else sensors and ground stations write."""

from pathlib import Path

import numpy as np
import pytest
from built_recordings import of_table, write
from turning_vehicle import readings

from identify.dive import Dive, Signal
from identify.ingest.files.streams import Stream, Streams
from identify.ingest.files.text_table import read_table
from identify.ingest.mapping.column_map import ColumnMap, Columns, TimeColumn
from identify.ingest.mapping.lost_lock import without_zeros
from identify.ingest.mapping.proposal_of_runs import propose
from identify.ingest.mapping.signals import dive_fields
from identify.ingest.rotation import to_earth

MAP = "time: {column: t}\nvelocity: {columns: [vx, vy, null], unit: m/s}\n"


@pytest.mark.parametrize(("yes", "no"), [("True", "False"), ("1", "0")])
def test_a_velocity_that_its_sensor_calls_invalid_is_unknown_and_no_standstill(tmp_path, yes, no):
    rows = f"0,0.5,0.1,{yes}\n0.1,0,0,{no}\n0.2,0.6,0.2,{yes}\n"
    dive = of_table(tmp_path, f"t,vx,vy,velocity_valid\n{rows}", MAP)
    np.testing.assert_array_equal(dive.velocity.value[:, :2], [[0.5, 0.1], [np.nan] * 2, [0.6, 0.2]])
    assert "Left out by velocity_valid: 1 of 3 velocities, which are no reading." in dive.notes


def swum(lost, resolution=0.0):
    """Velocities (n, 3) of a minute with noise, zero where `lost`, in steps of a resolution."""
    rng = np.random.default_rng(8)
    t = np.arange(0.0, 60.0, 0.1)
    value = np.column_stack([0.4 + 0.3 * np.sin(0.3 * t), 0.2 * np.sin(0.5 * t), 0.1 * np.sin(0.7 * t)])
    value += 0.01 * rng.standard_normal(value.shape)
    value[lost] = 0.0
    return Signal(t, np.round(value / resolution) * resolution if resolution else value)


@pytest.mark.parametrize("lost", [slice(0, 600, 15), slice(280, 310), np.arange(600) % 5 > 0])
def test_zeros_amid_a_motion_that_goes_on_are_no_velocities_and_are_told(lost):
    notes = []
    read = without_zeros(swum(lost), notes)
    unknown = np.zeros(600, np.bool_)
    unknown[lost] = True
    unknown[0] = unknown[599] = False
    assert np.mean(np.isnan(read.value).all(axis=1)[unknown]) > 0.5
    assert np.isfinite(read.value[~unknown]).all()
    assert notes == [
        f"{np.count_nonzero(np.isnan(read.value[:, 0]))} of 600 velocities are exactly zero in all axes, and those "
        "around them are not: taken for no reading, as of a DVL without bottom lock."
    ]


def test_a_table_loses_the_zeros_of_a_dvl_without_bottom_lock(tmp_path):
    velocity = swum(slice(0, 600, 15))
    rows = "".join(
        f"{t:.1f},{u:.6f},{v:.6f}\n" for t, (u, v, _) in zip(velocity.time_s, velocity.value, strict=True)
    )
    dive = of_table(tmp_path, f"t,vx,vy\n{rows}", MAP)
    assert np.count_nonzero(np.isnan(dive.velocity.value[:, 0])) > 20
    assert any("bottom lock" in note for note in dive.notes)


@pytest.mark.parametrize("resolution", [0.0, 0.05])
def test_a_vehicle_that_stops_and_one_whose_sensor_is_coarse_keep_their_zeros(resolution):
    goes = np.clip(np.sin(0.2 * np.arange(600)), 0.0, None)
    stops = Signal(0.1 * np.arange(600), np.outer(goes, [0.4, 0.1, 0.0]))
    slow = swum(slice(0, 0), resolution)
    for velocity in (stops, slow, Signal(slow.time_s, 0.1 * slow.value)):
        notes = []
        assert without_zeros(velocity, notes) is velocity
        assert notes == []


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
