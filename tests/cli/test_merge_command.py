"""`seatrial merge`: the autopilot's log and another recorder's frames, told and refused."""

import json
import os
import re
from pathlib import Path

import pytest
from autopilot_log import Turning, heard, logged

from bridge import exit_codes
from bridge.wire.whole_recording import WHOLE
from tui import cli
from tui.commands.merge import guessed_words


@pytest.fixture
def folder(tmp_path):
    made = tmp_path / "2026-11-20T0912Z-lake"
    made.mkdir()
    heard(made / "telemetry.tlog", Turning())
    return made


def test_a_log_is_merged_by_one_command_and_again_without_harm(folder, tmp_path, capsys):
    log = logged(tmp_path / "00000042.BIN", Turning(), lambda boot_s: boot_s + 12.7)
    for _ in range(2):
        words = ["merge", str(folder), str(log), "--json", str(tmp_path / "came.json")]
        assert cli.main(words) == exit_codes.DONE
        said = " ".join(capsys.readouterr().out.split())
        assert "00000042.BIN is merged: its clock is 12.70" in said
        assert "It fills up thruster commands" in said
    (merged,) = json.loads((tmp_path / "came.json").read_text())
    assert merged["into"] == str(folder / "00000042.BIN")
    assert (folder / "00000042.BIN").read_bytes() == log.read_bytes()
    assert cli.main(["import", str(folder), "--json", "-"]) == exit_codes.DONE
    assert "00000042.BIN is merged" in capsys.readouterr().out


def test_a_log_of_another_vehicle_is_refused_and_not_copied(folder, tmp_path, refused):
    log = logged(tmp_path / "1.BIN", Turning(5), lambda boot_s: boot_s)
    assert "it turned otherwise than the vehicle of this dive did" in refused("merge", folder, log)
    assert [file.name for file in folder.iterdir()] == ["telemetry.tlog"]


def test_another_log_of_the_same_name_is_never_written_over(folder, tmp_path, refused):
    (folder / "1.BIN").write_bytes(b"mine")
    log = logged(tmp_path / "1.BIN", Turning(), lambda boot_s: boot_s)
    assert "is there already, and is another log" in refused("merge", folder, log)
    assert (folder / "1.BIN").read_bytes() == b"mine"


def test_the_commands_of_the_how_to_do_what_it_says(tmp_path, monkeypatch):
    page = Path(__file__).resolve().parents[2] / "docs" / "howto" / "merge_recordings.md"
    shown = [
        line
        for block in re.findall(r"```sh\n(.*?)```", page.read_text(), re.S)
        for line in block.splitlines()
    ]
    monkeypatch.chdir(tmp_path)
    folder = Path(shown[0].split()[2])
    folder.mkdir(parents=True)
    telemetry = heard(folder / "telemetry.tlog", Turning())
    logged(tmp_path / "00000042.BIN", Turning(), lambda boot_s: boot_s - 7.0)
    data = telemetry.read_bytes()
    over = 4 * len(data) // 5
    telemetry.write_bytes(data[:over])
    (tmp_path / "laptop.tlog").write_bytes(data[len(data) // 3 : over])
    second = folder / "telemetry.2.tlog"
    for line in shown:
        if second.name in line:
            second.write_bytes(data[over:])
        assert line.startswith("seatrial merge ")
        assert cli.main(line.split()[1:]) == exit_codes.DONE
    assert sorted(file.name for file in folder.iterdir()) == [
        "00000042.BIN", second.name, "telemetry.tlog", WHOLE
    ]  # fmt: skip


def test_one_frame_whose_time_is_a_guess_is_called_one_frame():
    assert guessed_words(1).startswith("When 1 frame of it was sent is a guess")
    assert guessed_words(1).endswith("and it is dated from the end of the one before")
    assert guessed_words(2).startswith("When 2 frames of it were sent is a guess")
    assert guessed_words(2).endswith("and they are dated from the end of the one before")


def test_a_pipe_under_the_name_of_the_log_is_named_and_not_waited_for(folder, tmp_path, refused):
    os.mkfifo(folder / "1.BIN")
    log = logged(tmp_path / "1.BIN", Turning(), lambda boot_s: boot_s)
    assert "1.BIN: is no file; take it away" in refused("merge", folder, log)


def test_one_file_that_can_not_be_merged_keeps_none_of_the_others_out_and_is_named_at_the_end(
    folder, tmp_path, capsys
):
    data = (folder / "telemetry.tlog").read_bytes()
    (tmp_path / "a.tlog").write_bytes(data)
    (tmp_path / "b.tlog").write_bytes(data)
    (tmp_path / "empty.tlog").write_bytes(b"")
    (tmp_path / "words.tlog").write_text("no recording", encoding="utf-8")
    names = ["a.tlog", "empty.tlog", "absent.tlog", "words.tlog", "b.tlog"]
    given = [str(tmp_path / name) for name in names]
    words = ["merge", str(folder), *given, "--json", str(tmp_path / "came.json")]
    assert cli.main(words) == exit_codes.BAD_INPUT
    out, err = (" ".join(text.split()) for text in capsys.readouterr())
    assert "a.tlog: its clock" in out
    assert "b.tlog: its clock" in out
    assert f"seatrial: {tmp_path / 'empty.tlog'}: is empty, nothing was recorded in it" in err
    assert f"seatrial: {tmp_path / 'absent.tlog'}: no such file; check the name" in err
    assert f"seatrial: {tmp_path / 'words.tlog'}: holds no MAVLink frame" in err
    assert err.endswith("merged: a.tlog, b.tlog; not merged: empty.tlog, absent.tlog, words.tlog")
    merged = json.loads((tmp_path / "came.json").read_text())
    whole = str(folder / WHOLE)
    assert [(item["file"], item["into"]) for item in merged] == list(
        zip(given, [whole, None, None, None, whole], strict=True)
    )


def test_a_file_that_may_not_be_read_is_told_as_any_other(folder, monkeypatch, capsys, refused):
    def refused(*_):
        raise PermissionError(13, "Permission denied", "secret.tlog")

    monkeypatch.setattr("tui.commands.merge.load_recording", refused)
    assert cli.main(["merge", str(folder), "secret.tlog"]) == exit_codes.BAD_INPUT
    said = "seatrial: secret.tlog: Permission denied; check the path, its rights and the disk"
    assert said in " ".join(capsys.readouterr().err.split())
