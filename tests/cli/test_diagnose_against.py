"""`seatrial diagnose REAL --against SIM`: what it reads, refuses, says and writes."""

import json
import math
from pathlib import Path

import pytest

from identify.challenge.case import Case, check_of, dive_of, draw_case
from identify.challenge.seal import tlog_of
from identify.diagnose import against as compared_by
from identify.diagnose.candidates import Cause
from identify.diagnose.result import Accepted, Diagnosis, Finding, Gap
from identify.effects.library import library
from tui import cli, exit_codes

NOTHING = Gap(math.nan, (), (), {}, (), (), ())


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> tuple[Case, Path]:
    """A vehicle with a real dive and a simulator's, both of 20 s."""
    case, folder = draw_case(150051, names=[], seconds=20.0), tmp_path_factory.mktemp("pair")
    (folder / "vehicle.yaml").write_text(case.vehicle.text, encoding="utf-8")
    (folder / "real.tlog").write_bytes(tlog_of(dive_of(case)))
    (folder / "sim.tlog").write_bytes(tlog_of(check_of(case)))
    return case, folder


def diagnose(folder: Path, *words: object) -> int:
    real, sim, vehicle = folder / "real.tlog", folder / "sim.tlog", folder / "vehicle.yaml"
    return cli.main(["diagnose", *map(str, (real, "--against", sim, "--vehicle", vehicle)), *map(str, words)])


def test_screen_json_and_page_say_what_the_simulator_must_gain(
    files: tuple[Case, Path],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
):
    case, folder = files
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
    assert diagnose(folder, "--report", page, "--json", data) == exit_codes.DONE
    assert asked == [("sim", case.configuration, False), ("real", case.configuration, True)]
    assert "Your simulator must gain dead zone" in " ".join(capsys.readouterr().out.split())
    assert "Your simulator must gain dead zone" in page.read_text(encoding="utf-8")
    assert json.loads(data.read_text())["against"]["lacks"] == ["dead_zone"]


@pytest.mark.parametrize("option", ["--check", "--predict", "--accept"])
def test_what_tells_of_the_vehicle_alone_is_refused_beside_a_simulator(
    files: tuple[Case, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str], option: str
):
    assert diagnose(files[1], option, tmp_path / "other.param") == exit_codes.BAD_INPUT
    assert f"{option} tells of the vehicle, --against of a simulator" in capsys.readouterr().err


def test_a_page_never_takes_the_place_of_the_simulator_s_recording(
    files: tuple[Case, Path], capsys: pytest.CaptureFixture[str]
):
    sim = files[1] / "sim.tlog"
    before = sim.read_bytes()
    assert diagnose(files[1], "--report", sim) == exit_codes.BAD_INPUT
    assert sim.read_bytes() == before
    assert "sim.tlog" in capsys.readouterr().err


def test_twenty_seconds_are_too_short(files: tuple[Case, Path], capsys: pytest.CaptureFixture[str]):
    assert diagnose(files[1]) == exit_codes.NO
    assert "too short to tell one cause from another" in " ".join(capsys.readouterr().err.split())
