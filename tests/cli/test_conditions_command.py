"""`seatrial conditions`, and their use by `identify` and `diagnose`."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from bridge.errors import FitError
from bridge.vehicle.config import load_vehicle
from gcs_plugin.dives.conditions import NOTHING_SAID, Conditions
from gcs_plugin.dives.folder import DiveFolder, about_vehicle
from identify.dive import Dive
from tui import cli
from tui.recordings import recording_at, ruled_out

SEA = Conditions(water_temperature_c=11.5, salinity=35.0)


@pytest.fixture
def dive(tmp_path, monkeypatch):
    """A dive, the one before which was made in the sea; the folder above is where the command runs."""
    monkeypatch.chdir(tmp_path)
    for name, conditions in (("2026-11-19T0900Z", SEA), ("2026-11-20T0900Z", NOTHING_SAID)):
        folder = DiveFolder(Path("dives", name))
        folder.path.mkdir(parents=True)
        folder.open_telemetry(1).close()
        folder.describe(about_vehicle(load_vehicle("ruvifist"), "hovering"))
        folder.set_conditions(conditions)
    return folder


def test_a_dive_of_which_nothing_is_known_shows_what_held_before(dive, capsys):
    assert cli.main(["conditions", str(dive.path)]) == 0
    words = capsys.readouterr().out
    assert "no conditions are noted" in words
    assert "in the dive before: water 11.5 °C, salinity 35; --same takes that" in words
    assert dive.about().conditions == NOTHING_SAID


def test_the_same_is_taken_but_for_what_is_given(dive, capsys):
    assert cli.main(["conditions", "--same", "--salinity", "0", "--ballast", "-1.5"]) == 0
    assert dive.about().conditions == Conditions(11.5, 0.0, None, -1.5)
    assert dive.about().configuration == "hovering"
    assert "water of 999.6 kg/m3" in capsys.readouterr().out


def test_where_no_dive_before_has_any_what_is_noted_stays(dive, capsys):
    first = dive.path.with_name("2026-11-19T0900Z")
    assert cli.main(["conditions", str(first), "--same"]) == 2
    assert f"--same: no dive before {first} has any" in capsys.readouterr().err
    assert DiveFolder(first).about().conditions == SEA


def test_what_is_given_is_put_in_and_an_empty_text_takes_it_back(dive):
    assert cli.main(["conditions", "--weather", "calm", "--tether-out", "30"]) == 0
    assert cli.main(["conditions", "--weather", "", "--payload", "sonar", "--payload-mass", "1"]) == 0
    assert dive.about().conditions == Conditions(tether_out_m=30.0, payload_kg=1.0, payload="sonar")


def test_json_has_them_with_the_density(dive, capsys):
    assert cli.main(["conditions", str(dive.path.with_name("2026-11-19T0900Z")), "--json", "-"]) == 0
    output = json.loads(capsys.readouterr().out)
    assert output["salinity"] == 35.0
    assert output["ballast_kg"] is None
    assert output["density_kg_m3"] == pytest.approx(1026.684, abs=1e-3)


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["nowhere"], "nowhere: no such dive folder"),
        (["--salinity", "much"], "--salinity: 'much' is no number"),
        (["--water-temperature", "90"], "--water-temperature: must lie from -2 to 40 °C"),
    ],
)
@pytest.mark.usefixtures("dive")
def test_mistakes_are_named(words, sentence, capsys):
    assert cli.main(["conditions", *words]) == 2
    assert sentence in capsys.readouterr().err


def test_without_a_dive_it_says_so(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["conditions"]) == 2
    assert "no recording runs, and dives holds none" in capsys.readouterr().err


def with_model(file, **model):
    shapes = {name: replace(shape, model=model) for name, shape in file.vehicle.configurations.items()}
    return replace(file, vehicle=replace(file.vehicle, configurations=shapes))


def test_the_vehicle_file_takes_water_and_mass_of_the_dive(dive):
    filed = with_model(load_vehicle("ruvifist"), M_u=100.0, M_w=180.0, I_r=20.0, D_u=50.0)
    dive.set_conditions(Conditions(11.5, 35.0, ballast_kg=3.0, payload_kg=-1.0))
    file, sentences = recording_at(dive.path).under_conditions(filed)
    assert file.vehicle.water.density_kg_m3 == pytest.approx(1026.684, abs=1e-3)
    shape, before = file.vehicle.configurations["hovering"], filed.vehicle.configurations["hovering"]
    assert shape.dry_mass_kg == before.dry_mass_kg + 2.0
    assert shape.model == {"M_u": 102.0, "M_w": 182.0, "I_r": 20.0, "D_u": 50.0}
    assert (file.sha256, file.vehicle.name) == (filed.sha256, filed.vehicle.name)
    assert sentences == (
        "2026-11-20T0900Z: water of 1026.7 kg/m3 by the dive's temperature and salinity, not the vehicle file's 998.2",
        "2026-11-20T0900Z: +2 kg of ballast and payload on top of the vehicle file's dry mass",
    )


def test_a_recording_in_a_dive_folder_has_its_conditions_and_another_none(dive, tmp_path):
    filed = load_vehicle("ruvifist")
    dive.set_conditions(SEA)
    assert (
        recording_at(dive.path / "telemetry.tlog").under_conditions(filed)[0].vehicle.water.density_kg_m3
        > 1026.0
    )
    assert recording_at(tmp_path / "other.csv").under_conditions(filed) == (filed, ())


def test_water_as_the_file_has_it_is_not_worth_a_word(dive):
    dive.set_conditions(Conditions(20.0, 0.0))
    filed = load_vehicle("ruvifist")
    assert recording_at(dive.path).under_conditions(filed) == (filed, ())


class LookedAt(FitError):
    """Only the attempt counts."""


@pytest.mark.parametrize(
    ("out_m", "tried", "sentences"),
    [
        (0.0, False, ("2026-11-20T0900Z: no tether was out, so a tether is not among the causes",)),
        (30.0, True, ()),
        (None, True, ()),
    ],
)
def test_where_no_tether_was_out_it_is_not_tried_as_a_cause(
    dive, monkeypatch, capsys, out_m, tried, sentences
):
    def look(*_, effects, **__):
        raise LookedAt(f"tether tried: {effects is None or 'tether' in {effect.name for effect in effects}}")

    dive.set_conditions(Conditions(tether_out_m=out_m))
    assert ruled_out([dive.path])[1] == sentences
    monkeypatch.setattr(
        "identify.run.recordings.read_dives", lambda *_: [Dive("dive", Path("dive.tlog"), "1" * 64)]
    )
    monkeypatch.setattr("identify.diagnose.diagnose.diagnose", look)
    cli.main(["diagnose", str(dive.path), "--vehicle", "ruvifist:hovering"])
    assert f"tether tried: {tried}" in capsys.readouterr().err


def of_mass(looked_at, file):
    """The dry mass by which a dive is looked at."""
    return looked_at, file.vehicle.configurations["hovering"].dry_mass_kg - DRY_KG


DRY_KG = load_vehicle("ruvifist").vehicle.configurations["hovering"].dry_mass_kg


def read_as_named(path, *_):
    return [Dive(path.name, path, path.name)]


def test_the_dive_that_a_plan_follows_is_identified_under_its_conditions(dive, monkeypatch, capsys):
    def look(dive, file, *_):
        raise LookedAt(f"{of_mass(dive.name, file)}")

    dive.set_conditions(Conditions(ballast_kg=3.0))
    monkeypatch.setattr("identify.run.recordings.read_dives", read_as_named)
    monkeypatch.setattr("identify.ingest.open.read_dives", read_as_named)
    monkeypatch.setattr("identify.run.plan.estimator", lambda _: look)
    assert cli.main(["plan", "--after", str(dive.path), "--vehicle", "ruvifist:hovering"]) == 1
    assert "('2026-11-20T0900Z', 3.0)" in capsys.readouterr().err


def test_a_dive_and_a_simulators_are_each_diagnosed_under_their_conditions(dive, monkeypatch):
    looked_at = []

    def look(dive, file, *_, **__):
        looked_at.append(of_mass(dive.name, file))
        if len(looked_at) == 2:
            raise LookedAt("both")

    simulated = DiveFolder(Path("dives", "2026-11-19T0900Z"))
    simulated.set_conditions(Conditions(payload_kg=1.0))
    dive.set_conditions(Conditions(ballast_kg=3.0))
    monkeypatch.setattr("identify.run.recordings.read_dives", read_as_named)
    monkeypatch.setattr("identify.diagnose.simulators.comparison.diagnose", look)
    monkeypatch.setattr("identify.diagnose.simulators.comparison.simulator_of", lambda _: None)
    monkeypatch.setattr("identify.diagnose.simulators.comparison.priors_of", lambda _: {})
    words = ["diagnose", str(dive.path), "--against", str(simulated.path), "--vehicle", "ruvifist:hovering"]
    assert cli.main(words) == 1
    assert looked_at == [("2026-11-19T0900Z", 1.0), ("2026-11-20T0900Z", 3.0)]


def test_a_check_dive_is_flown_under_its_own_conditions(dive, monkeypatch, capsys):
    def look(dive, file, *_, check, check_file, **__):
        raise LookedAt(f"{of_mass(dive.name, file)} and {of_mass(check.name, check_file)}")

    before = DiveFolder(Path("dives", "2026-11-19T0900Z"))
    before.set_conditions(Conditions(payload_kg=1.0))
    (before.path / "telemetry.tlog").write_bytes(b"another")
    dive.set_conditions(Conditions(ballast_kg=3.0))
    monkeypatch.setattr("identify.run.recordings.read_dives", read_as_named)
    monkeypatch.setattr("identify.diagnose.diagnose.diagnose", look)
    words = ["diagnose", str(dive.path), "--check", str(before.path), "--vehicle", "ruvifist:hovering"]
    assert cli.main(words) == 1
    assert "('2026-11-20T0900Z', 3.0) and ('2026-11-19T0900Z', 1.0)" in capsys.readouterr().err
