"""`params` against the vehicle's real parameter server, in simulated time."""

import errno
import json
import os
import threading
from pathlib import Path

import pytest
from parameter_vehicle import VEHICLE, GroundKilledError, VehicleAtTheEnd, dying_at

from bridge.vehicle.config import load_vehicle
from gcs_plugin.params.files import system_of, write_parameters
from gcs_plugin.params.sidecar import Interval, Sidecar, read_sidecar, write_sidecar
from identify.identification import Doubt, Identification, Outcome, estimate
from tui import cli, exit_codes, told
from tui.parameter_files import write_identified


@pytest.fixture
def vehicle(monkeypatch, tmp_path):
    vehicle = VehicleAtTheEnd()
    monkeypatch.setattr("bridge.link.open.open_link", lambda _: vehicle)
    monkeypatch.setattr("bridge.clock.SystemClock", lambda: vehicle.clock)
    monkeypatch.chdir(tmp_path)
    return vehicle


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "new.param"
    path.write_text("FF1_M_U,111.5\nFF1_D_U,56.25\n", encoding="utf-8")
    return str(path)


def run(*line):
    return cli.main(["params", *line, "--link", "any"])


@pytest.mark.usefixtures("vehicle")
def test_show_lists_what_the_vehicle_holds(capsys):
    assert run("show", "ff1_m", "--json", "-") == exit_codes.DONE
    shown = json.loads(capsys.readouterr().out)
    assert sorted(shown) == ["FF1_M_QQ", "FF1_M_U", "FF1_M_V", "FF1_M_W"]


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


@pytest.mark.usefixtures("vehicle")
def test_show_of_nothing_shows_no_empty_table(capsys):
    assert run("show", "SERVO") == exit_codes.NO
    assert capsys.readouterr().out == ""


@pytest.mark.usefixtures("vehicle")
def test_show_says_the_unit_of_each_coefficient(capsys):
    assert run("show", "FF1_M_U", "FF1_D_R", "FF_MODE") == exit_codes.DONE
    rows = [line.split(maxsplit=2) for line in capsys.readouterr().out.splitlines() if line.startswith("FF")]
    assert ["FF1_M_U", "0", "kg"] in rows
    assert ["FF1_D_R", "0", "N m/(rad/s)"] in rows
    assert ["FF_MODE", "0"] in rows


@pytest.mark.usefixtures("vehicle")
@pytest.mark.parametrize("words", [("show",), ("diff", "FILE"), ("upload", "FILE", "--yes")])
def test_every_table_fits_80_columns_and_none_is_cut(file, words, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "80")
    run(*(file if word == "FILE" else word for word in words))
    shown = capsys.readouterr().out
    assert "…" not in shown
    assert all(len(line) <= 80 for line in shown.splitlines() if " " in line)
    assert "FF1_M_U" in shown


def test_diff_says_what_would_change_and_writes_nothing(vehicle, file, capsys):
    assert run("diff", file) == exit_codes.NO
    assert "2 changed" in capsys.readouterr().out
    assert vehicle.server.value("FF1_M_U") == 0.0


def test_upload_is_active_read_back_and_has_a_receipt(vehicle, file, tmp_path, capsys):
    assert run("upload", file, "--yes", "--json", "-") == exit_codes.DONE
    receipt = json.loads(capsys.readouterr().out)
    active = vehicle.server.active(1)
    assert {name: value for name, value in active.items() if value} == {"M_u": 111.5, "D_u": 56.25}
    assert [line["after"] for line in receipt["parameters"]] == [111.5, 56.25]
    assert len(list((tmp_path / "receipts").glob("*-receipt.json"))) == 1


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


@pytest.mark.parametrize("suffix", [".param", ".parm", ".params"])
def test_what_another_vehicle_held_before_an_upload_is_not_gone_back_to(vehicle, tmp_path, suffix, capsys):
    before = tmp_path / f"2026-05-04T101112Z-before{suffix}"
    write_parameters(before, {"FF1_M_U": 112.0}, system=7, component=191)
    assert run("rollback", str(before), "--yes") == exit_codes.BAD_INPUT
    assert "was saved of vehicle 7, and this is vehicle 1: nothing was sent" in capsys.readouterr().err
    assert vehicle.server.value("FF1_M_U") == 0.0
    assert run("rollback", str(before), "--yes", "--any-vehicle") == exit_codes.DONE
    assert vehicle.server.value("FF1_M_U") == 112.0


@pytest.mark.usefixtures("vehicle")
def test_files_that_this_program_writes_say_of_which_vehicle_they_are(file, tmp_path):
    shown = tmp_path / "shown.parm"
    assert run("show", "--out", str(shown)) == exit_codes.DONE
    assert run("upload", file, "--yes") == exit_codes.DONE
    (before,) = (tmp_path / "receipts").glob("*-before.param")
    (accepted,) = (tmp_path / "receipts").glob("*-accepted.param")
    assert {system_of(path) for path in (shown, before, accepted)} == {1}


def identified(tmp_path, **changed):
    """The JSON of an identification of this vehicle, some of it changed."""
    file = load_vehicle(VEHICLE)
    data = {
        "outcome": "converged",
        "configuration": "hovering",
        "parameters": [
            {"name": "M_u", "value": 112.0, "identifiable": True},
            {"name": "M_v", "value": 50.0, "identifiable": False},
        ],
        "vehicle": {"name": file.vehicle.name, "sha256": file.sha256},
        "notes": ["the thrusters saturated"],
    }
    path = tmp_path / "found.json"
    path.write_text(json.dumps(data | changed), encoding="utf-8")
    return str(path)


@pytest.mark.parametrize("action", ["diff", "upload"])
def test_outcome_and_notes_of_an_identification_stand_above_the_plan(vehicle, tmp_path, action, capsys):
    del vehicle
    run(action, identified(tmp_path), "--vehicle", VEHICLE, *(["--yes"] if action == "upload" else []))
    shown = capsys.readouterr().out
    assert shown.index("outcome: converged") < shown.index("the thrusters saturated") < shown.index("FF1_M_U")


OTHER = {"vehicle": {"name": "otter", "sha256": "0"}}
CHANGED = {"vehicle": {"name": "hovering", "sha256": "0"}}


@pytest.mark.parametrize("action", ["diff", "upload"])
def test_what_was_identified_of_another_vehicle_is_refused(vehicle, tmp_path, action, capsys):
    path = identified(tmp_path, **OTHER)
    assert run(action, path, "--vehicle", VEHICLE) == exit_codes.BAD_INPUT
    assert "is of vehicle 'otter'" in capsys.readouterr().err
    assert vehicle.server.value("FF1_M_U") == 0.0


def test_what_was_saved_of_another_vehicle_is_refused_unless_on_purpose(vehicle, tmp_path, capsys):
    path = tmp_path / "saved.params"
    write_parameters(path, {"FF1_M_U": 112.0}, system=7, component=191)
    assert run("upload", str(path), "--yes") == exit_codes.BAD_INPUT
    assert "was saved of vehicle 7, and this is vehicle 1: nothing was sent" in capsys.readouterr().err
    write_sidecar(
        path, Sidecar("ab", "cd", "hovering", "likelihood", "0.1", {}, "hovering", "lake", "converged")
    )
    assert run("upload", str(path), "--yes") == exit_codes.BAD_INPUT
    assert "was saved of vehicle 7" in capsys.readouterr().err
    assert vehicle.server.value("FF1_M_U") == 0.0
    assert run("upload", str(path), "--yes", "--any-vehicle") == exit_codes.DONE
    assert vehicle.server.value("FF1_M_U") == 112.0


def test_what_was_identified_of_another_vehicle_can_be_sent_on_purpose(vehicle, tmp_path, capsys):
    path = identified(tmp_path, **OTHER)
    assert run("upload", path, "--vehicle", VEHICLE, "--yes", "--any-vehicle") == exit_codes.DONE
    assert "warning:" in capsys.readouterr().out
    assert vehicle.server.active(1)["M_u"] == 112.0


def test_a_vehicle_file_that_has_changed_since_is_a_warning(vehicle, tmp_path, capsys):
    path = identified(tmp_path, **CHANGED)
    assert run("upload", path, "--vehicle", VEHICLE, "--yes") == exit_codes.DONE
    assert "has changed since" in capsys.readouterr().out
    assert vehicle.server.active(1)["M_u"] == 112.0


def test_an_identification_of_another_configuration_than_named_is_refused(vehicle, tmp_path, capsys):
    path = identified(tmp_path, configuration="survey")
    assert run("upload", path, "--vehicle", f"{VEHICLE}:hovering", "--yes") == exit_codes.BAD_INPUT
    assert "is of configuration 'survey'" in capsys.readouterr().err
    assert vehicle.server.value("FF1_M_U") == 0.0


def test_an_identification_in_doubt_is_sent_on_purpose_alone(vehicle, tmp_path, capsys):
    path = identified(tmp_path, outcome="data and model disagree")
    line = ("upload", path, "--vehicle", VEHICLE, "--yes")
    assert run(*line) == exit_codes.BAD_INPUT
    assert "data and model disagree" in capsys.readouterr().err
    assert vehicle.server.value("FF1_M_U") == 0.0
    assert run(*line, "--despite-doubts") == exit_codes.DONE
    assert vehicle.server.active(1)["M_u"] == 112.0


def test_diff_shows_an_identification_in_doubt(vehicle, tmp_path, capsys):
    del vehicle
    path = identified(tmp_path, outcome="stopped at a bound")
    assert run("diff", path, "--vehicle", VEHICLE) == exit_codes.NO
    assert "outcome: stopped at a bound" in capsys.readouterr().out


@pytest.mark.parametrize("data", [{}, {"parameters": []}, {"configuration": "hovering"}, {"identified": {}}])
def test_a_json_that_is_no_identification_is_said_so(vehicle, tmp_path, data, capsys):
    del vehicle
    path = tmp_path / "other.json"
    path.write_text(json.dumps(data), encoding="utf-8")
    assert run("diff", str(path), "--vehicle", VEHICLE) == exit_codes.BAD_INPUT
    assert "is not an identification" in capsys.readouterr().err


def test_upload_takes_the_json_of_an_identification(vehicle, tmp_path):
    path = identified(tmp_path)
    assert run("upload", path, "--vehicle", VEHICLE, "--yes") == exit_codes.DONE
    assert vehicle.server.active(1)["M_u"] == 112.0
    assert "M_v" not in vehicle.server.active(1)


def test_only_sends_the_lines_named(vehicle, file):
    assert run("upload", file, "--yes", "--only", "FF1_D_U") == exit_codes.DONE
    assert vehicle.server.active(1)["D_u"] == 56.25
    assert "M_u" not in vehicle.server.active(1)


def test_an_armed_vehicle_gets_no_upload(vehicle, file, capsys):
    vehicle.armed = True
    assert run("upload", file, "--yes") == exit_codes.NO
    assert "is armed; nothing was sent" in capsys.readouterr().err
    assert vehicle.server.value("FF1_M_U") == 0.0


def test_a_value_that_the_vehicle_never_takes_leaves_everything_as_it_was(vehicle, file, capsys):
    vehicle.stuck = {"FF1_D_U"}
    assert run("upload", file, "--yes") == exit_codes.NO
    assert vehicle.server.value("FF1_M_U") == 0.0
    assert vehicle.server.active_crc == 0
    assert "rolled back" in capsys.readouterr().out


def test_a_value_out_of_its_bounds_stops_the_whole_upload(vehicle, tmp_path, capsys):
    path = tmp_path / "wild.param"
    path.write_text("FF1_M_U,111.5\nFF1_D_U,-3\n", encoding="utf-8")
    assert run("upload", str(path), "--yes") == exit_codes.NO
    assert "FF1_D_U" in capsys.readouterr().err
    assert vehicle.server.value("FF1_M_U") == 0.0


def test_without_a_terminal_nobody_is_asked(vehicle, file, monkeypatch, capsys):
    monkeypatch.setattr("sys.stdin.isatty", lambda: False, raising=False)
    assert run("upload", file) == exit_codes.BAD_INPUT
    assert "--yes" in capsys.readouterr().err
    assert vehicle.server.value("FF1_M_U") == 0.0


@pytest.mark.parametrize(("typed", "code", "value"), [("yes\n", 0, 111.5), ("no\n", 4, 0.0), ("\n", 4, 0.0)])
def test_the_operator_is_asked_and_only_yes_means_yes(vehicle, file, monkeypatch, typed, code, value):
    class Terminal:
        def isatty(self):
            return True

        def readline(self):
            return typed

    monkeypatch.setattr("sys.stdin", Terminal())
    assert run("upload", file) == code
    assert vehicle.server.value("FF1_M_U") == value


def test_while_the_question_stands_the_link_is_read(vehicle, file, monkeypatch):
    read, ten_s = vehicle.read, threading.Event()

    def reads(timeout_s):
        data = read(timeout_s)
        if vehicle.clock.now_s > begun_s[0] + 10.0:
            ten_s.set()
        return data

    begun_s = [float("inf")]

    class Terminal:
        def isatty(self):
            return True

        def readline(self):
            begun_s[0] = vehicle.clock.now_s
            assert ten_s.wait(10.0)
            return "yes\n"

    monkeypatch.setattr(vehicle, "read", reads)
    monkeypatch.setattr("sys.stdin", Terminal())
    assert run("upload", file) == exit_codes.DONE
    assert vehicle.server.value("FF1_M_U") == 111.5


def test_one_that_is_armed_while_the_question_stands_gets_no_upload(vehicle, file, monkeypatch, capsys):
    beats = threading.Event()
    read = vehicle.read

    def reads(timeout_s):
        data = read(timeout_s)
        if vehicle.armed and vehicle.clock.now_s > armed_s[0] + 3.0:
            beats.set()
        return data

    armed_s = [0.0]

    class Terminal:
        def isatty(self):
            return True

        def readline(self):
            armed_s[0] = vehicle.clock.now_s
            vehicle.armed = True
            assert beats.wait(10.0)
            return "yes\n"

    monkeypatch.setattr(vehicle, "read", reads)
    monkeypatch.setattr("sys.stdin", Terminal())
    assert run("upload", file) == exit_codes.NO
    assert "is armed; nothing was sent" in capsys.readouterr().err


def test_nobody_on_the_link(vehicle, capsys):
    vehicle.mute = True
    assert run("show", "--seconds", "2") == exit_codes.LINK
    assert "no vehicle's HEARTBEAT" in capsys.readouterr().err


def with_sidecar(path, outcome):
    about = Sidecar("dive", "vehicle", "hovering", "likelihood", "0.1.0", {}, "ruvifist", "lake-7", outcome)
    write_sidecar(Path(path), about)


def test_a_parameter_file_from_an_identification_in_doubt_is_refused_until_told_otherwise(
    vehicle, file, capsys
):
    with_sidecar(file, "data and model disagree")
    assert run("upload", file, "--yes") == exit_codes.BAD_INPUT
    assert "data and model disagree" in capsys.readouterr().err
    assert vehicle.server.active(1) == {}
    assert run("upload", file, "--yes", "--despite-doubts") == exit_codes.DONE


@pytest.mark.usefixtures("vehicle")
def test_a_parameter_file_with_a_sidecar_says_where_it_comes_from(file, capsys):
    with_sidecar(file, "converged")
    run("diff", file)
    shown = capsys.readouterr()
    assert (
        "from lake-7 of ruvifist, configuration hovering, by likelihood: converged" in shown.out + shown.err
    )


DOUBTED = "warning: M_u is doubted: no rate of turn was recorded"


@pytest.mark.usefixtures("vehicle")
def test_each_doubted_value_that_a_parameter_file_sends_is_told(file, capsys):
    doubted = {"M_u": "no rate of turn was recorded", "M_w": "it was weighed by others"}
    write_sidecar(
        Path(file), Sidecar("dive", "vehicle", "hovering", "likelihood", "0.1.0", {}, doubted=doubted)
    )
    assert run("diff", file) == exit_codes.NO
    shown = capsys.readouterr().out
    assert DOUBTED in shown
    assert "M_w is doubted" not in shown
    run("diff", file, "--only", "FF1_D_U")
    assert "is doubted" not in capsys.readouterr().out
    assert run("upload", file, "--yes") == exit_codes.DONE
    assert DOUBTED in capsys.readouterr().out


@pytest.mark.usefixtures("vehicle")
def test_each_doubted_value_that_an_identification_sends_is_told(tmp_path, capsys):
    doubt = {
        "about": ["M_u", "M_w"],
        "sentence": "No rate of turn was recorded: dive again.",
        "outcome": "converged",
    }
    path = identified(tmp_path, doubts=[doubt])
    run("diff", path, "--vehicle", VEHICLE)
    shown = capsys.readouterr().out
    assert DOUBTED in shown
    assert f"warning: {doubt['sentence']}" in shown
    assert "M_w is doubted" not in shown


def test_a_parameter_file_and_its_sidecar_keep_what_is_doubted(tmp_path):
    doubt = Doubt(("M_u", "M_w"), "No rate of turn was recorded: dive again.")
    found = Identification("likelihood", Outcome.CONVERGED, (estimate("M_u", 111.0, 1.0, 109.0, 113.0),), "hovering",
                           "lake-7", "7" * 64, "hovering", "0" * 64, 60.0, 100, doubts=(doubt,))  # fmt: skip
    path = tmp_path / "a.param"
    write_identified(path, found, load_vehicle(VEHICLE))
    assert "# M_u is doubted: no rate of turn was recorded\n" in path.read_text(encoding="utf-8")
    sidecar = read_sidecar(path)
    assert sidecar is not None
    assert sidecar.doubted == {"M_u": "no rate of turn was recorded"}


def test_a_model_without_effects_takes_back_those_accepted_before_and_says_so(vehicle, file, capsys):
    vehicle.server.write("FF1_X_UU", 12.5, False)
    vehicle.server.write("FF_COMMIT", float(vehicle.server.staged_crc), False)
    assert run("upload", file, "--yes") == exit_codes.DONE
    assert vehicle.server.active(1)["X_uu"] == 12.5
    write_sidecar(
        Path(file), Sidecar("", "", "hovering", "likelihood", "1", vehicle="ruvifist", outcome="converged")
    )
    assert run("upload", file, "--yes") == exit_codes.DONE
    assert "taken back: FF1_X_UU" in capsys.readouterr().out
    assert "X_uu" not in vehicle.server.active(1)


def with_intervals(path):
    mass = Interval("M_u", "kg", 101.5, 121.5)
    write_sidecar(
        Path(path), Sidecar("d", "v", "hovering", "likelihood", "1", {"FF1_M_U": mass}, "ruvifist", "lake")
    )


def test_what_was_verified_is_kept_as_accepted_and_diff_tells_it(vehicle, file, tmp_path, capsys):
    with_intervals(file)
    run("diff", file, "--json", str(tmp_path / "first.json"))
    first = json.loads((tmp_path / "first.json").read_text("utf-8"))
    row = next(row for row in first["parameters"] if row["name"] == "FF1_M_U")
    assert (row["accepted"], row["change"], row["unit"]) == (None, 11.15, "kg")
    assert run("upload", file, "--yes") == exit_codes.DONE
    (accepted,) = (tmp_path / "receipts").glob("*-accepted.param")
    kept = read_sidecar(accepted)
    assert kept is not None
    assert kept.intervals["FF1_M_U"].high95 == 121.5
    vehicle.server.write("FF1_M_U", 101.5, armed=False)
    capsys.readouterr()
    run("diff", file)
    (line,) = (line for line in capsys.readouterr().out.splitlines() if line.startswith("FF1_M_U"))
    assert line.split() == ["FF1_M_U", "kg", "101.5", "111.5", "111.5", "+1.0", "changed"]


def test_roll_back_without_a_file_goes_back_one_upload_at_a_time(vehicle, file, tmp_path, capsys):
    assert run("upload", file, "--yes", "--only", "FF1_M_U") == exit_codes.DONE
    vehicle.clock.advance_to(vehicle.clock.now_s + 2.0)
    assert run("upload", file, "--yes", "--only", "FF1_D_U") == exit_codes.DONE
    vehicle.clock.advance_to(vehicle.clock.now_s + 2.0)
    assert run("rollback", "--yes") == exit_codes.DONE
    assert vehicle.server.active(1).get("M_u") == 111.5
    assert vehicle.server.active(1)["D_u"] == 0.0
    vehicle.clock.advance_to(vehicle.clock.now_s + 2.0)
    assert run("rollback", "--yes") == exit_codes.DONE
    assert "M_u" not in vehicle.server.active(1)
    capsys.readouterr()
    assert run("rollback", "--yes") == exit_codes.BAD_INPUT
    assert "no upload to vehicle 1 that stands" in capsys.readouterr().err
    assert len(list((tmp_path / "receipts").glob("*-accepted.param"))) == 2


def test_an_armed_vehicle_gets_an_upload_and_its_roll_back_on_purpose(vehicle, file):
    vehicle.armed = True
    assert run("upload", file, "--yes", "--armed") == exit_codes.DONE
    assert vehicle.server.active(1)["M_u"] == 111.5
    vehicle.clock.advance_to(vehicle.clock.now_s + 2.0)
    assert run("rollback", "--yes") == exit_codes.NO
    assert run("rollback", "--yes", "--armed") == exit_codes.DONE
    assert "M_u" not in vehicle.server.active(1)


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


def test_a_program_that_reads_along_hears_of_each_line_once_it_is_read_back(
    vehicle, file, monkeypatch, capsys
):
    monkeypatch.setenv(told.VARIABLE, told.FORM)
    vehicle.stuck = {"FF1_D_U"}
    assert run("upload", file, "--yes") == exit_codes.NO
    heard = [told.read(line) for line in capsys.readouterr().err.splitlines()]
    lines = [one.line for one in heard if one is not None and one.of == told.WRITING and one.line]
    assert lines[0] == ("FF1_M_U", "111.5 read back equal")
    assert lines[1][0] == "FF1_D_U"
    assert "equal" not in lines[1][1]
    assert lines[2] == ("FF1_M_U", "0 read back equal")


def test_a_dry_run_tells_what_a_roll_back_would_change_and_of_which_upload(vehicle, file, tmp_path):
    assert run("upload", file, "--yes", "--only", "FF1_M_U") == exit_codes.DONE
    kept = tmp_path / "plan.json"
    assert run("rollback", "--dry-run", "--json", str(kept)) == exit_codes.NO
    plan = json.loads(kept.read_text("utf-8"))
    assert Path(plan["file"]).name.endswith("-before.param")
    changed = [(row["name"], row["target"]) for row in plan["parameters"] if row["verdict"] == "changed"]
    assert changed == [("FF1_M_U", 0.0)]
    assert (plan["writes"], plan["needs_disarmed"], plan["vehicle"]["armed"]) == (True, True, False)
    assert vehicle.server.active(1)["M_u"] == 111.5


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


def test_an_implausible_value_that_another_ground_staged_comes_into_force_by_name_alone(
    vehicle, file, capsys
):
    assert run("upload", file, "--yes") == exit_codes.DONE
    flying = vehicle.server.active_crc
    write_parameters(Path(file), {"FF1_M_U": 111.5, "FF1_D_U": 5.0})
    vehicle.server.write("FF1_D_U", 5.0, armed=False)
    assert run("upload", file, "--yes") == exit_codes.NO
    assert "FF1_D_U: 56.25 was accepted last" in " ".join(capsys.readouterr().err.split())
    assert vehicle.server.active_crc == flying
    vehicle.clock.advance_to(vehicle.clock.now_s + 2.0)
    assert run("upload", file, "--yes", "--accept-implausible", "FF1_D_U") == exit_codes.DONE
    assert vehicle.server.active(1)["D_u"] == 5.0


def test_what_is_put_in_force_without_a_write_is_asked_for_as_well(vehicle, file, monkeypatch, capsys):
    vehicle.server.write("FF1_M_U", 111.5, armed=False)
    vehicle.server.write("FF1_D_U", 56.25, armed=False)
    asked = []
    monkeypatch.setattr("tui.asked.asked", lambda _client, question, _does: asked.append(question) or "no")
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


def test_an_effect_that_a_model_takes_back_is_a_line_that_can_be_chosen(vehicle, file, capsys):
    vehicle.server.write("FF1_X_UU", 12.5, False)
    vehicle.server.write("FF_COMMIT", float(vehicle.server.staged_crc), False)
    with_sidecar(file, "converged")
    assert run("upload", file, "--yes", "--only", "FF1_M_U") == exit_codes.DONE
    assert vehicle.server.active(1)["X_uu"] == 12.5
    vehicle.clock.advance_to(vehicle.clock.now_s + 2.0)
    assert run("upload", file, "--yes", "--only", "FF1_X_UU") == exit_codes.DONE
    assert "X_uu" not in vehicle.server.active(1)
    capsys.readouterr()
    assert run("upload", file, "--yes", "--only", "FF1_Y_VV") == exit_codes.BAD_INPUT
    assert "nothing of FF1_Y_VV is to be changed" in capsys.readouterr().err


def test_a_clock_that_was_set_back_leaves_the_newest_upload_the_newest(vehicle, file):
    assert run("upload", file, "--yes", "--only", "FF1_M_U") == exit_codes.DONE
    vehicle.clock.unix_at_boot_s -= 86_400.0
    assert run("upload", file, "--yes", "--only", "FF1_D_U") == exit_codes.DONE
    assert run("rollback", "--yes") == exit_codes.DONE
    assert (vehicle.server.value("FF1_M_U"), vehicle.server.value("FF1_D_U")) == (111.5, 0.0)


def killed(vehicle, write, *line):
    """Run a command whose ground dies as it sends that write."""
    with dying_at(vehicle, write, ("PARAM_SET",)), pytest.raises(GroundKilledError):
        run(*line)
    vehicle.clock.advance_to(vehicle.clock.now_s + 2.0)


NEVER_FINISHED = "was never finished: of its 2 values 1 are on the vehicle, and none of them flies: set"


def test_a_ground_that_was_killed_in_an_upload_is_told_of_it_and_finishes_it(vehicle, file, tmp_path, capsys):
    with_intervals(file)
    killed(vehicle, 2, "upload", file, "--yes")
    (receipt,) = (tmp_path / "receipts").glob("*-receipt.json")
    assert json.loads(receipt.read_text("utf-8"))["outcome"] == "begun"
    assert run("show", "FF1_M_U") == exit_codes.DONE
    said = capsys.readouterr().err
    assert NEVER_FINISHED in " ".join(said.split())
    (wanted,) = (tmp_path / "receipts").glob("*-wanted.param")
    assert f"finish it: params upload receipts/{wanted.name}" in " ".join(said.split())
    assert run("upload", str(wanted), "--yes") == exit_codes.DONE
    assert {k: v for k, v in vehicle.server.active(1).items() if v} == {"M_u": 111.5, "D_u": 56.25}
    (accepted,) = (tmp_path / "receipts").glob("*-accepted.param")
    assert read_sidecar(accepted).intervals["FF1_M_U"].high95 == 121.5
    capsys.readouterr()
    run("diff", file)
    assert "never finished" not in capsys.readouterr().out
    vehicle.clock.advance_to(vehicle.clock.now_s + 2.0)
    assert run("rollback", "--yes") == exit_codes.DONE
    assert not any(vehicle.server.active(1).values())


def test_a_ground_that_was_killed_in_an_upload_goes_back_in_one_step(vehicle, file, capsys):
    assert run("upload", file, "--yes", "--only", "FF1_D_U") == exit_codes.DONE
    vehicle.clock.advance_to(vehicle.clock.now_s + 2.0)
    killed(vehicle, 2, "upload", file, "--yes", "--only", "FF1_M_U")
    capsys.readouterr()
    assert vehicle.server.value("FF1_M_U") == 111.5
    run("diff", file)
    assert "or go back: params rollback" in " ".join(capsys.readouterr().out.split())
    assert run("rollback", "--yes") == exit_codes.DONE
    assert vehicle.server.value("FF1_M_U") == 0.0
    assert vehicle.server.active(1)["D_u"] == 56.25
    capsys.readouterr()
    run("diff", file)
    assert "never finished" not in capsys.readouterr().out


@pytest.mark.usefixtures("vehicle")
def test_what_was_to_be_written_is_kept_no_longer_than_the_upload_lasts(file, tmp_path):
    with_intervals(file)
    assert run("upload", file, "--yes") == exit_codes.DONE
    assert [*(tmp_path / "receipts").glob("*-wanted*")] == []


def full_once_in_force(vehicle, monkeypatch):
    """A disk that is full from the moment on at which a set came into force."""
    fsync = os.fsync

    def full(file):
        if any(vehicle.server.active(1).values()):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        fsync(file)

    monkeypatch.setattr("os.fsync", full)


def test_a_disk_that_fills_up_in_an_upload_hides_nothing_of_what_came_into_force(
    vehicle, file, monkeypatch, capsys
):
    with monkeypatch.context() as disk:
        full_once_in_force(vehicle, disk)
        assert run("upload", file, "--yes") == exit_codes.NO
    told = capsys.readouterr()
    assert "2 parameters written and read back, set " in told.out
    assert told.out.count("read back equal") == 2
    assert "receipt: " not in told.out
    said = " ".join(told.err.split())
    assert "its receipt still says that it was begun: " in said
    assert "can't be written (No space left on device)" in said
    assert run("upload", file, "--yes") == exit_codes.DONE
    assert run("diff", file) == exit_codes.DONE
    assert "was never finished" not in capsys.readouterr().err


def test_json_tells_what_came_into_force_beside_why_no_receipt_says_so(vehicle, file, monkeypatch, capsys):
    full_once_in_force(vehicle, monkeypatch)
    assert run("upload", file, "--yes", "--json", "-") == exit_codes.NO
    told = json.loads(capsys.readouterr().out)
    assert (told["outcome"], [line["after"] for line in told["parameters"]]) == ("applied", [111.5, 56.25])
    assert "No space left on device" in told["unkept"]


def test_a_full_disk_hides_nothing_of_a_roll_back_either(vehicle, file, monkeypatch, capsys):
    vehicle.server.write("FF1_M_U", 99.0, armed=False)
    vehicle.server.write("FF_COMMIT", vehicle.server.staged_crc, armed=False)
    assert run("upload", file, "--yes") == exit_codes.DONE
    replace = Path.replace

    def full_at_the_end(path, into):
        if into.name.endswith("-receipt.json") and vehicle.server.active(1)["M_u"] == 99.0:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return replace(path, into)

    monkeypatch.setattr("pathlib.Path.replace", full_at_the_end)
    assert run("rollback", "--yes") == exit_codes.NO
    told = capsys.readouterr()
    assert "2 parameters written and read back" in told.out
    assert "the same `seatrial params rollback` once more" in " ".join(told.err.split())


def test_a_full_disk_before_the_first_write_lets_nothing_be_sent(vehicle, file, monkeypatch, capsys):
    vehicle.server.write("FF1_M_U", 99.0, armed=False)
    vehicle.server.write("FF_COMMIT", vehicle.server.staged_crc, armed=False)
    full_once_in_force(vehicle, monkeypatch)
    assert run("upload", file, "--yes") == exit_codes.NO
    assert vehicle.server.value("FF1_M_U") == 99.0
    assert "read back" not in capsys.readouterr().out


def test_an_implausible_value_stops_all_and_is_taken_by_name_alone(vehicle, file, capsys):
    wide = Interval("M_u", "kg", 111.5 - 300.0, 111.5 + 300.0)
    write_sidecar(
        Path(file), Sidecar("d", "v", "hovering", "likelihood", "1", {"FF1_M_U": wide}, "ruvifist", "lake")
    )
    assert run("diff", file) == exit_codes.NO
    assert "1 changed, 1 implausible" in capsys.readouterr().out
    assert run("upload", file, "--yes") == exit_codes.NO
    said = " ".join(capsys.readouterr().err.split())
    assert "FF1_M_U: its standard deviation, 153.1, is as large as the value" in said
    assert "--accept-implausible FF1_M_U" in said
    assert run("upload", file, "--yes", "--accept-implausible", "FF1_D_U") == exit_codes.NO
    assert vehicle.server.active(1) == {}
    assert run("upload", file, "--yes", "--only", "FF1_D_U") == exit_codes.DONE
    assert run("upload", file, "--yes", "--accept-implausible", "FF1_M_U") == exit_codes.DONE
    assert vehicle.server.active(1)["M_u"] == 111.5


def test_a_change_that_what_was_accepted_last_speaks_against_stops_all_but_a_roll_back(
    vehicle, file, tmp_path, capsys
):
    assert run("upload", file, "--yes") == exit_codes.DONE
    typed = tmp_path / "typed.param"
    typed.write_text("FF1_D_U,562.5\n", encoding="utf-8")
    assert run("upload", str(typed), "--yes") == exit_codes.NO
    assert "56.25 was accepted last: this is 10 times as much" in " ".join(capsys.readouterr().err.split())
    assert run("upload", str(typed), "--yes", "--accept-implausible", "FF1_D_U") == exit_codes.DONE
    assert run("rollback", "--yes") == exit_codes.DONE
    assert vehicle.server.active(1)["D_u"] == 56.25


def test_a_zero_that_what_was_accepted_last_speaks_against_is_taken_by_name_or_a_roll_back_alone(
    vehicle, file, tmp_path, capsys
):
    zero = tmp_path / "zero.param"
    zero.write_text("FF1_D_U,0\n", encoding="utf-8")
    assert run("upload", file, "--yes") == exit_codes.DONE
    assert run("upload", str(zero), "--yes") == exit_codes.NO
    assert "56.25 was accepted last: this is 0 times as much" in " ".join(capsys.readouterr().err.split())
    assert vehicle.server.active(1)["D_u"] == 56.25
    assert run("upload", str(zero), "--yes", "--accept-implausible", "FF1_D_U") == exit_codes.DONE
    assert vehicle.server.active(1)["D_u"] == 0.0
    assert run("rollback", "--yes") == exit_codes.DONE
    assert run("rollback", "--yes") == exit_codes.DONE
    assert vehicle.server.value("FF1_M_U") == 0.0


@pytest.mark.usefixtures("vehicle")
def test_with_a_vehicle_file_a_total_mass_below_its_dry_mass_stops_all(tmp_path, capsys):
    light = tmp_path / "light.param"
    dry_kg = load_vehicle(VEHICLE).vehicle.configurations["hovering"].dry_mass_kg
    light.write_text(f"FF1_M_U,{dry_kg / 2}\n", encoding="utf-8")
    assert run("diff", str(light)) == exit_codes.NO
    assert "1 changed" in capsys.readouterr().out
    assert run("upload", str(light), "--vehicle", VEHICLE, "--yes") == exit_codes.NO
    assert "below the rigid body's own" in " ".join(capsys.readouterr().err.split())


def test_a_parameter_file_of_another_vehicle_than_the_one_given_is_refused(vehicle, file, capsys):
    with_sidecar(file, "converged")
    assert run("upload", file, "--vehicle", VEHICLE, "--yes") == exit_codes.BAD_INPUT
    assert "is of vehicle 'ruvifist'" in capsys.readouterr().err
    assert vehicle.server.active(1) == {}
    assert run("upload", file, "--vehicle", VEHICLE, "--yes", "--any-vehicle") == exit_codes.DONE
