"""`record`, `replay` and `import`: what goes in comes out again."""

import gzip
import json
import os
import signal
import socket
from pathlib import Path

import pytest
from fakes.processes import Running
from fakes.recordings import raws
from full_disk import fill
from pymavlink.dialects.v20 import ardupilotmega as dialect
from waiting import ended_once

from bridge import exit_codes
from bridge.links.link import memory_pair
from bridge.links.udp import open_udpin
from bridge.wire.framing import Encoder
from bridge.wire.status_codes import status_texts
from bridge.wire.tlog import TlogWriter
from gcs_plugin.dives.conditions import Conditions
from gcs_plugin.dives.folder import About, list_folders, new_folder
from tui import cli

BOOT_US = 1_790_000_000_000_000
PATIENCE_S = 30.0


def attitudes(count):
    encoder = Encoder(1, 1)
    messages = [
        dialect.MAVLink_attitude_quaternion_message(1000 * second, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        for second in range(count)
    ]
    return [encoder.encode(message) for message in messages]


@pytest.fixture
def recording(tmp_path):
    """A `.tlog` of a hundred attitudes, one a second."""
    path = tmp_path / "still.tlog"
    with TlogWriter(path) as writer:
        for second, raw in enumerate(attitudes(100)):
            writer.write(BOOT_US + second * 1_000_000, raw)
    return path


@pytest.fixture
def far_end(monkeypatch):
    """The other end of the link that the next verb opens; a recording ends with what it has sent."""
    near, far = memory_pair()
    monkeypatch.setattr("bridge.links.open.open_link", lambda _: near)
    ended_once(monkeypatch, lambda: not near._inbox)
    return far


def everything(link):
    data = b""
    while link._inbox:
        data += link.read(0)
    return data


def test_record_keeps_every_frame_in_a_dive_folder(far_end, tmp_path, capsys):
    sent = attitudes(50)
    for raw in sent:
        far_end.write(raw)
    line = ["record", "--link", "any", "--out", str(tmp_path), "--name", "Lake 7"]
    code = cli.main([*line, "--json", "-"])
    output = json.loads(capsys.readouterr().out)
    assert code == exit_codes.DONE
    assert output["frames"] == 50
    assert output["links"]["memory:a"][0]["received"] == 50
    folder = Path(output["folder"])
    assert folder.name.endswith("Z-lake-7")
    assert raws(folder / "telemetry.tlog") == sent


@pytest.mark.parametrize(
    ("words", "taken", "kept"),
    [
        (["--same-conditions"], "taken", Conditions(salinity=35.0)),
        ([], "`seatrial conditions --same` takes that", Conditions()),
    ],
)
def test_record_tells_of_the_conditions_before_and_takes_them_only_where_it_is_told(
    words, taken, kept, far_end, tmp_path, capsys
):
    new_folder(tmp_path, 0.0, "before").describe(About(conditions=Conditions(salinity=35.0)))
    far_end.write(attitudes(1)[0])
    cli.main(["record", "--link", "any", "--out", str(tmp_path), *words])
    assert f"conditions of the dive before: salinity 35; {taken}" in capsys.readouterr().err
    assert list_folders(tmp_path)[-1].about().conditions == kept


def test_record_tells_what_the_vehicle_says_without_what_steers_a_terminal(far_end, tmp_path, capsys):
    encoder = Encoder(7, 1)
    for message in status_texts("depth \x1b[2Jhold " + "is lost " * 12, 4, 1) + status_texts("x" * 50, 4, 2):
        far_end.write(encoder.encode(message))
    far_end.write(encoder.encode(dialect.MAVLink_heartbeat_message(12, 0, 0, 0, 4, 3)))
    cli.main(["record", "--link", "any", "--out", str(tmp_path)])
    output = [line for line in capsys.readouterr().err.splitlines() if line.startswith("vehicle 7")]
    assert output == ["vehicle 7: depth [2Jhold " + "is lost " * 12, f"vehicle 7: {'x' * 50}"]


def test_control_c_ends_a_recording_in_order(tmp_path):
    running = Running("record", "--link", "udpin:127.0.0.1:0", "--out", str(tmp_path))
    running.until("Ctrl-C ends it")
    assert running.end() == exit_codes.LINK
    assert running.said("0 frames")
    assert not running.said("Traceback")


def test_replay_sends_every_frame_unchanged(recording, far_end, capsys):
    code = cli.main(["replay", str(recording), "--link", "any", "--speed", "1e6"])
    assert code == exit_codes.DONE
    assert everything(far_end) == b"".join(attitudes(100))
    assert "100 frames sent" in capsys.readouterr().out


@pytest.mark.usefixtures("far_end")
def test_a_single_frame_is_no_several_frames(tmp_path, capsys):
    path = tmp_path / "single.tlog"
    with TlogWriter(path) as writer:
        writer.write(BOOT_US, attitudes(1)[0])
    assert cli.main(["replay", str(path), "--link", "any"]) == exit_codes.DONE
    assert "1 frame sent" in capsys.readouterr().out


def test_replay_on_a_link_that_listens_waits_for_whoever_speaks_there_first_and_sends_all_to_him(
    recording, monkeypatch, capsys
):
    link = open_udpin("127.0.0.1", 0)
    monkeypatch.setattr("bridge.links.open.open_link", lambda _: link)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ground:
        ground.settimeout(PATIENCE_S)
        looks = []

        def speaks_at_the_third_look(*waiting):
            looks.append(waiting)
            if len(looks) == 3:
                ground.sendto(attitudes(1)[0], ("127.0.0.1", link.port))
            return listen(*waiting)

        listen = link.read
        monkeypatch.setattr(link, "read", speaks_at_the_third_look)
        words = ("replay", str(recording), "--link", "udpin:127.0.0.1:14550", "--speed", "1e6")
        assert cli.main(words) == exit_codes.DONE
        assert [ground.recv(1024) for _ in range(100)] == attitudes(100)
    assert "waits until somebody speaks on udpin:" in capsys.readouterr().err


def test_replay_starts_where_it_is_told(recording, far_end):
    assert (
        cli.main(["replay", str(recording), "--link", "any", "--speed", "1e6", "--from", "90"])
        == exit_codes.DONE
    )
    assert everything(far_end) == b"".join(attitudes(100)[90:])


def test_replay_of_a_dive_whose_clock_was_set_back_sends_every_frame(tmp_path, far_end):
    path, frames = tmp_path / "a.tlog", attitudes(40)
    with TlogWriter(path) as writer:
        for n, raw in enumerate(frames):
            writer.write(round(1.79e15 + n * 5e4 - 3.6e9 * (n >= 20)), raw)
    assert cli.main(["replay", str(path), "--link", "any", "--speed", "1e6"]) == exit_codes.DONE
    assert everything(far_end) == b"".join(frames)


def test_replay_from_beyond_the_end_says_how_long_the_dive_is(recording, far_end, capsys):
    code = cli.main(["replay", str(recording), "--link", "any", "--from", "1000"])
    assert code == exit_codes.BAD_INPUT
    assert "is 99 s long" in capsys.readouterr().err
    assert everything(far_end) == b""


@pytest.mark.parametrize("start", ["-5", "nan", "end"])
def test_replay_from_no_second_of_the_dive_is_refused(start, recording, far_end, refused):
    assert f"--from: '{start}' is not a number of seconds from 0" in refused(
        "replay", recording, "--link", "any", "--from", start
    )
    assert everything(far_end) == b""


def test_import_says_what_there_is_and_files_a_copy(recording, tmp_path, capsys):
    out = tmp_path / "dives" / "lake"
    code = cli.main(["import", str(recording), "--out", str(out), "--json", "-"])
    output = json.loads(capsys.readouterr().out)
    assert code == exit_codes.DONE
    assert [signal["name"] for signal in output["signals"]] == ["attitude"]
    assert [signal["samples"] for signal in output["signals"]] == [100]
    assert any("There is no velocity" in note for note in output["notes"])
    assert (out / "telemetry.tlog").read_bytes() == recording.read_bytes()
    assert "still.tlog" in (out / "dive.yaml").read_text(encoding="utf-8")


def test_import_never_overwrites_a_folder(recording, tmp_path, refused):
    assert "never overwritten" in refused("import", recording, "--out", tmp_path)


@pytest.mark.parametrize("name", ["tank.csv", "tank.3.csv.gz", "tank.TXT", "tank.tsv"])
def test_a_table_imported_with_its_map_needs_no_map_again(name, tmp_path, capsys):
    table = tmp_path / name
    rows = "t,p1,p2\n" + "".join(f"{i / 10},1500,1600\n" for i in range(50))
    table.write_bytes(gzip.compress(rows.encode()) if name.endswith(".gz") else rows.encode())
    columns = tmp_path / "map.yaml"
    columns.write_text("time: {column: t, unit: s}\npwm: {columns: [p1, p2], unit: us}\n", encoding="utf-8")
    out = tmp_path / "dive"
    assert cli.main(["import", str(table), "--columns", str(columns), "--out", str(out)]) == exit_codes.DONE
    capsys.readouterr()
    assert cli.main(["import", str(out), "--json", "-"]) == exit_codes.DONE
    assert json.loads(capsys.readouterr().out)["signals"][0]["name"] == "pwm"


@pytest.mark.parametrize("name", ["telemetry.tlog", "dive.yaml"])
def test_an_import_onto_a_full_disk_names_what_it_was_to_write_and_can_be_made_again(
    name, recording, tmp_path, monkeypatch, capsys
):
    out = tmp_path / "full" / "lake"
    words = ["import", str(recording), "--out", str(out)]
    with monkeypatch.context() as disk:
        fill(disk, out, name)
        assert cli.main(words) == exit_codes.BAD_INPUT
    said = " ".join(capsys.readouterr().err.split())
    assert f"{out / name}: can't be written (No space left on device)" in said
    assert str(recording) not in said
    assert not out.exists()
    assert cli.main(words) == exit_codes.DONE


def test_an_import_that_is_ended_by_a_signal_leaves_no_folder_and_can_be_made_again(
    recording, tmp_path, monkeypatch, capsys
):
    out = tmp_path / "dives" / "lake"
    words = ["import", str(recording), "--out", str(out)]
    monkeypatch.setattr(
        "tui.commands.import_.DiveFolder.describe", lambda *_: os.kill(os.getpid(), signal.SIGTERM)
    )
    before = signal.signal(signal.SIGTERM, lambda *_: None)
    try:
        assert cli.main(words) == exit_codes.INTERRUPTED
    finally:
        signal.signal(signal.SIGTERM, before)
    assert "stopped before it was done" in capsys.readouterr().err
    assert not out.exists()
    monkeypatch.undo()
    assert cli.main(words) == exit_codes.DONE


@pytest.mark.usefixtures("far_end")
def test_a_recording_onto_a_full_disk_is_refused_and_leaves_no_empty_dive(tmp_path, monkeypatch, capsys):
    out = tmp_path / "full"
    fill(monkeypatch, out)
    assert cli.main(["record", "--link", "udpin:127.0.0.1:1", "--hub", "none", "--out", str(out)]) == (
        exit_codes.BAD_INPUT
    )
    assert "dive.yaml: can't be written (No space left on device)" in " ".join(
        capsys.readouterr().err.split()
    )
    assert [*out.iterdir()] == []
