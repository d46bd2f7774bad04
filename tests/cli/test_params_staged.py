"""`params` and values that are staged on the vehicle and do not fly."""

import json

import params_line
from params_line import run

from tui import exit_codes

vehicle = params_line.vehicle
file = params_line.file


def test_the_plan_of_lines_that_are_staged_and_not_in_force_writes_a_commit(vehicle, file, tmp_path, capsys):
    for name, value in (("FF1_M_U", 111.5), ("FF1_D_U", 56.25)):
        vehicle.server.write(name, value, armed=False)
    kept = tmp_path / "plan.json"
    assert run("diff", file, "--json", str(kept)) == exit_codes.NO
    told = json.loads(kept.read_text("utf-8"))
    assert told["writes"]
    assert (told["active_crc"], told["staged_crc"]) == (0.0, vehicle.server.staged_crc)
    assert [line["verdict"] for line in told["parameters"]] == ["staged", "staged"]
    shown = capsys.readouterr().out
    assert shown.startswith(
        "note: what the vehicle holds is staged, and none of it flies: no set is in force"
    )
    assert "2 parameters: 2 staged" in shown
    assert run("upload", file, "--yes") == exit_codes.DONE
    assert (
        f"2 staged parameters read back, set {vehicle.server.active_crc} is active" in capsys.readouterr().out
    )
    assert vehicle.server.active(1)["D_u"] == 56.25
    assert run("diff", file, "--json", str(kept)) == exit_codes.DONE
    told = json.loads(kept.read_text("utf-8"))
    assert not told["writes"]
    assert told["active_crc"] == told["staged_crc"] == vehicle.server.active_crc


def test_what_is_put_in_force_without_a_write_is_asked_for_as_well(vehicle, file, monkeypatch, capsys):
    vehicle.server.write("FF1_M_U", 111.5, armed=False)
    vehicle.server.write("FF1_D_U", 56.25, armed=False)
    asked = []
    monkeypatch.setattr("tui.running.asked", lambda _client, question, _does: asked.append(question) or "no")
    assert run("upload", file) == exit_codes.INTERRUPTED
    assert asked == ["put 2 parameters in force? [yes/no] "]
    assert vehicle.server.active_crc == 0
    assert "nothing was sent" in capsys.readouterr().err


def test_values_staged_beside_a_set_that_flies_are_told_as_staged(vehicle, file, capsys):
    assert run("upload", file, "--yes") == exit_codes.DONE
    flying = vehicle.server.active_crc
    vehicle.server.write("FF1_M_U", 120.0, armed=False)
    capsys.readouterr()
    assert run("diff", file) == exit_codes.NO
    # With that line as in the file, the rest is what flies.
    assert "2 parameters: 1 changed, 1 same" in capsys.readouterr().out
    vehicle.server.write("FF1_M_V", 90.0, armed=False)
    run("diff", file)
    shown = capsys.readouterr().out
    assert f"and does not fly: set {flying} does, which is another" in shown
    assert "2 parameters: 1 changed, 1 staged" in shown
