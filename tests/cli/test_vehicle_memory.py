"""A vehicle whose file is edited between two starts, and the ground that looks at it."""

from pathlib import Path

import pytest
from fakes.vehicle import VEHICLE, FakeVehicle
from parameter_vehicle import put_at_any_link

from bridge import exit_codes
from bridge.onboard.parameters import parameters_of
from bridge.vehicle.config import load_vehicle
from tui import cli

NONE_IN_FORCE = "no set is in force on the vehicle (FF_ACTIVE is 0)"


class Edited(FakeVehicle):
    """A vehicle that starts as the bridge does, from a file that can be edited."""

    def __init__(self, folder):
        self.file = folder / "ours.yaml"
        self.file.write_text(Path(VEHICLE).read_text(encoding="utf-8"), encoding="utf-8")
        super().__init__(store=folder / "parameters.json", file=self.file)

    def boot(self):
        self.server = parameters_of(load_vehicle(str(self.file)), self.store)

    def edit(self, before, after):
        text = self.file.read_text(encoding="utf-8")
        assert before in text
        self.file.write_text(text.replace(before, after, 1), encoding="utf-8")
        self.boot()


@pytest.fixture
def vehicle(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    vehicle = Edited(tmp_path)
    put_at_any_link(monkeypatch, vehicle)
    (tmp_path / "ours.param").write_text("FF1_M_U,111.5\nFF1_D_U,56.25\n", encoding="utf-8")
    return vehicle


def params(capsys, *line):
    """The exit code, and all that was said."""
    code = cli.main(["params", *line, "--link", "any"])
    shown = capsys.readouterr()
    return code, " ".join((shown.out + shown.err).split())


def test_an_edited_vehicle_file_puts_its_set_out_of_force_until_it_is_put_back_or_a_set_uploaded(
    vehicle, capsys
):
    code, said = params(capsys, "upload", "ours.param", "--yes")
    assert (code, NONE_IN_FORCE in said) == (exit_codes.DONE, True)
    crc = vehicle.server.active_crc
    assert crc != 0

    vehicle.edit("name: hovering\n", "# moved to another port\nname: hovering\n")
    assert vehicle.server.active_crc == crc
    assert NONE_IN_FORCE not in params(capsys, "show")[1]
    assert NONE_IN_FORCE not in params(capsys, "diff", "ours.param")[1]

    vehicle.edit("position_m: [0.42, -0.32, 0.0]", "position_m: [0.52, -0.32, 0.0]")
    assert "other thrusters than the vehicle file has now" in vehicle.server.trouble
    assert (vehicle.server.active_crc, vehicle.server.active(1)) == (0, {})
    assert NONE_IN_FORCE in params(capsys, "show")[1]
    assert NONE_IN_FORCE in params(capsys, "diff", "ours.param")[1]

    vehicle.edit("position_m: [0.52, -0.32, 0.0]", "position_m: [0.42, -0.32, 0.0]")
    assert vehicle.server.active_crc == crc

    vehicle.edit("dry_mass_kg: 72.0", "dry_mass_kg: 80.0")
    assert vehicle.server.active_crc == 0
    assert params(capsys, "upload", "ours.param", "--yes")[0] == exit_codes.DONE
    vehicle.boot()
    assert vehicle.server.active(1)["M_u"] == 111.5
