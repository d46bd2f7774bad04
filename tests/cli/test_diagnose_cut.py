"""`seatrial diagnose` of a recording that was cut: what is said of which file."""

import gzip
from pathlib import Path

import pytest

from identify.challenge.case import dive_of, draw_case
from identify.challenge.seal import tlog_of
from identify.diagnose import diagnose
from identify.diagnose.result import Diagnosis, Gap
from tui import cli, exit_codes


@pytest.fixture(scope="module")
def dive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A vehicle with a dive of 18 s, packed."""
    case, folder = draw_case(300052, names=[], seconds=18.0), tmp_path_factory.mktemp("cut")
    (folder / "vehicle.yaml").write_text(case.vehicle.text, encoding="utf-8")
    (folder / "dive.tlog.gz").write_bytes(gzip.compress(tlog_of(dive_of(case))))
    return folder / "dive.tlog.gz"


def refused(recording: Path, folder: Path, capsys: pytest.CaptureFixture[str], *more: str) -> tuple[int, str]:
    """Exit code, and what is said, on one line."""
    code = cli.main(["diagnose", str(recording), "--vehicle", str(folder / "vehicle.yaml"), *more])
    return code, " ".join(capsys.readouterr().err.split())


def test_a_packed_recording_that_was_cut_is_said_to_end_in_the_middle_of_a_record(
    dive: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cut, data = tmp_path / "dive.tlog.gz", dive.read_bytes()
    cut.write_bytes(data[: len(data) // 3])
    code, said = refused(cut, dive.parent, capsys)
    assert code == exit_codes.NO
    assert f"{cut}: ends in the middle of a record, and what comes before lasts " in said
    assert "copy the whole file, or record 20 s or more" in said


def test_a_whole_recording_that_is_short_is_named_by_its_path_and_not_said_to_be_cut(
    dive: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, said = refused(dive, dive.parent, capsys)
    assert code == exit_codes.NO
    assert f"{dive}: lasts 17 s, too short to tell one cause from another; record 20 s or more" in said


def test_a_column_map_is_refused_where_no_recording_is_a_table(
    dive: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, said = refused(dive, dive.parent, capsys, "--columns", "nosuch")
    assert code == exit_codes.BAD_INPUT
    assert f"--columns nosuch: {dive} is no table (.csv), and needs no column map; leave it out" in said


def test_bytes_that_belong_to_no_message_are_told_once(
    dive: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    nothing = Gap(1.0, (), (), {}, (), (), ())
    found = Diagnosis("d", "v", "c", "no_gap", nothing, (), (), None, None, None, None, (), 1.0)
    monkeypatch.setattr(diagnose, "diagnose", lambda *_, **__: found)
    spoilt = tmp_path / "dive.tlog"
    spoilt.write_bytes(gzip.decompress(dive.read_bytes()) + b"nothing of the kind, " * 200)
    cli.main(["diagnose", str(spoilt), "--vehicle", str(dive.parent / "vehicle.yaml")])
    said = " ".join(capsys.readouterr().out.split())
    assert said.count("dive.tlog: 4200 bytes at its end belong to no message and were left out.") == 1
    cli.main(["diagnose", str(dive), "--vehicle", str(dive.parent / "vehicle.yaml")])
    assert "belong to no message" not in capsys.readouterr().out
