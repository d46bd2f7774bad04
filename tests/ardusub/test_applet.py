"""The applet put in, looked at and taken out by MAVLink alone, with the fake and with the firmware alike."""

import json
import threading

import pytest
from fakes.ardusub import MANUAL, Ardusub
from fakes.firmware import Firmware
from rig import Aboard, Pilot, arm, ready
from test_applet_law import wired

from bridge.ardusub.applet import applet, wiring_fault
from bridge.errors import LinkError, ParamRejected, ParamUnverified
from bridge.links.link import Link
from bridge.links.open import open_link
from bridge.links.reconnecting import Reconnecting
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.parameters import set_crc
from gcs_plugin.applet import Deployment
from gcs_plugin.params.client import ParameterClient
from gcs_plugin.params.comparison import Wanted, planned
from gcs_plugin.params.receipt import newest

FILE = load_vehicle("bluerov2")
WIRED = {f"SERVO{8 + n}_FUNCTION": 32 + n for n in range(1, 7)}


class Ground(Link):
    """The end of a link at the ground; time passes for a fake while it is read."""

    def __init__(self, autopilot):
        self.autopilot, self.name = autopilot, "fake"

    def read(self, timeout_s):
        self.autopilot.run(max(timeout_s, 0.01))
        return self.autopilot.ground.read(0.0)

    def write(self, data):
        self.autopilot.ground.write(data)

    def close(self):
        pass


@pytest.fixture(params=["fake", "firmware"])
def autopilot(request, tmp_path):
    """ArduSub in the fail-safe wiring, scripting off as it comes."""
    if request.param == "fake":
        pytest.importorskip("lupa.lua53", reason="the Lua of applets needs the package lupa")
        made = wired(Ardusub())
        made.parameters["SCR_ENABLE"] = 0.0
        made.link = Ground(made)
    else:
        made = Firmware(tmp_path / "sitl", settings=WIRED, first_output=9, depth_m=10.0)
        name, first = made.ground.name, [made.ground]
        made.link = made.ground = Reconnecting(
            lambda: first.pop() if first else open_link(name), made.clock, name
        )
    ready(made, Pilot(made))
    yield made
    made.close()


def deployment(autopilot):
    return Deployment(autopilot.link, autopilot.clock, FILE, "standard")


def deployed(autopilot, receipts):
    """Put the applet in; what was said under way."""
    said = []
    deployment(autopilot).deploy(receipts, said.append)
    return said


def upload(autopilot, receipts, values):
    """Upload by the way of every vehicle; its receipt."""
    client = ParameterClient(autopilot.link, autopilot.clock)
    assert client.find_vehicle() == (1, 1)
    read_at = newest(receipts, 1)
    plan = planned(receipts / "set.param", Wanted(values), client.read_all(), None, receipts, 1)
    return client.apply(plan.order(receipts, autopilot.clock.unix_s(), even_armed=False, read_at=read_at))


def test_from_scripting_off_to_a_set_in_force_and_out_again(autopilot, tmp_path):
    receipts = tmp_path / "receipts"
    before = deployment(autopilot).look()
    assert (before.folder, before.runs, before.good) == (None, False, False)
    said = deployed(autopilot, receipts)
    assert said[0].startswith("rebooting")
    state = deployment(autopilot).look()
    assert (state.good, state.mode, state.active) == (True, 0.0, 0.0)

    first = upload(autopilot, receipts, {"FF0_M_U": 16.5, "FF0_D_U": 4.0})
    assert first.good, first.sentence
    again = upload(autopilot, receipts, {"FF0_M_U": 18.5})
    assert again.good, again.sentence
    flown = ParameterClient(autopilot.link, autopilot.clock).read_all()
    held = {name: value for name, value in flown.items() if name.startswith("FF0_")}
    assert (held["FF0_M_U"], held["FF0_D_U"]) == (18.5, 4.0)
    assert flown["FF_ACTIVE"] == set_crc(held) == again.active_crc

    assert not deployed(autopilot, receipts)[0].startswith("rebooting")
    assert deployment(autopilot).look().active == again.active_crc
    deployment(autopilot).remove(said.append)
    gone = deployment(autopilot).look()
    assert (gone.there, gone.runs) == (None, False)


def test_a_stopped_script_is_not_taken_for_one_that_runs_though_its_parameters_answer(autopilot, tmp_path):
    deployed(autopilot, tmp_path)
    station = deployment(autopilot)
    if autopilot.is_firmware:
        stop_by_command(autopilot)
    else:
        autopilot.scripting.stop()
    state = station.look()
    assert (state.there, state.runs, state.good) == (True, False, False)
    pilot = Pilot(autopilot)
    assert pilot.read("FF_MODE") == 0.0


def stop_by_command(autopilot):
    """MAV_CMD_SCRIPTING with SCRIPTING_CMD_STOP."""
    autopilot.command(42701, 2.0)
    autopilot.run(2.0)
