"""`identify` where two methods disagree: a doubt like any other, told once, that the exit code and `params` know of."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bridge.errors import FitError
from bridge.vehicle.config import load_vehicle
from identify.dive import Dive
from identify.identification import Identification, Outcome, estimate
from tui import cli, exit_codes
from tui.commands import identify as command
from tui.exit_codes import UsageError
from tui.parameter_files import Leave, targets_of_identification

VEHICLE = str(Path(__file__).resolve().parents[1] / "data" / "vehicles" / "hovering.yaml")
NAMES = ("M_u", "D_u")
ENDS = {"likelihood": "", "pinn": "the network has settled: the loss fell no more"}


def answer(method, mass):
    values = (estimate("M_u", mass, 1.0, mass - 2, mass + 2), estimate("D_u", 50.0, 1.0, 48.0, 52.0))
    return Identification(
        method, Outcome.CONVERGED, values, "hovering", "dive-7", "1" * 64, "hovering", "0" * 64, 100.0, 1000,
        np.eye(2), NAMES,
    )  # fmt: skip


@pytest.fixture
def identified(monkeypatch, tmp_path):
    """Runs `identify` with two made-up methods, the second saying that `mass`; gives its exit code and its JSON."""
    monkeypatch.setattr(
        "identify.run.recordings.read_dive", lambda *_: Dive("dive-7", tmp_path / "dive.tlog", "1" * 64)
    )

    def run(mass, *words):
        masses = {"likelihood": 100.0, "pinn": mass}
        vehicle = load_vehicle(VEHICLE).vehicle.name

        def estimator_of(name, *_):
            def estimate(*given):
                given[-1](1.0, ENDS[name])
                return replace(answer(name, masses[name]), vehicle=vehicle)

            return estimate

        monkeypatch.setattr(command, "estimator_of", estimator_of)
        out = tmp_path / "out.json"
        code = cli.main(["identify", "dive", "--vehicle", VEHICLE, "--json", str(out), *map(str, words)])
        return code, out

    return run


def test_a_disagreement_is_a_no_and_told_once_in_terminal_and_page(identified, tmp_path, capsys):
    page = tmp_path / "page.html"
    code, out = identified(110.0, "--report", page)
    found = json.loads(out.read_text(encoding="utf-8"))
    assert code == exit_codes.NO
    assert found["outcome"] == "data and model disagree"
    (doubt,) = found["doubts"]
    assert doubt["about"] == ["M_u"]
    assert doubt["sentence"] == found["comparison"]["sentences"][0]
    assert capsys.readouterr().out.count("On M_u two methods disagree") == 1
    assert page.read_text(encoding="utf-8").count("On M_u two methods disagree") == 1


def test_an_upload_refuses_it_until_it_is_taken_despite_its_doubts(identified):
    _, out = identified(110.0)
    with pytest.raises(UsageError, match="data and model disagree"):
        targets_of_identification(out, VEHICLE, Leave())
    targets = targets_of_identification(out, VEHICLE, Leave(doubts=True))
    assert 100.0 in targets.values.values()
    assert any("two methods disagree" in note for note in targets.notes)


@pytest.mark.usefixtures("identified")
def test_a_second_method_that_gives_nothing_says_why_in_terminal_and_page(monkeypatch, tmp_path, capsys):
    def estimator_of(name, *_):
        def estimate(*_given):
            if name == "pinn":
                raise FitError("no network settles on 3 s; dive longer", of="dive-7")
            return answer("likelihood", 100.0)

        return estimate

    monkeypatch.setattr(command, "estimator_of", estimator_of)
    page = tmp_path / "page.html"
    words = ["identify", "dive", "--vehicle", VEHICLE, "--report", str(page)]
    assert cli.main(words) == exit_codes.DONE
    shown = " ".join(capsys.readouterr().out.split())
    assert "Pinn ended with 'not identifiable'." in shown
    assert shown.count("Pinn gives nothing: no network settles on 3 s; dive longer") == 1
    assert "Pinn gives nothing: no network settles" in page.read_text(encoding="utf-8")


def test_two_that_agree_are_done(identified):
    code, out = identified(100.5)
    assert code == exit_codes.DONE
    assert json.loads(out.read_text(encoding="utf-8"))["doubts"] == []


def test_why_training_stopped_is_a_note_on_the_page_and_in_the_json(identified, tmp_path):
    page = tmp_path / "page.html"
    _, out = identified(100.5, "--report", page)
    found = json.loads(out.read_text(encoding="utf-8"))
    told = "The network has settled: the loss fell no more."
    assert told in page.read_text(encoding="utf-8")
    assert told in found["comparison"]["notes"]
    assert found["notes"] == []
