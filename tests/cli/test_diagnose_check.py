"""`seatrial diagnose DIVE --check DIVE`: which check dives are refused, and which are told to be too short."""

import gzip
from pathlib import Path

import pytest

from bridge.errors import FitError
from identify.challenge.case import check_of, dive_of, draw_case
from identify.challenge.seal import tlog_of
from identify.diagnose.diagnose import diagnose
from identify.diagnose.recording import LEAST_CHECK_S
from identify.effects.hydrodynamics import QUADRATIC_DRAG
from identify.ingest.open import OPENING_BYTES, OVERLAPPING, PIECE, SAME, of_one_dive
from tui import cli, exit_codes


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A vehicle with two dives of 30 s."""
    case, folder = draw_case(300051, names=[], seconds=30.0), tmp_path_factory.mktemp("two")
    (folder / "vehicle.yaml").write_text(case.vehicle.text, encoding="utf-8")
    (folder / "dive.tlog").write_bytes(tlog_of(dive_of(case)))
    (folder / "other.tlog").write_bytes(tlog_of(check_of(case)))
    return folder


def refused(folder: Path, check: Path, capsys: pytest.CaptureFixture[str]) -> str:
    """What is said of a check dive that is refused."""
    words = ("diagnose", folder / "dive.tlog", "--vehicle", folder / "vehicle.yaml", "--check", check)
    assert cli.main([*map(str, words)]) == exit_codes.BAD_INPUT
    return " ".join(capsys.readouterr().err.split())


def made(path: Path, data: bytes) -> Path:
    path.write_bytes(data)
    return path


def test_a_check_dive_that_is_the_dive_is_refused_by_whatever_name(
    files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = (files / "dive.tlog").read_bytes()
    copy, packed = made(tmp_path / "copy.tlog", data), made(tmp_path / "c.tlog.gz", gzip.compress(data))
    for same in (files / "dive.tlog", copy, packed):
        said = refused(files, same, capsys)
        assert f"the check dive {same}: {SAME} {files / 'dive.tlog'}" in said
        assert "give another dive" in said


def test_a_piece_of_the_dive_is_refused_wherever_it_was_cut(
    files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = (files / "dive.tlog").read_bytes()
    beginning = made(tmp_path / "beginning.tlog", data[: len(data) * 9 // 10 + 3])
    end = made(tmp_path / "end.tlog", data[len(data) // 3 :])
    for piece in (beginning, end):
        assert f"the check dive {piece}: {PIECE} " in refused(files, piece, capsys)


def test_what_is_wrong_with_the_check_dive_is_told_of_the_check_dive(
    files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    empty = made(tmp_path / "empty.tlog", b"")
    assert f"the check dive {empty}: is empty" in refused(files, empty, capsys)
    case = draw_case(300051, names=[], seconds=70.0)
    long = made(tmp_path / "long.tlog", tlog_of(dive_of(case)))
    start_s = check_of(case).span_s[0]
    short = made(tmp_path / "short.tlog", tlog_of(check_of(case).between(start_s, start_s + 5.0)))
    words = ("diagnose", long, "--vehicle", files / "vehicle.yaml", "--check", short)
    assert cli.main([*map(str, words)]) == exit_codes.NO
    said = " ".join(capsys.readouterr().err.split())
    assert f"the check dive {short}: lasts 4 s, too short to tell one cause from another" in said


def test_two_pieces_that_share_a_stretch_are_of_one_dive(files: Path, tmp_path: Path) -> None:
    data = (files / "dive.tlog").read_bytes()
    assert len(data) > 4 * OPENING_BYTES
    one = made(tmp_path / "one.tlog", data[: len(data) * 2 // 3])
    other = made(tmp_path / "other.tlog", data[len(data) // 3 :])
    assert of_one_dive([one], [other]) == of_one_dive([other], [one]) == OVERLAPPING


def test_two_dives_of_a_vehicle_and_two_tables_that_begin_alike_are_two(files: Path, tmp_path: Path) -> None:
    assert of_one_dive([files / "dive.tlog"], [files / "other.tlog"]) == ""
    head = b"time_s,u\n" * OPENING_BYTES
    tables = [made(tmp_path / f"{end}.csv", head + str(end).encode()) for end in (1, 2)]
    assert of_one_dive(tables[:1], tables[1:]) == ""
    assert of_one_dive([made(tmp_path / "empty.tlog", b"")], [files / "dive.tlog"]) == ""


@pytest.mark.slow
def test_a_check_dive_under_a_minute_is_flown_with_a_word_that_it_tells_little() -> None:
    case = draw_case(300051, names=[], seconds=90.0)
    dive, check = dive_of(case), check_of(case)
    start_s = check.span_s[0]
    short = check.between(start_s, start_s + LEAST_CHECK_S + 15.0)

    def told(other):
        found = diagnose(
            dive,
            case.file,
            case.configuration,
            check=other,
            effects=(QUADRATIC_DRAG,),
            progress=lambda *_report: None,
        )
        assert found.check is not None
        return [note for note in found.notes if "check dive" in note]

    assert told(check) == []
    (note,) = told(short)
    assert note.startswith("The check dive lasts 34 s, too short to tell how far the gap shrinks; dive 60 s")


@pytest.mark.parametrize("first", [True, False])
def test_a_run_that_compiles_first_says_so_and_no_other(
    first: bool, files: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def no_dive(*_: object, **_more: object) -> None:
        raise FitError("nothing was pushed")

    monkeypatch.setattr("identify.run.identify.compiles_first", lambda: first)
    monkeypatch.setattr("identify.diagnose.diagnose.diagnose", no_dive)
    words = ("diagnose", files / "dive.tlog", "--vehicle", files / "vehicle.yaml")
    assert cli.main([*map(str, words)]) == exit_codes.NO
    assert ("compiling first, once after installation" in capsys.readouterr().err) is first
