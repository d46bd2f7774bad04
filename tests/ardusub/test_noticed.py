"""What the companion says when something is wrong beside ArduSub: one sentence with the remedy; the sticks stay."""

import socket
import threading
from dataclasses import replace
from types import SimpleNamespace

import pytest
from fakes.ardusub import Ardusub
from fakes.ports import free_port
from pymavlink.dialects.v20 import ardupilotmega as dialect
from rig import FILE, Aboard, Pilot, orders, ready, taken
from soak import rows_rest_in_soak

from bridge import exit_codes
from bridge.ardusub.companion import ANOTHER, APPLET, NO_ARDUSUB
from bridge.links.link import memory_pair
from bridge.onboard import program
from bridge.vehicle.mode import Mode
from bridge.wire.framing import Encoder, Framer, decode
from gcs_plugin.feedforward.switch import Switch

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
    "a fail-safe that only warns": (
        {"FS_GCS_ENABLE": 1.0},
        "no feed-forward: FS_GCS_ENABLE must stop the vehicle: set it to 2",
    ),
    "no fail-safe of the pilot's": (
        {"FS_PILOT_INPUT": 0.0},
        "no feed-forward: FS_PILOT_INPUT must stop the vehicle: set it to 2",
    ),
    "a fail-safe of the pilot's that only warns": (
        {"FS_PILOT_INPUT": 1.0},
        "no feed-forward: FS_PILOT_INPUT must stop the vehicle: set it to 2",
    ),
    "a fail-safe of the pilot's of which nobody knows how long it waits": (
        {"FS_PILOT_TIMEOUT": None},
        "no feed-forward: FS_PILOT_TIMEOUT is not read yet: wait, or look at the autopilot's link",
    ),
    "a fail-safe of the pilot's that waits too long": (
        {"FS_PILOT_TIMEOUT": 10.0},
        "no feed-forward: FS_PILOT_TIMEOUT is 10 s: set it to 5 or less",
    ),
}


@pytest.mark.parametrize(("changes", "sentence"), WRONG.values(), ids=WRONG)
def test_what_is_wrong_is_said_with_the_way_out_and_the_sticks_are_not_taken(changes, sentence):
    fake, aboard, pilot = afloat(changes)
    assert fake.until(lambda: sentence in pilot.words(), WAIT_S, aboard, pilot), pilot.texts()
    fake.run(2.0, aboard, pilot)
    assert not taken(aboard)
    assert pilot.words().count(sentence) == 1
    assert not fake.writes


def test_a_fail_safe_that_waits_too_long_is_said_and_once_it_is_shorter_the_sticks_are_taken():
    fake, aboard, pilot = afloat({"FS_GCS_TIMEOUT": 30.0})
    fake.version = (4, 6, 0)
    sentence = "no feed-forward: FS_GCS_TIMEOUT is 30 s: set it to 5 or less"
    assert fake.until(lambda: sentence in pilot.words(), WAIT_S, aboard, pilot), pilot.texts()
    fake.run(2.0, aboard, pilot)
    assert not taken(aboard)
    pilot.write("FS_GCS_TIMEOUT", 5.0)
    assert fake.until(lambda: taken(aboard), WAIT_S, aboard, pilot), pilot.texts()


def test_the_sticks_are_taken_where_the_fail_safe_of_the_pilot_waits_no_longer_than_may_be():
    fake, aboard, pilot = afloat({"FS_PILOT_TIMEOUT": 5.0})
    assert fake.until(lambda: taken(aboard), WAIT_S, aboard, pilot), pilot.texts()


def test_the_sticks_are_not_taken_before_the_version_is_read():
    fake, aboard, pilot = afloat({})
    fake.version = (0, 0, 0)
    sentence = (
        "no feed-forward: the autopilot's version is not read yet: wait, or look at the autopilot's link"
    )
    assert fake.until(lambda: sentence in pilot.words(), WAIT_S, aboard, pilot), pilot.texts()
    fake.run(2.0, aboard, pilot)
    assert not taken(aboard)
    fake.version = (4, 5, 7)
    assert fake.until(lambda: taken(aboard), WAIT_S, aboard, pilot), pilot.texts()


@pytest.mark.parametrize(
    "version", [(4, 1, 2), (3, 5, 4)], ids=["4.1", "3.5, which sends no message by its number"]
)
def test_a_firmware_older_than_was_tried_is_said_and_once_it_is_updated_the_sticks_are_taken(version):
    fake, aboard, pilot = afloat({})
    fake.version = version
    number = ".".join(map(str, version))
    sentence = f"no feed-forward: ArduSub {number} is too old: update it to 4.5 or 4.6"
    assert fake.until(lambda: sentence in pilot.words(), WAIT_S, aboard, pilot), pilot.texts()
    fake.run(2.0, aboard, pilot)
    assert not taken(aboard)
    fake.version = (4, 5, 0)
    assert fake.until(lambda: taken(aboard), 40.0, aboard, pilot), pilot.texts()


def test_a_file_that_is_wired_as_the_vehicle_is_taken():
    fake, aboard, pilot = afloat(SWAPPED, fitted((4, 2, 3, 1, 5, 6)))
    assert fake.until(lambda: taken(aboard), WAIT_S, aboard, pilot), pilot.texts()


def test_a_sysid_that_a_crash_left_is_put_back_and_said_even_where_no_file_remembers_it():
    fake, aboard, pilot = afloat({"SYSID_MYGCS": 1.0})
    aboard.set_mode(Mode.OFF)
    said = {"SYSID_MYGCS was left at 1: putting it back", "sticks given back: SYSID_MYGCS 255"}
    assert fake.until(lambda: said <= set(pilot.texts()), WAIT_S, aboard, pilot), pilot.texts()
    assert fake.parameters["SYSID_MYGCS"] == 255


@pytest.mark.parametrize(("frame", "value", "says"), [(1.0, 1.0, True), (1.0, 0.0, False), (2.0, 1.0, False)])
def test_a_coupling_that_cuts_surge_is_said_where_the_frame_has_it(frame, value, says):
    fake, aboard, pilot = afloat({"MOT_FV_CPLNG_K": value, "FRAME_CONFIG": frame})
    assert fake.until(lambda: aboard.companion.settings.complete, WAIT_S, aboard, pilot)
    fake.run(2.0, aboard, pilot)
    said = "surge falls short while it climbs or dives hard: MOT_FV_CPLNG_K is 1, set 0"
    assert (said in pilot.words()) == says


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
    assert fake.until(lambda: sentence in pilot.words(), WAIT_S, aboard, pilot, other), pilot.texts()


def test_two_programs_that_send_sticks_are_said():
    fake, aboard, pilot = afloat({})
    fake.armed = True
    other = Pilot(fake, component=25)
    sentence = "FF off: two programs send sticks: end one"
    assert fake.until(lambda: sentence in pilot.words(), WAIT_S, aboard, pilot, other), pilot.texts()


OTHER_FRAME = WRONG["another frame"]


def told(mode, changes=OTHER_FRAME[0]):
    """A vehicle that can't be flown by its companion, which has said so once."""
    fake, aboard, pilot = afloat(changes)
    aboard.set_mode(mode)
    assert fake.until(lambda: OTHER_FRAME[1] in pilot.words(), WAIT_S, aboard, pilot), pilot.texts()
    return fake, aboard, pilot


@pytest.mark.parametrize(
    ("mode", "times"), rows_rest_in_soak([(Mode.BOTH, 2), (Mode.OFF, 1), (Mode.SHADOW, 2)], keep=2)
)
def test_a_trouble_is_said_again_every_half_minute_while_a_mode_needs_the_companion(mode, times):
    fake, aboard, pilot = told(mode)
    fake.run(32.0, aboard, pilot)
    assert pilot.words().count(OTHER_FRAME[1]) == times


def test_a_ground_that_comes_later_is_told_of_the_trouble_too():
    fake, aboard, pilot = told(Mode.OFF)
    pilot.beats = pilot.flies = False
    fake.run(15.0, aboard, pilot)
    pilot.heard.clear()
    pilot.beats = True
    assert fake.until(lambda: OTHER_FRAME[1] in pilot.words(), 2.0, aboard, pilot)


def test_who_raises_the_feedforward_is_told_why_the_companion_can_not_act():
    fake, aboard, pilot = told(Mode.OFF)
    fake.run(3.0, aboard, pilot)
    switch = Switch(Mode.SHADOW, 1)
    order = orders(pilot, switch)
    pilot.heard.clear()
    assert fake.until(lambda: switch.done, 15.0, aboard, pilot, order), switch.words
    assert switch.words.endswith(f"; but {OTHER_FRAME[1]}")
    assert pilot.words().count(OTHER_FRAME[1]) == 1
    assert aboard.companion.trouble(fake.clock.now_s) == OTHER_FRAME[1], "for its own terminal"


def test_sticks_that_are_not_taken_are_said_with_the_way_out_again_and_again():
    fake, aboard, pilot = afloat({"SYSID_MYGCS": 254.0})
    sentence = (
        "sticks not taken: SYSID_MYGCS is 254, the pilot's system 255: set SYSID_MYGCS to 255, or start the companion "
        "with --ground 254; then FF_MODE 0 and on again"
    )
    assert fake.until(lambda: sentence in pilot.words(), WAIT_S, aboard, pilot), pilot.texts()
    fake.run(31.0, aboard, pilot)
    assert fake.parameters["SYSID_MYGCS"] == 254
    assert pilot.words().count(sentence) == 2
    pilot.write("SYSID_MYGCS", 255.0)
    aboard.set_mode(Mode.OFF)
    fake.run(6.0, aboard, pilot)
    aboard.set_mode(Mode.BOTH)
    assert fake.until(lambda: taken(aboard), WAIT_S, aboard, pilot)


def test_another_program_that_takes_the_sticks_while_the_feedforward_is_off_is_told_once():
    fake, aboard, pilot = afloat({})
    aboard.set_mode(Mode.OFF)
    fake.run(10.0, aboard, pilot)
    assert not [words for words in pilot.words() if "SYSID_MYGCS" in words]
    pilot.write("SYSID_MYGCS", 254.0)
    fake.run(20.0, aboard, pilot)
    sentence = (
        "SYSID_MYGCS is 254: other sticks than those of system 255 fly; "
        "end their program, or set SYSID_MYGCS to 255"
    )
    assert pilot.words().count(sentence) == 1


def test_a_trouble_stands_on_the_companions_own_terminal_too(tmp_path, capsys):
    """Beside a PX4, on the loopback."""
    port, encoder, over = free_port(socket.SOCK_DGRAM), Encoder(1, 1), threading.Event()
    beat = encoder.encode(dialect.MAVLink_heartbeat_message(2, dialect.MAV_AUTOPILOT_PX4, 0, 0, 4, 3))

    def beats():
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as end:
            while not over.wait(0.2):
                end.sendto(beat, ("127.0.0.1", port))

    px4 = threading.Thread(target=beats)
    px4.start()
    try:
        ways = ["--link", f"udpin:127.0.0.1:{port}", "--parameters", str(tmp_path / "p.json")]
        program.main(["--vehicle", "bluerov2", "--ardusub", "--seconds", "3", *ways])
    finally:
        over.set()
        px4.join()
    assert capsys.readouterr().err.count(NO_ARDUSUB) == 1


def test_an_applet_that_runs_beside_the_companion_is_said_and_only_one_of_them_adds():
    fake, aboard, pilot = afloat({})
    assert fake.until(lambda: taken(aboard), WAIT_S, aboard, pilot)
    beat = dialect.MAVLink_named_value_float_message(0, b"FF_MODE", 0.0)
    beats = lambda: fake.send(beat)  # noqa: E731
    sentence = f"no feed-forward: {APPLET}"
    assert fake.until(lambda: sentence in pilot.words(), 1.0, beats, aboard, pilot), pilot.texts()
    assert fake.until(lambda: fake.parameters["SYSID_MYGCS"] == 255, WAIT_S, beats, aboard, pilot)
    assert aboard.companion.no_flight(fake.clock.now_s) == APPLET
    assert fake.until(lambda: taken(aboard), WAIT_S, aboard, pilot), "it is gone"


def test_two_companions_are_said_and_neither_holds_the_sticks():
    fake, aboard, pilot = afloat({})
    assert fake.until(lambda: taken(aboard), WAIT_S, aboard, pilot)
    other = Encoder(1, 191)
    other.encode(dialect.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3))
    beat_s = [0.0]

    def beats():
        if fake.clock.now_s >= beat_s[0]:
            beat_s[0] = fake.clock.now_s + 1.0
            fake.ends[1].write(other.encode(dialect.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3)))

    sentence = f"no feed-forward: {ANOTHER}"
    assert fake.until(lambda: sentence in pilot.words(), WAIT_S, beats, aboard, pilot), pilot.texts()
    assert fake.until(lambda: fake.parameters["SYSID_MYGCS"] == 255, WAIT_S, beats, aboard, pilot)
    fake.run(10.0, beats, aboard, pilot)
    assert not taken(aboard)
    assert fake.until(lambda: taken(aboard), WAIT_S, aboard, pilot), "it is gone"


def test_a_second_companion_started_by_mistake_takes_nothing_from_the_first(tmp_path):
    fake, aboard, pilot = afloat({}, store=tmp_path / "first")
    pilot.sticks["x"] = 300
    fake.arm()
    assert fake.until(lambda: taken(aboard), WAIT_S, aboard, pilot)
    second = Aboard(SimpleNamespace(clock=fake.clock, aboard=fake.another_link()), store=tmp_path / "second")
    fake.writes.clear()
    fake.run(10.0, aboard, second, pilot)
    assert second.companion.trouble(fake.clock.now_s) == f"no feed-forward: {ANOTHER}"
    assert (taken(aboard), fake.armed, fake.writes) == (True, True, [])
    assert f"no feed-forward: {ANOTHER}" in pilot.words()
    assert not any("not read yet" in words for words in pilot.words())
    aboard.alive = False
    assert fake.until(lambda: fake.parameters["SYSID_MYGCS"] == 255, WAIT_S, second, pilot), "it is gone"


def test_a_second_companion_on_a_link_of_its_own_hears_the_first_through_the_autopilot(autopilot):
    ground, far = memory_pair()
    pilot = Pilot(SimpleNamespace(clock=autopilot.clock, ground=ground))
    first = Aboard(autopilot, Mode.BOTH, more_links=[far])
    assert autopilot.until(lambda: taken(first), 60.0, first, pilot)
    second = Aboard(SimpleNamespace(clock=autopilot.clock, aboard=autopilot.ground), Mode.BOTH)
    autopilot.run(12.0, first, pilot, second)
    assert second.companion.trouble(autopilot.clock.boot_s()) == f"no feed-forward: {ANOTHER}"
    assert taken(first)


def test_what_a_companion_has_to_say_while_it_listens_for_another_comes_from_its_own_address_after_that():
    fake, aboard, pilot = afloat({})
    aboard.bridge.say("leak")
    fake.run(4.0, aboard, pilot)
    assert [m.get_srcComponent() for m in pilot.of("STATUSTEXT") if m.text == "leak"] == [191]


def test_a_second_companion_that_overhears_who_holds_the_sticks_neither_steers_nor_disarms(tmp_path):
    fake, first, pilot = afloat({}, store=tmp_path / "first")
    assert fake.until(lambda: taken(first), WAIT_S, first, pilot)
    pilot.flies = False
    link, sent = fake.another_link(), []
    write = link.write
    link.write = lambda data: (sent.append(data), write(data))
    second = Aboard(SimpleNamespace(clock=fake.clock, aboard=link), store=tmp_path / "second")

    def answers_to_the_first():
        fake.send(dialect.MAVLink_param_value_message(b"SYSID_MYGCS", 1.0, 4, 1, 0))

    fake.run(8.0, first, second, pilot, answers_to_the_first)
    assert taken(first)
    said = {(frame.component, decode(frame).get_type()) for frame in Framer().feed(b"".join(sent))}
    assert said == {(194, "PARAM_REQUEST_READ"), (194, "STATUSTEXT")}, "nothing from the first's own address"


def test_a_program_that_took_the_sticks_keeps_them_though_an_applet_beat_meanwhile():
    fake, aboard, pilot = afloat({})
    assert fake.until(lambda: taken(aboard), WAIT_S, aboard, pilot)
    pilot.write("SYSID_MYGCS", 254.0)
    assert fake.until(lambda: not taken(aboard), WAIT_S, aboard, pilot)
    pilot.write("SYSID_MYGCS", 255.0)
    fake.send(dialect.MAVLink_named_value_float_message(0, b"FF_MODE", 0.0))
    fake.run(10.0, aboard, pilot)
    assert not taken(aboard), "not before FF_MODE was 0"


def test_its_own_heartbeats_that_come_back_are_no_other_companion():
    fake, aboard, pilot = afloat({})
    write = fake.aboard.write

    def echoed(data):
        write(data)
        fake.ends[1].write(data)

    fake.aboard.write = echoed
    assert fake.until(lambda: taken(aboard), WAIT_S, aboard, pilot)
    fake.run(15.0, aboard, pilot)
    assert taken(aboard)


def test_sticks_that_another_companion_holds_are_not_to_be_taken_for_those_of_a_ground():
    fake, aboard, pilot = afloat({})
    aboard.set_mode(Mode.OFF)
    fake.run(10.0, aboard, pilot)
    pilot.write("SYSID_MYGCS", 1.0)
    way = "SYSID_MYGCS is 1, the vehicle's own system: end the other companion, or set SYSID_MYGCS to 255"
    assert fake.until(lambda: way in pilot.words(), WAIT_S, aboard, pilot)
    aboard.set_mode(Mode.BOTH)
    sentence = f"sticks not taken: {way}; then FF_MODE 0 and on again"
    assert fake.until(lambda: sentence in pilot.words(), WAIT_S, aboard, pilot), pilot.texts()


def test_the_vehicles_own_system_is_no_ground(capsys):
    ways = ["--vehicle", "bluerov2", "--ardusub", "--link", "udpin:127.0.0.1:1", "--ground", "1"]
    assert program.main(ways) == exit_codes.BAD_INPUT
    assert "--ground 1" in capsys.readouterr().err


def unheard(fake, aboard, *acts):
    """The sentence on the companion's own terminal, where it hears no autopilot."""
    fake.run(6.0, aboard, *acts)
    return aboard.companion.trouble(fake.clock.now_s)


def test_a_link_on_which_no_autopilot_speaks_is_said():
    fake, aboard, _ = afloat({})
    fake.dead = True
    fake.run(4.0, aboard)
    assert aboard.companion.trouble(fake.clock.now_s) == ""
    assert unheard(fake, aboard).startswith("no autopilot heard: look at --link")


def test_an_autopilot_of_another_system_is_named():
    fake, aboard, pilot = afloat({})
    fake.encoder = Encoder(2, 1)
    assert "give the vehicle file system_id 2" in unheard(fake, aboard, pilot)


def test_an_autopilot_that_falls_silent_is_said():
    fake, aboard, pilot = afloat({})
    assert fake.until(lambda: taken(aboard), WAIT_S, aboard, pilot)
    fake.dead = True
    assert unheard(fake, aboard, pilot) == "autopilot is silent: look at its power and its link"
    fake.dead = False
    fake.run(2.0, aboard, pilot)
    assert aboard.companion.trouble(fake.clock.now_s) == ""
