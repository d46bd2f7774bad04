"""Units of a column map, each with its exact factor, and velocities in axes other than the body's."""

import math
from pathlib import Path

import numpy as np
import pytest
from turning_vehicle import readings, table, usual

from bridge.errors import ConfigError, LogError
from identify.dive import Signal
from identify.ingest.files.streams import Stream, Streams
from identify.ingest.mapping.candidates import Confidence
from identify.ingest.mapping.column_map import ColumnMap, Columns, TimeColumn, column_map
from identify.ingest.mapping.map_text import map_text
from identify.ingest.mapping.proposal_of_runs import propose
from identify.ingest.mapping.signals import dive_fields
from identify.ingest.open import read_dive
from identify.ingest.rotation import attitude_at, euler_angles, quaternions_from_euler, to_earth

LOG = Path("log.csv")
READ = readings()
NED = to_earth(READ["attitude"], READ["velocity"])
ENU = NED[:, [1, 0, 2]] * np.array([1.0, 1.0, -1.0])

EXACT = [
    ("velocity", "kn", 3600, 1852.0),
    ("velocity", "knot", 3600, 1852.0),
    ("velocity", "km/h", 36, 10.0),
    ("velocity", "ft/s", 10_000, 3048.0),
    ("velocity", "in/s", 10_000, 254.0),
    ("gyro", "deg/s", 180, math.pi),
    ("gyro", "deg/h", 648_000, math.pi),
    ("euler", "deg", 180, math.pi),
    ("specific_force", "g", 100_000, 980_665.0),
    ("specific_force", "ft/s2", 10_000, 3048.0),
    ("depth", "ft", 10_000, 3048.0),
    ("depth", "in", 10_000, 254.0),
    ("pressure", "mbar", 1, 100.0),
    ("pressure", "kPa", 1, 1000.0),
    ("pressure", "dbar", 1, 10_000.0),
    ("pressure", "psi", 1, 6894.757293168361),
    ("rpm", "rev/s", 1, 60.0),
    ("rpm", "rad/s", math.pi, 30.0),
    ("rpm", "deg/s", 6, 1.0),
    ("tau_cmd", "lbf", 1, 4.4482216152605),
    ("tau_cmd", "kgf", 1, 9.80665),
    ("pwm", "ms", 1, 1000.0),
    ("voltage", "mV", 1000, 1.0),
]


@pytest.mark.parametrize(("signal", "unit", "cell", "si"), EXACT)
def test_a_cell_in_a_unit_is_exactly_so_much_in_si(signal, unit, cell, si):
    width = {"depth": 1, "pressure": 1, "voltage": 1, "rpm": 1, "pwm": 1, "tau_cmd": 6}.get(signal, 3)
    columns = {"t": np.arange(3.0), "c": np.full(3, float(cell)), "z": np.zeros(3)}
    mapped = ColumnMap(TimeColumn("t"), **{signal: Columns(("c", *"z" * (width - 1)), unit)})
    fields = dive_fields(Streams(table(columns)), mapped, LOG)
    if signal == "euler":
        w, x = fields["attitude"].value[0, :2]
        assert 2 * math.atan2(x, w) == pytest.approx(si, rel=1e-15)
    else:
        assert fields[signal].value[0, 0] == pytest.approx(si, rel=1e-15)


def test_a_depth_in_decibars_is_refused_with_what_makes_a_depth_of_it(tmp_path):
    written = tmp_path / "map.yaml"
    written.write_text("time: {column: t}\ndepth: {columns: [d], unit: dbar}\n", encoding="utf-8")
    with pytest.raises(ConfigError, match=r"unit 'dbar' is none of m, cm, mm, ft, in; it is one of pressure"):
        column_map(written)


def proposed(columns):
    return propose(table(columns), LOG)


def velocity_of(streams, proposal):
    return dive_fields(Streams(streams), proposal.columns, LOG)["velocity"].value


def test_units_in_names_are_taken_and_physics_finds_those_that_no_name_has():
    columns = usual(READ)
    columns["depth [ft]"] = columns.pop("depth") / 0.3048
    columns["Pressure (psi)"] = columns.pop("pressure") / 6894.757293168361
    for name in "uvw":
        columns[name] = columns[name] * 3600 / 1852
    proposal = proposed(columns)
    assert proposal.columns.depth.unit == "ft"
    assert proposal.columns.pressure.unit == "psi"
    assert (proposal.columns.velocity.unit, proposal.columns.velocity.scale) == ("kn", ())
    assert "it is in knots" in map_text(proposal, "log.csv").replace("\n# ", " ")
    assert velocity_of(table(columns), proposal) == pytest.approx(READ["velocity"], rel=1e-9)


@pytest.mark.parametrize(
    ("pascals", "unit"),
    [(1.0, "Pa"), (100.0, "hPa"), (1e3, "kPa"), (1e4, "dbar"), (6894.757, "psi"), (1e5, "bar")],
)
def test_the_unit_of_a_pressure_without_a_depth_is_known_by_the_airs(pascals, unit):
    columns = {"t": READ["t"], "u": READ["velocity"][:, 0]}
    columns["pressure"] = (101_325.0 + 9900.0 * np.abs(READ["velocity"][:, 1])) / pascals
    assert proposed(columns).columns.pressure.unit == unit


def test_a_pressure_from_the_surface_gets_the_airs_and_is_to_be_checked():
    columns = {"t": READ["t"], "u": READ["velocity"][:, 0], "pressure_dbar": 0.99 * READ["depth"]}
    proposal = proposed(columns)
    assert proposal.columns.pressure.offset == pytest.approx((10.1325,))
    (choice,) = [choice for choice in proposal.choices if choice.signal == "pressure"]
    assert choice.confidence is Confidence.GUESSED
    assert "it counts from the surface" in choice.reasons[0]


@pytest.mark.parametrize("taken", ["water_pressure", "water_pressure_hPa"])
def test_pascals_from_the_surface_that_look_like_hectopascals_are_known_by_the_pace_of_the_dive(taken):
    columns = usual(READ)
    del columns["depth"], columns["pressure"]
    columns[taken] = READ["pressure"] - 101325.0
    (choice,) = (choice for choice in propose(table(columns), LOG).choices if choice.signal == "pressure")
    assert (choice.columns.unit, choice.columns.offset[0]) == ("Pa", pytest.approx(101325.0))
    assert "which none does: it is in Pa, taken for hPa" in choice.mends[0].problem


def test_a_pressure_that_is_never_near_the_airs_is_asked_for_its_unit():
    columns = {name: values for name, values in usual(READ).items() if name != "depth"}
    for least_pa, is_asked in ((101_325.0, False), (300_000.0, True)):
        columns["pressure"] = 0.01 * (least_pa + READ["pressure"] - READ["pressure"].min())
        (choice,) = (each for each in propose(table(columns), LOG).choices if each.signal == "pressure")
        assert choice.columns.unit == "hPa"
        assert (choice.confidence is Confidence.GUESSED) is is_asked
        assert ("Pa from the surface" in choice.reasons[0]) is is_asked


@pytest.mark.parametrize(("named", "unit", "pascals"), [("dbar", "bar", 1e5), ("bar", "dbar", 1e4)])
def test_an_absolute_pressure_whose_name_says_another_unit_is_mended_by_the_depth(named, unit, pascals):
    columns = usual(READ)
    columns[f"pressure_{named}"] = columns.pop("pressure") / pascals
    proposal = proposed(columns)
    pressure = proposal.columns.pressure
    assert (pressure.unit, pressure.offset, pressure.scale) == (unit, (), ())
    fields = dive_fields(Streams(table(columns)), proposal.columns, LOG)
    assert fields["pressure"].value == pytest.approx(READ["pressure"][:, None], rel=1e-9)


@pytest.mark.parametrize(
    ("frame", "velocity"),
    [
        ("FRD", READ["velocity"]),
        ("FLU", READ["velocity"] * np.array([1.0, -1.0, -1.0])),
        ("NED", NED),
        ("ENU", ENU),
    ],
)
def test_a_velocity_in_a_frame_is_turned_to_the_bodys_axes(frame, velocity):
    columns = {"t": READ["t"], **dict(zip("abc", velocity.T, strict=True))}
    columns |= dict(zip("wxyz", READ["attitude"].T, strict=True))
    mapped = ColumnMap(
        TimeColumn("t"),
        velocity=Columns(("a", "b", "c"), "m/s", frame=frame),
        quaternion=Columns(tuple("wxyz"), "1"),
    )
    fields = dive_fields(Streams(table(columns)), mapped, LOG)
    assert fields["velocity"].value == pytest.approx(READ["velocity"], abs=1e-12)


def test_an_attitude_between_known_ones_is_near_both_though_its_quaternion_changes_sign_where_it_is_unknown():
    """A filter that keeps w above 0, at a heading about south; every other reading is none."""
    time_s = np.arange(0.0, 20.0, 0.1)
    yaw = np.pi + 0.3 * np.sin(time_s)
    quaternion = quaternions_from_euler(0.0 * yaw, 0.0 * yaw, yaw)
    quaternion[quaternion[:, 0] < 0.0] *= -1.0
    quaternion[1::2] = np.nan
    _, _, heading = euler_angles(attitude_at(Signal(time_s, quaternion), time_s))
    assert np.abs(np.angle(np.exp(1j * (heading - yaw)))).max() < 0.03


def test_a_velocity_in_earth_axes_lasts_as_long_as_the_attitude_and_says_so():
    attitude = {"t": READ["t"][500:1500], **dict(zip("wxyz", READ["attitude"][500:1500].T, strict=True))}
    velocity = {"t": READ["t"], **dict(zip("ned", NED.T, strict=True))}
    streams = Streams((Stream("a", attitude, {}), Stream("v", velocity, {})))
    mapped = ColumnMap(
        TimeColumn("t"),
        velocity=Columns(("v.n", "v.e", "v.d"), "m/s", frame="NED"),
        quaternion=Columns(("a.w", "a.x", "a.y", "a.z"), "1"),
    )
    fields = dive_fields(streams, mapped, LOG)
    assert fields["velocity"].value == pytest.approx(READ["velocity"][500:1500], abs=1e-12)
    assert "1000 of 2000 velocities are from before or after the attitude" in fields["notes"][0]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("velocity: {columns: [a, b, c], unit: m/s, frame: NED}", "name `euler` or `quaternion`"),
        ("velocity: {columns: [a, b, null], unit: m/s, frame: NED}", "can't be known in part"),
        (
            "velocity: {columns: [a, b, c], unit: m/s, frame: UTM}",
            "frame 'UTM' is none of FRD, FLU, NED, ENU",
        ),
        ("gyro: {columns: [a, b, c], unit: rad/s, frame: FLU}", "only a velocity has a frame"),
    ],
)
def test_a_frame_that_can_not_be_is_refused_in_a_sentence(tmp_path, text, said):
    log, written = tmp_path / "log.csv", tmp_path / "map.yaml"
    log.write_text("t,a,b,c\n0,1,2,3\n1,1,2,3\n", encoding="utf-8")
    written.write_text(f"time: {{column: t}}\n{text}\n", encoding="utf-8")
    with pytest.raises((ConfigError, LogError), match=said):
        read_dive(log, written)


def earth_table(names, velocity, **less):
    columns = {name: values for name, values in usual(READ).items() if name not in "uvw"}
    return {**columns, **dict(zip(names.split(), velocity.T, strict=True)), **less}


@pytest.mark.parametrize(
    ("names", "velocity", "frame"),
    [
        ("vn ve vd", NED, "NED"),
        ("vel_north vel_east vel_down", NED, "NED"),
        ("ve vn vu", ENU, "ENU"),
        ("east_velocity north_velocity up_velocity", ENU, "ENU"),
    ],
)
def test_names_of_the_earths_axes_propose_a_frame(names, velocity, frame):
    columns = earth_table(names, velocity)
    proposal = proposed(columns)
    assert proposal.columns.velocity.frame == frame
    assert f"frame: {frame}" in map_text(proposal, "log.csv")
    assert velocity_of(table(columns), proposal) == pytest.approx(READ["velocity"], abs=1e-9)


def test_a_velocity_in_earth_axes_under_the_names_of_the_bodys_is_found_by_physics():
    columns = earth_table("u v w", NED)
    proposal = proposed(columns)
    assert proposal.columns.velocity.frame == "NED"
    assert "it is in earth axes, north, east, down" in map_text(proposal, "log.csv").replace("\n# ", " ")
    assert velocity_of(table(columns), proposal) == pytest.approx(READ["velocity"], abs=1e-9)


def test_of_a_bag_of_mavros_the_velocity_in_earth_axes_is_turned_by_an_attitude_of_ros():
    flu = np.array([1.0, -1.0, -1.0])
    w, x, y, z = READ["attitude"].T
    t = READ["t"]
    imu = {"orientation.w": w, "orientation.x": x, "orientation.y": -y, "orientation.z": -z}
    for field, key in (("angular_velocity", "gyro"), ("linear_acceleration", "force")):
        imu |= {f"{field}.{axis}": (READ[key] * flu)[:, k] for k, axis in enumerate("xyz")}
    speeds = {f"twist.linear.{axis}": (NED * flu)[:, k] for k, axis in enumerate("xyz")}
    for less in ((), ("linear_acceleration",)):
        kept = {name: values for name, values in imu.items() if not name.startswith(tuple(less) or "-")}
        streams = (
            Stream("/imu/data", {"stamp": t, **kept}, {}),
            Stream("/mavros/local_position/velocity_local", {"stamp": t, **speeds}, {}),
            Stream("/depth", {"stamp": t, "data": READ["depth"]}, {}),
        )
        proposal = propose(streams, Path("dive.bag"))
        assert proposal.columns.velocity_is_filtered
        if not less:
            assert velocity_of(streams, proposal) == pytest.approx(READ["velocity"], abs=1e-9)
        else:
            assert proposal.columns.velocity.frame in ("NED", "ENU")
            (choice,) = [choice for choice in proposal.choices if choice.signal == "velocity"]
            assert choice.confidence is Confidence.GUESSED


def test_without_an_attitude_a_velocity_in_earth_axes_is_left_out_and_said():
    columns = {"t": READ["t"], "r": READ["gyro"][:, 2], **dict(zip(("vn", "ve", "vd"), NED.T, strict=True))}
    proposal = proposed(columns)
    assert proposal.columns.velocity is None
    assert any("vn, ve, vd: not used for velocity" in note for note in proposal.notes)
    del columns["vd"]
    assert any("a part of one in earth axes" in note for note in proposed(columns).notes)
