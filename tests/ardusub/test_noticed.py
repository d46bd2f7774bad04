"""What may be wrong beside ArduSub: each is said in one sentence with the way out, and nothing is taken or added."""

from dataclasses import replace

import pytest
from fakes.ardusub import Ardusub
from rig import FILE, Aboard, Pilot, ready, taken

from bridge.vehicle.mode import Mode

WAIT_S = 25.0
SHAPE = FILE.vehicle.configurations["standard"]


def fitted(motors):
    """The vehicle file of a vehicle whose outputs drive these motors."""
    shape = replace(SHAPE, thrusters=tuple(SHAPE.thrusters[motor - 1] for motor in motors))
    return replace(FILE, vehicle=replace(FILE.vehicle, configurations={"standard": shape}))


def afloat(changes, file=FILE, store=None):
    fake = Ardusub()
    for name, value in changes.items():
        if value is None:
            del fake.parameters[name]
        else:
            fake.parameters[name] = value
    aboard, pilot = Aboard(fake, Mode.BOTH, file=file, store=store), Pilot(fake)
    return fake, aboard, pilot


SWAPPED = {"SERVO1_FUNCTION": 36.0, "SERVO4_FUNCTION": 33.0}
WRONG = {
    "outputs wired otherwise than the file": (
        SWAPPED,
        "no feed-forward: the thrusters of the vehicle file do not push as ArduSub's frame takes them to: make the "
        "file anew by seatrial vehicle guess, or mend SERVOn_FUNCTION and MOT_n_DIRECTION",
    ),
    "a motor turned round": (
        {"MOT_5_DIRECTION": -1.0},
        "no feed-forward: the thrusters of the vehicle file do not push as ArduSub's frame takes them to: make the "
        "file anew by seatrial vehicle guess, or mend SERVOn_FUNCTION and MOT_n_DIRECTION",
    ),
    "an output that drives nothing": (
        {"SERVO3_FUNCTION": 0.0},
        "no feed-forward: no output drives motor 3 of the frame vectored: set SERVOn_FUNCTION to 35 for the outputs "
        "that they are wired to",
    ),
    "another frame": (
        {"FRAME_CONFIG": 3.0},
        "no feed-forward: FRAME_CONFIG 3 is not supported: 1 (vectored) and 2 (vectored_6dof) are",
    ),
    "the frame of another vehicle": (
        {"FRAME_CONFIG": 2.0},
        "no feed-forward: FRAME_CONFIG 2 has not 6 thrusters: name that vehicle's own file",
    ),
    "firmware of 4.7": (
        {"SYSID_MYGCS": None, "MAV_GCS_SYSID": 255.0},
        "no feed-forward: no SYSID_MYGCS: from 4.7 on ArduSub has MAV_GCS_SYSID, use 4.5 or 4.6",
    ),
    "no fail-safe": (
        {"FS_GCS_ENABLE": 0.0},
        "no feed-forward: FS_GCS_ENABLE must stop the vehicle: set it to 2",
    ),
}


@pytest.mark.parametrize(("changes", "sentence"), WRONG.values(), ids=WRONG)
def test_what_is_wrong_is_said_with_the_way_out_and_the_sticks_are_not_taken(changes, sentence):
    fake, aboard, pilot = afloat(changes)
    assert fake.until(lambda: sentence in pilot.texts(), WAIT_S, aboard, pilot), pilot.texts()
    fake.run(2.0, aboard, pilot)
    assert not taken(aboard)
    assert pilot.texts().count(sentence) == 1
    assert not fake.writes


def test_a_file_that_is_wired_as_the_vehicle_is_taken():
    fake, aboard, pilot = afloat(SWAPPED, fitted((4, 2, 3, 1, 5, 6)))
    assert fake.until(lambda: taken(aboard), WAIT_S, aboard, pilot), pilot.texts()


def test_a_sysid_that_a_crash_left_is_put_back_and_said_even_where_no_file_remembers_it():
    fake, aboard, pilot = afloat({"SYSID_MYGCS": 1.0})
    aboard.set_mode(Mode.OFF)
    said = {"SYSID_MYGCS was left at 1: putting it back", "sticks given back: SYSID_MYGCS 255"}
    assert fake.until(lambda: said <= set(pilot.texts()), WAIT_S, aboard, pilot), pilot.texts()
    assert fake.parameters["SYSID_MYGCS"] == 255


def test_a_second_ground_station_that_writes_is_named_with_what_to_do():
    fake, aboard, pilot = afloat({})
    ready(fake, aboard, pilot)
    assert fake.until(lambda: taken(aboard), WAIT_S, aboard, pilot)
    other = Pilot(fake, system=254)
    other.flies = False
    other.write("FF_MODE", 0.0, component=191)
    fake.run(1.0, aboard, pilot, other)
    assert aboard.parameters.mode is Mode.BOTH
    assert any("orders from system 254 are refused" in text for text in pilot.texts())
    other.write("SYSID_MYGCS", 254.0)
    sentence = "sticks lost: SYSID_MYGCS set to 254 by another program: end it, then FF_MODE 0 and on again"
    assert fake.until(lambda: sentence in pilot.texts(), WAIT_S, aboard, pilot, other), pilot.texts()


def test_two_programs_that_send_sticks_are_said():
    fake, aboard, pilot = afloat({})
    fake.armed = True
    other = Pilot(fake, component=25)
    sentence = "FF off: two programs send sticks: end one"
    assert fake.until(lambda: sentence in pilot.texts(), WAIT_S, aboard, pilot, other), pilot.texts()
