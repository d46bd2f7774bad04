"""`params` against the vehicle's parameter server, in simulated time: shown, asked, written, taken back."""

import json
import threading
from pathlib import Path

import params_line
import pytest
from fakes.terminal import Terminal, nobody
from params_line import DESPITE_HALF, run, with_intervals

from bridge import exit_codes, reports
from bridge.wire.framing import Framer, decode
from gcs_plugin.params.sidecar import read_sidecar

vehicle = params_line.vehicle
file = params_line.file


@pytest.mark.usefixtures("vehicle")
def test_show_writes_a_file_that_diff_finds_to_be_the_same(tmp_path, capsys):
    kept = str(tmp_path / "kept.param")
    assert run("show", "--out", kept) == exit_codes.DONE
    assert run("diff", kept) == exit_codes.DONE
    assert "changed" not in capsys.readouterr().out


@pytest.mark.usefixtures("vehicle")
def test_show_names_the_patterns_that_match_nothing(capsys):
    assert run("show", "SERVO", "FF1_M_U") == exit_codes.NO
    shown = capsys.readouterr()
    assert "no parameter like 'SERVO'" in shown.err
    assert "FF1_M_U" not in shown.err
    assert "FF1_M_U" in shown.out
    assert run("show", "SERVO") == exit_codes.NO
    assert capsys.readouterr().out == ""


def test_upload_is_active_read_back_and_has_a_receipt(vehicle, file, tmp_path, capsys):
    assert run("upload", file, "--yes", "--json", "-") == exit_codes.DONE
    receipt = json.loads(capsys.readouterr().out)
    active = vehicle.server.active(1)
    assert {name: value for name, value in active.items() if value} == {"M_u": 111.5, "D_u": 56.25}
    assert [line["after"] for line in receipt["parameters"]] == [111.5, 56.25]
    assert len(list((tmp_path / "receipts").glob("*-receipt.json"))) == 1


def test_a_commit_of_what_another_program_wrote_upon_says_so_and_takes_all_back(vehicle, file, capsys):
    write = vehicle.write

    def beside_another(data):
        for frame in Framer().feed(data):
            message = decode(frame)
            if message.get_type() == "PARAM_SET" and message.param_id == "FF_COMMIT":
                vehicle.server.write("FF1_D_V", 33.0, armed=False)
        write(data)

    vehicle.write = beside_another
    assert run("upload", file, "--yes") == exit_codes.NO
    said = " ".join(capsys.readouterr().out.split())
    assert (
        "refused: the vehicle holds another set than was read back from it just now: "
        "another program wrote to it meanwhile; every value that was written is back as it was"
    ) in said
    assert vehicle.server.active_crc == 0
    held = [vehicle.server.value(name) for name in ("FF1_M_U", "FF1_D_U", "FF1_D_V")]
    assert held == [0.0, 0.0, 33.0]


def test_nobody_on_the_link(vehicle, capsys):
    vehicle.mute = True
    assert run("show", "--seconds", "2") == exit_codes.LINK
    assert "no vehicle's HEARTBEAT" in capsys.readouterr().err


@pytest.mark.usefixtures("vehicle")
def test_another_vehicle_on_the_link_is_named_with_what_to_give(capsys):
    assert run("show", "--seconds", "2", "--system", "7") == exit_codes.LINK
    said = " ".join(capsys.readouterr().err.split())
    assert (
        "no vehicle's HEARTBEAT of system 7 within 2 s (heard: 1/1); give --system one that is heard" in said
    )


def test_what_was_verified_is_kept_as_accepted_and_diff_tells_it(vehicle, file, tmp_path, capsys):
    with_intervals(file)
    run("diff", file, "--json", str(tmp_path / "first.json"))
    first = json.loads((tmp_path / "first.json").read_text("utf-8"))
    row = next(row for row in first["parameters"] if row["name"] == "FF1_M_U")
    assert (row["accepted"], row["change"], row["unit"]) == (None, None, "kg")
    assert run("upload", file, "--yes") == exit_codes.DONE
    (accepted,) = (tmp_path / "receipts").glob("*-accepted.param")
    kept = read_sidecar(accepted)
    assert kept.intervals["FF1_M_U"].high95 == 121.5
    vehicle.server.write("FF1_M_U", 101.5, armed=False)
    capsys.readouterr()
    run("diff", file)
    (line,) = (line for line in capsys.readouterr().out.splitlines() if line.startswith("FF1_M_U"))
    assert line.split() == ["FF1_M_U", "101.5", "111.5", "+9.9", "%", "kg", "111.5", "+1.0", "changed"]


def test_a_program_that_reads_along_hears_of_each_line_once_it_is_read_back(
    vehicle, file, monkeypatch, capsys
):
    monkeypatch.setenv(reports.VARIABLE, reports.FORM)
    vehicle.drops = ("FF1_D_U",)
    assert run("upload", file, "--yes") == exit_codes.NO
    heard = [reports.read(line) for line in capsys.readouterr().err.splitlines()]
    writing = [report for report in heard if report is not None and report.of == reports.WRITING]
    lines = [report.written for report in writing if report.written is not None]
    assert lines[0] == reports.Written("FF1_M_U", "applied", "111.5 read back equal")
    assert lines[1].name == "FF1_D_U"
    assert not lines[1].equal
    assert lines[2] == reports.Written("FF1_M_U", "applied", "not set read back equal")
    assert {"STAGE", "UNDO"} <= {report.stage for report in writing}


def test_without_a_terminal_nobody_is_asked(vehicle, file, monkeypatch, capsys):
    nobody(monkeypatch)
    assert run("upload", file) == exit_codes.BAD_INPUT
    assert "--yes" in capsys.readouterr().err
    assert vehicle.server.value("FF1_M_U") == 0.0


@pytest.mark.parametrize(("typed", "code", "value"), [("yes\n", 0, 111.5), ("no\n", 4, 0.0), ("\n", 4, 0.0)])
def test_the_operator_is_asked_and_only_yes_means_yes(vehicle, file, monkeypatch, typed, code, value):
    monkeypatch.setattr("sys.stdin", Terminal(typed))
    assert run("upload", file) == code
    assert vehicle.server.value("FF1_M_U") == value


def test_one_that_is_armed_while_the_question_stands_gets_no_upload(vehicle, file, monkeypatch, capsys):
    beats = threading.Event()
    read = vehicle.read

    def reads(timeout_s):
        data = read(timeout_s)
        if vehicle.armed and vehicle.clock.now_s > armed_s[0] + 3.0:
            beats.set()
        return data

    armed_s = [0.0]

    def asked():
        armed_s[0] = vehicle.clock.now_s
        vehicle.armed = True
        assert beats.wait(60.0)

    monkeypatch.setattr(vehicle, "read", reads)
    monkeypatch.setattr("sys.stdin", Terminal("yes\n", asked))
    assert run("upload", file) == exit_codes.NO
    assert "is armed; nothing was sent" in capsys.readouterr().err


@pytest.mark.parametrize("action", ["upload", "rollback"])
def test_nobody_is_asked_about_an_armed_vehicle_that_gets_nothing_anyway(
    vehicle, file, monkeypatch, capsys, action
):
    assert run("upload", file, "--yes") == exit_codes.DONE
    if action == "upload":
        vehicle.server.write("FF1_M_U", 99.0, armed=False)
    vehicle.armed = True
    asked = []
    monkeypatch.setattr("sys.stdin", Terminal("yes\n", lambda: asked.append(True)))
    assert run(action, *([file] if action == "upload" else [])) == exit_codes.NO
    assert "is armed; nothing was sent" in capsys.readouterr().err
    assert not asked


def test_an_armed_vehicle_gets_an_upload_and_its_roll_back_on_purpose(vehicle, file):
    vehicle.armed = True
    assert run("upload", file, "--yes", "--armed") == exit_codes.DONE
    assert vehicle.server.active(1)["M_u"] == 111.5
    assert run("rollback", "--yes") == exit_codes.NO
    assert run("rollback", "--yes", "--armed") == exit_codes.DONE
    assert "M_u" not in vehicle.server.active(1)


def test_the_plan_of_lines_that_are_staged_and_not_in_force_writes_a_commit(vehicle, file, tmp_path, capsys):
    for name, value in (("FF1_M_U", 111.5), ("FF1_D_U", 56.25)):
        vehicle.server.write(name, value, armed=False)
    kept = tmp_path / "plan.json"
    assert run("diff", file, "--json", str(kept)) == exit_codes.NO
    data = json.loads(kept.read_text("utf-8"))
    assert data["writes"]
    assert (data["active_crc"], data["staged_crc"]) == (0.0, vehicle.server.staged_crc)
    assert [line["verdict"] for line in data["parameters"]] == ["staged", "staged"]
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
    data = json.loads(kept.read_text("utf-8"))
    assert not data["writes"]
    assert data["active_crc"] == data["staged_crc"] == vehicle.server.active_crc


def test_what_is_put_in_force_without_a_write_is_asked_for_as_well(vehicle, file, monkeypatch, capsys):
    vehicle.server.write("FF1_M_U", 111.5, armed=False)
    vehicle.server.write("FF1_D_U", 56.25, armed=False)
    asked = []
    monkeypatch.setattr("tui.show.asked", lambda _client, question, _does: asked.append(question) or "no")
    assert run("upload", file) == exit_codes.INTERRUPTED
    assert asked == ["put 2 parameters in force? [yes/no] "]
    assert vehicle.server.active_crc == 0
    assert "nothing was sent" in capsys.readouterr().err


def test_roll_back_without_a_file_goes_back_one_upload_at_a_time(vehicle, file, tmp_path, capsys):
    assert run("upload", file, "--yes", "--only", "FF1_M_U", *DESPITE_HALF) == exit_codes.DONE
    assert run("upload", file, "--yes", "--only", "FF1_D_U", *DESPITE_HALF) == exit_codes.DONE
    assert run("rollback", "--yes") == exit_codes.DONE
    assert vehicle.server.active(1).get("M_u") == 111.5
    assert "D_u" not in vehicle.server.active(1)
    assert run("rollback", "--yes") == exit_codes.DONE
    assert "M_u" not in vehicle.server.active(1)
    capsys.readouterr()
    assert run("rollback", "--yes") == exit_codes.BAD_INPUT
    assert "no upload to vehicle 1 that stands" in capsys.readouterr().err
    assert len(list((tmp_path / "receipts").glob("*-accepted.param"))) == 2


def test_what_is_uploaded_twice_is_nothing_to_do_and_one_roll_back_takes_it_back(vehicle, file, capsys):
    assert run("upload", file, "--yes") == exit_codes.DONE
    capsys.readouterr()
    assert run("upload", file, "--yes") == exit_codes.DONE
    shown = capsys.readouterr().out
    assert "nothing to do: the vehicle holds all of it already; nothing was written" in shown
    assert "values before" not in shown
    assert run("rollback", "--yes") == exit_codes.DONE
    assert "M_u" not in vehicle.server.active(1)


@pytest.mark.parametrize("more", [(), ("--armed",)], ids=["disarmed", "armed"])
def test_a_roll_back_of_the_first_upload_leaves_no_set_in_force(vehicle, file, capsys, more):
    assert run("upload", file, "--yes") == exit_codes.DONE
    assert vehicle.server.active_crc
    vehicle.armed = bool(more)
    capsys.readouterr()
    assert run("rollback", "--yes", *more) == exit_codes.DONE
    assert "no set is in force, as before the upload" in capsys.readouterr().out
    assert (vehicle.server.active_crc, vehicle.server.active(1)) == (0, {})


def test_a_roll_back_lowers_the_mode_of_the_feed_forward_and_never_raises_it(vehicle, file):
    vehicle.server.write("FF_MODE", 1.0, armed=False)
    assert run("upload", file, "--yes") == exit_codes.DONE
    vehicle.server.write("FF_MODE", 0.0, armed=False)
    assert run("rollback", "--yes") == exit_codes.DONE
    assert vehicle.server.mode == 0
    assert run("upload", file, "--yes") == exit_codes.DONE
    vehicle.server.write("FF_MODE", 3.0, armed=False)
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
