"""What the screens work on together, and the verbs that they have at work."""

import asyncio
import json
import math
import os
from dataclasses import asdict

import pytest
from fake_verbs import FakeVerbs
from made_dives import record

from bridge import exit_codes, schema
from bridge.errors import ConfigError
from bridge.plain import plain
from bridge.reports import Report
from bridge.vehicle.config import CONFIGS
from gcs_plugin.dives.folder import About, DiveFolder
from gcs_plugin.params.last_accepted import keep_accepted
from gcs_plugin.params.receipt import RECEIPT, Line, Receipt, path_of
from gcs_plugin.params.sidecar import Sidecar
from gcs_plugin.params.transfer import Outcome
from tui.app.desk import Desk, can_check, check_dives, nearest_first, values_of
from tui.app.jobs import Jobs
from tui.app.screens.parameters_transfer import READ, ParameterTransfer
from tui.dive_list import VERSION, Glance, dive_folders

HALF = Report("pinn", 0.5, "pass 1", values={"M_u": (10.0, 2.0)})
WORDS = ("identify", "dive")


def ran(verbs, *steps, **how):
    """Jobs of these verbs after the steps, between which they come to rest."""
    jobs = Jobs(verbs, **how)

    async def work():
        for step in steps:
            step(jobs)
            await asyncio.sleep(0)
            while sum(state.runs for state in jobs._states.values()) > verbs.waiting:
                await asyncio.sleep(0)

    asyncio.run(work())
    return jobs


def start(jobs):
    jobs.start("identify", WORDS)


def test_a_job_is_told_while_it_runs_and_as_it_ended():
    times = iter([10.0, 14.0])
    jobs = ran(
        FakeVerbs({"identify": {"outcome": "converged"}}, tells=[HALF]), start, clock=lambda: next(times)
    )
    state = jobs.state("identify")
    assert (state.words, state.began_s, state.ended_s) == (WORDS, 10.0, 14.0)
    assert (state.reports, state.cancelled, state.runs) == ((HALF,), False, False)
    assert state.done.result == {"outcome": "converged"}
    assert jobs.state("diagnose") is None


def test_one_verb_runs_once_and_another_beside_it():
    def start_again(jobs):
        with pytest.raises(ConfigError, match="identify runs already; wait for it, or cancel it"):
            start(jobs)
        assert jobs.runs("identify")
        assert jobs.runs("diagnose")

    ran(FakeVerbs({}), start, lambda jobs: jobs.start("diagnose", ["diagnose"]), start_again)


def test_a_job_that_is_cancelled_is_over_only_when_it_has_ended_and_then_of_its_own_dive_alone():
    def cancel(jobs):
        assert jobs.cancel("identify")
        assert jobs.state("identify").cancelled
        assert jobs.about("identify", "another dive").runs

    def is_over(jobs):
        assert jobs.about("identify", "another dive") is None
        assert jobs.about("identify", "dive").cancelled
        assert jobs.state("identify").done.code == exit_codes.INTERRUPTED
        assert not jobs.cancel("identify")

    def runs_again(jobs):
        assert not jobs.state("identify").cancelled

    verbs = FakeVerbs({})
    ran(verbs, start, cancel, is_over, start, runs_again)
    assert len(verbs.words) == 2


def test_a_verb_that_can_t_be_started_says_so():
    def fault(_):
        raise OSError(12, "Cannot allocate memory")

    done = ran(FakeVerbs(fault), start).state("identify").done
    assert done.said == ("identify could not be started (Cannot allocate memory)",)
    assert done.code == exit_codes.BAD_INPUT


def dive(root, name, about=None):
    folder = root / name
    folder.mkdir(parents=True)
    (folder / "telemetry.tlog").write_bytes(b"")
    if about:
        DiveFolder(folder).describe(about)
    return folder


def test_the_newest_finished_dive_is_chosen_where_none_was(tmp_path):
    assert Desk(out=tmp_path / "none").chosen() is None
    old, new = (dive(tmp_path, f"2026-11-2{n}T0800Z-hovering") for n in (0, 1))
    (tmp_path / "2026-11-22T0800Z").mkdir()
    assert Desk(out=tmp_path).chosen() == new
    assert Desk(out=tmp_path, recorded=lambda: new).chosen() == old
    assert Desk(out=tmp_path, dive=old).chosen() == old


def test_the_dive_that_is_meant_is_chosen_until_another_is_there(tmp_path):
    surveyed, afloat = (dive(tmp_path, f"2026-11-2{n}T0800Z") for n in (0, 1))
    desk = Desk(out=tmp_path)
    desk.mean(surveyed)
    assert desk.chosen() == surveyed
    later = dive(tmp_path, "2026-11-22T0800Z")
    assert desk.chosen() == later
    desk.mean(surveyed)
    assert desk.chosen() == surveyed
    desk.dive = afloat
    assert desk.chosen() == afloat
    desk.dive = None
    desk.mean(None)
    assert desk.chosen() == later


def test_the_newest_is_the_one_that_began_last_whatever_the_folders_are_called(tmp_path):
    names = "2026-11-20T1645Z-validation-shadow", "2026-11-20T1645Z-validation-both", "b-off", "a-off"
    for second, name in enumerate(names):
        record(dive(tmp_path, name) / "telemetry.tlog", 1_795_165_923 + second)
    desk = Desk(out=tmp_path)
    assert desk.chosen() == tmp_path / "a-off"
    assert [path.name for path in check_dives(desk, desk.chosen())] == list(reversed(names[:-1]))
    assert [path.name for path in dive_folders(tmp_path)] == list(names)


def test_a_dive_is_a_check_unless_its_stamps_say_that_it_is_too_short(tmp_path):
    for name, lasts_s in (("short", 19.0), ("long", 20.0)):
        stamps = (1_795_165_923 + after for after in (0, 1, lasts_s))
        record(dive(tmp_path, name) / "telemetry.tlog", *stamps)
    assert not can_check(tmp_path / "short")
    assert can_check(tmp_path / "long")
    assert can_check(dive(tmp_path, "unknown"))


@pytest.mark.parametrize(
    ("glance", "can"),
    [
        (Glance(duration_s=112.0), True),
        (Glance(duration_s=112.0, relative_std={"M_u": 0.5, "D_u": math.inf}), True),
        (Glance(duration_s=19.9), False),
        (Glance(duration_s=112.0, relative_std={"M_u": math.inf}), False),
        (Glance(error="telemetry.tlog: holds no MAVLink frame"), False),
    ],
)
def test_what_was_read_of_a_dive_says_whether_it_can_be_a_check(tmp_path, glance, can):
    folder = dive(tmp_path, "a")
    state = (folder / "telemetry.tlog").stat()
    key = {
        "version": VERSION,
        "recordings": [["telemetry.tlog", state.st_size, state.st_mtime_ns]],
        "beside": [],
        "vehicle": "x",
    }
    kept = plain({"key": key, "glance": asdict(glance)})
    (folder / ".glance.json").write_text(json.dumps(kept), encoding="utf-8")
    assert can_check(folder) is can
    (folder / "telemetry.tlog").write_bytes(b"more")
    assert can_check(folder)


def test_the_vehicle_of_a_dive_is_the_one_that_it_names(tmp_path):
    vehicle_file = tmp_path / "mine.yaml"
    vehicle_file.write_text("", encoding="utf-8")
    desk = Desk("ruvifist:survey")
    assert (
        desk.vehicle_of(dive(tmp_path, "a", About(str(vehicle_file), "", "hovering")))
        == f"{vehicle_file}:hovering"
    )
    assert desk.vehicle_of(dive(tmp_path, "b", About(str(vehicle_file)))) == str(vehicle_file)
    gone = About("/elsewhere/ruvifist.yaml", "", "hovering")
    assert desk.vehicle_of(dive(tmp_path, "c", gone)) == f"{CONFIGS / 'vehicles' / 'ruvifist.yaml'}:hovering"


def test_what_hundreds_of_dives_say_of_their_vehicle_is_read_once_for_each_change(tmp_path, monkeypatch):
    read, load = [], schema.load_yaml
    monkeypatch.setattr(schema, "load_yaml", lambda path: read.append(path) or load(path))
    desk = Desk(out=tmp_path)
    dives = [dive(tmp_path, f"2026-11-{n:02}T0800Z", About("ruvifist.yaml")) for n in range(1, 21)]
    for _ in range(3):
        assert len(check_dives(desk, dives[0])) == 19
    assert len(read) == 20
    DiveFolder(dives[3]).describe(About("bluerov2_heavy.yaml"))
    os.utime(dives[3] / "dive.yaml", ns=(1, 1))
    assert len(check_dives(desk, dives[0])) == 18
    assert len(read) == 21


def test_of_many_diagnoses_the_newest_alone_is_read_for_the_newest_values(tmp_path, monkeypatch):
    read = []
    monkeypatch.setattr(
        "tui.app.desk.is_contradicted", lambda file: read.append(file) or file == contradicted
    )
    dives = [dive(tmp_path, f"2026-11-{n:02}T0800Z") for n in range(1, 21)]
    for second, folder in enumerate(dives):
        for name in ("diagnosis.json", "diagnosed.param"):
            (folder / name).write_text("", encoding="utf-8")
            os.utime(folder / name, (second, second))
    contradicted = dives[-1] / "diagnosis.json"
    assert values_of(*dives) == dives[-2] / "diagnosed.param"
    assert read == [contradicted, dives[-2] / "diagnosis.json"]


def test_values_of_another_vehicles_dive_are_not_proposed_for_a_vehicle(tmp_path):
    """Where nothing was identified of its own dives yet, the newest of any were compared with it, for an upload."""
    other, survey, mine = (
        dive(tmp_path, f"2026-11-2{n}T0800Z", About(f"{name}.yaml", "", configuration))
        for n, (name, configuration) in enumerate(
            (("ruvifist", "hovering"), ("ruvifist", "survey"), ("bluerov2", "standard"))
        )
    )
    (other / "identified.param").write_text("FF1_M_U,100\n", encoding="utf-8")
    desk = Desk(out=tmp_path)
    transfer = ParameterTransfer(desk)
    transfer.read(back=False)
    assert desk.chosen() == mine
    assert desk.jobs.state(READ) is None
    assert desk.values(mine) is None
    assert desk.values(survey) == desk.values(other) == desk.values(None) == other / "identified.param"
    unnamed = dive(tmp_path, "2026-11-24T0800Z")
    assert Desk("ruvifist:hovering", out=tmp_path).values(unnamed) == other / "identified.param"


def uploaded(receipts, vehicle, second):
    """An upload of a vehicle's model, at this second."""
    path = receipts / f"2026-11-20T0800{second:02d}Z-before.param"
    line = Line("FF1_M_U", 1.0, 2.0, 2.0, Outcome.APPLIED, "")
    receipt = Receipt(Outcome.APPLIED, "", 1, 1, (line,), path, None, "2026", 1.0, number=second)
    receipts.mkdir(exist_ok=True)
    keep_accepted(receipt, Sidecar("", "", "hovering", "likelihood", "0.1", vehicle=vehicle), True)
    kept = path_of(path, RECEIPT)
    kept.write_text(json.dumps(receipt.to_json()), encoding="utf-8")
    os.utime(kept, (second, second))


@pytest.mark.parametrize(("vehicle", "first"), [("ruvifist", "before"), ("bluerov2", "after")])
def test_only_an_upload_to_its_own_vehicle_parts_a_dive_from_a_later_check_dive(tmp_path, vehicle, first):
    desk = Desk("ruvifist:hovering", out=tmp_path / "dives", receipts=tmp_path / "receipts")
    dives = {name: dive(desk.out, name) for name in ("before", "diagnosed", "after")}
    for second, folder in zip((10, 20, 40), dives.values(), strict=True):
        os.utime(folder / "telemetry.tlog", (second, second))
    uploaded(desk.receipts, vehicle, 30)
    others = (dives["before"], dives["after"])
    assert nearest_first(desk, dives["diagnosed"], others)[0] == dives[first]


def test_a_dive_that_names_none_or_one_that_is_gone_is_of_the_vehicle_of_the_app(tmp_path):
    desk = Desk("ruvifist:survey")
    assert desk.vehicle_of(dive(tmp_path, "a")) == "ruvifist:survey"
    gone = dive(tmp_path, "d", About("/elsewhere/mine.yaml", "", "hovering"))
    assert desk.vehicle_of(gone) == "ruvifist:survey"
    assert Desk().vehicle_of(gone) == ""
    damaged = dive(tmp_path, "b")
    (damaged / "dive.yaml").write_text("notes: [", encoding="utf-8")
    assert desk.vehicle_of(damaged) == "ruvifist:survey"
    assert Desk().vehicle_of(tmp_path / "a") == ""
