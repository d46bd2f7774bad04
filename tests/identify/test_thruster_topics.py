"""A bag with a topic for each thruster, as simulators on Gazebo publish them, gives the commands of all thrusters."""

from pathlib import Path

import numpy as np
import pytest
from bags_made import ROS1, START_NS, STEP_NS, swim, write_bag

from identify.ingest.files.streams import Stream
from identify.ingest.mapping.proposal_of_runs import propose
from identify.ingest.mapping.signals import dive_fields
from identify.ingest.ros.bags import read_bag
from identify.ingest.ros.thruster_topics import joined_thrusters

LATE_NS = 2_000_000


def test_the_forces_of_a_topic_for_each_thruster_are_proposed_and_read(tmp_path):
    kind = {name.rpartition("/")[2]: made for name, made in ROS1.types.items()}
    messages = [each for each in swim(ROS1, 200) if each[0] != "/thrusters"]
    for k in range(200):
        time_ns = START_NS + k * STEP_NS
        for number in range(3):
            order = kind["Float64"](30.0 * np.sin(k + number))
            topic_of = f"/rov2/thrusters/{number}/thrust"
            messages.append((topic_of, "std_msgs/msg/Float64", time_ns + number * LATE_NS, order))
    path = write_bag(tmp_path, "bag", messages)
    streams = read_bag([path])
    orders = next(stream for stream in streams.streams if stream.name == "/rov2/thrusters/*/thrust")
    assert list(orders.columns) == ["data.0", "data.1", "data.2", "received", "stamp"]
    proposal = propose(streams.streams, path)
    columns = proposal.columns.pwm
    assert columns is not None
    assert columns.columns == tuple(f"/rov2/thrusters/*/thrust.data.{k}" for k in range(3))
    pwm = dive_fields(streams, proposal.columns, path)["thrust_cmd"]
    assert pwm.value[7] == pytest.approx(30.0 * np.sin([7, 8, 9]))


def topic(name, stamp, values):
    stamp = np.array(stamp, float)
    return Stream(name, {"data": np.array(values, float), "received": stamp, "stamp": stamp}, {})


def test_of_the_other_thrusters_the_nearest_message_counts_and_none_beyond_a_step():
    first = topic("/thruster1/force", [0.0, 0.1, 0.2, 0.3], [1, 2, 3, 4])
    other = topic("/thruster2/force", [0.14, 0.02], [20, 10])
    (joined,) = joined_thrusters((first, other, topic("/battery2", [0.0], [12.0])))
    assert joined.name == "/thruster*/force"
    assert joined.columns["data.1"].tolist() == [1, 2, 3, 4]
    assert joined.columns["data.2"] == pytest.approx([10, 20, 20, np.nan], nan_ok=True)


def test_a_single_thruster_stays_as_it_is():
    assert joined_thrusters((topic("/thruster1/force", [0.0, 0.1], [1, 2]),)) == ()


def test_forces_are_taken_before_orders_and_their_own_clock_alone_counts():
    times = np.arange(0.0, 40.0, 0.1)
    streams = [
        topic(f"/thrusters/{k}/{name}", times + start, size * np.sin(times + k))
        for k in range(3)
        for name, start, size in (("input", 1.7e9, 300.0), ("thrust", 0.0, 30.0))
    ]
    turning = {f"angular_velocity.{axis}": np.sin(times) for axis in "xyz"} | {
        "received": times,
        "stamp": times,
    }
    streams += [Stream("/imu", turning, {}), *joined_thrusters(streams)]
    columns = propose(tuple(streams), Path("log.bag")).columns
    assert columns.pwm is not None
    assert columns.pwm.columns[0] == "/thrusters/*/thrust.data.0"
    assert (columns.pwm.unit, columns.time.column) == ("N", "stamp")
