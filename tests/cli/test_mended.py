"""A weak thruster from the dive to the mended vehicle, by the verbs alone: foretold, flown, held against it."""

import json
import shutil

import pytest

from bridge import exit_codes
from bridge.onboard.parameters import parameters_of
from bridge.vehicle.config import CONFIGS, load_vehicle
from gcs_plugin import simulated
from tui import cli

WEAK_IN_THE_WATER = "disturbance_time_s: 1.5\n  effects: {T1_gain: 0.8}"
WEAK_ON_BOARD = "[0.42, -0.32, 0.0], gain: 0.8}"


def vehicle(folder, name, *, in_the_water=False, on_board=False):
    """A copy of the simulated vehicle: its first thruster weak in the water alone, or as its own file knows, too."""
    path, shipped = folder / f"{name}.yaml", CONFIGS / "vehicles" / "ruvifist.yaml"
    text = shipped.read_text(encoding="utf-8")
    path.write_text(
        text.replace("[0.42, -0.32, 0.0]}", WEAK_ON_BOARD) if on_board else text, encoding="utf-8"
    )
    truth = shipped.with_suffix(".truth.yaml").read_text(encoding="utf-8")
    truth = truth.replace("disturbance_time_s: 1.5", WEAK_IN_THE_WATER) if in_the_water else truth
    path.with_suffix(".truth.yaml").write_text(truth, encoding="utf-8")
    return path


class Crew:
    """Types the verbs, with a vehicle that keeps its parameters in `memory.json`."""

    def __init__(self, folder, file, monkeypatch, capsys):
        self.folder, self.file, self.patch, self.capsys = folder, file, monkeypatch, capsys
        self.memory = folder / "memory.json"

    def type(self, *words, code=exit_codes.DONE):
        self.capsys.readouterr()
        assert cli.main([str(word) for word in words]) == code
        shown = self.capsys.readouterr()
        return " ".join((shown.out + shown.err).split())

    def dive(self, mode, seed):
        report = self.folder / "dived.json"
        line = ("simulate", "--vehicle", f"{self.file}:hovering", "--mission", "validation", "--mode", mode)
        places = ("--out", self.folder / "dives", "--parameters", self.memory, "--json", report)
        self.type(*line, "--seed", seed, *places)
        return json.loads(report.read_text(encoding="utf-8"))["folder"]

    def upload(self, source, *more, code=exit_codes.DONE):
        file = load_vehicle(str(self.file))
        link, clock = simulated.afloat(file, "hovering", 5, parameters_of(file, self.memory))
        with self.patch.context() as patch:
            patch.setattr("bridge.links.open.open_link", lambda _: link)
            patch.setattr("bridge.clock.SystemClock", lambda: clock)
            line = ("params", "upload", source, "--yes", "--link", "any", "--despite-doubts")
            return self.type(*line, "--receipts", self.folder / "receipts", *more, code=code)

    def validate(self, *dives):
        report = self.folder / "validation.json"
        line = ("validate", *dives, "--vehicle", self.file, "--receipts", self.folder / "receipts")
        said = self.type(*line, "--json", report)
        return json.loads(report.read_text(encoding="utf-8")), said


@pytest.mark.soak
def test_a_weak_thruster_is_diagnosed_accepted_flown_and_comes_as_foretold(tmp_path, monkeypatch, capsys):
    crew = Crew(tmp_path, vehicle(tmp_path, "own"), monkeypatch, capsys)
    hull, mended = tmp_path / "first.param", tmp_path / "mended.param"
    first = crew.dive("off", 1)
    crew.type(
        "identify", first, "--vehicle", f"{crew.file}:hovering", "--method", "likelihood", "--param", hull
    )
    crew.upload(hull)
    vehicle(tmp_path, "own", in_the_water=True)  # now its first thruster breaks
    before = crew.dive("ff", 2)
    ((run,), _) = crew.validate(before)
    assert not run["raising"]["go"]
    assert "yaw moves unasked" in run["raising"]["sentence"]
    said = crew.type("diagnose", before, "--vehicle", f"{crew.file}:hovering", "--accept", mended)
    assert "foretold for the next dive in ff, rms over the whole mission: surge 1" in said
    crew.upload(mended, "--vehicle", crew.file)
    ((old, alone, both), said) = crew.validate(before, crew.dive("ff", 12), crew.dive("both", 13))
    assert old["foretold"] == []
    assert "As foretold: surge 1" in said
    for run in (alone, both):
        assert run["raising"]["go"], run["raising"]["sentence"]
        assert [held["axis"] for held in run["foretold"]] == ["surge", "sway", "yaw"]
        for held in run["foretold"]:
            assert held["before"] > 2 * held["after"]
            assert held["flown_now"] == pytest.approx(held["after"], rel=1 / 3)


@pytest.mark.soak
def test_made_up_for_on_board_and_accepted_again_it_is_refused_and_forced_it_is_no_go(
    tmp_path, monkeypatch, capsys
):
    crew = Crew(tmp_path, vehicle(tmp_path, "weak", on_board=True), monkeypatch, capsys)
    unaware, twice = vehicle(tmp_path, "unaware"), tmp_path / "twice.param"
    first = crew.dive("off", 1)
    said = crew.type("diagnose", first, "--vehicle", f"{unaware}:hovering", "--accept", twice)
    assert (
        "thruster 1: in this dive the vehicle asked it as if it gave 80 % of its curve already, by itself"
        in said
    )
    for known in ((), ("--vehicle", crew.file)):
        said = crew.upload(twice, *known, code=exit_codes.NO)
        assert "FF1_T1_GAIN: thruster 1 is made up for already" in said
        assert "nothing was sent" in said
    crew.upload(twice, "--accept-implausible", "FF1_T1_GAIN")
    (runs, _) = crew.validate(crew.dive("ff", 12), crew.dive("both", 13))
    for run in runs:
        assert not run["raising"]["go"]
        assert "yaw moves unasked" in run["raising"]["sentence"]
        assert "thruster 1 made up for twice" in run["raising"]["sentence"]
    shutil.rmtree(tmp_path / "receipts")  # also without a word on what was accepted
    ((run, _), _) = crew.validate(*sorted((tmp_path / "dives").glob("*-[ab]*")))
    assert not run["raising"]["go"]
