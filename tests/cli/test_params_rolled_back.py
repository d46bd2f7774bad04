"""`params rollback`: what it brings back, of which upload, and what it never raises."""

import json
from pathlib import Path

import params_line
from params_line import DESPITE_HALF, run

from tui import exit_codes

vehicle = params_line.vehicle
file = params_line.file


def test_rollback_brings_the_values_before_back(vehicle, file, tmp_path, capsys):
    vehicle.server.write("FF1_M_U", 99.0, armed=False)
    vehicle.server.write("FF_COMMIT", vehicle.server.staged_crc, armed=False)
    assert run("upload", file, "--yes") == exit_codes.DONE
    (before,) = (tmp_path / "receipts").glob("*-before.param")
    capsys.readouterr()
    assert run("rollback", str(before), "--yes") == exit_codes.DONE
    assert vehicle.server.active(1)["M_u"] == 99.0
    shown = capsys.readouterr().out
    assert not any(name in shown for name in ("FF_COMMIT", "FF_ACTIVE", "FF_VERSION"))
    (line,) = (
        line for line in shown.splitlines() if line.startswith("FF1_M_U") and "read back equal" in line
    )
    assert line.split()[2:4] == ["111.5", "99"]


def test_roll_back_without_a_file_goes_back_one_upload_at_a_time(vehicle, file, tmp_path, capsys):
    assert run("upload", file, "--yes", "--only", "FF1_M_U", *DESPITE_HALF) == exit_codes.DONE
    vehicle.clock.advance_to(vehicle.clock.now_s + 2.0)
    assert run("upload", file, "--yes", "--only", "FF1_D_U", *DESPITE_HALF) == exit_codes.DONE
    vehicle.clock.advance_to(vehicle.clock.now_s + 2.0)
    assert run("rollback", "--yes") == exit_codes.DONE
    assert vehicle.server.active(1).get("M_u") == 111.5
    assert "D_u" not in vehicle.server.active(1)
    vehicle.clock.advance_to(vehicle.clock.now_s + 2.0)
    assert run("rollback", "--yes") == exit_codes.DONE
    assert "M_u" not in vehicle.server.active(1)
    capsys.readouterr()
    assert run("rollback", "--yes") == exit_codes.BAD_INPUT
    assert "no upload to vehicle 1 that stands" in capsys.readouterr().err
    assert len(list((tmp_path / "receipts").glob("*-accepted.param"))) == 2


def test_a_roll_back_lowers_the_mode_of_the_feed_forward_and_never_raises_it(vehicle, file):
    vehicle.server.write("FF_MODE", 1.0, armed=False)
    assert run("upload", file, "--yes") == exit_codes.DONE
    vehicle.server.write("FF_MODE", 0.0, armed=False)
    vehicle.clock.advance_to(vehicle.clock.now_s + 2.0)
    assert run("rollback", "--yes") == exit_codes.DONE
    assert vehicle.server.mode == 0
    assert run("upload", file, "--yes") == exit_codes.DONE
    vehicle.server.write("FF_MODE", 3.0, armed=False)
    vehicle.clock.advance_to(vehicle.clock.now_s + 2.0)
    assert run("rollback", "--yes") == exit_codes.DONE
    assert vehicle.server.mode == 0


def test_a_dry_run_tells_what_a_roll_back_would_change_and_of_which_upload(vehicle, file, tmp_path):
    assert run("upload", file, "--yes", "--only", "FF1_M_U", *DESPITE_HALF) == exit_codes.DONE
    kept = tmp_path / "plan.json"
    assert run("rollback", "--dry-run", "--json", str(kept)) == exit_codes.NO
    plan = json.loads(kept.read_text("utf-8"))
    assert Path(plan["file"]).name.endswith("-before.param")
    changed = [(row["name"], row["target"]) for row in plan["parameters"] if row["verdict"] == "changed"]
    assert changed == [("FF1_M_U", 0.0)]
    assert (plan["writes"], plan["needs_disarmed"], plan["vehicle"]["armed"]) == (True, True, False)
    assert vehicle.server.active(1)["M_u"] == 111.5


def test_a_clock_that_was_set_back_leaves_the_newest_upload_the_newest(vehicle, file):
    assert run("upload", file, "--yes", "--only", "FF1_M_U", *DESPITE_HALF) == exit_codes.DONE
    vehicle.clock.unix_at_boot_s -= 86_400.0
    assert run("upload", file, "--yes", "--only", "FF1_D_U", *DESPITE_HALF) == exit_codes.DONE
    assert run("rollback", "--yes") == exit_codes.DONE
    assert (vehicle.server.value("FF1_M_U"), vehicle.server.value("FF1_D_U")) == (111.5, 0.0)
