"""Whom an OFF goes to is kept of those who beat or told FF_MODE, and of nobody else."""

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.framing import Encoder, Framer
from bridge.messages.readings import Reading, encode
from gcs_plugin.known_vehicles import KNOWN_FOR_S, PASSED_BY_S, KnownVehicle, KnownVehicles, newest

BEAT = dialect.MAVLink_heartbeat_message(dialect.MAV_TYPE_SUBMARINE, 0, 0, 0, 4, 3)
OF_GROUND = dialect.MAVLink_heartbeat_message(dialect.MAV_TYPE_GCS, 8, 0, 0, 4, 3)
TOLD = dialect.MAVLink_param_value_message(b"FF_MODE", 3.0, 9, 1, 0)
OTHER = dialect.MAVLink_param_value_message(b"FF_MODES", 3.0, 9, 1, 0)
ORDER = dialect.MAVLink_param_set_message(1, 1, b"FF_MODE", 3.0, 9)


def hear(known, source, message, time_s):
    for frame in Framer().feed(Encoder(*source).encode(message)):
        known.on_frame(frame, time_s)


@pytest.mark.parametrize("message", [OF_GROUND, ORDER, OTHER])
def test_nobody_is_known_by_what_only_names_the_mode_or_beats_as_a_ground(message):
    known = KnownVehicles()
    hear(known, (255, 190), message, 1.0)
    assert known.at(1.0) == ()


def test_who_told_the_mode_stays_known_for_a_dive_and_who_only_beat_for_a_minute():
    known = KnownVehicles()
    hear(known, (1, 1), TOLD, 1.0)
    hear(known, (1, 1), BEAT, 2.0)
    hear(known, (2, 1), BEAT, 2.0)
    holder, passer = KnownVehicle((1, 1), True, 2.0), KnownVehicle((2, 1), False, 2.0)
    assert known.at(2.0 + PASSED_BY_S) == (holder, passer)
    assert known.at(2.1 + PASSED_BY_S) == (holder,)
    assert known.at(2.1 + KNOWN_FOR_S) == ()


def test_telemetry_of_the_mode_makes_a_vehicle_known_without_a_beat():
    known = KnownVehicles()
    for frame in Framer().feed(Encoder(4, 191).frame(*encode(Reading("ff_mode", 0.0, (2.0,))))):
        known.on_frame(frame, 5.0)
    assert known.at(5.0) == (KnownVehicle((4, 191), True, 5.0),)


def test_of_what_two_know_the_newest_of_each_counts():
    old, new, other = (KnownVehicle((1, 1), True, t) for t in (1.0, 2.0, 0.0))
    other = KnownVehicle((2, 1), False, 0.0)
    assert newest([new, other, old]) == (other, new)
