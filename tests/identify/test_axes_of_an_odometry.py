"""Axes of an odometry, told by its own position; and whether an orientation is angles or a quaternion."""

from pathlib import Path

import numpy as np
import pytest
from turning_vehicle import STEP_S, readings, table, usual

from identify.dive import Dive
from identify.ingest.files.streams import Stream, Streams
from identify.ingest.mapping.map_text import uncertain
from identify.ingest.mapping.proposal_of_runs import propose
from identify.ingest.mapping.signals import dive_fields
from identify.ingest.rotation import to_earth

LOG = Path("log.bag")
READ = readings()
T = READ["t"]
EARTH = to_earth(READ["attitude"], READ["velocity"])
PLACE = np.array([3.0, -7.0, 5.0]) + STEP_S * np.cumsum(EARTH, axis=0)
UP = np.array([1.0, -1.0, -1.0])


def odometry(topic, velocity):
    """As ROS writes it, in axes x, left, up: of the earth's its own."""
    turn = READ["attitude"] * np.array([1.0, 1.0, -1.0, -1.0])
    columns = {"stamp": T}
    columns |= {f"pose.pose.position.{a}": (PLACE * UP)[:, k] for k, a in enumerate("xyz")}
    columns |= {f"pose.pose.orientation.{a}": turn[:, k] for k, a in enumerate("wxyz")}
    columns |= {f"twist.twist.linear.{a}": (velocity * UP)[:, k] for k, a in enumerate("xyz")}
    return Stream(topic, columns, {})


IMU = Stream(
    "/imu/data",
    {"stamp": T, **{f"angular_velocity.{a}": (READ["gyro"] * UP)[:, k] for k, a in enumerate("xyz")}},
    {},
)


def velocity_of(streams):
    """Its columns, its values and what is asked of it; in axes forward, left, up where nothing tells of y and z."""
    proposal = propose(streams, LOG)
    dive = Dive("log", LOG, "", **dive_fields(Streams(streams), proposal.columns, LOG))
    (choice,) = (each for each in proposal.choices if each.signal == "velocity")
    return proposal.columns.velocity, dive.velocity.value, " ".join(uncertain(choice))


def test_a_twist_in_the_axes_of_its_position_is_turned_by_its_attitude_and_told():
    columns, value, asked = velocity_of((odometry("/odom", EARTH), IMU))
    assert columns.frame == "NED"
    assert value == pytest.approx(READ["velocity"] * UP, abs=1e-6)
    assert (
        "It is in earth axes, those of the attitude: its position moves as it says but for 0 % as it is"
        in asked
    )


def test_the_attitude_of_the_odometry_turns_it_and_not_that_of_another_compass():
    other = {f"orientation.{a}": np.roll(READ["attitude"], 3, axis=0)[:, k] for k, a in enumerate("wxyz")}
    imu = Stream(IMU.name, {**IMU.columns, **other}, {})
    _, value, _ = velocity_of((odometry("/odom", EARTH), imu))
    assert value == pytest.approx(READ["velocity"] * UP, abs=1e-6)


@pytest.mark.parametrize("topic", ["/odom", "/mavros/local_position/odom"])
def test_a_twist_in_the_body_s_axes_stays_in_them_also_where_its_topic_is_named_as_one_of_the_earth(topic):
    columns, value, _ = velocity_of((odometry(topic, READ["velocity"]), IMU))
    assert columns.frame == "FRD"
    assert value == pytest.approx(READ["velocity"] * UP, abs=1e-6)


def test_of_a_table_too_the_position_tells_the_axes():
    columns = {"t": T, **dict(zip(("roll", "pitch", "yaw"), READ["euler"].T, strict=True))}
    columns |= dict(zip(("x", "y", "z"), PLACE.T, strict=True)) | dict(
        zip(("vx", "vy", "vz"), EARTH.T, strict=True)
    )
    mapped, value, _ = velocity_of(table(columns))
    assert mapped.frame == "NED"
    assert value == pytest.approx(READ["velocity"], abs=1e-6)


def test_where_it_never_turns_or_the_position_is_another_the_axes_stay_as_named():
    straight = odometry("/odom", READ["velocity"])
    still = {
        name: np.full(len(T), float(name.endswith("w"))) for name in straight.columns if "orientation" in name
    }
    for spoilt in (still, {"pose.pose.position.x": np.sin(T)}):
        columns, _, asked = velocity_of((Stream("/odom", {**straight.columns, **spoilt}, {}), IMU))
        assert columns.frame == "FRD"
        assert "its position moves" not in asked


ANGLES = ("roll", "pitch", "yaw")


def proposed(columns):
    return propose(table(columns), Path("log.csv"))


@pytest.mark.parametrize("names", ["orientation.{}", "field.orientation.{}", "attitude_{}"])
def test_three_numbers_of_an_orientation_are_roll_pitch_and_yaw(names):
    columns = {name: value for name, value in usual(READ).items() if name not in ANGLES}
    named = [names.format(axis) for axis in "xyz"]
    columns |= dict(zip(named, READ["euler"].T, strict=True))
    proposal = proposed(columns)
    assert proposal.columns.euler.columns == tuple(named)
    assert proposal.columns.euler.unit == "rad"
    assert proposal.columns.quaternion is None


def test_the_imaginary_part_of_a_quaternion_alone_is_no_angles():
    columns = {name: value for name, value in usual(READ).items() if name not in ANGLES}
    columns |= {f"q{axis}": READ["attitude"][:, k + 1] for k, axis in enumerate("xyz")}
    assert proposed(columns).columns.euler is None


def test_four_numbers_of_an_orientation_are_a_quaternion():
    columns = {name: value for name, value in usual(READ).items() if name not in ANGLES}
    columns |= {f"orientation.{axis}": READ["attitude"][:, k] for k, axis in enumerate("wxyz")}
    proposal = proposed(columns)
    assert proposal.columns.quaternion.columns == tuple(f"orientation.{axis}" for axis in "wxyz")
    assert proposal.columns.euler is None
