"""The module in a real MAVProxy: commands are typed into it, for one vehicle and for two, and its output is read.

Each test leaves vehicle 1 meant; what it uploads to that is rolled back, but for the last, from a dive.
"""

import re
from pathlib import Path

import pytest
from console import upload, write
from waiting import until

from bridge.wire.tlog import read_tlog
from gcs_plugin.dives.folder import load_folder
from gcs_plugin.params.files import read_parameters


@pytest.mark.slow
def test_status_tells_each_vehicle_and_that_nothing_is_recorded(mavproxy):
    heard = r"on tcp:127\.0\.0\.1:\d+: heard \d\.\d s ago, \d+ frames, \d+\.\d% lost as seen here, disarmed"
    mavproxy.ask("seatrial status", rf"(?s)1/1 {heard}.*2/1 {heard}.*meant: vehicle 1.*NOT RECORDING")


def test_commands_are_completed_and_help_names_each(mavproxy, folder):
    write(folder, "completed.param", FF0_M_U=1)
    mavproxy.type("seatrial par\t di\t comp\t", end="")
    mavproxy.wait_for("seatrial params diff completed.param")
    mavproxy.type("", end="\n")
    mavproxy.wait_for("outside|summary|parameters: ")
    for word in ("status", "record", "identify", "diagnose", "params", "ff", "vehicle", "file", "cancel"):
        mavproxy.ask(f"seatrial help {word}", f"seatrial {word}")
    mavproxy.ask("seatrial hlep", r"usage: seatrial status \| record")


def frames_of(dive):
    return [frame for path in dive.telemetry() for _, frame in read_tlog(path)]


def heard_of(mavproxy, vehicle):
    """How many frames came from a vehicle so far."""
    said = rf"{vehicle}/1 on \S+: heard \d+\.\d s ago, (\d+) frames, .*\n"
    return int(mavproxy.ask("seatrial status", rf"{said}(?s:.*)meant: ")[1])


def test_a_recording_holds_what_was_heard_and_sent_and_the_notes_and_goes_on_in_a_next_dive(mavproxy, folder):
    made = mavproxy.ask("seatrial record start one", r"recording into (one/\S+):")[1]
    heard = {vehicle: heard_of(mavproxy, vehicle) for vehicle in (1, 2)}
    mavproxy.ask("seatrial record note the current comes from the north", "noted in")
    # The one sends two hundred frames a second, the other three: each must have been heard since.
    for vehicle, before in heard.items():
        until(lambda vehicle=vehicle, before=before: heard_of(mavproxy, vehicle) > before)
    upload_like = write(folder, "recorded.param", FF0_D_U=41)
    mavproxy.ask(f"seatrial params diff {upload_like}", "1 parameters: ")
    over = rf"recorded \d+ frames, \d+ bytes, 0 lost here: {made}\nrecording into (one/\S+):"
    following = mavproxy.ask("seatrial record next", over)[1]
    mavproxy.until("seatrial status", rf"recording into {following}: .* [1-9]\d{{2,}} frames")
    mavproxy.ask("seatrial record stop", rf"recorded \d+ frames, \d+ bytes, 0 lost here: {following}")
    dive = load_folder(folder / made)
    assert [event.text for event in dive.about().events] == ["the current comes from the north"]
    of_both = [frames_of(dive), frames_of(load_folder(folder / following))]
    assert {frame.system for frame in of_both[0]} == {1, 2, 255}
    assert 1 in {frame.system for frame in of_both[1]}
    frames = [frame for item in of_both for frame in item]
    for vehicle in (1, 2):
        numbers = [frame.sequence for frame in frames if frame.system == vehicle]
        assert numbers == [(numbers[0] + i) % 256 for i in range(len(numbers))], "a frame was not recorded"
    asked = [frame for frame in frames if frame.system == 255 and frame.message_id == 21]
    assert asked, "the recording lacks the PARAM_REQUEST_LIST that was sent"
    mavproxy.ask("seatrial record stop", "nothing is being recorded")
    mavproxy.ask("seatrial record next", "nothing is being recorded that could go on in a new dive")


def test_an_upload_asks_for_its_code_and_is_read_back_and_rolled_back_in_one_step(mavproxy, folder):
    name = write(folder, "set.param", FF1_M_U=120.5, FF1_D_U=50.25, FF1_D_V=-1)
    mavproxy.ask("seatrial params yes 2-000000", "there is no plan to agree to")
    mavproxy.ask(f"seatrial params diff {name}", "3 parameters: 2 changed, 1 refused")
    mavproxy.ask(f"seatrial params upload {name}", "FF1_D_V: -1 is outside .*nothing was sent")
    chosen = f"seatrial params upload {name} FF1_M_U FF1_D_U"
    code = mavproxy.ask(chosen, r"to write 2 parameters on vehicle 1:\n\s+seatrial params (yes \S+)\n")[1]
    mavproxy.ask("seatrial params yes 2-000000", "is not the code of the plan shown.*nothing was sent")
    done = mavproxy.ask(f"seatrial params {code}", r"(?s)what became of it.*values before: (\S+)\n")
    assert re.search(r"FF1_M_U +kg +not set +120.5 +read back equal", done[0])
    assert "2 parameters written and read back" in done[0]
    assert read_parameters(folder / done[1])["FF1_M_U"] == 0.0
    mavproxy.ask(chosen, "holds all of it already; nothing was written")
    mavproxy.ask(
        "seatrial params rollback", r"(?s)FF1_M_U +kg +120.5 +not set +read back equal.*values before"
    )
    mavproxy.ask("seatrial params rollback", "no upload to vehicle 1 that stands is kept there")


def test_the_feed_forward_goes_off_at_once_and_elsewhere_only_by_a_second_word(mavproxy):
    mavproxy.ask("seatrial ff yes shadow", "`seatrial ff shadow` comes first")
    mavproxy.ask(
        "seatrial ff shadow", r"to set the feed-forward of vehicle 1 to shadow:\n\s+seatrial ff yes shadow"
    )
    mavproxy.ask("seatrial ff yes both", "`seatrial ff both` comes first")
    mavproxy.ask("seatrial ff shadow", "seatrial ff yes shadow")
    mavproxy.ask("seatrial ff yes shadow", "ff: vehicle 1: shadow, as read back and as its telemetry says")
    mavproxy.ask("seatrial status", "feed-forward shadow")
    mavproxy.ask("seatrial ff off", "ff: vehicle 1: off, as read back and as its telemetry says")


def test_without_a_vehicle_file_the_status_says_what_the_comparison_with_a_model_lacks(mavproxy):
    lacks = "not compared with its model: needs a vehicle file; name it: seatrial file NAME"
    mavproxy.until("seatrial status", lacks)


def test_an_alarm_of_the_crews_own_limits_is_said_and_stands_in_the_status(mavproxy):
    mavproxy.until("seatrial status", r"component 1\s+ALARM battery \d\d\.\d\d V, below 99 V")
    assert len(re.findall("^ALARM battery", mavproxy.text, re.MULTILINE)) >= 2


def test_the_docs_tell_every_command(mavproxy):
    page = (Path(__file__).resolve().parents[2] / "docs" / "ground_stations.md").read_text(encoding="utf-8")
    named = mavproxy.ask("seatrial help nonsense", r"usage: seatrial (status .*)\n")[1].split(" | ")
    assert len(named) == 10
    for command in named:
        assert re.search(rf"\| `seatrial {command}\b", page), command


def test_two_vehicles_are_told_apart_and_nothing_is_sent_while_none_is_chosen(mavproxy, folder, second):
    name = write(folder, "second.param", FF0_M_U=111, FF0_D_U=50)
    before = dict(second.server._staged)
    try:
        mavproxy.ask("seatrial vehicle any", "vehicle: any")
        for line in (f"params upload {name}", f"params rollback {name}", f"params diff {name}", "ff both"):
            mavproxy.ask(f"seatrial {line}", r"several vehicles beat \(systems 1, 2\) and none is chosen")
        assert second.server._staged == before
        mavproxy.ask("seatrial vehicle 7", "no vehicle beats as system 7; these do: 1, 2")
        mavproxy.until("seatrial vehicle 2", "vehicle: 2")
        mavproxy.ask(f"seatrial params diff {name}", r"FF0_M_U +not set +111 +- +kg +- +- +changed")
        mavproxy.ask("seatrial ff both", "vehicle 2 has no parameters in force to feed forward")
        mavproxy.ask("seatrial ff shadow", "vehicle 2 has no parameters in force: shadow computes zero")
        upload(mavproxy, f"seatrial params upload {name}")
        assert second.server.value("FF0_M_U") == 111.0
        mavproxy.ask("seatrial ff both", "disarmed, vehicle 2 takes both whatever its shadow showed")
        mavproxy.ask("seatrial vehicle 1", "vehicle: 1")
        mavproxy.ask(f"seatrial params diff {name}", r"FF0_M_U +not set +111 +- +kg +- +- +changed")
    finally:
        mavproxy.ask("seatrial vehicle 1", "vehicle: 1")


def test_an_armed_vehicle_takes_what_a_code_for_armed_ones_confirms_and_nothing_while_its_feed_forward_acts(
    mavproxy, folder, second
):
    coefficients = write(folder, "armed.param", FF0_M_V=111, FF0_D_V=33)
    mode = write(folder, "mode.param", FF_MODE=1)
    mavproxy.ask("seatrial vehicle 2", "vehicle: 2")
    second.bridge.arm(True)
    try:
        mavproxy.until("seatrial status", "2/1 .* ARMED")
        code = mavproxy.ask(
            f"seatrial params upload {mode}", r"which is ARMED:\n\s+seatrial params yes armed-(\S+)"
        )[1]
        mavproxy.ask(f"seatrial params yes {code}", "the vehicle is ARMED; to write all the same")
        assert second.server.mode == 0
        mavproxy.ask(
            f"seatrial params yes armed-{code}", r"(?s)FF_MODE +off +shadow +read back equal.*values before"
        )
        code = mavproxy.ask(
            f"seatrial params upload {coefficients}", r"which is ARMED:\n\s+seatrial params (yes armed-\S+)"
        )[1]
        mavproxy.ask(
            f"seatrial params {code}", r"(?s)FF0_D_V +N/\(m/s\) +not set +33 +read back equal.*values before"
        )
        assert second.server.active(0)["D_v"] == 33.0
        second.server.write("FF_MODE", 3.0, False)
        mavproxy.ask(
            "seatrial params rollback armed", "acts on the thrusters: force the feed-forward off first"
        )
        second.server.write("FF_MODE", 1.0, True)
        mavproxy.ask("seatrial ff shadow", "which is ARMED, to shadow:\n\\s+seatrial ff yes shadow armed")
        mavproxy.ask("seatrial ff yes shadow", "the vehicle is ARMED; to set it all the same")
    finally:
        second.bridge.arm(False)
        second.server.write("FF_MODE", 0.0, False)
        mavproxy.ask("seatrial vehicle 1", "vehicle: 1")


@pytest.mark.slow
def test_from_a_dive_to_a_verified_upload_with_mavproxy_answering_all_along(mavproxy, folder, dive):
    path = dive.relative_to(folder)
    mavproxy.ask("seatrial file ruvifist:hovering", r"vehicle file: .*\(ruvifist\), configuration: hovering")
    mavproxy.ask("seatrial file ruvifist", "configuration: the recording's own")
    mavproxy.ask(f"seatrial identify {path} --method likelihood", "identify: .* in a process of its own")
    mavproxy.ask("seatrial identify", "identify .* runs; wait for it")
    mavproxy.ask("seatrial status", "identify .*: runs for")
    mavproxy.wait_for(r"(?s)M_u .*identify .*: done.* after \d+ s\n(seatrial params upload \S+)\n")
    values = read_parameters(dive / "identified.param")
    # A dive this short tells not every damping: the other half of these axes is taken on purpose.
    despite = f"--accept-implausible {' '.join(values)}"
    upload(mavproxy, f"seatrial params upload {path}/identified.param {despite}")
    mavproxy.ask(
        f"seatrial params diff {path}/identified.param", f"{len(values)} parameters: {len(values)} same"
    )


def test_cancel_ends_what_runs(mavproxy, folder, dive):
    path = dive.relative_to(folder)
    mavproxy.ask(f"seatrial diagnose {path} --vehicle ruvifist", "diagnose: .* in a process of its own")
    mavproxy.ask("seatrial cancel", r"diagnose .*: stopped by the user, after \d+ s")
    mavproxy.ask("seatrial cancel", "nothing runs that could be ended")


def test_it_is_taken_out_and_put_in_again_without_a_trace(mavproxy):
    mavproxy.ask("seatrial record start reloaded", "recording into")
    mavproxy.until("seatrial status", r"recording into .* [1-9]\d+ frames")
    mavproxy.ask(
        "module unload gcs_plugin.mavproxy", r"(?s)recorded \d+ frames.*Unloaded module gcs_plugin.mavproxy"
    )
    mavproxy.ask("seatrial status", "Unknown command 'seatrial status'")
    mavproxy.ask("module load gcs_plugin.mavproxy", "Loaded module gcs_plugin.mavproxy")
    mavproxy.until("seatrial vehicle 1", r"vehicle: 1 \(systems that beat: 1, 2\)")
    mavproxy.until("seatrial status", "meant: vehicle 1, component 1")
