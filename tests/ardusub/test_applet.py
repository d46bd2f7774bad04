"""The applet put in, looked at and taken out by MAVLink alone, with the fake and with the firmware alike."""

import json
import math
import random
from dataclasses import replace

import pytest
from fakes.ardusub import Ardusub
from fakes.firmware import RealTime
from rig import Aboard, Pilot, ready
from test_applet_law import wired

from bench.ardusub.firmware import SteppedLink
from bridge import exit_codes
from bridge.ardusub.applet import applet, wiring_fault
from bridge.errors import LinkError, ParamRejected, ParamUnverified
from bridge.links.open import open_link
from bridge.links.reconnecting import Reconnecting
from bridge.simulator.json_plant import FOR_SCRIPTS_HZ
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.parameters import set_crc
from gcs_plugin.applet import FREEZES, Deployment, Station
from gcs_plugin.params.client import ParameterClient
from gcs_plugin.params.files import read_parameters
from gcs_plugin.params.last_accepted import newest_before
from gcs_plugin.params.proposal import propose_rollback, propose_upload
from gcs_plugin.params.receipt import newest
from gcs_plugin.params.transfer import Outcome
from gcs_plugin.params.wanted import Wanted
from tui.cli import main

FILE = load_vehicle("bluerov2")
WIRED = {f"SERVO{8 + n}_FUNCTION": 32 + n for n in range(1, 7)}


class Ground(SteppedLink):
    """The end of a link at the ground; time passes for a fake while it is read, a little with each read."""

    def read(self, timeout_s):
        return super().read(max(timeout_s, 0.01))


@pytest.fixture(params=["fake", "firmware"])
def autopilot(request, tmp_path):
    """ArduSub in the fail-safe wiring, scripting off as it comes."""
    if request.param == "fake":
        pytest.importorskip("lupa.lua53", reason="the Lua of applets needs the package lupa")
        made = wired(Ardusub())
        made.parameters["SCR_ENABLE"] = 0.0
        made.quirks.read_s = 0.02
        made.link = Ground(made)
    else:
        made = RealTime(
            tmp_path / "sitl", settings=WIRED, first_output=9, depth_m=10.0, step_hz=FOR_SCRIPTS_HZ
        )
        name, first = made.ground.name, [made.ground]
        made.link = made.ground = Reconnecting(
            lambda: first.pop() if first else open_link(name), made.clock, name
        )
    ready(made, Pilot(made))
    yield made
    made.link.close()
    made.close()


def deployment(autopilot):
    return Deployment(autopilot.link, autopilot.clock, FILE, "standard")


def deployed(autopilot, receipts):
    """Put the applet in; what was said under way. A firmware that keeps overrides is to be refused, and no more."""
    said = []
    try:
        deployment(autopilot).deploy(receipts, said.append)
    except ParamRejected as error:
        if autopilot.is_firmware and FREEZES in str(error):
            assert deployment(autopilot).look().there is None
            pytest.skip("this firmware keeps overrides for ever, and the applet was refused as it should be")
        raise
    return said


def upload(autopilot, receipts, values):
    """Upload by the way of every vehicle; its receipt."""
    client = ParameterClient(autopilot.link, autopilot.clock)
    assert client.find_vehicle() == (1, 1)
    read_at = newest(receipts, 1)
    plan = propose_upload(receipts / "set.param", Wanted(values), client.read_all(), None, receipts, 1)
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


@pytest.fixture
def fake():
    pytest.importorskip("lupa.lua53", reason="the Lua of applets needs the package lupa")
    made = wired(Ardusub())
    made.link = Ground(made)
    made.scripting.boot(0.0)
    return made


def unchanged(fake, act, error, words):
    """`act` raises, and neither parameters nor files are others than before."""
    before = dict(fake.parameters), dict(fake.scripting.files)
    with pytest.raises(error, match=words):
        act()
    assert (fake.parameters, fake.scripting.files) == before


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"SERVO9_FUNCTION": 94.0}, "SERVO9_FUNCTION is 94, an output of scripts.*disarmed too"),
        ({"SERVO3_FUNCTION": 96.0, "SERVO11_FUNCTION": 35.0}, "SERVO3_FUNCTION is 96, an output of scripts"),
        (
            {f"SERVO{n}_FUNCTION": 0.0 for n in range(9, 15)},
            "SERVO9_FUNCTION is 0, not 33: wire the thrusters",
        ),
        ({"SERVO2_FUNCTION": 0.0}, "SERVO2_FUNCTION is 0, not 34"),
        ({"SERVO2_FUNCTION": math.inf}, "SERVO2_FUNCTION is inf, no whole number"),
        ({"FRAME_CONFIG": math.nan}, "FRAME_CONFIG nan is not supported: 1 .vectored."),
        ({"SERVO12_FUNCTION": 33.0}, "SERVO12_FUNCTION is 33, not 36"),
        (
            {"FRAME_CONFIG": 2.0},
            "FRAME_CONFIG 2 is not supported for a vehicle file of 6 thrusters: it has 8; name that vehicle's own "
            "file, such as bluerov2_heavy",
        ),
        ({"FRAME_CONFIG": 3.0}, "FRAME_CONFIG 3 is not supported: 1 .vectored. and 2 .vectored_6dof. are"),
    ],
)
def test_in_another_wiring_it_refuses_with_the_reason_and_sends_nothing(fake, tmp_path, changes, words):
    fake.parameters |= changes
    made = deployment(fake)
    unchanged(fake, lambda: made.deploy(tmp_path, print), ParamRejected, words)
    assert not made.look().good


def test_a_firmware_without_scripting_is_refused(fake):
    values = {name: value for name, value in fake.parameters.items() if name != "SCR_ENABLE"}
    assert "can't run scripts" in wiring_fault(values, 6)


def test_an_armed_vehicle_is_left_alone(fake, tmp_path):
    fake.armed = True
    made = deployment(fake)
    unchanged(fake, lambda: made.deploy(tmp_path, print), ParamRejected, "armed")
    unchanged(fake, lambda: made.remove(print), ParamRejected, "armed")


@pytest.mark.parametrize("word", ["writing", "removing"])
def test_scripts_do_not_start_anew_under_a_vehicle_that_was_armed_meanwhile(fake, tmp_path, word):
    deployed(fake, tmp_path)
    made, starts = deployment(fake), []
    fake.quirks.disarms_without_ground = False
    fake.scripting.restart = starts.append

    def arm(words):
        fake.armed = fake.armed or words.startswith(word)

    act = made.remove if word == "removing" else lambda tell: made.deploy(tmp_path, tell)
    with pytest.raises(ParamRejected, match="is armed; the script is"):
        act(arm)
    assert starts == []


def test_a_vehicle_that_was_armed_since_it_was_looked_at_is_left_alone(fake):
    made = deployment(fake)
    fake.quirks.disarms_without_ground = False
    fake.armed = True
    fake.run(2.0)
    unchanged(fake, lambda: made.remove(print), ParamRejected, "armed; nothing was sent")


def test_beside_a_companion_it_is_refused(fake):
    aboard = Aboard(fake)
    fake.run(2.0, aboard)
    listen, fake.link.read = fake.link.read, lambda timeout_s: aboard() or listen(timeout_s)
    with pytest.raises(LinkError, match="companion, component 191"):
        deployment(fake)


def test_a_script_that_arrived_damaged_never_runs(fake, tmp_path):
    fake.scripting.damages_files = True
    with pytest.raises(ParamUnverified, match="not what was sent"):
        deployed(fake, tmp_path)
    assert fake.scripting.files == {}
    assert fake.scripting.scripts == []


def test_a_script_that_can_not_be_loaded_is_noticed(fake, tmp_path):
    fake.scripting.lacks_memory = True
    with pytest.raises(ParamUnverified, match="SCR_HEAP_SIZE"):
        deployed(fake, tmp_path)


def test_on_a_firmware_that_keeps_overrides_it_takes_itself_out_again(fake, tmp_path):
    fake.scripting.ends_overrides = False
    with pytest.raises(ParamRejected, match="keeps an override for ever"):
        deployed(fake, tmp_path)
    assert fake.scripting.files == {}
    assert fake.scripting.scripts == []


def test_deployed_again_it_leaves_the_feedforward_off_and_the_set_in_force(fake, tmp_path):
    deployed(fake, tmp_path)
    assert upload(fake, tmp_path, {"FF0_M_U": 18.0}).good
    fake.parameters["FF_MODE"] = 3.0
    fake.run(0.1)
    deployed(fake, tmp_path)
    state = deployment(fake).look()
    assert (state.good, state.mode) == (True, 0.0)
    assert state.active > 0


def test_the_script_of_another_vehicle_file_is_told_apart(fake, tmp_path):
    deployed(fake, tmp_path)
    fake.parameters |= {"MOT_1_DIRECTION": 1.0}
    name = "scripts/seatrial.lua"
    fake.scripting.files[name] = fake.scripting.files[name].replace(b"pace = 3.0", b"pace = 4.0")
    state = deployment(fake).look()
    assert (state.there, state.is_mine, state.good) == (False, True, False)


def test_the_name_of_a_vehicle_adds_no_line_to_its_script(fake):
    strange = replace(FILE, vehicle=replace(FILE.vehicle, name="{a}\nerror('b')\r\n"))
    text, plain = (applet(file, "standard", fake.parameters).text for file in (strange, FILE))
    assert text.splitlines()[1:] == plain.splitlines()[1:]
    assert text.startswith("-- seatrial.lua, made by seatrial for {a}?error('b')??:standard; do not edit\n")


def test_a_lossy_link_brings_it_over_whole(fake, tmp_path):
    fake.link = Losing(fake, 0.2)
    assert deployed(fake, tmp_path)
    made = applet(FILE, "standard", fake.parameters)
    assert fake.scripting.files == {"scripts/seatrial.lua": made.text.encode()}


def rolled_back(autopilot, receipts, even_armed=False):
    """Roll the newest upload back; its receipt."""
    client = ParameterClient(autopilot.link, autopilot.clock)
    assert client.find_vehicle() == (1, 1)
    before = newest_before(receipts, 1)
    wanted = Wanted(read_parameters(before))
    plan = propose_rollback(before, wanted, client.read_all(), receipts, 1)
    order = plan.order(receipts, autopilot.clock.unix_s(), even_armed=even_armed, read_at=newest(receipts, 1))
    return client.apply(order)


@pytest.mark.parametrize("values", [{"FF0_M_U": 16.5}, {}], ids=["changed", "the file's own model"])
def test_a_roll_back_of_the_first_upload_leaves_no_set_in_force_after_a_reboot_too(
    autopilot, tmp_path, values
):
    deployed(autopilot, tmp_path)
    held = ParameterClient(autopilot.link, autopilot.clock)
    assert held.find_vehicle() == (1, 1)
    before = {name: value for name, value in held.read_all().items() if name.startswith("FF0_")}
    assert upload(autopilot, tmp_path, before | values).good
    assert deployment(autopilot).look().active > 0
    back = rolled_back(autopilot, tmp_path)
    assert back.good, back.sentence
    assert back.sentence.endswith("no set is in force, as before the upload")
    assert none_in_force(autopilot, before)
    Station(autopilot.link, autopilot.clock, (1, 1)).reboot()
    autopilot.run(5.0)
    assert none_in_force(autopilot, before)


def none_in_force(autopilot, staged):
    """Whether a script runs, off and without a set, and these values are staged."""
    state = deployment(autopilot).look()
    present = deployment(autopilot).present
    return (state.good, state.active, state.mode) == (True, 0.0, 0.0) and present.items() >= staged.items()


def test_a_roll_back_that_can_not_take_the_set_out_of_force_says_so_with_the_way_out(fake, tmp_path):
    deployed(fake, tmp_path)
    assert upload(fake, tmp_path, {"FF0_M_U": 16.5}).good
    fake.scripting.restart = lambda _: None
    back = rolled_back(fake, tmp_path)
    assert (back.good, back.outcome) == (False, Outcome.UNVERIFIED)
    assert "reboot the autopilot: no set is in force after its start" in back.sentence
    fake.scripting.boot(fake.clock.now_s)
    fake.run(2.0)
    assert fake.parameters["FF_ACTIVE"] == 0.0


def test_a_restart_that_is_lost_on_the_way_is_ordered_again(fake, tmp_path):
    deployed(fake, tmp_path)
    assert upload(fake, tmp_path, {"FF0_M_U": 16.5}).good
    restart, asked = fake.scripting.restart, []
    fake.scripting.restart = lambda now_s: asked.append(now_s) or (len(asked) > 1 and restart(now_s))
    back = rolled_back(fake, tmp_path)
    assert back.good, back.sentence
    assert len(asked) == 2
    assert deployment(fake).look().active == 0.0


def test_scripts_do_not_start_anew_under_an_armed_vehicle(fake, tmp_path):
    deployed(fake, tmp_path)
    assert upload(fake, tmp_path, {"FF0_M_U": 16.5}).good
    fake.armed, fake.quirks.disarms_without_ground = True, False
    with pytest.raises(ParamRejected, match="its scripts are to start anew; nothing was sent: disarm it"):
        rolled_back(fake, tmp_path, even_armed=True)
    assert fake.parameters["FF0_M_U"] == 16.5


def test_a_reboot_in_place_of_the_restart_comes_to_the_same(fake, tmp_path):
    deployed(fake, tmp_path)
    assert upload(fake, tmp_path, {"FF0_M_U": 16.5}).good
    fake.scripting.restart = fake.scripting.boot
    back = rolled_back(fake, tmp_path)
    assert back.good, back.sentence
    assert deployment(fake).look().active == 0.0


def test_a_roll_back_leaves_alone_what_others_have_set_since(autopilot, tmp_path):
    deployed(autopilot, tmp_path)
    assert upload(autopilot, tmp_path, {"FF0_M_U": 18.0}).good
    assert upload(autopilot, tmp_path, {"FF0_M_U": 19.0}).good
    pilot, tightened = Pilot(autopilot), {"FS_PILOT_TIMEOUT": 1.0, "JS_GAIN_DEFAULT": 0.25}
    for name, value in tightened.items():
        pilot.write(name, value)
        autopilot.run(0.5, pilot)
    back = rolled_back(autopilot, tmp_path)
    assert back.good, back.sentence
    assert {line.name for line in back.lines if not line.name.startswith("FF")} == set()
    assert {name: pilot.read(name) for name in tightened} == pytest.approx(tightened)
    assert pilot.read("FF0_M_U") == 18.0


@pytest.fixture
def seatrial(fake, monkeypatch):
    """The command on the fake: its exit code by the words of a line."""
    monkeypatch.setattr("tui.links.link_for", lambda *_: fake.link)
    monkeypatch.setattr("bridge.clock.SystemClock", lambda: fake.clock)

    def run(line, *options):
        return main([*line.split(), *options, "--link", "udpin:127.0.0.1:14550"])

    return run


def test_the_command_deploys_checks_and_removes(seatrial, tmp_path, capsys):
    deploy = f"applet deploy --vehicle bluerov2 --yes --receipts {tmp_path}"
    check = "applet check --vehicle bluerov2"
    assert seatrial(check) == exit_codes.NO
    assert "runs: no" in capsys.readouterr().out
    assert seatrial(deploy, "--json", str(tmp_path / "state.json")) == exit_codes.DONE
    state = json.loads((tmp_path / "state.json").read_text())
    assert (state["good"], state["runs"], state["mode"]) == (True, True, 0.0)
    assert "no set in force" in capsys.readouterr().out
    assert seatrial(check) == exit_codes.DONE
    assert seatrial("applet remove --vehicle bluerov2 --yes") == exit_codes.DONE
    assert "script in scripts: none" in capsys.readouterr().out


def test_the_first_deploy_of_all_says_what_the_autopilot_holds_after_its_reboot(
    seatrial, fake, tmp_path, capsys
):
    fake.parameters["SCR_ENABLE"] = 0.0
    fake.scripting.boot(fake.clock.now_s)
    deploy = f"applet deploy --vehicle bluerov2 --yes --receipts {tmp_path}"
    assert seatrial(deploy) == exit_codes.DONE
    assert "script in scripts: that of the vehicle file" in capsys.readouterr().out


def test_the_command_asks_before_it_removes_from_a_wiring_that_does_not_fit_too(
    seatrial, fake, tmp_path, capsys
):
    deployed(fake, tmp_path)
    fake.parameters["SERVO3_FUNCTION"] = 96.0
    assert seatrial("applet remove --vehicle bluerov2") == exit_codes.BAD_INPUT
    assert "give --yes to remove without asking" in " ".join(capsys.readouterr().err.split())
    assert deployment(fake).look().there is not None


def test_the_command_refuses_a_wiring_that_freezes(seatrial, fake, tmp_path, capsys):
    fake.parameters["SERVO10_FUNCTION"] = 95.0
    assert seatrial(f"applet deploy --vehicle bluerov2 --receipts {tmp_path}") != exit_codes.DONE
    assert "keeps its last pulse" in capsys.readouterr().err


def test_ff_switches_it_as_any_vehicle_and_believes_the_script_alone(seatrial, fake, tmp_path):
    deployed(fake, tmp_path)
    assert upload(fake, tmp_path, {"FF0_M_U": 18.0}).good
    assert seatrial("ff both --yes --seconds 6") == exit_codes.DONE
    assert seatrial("ff off --seconds 6") == exit_codes.DONE
    assert fake.parameters["FF_MODE"] == 0.0
    fake.scripting.stop()
    assert seatrial("ff shadow --yes --seconds 6") == exit_codes.NO
    # The autopilot took the parameter of a script that does not run.
    assert fake.parameters["FF_MODE"] == 1.0


def test_ff_on_an_autopilot_alone_says_how_it_gets_a_feed_forward(seatrial, capsys):
    assert seatrial("ff both --yes --seconds 6") != exit_codes.DONE
    said = " ".join(capsys.readouterr().err.split())
    assert "the companion brings them (start seatrial bridge --ardusub), or the applet in it" in said
    assert seatrial("ff off --seconds 8") != exit_codes.DONE
    said = " ".join(capsys.readouterr().out.split())
    assert "an autopilot alone has no FF_MODE: start seatrial bridge --ardusub beside it" in said


class Losing(Ground):
    """A share of what is written, and of what is read, is lost."""

    def __init__(self, autopilot, share):
        super().__init__(autopilot)
        self.share, self.rng = share, random.Random(4)

    def read(self, timeout_s):
        data = super().read(timeout_s)
        return b"" if self.rng.random() < self.share else data

    def write(self, data):
        if self.rng.random() >= self.share:
            super().write(data)
