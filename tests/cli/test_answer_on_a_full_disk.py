"""A verb whose files find no room: it answers all the same, writes the others, and names each that it could not."""

import asyncio
import json
import shutil
import subprocess
import sys

import pytest
from full_disk import fill

from bridge import exit_codes
from bridge.reports import UNKEPT
from bridge.vehicle.config import load_vehicle
from identify.challenge.case import dive_of, draw_case
from identify.challenge.tlog import tlog_of
from identify.estimators.table import estimator
from identify.ingest.open import read_dive
from identify.report.page import Report
from tui import cli
from tui.app.jobs import work
from tui.commands import validate

CASE = draw_case(300_001, kind="none", seconds=30.0)
EACH = ("a.json", "okp.param", "okp.html")


@pytest.fixture(scope="module")
def dive(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dive")
    (folder / "dive.tlog").write_bytes(tlog_of(dive_of(CASE)))
    (folder / "vehicle.yaml").write_text(CASE.vehicle.text, encoding="utf-8")
    return folder / "dive.tlog"


@pytest.fixture
def full(tmp_path, monkeypatch):
    """A folder on a full disk."""
    place = tmp_path / "full"
    place.mkdir()
    fill(monkeypatch, place)
    return place


def verb(name, dive, *words):
    vehicle = f"{dive.with_name('vehicle.yaml')}:{CASE.configuration}"
    return cli.main([name, str(dive), *map(str, words), "--vehicle", vehicle])


@pytest.fixture(scope="module")
def fit(dive):
    """The dive identified by the likelihood."""
    file = load_vehicle(f"{dive.with_name('vehicle.yaml')}:{CASE.configuration}")
    return estimator("likelihood")(read_dive(dive, None, file), file, CASE.configuration, lambda *_: None)


@pytest.mark.parametrize("unwritten", [{"a.json"}, {"okp.param"}, {"okp.html"}, set(EACH)])
def test_identify_shows_its_values_and_writes_what_it_can(
    unwritten, dive, fit, full, tmp_path, monkeypatch, capsys
):
    monkeypatch.setattr("tui.commands.identify.estimator_of", lambda *_: lambda *_: fit)
    monkeypatch.setattr("tui.commands.identify.page_of", lambda *_: Report("d", "v", "m", ()))
    at = {name: (full if name in unwritten else tmp_path) / name for name in EACH}
    options = zip(("--json", "--param", "--report"), at.values(), strict=True)
    code = verb("identify", dive, "--method", "likelihood", *(word for both in options for word in both))
    assert code == exit_codes.BAD_INPUT
    output = capsys.readouterr()
    assert "95 % low" in output.out
    assert "M_u" in output.out
    assert {name for name, path in at.items() if not path.exists()} == unwritten
    assert [*full.iterdir()] == []
    said = [line for line in output.err.splitlines() if line.startswith("seatrial: ")]
    # The sidecar is written before its parameter file.
    tried = {name: f"{path}.json" if name == "okp.param" else str(path) for name, path in at.items()}
    assert [line.split(":")[1].strip() for line in said] == [
        tried[name] for name in EACH if name in unwritten
    ]
    assert all("can't be written (No space left on device)" in line for line in said)


def test_parameters_whose_sidecar_finds_no_room_are_not_left_without_it(
    dive, fit, tmp_path, monkeypatch, capsys
):
    monkeypatch.setattr("tui.commands.identify.estimator_of", lambda *_: lambda *_: fit)
    param = tmp_path / "okp.param"
    fill(monkeypatch, tmp_path, ".param.json")
    assert verb("identify", dive, "--method", "likelihood", "--param", param) == exit_codes.BAD_INPUT
    assert f"{param}.json: can't be written" in capsys.readouterr().err
    assert not param.exists()


def test_validate_shows_its_errors_and_writes_its_page(dive, full, tmp_path, capsys):
    page = tmp_path / "page.html"
    assert verb("validate", dive, "--json", full / "v.json", "--report", page) == exit_codes.BAD_INPUT
    output = capsys.readouterr()
    assert "mean absolute error by phase" in output.out
    assert f"{full / 'v.json'}: the JSON can't be written" in output.err
    assert page.exists()


def test_validate_writes_its_files_though_the_reader_of_the_tables_leaves_at_their_first_line(
    dive, tmp_path, monkeypatch
):
    def left(*_words):
        raise BrokenPipeError

    monkeypatch.setattr("tui.show.put", left)
    places = ("--json", str(tmp_path / "v.json"), "--report", str(tmp_path / "page.html"))
    line = (str(dive), "--vehicle", f"{dive.with_name('vehicle.yaml')}:{CASE.configuration}", *places)
    with pytest.raises(BrokenPipeError):
        validate.run(cli.verb_parser("validate").parse_args(line))
    assert {path.name for path in tmp_path.iterdir()} >= {"v.json", "page.html"}


def test_plan_shows_what_to_dive_and_names_no_mission_that_is_not_there(full, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("identify.planning.propose.PERIODS_S", (4.0,))
    words = ("--vehicle", "ruvifist:hovering", "--axes", "yaw", "--minutes", "1")
    places = ("--out", full / "plan.yaml", "--json", tmp_path / "plan.json")
    assert cli.main(["plan", *words, *map(str, places)]) == exit_codes.BAD_INPUT
    output = capsys.readouterr()
    assert "yaw: square wave" in output.out
    assert "by hand: " not in output.out
    assert "plan.yaml: can't be written (No space left on device)" in output.err
    assert json.loads((tmp_path / "plan.json").read_text("utf-8"))["mission"] is None


@pytest.mark.skipif(sys.platform == "win32" or not shutil.which("sh"), reason="files are limited by a shell")
def test_who_waits_for_a_verb_has_its_result_though_no_file_of_it_can_grow(dive, tmp_path, monkeypatch):
    start, heard = subprocess.Popen, []

    def limited(words, **options):
        return start(["sh", "-c", 'ulimit -f 0; exec "$@"', "sh", *words], **options)

    monkeypatch.setattr("gcs_plugin.job.subprocess.Popen", limited)
    result = tmp_path / "held.json"
    done = asyncio.run(work(("import", str(dive), "--json", str(result)), heard.append, lambda: 0))
    (unkept,) = (report for report in heard if report.of == UNKEPT)
    assert (done.code, done.result) == (exit_codes.BAD_INPUT, None)
    assert not result.exists()
    assert "pressure" in [signal["name"] for signal in unkept.result["signals"]]
    assert done.errors == (unkept.words,)
