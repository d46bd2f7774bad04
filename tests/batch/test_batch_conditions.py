"""What each dive of a batch is judged by: its own conditions, and what was accepted before."""

import json
from pathlib import Path

import batch_jobs
import pytest

from bridge import exit_codes
from bridge.errors import FitError
from gcs_plugin.dives.conditions import Conditions
from gcs_plugin.dives.folder import DiveFolder, about_vehicle
from identify.batch import dive_jobs
from identify.batch.jobs import Against, run_job
from identify.run.diagnose import Before
from tui import cli
from tui.commands import batch

MODEL = Path("configs/vehicles/bluerov2_heavy.yaml").resolve()


@pytest.fixture
def jobs(tmp_path, monkeypatch):
    """The jobs of a batch of two dives, by dive and function; the second carries 2 kg in other water, and no tether."""
    monkeypatch.chdir(tmp_path)
    for name in ("plain", "loaded"):
        folder = DiveFolder(Path("dives", name))
        folder.path.mkdir(parents=True)
        folder.open_telemetry(1).close()
        (folder.path / "telemetry.tlog").write_bytes(name.encode())
        folder.describe(about_vehicle(batch_jobs.FILE, "hovering"))
    folder.set_conditions(Conditions(11.5, 35.0, ballast_kg=2.0, tether_out_m=0.0))
    given = {}

    def engine(_):
        def run(jobs):
            for job in jobs:
                given[job.recording.name, job.function.rpartition(":")[2]] = job
                yield job.failed("was not asked", final=False)

        return run

    monkeypatch.setattr(batch, "engine", engine)

    def of(*words):
        assert cli.main(["batch", "dives", *words]) == exit_codes.NO
        return given

    return of


def test_each_dive_is_judged_under_its_own_conditions_and_it_is_said(jobs, capsys):
    given = jobs("--vehicle", "ruvifist", "--diagnose")
    plain, loaded = given["plain", "identify"], given["loaded", "identify"]
    masses = [job.vehicle.vehicle.configurations["hovering"].dry_mass_kg for job in (plain, loaded)]
    assert masses[1] == masses[0] + 2.0
    assert (plain.carried_kg, loaded.carried_kg) == (0.0, 2.0)
    assert given["loaded", "diagnose"].against.without == ("tether",)
    assert given["plain", "diagnose"].against == Against()
    said = " ".join(capsys.readouterr().err.split())
    assert "loaded: +2 kg of ballast and payload on top of the vehicle file's dry mass." in said
    assert "loaded: no tether was out, so a tether is not among the causes." in said
    assert "loaded: +2 kg" in " ".join(Path("batch/trends.html").read_text(encoding="utf-8").split())


def test_a_dive_whose_conditions_can_t_be_read_costs_that_dive_and_not_the_batch(jobs):
    Path("dives/loaded/dive.yaml").write_text("conditions: [", encoding="utf-8")
    given = jobs("--vehicle", "ruvifist", "--diagnose", "--json", "all.json")
    assert {name for name, _ in given} == {"plain"}
    dives = json.loads(Path("all.json").read_text(encoding="utf-8"))["dives"]
    errors = {dive["dive"]: dive["error"] for dive in dives}
    assert errors["plain"] == "was not asked"
    assert errors["loaded"].startswith("dives/loaded/dive.yaml: ")


def test_another_ballast_is_another_job_whose_result_is_not_taken_from_what_was_kept(jobs):
    before = jobs("--vehicle", "ruvifist")["loaded", "identify"].key
    DiveFolder(Path("dives/loaded")).set_conditions(Conditions(11.5, 35.0, ballast_kg=3.0, tether_out_m=0.0))
    assert jobs("--vehicle", "ruvifist")["loaded", "identify"].key != before


def test_what_was_accepted_is_what_each_dive_is_diagnosed_against(jobs, monkeypatch):
    words = ("--vehicle", "bluerov2_heavy", "--diagnose", "--accepted", f"{MODEL}:heavy")
    job = jobs(*words)["plain", "diagnose"]
    assert job.against.accepted["heavy"].values["M_u"].value == 19.86
    asked = {}

    def looked(dive, _, configuration, *, before, without):
        asked.update(configuration=configuration, before=before, without=without)
        raise FitError("looked", of=dive)

    monkeypatch.setattr(dive_jobs, "read_job", lambda job: ("plain", job.vehicle, "heavy"))
    monkeypatch.setattr(dive_jobs.run_diagnose, "diagnose", looked)
    assert run_job(job).error == "looked"
    assert (asked["before"], asked["without"]) == (job.against.accepted["heavy"], ())
    monkeypatch.setattr(dive_jobs, "read_job", lambda job: ("plain", job.vehicle, "light"))
    assert "was dived in configuration 'light', and what was accepted is of heavy" in run_job(job).error


def test_without_what_was_accepted_nothing_is_held_against_a_dive(jobs, monkeypatch):
    job = jobs("--vehicle", "ruvifist", "--diagnose")["plain", "diagnose"]
    asked = {}

    def looked(*_, before, without):
        asked.update(before=before, without=without)
        raise FitError("looked", of="plain")

    monkeypatch.setattr(dive_jobs, "read_job", lambda job: ("plain", job.vehicle, "hovering"))
    monkeypatch.setattr(dive_jobs.run_diagnose, "diagnose", looked)
    assert run_job(job).error == "looked"
    assert asked == {"before": Before(), "without": ()}


def test_accepted_goes_with_a_diagnosis(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("dive.tlog").write_text("", encoding="utf-8")
    words = ["batch", "dive.tlog", "--vehicle", "bluerov2_heavy", "--accepted", str(MODEL)]
    assert cli.main(words) == exit_codes.BAD_INPUT
    assert "give --diagnose with it" in capsys.readouterr().err
