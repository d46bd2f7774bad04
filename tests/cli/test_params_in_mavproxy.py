"""MAVProxy's `seatrial params` beside the verb and other MAVProxys in one folder, against the vehicle's real parameter
server, in simulated time."""

import pytest
from full_disk import full_once_in_force
from parameter_vehicle import at_any_link

from bridge import exit_codes
from bridge.wire.framing import Encoder, Framer
from gcs_plugin.fleet import Fleet
from tui import cli

in_mavproxy = pytest.importorskip("gcs_plugin.mavproxy.parameters", reason="MAVProxy is not installed")

STEP_S = 0.05


class Mavproxy:
    """The parameters of a MAVProxy that was started just now; `said` are its lines."""

    def __init__(self, vehicle):
        self.vehicle, self.fleet, self.said = vehicle, Fleet(), []
        self.parameters = in_mavproxy.Parameters(self.fleet, vehicle.clock, self.said.append)
        self._framer, self._encoder = Framer(), Encoder(255, 230)

    def ask(self, words):
        """Type `params WORDS` once the vehicle was heard; all that is said until nothing goes on any more."""
        self._pass(3.0)
        self.said.clear()
        assert self.parameters.command(words.split())
        self._step()
        while self.parameters.busy:
            self._step()
        self._step()
        return "\n".join(self.said)

    def upload(self, file):
        """Upload a file, and agree to the plan."""
        code = self.ask(f"upload {file}").rpartition("params yes ")[2]
        assert "values before: " in self.ask(f"yes {code}")

    def _pass(self, seconds):
        end_s = self.vehicle.clock.now_s + seconds
        while self.vehicle.clock.now_s < end_s:
            self._step()

    def _step(self):
        for message in self.parameters.tick():
            self.vehicle.write(self._encoder.encode(message))
        for frame in self._framer.feed(self.vehicle.read(STEP_S)):
            news = self.fleet.on_frame(frame, self.vehicle.name, self.vehicle.clock.now_s)
            if news is not None:
                self.parameters.on_news(news)


@pytest.fixture
def vehicle(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    vehicle = at_any_link(monkeypatch)
    for mass in (90, 111):
        (tmp_path / f"{mass}.param").write_text(f"FF1_M_U,{mass}\nFF1_D_U,50\n", encoding="utf-8")
    return vehicle


def verb(*words):
    return cli.main(["params", *words, "--yes", "--link", "any"])


def test_roll_backs_go_back_one_upload_at_a_time_whichever_program_made_them(vehicle):
    mavproxy = Mavproxy(vehicle)
    mavproxy.upload("90.param")
    assert verb("upload", "111.param") == exit_codes.DONE
    assert "read back equal" in mavproxy.ask("rollback")
    assert vehicle.server.active(1)["M_u"] == 90.0
    assert "read back equal" in Mavproxy(vehicle).ask("rollback")
    assert "M_u" not in vehicle.server.active(1)
    assert verb("rollback") == exit_codes.BAD_INPUT


def test_an_upload_of_what_the_vehicle_holds_already_leaves_a_receipt_and_is_accepted(vehicle, tmp_path):
    mavproxy = Mavproxy(vehicle)
    assert verb("upload", "90.param") == exit_codes.DONE
    said = mavproxy.ask("upload 90.param")
    assert "the vehicle holds all of it already; nothing was written" in said
    assert "intervals of 90.param could not be checked: 90.param.json is not beside it" in said
    for kind in ("receipt.json", "accepted.param"):
        assert len(list((tmp_path / "receipts").glob(f"*-{kind}"))) == 2


def test_a_full_disk_hides_nothing_of_what_came_into_force(vehicle, monkeypatch):
    mavproxy = Mavproxy(vehicle)
    code = mavproxy.ask("upload 111.param").rpartition("params yes ")[2]
    with monkeypatch.context() as disk:
        full_once_in_force(vehicle, disk)
        told = mavproxy.ask(f"yes {code}")
    assert "2 parameters written and read back, set " in told
    assert told.index("read back equal") < told.index("its receipt still says that it was begun: ")
    assert "No space left on device" in told
    assert "receipt: " not in told
    again = mavproxy.ask("upload 111.param")
    assert "already so: " in again
    assert "accepted: " in again
    assert "never finished" not in mavproxy.ask("diff 111.param")
