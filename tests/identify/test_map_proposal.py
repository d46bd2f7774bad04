"""The column map that a file suggests: columns, units, and what physics mends in it."""

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from fakes.shared import shared
from turning_vehicle import readings, table, usual

from bridge import schema
from bridge.errors import LogError
from identify.dive import Dive
from identify.ingest.files.streams import Stream, Streams
from identify.ingest.files.text_table import read_table
from identify.ingest.mapping.candidates import Confidence
from identify.ingest.mapping.column_map import ColumnMap, TimeColumn, column_map
from identify.ingest.mapping.map_text import map_text, uncertain
from identify.ingest.mapping.proposal import NothingKnown
from identify.ingest.mapping.proposal_of_runs import propose
from identify.ingest.mapping.ranges import time_unit_of
from identify.ingest.mapping.signals import dive_fields

LOG = Path("log.csv")
READ = readings()


def proposed(columns):
    return propose(table(columns), LOG)


def mapped(streams, columns, path):
    return Dive(path.name, path, "", **dive_fields(Streams(streams), columns, path))


def units(proposal):
    return {name: columns.unit for name, columns in proposal.columns.signals().items()}


def assert_maps_to_the_truth(streams, proposal):
    """Every signal of the proposal's dive is what the vehicle did."""
    dive = mapped(streams, proposal.columns, LOG)
    truth = {
        "velocity": READ["velocity"], "gyro": READ["gyro"], "specific_force": READ["force"],
        "depth": READ["depth"][:, None], "pressure": READ["pressure"][:, None],
    }  # fmt: skip
    for name, value in truth.items():
        if name in dive.signals():
            assert getattr(dive, name).value == pytest.approx(value, rel=1e-4, abs=1e-6), name
    same = np.abs(np.sum(dive.attitude.value * READ["attitude"], axis=1))
    assert same == pytest.approx(1.0, abs=1e-9)
    assert {"velocity", "gyro", "depth"} <= dive.signals().keys()


def test_usual_names_in_si_are_taken_as_they_are_without_a_mend():
    columns = usual(READ)
    proposal = proposed(columns)
    assert units(proposal) == {
        "velocity": "m/s", "gyro": "rad/s", "specific_force": "m/s2", "euler": "rad", "pressure": "Pa", "depth": "m",
        "pwm": "us",
    }  # fmt: skip
    assert proposal.columns.pwm.columns == ("T1", "T2", "T3", "T4")
    assert not any(choice.mends for choice in proposal.choices)
    assert not any(choice.confidence is Confidence.GUESSED for choice in proposal.choices)
    assert_maps_to_the_truth(table(columns), proposal)


def test_degrees_centimetres_milliseconds_hectopascals_and_g_are_known_by_their_size():
    columns = usual(READ)
    scales = {"t": 1e3, "depth": 100.0, "pressure": 0.01}
    scales |= dict.fromkeys("uvw", 100.0) | dict.fromkeys(("ax", "ay", "az"), 1 / 9.80665)
    scales |= dict.fromkeys(("p", "q", "r", "roll", "pitch", "yaw"), np.degrees(1.0))
    columns = {name: values * scales.get(name, 1.0) for name, values in columns.items()}
    proposal = proposed(columns)
    assert proposal.columns.time.unit == "ms"
    assert units(proposal) == {
        "velocity": "cm/s", "gyro": "deg/s", "specific_force": "g", "euler": "deg", "pressure": "hPa", "depth": "cm",
        "pwm": "us",
    }  # fmt: skip
    assert proposal.columns.depth.scale == ()
    assert_maps_to_the_truth(table(columns), proposal)


def test_a_log_in_feet_is_known_by_its_gravity_and_every_guess_of_it_is_asked():
    feet = 1 / 0.3048
    columns = usual(READ)
    del columns["pressure"]
    for name in ("u", "v", "w", "ax", "ay", "az", "depth"):
        columns[name] = feet * columns[name]
    proposal = proposed(columns)
    assert units(proposal) | {"pwm": ""} == {
        "velocity": "ft/s", "gyro": "rad/s", "specific_force": "ft/s2", "euler": "rad", "depth": "ft", "pwm": "",
    }  # fmt: skip
    assert_maps_to_the_truth(table(columns), proposal)
    for name in ("ax", "ay", "az"):
        del columns[name]
    blind = proposed(columns)
    asked = {choice.signal for choice in blind.choices if choice.confidence is Confidence.GUESSED}
    assert asked == {"velocity", "gyro", "euler", "depth"}


def test_a_unit_that_physics_mends_is_not_asked_about_as_first_guessed():
    columns = {name: values for name, values in usual(READ).items() if name not in ("ax", "ay", "az")}
    columns |= {name: columns[name] / 0.3048 for name in ("u", "v", "w", "depth")}
    velocity = next(choice for choice in proposed(columns).choices if choice.signal == "velocity")
    assert velocity.columns.unit == "ft/s"
    assert [words for words in uncertain(velocity) if "taken for" in words] == []


def test_angles_that_turn_ten_times_as_fast_as_the_gyro_are_in_no_unit_by_it():
    columns = usual(readings(size=0.05))
    euler = next(
        each for each in proposed({**columns, "t": 0.1 * columns["t"]}).choices if each.signal == "euler"
    )
    assert (euler.columns.unit, euler.confidence) == ("rad", Confidence.GUESSED)


def test_two_guesses_that_agree_are_still_guesses():
    small = readings(size=0.05)
    columns = {"t": small["t"], "r": np.degrees(small["gyro"][:, 2])}
    columns |= {name: np.degrees(small["euler"][:, k]) for k, name in enumerate(("roll", "pitch", "yaw"))}
    columns |= {"p": np.degrees(small["gyro"][:, 0]), "q": np.degrees(small["gyro"][:, 1])}
    proposal = proposed(columns)
    assert {choice.signal: choice.confidence for choice in proposal.choices} == dict.fromkeys(
        ("gyro", "euler"), Confidence.GUESSED
    )


@pytest.mark.parametrize("side", ["stbd", "port"])
def test_a_velocity_down_or_up_is_of_the_body_beside_one_ahead_and_of_the_earth_beside_one_north(side):
    sign, vertical = (1.0, "down") if side == "stbd" else (-1.0, "up")
    columns = usual(READ)
    ahead, aside, down = (columns.pop(name) for name in "uvw")
    columns |= {"Speed ahead": ahead, f"Speed {side}": sign * aside, f"Speed {vertical}": sign * down}
    proposal = proposed(columns)
    assert proposal.columns.velocity.columns == ("Speed ahead", f"Speed {side}", f"Speed {vertical}")
    assert_maps_to_the_truth(table(columns), proposal)
    earth = proposed({"t": READ["t"], "r": READ["gyro"][:, 2], "Speed north": ahead, "Speed down": down})
    assert earth.columns.velocity is None


def test_small_angles_are_degrees_where_they_turn_as_the_gyro_in_degrees():
    small = readings(size=0.05)
    columns = usual(small)
    for name in ("roll", "pitch", "yaw"):
        columns[name] = np.degrees(columns[name])
    assert max(np.abs(columns["yaw"]).max(), np.abs(columns["pitch"]).max()) < 7.0
    proposal = proposed(columns)
    assert proposal.columns.euler.unit == "deg"
    assert proposal.columns.gyro.unit == "rad/s"
    assert proposal.columns.gyro.scale == ()


def test_radians_that_count_turns_on_are_no_degrees():
    columns = {
        "t": READ["t"],
        "roll": READ["euler"][:, 0],
        "pitch": READ["euler"][:, 1],
        "yaw": 0.5 * READ["t"],
    }
    assert proposed(columns).columns.euler.unit == "rad"


def test_a_log_in_axes_forward_left_up_is_turned_and_says_so():
    columns = usual(READ)
    for name in ("v", "w", "q", "r", "pitch", "yaw", "ay", "az", "depth"):
        columns[name] = -columns[name]
    proposal = proposed(columns)
    signals = proposal.columns.signals()
    for name in ("velocity", "gyro", "specific_force", "euler"):
        assert signals[name].scale == (1.0, -1.0, -1.0)
    assert signals["depth"].scale == (-1.0,)
    assert_maps_to_the_truth(table(columns), proposal)
    assert map_text(proposal, "log.csv").count("forward, left, up (FLU, as in ROS)") == 4
    assert any("says to run north runs east" in note for note in proposal.notes)
    assert not any("runs east" in note for note in proposed(usual(READ)).notes)


def test_a_bag_as_ros_writes_it_is_turned_with_its_quaternion_in_the_order_of_a_dive():
    w, x, y, z = READ["attitude"].T
    flu = np.array([1.0, -1.0, -1.0])
    imu = {
        "stamp": READ["t"] + 1.7e9,
        "orientation.x": x,
        "orientation.y": -y,
        "orientation.z": -z,
        "orientation.w": w,
    }
    for field, key in (("angular_velocity", "gyro"), ("linear_acceleration", "force")):
        imu |= {f"{field}.{axis}": READ[key][:, k] * flu[k] for k, axis in enumerate("xyz")}
    dvl = {"stamp": READ["t"][::5] + 1.7e9}
    dvl |= {f"twist.twist.linear.{axis}": READ["velocity"][::5, k] * flu[k] for k, axis in enumerate("xyz")}
    odom = {"stamp": READ["t"] + 1.7e9, "pose.pose.position.z": -READ["depth"]}
    thrusters = {"stamp": READ["t"] + 1.7e9, **{f"data.{k}": READ["pulses"][:, k] for k in range(4)}}
    named = {"/imu/data": imu, "/dvl/twist": dvl, "/odom": odom, "/thrusters/pwm": thrusters}
    streams = tuple(Stream(topic, columns, {}) for topic, columns in named.items())
    proposal = propose(streams, Path("dive.bag"))
    assert proposal.columns.time.column == "stamp"
    assert proposal.columns.time.unit == "s"
    signals = proposal.columns.signals()
    assert signals["quaternion"].columns == tuple(f"/imu/data.orientation.{axis}" for axis in "wxyz")
    assert signals["quaternion"].scale == (1.0, 1.0, -1.0, -1.0)
    assert signals["velocity"].columns[0] == "/dvl/twist.twist.twist.linear.x"
    assert signals["velocity"].scale == (1.0, -1.0, -1.0)
    assert signals["depth"].scale == (-1.0,)
    assert signals["pwm"].columns[3] == "/thrusters/pwm.data.3"
    dive = mapped(streams, proposal.columns, Path("dive.bag"))
    assert np.abs(np.sum(dive.attitude.value * READ["attitude"], axis=1)) == pytest.approx(1.0, abs=1e-9)
    assert dive.velocity.value == pytest.approx(READ["velocity"][::5])
    assert dive.gyro.value == pytest.approx(READ["gyro"])


@pytest.mark.parametrize("order", [(0, 1, 2, 3), (1, 2, 3, 0)], ids=["w first", "w last"])
@pytest.mark.parametrize("name", ["q{}", "ATTITUDE_QUATERNION.q{}", "quat.{}"])
def test_a_quaternion_whose_parts_are_counted_from_one_is_the_attitude(name, order):
    columns = {key: values for key, values in usual(READ).items() if key not in ("roll", "pitch", "yaw")}
    parts = {name.format(1 + k): READ["attitude"][:, part] for k, part in enumerate(order)}
    proposal = proposed(columns | parts)
    assert_maps_to_the_truth(table(columns | parts), proposal)
    assert proposal.columns.quaternion.columns == tuple(name.format(1 + order.index(k)) for k in range(4))


def test_a_ulog_gives_its_rates_attitude_and_outputs_and_its_velocity_in_earth_axes_is_refused():
    stamp = READ["t"] * 1e6 + 5e6
    topics = {
        "vehicle_angular_velocity": {f"xyz[{k}]": READ["gyro"][:, k] for k in range(3)},
        "vehicle_attitude": {f"q[{k}]": READ["attitude"][:, k] for k in range(4)},
        "vehicle_local_position": {"vx": READ["velocity"][:, 0], "z": READ["depth"]},
        "actuator_outputs": {
            f"output[{k}]": READ["pulses"][:, k] if k < 4 else 0.0 * stamp for k in range(16)
        },
        "battery_status": {"voltage_v": 15.0 + 0.0 * stamp},
    }
    streams = tuple(Stream(name, {"timestamp": stamp, **columns}, {}) for name, columns in topics.items())
    proposal = propose(streams, Path("log.ulg"))
    assert (proposal.columns.time.column, proposal.columns.time.unit) == ("timestamp", "us")
    assert set(proposal.columns.signals()) == {"gyro", "quaternion", "depth", "pwm", "voltage"}
    assert proposal.columns.pwm.columns == tuple(f"actuator_outputs.output[{k}]" for k in range(4))
    assert proposal.columns.quaternion.scale == ()
    assert any("earth axes" in note for note in proposal.notes)


def test_of_mavros_the_velocity_in_body_axes_and_the_height_above_the_surface_are_taken():
    t = READ["t"]
    axes = dict(enumerate("xyz"))
    topics = {
        "/mavros/local_position/velocity_local": {
            f"twist.linear.{a}": READ["euler"][:, k] for k, a in axes.items()
        },
        "/mavros/local_position/velocity_body": {
            f"twist.linear.{a}": READ["velocity"][:, k] for k, a in axes.items()
        },
        "/mavros/global_position/rel_alt": {"data": -READ["depth"]},
        "/ping": {"range": 3.0 + 0.1 * np.sin(t), "min_range": 0.3 + 0.0 * t, "max_range": 50.0 + 0.0 * t},
    }
    streams = tuple(Stream(name, {"stamp": t, **columns}, {}) for name, columns in topics.items())
    columns = propose(streams, Path("dive.bag")).columns
    signals = columns.signals()
    assert columns.velocity_is_filtered
    assert signals["velocity"].columns[0] == "/mavros/local_position/velocity_body.twist.linear.x"
    assert (signals["depth"].columns[0], signals["depth"].scale) == (
        "/mavros/global_position/rel_alt.data",
        (-1.0,),
    )
    assert signals["altitude"].columns == ("/ping.range",)


@pytest.mark.parametrize(("full", "scale"), [(1.0, ()), (100.0, (0.01, 0.01))])
def test_commands_from_minus_one_to_one_or_in_per_cent_stay_shares_and_are_to_be_checked(full, scale):
    columns = {
        "time": READ["t"],
        "r": READ["gyro"][:, 2],
        "thruster_1": full * np.sin(READ["t"]),
        "thruster_2": full * np.cos(READ["t"]),
    }
    proposal = proposed(columns)
    commands = proposal.columns.pwm
    assert (commands.unit, commands.offset, commands.scale) == ("1", (), scale)
    shares = mapped(table(columns), proposal.columns, LOG).effort.value
    assert shares[:, 0] == pytest.approx(np.sin(READ["t"]))
    (choice,) = [choice for choice in proposal.choices if choice.signal == "pwm"]
    assert choice.confidence is Confidence.GUESSED


def test_of_thrusters_named_by_their_side_port_is_the_first_and_that_is_asked():
    pulses = {"thr_right": READ["pulses"][:, 1], "thr_left": READ["pulses"][:, 0]}
    proposal = proposed({"t": READ["t"], "u": READ["velocity"][:, 0]} | pulses)
    (choice,) = [choice for choice in proposal.choices if choice.signal == "pwm"]
    assert (choice.columns.columns, choice.columns.unit) == (("thr_left", "thr_right"), "us")
    words = "Port is taken for the vehicle file's first thruster, and starboard for its second."
    assert choice.reasons[-1] == words
    assert words in map_text(proposal, LOG.name)
    assert "FLU" not in map_text(proposal, LOG.name)


def test_a_force_along_one_axis_is_a_wrench_whose_other_parts_are_nothing():
    columns = {"t": READ["t"], "u": READ["velocity"][:, 0], "X_N": 20.0 * np.sin(READ["t"])}
    wrench = proposed(columns).columns.tau_cmd
    assert wrench is not None
    assert (wrench.columns, wrench.unit) == (("X_N", "-", "-", "-", "-", "-"), "N")


@pytest.mark.parametrize(("largest", "unit"), [(29.0, "N"), (0.9, "1")])
def test_commands_that_are_named_forces_are_newtons_where_they_are_no_shares(largest, unit):
    forces = {f"thrust_{k}": largest * np.sin(READ["t"] + k) for k in range(6)}
    motion = {name: cells for name, cells in usual(READ).items() if not name.startswith("pwm")}
    commands = proposed(motion | forces).columns.pwm
    assert commands is not None
    assert (commands.columns, commands.unit) == (tuple(forces), unit)


def test_of_a_single_rate_the_others_are_unknown():
    proposal = proposed({"t": READ["t"], "r": READ["gyro"][:, 2], "T1": READ["pulses"][:, 0]})
    assert proposal.columns.gyro.columns == (None, None, "r")


def test_theta_beside_x_and_y_is_the_heading_of_a_pose_in_the_plane_and_else_the_pitch():
    theta, rate, gone = READ["euler"][:, 2], READ["gyro"][:, 2], np.cumsum(READ["velocity"], axis=0)
    flat = {"t": READ["t"], "x": gone[:, 0], "y": gone[:, 1], "theta": theta, "r": rate}
    assert proposed(flat).columns.euler.columns == ("-", "-", "theta")
    pose = Stream("pose_2d", {"stamp": READ["t"], "x": gone[:, 0], "y": gone[:, 1], "theta": theta}, {})
    imu = Stream("imu", {"stamp": READ["t"], "r": rate}, {})
    assert propose((pose, imu), LOG).columns.euler.columns == ("-", "-", "pose_2d.theta")
    for other in ({"z": gone[:, 2]}, {"psi": theta}):
        assert proposed(flat | other).columns.euler.columns[1] == "theta"


def test_the_profile_of_a_column_has_its_range_rate_and_share_unknown():
    depth = READ["depth"].copy()
    depth[1::2] = np.nan
    profiles = {
        each.name: each for each in proposed({**usual(READ), "depth": depth, "mood": READ["t"] * 0}).profiles
    }
    profile = profiles["depth"]
    assert (profile.samples, profile.unknown) == (1000, 0.5)
    assert profile.rate_hz == pytest.approx(25.0)
    assert (profile.least, profile.largest) == (np.nanmin(depth), np.nanmax(depth))
    assert profile.median == np.nanmedian(depth)
    proposal = proposed({**usual(READ), "mood": READ["t"] * 0})
    assert proposal.taken_for("mood") == ("", "")
    assert proposal.taken_for("q") == ("gyro 2", "rad/s")
    assert proposal.taken_for("t") == ("time", "s")


@pytest.mark.parametrize("stamp", [202458, 126061])
def test_a_clock_that_counts_to_59_and_on_from_100_is_the_time_of_day(stamp):
    """Twenty rows a second from 20:24:50 on, of which one may be stamped with no time of day."""
    second = np.arange(600) // 20
    clock = np.where(second < 10, 202450, 202500 - 10) + second
    clock[170] = stamp
    proposal = proposed({"time": clock.astype(float), "depth": 0.01 * np.arange(600.0)})
    assert proposal.columns.time == TimeColumn("time", "hhmmss")
    dive = mapped(
        table({"time": clock.astype(float), "depth": 0.01 * np.arange(600.0)}), proposal.columns, LOG
    )
    assert len(dive.depth) == 600 - (stamp == 126061)
    np.testing.assert_allclose(np.diff(dive.depth.time_s), 0.05, atol=0.003 if stamp == 126061 else 1e-9)


@pytest.mark.parametrize(("unit", "in_a_second"), [("ns", 1e9), ("us", 1e6), ("ms", 1e3)])
def test_a_clock_of_a_computer_that_has_run_for_days_counts_in_the_unit_of_its_steps(unit, in_a_second):
    read = readings()
    days = {**usual(read), "t": (2.5 * 86_400.0 + read["t"]) * in_a_second}
    assert proposed(days).columns.time == TimeColumn("t", unit)


@pytest.mark.parametrize(("unit", "in_a_second"), [("ns", 1e9), ("us", 1e6), ("ms", 1e3), ("s", 1.0)])
def test_a_date_as_a_number_is_known_by_its_size_however_seldom_it_is_logged(unit, in_a_second):
    assert time_unit_of((1.79e9 + 20.0 * np.arange(9)) * in_a_second) == (unit, True)


@pytest.mark.parametrize(("unit", "in_a_second", "start_s"), [("ns", 1e9, 1.4), ("us", 1e6, 1400.0)])
def test_a_clock_from_the_start_whose_numbers_look_like_dates_counts_in_the_unit_that_makes_a_dive(
    unit, in_a_second, start_s
):
    assert time_unit_of((start_s + 0.05 * np.arange(6000)) * in_a_second)[0] == unit


def test_a_clock_of_dates_is_taken_for_one():
    second = [f"2026-07-19T10:15:{k:02d}Z" for k in range(50)]
    stream = Stream("", {"depth": np.linspace(1.0, 2.0, 50)}, {"time": tuple(second)})
    proposal = propose((stream,), LOG)
    assert proposal.columns.time == TimeColumn("time", "iso")
    assert np.diff(mapped((stream,), proposal.columns, LOG).depth.time_s) == pytest.approx(1.0)


def test_a_date_that_the_file_holds_as_one_is_in_seconds_whatever_its_name_ends_in():
    columns = {**usual(READ), "timestamp_ns": 1.79e9 + READ["t"]}
    del columns["t"]
    streams = (Stream("", columns, {}, frozenset({"timestamp_ns"})),)
    proposal = propose(streams, LOG)
    assert proposal.columns.time == TimeColumn("timestamp_ns", "s")
    assert_maps_to_the_truth(streams, proposal)


def test_the_written_map_reads_back_as_the_proposal():
    columns = usual(READ)
    columns["q"] = -columns["q"]
    proposal = proposed(columns)
    text = map_text(proposal, "log.csv")
    assert schema.build(ColumnMap, yaml.safe_load(text), "map") == proposal.columns
    assert "# The gyro contradicts how the attitude turns" in text


def test_an_attitude_that_a_log_calls_angular_is_doubted_as_a_rate_of_turn():
    columns = usual(READ)
    heading = 2.2 + 0.3 * np.sin(0.1 * READ["t"])
    columns = {name: columns[name] for name in ("t", "u", "v", "w")}
    columns |= {f"twist_angular_{axis}": 0.01 * np.sin(READ["t"]) for axis in "xy"} | {
        "twist_angular_z": heading
    }
    (gyro,) = (choice for choice in proposed(columns).choices if choice.signal == "gyro")
    assert gyro.confidence is Confidence.GUESSED
    assert "About z they stay near 2.4, as an angle does" in " ".join(gyro.reasons)
    columns["twist_angular_z"] = heading - 2.2
    (gyro,) = (choice for choice in proposed(columns).choices if choice.signal == "gyro")
    assert "as an angle does" not in " ".join(gyro.reasons)


def test_a_fibre_optic_gyro_of_a_vehicle_that_spins_is_not_told_to_be_an_attitude():
    columns = {name: usual(READ)[name] for name in ("t", "u", "v", "w")}
    columns["fog_z"] = 2.2 + 0.3 * np.sin(0.1 * READ["t"])
    (fog,) = (choice for choice in proposed(columns).choices if choice.signal == "fog")
    assert "as an angle does" not in " ".join(fog.reasons)


def test_header_times_that_fall_back_leave_the_log_s_times_and_a_word_on_it():
    stamp_s = np.arange(0.0, 30.0, 0.1)
    overtaken_s = stamp_s.reshape(-1, 4)[:, [1, 0, 3, 2]].ravel()
    motion = {f"twist.linear.{axis}": np.sin(stamp_s) for axis in "xyz"}
    imu = {f"angular_velocity.{axis}": np.cos(stamp_s) for axis in "xyz"}
    streams = (
        Stream("/dvl", {"stamp": overtaken_s, "received": stamp_s + 0.1, **motion}, {}),
        Stream("/imu", {"stamp": stamp_s, "received": stamp_s + 0.1, **imu}, {}),
    )
    proposal = propose(streams, LOG)
    assert proposal.columns.time == TimeColumn("received", "s")
    assert proposal.time_reason.startswith("The header times of /dvl fall back from message to message")


def test_header_times_that_nothing_fills_or_of_a_single_message_are_not_told_to_fall_back():
    time_s = np.arange(0.0, 30.0, 0.1)
    motion = {f"twist.linear.{axis}": np.sin(time_s) for axis in "xyz"}
    imu = {f"angular_velocity.{axis}": np.cos(time_s) for axis in "xyz"}
    once = {"stamp": np.zeros(1), "received": np.ones(1), "data": np.zeros(1)}
    unfilled = (
        Stream("/dvl", {"stamp": 0.0 * time_s, "received": time_s + 0.1, **motion}, {}),
        Stream("/imu", {"stamp": time_s, "received": time_s + 0.1, **imu}, {}),
        Stream("/mode", once, {}),
    )
    proposal = propose(unfilled, LOG)
    assert proposal.columns.time == TimeColumn("received", "s")
    assert "fall back" not in proposal.time_reason
    falling = {"stamp": time_s[::-1], "received": time_s + 0.1, "data": 0.0 * time_s}
    both = propose((*unfilled, Stream("/mast", falling, {})), LOG)
    assert both.time_reason.startswith("The header times of /mast fall back")


@pytest.mark.parametrize("other", ["cum_s", "speed_ms"])
def test_of_columns_that_rise_and_end_in_a_unit_of_time_the_most_even_is_the_time(other):
    """Time of which the thrusters pushed, and a vehicle that gathers way by fits and starts."""
    rises = np.cumsum(np.random.default_rng(6).exponential(0.05, len(READ["t"])))
    columns = {name: values for name, values in usual(READ).items() if name != "t"}
    proposal = proposed({other: rises, "Zeit_ms": 1e3 * READ["t"], **columns})
    assert proposal.columns.time == TimeColumn("Zeit_ms", "ms")


def test_where_no_column_is_named_a_time_one_that_rises_and_ends_in_a_unit_of_time_is_taken_and_told():
    clocks = {"MonoNS": READ["t"] * 1e9 + 4e12, "MonoS": READ["t"] + 4000.0}
    proposal = proposed(clocks | {name: values for name, values in usual(READ).items() if name != "t"})
    assert proposal.columns.time == TimeColumn("MonoS", "s")
    assert proposal.time_reason == "No column is named a time; 'MonoS' rises throughout, and ends in s."
    assert {"velocity", "gyro", "depth"} <= units(proposal).keys()


def test_dates_under_a_name_of_another_language_are_the_time_and_told():
    times = tuple(f"2026-07-03 09:15:{t:06.3f}" for t in np.arange(0.0, 50.0, 0.1))
    columns = {name: values[: len(times)] for name, values in usual(READ).items() if name != "t"}
    proposal = propose((Stream("", columns, {"Ort": ("Kiel",) * len(times), "Zeit": times}),), LOG)
    assert proposal.columns.time == TimeColumn("Zeit", "iso")
    assert proposal.time_reason == "No column is named a time; 'Zeit' holds dates."


@pytest.mark.parametrize(
    ("name", "in_a_second", "said"),
    [
        ("time [min]", 1 / 60, r"its times in 'time \[min\]' are in min; give them in s, ms, us or ns"),
        ("Time (hours)", 1 / 3600, "are in hours; give them in s"),
        ("t_days", 1 / 86_400, "are in days; give them in s"),
        ("time", 1 / 86_400, "if they are days, as spreadsheets and MATLAB count them, give them in s"),
    ],
)
def test_times_in_minutes_hours_or_days_are_refused_and_not_taken_for_seconds(name, in_a_second, said):
    columns = {key: values for key, values in usual(READ).items() if key != "t"}
    with pytest.raises(LogError, match=said):
        proposed({name: 45_000.0 + READ["t"] * in_a_second} | columns)


def test_a_file_without_a_time_or_without_a_known_name_is_refused_in_a_sentence():
    with pytest.raises(
        LogError, match="its times in 'time' do not rise, as where several runs stand in one table"
    ):
        proposed({"time": np.tile(READ["t"][:10], 100), "u": np.zeros(1000)})
    with pytest.raises(LogError, match="no column is a rising time"):
        proposed({"u": READ["velocity"][:, 0]})
    with pytest.raises(LogError, match="holds no rows of numbers"):
        propose((), LOG)
    with pytest.raises(NothingKnown, match="no column but the time is known by its name") as refused:
        proposed({"t": READ["t"], "colour": READ["t"]})
    assert [profile.name for profile in refused.value.seen.profiles] == ["t", "colour"]


def test_columns_that_are_known_by_name_and_have_no_time_are_named():
    motion = Stream("motion", {"u": READ["velocity"][:100, 0], "r": READ["gyro"][:100, 2]}, {})
    clock = Stream("clock", {"time": READ["t"]}, {})
    with pytest.raises(NothingKnown, match=r"motion\.u, motion\.r have no time beside them; save the times"):
        propose((clock, motion), LOG)
    pushed = Stream("pushed", {"time": READ["t"], "T1": READ["pulses"][:, 0]}, {})
    told = "motion.u, motion.r: not used. No 'time' beside them says when they were read."
    assert told in propose((pushed, motion), LOG).notes


def test_a_file_in_which_no_time_passes_says_so_and_does_not_speak_of_runs():
    with pytest.raises(LogError, match=r"log\.csv: holds one row alone, and a motion takes many"):
        proposed({"time": np.zeros(1), "u": np.zeros(1)})
    with pytest.raises(LogError, match="its clock 'time' stands still in all 50 rows; name the column"):
        proposed({"time": np.full(50, 5.0), "u": np.zeros(50)})
    with pytest.raises(LogError, match="holds one message of each topic, and a motion takes many"):
        propose((Stream("/dvl", {"stamp": np.zeros(1), "twist.linear.x": np.ones(1)}, {}),), LOG)


def bagged(dvl_ahead_s):
    """Two topics as in a bag, that of the DVL with its header's clock so much ahead."""
    at_s = READ["t"] + 1.7e9
    gyro = {f"angular_velocity.{axis}": READ["gyro"][:, k] for k, axis in enumerate("xyz")}
    twist = {f"twist.linear.{axis}": READ["velocity"][:, k] for k, axis in enumerate("xyz")}
    return (
        Stream("/imu", gyro | {"stamp": at_s, "received": at_s + 0.01}, {}),
        Stream("/dvl", twist | {"stamp": at_s + dvl_ahead_s, "received": at_s + 0.01}, {}),
    )


def test_topics_on_two_clocks_are_taken_by_the_one_of_the_log_and_it_is_said():
    whole = propose(bagged(0.0), LOG)
    assert (whole.columns.time, whole.time_reason) == (TimeColumn("stamp", "s"), "")
    apart = propose(bagged(-1.7e9), LOG)
    assert apart.columns.time == TimeColumn("received", "s")
    assert apart.time_reason.startswith("By 'stamp', /dvl runs from 0.0 to ")
    assert "check time" not in str(apart.notes)
    assert mapped(bagged(-1.7e9), apart.columns, LOG).velocity.time_s[0] == pytest.approx(1.7e9 + 0.01)


def test_two_clocks_that_run_seconds_apart_are_known_by_the_log_that_heard_both():
    late = propose(bagged(-7.0), LOG)
    assert late.columns.time == TimeColumn("received", "s")
    assert late.time_reason.startswith(
        "By 'stamp', the log got /dvl 7.01 s after its headers' times, and /imu 0.01 s;"
    )
    by_stamp = mapped(bagged(-7.0), replace(late.columns, time=TimeColumn("stamp", "s")), LOG)
    assert any("they may be on two clocks; 'received', the log's, is one." in note for note in by_stamp.notes)
    assert not any("two clocks" in note for note in mapped(bagged(-0.5), late.columns, LOG).notes)


def test_headers_that_are_half_a_second_older_than_others_are_asked_about():
    old = propose(bagged(-0.5), LOG)
    assert old.columns.time == TimeColumn("stamp", "s")
    assert old.notes[0] == (
        "By 'stamp', the log got /dvl 0.51 s after its headers' times, and /imu 0.01 s: taken for the age of its "
        "readings; if a clock is off instead, take 'received'."
    )
    assert "headers" not in str(propose(bagged(-0.1), LOG).notes)


def test_topics_on_two_clocks_without_a_common_one_are_told():
    streams = tuple(
        Stream(stream.name, {name: cells for name, cells in stream.columns.items() if name != "received"}, {})
        for stream in bagged(-1.7e9)
    )
    proposal = propose(streams, LOG)
    assert proposal.columns.time == TimeColumn("stamp", "s")
    assert proposal.notes[0].endswith("no signal was held against another. Name one clock of all.")


def test_topics_without_a_common_time_are_told_where_both_are_used():
    rows = len(READ["t"])
    dvl = Stream(
        "dvl",
        {"stamp": READ["t"] + 5000.0, **{axis: READ["velocity"][:, k] for k, axis in enumerate("uvw")}},
        {},
    )
    imu = Stream(
        "imu", {"stamp": READ["t"], **{axis: READ["gyro"][:, k] for k, axis in enumerate("pqr")}}, {}
    )
    other = Stream("log", {"stamp": READ["t"] + 9000.0, "load": np.arange(float(rows))}, {})
    (said,) = [note for note in propose((dvl, imu, other), LOG).notes if "in common" in note]
    assert said.startswith("imu runs from 0.0 to ")
    assert said.endswith(
        ": they have no time in common, and may be on two clocks. No signal of one was held against one of the other."
    )
    together = propose((replace(dvl, columns=dvl.columns | {"stamp": READ["t"]}), imu), LOG)
    assert "in common" not in str(together.notes)


def test_an_attitude_that_never_changes_is_not_taken_for_one():
    rows = len(READ["t"])
    quaternion = {f"orientation.{axis}": np.full(rows, float(axis == "w")) for axis in "xyzw"}
    gyro = {f"angular_velocity.{axis}": READ["gyro"][:, k] for k, axis in enumerate("xyz")}
    imu = Stream("/imu", {"stamp": READ["t"], **quaternion, **gyro}, {})
    alone = propose((imu,), LOG)
    assert alone.columns.quaternion is None
    assert any("not used for quaternion. They never change" in note for note in alone.notes)
    angles = {f"vector.{axis}": READ["euler"][:, k] for k, axis in enumerate("xyz")}
    proposal = propose((imu, Stream("/attitude/rpy", {"stamp": READ["t"], **angles}, {})), LOG)
    assert proposal.columns.euler.columns == tuple(f"/attitude/rpy.vector.{axis}" for axis in "xyz")


def test_angles_in_the_fields_of_a_quaternion_are_not_taken_for_one():
    angles = {f"orientation.{axis}": 3.0 * READ["euler"][:, k] for k, axis in enumerate("xyz")}
    odom = Stream("/odom", {"stamp": READ["t"], **angles, "orientation.w": np.zeros(len(READ["t"]))}, {})
    speed = {f"twist.linear.{axis}": READ["velocity"][:, k] for k, axis in enumerate("xyz")}
    proposal = propose((odom, Stream("/dvl", {"stamp": READ["t"], **speed}, {})), LOG)
    assert proposal.columns.quaternion is None
    assert "and a quaternion's is 1: if they are angles, name them under `euler`" in str(proposal.notes)


def test_a_quaternion_that_is_nothing_before_the_filter_runs_is_still_one():
    late = np.where(np.arange(len(READ["t"]))[:, None] < 20, 0.0, READ["attitude"])
    imu = {f"orientation.{axis}": late[:, k] for k, axis in enumerate("wxyz")}
    earth = {f"velocity_ned.{k}": np.full(len(READ["t"]), 0.1) for k in range(3)}
    earth["velocity_ned.0"] = np.sin(READ["t"])
    streams = (
        Stream("/imu", {"stamp": READ["t"], **imu}, {}),
        Stream("/ins", {"stamp": READ["t"], **earth}, {}),
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        proposal = propose(streams, LOG)
        dive = mapped(streams, proposal.columns, LOG)
    assert proposal.columns.quaternion is not None
    assert np.isnan(dive.attitude.value[:20]).all()
    assert np.isfinite(dive.attitude.value[20:]).all()
    # A velocity that nothing turned is none that the DVL missed.
    assert len(dive.velocity) == len(READ["t"]) - 20
    assert np.isfinite(dive.velocity.value).all()


def test_an_accelerometer_in_the_field_of_a_position_is_not_taken_for_a_depth():
    shaken = -980.0 + 30.0 * np.random.default_rng(3).normal(size=len(READ["t"]))
    scaled = Stream("/scaled_imu", {"stamp": READ["t"], "pose.position.z": shaken}, {})
    odom = Stream("/odom", {"stamp": READ["t"], "pose.position.z": READ["depth"]}, {})
    proposal = propose((scaled, odom), LOG)
    assert proposal.columns.depth.columns == ("/odom.pose.position.z",)
    assert "/scaled_imu.pose.position.z: not used for depth. It jumps by" in str(proposal.notes)


def test_a_field_that_no_sensor_fills_is_not_taken_for_a_depth():
    rows = len(READ["t"])
    odom = Stream("/odom", {"stamp": READ["t"], "pose.position.z": np.zeros(rows)}, {})
    pressure = Stream(
        "/pressure", {"stamp": READ["t"], "fluid_pressure": 101325.0 + 9790.0 * READ["depth"]}, {}
    )
    proposal = propose((odom, pressure), LOG)
    assert proposal.columns.depth is None
    assert proposal.columns.pressure is not None
    assert "/odom.pose.position.z: not used for depth. It never changes" in str(proposal.notes)
    beside = propose((odom, Stream("/depth", {"stamp": READ["t"], "data": READ["depth"]}, {})), LOG)
    assert beside.columns.depth.columns == ("/depth.data",)
    assert "never changes" not in str(beside.notes)


@pytest.mark.parametrize("unit", ["", " [m/s2]"])
def test_an_accelerometer_without_gravity_is_left_out_and_told(unit):
    columns = usual(READ)
    moved = READ["force"] - np.median(READ["force"], axis=0)
    axes = {f"acc_{axis}{unit}": moved[:, k] for k, axis in enumerate("xyz")}
    proposal = proposed(
        {name: values for name, values in columns.items() if name not in ("ax", "ay", "az")} | axes
    )
    assert proposal.columns.specific_force is None
    assert "which is gravity in no unit; a specific force includes gravity" in str(proposal.notes)
    assert proposal.columns.velocity.unit == "m/s"


def test_roll_and_pitch_in_radians_beside_a_heading_in_degrees_are_mended():
    columns = usual(READ)
    columns = {name: np.degrees(values) if name == "yaw" else values for name, values in columns.items()}
    proposal = proposed(columns)
    assert proposal.columns.euler.scale == (
        pytest.approx(np.degrees(1.0)),
        pytest.approx(np.degrees(1.0)),
        1.0,
    )
    assert_maps_to_the_truth(table(columns), proposal)


def test_a_clock_that_was_set_by_years_between_two_rows_is_said_and_fills_no_memory():
    columns = {**usual(READ), "t": READ["t"] + np.where(READ["t"] > 20.0, 1.79e12, 0.0)}
    notes = " ".join(proposed(columns).notes)
    assert "No signal was held against another, as this map reads no dive." in notes
    assert "its times lie 2.07e+07 days apart" in notes


def test_why_a_map_reads_no_dive_is_said_when_it_is_proposed():
    columns = usual(READ)
    words = tuple(f"02/29/2024 11:{k // 60 % 60:02d}:{k % 60:02d} PM" for k in range(len(columns.pop("t"))))
    (note,) = (note for note in propose((Stream("", columns, {"time": words}),), LOG).notes if "held" in note)
    assert (
        f"No signal was held against another, as this map reads no dive. {LOG}: '02/29/2024 11:00:00 PM'"
        in note
    )
    twice = {name: np.concatenate([values, values]) for name, values in usual(READ).items()}
    assert "as where several runs stand one below another" in str(proposed(twice).notes)


@pytest.mark.parametrize("name", ["thr", "u_cmd", "commands"])
def test_an_array_of_thrusters_is_known_by_the_names_that_a_thesis_gives_it(name):
    columns = {f"{name}.{k}": np.sin(READ["t"] + k) for k in range(6)}
    found = proposed({"t": READ["t"], **columns}).columns
    assert found.pwm.columns == tuple(columns)
    assert proposed({"t": READ["t"], **columns, "tau_cmd.0": READ["t"]}).columns.pwm.columns == tuple(columns)


def test_without_velocity_and_rate_of_turn_the_attitude_is_said_to_tell_the_motion():
    angles = {name: READ["euler"][:, k] for k, name in enumerate(("roll", "pitch", "yaw"))}
    assert "attitude alone tells the motion" in proposed({"t": READ["t"], **angles}).notes[-1]
    deep = {"t": READ["t"], **angles, "depth": READ["depth"]}
    assert "attitude and depth alone tell the motion" in proposed(deep).notes[-1]
    assert "name their columns in the map" in proposed({"t": READ["t"], "depth": READ["depth"]}).notes[-1]
    assert "attitude" not in proposed({"t": READ["t"], "depth": READ["depth"]}).notes[-1]


def test_a_guess_is_a_comment_of_the_map_and_what_the_values_prove_is_none():
    text = map_text(
        proposed({"t": READ["t"], "u": READ["velocity"][:, 0], "depth": READ["depth"]}), "log.csv"
    )
    lines = text.splitlines()
    assert lines[lines.index("depth: {columns: [depth], unit: m}") - 1] == "# Depth is taken for metres."
    whole = map_text(proposed(usual(READ)), "log.csv").splitlines()
    assert [line for line in whole if line.startswith("#")] == whole[:2]


@pytest.mark.parametrize("name", ["Depth_test_3", "Yaw_test_4", "Yaw_test_7", "yaw_test"])
def test_real_step_tests_are_mapped_as_by_the_map_that_was_written_by_hand(name):
    path = shared("data", "bolt_auv", f"{name}.csv")
    by_hand = column_map("bolt")
    assert propose(read_table(path).streams, path).columns == by_hand


def test_a_column_without_a_name_that_rises_by_equal_steps_is_the_time_and_a_count_of_rows_is_none():
    columns = usual(READ)
    rows = len(next(iter(columns.values())))
    unnamed = {name: values for name, values in columns.items() if name != "t"}
    proposal = proposed({"run.0": np.arange(rows) * 0.02, **unnamed})
    assert (proposal.columns.time.column, proposal.columns.time.unit) == ("run.0", "s")
    assert proposal.time_reason == (
        "No column is named a time; 'run.0' rises by equal steps throughout: taken for s."
    )
    with pytest.raises(LogError, match="no column is a rising time"):
        proposed({"run.0": np.arange(rows) * 1.0, **unnamed})


def test_a_clock_whose_name_ends_in_volt_is_no_voltage():
    columns = usual(READ)
    clock = np.arange(len(next(iter(columns.values())))) * 0.2 + 2190.9
    proposal = proposed({**columns, "t_s_volt": clock})
    assert "voltage" not in proposal.columns.signals()
    assert (
        "t_s_volt: not used for voltage. It rises from each row to the next, as a clock does."
        in proposal.notes
    )
    sagging = proposed({**columns, "t_s_volt": 16.0 - clock * 1e-4})
    assert sagging.columns.voltage.unit == "V"


@pytest.mark.parametrize("offset", [-20.0, 20.0])
@pytest.mark.parametrize("up", [False, True])
def test_the_sign_of_a_position_is_that_of_its_motion_wherever_it_counts_from(offset, up):
    axes = np.array([1.0, -1.0, -1.0] if up else [1.0, 1.0, 1.0])
    columns = {"t": READ["t"], "z": offset + (-READ["depth"] if up else READ["depth"])}
    for names, key in (("uvw", "velocity"), ("pqr", "gyro"), (("roll", "pitch", "yaw"), "euler")):
        columns |= dict(zip(names, (READ[key] * axes).T, strict=True))
    columns |= dict(zip(("ax", "ay", "az"), (READ["force"] * axes).T, strict=True))
    proposal = proposed(columns)
    assert proposal.columns.depth.scale == ((-1.0,) if up else ())
    dive = mapped(table(columns), proposal.columns, LOG)
    assert dive.velocity.value == pytest.approx(READ["velocity"])


def test_a_position_that_is_only_set_off_is_not_turned_round_and_one_that_went_down_from_0_is():
    t = READ["t"]
    speed = {"u": READ["velocity"][:, 0]}
    held = proposed({"t": t, **speed, "pose.position.z": -0.3 + 0.02 * np.sin(t)})
    assert held.columns.depth.scale == ()
    (depth,) = (choice for choice in held.choices if choice.signal == "depth")
    assert "It is a position, which may count from elsewhere than the surface." in uncertain(depth)
    dived = proposed({"t": t, **speed, "pose.position.z": -2.0 + 2.0 * np.cos(0.1 * t)})
    assert dived.columns.depth.scale == (-1.0,)
    named = proposed({"t": t, **speed, "depth": -3.0 + 0.02 * np.sin(t)})
    assert named.columns.depth.scale == (-1.0,)


def test_the_z_of_a_wrench_is_no_depth_whose_motion_turns_the_axes_round():
    at_s = np.linspace(0.0, 60.0, 1201)
    columns = {"time": at_s, "u": 0.2 * np.sin(at_s), "v": 0.1 * np.cos(at_s), "w": 0.1 * np.sin(0.5 * at_s)}
    columns |= {axis: (4.0 + k) * np.sin(at_s / (k + 2.0)) for k, axis in enumerate("XYZKMN")}
    proposal = proposed(columns)
    assert "depth" not in units(proposal)
    assert proposal.columns.tau_cmd.columns == tuple("XYZKMN")


@pytest.mark.parametrize("names", [("escStatus.rpm1", "escStatus.rpm2"), ("pwm_1", "pwm_2")])
def test_outputs_that_nothing_drives_are_not_the_vehicles_thrusters(names):
    columns = usual(READ)
    columns = {name: cells for name, cells in columns.items() if not name.startswith("T")}
    proposal = proposed(columns | dict.fromkeys(names, 0.0 * READ["depth"]))
    assert not {"rpm", "pwm"} & units(proposal).keys()
    assert any("never change" in note for note in proposal.notes)


@pytest.mark.parametrize("name", ["timestamp_abs", "timestamp_rel", "time_absolute"])
def test_a_stamp_that_says_which_of_two_it_is_is_a_time(name):
    columns = usual(READ)
    time = next(iter(columns))
    uneven = columns[time] + 0.005 * np.sin(1.7 * np.arange(len(columns[time])))
    renamed = {name: uneven} | {each: cells for each, cells in columns.items() if each != time}
    assert proposed(renamed).columns.time.column == name


def test_a_range_to_a_beacon_is_no_altitude():
    streams = table(usual(READ))
    beacon = replace(streams[0], name="usbl", columns={
        next(iter(streams[0].columns)): next(iter(streams[0].columns.values())), "range": 5.0 + READ["depth"],
    })  # fmt: skip
    assert "altitude" not in units(propose([*streams, beacon], LOG))
