"""`identify` and `validate` on real recordings of the telemetry contract, also where two methods disagree."""

import contextlib
import hashlib
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sketches
from pymavlink.dialects.v20.ardupilotmega import MAVLINK_MSG_ID_NAMED_VALUE_FLOAT
from soak import rest_in_soak

from bridge import exit_codes
from bridge.reports import read
from bridge.vehicle.coefficients import ADDED_MASS_NAMES, COEFFICIENTS
from bridge.vehicle.config import load_vehicle
from bridge.wire.framing import Encoder, decode
from bridge.wire.tlog import TlogWriter, read_tlog
from identify.dive import Dive, Signal
from identify.doubt import Outcome
from identify.identification import Identification, estimate
from tui import cli
from tui.commands import identify as command

ROOT = Path(__file__).resolve().parents[2]
DIVE = ROOT.parent / "shared" / "sealed" / "open_1" / "dive.tlog.gz"
ARDUSUB = ROOT.parent / "shared" / "data" / "ardusub_dives" / "2023-04-18.tlog"
VEHICLE = str(ROOT / "tests" / "data" / "vehicles" / "hovering.yaml")

needs_shared = pytest.mark.skipif(not DIVE.exists(), reason="needs ../shared/sealed beside the checkout")


def identify(*words):
    method = [] if "--method" in words else ["--method", "likelihood"]
    return cli.main(["identify", *map(str, words), *method, "--vehicle", VEHICLE])


@pytest.fixture(scope="module", params=rest_in_soak((180.0, 240.0)))
def minute(tmp_path_factory, request):
    """A minute of a dive, or two, as a `.tlog`."""
    return cut(tmp_path_factory.mktemp("dive") / "minute.tlog", 120.0, request.param)


def cut(path, start_s, end_s):
    first = None
    with TlogWriter(path) as writer:
        for stamp, frame in read_tlog(DIVE):
            first = first or stamp
            if (stamp - first) / 1e6 >= end_s:
                break
            if start_s <= (stamp - first) / 1e6:
                writer.write(stamp, frame.raw)
    return path


def answer(method, mass):
    values = (estimate("M_u", mass, 1.0, mass - 2, mass + 2), estimate("D_u", 50.0, 1.0, 48.0, 52.0))
    return Identification(
        method, Outcome.CONVERGED, values, "hovering", "dive-7", "1" * 64, load_vehicle(VEHICLE).vehicle.name, "0" * 64,
        100.0, 1000, np.eye(2), ("M_u", "D_u"),
    )  # fmt: skip


@pytest.fixture
def quick(monkeypatch):
    """Every estimator answers the same at once."""

    def estimator_of(name, *_):
        return lambda dive, *_: replace(answer(name, 100.0), dive=dive.name)

    monkeypatch.setattr(command, "estimator_of", estimator_of)


@pytest.mark.slow
@needs_shared
def test_the_json_of_one_dive_is_its_identification(minute, tmp_path, monkeypatch):
    # Its figures are rendered for the page; once more, for a paper, another test renders some.
    monkeypatch.setattr("identify.report.picture.write_files", sketches.write_files)
    out, page, param = (tmp_path / name for name in ("out.json", "report.html", "out.param"))
    drawn = tmp_path / "figures"
    targets = ("--json", out, "--report", page, "--param", param, "--figures", drawn)
    assert identify(minute, *targets) == exit_codes.DONE
    answer = json.loads(out.read_text(encoding="utf-8"))
    assert answer["method"] == "likelihood"
    assert answer["configuration"] == "hovering"
    by_name = {parameter["name"]: parameter for parameter in answer["parameters"]}
    assert {coefficient.name for coefficient in COEFFICIENTS} <= set(by_name)
    assert set(by_name) <= {coefficient.name for coefficient in COEFFICIENTS} | set(ADDED_MASS_NAMES)
    keys = {"name", "symbol", "value", "unit", "std", "low95", "high95", "identifiable"}
    assert all(keys <= set(parameter) for parameter in by_name.values())
    assert all(p["identifiable"] or p["reason"] for p in by_name.values())
    assert 90 < by_name["M_u"]["value"] < 130
    html = page.read_text(encoding="utf-8")
    assert html.startswith("<!DOCTYPE html>")
    assert (
        html.index("<h2>Provenance</h2>") < html.index(answer["dive"]["sha256"]) < html.index(">likelihood<")
    )
    assert len(html) < 1_500_000
    assert {path.suffix for path in drawn.iterdir()} == {".svg", ".png"}
    assert len(list(drawn.iterdir())) == 2 * html.count("<figure")
    assert "FF1_M_U," in param.read_text(encoding="utf-8")
    data = json.loads((tmp_path / "out.param.json").read_text(encoding="utf-8"))
    assert data["dive_sha256"] == answer["dive"]["sha256"]
    assert data["intervals"]["FF1_M_U"]["low95"] == by_name["M_u"]["given_thrust_low95"]


@needs_shared
@pytest.mark.usefixtures("quick")
def test_files_are_written_though_the_reader_of_the_table_leaves_at_its_first_line(
    minute, tmp_path, monkeypatch
):
    def left(*_words):
        raise BrokenPipeError

    drawn = []
    monkeypatch.setattr("tui.commands.identify.tell", left)
    monkeypatch.setattr("tui.files.Files.publish", lambda *words: drawn.append(words) or [])
    out = tmp_path / "out.json"
    with contextlib.suppress(BrokenPipeError, SystemExit):
        identify(minute, "--json", out, "--report", tmp_path / "report.html")
    assert json.loads(out.read_text(encoding="utf-8"))["method"] == "likelihood"
    assert drawn


@needs_shared
def test_the_answer_is_written_and_told_before_the_page_is_drawn(minute, tmp_path, monkeypatch, capfd):
    out, param = tmp_path / "out.json", tmp_path / "out.param"
    monkeypatch.setenv("SEATRIAL_PROGRESS", "json")
    seen = []

    def drawn(*_words):
        shown = capfd.readouterr()
        reports = [reports for line in shown.err.splitlines() if (reports := read(line)) is not None]
        seen.append((out.exists(), param.exists(), "95 % low" in shown.out, reports))
        return []

    monkeypatch.setattr("tui.files.Files.publish", drawn)
    assert (
        identify(minute, "--json", out, "--param", param, "--report", tmp_path / "x.html") == exit_codes.DONE
    )
    ((*there, reports),) = seen
    assert there == [True, True, True]
    assert [item.share for item in reports if item.answered] == [1.0]
    assert reports[-1].answered
    value = next(p["value"] for p in json.loads(out.read_text("utf-8"))["parameters"] if p["name"] == "M_u")
    assert reports[-1].values["M_u"][0] == pytest.approx(value, rel=1e-3)


@needs_shared
@pytest.mark.usefixtures("quick")
def test_several_dives_give_a_list_and_the_table_leaves_standard_output_to_it(minute, capsys):
    assert identify(minute, minute, "--json", "-") == exit_codes.DONE
    shown = capsys.readouterr()
    assert [load["dive"]["name"] for load in json.loads(shown.out)] == ["minute", "minute"]
    assert "95 % low" in shown.err


@needs_shared
def test_a_dive_of_three_seconds_says_why_nothing_can_be_identified(tmp_path, capsys):
    out = tmp_path / "out.json"
    assert identify(cut(tmp_path / "short.tlog", 120.0, 123.0), "--json", out) == exit_codes.NO
    data = json.loads(out.read_text(encoding="utf-8"))
    assert data["outcome"] == "not identifiable"
    names = [parameter["name"] for parameter in data["parameters"]]
    assert names == [*(coefficient.name for coefficient in COEFFICIENTS), *ADDED_MASS_NAMES]
    assert not any(parameter["identifiable"] for parameter in data["parameters"])
    assert all(parameter["reason"] for parameter in data["parameters"])
    shown = capsys.readouterr()
    assert "Traceback" not in shown.err
    title, reason, *_ = shown.out.splitlines()
    assert title == "short: likelihood, configuration hovering, not identifiable"
    assert (
        reason
        == data["parameters"][0]["reason"]
        == "the dive lasts 3 s, but identification needs at least 20 s; record a longer one"
    )
    assert "95 % low" not in shown.out


@needs_shared
def test_data_that_disagrees_with_the_model_is_a_no_whatever_was_identified(minute, tmp_path, capsys):
    out = tmp_path / "out.json"
    words = ["identify", str(minute), "--vehicle", "ruvifist:survey", "--method", "likelihood"]
    assert cli.main([*words, "--json", str(out)]) == exit_codes.NO
    data = json.loads(out.read_text(encoding="utf-8"))
    assert data["outcome"] == "data and model disagree"
    assert any("VEH_CFG 1" in doubt["sentence"] for doubt in data["doubts"])
    assert "warning: These values can hardly be this vehicle's" in capsys.readouterr().out


@pytest.mark.soak
@needs_shared
def test_two_methods_stand_side_by_side_in_json_table_and_page(minute, tmp_path, capsys):
    out, page = tmp_path / "out.json", tmp_path / "report.html"
    code = identify(
        minute, "--method", "likelihood+paper", "--network", 4, 1, 3, "--json", out, "--report", page
    )
    assert code == exit_codes.DONE
    data = json.loads(out.read_text(encoding="utf-8"))
    assert data["method"] == "likelihood"
    assert data["comparison"]["method"] == "paper"
    assert {"difference_in_std", "disagrees", "value"} <= set(data["comparison"]["parameters"][0])
    assert "likelihood beside paper (converged)" in capsys.readouterr().out
    assert "Likelihood beside paper: minute" in page.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("method", "words"),
    [
        ("likelyhood", "no such method as 'likelyhood'"),
        ("likelihood+", "no such method as ''"),
        ("likelihood+likelihood", "two different ones"),
    ],
)
def test_a_method_that_there_is_not_is_told_before_anything_is_read(method, words, capsys):
    code = cli.main(["identify", "no-such-dive", "--vehicle", VEHICLE, "--method", method])
    assert code == exit_codes.BAD_INPUT
    assert words in " ".join(capsys.readouterr().err.split())


@needs_shared
def test_a_dive_without_velocity_says_what_can_not_be_identified(capsys):
    code = cli.main(["identify", str(ARDUSUB), "--vehicle", "bluerov2_heavy"])
    assert code == exit_codes.NO
    shown = capsys.readouterr().out
    assert "There is no velocity to go by" in shown
    assert "no, see" not in shown


@needs_shared
def test_validate_shows_dives_in_the_order_of_their_modes(tmp_path, capsys):
    short = cut(tmp_path / "short.tlog", 120.0, 150.0)
    files = {mode: in_mode(short, tmp_path / f"{mode}.tlog", mode) for mode in (3, 1, 0, 2)}
    assert (
        cli.main(["validate", *map(str, files.values()), "--vehicle", VEHICLE, "--json", "-"])
        == exit_codes.DONE
    )
    shown = capsys.readouterr()
    assert [run["run"] for run in json.loads(shown.out)] == ["off", "shadow", "ff", "both"]
    (heading,) = (line for line in shown.err.splitlines() if line.startswith("motion"))
    assert heading.split() == ["motion", "phase", "off", "shadow", "ff", "both"]


@needs_shared
def test_validate_tells_whether_the_feed_forward_may_be_raised(minute, tmp_path, capsys):
    path = in_mode(minute, tmp_path / "shadow.tlog", 1)
    cli.main(["validate", str(path), "--vehicle", VEHICLE, "--json", "-"])
    shown = capsys.readouterr()
    (run,) = json.loads(shown.out)
    assert (run["raising"]["from"], run["raising"]["to"]) == ("shadow", "both")
    err = " ".join(shown.err.split())
    verdict = err.index(f"shadow: {run['raising']['sentence']}")
    assert all(f"{item['what']}: {item['words']}" in err for item in run["raising"]["criteria"])
    assert err.startswith("'shadow' errs, mean absolute: ")
    assert verdict < err.index("rms over the whole mission of") < err.index("mean absolute error by phase")


@needs_shared
@pytest.mark.usefixtures("sketched")
def test_validate_writes_a_page_that_begins_with_which_mode_errs_least(minute, tmp_path, capsys):
    files = [in_mode(minute, tmp_path / f"{mode}.tlog", mode) for mode in (0, 3)]
    page, drawn = tmp_path / "page.html", tmp_path / "figures"
    line = ("validate", *files, "--vehicle", VEHICLE, "--report", page, "--figures", drawn)
    assert cli.main([str(word) for word in line]) == exit_codes.DONE
    html = page.read_text(encoding="utf-8")
    assert re.search(r'class="verdict">[^<]*errs least, mean absolute: ', html)
    assert html.index("</h2>") < html.index("<h2>Provenance</h2>")
    assert all(sha in html for sha in (hashlib.sha256(file.read_bytes()).hexdigest() for file in files))
    assert (drawn / "errors-in-surge-by-phase.svg").is_file() or (
        drawn / "errors-in-yaw-by-phase.svg"
    ).is_file()
    output = " ".join(capsys.readouterr().out.split())
    assert f"report: {page}" in output
    assert "each as SVG and PNG" in output


def in_mode(source, path, mode):
    """A recording as it would be had the feed-forward been in this mode."""
    encoder = Encoder(1, 1)
    with TlogWriter(path) as writer:
        for stamp, frame in read_tlog(source):
            message = decode(frame) if frame.message_id == MAVLINK_MSG_ID_NAMED_VALUE_FLOAT else None
            if message is not None and message.name == "FF_MODE":
                message.value = float(mode)
                writer.write(stamp, encoder.encode(message))
            else:
                writer.write(stamp, frame.raw)
    return path


@needs_shared
@pytest.mark.parametrize(("short", "why"), [(True, "nothing to compare"), (False, "no reference")])
def test_validate_of_a_dive_with_nothing_to_compare_is_a_no_with_a_sentence(tmp_path, capsys, short, why):
    path = cut(tmp_path / "short.tlog", 120.0, 120.04) if short else ARDUSUB
    vehicle = VEHICLE if short else "bluerov2_heavy"
    assert cli.main(["validate", str(path), "--vehicle", vehicle]) == exit_codes.NO
    shown = capsys.readouterr()
    assert why in shown.err
    assert shown.out == ""


def test_validate_says_which_speed_was_not_measured_where_the_reference_moved(monkeypatch, tmp_path, capsys):
    time_s = np.arange(0.0, 60.0, 0.05)
    reference = np.zeros((len(time_s), 14))
    reference[200:800, 0] = 0.4
    still, unlocked = np.zeros((len(time_s), 3)), np.full((len(time_s), 3), np.nan)
    dive = Dive(
        "dive-7",
        tmp_path / "dive.tlog",
        "1" * 64,
        velocity=Signal(time_s, unlocked),
        gyro=Signal(time_s, still),
        nu_ref=Signal(time_s, reference),
    )
    monkeypatch.setattr("tui.commands.validate.read_dive", lambda *_: dive)
    assert cli.main(["validate", "dive", "--vehicle", VEHICLE]) == exit_codes.NO
    assert " ".join(capsys.readouterr().err.split()) == (
        "dive-7: its reference (NU_REF) moves in surge, where no speed is measured, so nothing to compare; record "
        "the DVL for surge and sway, a gyro for yaw"
    )


@pytest.mark.parametrize(("mass", "disagrees"), [(110.0, True), (100.5, False)])
def test_a_disagreement_of_two_methods_is_a_no_and_told_once_in_terminal_and_page(
    mass, disagrees, monkeypatch, tmp_path, capsys
):
    masses, dive = {"likelihood": 100.0, "pinn": mass}, Dive("dive-7", tmp_path / "dive.tlog", "1" * 64)
    monkeypatch.setattr("identify.run.recordings.read_dive", lambda *_: dive)
    monkeypatch.setattr(command, "estimator_of", lambda name, *_: lambda *_: answer(name, masses[name]))
    page, out = tmp_path / "page.html", tmp_path / "out.json"
    words = ["identify", "dive", "--vehicle", VEHICLE, "--json", str(out), "--report", str(page)]
    assert cli.main(words) == (exit_codes.NO if disagrees else exit_codes.DONE)
    data = json.loads(out.read_text(encoding="utf-8"))
    assert (data["outcome"] == "data and model disagree") == disagrees
    assert [(doubt["about"], doubt["sentence"]) for doubt in data["doubts"]] == (
        [(["M_u"], data["comparison"]["sentences"][0])] if disagrees else []
    )
    assert capsys.readouterr().out.count("On M_u two methods disagree") == disagrees
    assert page.read_text(encoding="utf-8").count("On M_u two methods disagree") == disagrees


def test_the_table_shows_the_interval_with_the_thrust_s_doubt_and_beside_it_the_error_given_the_thrust():
    mass = replace(estimate("M_u", 100.0, 1.0, 98.06, 101.98), scale_std=10.0)
    assert command._row(mass, [], False)[:6] == ("M_u", "100.0", "82.12", "121.8", "kg", "1.0")
    alone = replace(mass, scale_std=0.0)
    assert command._row(alone, [], False)[:6] == ("M_u", "100.0", "98.06", "102.0", "kg", "1.0")


@pytest.mark.parametrize(("scale_std", "column"), [(10.0, "std given thrust, %"), (0.0, "std, %")])
def test_the_table_fits_a_terminal_of_eighty_columns_and_names_its_error(scale_std, column, monkeypatch):
    shown = []
    monkeypatch.setattr(command.show, "put", lambda _, table: shown.append(table))
    mass = replace(estimate("M_u", 100.0, 1.0, 98.06, 101.98), scale_std=scale_std)
    damping = estimate("D_r", 0.5674, 0.01, 0.5422, 0.5871)
    result = replace(answer("likelihood", 100.0), parameters=(mass, damping))
    command.tell(command.show.words(), Dive("dive-7", Path("dive.tlog"), "1" * 64), result)
    (table,) = shown
    assert column in table.columns
    widest = [max(map(len, cells)) for cells in zip(*table.rows, strict=True)]
    assert sum(widest) + 2 * (len(widest) - 1) <= 80
