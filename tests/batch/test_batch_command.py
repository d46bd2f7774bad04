"""`seatrial batch` from the command line, on short dives of the simulated vehicle."""

import csv
import json
import shutil
from dataclasses import replace

import batch_jobs
import pytest
import sketches
from dask_cluster import cluster

from bridge import exit_codes
from bridge.clock import SimulatedClock
from bridge.simulator.dive import simulate_dive
from bridge.simulator.missions import rest, run
from bridge.vehicle.config import Prior
from bridge.vehicle.legs import Mission
from bridge.wire.framing import Framer
from bridge.wire.tlog import TlogWriter
from identify.batch.dive_jobs import identify
from identify.batch.run import Standing
from tui import cli
from tui.commands import batch

MISSION = Mission(
    "short", tuple(rest("still", 2.0) + run("ahead", 0.4, 0.0, 3.0) + run("back", -0.4, 0.0, 3.0))
)
WEEK_S = 7 * 86400.0


@pytest.fixture(scope="module")
def dives(tmp_path_factory):
    """Three dives a week apart."""
    root = tmp_path_factory.mktemp("dives")
    for number in range(3):
        folder = root / f"dive-{number}"
        folder.mkdir()
        framer = Framer()
        with TlogWriter(folder / "telemetry.tlog") as writer:

            def sink(unix_s, data, framer=framer, writer=writer):
                for frame in framer.feed(data):
                    writer.write(int(unix_s * 1e6), frame.raw)

            simulate_dive(
                batch_jobs.FILE, "hovering", MISSION, seed=100_200 + number, sink=sink,
                unix_at_boot_s=1.79e9 + WEEK_S * number,
            )  # fmt: skip
    return root


@pytest.fixture(scope="module", autouse=True)
def _pages_are_sketched():
    """Without their figures rendered; a test of the page renders some."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("identify.report.picture.inline", sketches.inline)
        yield


@pytest.fixture(scope="module")
def done(dives, tmp_path_factory):
    """The folder of a batch of them, and its JSON."""
    out = tmp_path_factory.mktemp("out")
    code = command(dives, out, "--json", out / "all.json", "--csv", out / "all.csv")
    return code, out, json.loads((out / "all.json").read_text(encoding="utf-8"))


def command(*words):
    dives, out, *rest_ = map(str, words)
    return cli.main(["batch", dives, "--vehicle", "ruvifist", "--out", out, "--processes", "1", *rest_])


def test_all_dives_identified_is_done(done):
    code, out, result = done
    assert code == exit_codes.DONE
    assert [row["dive"] for row in result["dives"]] == ["dive-0", "dive-1", "dive-2"]
    assert [row["date_utc"][:10] for row in result["dives"]] == ["2026-09-21", "2026-09-28", "2026-10-05"]
    for row in result["dives"]:
        assert row["parameters"]["M_u"]["low95"] < row["parameters"]["M_u"]["value"]
        assert row["configuration"] == "hovering"
        assert row["voltage_v"] > 10
    trend = result["trends"]["hovering"]["parameters"]["D_u"]
    assert (trend["count"], trend["first_s"] < trend["last_s"]) == (3, True)
    with (out / "all.csv").open(encoding="utf-8") as file:
        assert [row["dive"] for row in csv.DictReader(file)] == ["dive-0", "dive-1", "dive-2"]
    page = (out / "trends.html").read_text(encoding="utf-8")
    assert "Configuration hovering" in page
    *_, rests_on = page.partition("<h2>Provenance</h2>")
    assert all(row["sha256"] in rests_on for row in result["dives"])
    assert result["vehicle"]["sha256"] in rests_on
    assert str(out) not in rests_on


def test_the_vehicle_files_priors_do_not_pull_the_dives_together(dives, done):
    (job,) = (batch_jobs.job_on(dives / "dive-0", "identify", batch_jobs.FILE),)
    vehicle = job.vehicle.vehicle
    shape = replace(vehicle.configurations["hovering"], priors={"M_u": Prior(110.0, 0.01)})
    weighed = replace(job.vehicle, vehicle=replace(vehicle, configurations={"hovering": shape}))
    result = identify(replace(job, vehicle=weighed))["identification"]["parameters"]
    value = next(p["value"] for p in result if p["name"] == "M_u")
    assert value == done[2]["dives"][0]["parameters"]["M_u"]["value"]


def nobody(_):
    """An engine that must not be asked to do anything."""
    pytest.fail("a dive was identified again")
    yield


def test_the_same_batch_again_takes_every_result_from_where_it_is_kept(dives, done, monkeypatch, tmp_path):
    shutil.copy(done[1] / "results.jsonl", tmp_path)
    monkeypatch.setattr(batch, "engine", lambda _: nobody)
    assert command(dives, tmp_path, "--json", tmp_path / "all.json") == exit_codes.DONE
    assert json.loads((tmp_path / "all.json").read_text(encoding="utf-8")) == done[2]


@pytest.mark.soak
def test_a_cluster_finds_the_very_same(dives, done, tmp_path):
    with cluster(tmp_path, workers=2) as running:
        words = ["batch", str(dives), "--vehicle", "ruvifist", "--out", str(tmp_path / "out")]
        words += ["--scheduler", running.address, "--json", str(tmp_path / "all.json")]
        assert cli.main(words) == exit_codes.DONE
    assert json.loads((tmp_path / "all.json").read_text(encoding="utf-8")) == done[2]


def test_a_failed_dive_is_a_row_a_twin_counts_once_and_the_exit_code_says_partly(
    dives, done, tmp_path, capsys
):
    shutil.copy(done[1] / "results.jsonl", tmp_path)
    more = tmp_path / "more"
    more.mkdir()
    (more / "2026-01-02-broken.tlog").write_text("no frames")
    shutil.copy(dives / "dive-0" / "telemetry.tlog", more / "copy.tlog")
    code = cli.main(
        ["batch", str(dives), str(more), "--vehicle", "ruvifist", "--out", str(tmp_path), "--json", "-"]
    )
    assert code == exit_codes.PARTLY
    shown = capsys.readouterr()
    data = json.loads(shown.out)
    broken = data["dives"][0]
    assert (broken["dive"], broken["date_utc"]) == ("2026-01-02-broken", "2026-01-02T00:00:00Z")
    assert "holds no MAVLink frame" in broken["error"]
    assert len(data["dives"]) == 4
    (twin,) = data["counted_once"]
    assert twin == {
        "recording": str(more / "copy.tlog"), "why": "holds the same recording as", "same_as": str(dives / "dive-0")
    }  # fmt: skip
    assert "counted once" in shown.err


def test_control_c_says_where_the_work_is_kept(dives, tmp_path, monkeypatch, capsys):
    def interrupted(_):
        raise KeyboardInterrupt
        yield

    monkeypatch.setattr(batch, "engine", lambda _: interrupted)
    assert command(dives, tmp_path) == exit_codes.INTERRUPTED
    assert f"kept in {tmp_path / 'results.jsonl'}" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--method", "guess"], "no such method"),
        (["--scheduler", "tcp://127.0.0.1:1", "--processes", "2"], "leave it out with --scheduler"),
        (["--json", "-", "--csv", "-"], "would mix on standard output"),
        (["--csv", "nowhere/all.csv"], "no folder nowhere"),
        (["--out", "/dev/null/out"], "is no folder"),
    ],
)
def test_words_that_do_not_go_together_are_wrong_usage(words, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "dive.tlog").write_text("")
    assert cli.main(["batch", "dive.tlog", "--vehicle", "ruvifist", *words]) == exit_codes.BAD_INPUT
    assert said in capsys.readouterr().err


def test_a_scheduler_that_is_not_there_is_a_link_that_does_not_work(dives, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("identify.batch.cluster.ANSWER_WITHIN_S", 0.3)
    words = f"batch {dives} --vehicle ruvifist --out {tmp_path} --scheduler nonsense://1"
    assert cli.main(words.split()) == exit_codes.LINK
    assert "no Dask scheduler answers there" in capsys.readouterr().err


def test_json_csv_and_page_are_written_though_the_reader_of_the_tables_has_left(
    dives, done, tmp_path, monkeypatch
):
    _, kept, _ = done
    out = shutil.copytree(kept, tmp_path / "out", ignore=shutil.ignore_patterns("all.*", "*.html"))

    def left(*_):
        raise BrokenPipeError

    monkeypatch.setattr(batch, "tell", left)
    command(dives, out, "--json", out / "all.json", "--csv", out / "all.csv")
    assert {path.name for path in out.iterdir()} >= {"all.json", "all.csv", "trends.html"}


@pytest.mark.parametrize(("total", "of"), [(1, "0 of 1 dive, 0 failed"), (2, "0 of 2 dives, 0 failed")])
def test_a_single_dive_under_way_is_spoken_of_as_one(total, of):
    said = []
    batch.teller(lambda _share, words: said.append(words), SimulatedClock())(Standing(total, 0, 0, 0))
    assert said == [of]
