"""`seatrial diagnose`: check dives, simulators beside it, cut recordings, and the words of an answer."""

import gzip
import json
import math
from dataclasses import replace
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from bridge import exit_codes
from bridge.errors import ConfigError, FitError
from bridge.vehicle.config import load_vehicle
from identify.challenge.case import Case, check_of, dive_of, draw_case
from identify.challenge.seal import tlog_of
from identify.diagnose import against as compared_by
from identify.diagnose.candidates import Cause
from identify.diagnose.diagnose import diagnose
from identify.diagnose.result import Accepted, Diagnosis, Finding, Gain, Gap, Share, Value
from identify.effects.hydrodynamics import DRAG_ASYMMETRY, QUADRATIC_DRAG
from identify.effects.library import library
from identify.effects.rigid_body import ADDED_PAYLOAD
from identify.ingest.open import OVERLAPPING, PIECE, SAME, of_one_dive
from identify.run.diagnose import effects_without
from tui import cli
from tui.commands.diagnose import _sends, tell_diagnosis

DRAG = Finding(Cause(QUADRATIC_DRAG, QUADRATIC_DRAG.start()), (), {}, 0.95, {}, 50.0, Gain(0.0234, 0.0051))
D_U = {"D_u": Value(10.0, "N s/m", 9.0, 11.0)}


def diagnosis(*found: Finding, **other) -> Diagnosis:
    gap = Gap(2.0, (), (), {}, (Share("yaw", "turning", 1.0),), (), ())
    made = Diagnosis("d", "v", "c", "explained", gap, found, (), None, None, None, None, (), 1.0)
    return replace(made, **other)


def printed(one: Diagnosis) -> str:
    text = StringIO()
    tell_diagnosis(Console(file=text, width=1000), one)
    return text.getvalue()


def test_the_feed_forward_s_gain_is_printed_and_where_the_gap_lies():
    said = printed(diagnosis(DRAG))
    assert "the feed-forward alone would track to 5.1 mm/s instead of 23 mm/s" in said
    assert "Where: 100 % yaw, turning." in said


def test_an_upload_is_promised_to_send_only_what_the_feed_forward_can_make_up_for():
    path = Path("x.param")
    upload = "seatrial params upload x.param sends"
    drag = Accepted({**D_U, "X_uu": Value(10.0, "N s2/m2", 9.0, 11.0)}, (), ())
    assert _sends(path, diagnosis(DRAG, accepted=drag)) == f"{upload} it to the vehicle"
    munk = replace(DRAG, cause=Cause(DRAG_ASYMMETRY, DRAG_ASYMMETRY.start()))
    assert _sends(path, diagnosis(munk, accepted=Accepted(D_U, (), ()))) == (
        f"the feed-forward can make up for none of its causes; {upload} only the masses and dampings that were fitted "
        "beside them"
    )
    nothing = _sends(path, diagnosis(munk, accepted=Accepted({}, (), ())))
    assert nothing == "nothing in it is for the vehicle; export and simulate --accepted take it"
    payload = replace(DRAG, cause=Cause(ADDED_PAYLOAD, np.array([1.0])))
    assert _sends(path, diagnosis(payload, accepted=Accepted(D_U, (), ()))) == f"{upload} it to the vehicle"


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
    assert len(data) > 262_144
    one = made(tmp_path / "one.tlog", data[: len(data) * 2 // 3])
    other = made(tmp_path / "other.tlog", data[len(data) // 3 :])
    assert of_one_dive([one], [other]) == of_one_dive([other], [one]) == OVERLAPPING


def test_two_dives_of_a_vehicle_and_two_tables_that_begin_alike_are_two(files: Path, tmp_path: Path) -> None:
    assert of_one_dive([files / "dive.tlog"], [files / "other.tlog"]) == ""
    head = b"time_s,u\n" * 65536
    tables = [made(tmp_path / f"{end}.csv", head + str(end).encode()) for end in (1, 2)]
    assert of_one_dive(tables[:1], tables[1:]) == ""
    assert of_one_dive([made(tmp_path / "empty.tlog", b"")], [files / "dive.tlog"]) == ""


@pytest.mark.slow
def test_a_check_dive_under_a_minute_is_flown_with_a_word_that_it_tells_little() -> None:
    case = draw_case(300051, names=[], seconds=90.0)
    dive, check = dive_of(case), check_of(case)
    start_s = check.span_s[0]
    short = check.between(start_s, start_s + 35.0)

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

    monkeypatch.setattr("tui.commands.diagnose.compiles_first", lambda: first)
    monkeypatch.setattr("identify.diagnose.diagnose.diagnose", no_dive)
    words = ("diagnose", files / "dive.tlog", "--vehicle", files / "vehicle.yaml")
    assert cli.main([*map(str, words)]) == exit_codes.NO
    assert ("compiling first, once after installation" in capsys.readouterr().err) is first


NOTHING = Gap(math.nan, (), (), {}, (), (), ())


@pytest.fixture(scope="module")
def pair_of_files(tmp_path_factory: pytest.TempPathFactory) -> tuple[Case, Path]:
    """A vehicle with a real dive and a simulator's, both of 20 s."""
    case, folder = draw_case(150051, names=[], seconds=20.0), tmp_path_factory.mktemp("pair")
    (folder / "vehicle.yaml").write_text(case.vehicle.text, encoding="utf-8")
    (folder / "real.tlog").write_bytes(tlog_of(dive_of(case)))
    (folder / "sim.tlog").write_bytes(tlog_of(check_of(case)))
    return case, folder


def held_against(folder: Path, *words: object) -> int:
    real, sim, vehicle = folder / "real.tlog", folder / "sim.tlog", folder / "vehicle.yaml"
    return cli.main(["diagnose", *map(str, (real, "--against", sim, "--vehicle", vehicle)), *map(str, words)])


def test_screen_json_and_page_say_what_the_simulator_must_gain(
    pair_of_files: tuple[Case, Path],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
):
    case, folder = pair_of_files
    drag = next(
        e for e in library(case.file.vehicle.configurations[case.configuration], 0.1) if e.name == "dead_zone"
    )
    found = Finding(Cause(drag, drag.start()), (), {}, 0.99, {}, 40.0)
    asked = []

    def diagnosed(dive, _file, configuration, *, simulator=None, progress, **_):
        asked.append((dive.name, configuration, simulator is not None))
        progress(1.0, "done")
        causes = (found,) if dive.name == "real" else ()
        return Diagnosis(
            dive.name, "rov", configuration, "explained", NOTHING, causes, (), None, None, None, None, (), 1.0, None,
            Accepted({}, (), ()),
        )  # fmt: skip

    monkeypatch.setattr(compared_by, "diagnose", diagnosed)
    page, data = tmp_path / "page.html", tmp_path / "answer.json"
    assert held_against(folder, "--report", page, "--json", data) == exit_codes.DONE
    assert asked == [("sim", case.configuration, False), ("real", case.configuration, True)]
    assert "Your simulator must gain dead zone" in " ".join(capsys.readouterr().out.split())
    assert "Your simulator must gain dead zone" in page.read_text(encoding="utf-8")
    assert json.loads(data.read_text())["against"]["lacks"] == ["dead_zone"]


@pytest.mark.parametrize("option", ["--check", "--predict", "--accept"])
def test_what_tells_of_the_vehicle_alone_is_refused_beside_a_simulator(
    pair_of_files: tuple[Case, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str], option: str
):
    assert held_against(pair_of_files[1], option, tmp_path / "other.param") == exit_codes.BAD_INPUT
    assert f"{option} tells of the vehicle, --against of a simulator" in capsys.readouterr().err


@pytest.fixture(scope="module")
def dive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A vehicle with a dive of 18 s, packed."""
    case, folder = draw_case(300052, names=[], seconds=18.0), tmp_path_factory.mktemp("cut")
    (folder / "vehicle.yaml").write_text(case.vehicle.text, encoding="utf-8")
    (folder / "dive.tlog.gz").write_bytes(gzip.compress(tlog_of(dive_of(case))))
    return folder / "dive.tlog.gz"


def refusal_of_cut(
    recording: Path, folder: Path, capsys: pytest.CaptureFixture[str], *more: str
) -> tuple[int, str]:
    """Exit code, and what is said, on one line."""
    code = cli.main(["diagnose", str(recording), "--vehicle", str(folder / "vehicle.yaml"), *more])
    return code, " ".join(capsys.readouterr().err.split())


def test_a_packed_recording_that_was_cut_is_said_to_end_in_the_middle_of_a_record(
    dive: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cut, data = tmp_path / "dive.tlog.gz", dive.read_bytes()
    cut.write_bytes(data[: len(data) // 3])
    code, said = refusal_of_cut(cut, dive.parent, capsys)
    assert code == exit_codes.NO
    assert f"{cut}: ends in the middle of a record, and what comes before lasts " in said
    assert "copy the whole file, or record 20 s or more" in said


def test_a_whole_recording_that_is_short_is_named_by_its_path_and_not_said_to_be_cut(
    dive: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, said = refusal_of_cut(dive, dive.parent, capsys)
    assert code == exit_codes.NO
    assert f"{dive}: lasts 17 s, too short to tell one cause from another; record 20 s or more" in said


def test_a_column_map_is_refused_where_no_recording_is_a_table(
    dive: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, said = refusal_of_cut(dive, dive.parent, capsys, "--columns", "nosuch")
    assert code == exit_codes.BAD_INPUT
    assert f"--columns nosuch: {dive} is no table (.csv), and needs no column map; leave it out" in said


FILE = load_vehicle("ruvifist:survey")


def test_what_is_left_out_is_not_tried_and_all_else_is() -> None:
    whole = library(FILE.vehicle.configurations["survey"], FILE.vehicle.thrust_curve.lag_s)
    left = effects_without(["weak_thruster", "tether"], "survey", FILE)
    assert {effect.name for effect in whole} - {effect.name for effect in left} == {"weak_thruster", "tether"}


def test_an_effect_that_does_not_exist_is_refused_with_those_that_do() -> None:
    with pytest.raises(
        ConfigError, match=r"there is no effect 'kraken' to leave out; there are .*battery_sag"
    ):
        effects_without(["kraken"], "survey", FILE)
