"""A companion beside ArduSub, the fake one and, where it is at hand, the firmware: what is asked, and who flies."""

import errno
import math
import os
import time
from concurrent.futures import Executor, Future
from pathlib import Path

import numpy as np
import pytest
from fakes.ardusub import ALT_HOLD, MANUAL, POSHOLD
from pymavlink.dialects.v20 import ardupilotmega as dialect
from rig import Aboard, Pilot, arm, given_back, orders, ready, taken

from bridge.ardusub.companion import NO_ARDUSUB
from bridge.ardusub.handover import Handover, Holder
from bridge.ardusub.mixing import mixer_of
from bridge.links.link import memory_pair
from bridge.onboard.store import NONE_YET
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.mode import Mode
from bridge.vehicle.navigation import Navigation
from bridge.vehicle.thrusters import thrust_curve
from bridge.wire.framing import Encoder, Framer, decode
from gcs_plugin.feedforward.switch import Switch
from gcs_plugin.peers import KnownVehicle, Peers

WAIT_S = 20.0


def under_way(autopilot, mode=Mode.OFF, flight_mode=MANUAL, **options):
    """A companion that knows its autopilot, and an armed vehicle with a pilot's sticks in the middle."""
    aboard, pilot = Aboard(autopilot, **options), Pilot(autopilot)
    assert autopilot.until(lambda: aboard.companion.law, WAIT_S, aboard, pilot)
    ready(autopilot, aboard, pilot)
    autopilot.set_mode(flight_mode)
    heard = aboard.companion.heard
    assert autopilot.until(lambda: heard.mode == flight_mode, WAIT_S, aboard, pilot)
    arm(autopilot, aboard, pilot)
    assert autopilot.until(lambda: heard.has_switches(autopilot.clock.boot_s()), WAIT_S, aboard, pilot)
    if mode is not Mode.OFF:
        aboard.set_mode(mode)
        if mode.applies_feedforward:
            assert autopilot.until(lambda: taken(aboard), WAIT_S, aboard, pilot)
    return aboard, pilot


def pwm(aboard):
    return aboard.companion.heard.pwm_us[:6]


def stick_pwm(value, gain=0.5):
    return 1500 + 400 * gain * value / 1000


def test_messages_are_asked_for_one_by_one_and_come_at_their_rate(autopilot):
    aboard, pilot = Aboard(autopilot), Pilot(autopilot)
    assert autopilot.until(lambda: aboard.companion.rates.settled, WAIT_S, aboard, pilot)
    assert not aboard.companion.rates.denied
    times = []

    def look():
        if not times or times[-1] != aboard.companion.heard.pwm_s:
            times.append(aboard.companion.heard.pwm_s)

    autopilot.run(2.0, aboard, pilot, look)
    assert len(times) > 60, "2 a second without asking"


@pytest.mark.parametrize("mode", [Mode.ALONE, Mode.BOTH])
def test_a_companion_to_which_nothing_was_uploaded_leaves_the_sticks_alone_and_says_what_it_lacks(fake, mode):
    aboard, pilot = under_way(fake, uploaded=False)
    pilot.sticks["x"] = 300
    assert aboard.parameters.write("FF_MODE", float(mode), armed=True) is not None
    assert aboard.parameters.take_texts()[1:] == [*NONE_YET]
    assert aboard.parameters.write("FF_MODE", float(mode), armed=False) is None
    fake.run(2.0, aboard, pilot)
    assert not taken(aboard)
    assert pwm(aboard)[2] == pytest.approx(stick_pwm(300), abs=1)


def test_an_autopilot_that_was_not_heard_yet_or_is_silent_counts_as_armed(fake):
    """No mode is raised unproven, and no set changes under a mode that acts."""
    aboard, pilot = Aboard(fake), Pilot(fake)
    fake.dead = True
    fake.run(2.0, aboard)

    def written(name, value):
        encoder = Encoder(255, 190)
        fake.ends[1].write(encoder.encode(dialect.MAVLink_param_set_message(1, 191, name.encode(), value, 9)))
        fake.run(0.1, aboard)
        return aboard.parameters.value(name)

    raised = float(Mode.BOTH)
    assert written("FF_MODE", raised) == Mode.OFF, "never heard"
    assert written("FF_MODE", float(Mode.SHADOW)) == Mode.SHADOW, "no rise"
    fake.dead = False
    assert fake.until(lambda: aboard.companion.law, WAIT_S, aboard, pilot)
    fake.dead = True
    assert written("FF_MODE", raised) == Mode.BOTH, "heard a moment ago, disarmed"
    fake.run(4.0, aboard)
    active = aboard.parameters.active_crc
    assert written("FF_COMMIT", 0.0) == active, "silent"
    assert written("FF_MODE", 0.0) == Mode.OFF
    assert written("FF_MODE", raised) == Mode.OFF, "silent"
    assert written("FF_COMMIT", 0.0) == 0.0, "nothing acts"


def test_nothing_is_sent_to_an_autopilot_that_was_not_heard(fake):
    fake.dead = True
    aboard = Aboard(fake, Mode.BOTH)
    fake.run(3.0, aboard)
    ground = set()
    while data := fake.ends[1].read(0.0):
        ground |= {frame.message_id for frame in fake.framers[1].feed(data)}
    assert not ground & {11, 20, 23, 69, 76, 132}


def test_the_ground_reads_the_models_parameters_from_the_companion_alone(autopilot):
    aboard, pilot = Aboard(autopilot), Pilot(autopilot)
    there = lambda: [m for m in pilot.of("HEARTBEAT") if m.get_srcComponent() == 191]  # noqa: E731
    assert autopilot.until(there, WAIT_S, aboard, pilot)
    pilot.heard.clear()
    pilot.send(dialect.MAVLink_param_request_read_message(1, 191, b"FF_MODE", -1))
    answers = lambda: [m for m in pilot.of("PARAM_VALUE") if m.param_id == "FF_MODE"]  # noqa: E731
    assert autopilot.until(answers, WAIT_S, aboard, pilot)
    assert {(m.get_srcComponent(), m.param_value) for m in answers()} == {(191, 0.0)}


def test_a_write_to_a_companion_that_was_not_heard_yet_is_taken_by_the_autopilot_for_its_own(autopilot):
    """Why nothing may be sent to 191 before its own heartbeat."""
    pilot = Pilot(autopilot)
    assert autopilot.until(lambda: pilot.of("HEARTBEAT"), WAIT_S, pilot)
    pilot.write("PSC_ACCZ_FF", 0.25, component=191)
    autopilot.run(0.5, pilot)
    assert pilot.read("PSC_ACCZ_FF") == pytest.approx(0.25)
    aboard = Aboard(autopilot)
    pilot.heard.clear()
    there = lambda: [m for m in pilot.of("HEARTBEAT") if m.get_srcComponent() == 191]  # noqa: E731
    assert autopilot.until(there, WAIT_S, aboard, pilot)
    pilot.write("PSC_ACCZ_FF", 0.5, component=191)
    autopilot.run(0.5, aboard, pilot)
    assert pilot.read("PSC_ACCZ_FF") == pytest.approx(0.25)


def test_off_and_in_shadow_the_pilot_flies_as_if_there_were_no_companion(autopilot):
    aboard, pilot = under_way(autopilot, Mode.SHADOW)
    pilot.sticks["x"] = 300
    autopilot.run(1.0, aboard, pilot)
    assert pilot.read("SYSID_MYGCS") == 255
    assert pwm(aboard)[2] == pytest.approx(stick_pwm(300), abs=1.5)


def test_outputs_beyond_full_thrust_are_cut_off_each_by_itself_as_the_mixer_foretells(autopilot):
    aboard, pilot = under_way(autopilot, Mode.OFF)
    pilot.sticks |= {"x": 1000, "y": 1000, "r": 1000}
    autopilot.run(1.0, aboard, pilot)
    assert pwm(aboard)[:4] == pytest.approx((1700, 1100, 1700, 1700), abs=2)
    file = load_vehicle("bluerov2")
    shape = file.vehicle.configurations["standard"]
    mixer = mixer_of(
        aboard.companion.settings.values, shape, thrust_curve(file.vehicle.thrust_curve, file.path.parent)
    )
    foretold = mixer.wrench(np.full(3, 0.5))
    assert foretold == pytest.approx(mixer.wrench_of_pulses([*pwm(aboard)[:4], 1500, 1500]), abs=1.0)


def test_raised_the_companion_holds_the_sticks_and_lowered_it_proves_that_they_are_back(autopilot, tmp_path):
    store = tmp_path / "sticks"
    aboard, pilot = under_way(autopilot, Mode.ALONE, store=store)
    assert pilot.read("SYSID_MYGCS") == 1
    assert store.read_text() == "255\n"
    aboard.set_mode(Mode.OFF)
    assert autopilot.until(lambda: given_back(aboard), WAIT_S, aboard, pilot)
    assert pilot.read("SYSID_MYGCS") == 255
    assert not store.exists()
    assert aboard.companion.armed


def test_sticks_are_given_back_also_where_the_disk_can_not_be_written_any_more(fake, tmp_path, monkeypatch):
    def read_only(*_, **__):
        raise OSError(errno.EROFS, "Read-only file system")

    store = tmp_path / "sticks"
    aboard, pilot = under_way(fake, Mode.ALONE, store=store)
    monkeypatch.setattr(Path, "unlink", read_only)
    aboard.set_mode(Mode.OFF)
    assert fake.until(lambda: given_back(aboard), WAIT_S, aboard, pilot)
    again = Aboard(fake, store=store)
    assert fake.until(lambda: again.companion.law, WAIT_S, again, pilot)
    assert pilot.read("SYSID_MYGCS") == 255


def test_a_steady_stick_means_the_same_with_and_without_the_feedforward(autopilot):
    aboard, pilot = under_way(autopilot, Mode.ALONE)
    pilot.sticks["x"] = 400
    autopilot.run(5.0, aboard, pilot)
    assert pwm(aboard)[:4] == pytest.approx((1420, 1420, 1580, 1580), abs=4)


def test_a_moving_stick_gets_the_reference_s_force_and_off_ends_it_at_once(autopilot):
    aboard, pilot = under_way(autopilot, Mode.ALONE)
    pilot.sticks["x"] = 600
    autopilot.run(0.15, aboard, pilot)
    assert pwm(aboard)[2] < stick_pwm(600) - 10, "the reference has only begun to rise"
    autopilot.run(4.0, aboard, pilot)
    assert pwm(aboard)[2] == pytest.approx(stick_pwm(600), abs=4)
    pilot.sticks["x"] = 0
    pulses = []
    autopilot.run(0.4, aboard, pilot, lambda: pulses.append(pwm(aboard)[2]))
    assert min(pulses) < 1490, "the reference is still braking"
    aboard.set_mode(Mode.OFF)
    autopilot.run(0.15, aboard, pilot)
    assert pwm(aboard)[:4] == pytest.approx((1500,) * 4, abs=1)


def test_where_the_companion_dies_the_vehicle_disarms_by_itself(autopilot):
    aboard, pilot = under_way(autopilot, Mode.ALONE)
    aboard.alive = False
    began_s = autopilot.clock.boot_s()
    disarmed = lambda: [  # noqa: E731
        m for m in pilot.of("HEARTBEAT")
        if m.get_srcComponent() == 1 and not m.base_mode & dialect.MAV_MODE_FLAG_SAFETY_ARMED
    ]  # fmt: skip
    pilot.heard.clear()
    assert autopilot.until(disarmed, 10.0, pilot)
    assert autopilot.clock.boot_s() - began_s < aboard.disarmed_within_s


def test_a_ground_that_falls_silent_is_silence_to_the_autopilot_too(autopilot):
    aboard, pilot = under_way(autopilot, Mode.ALONE)
    if not autopilot.is_firmware:
        # As in the simulated firmware: the heartbeat alone decides.
        autopilot.quirks.checks_pilot = False
    pilot.beats = pilot.flies = False
    assert autopilot.until(lambda: not aboard.companion.armed, 12.0, aboard)


def test_a_pilot_without_a_ground_beat_still_flies(autopilot):
    """ArduSub takes sticks for a beat, and so does the way through the companion."""
    aboard, pilot = under_way(autopilot, Mode.ALONE)
    pilot.beats = False
    autopilot.run(6.0, aboard, pilot)
    assert aboard.companion.armed


def test_a_companion_that_died_puts_the_sticks_back_when_it_starts_again(autopilot, tmp_path):
    store = tmp_path / "sticks"
    aboard, pilot = under_way(autopilot, Mode.ALONE, store=store)
    aboard.alive = False
    autopilot.run(1.0, pilot)
    again = Aboard(autopilot, store=store)
    assert autopilot.until(lambda: given_back(again), WAIT_S, again, pilot)
    assert pilot.read("SYSID_MYGCS") == 255
    assert not store.exists()


LONG_AGO_S = 60.0
"""Longer ago than a companion that died can still have the vehicle armed."""


@pytest.mark.parametrize(("since_s", "listens"), [(0.0, False), (LONG_AGO_S, True), (-LONG_AGO_S, True)])
def test_who_held_the_sticks_on_this_computer_until_just_now_is_not_listened_for(
    fake, tmp_path, since_s, listens
):
    """`since_s` before now the file was touched last; below 0: after now, by a clock that was set back since."""
    store = tmp_path / "sticks"
    aboard, pilot = under_way(fake, Mode.ALONE, store=store)
    aboard.alive = False
    at_s = time.time() - since_s
    os.utime(store, (at_s, at_s))
    again, began_s = Aboard(fake, store=store), fake.clock.boot_s()
    assert fake.until(lambda: given_back(again), WAIT_S, again, pilot)
    assert (fake.clock.boot_s() - began_s > 2.0) == listens


def test_the_file_of_the_sticks_is_kept_fresh_while_they_are_held_and_no_longer(fake, tmp_path):
    store = tmp_path / "sticks"
    aboard, pilot = under_way(fake, Mode.ALONE, store=store)
    os.utime(store, (0.0, 0.0))
    fake.run(1.5, aboard, pilot)
    assert store.stat().st_mtime > 0
    pilot.write("SYSID_MYGCS", 255)
    assert fake.until(lambda: not taken(aboard), WAIT_S, aboard, pilot)
    os.utime(store, (0.0, 0.0))
    fake.run(3.0, aboard, pilot)
    assert store.stat().st_mtime == 0


def test_another_program_that_takes_the_sticks_keeps_them(autopilot):
    aboard, pilot = under_way(autopilot, Mode.ALONE)
    pilot.write("SYSID_MYGCS", 255)
    assert autopilot.until(lambda: aboard.companion.handover.fault, WAIT_S, aboard, pilot)
    autopilot.run(2.0, aboard, pilot)
    assert pilot.read("SYSID_MYGCS") == 255
    pilot.sticks["x"] = 300
    autopilot.run(1.0, aboard, pilot)
    assert pwm(aboard)[2] == pytest.approx(stick_pwm(300), abs=1.5)


def late_value(fake, value):
    """A PARAM_VALUE that is of before, as on a slower link beside the first, or behind a list of parameters."""
    fake.send(dialect.MAVLink_param_value_message(b"SYSID_MYGCS", value, 9, 1, 0))


def test_a_late_word_of_before_does_not_pass_for_another_program_that_took_the_sticks(fake):
    aboard, pilot = under_way(fake, Mode.ALONE)
    late_value(fake, 255.0)
    pilot.sticks["x"] = 300
    fake.run(3.0, aboard, pilot)
    assert taken(aboard)
    assert not aboard.companion.handover.fault
    assert fake.armed, "the pilot's sticks went on"
    assert pwm(aboard)[2] > stick_pwm(200)
    assert not any("another program" in text for text in pilot.texts())


def test_in_a_mode_that_holds_by_itself_the_sticks_pass_as_they_are(fake):
    aboard, pilot = under_way(fake, Mode.ALONE)
    fake.set_mode(POSHOLD)
    fake.run(1.5, aboard, pilot)
    assert passes(fake, aboard, pilot)


def passes(fake, aboard, pilot):
    """Whether a step of the stick reaches the autopilot unchanged from the first frame on."""
    pilot.sticks["x"] = 500
    fake.run(0.1, aboard, pilot)
    now = fake.sticks[0]
    fake.run(0.4, aboard, pilot)
    return (now, fake.sticks[0]) == (500, 500)


@pytest.mark.parametrize("switch", ["input_hold", "roll_pitch"])
def test_sticks_that_mean_something_else_pass_as_they_are(fake, switch):
    aboard, pilot = under_way(fake, Mode.ALONE)
    setattr(fake, switch, 1.0)
    fake.run(1.0, aboard, pilot)
    assert passes(fake, aboard, pilot)


def test_a_gain_that_is_not_heard_any_more_ends_the_addition(fake):
    aboard, pilot = under_way(fake, Mode.ALONE)
    fake.says_switches = False
    fake.run(4.0, aboard, pilot)
    assert passes(fake, aboard, pilot)


def test_two_programs_that_send_sticks_get_nothing_added(fake):
    aboard, pilot = under_way(fake, Mode.ALONE)
    other = Pilot(fake, component=25)
    other.sticks["x"] = 500
    fake.run(0.5, aboard, pilot, other)
    pilot.sticks["x"] = 500
    fake.run(0.1, aboard, pilot, other)
    assert fake.sticks[0] == 500


def test_in_alt_hold_surge_is_fed_and_yaw_is_left_to_the_autopilot(fake):
    aboard, pilot = under_way(fake, Mode.ALONE, flight_mode=ALT_HOLD)
    pilot.sticks |= {"x": 500, "r": 400}
    fake.run(0.2, aboard, pilot)
    assert fake.sticks[0] != 500
    assert fake.sticks[3] == 400


def test_merged_echoes_do_not_prove_who_holds_the_sticks(fake):
    """A read of its own does: the echo alone would be taken at face value here."""
    fake.quirks.read_s = 1.0
    aboard, pilot = Aboard(fake, Mode.ALONE), Pilot(fake)
    written = lambda: ("SYSID_MYGCS", 1.0) in fake.writes  # noqa: E731
    assert fake.until(written, WAIT_S, aboard, pilot)
    fake.run(0.2, aboard, pilot)
    assert not taken(aboard)
    assert fake.until(lambda: taken(aboard), WAIT_S, aboard, pilot)


def test_the_companion_arms_nothing(fake):
    aboard, pilot = Aboard(fake), Pilot(fake)
    fake.run(3.0, aboard, pilot)
    pilot.send(dialect.MAVLink_command_long_message(1, 191, 400, 0, 1, 0, 0, 0, 0, 0, 0))
    fake.run(0.5, aboard, pilot)
    assert [m.result for m in pilot.of("COMMAND_ACK") if m.get_srcComponent() == 191] == [2]
    assert not fake.armed


@pytest.mark.parametrize(("autopilot_kind", "vehicle"), [(12, 12), (3, 2)])
def test_another_autopilot_than_ardusub_is_named_and_sent_nothing(fake, autopilot_kind, vehicle):
    fake.kind = (vehicle, autopilot_kind)
    aboard, pilot = Aboard(fake, Mode.BOTH), Pilot(fake)
    fake.run(4.0, aboard, pilot)
    assert NO_ARDUSUB in pilot.words()
    assert not fake.writes
    assert 36 in fake.intervals
    assert fake.intervals[36] == 0.5


def test_the_word_of_another_component_proves_nothing(fake):
    """A camera that says SYSID_MYGCS = 1 is not the autopilot."""
    aboard, pilot, camera = Aboard(fake), Pilot(fake), Encoder(1, 100)
    assert fake.until(lambda: aboard.companion.law, WAIT_S, aboard, pilot)
    fake.quirks.read_s = 60.0
    aboard.set_mode(Mode.ALONE)
    for _ in range(40):
        fake.ground.write(camera.encode(dialect.MAVLink_param_value_message(b"SYSID_MYGCS", 1.0, 9, 1, 0)))
        fake.run(0.1, aboard, pilot)
    assert ("SYSID_MYGCS", 1.0) in fake.writes
    assert not taken(aboard)


@pytest.mark.parametrize("place", range(6))
@pytest.mark.parametrize("value", [math.inf, -math.inf, math.nan])
def test_an_attitude_that_is_no_number_is_as_good_as_none(fake, place, value):
    companion, autopilot, taken = Aboard(fake).companion, Encoder(1, 1), []
    for numbers in ([0.1] * 6, [value if number == place else 0.2 for number in range(6)]):
        raw = autopilot.encode(dialect.MAVLink_attitude_message(1000, *numbers))
        for frame in Framer().feed(raw):
            companion.hear(0, frame, float(len(taken)), Navigation)
        taken.append(companion.take_samples())
    assert [len(samples) for samples in taken] == [1, 0]
    assert companion.heard.rate == pytest.approx((0.1, 0.1, 0.1))


def test_sticks_that_come_on_a_second_link_too_are_sent_on_once(fake):
    near, far = memory_pair()
    aboard, pilot = under_way(fake, Mode.ALONE, more_links=[near])
    sent = []
    hear = fake.hear

    def listen(number, frame, now_s):
        sent.extend([number] if frame.message_id == dialect.MAVLINK_MSG_ID_MANUAL_CONTROL else [])
        hear(number, frame, now_s)

    fake.hear = listen
    sticks = pilot.encoder.encode(dialect.MAVLink_manual_control_message(1, 300, 0, 500, 0, 0))
    fake.run(1.0, aboard, pilot, lambda: far.write(sticks))
    assert sent.count(1) == pytest.approx(sent.count(0), abs=1)


def test_off_waits_for_a_companion_that_is_known_from_before_until_it_is_heard_on_this_link(fake):
    """Until then the autopilot would execute it."""
    sent, hear = [], fake.hear

    def listen(number, frame, now_s):
        message = decode(frame)
        sent.extend([message] if getattr(message, "target_component", 0) == 191 else [])
        hear(number, frame, now_s)

    fake.hear = listen
    switch, pilot = Switch(Mode.OFF, known=(KnownVehicle((1, 191), True, -90.0, behind=True),)), Pilot(fake)
    order = orders(pilot, switch)
    fake.run(5.0, pilot, order)
    assert (sent, switch.done) == ([], False)
    assert switch.words == (
        "vehicle 1: off waits for its companion's heartbeat: ArduSub would take it for its own until then"
    )
    aboard = Aboard(fake, Mode.BOTH)
    assert fake.until(lambda: switch.done, 8.0, pilot, order, aboard)
    assert aboard.parameters.mode is Mode.OFF
    assert sent


def test_a_ground_keeps_in_mind_which_companion_stands_behind_ardupilot():
    peers = Peers()
    for component, kind, autopilot in ((1, 12, 3), (191, 18, 8)):
        beat = Encoder(1, component).encode(dialect.MAVLink_heartbeat_message(kind, autopilot, 0, 0, 4, 3))
        (frame,) = Framer().feed(beat)
        peers.on_frame(frame, "link", 1.0)
    assert {vehicle.source: vehicle.behind for vehicle in peers.known(2.0)} == {(1, 1): False, (1, 191): True}


def test_a_motor_that_is_turned_round_under_way_ends_the_feedforward_and_turned_back_it_is_raised_again(
    autopilot,
):
    """The companion goes by the wiring of now: with that of its start a thruster would push the wrong way."""
    aboard, pilot = under_way(autopilot, Mode.BOTH)
    pilot.sticks["x"] = 200
    autopilot.run(1.0, aboard, pilot)
    sentence = (
        "no feed-forward: the thrusters of the vehicle file do not push as ArduSub's frame takes them to: make the "
        "file anew by seatrial vehicle guess, or mend SERVOn_FUNCTION and MOT_n_DIRECTION"
    )
    pilot.write("MOT_2_DIRECTION", -1.0)
    assert autopilot.until(lambda: aboard.companion.law is None, 1.0, aboard, pilot)
    assert autopilot.until(lambda: sentence in pilot.words(), WAIT_S, aboard, pilot), pilot.texts()
    assert autopilot.until(lambda: given_back(aboard), WAIT_S, aboard, pilot)
    assert aboard.companion.no_flight(autopilot.clock.boot_s()) == sentence.removeprefix("no feed-forward: ")
    pilot.write("MOT_2_DIRECTION", 1.0)
    assert autopilot.until(lambda: taken(aboard), WAIT_S, aboard, pilot), pilot.texts()


def test_what_the_autopilot_changed_without_a_word_is_read_anew(fake):
    aboard, pilot = under_way(fake, Mode.ALONE)
    fake.parameters["MOT_2_DIRECTION"] = -1.0
    assert fake.until(lambda: aboard.companion.law is None, 60.0, aboard, pilot)


def test_a_parameter_that_was_not_answered_at_the_start_is_asked_for_again(fake):
    aboard, pilot = Aboard(fake, Mode.ALONE), Pilot(fake)
    value = fake.parameters.pop("FRAME_CONFIG")
    assert fake.until(lambda: "FRAME_CONFIG nan" in " ".join(pilot.words()), WAIT_S, aboard, pilot)
    fake.parameters["FRAME_CONFIG"] = value
    assert fake.until(lambda: taken(aboard), 60.0, aboard, pilot), pilot.texts()


def test_rates_that_a_reboot_or_another_ground_took_away_are_asked_for_again_at_once(autopilot):
    aboard, pilot = Aboard(autopilot), Pilot(autopilot)
    heard = aboard.companion.heard
    ready(autopilot, aboard, pilot)
    times = []

    def look():
        if not times or times[-1] != heard.attitude_s:
            times.append(heard.attitude_s)

    def is_full():
        return len([time_s for time_s in times if time_s > autopilot.clock.boot_s() - 1.0]) > 30

    acts = aboard, pilot, look
    assert autopilot.until(is_full, WAIT_S, *acts)
    autopilot.run(10.0, *acts)
    slow = dialect.MAVLink_command_long_message(
        1, 1, dialect.MAV_CMD_SET_MESSAGE_INTERVAL, 0, dialect.MAVLINK_MSG_ID_ATTITUDE, 1e6, 0, 0, 0, 0, 0
    )
    for _ in range(2):
        autopilot.aboard.write(Encoder(254, 1).encode(slow))
        assert autopilot.until(lambda: not is_full(), 5.0, *acts)
        assert autopilot.until(is_full, 10.0, *acts)
        autopilot.run(10.0, *acts)


def test_an_answer_to_another_program_on_the_same_link_is_not_taken_for_ones_own(autopilot):
    aboard, pilot = Aboard(autopilot), Pilot(autopilot)
    ready(autopilot, aboard, pilot)
    denied = dialect.MAVLink_command_long_message(
        1, 1, dialect.MAV_CMD_SET_MESSAGE_INTERVAL, 0, dialect.MAVLINK_MSG_ID_HIGHRES_IMU, 1e6, 0, 0, 0, 0, 0
    )
    aboard.companion.rates.begin_anew()
    for _ in range(50):
        autopilot.aboard.write(Encoder(254, 1).encode(denied))
        autopilot.run(0.02, aboard, pilot)
    assert autopilot.until(lambda: aboard.companion.rates.settled, WAIT_S, aboard, pilot)
    assert not aboard.companion.rates.denied


def test_an_autopilot_that_is_heard_on_two_links_keeps_the_first_until_that_one_is_silent(fake):
    """Sticks are taken on that link alone, and requests go there."""
    near, far = memory_pair()
    aboard, pilot = Aboard(fake, more_links=(near,)), Pilot(fake)
    links, due_s, encoder = set(), [0.0], Encoder(1, 1)

    def beats_there_too():
        if fake.clock.now_s >= due_s[0]:
            due_s[0] += 0.7
            far.write(encoder.encode(dialect.MAVLink_heartbeat_message(*fake.kind, 1, MANUAL, 4, 3)))

    fake.run(2.0, aboard, pilot)
    fake.run(10.0, aboard, pilot, beats_there_too, lambda: links.add(aboard.companion.link))
    assert links == {1}
    fake.dead = True
    assert fake.until(lambda: aboard.companion.link == 0, 5.0, aboard, pilot, beats_there_too)


class Stalled(Executor):
    """A disk that stalls until `goes_on`."""

    def __init__(self):
        self.waiting = []

    def submit(self, work, /, *of):
        self.waiting.append((work, of, Future()))
        return self.waiting[-1][2]

    def goes_on(self):
        for work, of, kept in self.waiting:
            kept.set_result(work(*of))
        self.waiting = []


def test_a_disk_that_stalls_holds_no_loop_up_and_the_sticks_are_taken_once_their_owner_is_kept(tmp_path):
    disk, store = Stalled(), tmp_path / "rov.sticks"
    handover = Handover(1, 1, 255, store, disk)
    handover.on_value("SYSID_MYGCS", 255.0, 0.0)
    handover.step(False, 0.0, asked=False)
    for at_s in (1.0, 1.1, 1.2):
        sent = handover.step(True, at_s, asked=True)
        assert not [m for m in sent if m.get_type() == "PARAM_SET"]
        assert (handover.holder, store.exists(), len(disk.waiting)) == (Holder.FREE, False, 1)
    disk.goes_on()
    (taken,) = handover.step(True, 1.3, asked=True)
    assert (taken.get_type(), taken.param_value) == ("PARAM_SET", 1.0)
    assert (handover.holder, store.read_text()) == (Holder.TAKING, "255\n")


def held_on_a_disk(store):
    """A handover that holds the sticks since 1.6 s, and its disk, which stalls from then on."""
    disk = Stalled()
    handover = Handover(1, 1, 255, store, disk)
    handover.on_value("SYSID_MYGCS", 255.0, 0.0)
    handover.step(False, 0.0, asked=False)
    handover.step(True, 1.0, asked=True)
    disk.goes_on()
    for at_s in (1.1, 1.5):
        handover.step(True, at_s, asked=True)
    handover.on_value("SYSID_MYGCS", 1.0, 1.6)
    assert handover.holder is Holder.HELD
    return handover, disk


def test_a_disk_that_stalls_holds_no_loop_up_as_the_sticks_are_given_back(tmp_path):
    store = tmp_path / "rov.sticks"
    handover, disk = held_on_a_disk(store)
    for at_s in (2.0, 2.5):
        handover.step(False, at_s, asked=False)
    handover.on_value("SYSID_MYGCS", 255.0, 2.6)
    assert (handover.holder, store.exists()) == (Holder.FREE, True)
    disk.goes_on()
    assert not store.exists()


def test_a_disk_that_stalls_while_the_sticks_are_held_is_asked_once(tmp_path):
    handover, disk = held_on_a_disk(tmp_path / "rov.sticks")
    for at_s in range(2, 20):
        handover.step(True, float(at_s), asked=True)
    assert len(disk.waiting) == 1
    disk.goes_on()
    handover.step(True, 20.0, asked=True)
    assert len(disk.waiting) == 1


@pytest.mark.parametrize("wanted", [True, False], ids=["as they are taken", "as they are given back"])
def test_another_program_that_takes_the_sticks_meanwhile_keeps_them(tmp_path, wanted):
    store = tmp_path / "rov.sticks"
    handover = Handover(1, 1, 255, store)
    handover.on_value("SYSID_MYGCS", 255.0, 0.0)
    handover.step(False, 0.0, asked=False)
    assert written(handover, True, 1.0) == [1.0]
    if not wanted:
        written(handover, True, 2.0)
        handover.on_value("SYSID_MYGCS", 1.0, 2.1)
        assert handover.holder is Holder.HELD
        assert written(handover, False, 3.0) == [255.0]
    written(handover, wanted, 4.0)
    handover.on_value("SYSID_MYGCS", 254.0, 4.1)
    assert handover.holder is Holder.FREE
    assert "SYSID_MYGCS set to 254 by another program" in handover.trouble
    assert [written(handover, wanted, 4.2 + k) for k in range(20)] == [[]] * 20
    assert not store.exists()


def test_sticks_whose_return_nobody_confirms_are_said_once_and_the_sentence_ends_with_the_answer(tmp_path):
    handover, _disk = held_on_a_disk(tmp_path / "rov.sticks")
    sentence = "sticks not given back: no answer for SYSID_MYGCS: look at the autopilot's link"
    said = []
    for at_s in range(2, 30):
        handover.step(False, float(at_s), asked=False)
        said.append(handover.trouble)
    assert said == [""] * 10 + [sentence] * 18, "a grace of ten seconds"
    handover.on_value("SYSID_MYGCS", 255.0, 30.0)
    handover.step(False, 30.1, asked=False)
    assert (handover.holder, handover.trouble) == (Holder.FREE, "")


def test_a_disk_that_stalls_holds_no_loop_up_as_a_file_left_over_is_removed(tmp_path):
    disk, store = Stalled(), tmp_path / "rov.sticks"
    store.write_text("255\n")
    handover = Handover(1, 1, 255, store, disk)
    handover.on_value("SYSID_MYGCS", 255.0, 0.0)
    handover.step(False, 0.0, asked=False)
    assert store.exists()
    disk.goes_on()
    assert not store.exists()


def written(handover, wanted, at_s):
    """The values that the handover writes in a step."""
    sent = handover.step(wanted, at_s, asked=True)
    return [message.param_value for message in sent if message.get_type() == "PARAM_SET"]


def test_a_companion_that_is_stopped_before_it_knows_who_holds_the_sticks_has_not_given_them_back(tmp_path):
    store = tmp_path / "rov.sticks"
    assert Handover(1, 1, 255, store).given_back, "none was here before"
    store.write_text("255\n")
    handover = Handover(1, 1, 255, store)
    assert not handover.given_back
    handover.on_value("SYSID_MYGCS", 1.0, 0.0)
    assert not handover.given_back
    assert written(handover, False, 0.1) == [255.0]
    written(handover, False, 1.0)
    handover.on_value("SYSID_MYGCS", 255.0, 1.1)
    assert handover.given_back
    assert not store.exists()
