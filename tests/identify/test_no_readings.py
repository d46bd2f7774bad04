"""Readings that stand for none: a sensor's own number for it, wild ones, and those that a flag denies."""

from dataclasses import replace
from pathlib import Path

import closed_loop
import network_tasks
import numpy as np
import pytest
from built_recordings import of_table, write
from turning_vehicle import readings

from identify.dive import Dive, Signal
from identify.estimators.axes.build import build_axes
from identify.estimators.likelihood.fit import fit_axes
from identify.ingest.files.streams import Stream, Streams
from identify.ingest.files.text_table import read_table
from identify.ingest.mapping.column_map import ColumnMap, Columns, TimeColumn
from identify.ingest.mapping.lost_lock import without_zeros
from identify.ingest.mapping.proposal_of_runs import propose
from identify.ingest.mapping.signals import dive_fields
from identify.ingest.open import read_dive, read_streams
from identify.ingest.rotation import to_earth

T = np.arange(0.0, 30.0, 0.1)
SPEED = 0.4 + 0.3 * np.sin(0.5 * T)
LOST = slice(40, 60)


def rows(said, unit=1.0):
    """A DVL's table whose x reads `said`, and once -`said`, while it sees no bottom."""
    x = unit * SPEED
    x[LOST] = said
    x[50] = -said
    lines = [f"{t:.1f},{u:.9g},{unit * 0.1 * np.sin(t):.9g}" for t, u in zip(T, x, strict=True)]
    return "\n".join(["t,vx,vy", *lines])


@pytest.mark.parametrize(
    ("said", "unit"),
    [(8888.0, 1000.0), (-32768.0, 1000.0), (8.888, 1.0), (-32.768, 1.0), (99.99, 1.0), (88.888, 1.0)],
)
def test_a_velocity_that_the_sensor_gives_for_none_is_unknown_told_and_in_no_range(tmp_path, said, unit):
    name = "m/s" if unit == 1.0 else "mm/s"
    velocity = f"time: {{column: t}}\nvelocity: {{columns: [vx, vy, null], unit: {name}}}\n"
    dive = of_table(tmp_path, rows(said, unit), velocity)
    unknown = np.zeros(len(T), np.bool_)
    unknown[LOST] = True
    assert np.isnan(dive.velocity.value[:, 0]).tolist() == unknown.tolist()
    assert dive.velocity.value[~unknown, 0] == pytest.approx(SPEED[~unknown])
    assert f"{-abs(said):g} and {abs(said):g} in vx: taken for no reading." in dive.notes
    proposal = propose(read_streams(tmp_path / "dive.csv").streams, tmp_path / "dive.csv")
    assert proposal.columns.velocity.unit == name
    (profile,) = (each for each in proposal.profiles if each.name == "vx")
    assert profile.largest == pytest.approx(unit * SPEED.max(), rel=0.01)


def test_a_number_that_others_come_near_or_that_comes_once_is_a_reading(tmp_path):
    rpm = np.linspace(0.0, 9999.0, 300)
    rpm[-3:] = 9999.0
    depth = 1.0 + 0.01 * T
    depth[7] = 99.99
    lines = [f"{t:.1f},{n:.9g},{d:.9g}" for t, n, d in zip(T, rpm, depth, strict=True)]
    read = read_streams(write(tmp_path / "log.csv", "\n".join(["t,rpm_1,depth", *lines]).encode()))
    assert read.notes == ()
    assert read.streams[0].columns["rpm_1"] == pytest.approx(rpm)
    assert read.streams[0].columns["depth"][7] == 99.99


@pytest.mark.parametrize("said", [32.0, -99.0, 999.0, -1000.0])
def test_a_round_number_for_no_velocity_changes_no_unit_and_is_left_out_as_beyond_any_vehicle(tmp_path, said):
    log = write(tmp_path / "log.csv", rows(said).encode())
    columns = propose(read_streams(log).streams, log).columns
    assert columns.velocity.unit == "m/s"
    (tmp_path / "map.yaml").write_text("time: {column: t}\nvelocity: {columns: [vx, vy, null], unit: m/s}\n")
    dive = read_dive(log, tmp_path / "map.yaml")
    assert np.abs(dive.velocity.value[:, :2]).max() < 1.0
    assert any("no vehicle reaches" in note for note in dive.notes)


def test_a_word_on_columns_that_the_map_does_not_use_is_spared(tmp_path):
    dive = of_table(
        tmp_path, rows(8.888), "time: {column: t}\nvelocity: {columns: [null, vy, null], unit: m/s}\n"
    )
    assert not any("no reading" in note for note in dive.notes)


FILE = closed_loop.vehicle_file()
BUMPS_S = (62.0, 121.0, 203.0)


def left_out(dive):
    """Times of the readings that the fit of a dive leaves out."""
    built = build_axes(dive, FILE, "only")
    (problem,) = fit_axes(built, FILE.vehicle.configurations["only"], network_tasks.quiet).joint.problems
    dropped = np.isfinite(problem.axis.reading) & ~np.isfinite(problem.reading)
    return problem.axis.time_s[dropped]


def pushed(push_n, seconds):
    """A dive of a hull that something pushes three times."""

    def push(time_s, _thrust_n):
        return push_n * any(at_s <= time_s < at_s + seconds for at_s in BUMPS_S)

    return closed_loop.dive(np.random.default_rng(7), push=push)


def with_spikes(dive, every, size, row=1):
    """The dive with spikes of `row` readings in a row in its velocity, and the times of these readings."""
    read = dive.velocity
    value, at = read.value.copy(), np.arange(every // 2, len(read), every)
    at = (at[:, None] + np.arange(row)).ravel()
    value[at, 0] += size
    return replace(dive, velocity=Signal(read.time_s, value)), read.time_s[at]


@pytest.mark.parametrize("row", [1, 3])
@pytest.mark.parametrize("size", [0.1, 0.5])
def test_spikes_of_a_sensor_are_left_out_of_one_reading_or_of_three_in_a_row(row, size):
    dive, spikes_s = with_spikes(closed_loop.dive(np.random.default_rng(7)), 250, size, row)
    np.testing.assert_allclose(left_out(dive), spikes_s)


def test_a_spike_at_the_very_end_is_left_out():
    dive = closed_loop.dive(np.random.default_rng(7))
    value = dive.velocity.value.copy()
    value[-1, 0] += 0.5
    spiky = replace(dive, velocity=Signal(dive.velocity.time_s, value))
    np.testing.assert_allclose(left_out(spiky), dive.velocity.time_s[-1:])


@pytest.mark.parametrize(("push_n", "seconds"), [(60.0, 1.0), (60.0, 0.3), (400.0, 0.1), (1000.0, 0.1)])
def test_a_motion_that_the_model_lacks_is_kept_however_short(push_n, seconds):
    assert len(left_out(pushed(push_n, seconds))) == 0


def test_spikes_in_a_dive_with_such_a_motion_are_left_out_all_the_same():
    spiky, spikes_s = with_spikes(pushed(60.0, 1.0), 500, 1.0)
    np.testing.assert_allclose(left_out(spiky), spikes_s)


def test_where_more_readings_are_wild_than_a_sensor_has_spikes_all_are_kept():
    dive, _ = with_spikes(closed_loop.dive(np.random.default_rng(7)), 25, 0.5)
    assert len(left_out(dive)) == 0


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
