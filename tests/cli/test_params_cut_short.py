"""`params upload` that was killed at any message, or whose disk is full: what is said of it, and how it is finished."""

import json
import re
from pathlib import Path

import params_line
import pytest
from figures import keep
from full_disk import fill, full_once_in_force
from parameter_vehicle import GroundKilledError, at_any_link, dying_at
from params_line import run, with_intervals

from bridge import exit_codes
from bridge.vehicle.parameters import set_crc
from gcs_plugin.params.sidecar import read_sidecar
from tui import cli

vehicle = params_line.vehicle
file = params_line.file


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


@pytest.mark.usefixtures("vehicle")
def test_what_was_to_be_written_is_kept_no_longer_than_the_upload_lasts(file, tmp_path):
    with_intervals(file)
    assert run("upload", file, "--yes") == exit_codes.DONE
    assert [*(tmp_path / "receipts").glob("*-wanted*")] == []


def test_a_disk_that_fills_up_in_an_upload_hides_nothing_of_what_came_into_force(
    vehicle, file, monkeypatch, capsys
):
    with monkeypatch.context() as disk:
        full_once_in_force(vehicle, disk)
        assert run("upload", file, "--yes") == exit_codes.BAD_INPUT
    output = capsys.readouterr()
    assert "2 parameters written and read back, set " in output.out
    assert output.out.count("read back equal") == 2
    assert "receipt: " not in output.out
    said = " ".join(output.err.split())
    assert "its receipt still says that it was begun: " in said
    assert "can't be written (No space left on device)" in said
    assert run("upload", file, "--yes") == exit_codes.DONE
    assert run("diff", file) == exit_codes.DONE
    assert "was never finished" not in capsys.readouterr().err


def test_json_tells_what_came_into_force_beside_why_no_receipt_says_so(vehicle, file, monkeypatch, capsys):
    full_once_in_force(vehicle, monkeypatch)
    assert run("upload", file, "--yes", "--json", "-") == exit_codes.BAD_INPUT
    output = json.loads(capsys.readouterr().out)
    assert (output["outcome"], [line["after"] for line in output["parameters"]]) == (
        "applied",
        [111.5, 56.25],
    )
    assert "No space left on device" in output["unkept"]


@pytest.mark.parametrize("kind", ["-before.param", "-wanted.param", "-wanted.param.json", "-receipt.json"])
def test_an_upload_whose_files_find_no_room_writes_nothing_and_leaves_none_of_them(
    kind, vehicle, file, tmp_path, monkeypatch, capsys
):
    with_intervals(file)
    receipts = tmp_path / "receipts"
    with monkeypatch.context() as disk:
        fill(disk, receipts, kind)
        assert run("upload", file, "--yes") == exit_codes.BAD_INPUT
    assert "can't be written (No space left on device)" in " ".join(capsys.readouterr().err.split())
    assert [path.name for path in receipts.iterdir()] == [".vehicle-1.lock"]
    assert not any(vehicle.server.active(1).values())
    assert run("upload", file, "--yes") == exit_codes.DONE


OLD = {"FF1_M_U": 99.0, "FF1_D_U": 40.0}
NEW = {"FF1_M_U": 111.5, "FF1_D_U": 56.25}
MOST = 1000
TOLD = re.compile(r"never finished: of its 2 values (\d) are on the vehicle(, and its set \d+ flies)?")


@pytest.fixture
def sea(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "new.param").write_text("FF1_M_U,111.5\nFF1_D_U,56.25\n", encoding="utf-8")

    def begin():
        store = Path.cwd() / "store.json"
        store.unlink(missing_ok=True)
        vehicle = at_any_link(monkeypatch, store)
        for name, value in OLD.items():
            vehicle.server.write(name, value, armed=False)
        vehicle.server.write("FF_COMMIT", float(vehicle.server.staged_crc), armed=False)
        return vehicle

    return begin


def run_to_its_end(vehicle, *line):
    vehicle.clock.advance_to(vehicle.clock.now_s + 2.0)
    return cli.main(["params", *line, "--link", "any"])


def upload(vehicle, message):
    """Upload until the ground dies at a message; whether it did."""
    with dying_at(vehicle, message) as sent:
        try:
            assert run_to_its_end(vehicle, "upload", "new.param", "--yes") == exit_codes.DONE
        except GroundKilledError:
            return True, len(sent)
    return False, len(sent)


def flies(vehicle):
    return {name: vehicle.server.active(1)[name[4] + "_u"] for name in OLD}


def told_is_so(vehicle, said):
    """A BEGUN receipt is reported, with the number of its values on the vehicle and the set that flies."""
    staged = {name: vehicle.server.value(name) for name in NEW}
    assert vehicle.server.active_crc in (set_of(vehicle, OLD), set_of(vehicle, NEW))
    result = TOLD.search(" ".join(said.split()))
    if result is None:
        assert (staged, flies(vehicle)) == (OLD, OLD)
        return False
    assert int(result[1]) == sum(staged[name] == NEW[name] for name in NEW)
    assert bool(result[2]) == (flies(vehicle) == NEW)
    return True


def set_of(vehicle, values):
    table = {name: vehicle.server.value(name) for name in vehicle.server.names[:-4]}
    return set_crc(table | values)


def mended_from(sea, message, capsys, finishes):
    vehicle = sea()
    died, _ = upload(vehicle, message)
    assert died
    if message % 3 == 0:
        vehicle.boot()
    capsys.readouterr()
    run_to_its_end(vehicle, "show", "FF1_M_U")
    begun = told_is_so(vehicle, capsys.readouterr().err)
    if finishes or not begun:
        assert run_to_its_end(vehicle, "upload", "new.param", "--yes") == exit_codes.DONE
        assert flies(vehicle) == NEW
    if not finishes or not begun:
        assert run_to_its_end(vehicle, "rollback", "--yes") == exit_codes.DONE
        assert flies(vehicle) == OLD
    run_to_its_end(vehicle, "show", "FF1_M_U")
    assert "never finished" not in capsys.readouterr().err


def messages(sea):
    return upload(sea(), MOST)[1]


def in_a_new_folder(tmp_path, monkeypatch, name):
    folder = tmp_path / str(name)
    folder.mkdir()
    (folder / "new.param").write_bytes((tmp_path / "new.param").read_bytes())
    monkeypatch.chdir(folder)


def test_a_ground_killed_at_any_of_its_writes_or_just_before_tells_so_and_mends_it(
    sea, tmp_path, monkeypatch, capsys
):
    with dying_at(vehicle := sea(), MOST) as sent:
        assert run_to_its_end(vehicle, "upload", "new.param", "--yes") == exit_codes.DONE
    writes = [place for place, kind in enumerate(sent, start=1) if kind == "PARAM_SET"]
    assert len(writes) == 3
    for message in sorted({*writes, writes[-1] + 1, len(sent)}):
        in_a_new_folder(tmp_path, monkeypatch, message)
        mended_from(sea, message, capsys, finishes=message % 2 == 0)


@pytest.mark.soak
def test_a_ground_killed_at_any_message_tells_so_and_mends_it(sea, tmp_path, monkeypatch, capsys):
    count = messages(sea)
    for message in range(1, count + 1):
        for finishes in (True, False):
            in_a_new_folder(tmp_path, monkeypatch, f"{message}-{finishes}")
            mended_from(sea, message, capsys, finishes)
    keep(
        "upload_cut",
        f"killed at each of {count} messages: {count} finished, {count} rolled back, none told wrongly",
    )
