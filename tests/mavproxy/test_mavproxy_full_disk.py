"""An upload from MAVProxy while the disk fills up: the set in force is reported, and the next upload writes it down."""

import errno
import os
from types import SimpleNamespace

import pytest

from bridge.clock import SimulatedClock
from bridge.onboard.parameters import ParameterServer
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.parameters import vehicle_table
from gcs_plugin.params.session import News

parameters = pytest.importorskip("gcs_plugin.mavproxy.parameters", reason="MAVProxy is not installed")


class Sea:
    """MAVProxy's parameters with one vehicle, in simulated time; `said` is what the crew read."""

    def __init__(self):
        self.clock, self.said = SimulatedClock(), []
        self.server = ParameterServer(None, vehicle_table(load_vehicle("ruvifist").vehicle))
        fleet = SimpleNamespace(
            meant=lambda _: (1, 1),
            peers=SimpleNamespace(armed=lambda _: False, fault=lambda _: "", get=lambda _: self.peer()),
        )
        self.parameters = parameters.Parameters(fleet, self.clock, self.said.append)

    def peer(self):
        """The vehicle, which beat just now."""
        return SimpleNamespace(link="", heard_s=self.clock.now_s, beats=lambda *_: True)

    def ask(self, words):
        """The lines until nothing is read or written any more."""
        self.said.clear()
        self.parameters.command(words.split())
        while self.parameters.busy or self.parameters.tick():
            self.clock.advance_to(self.clock.now_s + 0.05)
            for message in self.parameters.tick():
                for answer in self.server.handle(message, False):
                    self.parameters.on_news(News((1, 1), answer))
            for answer in self.server.step(20):
                self.parameters.on_news(News((1, 1), answer))
        return "\n".join(self.said)


def test_a_full_disk_hides_nothing_of_what_came_into_force(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "new.param").write_text("FF1_M_U,111.5\nFF1_D_U,56.25\n", encoding="utf-8")
    sea, fsync = Sea(), os.fsync
    (code,) = (line.split()[-1] for line in sea.ask("upload new.param").splitlines() if "params yes" in line)

    def full(file):
        if any(sea.server.active(1).values()):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        fsync(file)

    with monkeypatch.context() as disk:
        disk.setattr("os.fsync", full)
        told = sea.ask(f"yes {code}")
    assert "2 parameters written and read back, set " in told
    assert told.index("read back equal") < told.index("its receipt still says that it was begun: ")
    assert "No space left on device" in told
    assert "receipt: " not in told
    again = sea.ask("upload new.param")
    assert "already so: " in again
    assert "accepted: " in again
    assert "never finished" not in sea.ask("diff new.param")
