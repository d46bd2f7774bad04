"""The module in a real MAVProxy: commands are typed into it, and its output is read.

One MAVProxy with two vehicles, on a link each: the simulated one (system 1), and a bridge without devices (system 2).
"""

import dataclasses
import re
import socket
import subprocess
import threading
from pathlib import Path

import pytest
from console import MAVPROXY, Console

from bridge.clock import SystemClock
from bridge.errors import LinkError
from bridge.link.open import open_link
from bridge.parameters import ParameterServer, vehicle_table
from bridge.service import Bridge
from bridge.tlog import read_tlog
from bridge.vehicle.config import load_vehicle
from gcs_plugin.folder import load_folder
from gcs_plugin.job import seatrial_command
from gcs_plugin.params.files import read_parameters
from tui import cli, exit_codes

pytestmark = pytest.mark.skipif(
    MAVPROXY is None, reason="MAVProxy is not installed: pip install -e .[mavproxy]"
)

LEGS = """
name: there and back
legs:
  - {name: rest, phase: rest, duration_s: 3}
  - {name: surge, duration_s: 3, push_surge_n: 24, alternate: 8}
"""
STEP_S = 0.05


def free_port():
    with socket.socket() as sock:
        sock.bind(("127.0.0.1", 0))
        return sock.getsockname()[1]


class SecondVehicle:
    """A bridge of system 2 without any device, in a thread."""

    def __init__(self, link):
        vehicle = dataclasses.replace(load_vehicle("ruvifist").vehicle, system_id=2)
        self.server = ParameterServer(None, vehicle_table(vehicle), system=2)
        self.link = open_link(link)
        self.bridge = Bridge(vehicle, SystemClock(), [self.link], self.server)
        self.stop = threading.Event()
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()

    def run(self):
        while not self.stop.wait(STEP_S):
            self.bridge.step()

    def close(self):
        self.stop.set()
        self.thread.join()
        self.link.close()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("mavproxy")


@pytest.fixture(scope="module")
def dive(folder):
    """A dive of the simulated vehicle that tells something."""
    legs = folder / "legs.yaml"
    legs.write_text(LEGS, encoding="utf-8")
    words = ["simulate", "--vehicle", "ruvifist:hovering", "--mission", str(legs), "--seed", "100001"]
    assert cli.main([*words, "--out", str(folder / "earlier")]) == exit_codes.DONE
    return next((folder / "earlier").iterdir())


@pytest.fixture(scope="module")
def second():
    link = f"tcpin:127.0.0.1:{free_port()}"
    try:
        vehicle = SecondVehicle(link)
    except LinkError as error:
        pytest.fail(str(error))
    vehicle.name = link
    yield vehicle
    vehicle.close()


@pytest.fixture(scope="module")
def mavproxy(folder, second):
    """MAVProxy with vehicle 1 meant, once it hears both for long enough."""
    link = f"tcpin:127.0.0.1:{free_port()}"
    words = [
        *seatrial_command(),
        "simulate",
        "--vehicle",
        "ruvifist:hovering",
        "--mission",
        "idle",
        "--link",
        link,
    ]
    with subprocess.Popen(words, cwd=folder, stderr=subprocess.PIPE, text=True) as simulator:
        try:
            assert "afloat" in simulator.stderr.readline()
            masters = [name.replace("tcpin:", "tcp:") for name in (link, second.name)]
            with Console(folder, masters) as console:
                console.wait_for("Loaded module gcs_plugin.mavproxy")
                console.wait_for("Detected vehicle 1:1")
                console.wait_for("Detected vehicle 2:1")
                console.until("seatrial vehicle 1", r"vehicle: 1 \(systems that beat: 1, 2\)")
                console.until("seatrial status", "meant: vehicle 1, component 1")
                yield console
        finally:
            simulator.terminate()
            simulator.stderr.close()


def write(folder, name, **values):
    (folder / name).write_text("".join(f"{key},{value}\n" for key, value in values.items()))
    return name


def upload(mavproxy, line):
    """Type an upload, then its code; what came of it."""
    code = mavproxy.ask(line, r"to write .* to vehicle \d:\n\s+seatrial params (yes \S+)\n")[1]
    return mavproxy.ask(f"seatrial params {code}", r"(?s)what became of it.*values before: (\S+)\n")


def test_status_tells_each_vehicle_and_that_nothing_is_recorded(mavproxy):
    said = mavproxy.ask("seatrial status", "(?s)(.*)NOT RECORDING")[1]
    assert re.search(
        r"1/1 on tcp:127.0.0.1:\d+: heard \d\.\d s ago, \d+ frames, 0.0% lost as seen here", said
    )
    assert re.search(r"2/1 on .*disarmed", said)


def test_commands_are_completed_and_help_names_each(mavproxy, folder):
    write(folder, "completed.param", FF0_M_U=1)
    mavproxy.type("seatrial par\t di\t comp\t", end="")
    mavproxy.wait_for("seatrial params diff completed.param")
    mavproxy.type("", end="\n")
    mavproxy.wait_for("outside|summary|parameters: ")
    for word in ("status", "record", "identify", "diagnose", "params", "ff", "vehicle", "file", "cancel"):
        mavproxy.ask(f"seatrial help {word}", f"seatrial {word}")
    mavproxy.ask("seatrial hlep", r"usage: seatrial status \| record")


def test_a_recording_holds_what_was_heard_and_what_was_sent_and_the_notes(mavproxy, folder):
    made = mavproxy.ask("seatrial record start one", r"recording into (one/\S+):")[1]
    mavproxy.ask("seatrial record note the current comes from the north", "noted in")
    mavproxy.until("seatrial status", r"recording into .* [1-9]\d{2,} frames")
    upload_like = write(folder, "recorded.param", FF0_D_U=41)
    mavproxy.ask(f"seatrial params diff {upload_like}", "1 parameters: ")
    mavproxy.ask("seatrial record stop", rf"recorded \d+ frames, \d+ kB: {made}")
    dive = load_folder(folder / made)
    assert [event.text for event in dive.about().events] == ["the current comes from the north"]
    frames = [frame for path in dive.telemetry() for _, frame in read_tlog(path)]
    systems = {frame.system for frame in frames}
    assert systems == {1, 2, 255}
    asked = [frame for frame in frames if frame.system == 255 and frame.message_id == 21]
    assert asked, "the recording lacks the PARAM_REQUEST_LIST that was sent"
    mavproxy.ask("seatrial record stop", "nothing is being recorded")


def test_an_upload_asks_for_its_code_and_is_read_back_and_rolled_back_in_one_step(mavproxy, folder):
    name = write(folder, "set.param", FF1_M_U=120.5, FF1_D_U=50.25, FF1_D_V=-1)
    mavproxy.ask(f"seatrial params diff {name}", "3 parameters: 2 changed, 1 refused")
    mavproxy.ask(f"seatrial params upload {name}", "FF1_D_V: -1 is outside .*nothing was sent")
    mavproxy.ask("seatrial params yes 2-000000", "there is no plan to agree to")
    mavproxy.ask(
        f"seatrial params upload {name} FF1_M_U FF1_D_U", r"to write these 2 parameters to vehicle 1"
    )
    mavproxy.ask("seatrial params yes 2-000000", "is not the code of the plan shown.*nothing was sent")
    done = upload(mavproxy, f"seatrial params upload {name} FF1_M_U FF1_D_U")
    assert re.search(r"FF1_M_U +0 +120.5 +read back equal", done[0])
    assert "2 parameters written and read back" in done[0]
    assert read_parameters(folder / done[1])["FF1_M_U"] == 0.0
    mavproxy.ask(
        f"seatrial params upload {name} FF1_M_U FF1_D_U", "holds all of it already; nothing was written"
    )
    mavproxy.ask("seatrial params rollback", r"(?s)FF1_M_U +120.5 +0 +read back equal.*values before")


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


def test_two_vehicles_are_told_apart_and_nothing_is_sent_while_none_is_chosen(mavproxy, folder, second):
    name = write(folder, "second.param", FF0_M_U=111)
    before = dict(second.server._staged)
    try:
        mavproxy.ask("seatrial vehicle any", "vehicle: any")
        for line in (f"params upload {name}", "params rollback", f"params diff {name}", "ff both"):
            mavproxy.ask(f"seatrial {line}", r"several vehicles beat \(systems 1, 2\) and none is chosen")
        assert second.server._staged == before
        mavproxy.ask("seatrial vehicle 7", "no vehicle beats as system 7; these do: 1, 2")
        mavproxy.ask("seatrial vehicle 2", "vehicle: 2")
        mavproxy.ask(f"seatrial params diff {name}", r"FF0_M_U +0 +111 +changed")
        mavproxy.ask("seatrial ff both", "vehicle 2 has no parameters in force to feed forward")
        upload(mavproxy, f"seatrial params upload {name}")
        assert second.server.value("FF0_M_U") == 111.0
        mavproxy.ask("seatrial vehicle 1", "vehicle: 1")
        mavproxy.ask(f"seatrial params diff {name}", r"FF0_M_U +0 +111 +changed")
    finally:
        mavproxy.ask("seatrial vehicle 1", "vehicle: 1")


def test_from_a_dive_to_a_verified_upload_with_mavproxy_answering_all_along(mavproxy, folder, dive):
    path = dive.relative_to(folder)
    mavproxy.ask("seatrial file ruvifist", "vehicle file: ")
    mavproxy.ask(f"seatrial identify {path} --method likelihood", "identify: .* in a process of its own")
    mavproxy.ask("seatrial identify", "identify .* runs; wait for it")
    mavproxy.ask("seatrial status", "identify .*: runs for")
    mavproxy.wait_for(r"(?s)M_u .*identify .*: done.* after \d+ s\n(seatrial params upload \S+)\n")
    upload(mavproxy, f"seatrial params upload {path}/identified.param")
    values = read_parameters(dive / "identified.param")
    mavproxy.ask(
        f"seatrial params diff {path}/identified.param", f"{len(values)} parameters: {len(values)} same"
    )


def test_cancel_ends_what_runs(mavproxy, folder, dive):
    path = dive.relative_to(folder)
    mavproxy.ask(f"seatrial diagnose {path} --vehicle ruvifist", "diagnose: .* in a process of its own")
    mavproxy.ask("seatrial cancel", r"diagnose .*: stopped by the user, after \d+ s")
    mavproxy.ask("seatrial cancel", "nothing runs that could be ended")


def test_the_docs_tell_every_command(mavproxy):
    page = (Path(__file__).resolve().parents[2] / "docs" / "ground_stations.md").read_text(encoding="utf-8")
    named = mavproxy.ask("seatrial help nonsense", r"usage: seatrial (status .*)\n")[1].split(" | ")
    assert len(named) == 10
    for command in named:
        assert re.search(rf"\| `seatrial {command}\b", page), command


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
