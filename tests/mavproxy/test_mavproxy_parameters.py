"""Parameters from MAVProxy, by themselves: an upload in the middle of which the module is taken out."""

import pytest
from fakes.vehicle import FakeVehicle

from bridge.wire.framing import Encoder, Framer
from gcs_plugin.fleet import Fleet
from gcs_plugin.peers import GROUND_STATION

parameters = pytest.importorskip("gcs_plugin.mavproxy.parameters", reason="MAVProxy is not installed")

OLD = {"FF0_M_U": 10.0, "FF0_D_U": 10.0, "FF_MODE": 0.0}


class Ground:
    """MAVProxy on a link to a vehicle in lock-step."""

    def __init__(self):
        self.vehicle, self.fleet, self.said = (
            FakeVehicle(source=(1, 191), autopilot=8, holds=OLD),
            Fleet(),
            [],
        )
        self._encoder, self._framer = Encoder(*GROUND_STATION), Framer()
        self.put_in()

    def put_in(self):
        """The module anew, as a reload makes it."""
        self.parameters = parameters.Parameters(self.fleet, self.vehicle.clock, self.said.append)

    def upload(self):
        """Upload a file and agree to it."""
        self.parameters.command(["upload", "new.param"])
        self.go_on(lambda: "seatrial params yes" in self.said[-1])
        self.parameters.command(["yes", self.said[-1].split()[-1]])

    def go_on(self, done):
        """Let time pass until `done()`, a minute at most."""
        for _ in range(1200):
            if done():
                return
            for message in self.parameters.tick():
                self.vehicle.write(self._encoder.encode(message))
            for frame in self._framer.feed(self.vehicle.read(0.05)):
                news = self.fleet.on_frame(frame, "link", self.vehicle.clock.now_s)
                if news is not None:
                    self.parameters.on_news(news)
        raise AssertionError(self.said)


@pytest.fixture
def ground(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)
    (tmp_path / "new.param").write_text("FF0_M_U,24.5\n")
    made = Ground()
    made.go_on(lambda: made.vehicle.clock.now_s > 3.0)
    return made


def test_an_upload_in_which_the_module_is_taken_out_says_so_and_lets_others_write_to_its_vehicle(ground):
    ground.upload()
    ground.go_on(lambda: ground.vehicle.sets)
    before = ground.parameters
    before.end()
    assert before.tick() == []
    assert any(": MAVProxy took this module out meanwhile" in line for line in ground.said)
    ground.put_in()
    ground.upload()
    ground.go_on(lambda: any("applied: " in line for line in ground.said))
    assert ground.vehicle.flying()["FF0_M_U"] == 24.5


def test_a_plan_that_nobody_agreed_to_goes_with_the_module(ground):
    ground.parameters.command(["upload", "new.param"])
    ground.go_on(lambda: "seatrial params yes" in ground.said[-1])
    ground.parameters.end()
    assert ground.said[-1] == "params: stopped, nothing was written"
    assert ground.parameters.status() == []
