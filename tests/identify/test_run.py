"""`identify` as a plain function: one answer of several methods, and typed steps on the way to it."""

from pathlib import Path
from types import SimpleNamespace

import fitted
import numpy as np

from bridge.errors import FitError
from bridge.vehicle.config import load_vehicle
from identify.dive import Dive
from identify.estimators import information
from identify.identification import Outcome
from identify.run import ANSWERED, compiles_first, identify, usual_methods

FILE = load_vehicle(str(Path(__file__).resolve().parents[1] / "data" / "vehicles" / "hovering.yaml"))
DIVE = Dive("dive-7", Path("dive.tlog"), "1" * 64)


def method(mass, ends="done"):
    """An estimator that finds this mass in surge, and reports half way and at its end."""

    def estimate(*given):
        progress = given[-1]
        progress(0.5, "climbing")
        progress(1.0, ends)
        return fitted.fit({"M_u": mass, "D_u": 50.0}, 1e-4 * np.eye(2), method="made")

    return estimate


def refuses(dive, *_):
    raise FitError("no thruster pushed", of=dive.name)


def test_the_first_method_answers_and_a_second_that_disagrees_casts_a_doubt():
    found = identify(DIVE, FILE, "hovering", {"a": method(100.0), "b": method(150.0)})
    assert found.answer["M_u"].value == 100.0
    assert found.answer.outcome is Outcome.DISAGREES
    assert [doubt.about for doubt in found.answer.doubts] == [("M_u",)]
    (comparison,) = found.comparisons
    assert comparison.second["M_u"].value == 150.0


def test_a_single_method_is_compared_with_none():
    found = identify(DIVE, FILE, "hovering", {"a": method(100.0)})
    assert (found.comparisons, found.answer.outcome) == ((), Outcome.CONVERGED)


def test_every_method_reports_its_steps_and_at_last_its_values():
    steps = []
    identify(DIVE, FILE, "hovering", {"a": method(100.0, "the loss fell no more")}, steps.append)
    assert [(step.method, step.share, step.answered) for step in steps] == [
        ("a", 0.5, False), ("a", 0.99, False), ("a", 1.0, True),
    ]  # fmt: skip
    assert steps[-1].words == ANSWERED
    assert steps[-1].values["M_u"][0] == 100.0


def test_how_a_method_ended_is_a_note_unless_it_is_only_done():
    ended = identify(DIVE, FILE, "hovering", {"a": method(100.0, "the loss fell no more")}).answer
    done = identify(DIVE, FILE, "hovering", {"a": method(100.0)}).answer
    assert "The loss fell no more." in ended.notes
    assert len(ended.notes) == len(done.notes) + 1


def test_a_dive_that_tells_nothing_gives_an_answer_with_the_reason_once():
    answer = identify(DIVE, FILE, "hovering", {"a": refuses}).answer
    assert answer.outcome is Outcome.NOT_IDENTIFIABLE
    assert answer.values() == {}
    assert answer["M_u"].reason == "no thruster pushed"


def test_the_methods_suit_the_damping_of_the_hull():
    assert usual_methods(FILE, ["hovering"]) == ("likelihood", "pinn")


def test_the_first_run_compiles_and_later_ones_find_what_it_kept(tmp_path, monkeypatch):
    kernel = SimpleNamespace(__module__="identify.estimators.information")
    kept = SimpleNamespace(stats=SimpleNamespace(cache_path=str(tmp_path)), py_func=kernel)
    monkeypatch.setattr(information, "gradient_and_information", kept)
    assert compiles_first()
    (tmp_path / "information.gradient_and_information-50.py311.nbi").write_bytes(b"")
    assert not compiles_first()
