"""`seatrial bridge --ring`: the vehicle's own recording."""

from pathlib import Path

from bridge import exit_codes
from bridge.onboard import program
from bridge.wire.tlog import MOST_BYTES
from tui import cli

VEHICLE = str(Path(__file__).resolve().parents[1] / "data" / "vehicles" / "hovering.yaml")


def bridge(folder, *more):
    link = ["--link", "udpout:127.0.0.1:9", "--parameters", str(folder.parent / "parameters.json")]
    return cli.main(["bridge", "--vehicle", VEHICLE, *link, "--ring", str(folder), *more])


def test_a_ring_of_too_few_files_is_refused_before_anything_begins(tmp_path, capsys):
    assert bridge(tmp_path / "ring", "--ring-mb", "3") == exit_codes.BAD_INPUT
    assert "holds fewer than 4 files of --segment-mb 4" in capsys.readouterr().err
    assert not (tmp_path / "ring").exists()


def test_files_that_the_ground_would_fetch_and_not_read_are_refused(tmp_path, capsys):
    assert bridge(tmp_path / "ring", "--ring-mb", "20000", "--segment-mb", "2001") == exit_codes.BAD_INPUT
    assert "no more than 2000 MB of a file are read" in " ".join(capsys.readouterr().err.split())
    assert program.MOST_SEGMENT_MB * program.MEGABYTE < MOST_BYTES


def test_a_ring_that_would_lie_in_a_file_is_refused(tmp_path, capsys):
    (tmp_path / "ring").write_text("")
    assert bridge(tmp_path / "ring") == exit_codes.BAD_INPUT
    assert "is no folder" in capsys.readouterr().err
