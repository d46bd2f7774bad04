"""The module in a real MAVProxy: two vehicles, an armed one, and the whole way from a dive to a verified upload."""

import pytest
from console import upload, write

from gcs_plugin.params.files import read_parameters


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
