"""Sections of the benchmark page: the ladder of controllers, the flown plan, the station, the gap monitor, the bags."""

import signal
import subprocess
import sys

import numpy as np
import pytest

from bench.operation import station
from bench.operation.flying import figures
from bench.operation.flying import words as flying_page
from bench.operation.gap_monitor import ONSETS, onset_dive
from bench.operation.gap_monitor import words as gap_monitor_page
from bench.speed.bags import BARE, DECODED, FORMS, MAP, OURS, hour, words_of
from bench.tracking import ladder
from bridge.errors import LinkError, LinkTimeout
from bridge.simulator.truth import load_truth
from bridge.vehicle.config import load_vehicle
from gcs_plugin.flying.run import Outcome, Wanted
from identify.ingest.open import read_dive

TUNED = ladder.Pid(8.0, 64.0, 0.6)


def test_a_pid_flies_the_same_gains_and_dead_zone_alone_and_beside_the_feed_forward():
    paper, gains = ladder.paper_table(), ladder.table(ladder.Pid(2.0, 4.0, 0.7))
    assert gains["fed"] == {"gain": 1.0, "straight_below_n": 0.7}
    assert gains["straight_below_n"] == 0.7
    assert gains["surge"]["kp"] == [2.0 * gain for gain in paper["surge"]["kp"]]
    assert gains["sway"]["ki"] == [4.0 * gain for gain in paper["sway"]["ki"]]
    assert gains["yaw"] == paper["yaw"]


def test_the_page_gives_both_errors_and_their_ratio():
    flight = {
        name: {"OFF": {"surge": 0.06, "sway": 0.05}, "BOTH": {"surge": 0.005, "sway": 0.004}}
        for name in ("the paper's", "as beside the feed-forward", "tuned")
    }
    words, table = ladder.shown(TUNED, [flight, flight])
    assert table.splitlines()[-1] == "| tuned | 60.0 | 5.0 | 12.0 | 50.0 | 4.0 | 12.5 |"
    assert "8 times the paper's proportional gain, 64 times its integral" in " ".join(words.split())


def test_the_table_has_medians_and_the_share_of_the_time_by_hand():
    data = {
        "hand_s": 800.0, "known_s": 100.0, "whole_s": 120.0, "identify_s": 0.5, "share": 0.05,
        "hand": {"M_u": 0.013, "D_u": 0.05}, "flown": {"M_u": 0.003, "D_u": 0.012},
        "each_known_s": 200.0, "each_whole_s": 230.0, "each": {"M_u": 0.002, "D_u": 0.008},
    }  # fmt: skip
    results = {f"{c} {n}": data for c in ("survey", "hovering") for n in range(3)}
    results["hovering 1"] = data | {"known_s": 90.0}
    page = flying_page(results)
    assert "| hovering | 3 | 5.0% | 800 s | 100 s | 1/8.0 | 120 s |" in page
    assert "| hovering | 3 | each as by hand | 800 s | 200 s | 1/4.0 | 230 s |" in page
    assert "| flown, each as by hand | 0.2 | 0.8 |" in page
    assert "| survey | M_u | D_u |" in page
    assert "| flown | 0.3 | 1.2 |" in page
    assert "took 0.5 s on average" in " ".join(page.split())
    results["survey 1"] = data | {"known_s": float("nan")}
    assert "| survey | 3 | 5.0% | 800 s | 100 s | 1/8.0 | 120 s |" in flying_page(results)
    unknown = figures(800.0, {"M_u": 0.013, "D_u": 0.05}, Wanted(("M_u", "D_u"), 0.05), Outcome(), [0.5])
    results["survey 2"] = results["survey 1"] = data | unknown | {"whole_s": 120.0}
    assert "| survey | 3 | 5.0% | 800 s | never | - | 120 s |" in flying_page(results)
    assert "| flown | - | - |" in flying_page(results)


def station_of(monkeypatch, tmp_path, program):
    """A station whose vehicle and recorder both run `program` instead, and the list of the processes that it starts."""
    begun, popen = [], subprocess.Popen

    def begin(*_, **__):
        begun.append(popen([sys.executable, "-c", program], stderr=subprocess.DEVNULL))
        return begun[-1]

    monkeypatch.setenv("XDG_STATE_HOME", "kept for the others")
    monkeypatch.setattr(station.subprocess, "Popen", begin)
    return station._afloat(tmp_path), begun


def test_a_station_that_fails_ends_its_vehicle_and_its_recording(monkeypatch, tmp_path):
    afloat, begun = station_of(monkeypatch, tmp_path, "import time; time.sleep(20.0)")
    monkeypatch.setattr(station, "held", lambda _: "recorded")
    with pytest.raises(LinkTimeout), afloat:
        raise LinkTimeout("not seen")
    assert [process.returncode for process in begun] == [-signal.SIGTERM] * 2


def test_a_recording_that_ends_before_it_began_is_not_waited_for(monkeypatch, tmp_path):
    afloat, _ = station_of(monkeypatch, tmp_path, "raise SystemExit(3)")
    with pytest.raises(LinkError, match="the recording ended with 3"), afloat:
        pass


def test_every_onset_can_be_simulated_and_has_a_cause_to_be_named():
    truth = load_truth(load_vehicle("ruvifist:survey"), "survey")
    for onset in ONSETS.values():
        effects = onset.draw(np.random.default_rng(1))
        assert type(truth)(truth.model, 0.0, 0.0, onset=effects).onset == effects
        assert onset.named(effects)


@pytest.mark.soak
def test_a_current_that_sets_in_is_found_and_named():
    data = onset_dive("current", "hovering", 8301)
    assert data["early"] == 0
    assert 15.0 < data["after_s"] < 60.0
    assert data["named"]


def test_the_table_counts_what_was_found_in_time_and_every_false_alarm():
    dive = {"effects": {}, "after_s": 30.0, "early": 0, "named": True}
    results = {f"{name} {n}": dive for name in ONSETS for n in range(3)}
    results |= {
        "tether 0": dive | {"after_s": 70.0, "named": False},
        "tether 1": dive | {"after_s": None, "named": False, "early": 1},
        "calm 0": {"hours": 0.5, "alarms": [100.0]},
        "calm 1": {"hours": 0.25, "alarms": []},
    }
    page = gap_monitor_page(results)
    assert "| a tether snags, 0.5 to 3 N/m | 3 | 33% | 67% | 50 s | 50% |" in page
    assert "| a current of 0.05 to 0.2 m/s | 3 | 100% | 100% | 30 s | 100% |" in page
    flat = " ".join(page.split())
    assert "False alarms: 1 in 0.8 h of 2 whole missions without any effect, and 1 in the 45 minutes" in flat


BAG_SECONDS = 3


@pytest.mark.parametrize("form", FORMS)
def test_a_bag_of_each_form_holds_every_sample_and_opens_as_a_dive(tmp_path, form):
    bag, columns = hour(form, tmp_path, BAG_SECONDS), tmp_path / "map.yaml"
    columns.write_text(MAP, encoding="utf-8")
    dive = read_dive(bag, columns)
    assert {name: len(signal) for name, signal in dive.signals().items()} == dict.fromkeys(
        ("velocity", "gyro", "specific_force", "attitude", "pwm"), 100 * BAG_SECONDS
    )
    assert dive.duration_s == pytest.approx(BAG_SECONDS - 0.01)
    written = bag.stat().st_mtime_ns
    assert hour(form, tmp_path, BAG_SECONDS).stat().st_mtime_ns == written


@pytest.mark.parametrize("form", FORMS)
def test_a_bag_that_a_kill_cut_short_is_written_anew(tmp_path, form):
    bag = hour(form, tmp_path, BAG_SECONDS)
    (tmp_path / bag.relative_to(tmp_path).parts[0] / "whole").unlink()
    bag.write_bytes(b"a half")
    assert hour(form, tmp_path, BAG_SECONDS).stat().st_size > 1000 * BAG_SECONDS


def measured(bare_s, ours_s):
    return {"bytes": 2e6, "messages": 900, "seconds": {BARE: bare_s, OURS: ours_s, DECODED: 9.0}}


def test_the_slowest_form_is_judged_by_the_goal():
    words = words_of({".bag": measured(2.0, 1.0), ".mcap": measured(1.0, 2.5)})
    assert "| `.bag` | 2 | 2 | 1 | 0.5 | 9 |" in words
    assert "Goal of 3 times bare: 2.5 at most, met." in words
    assert "Goal of 3 times bare: 4 at most, **missed**." in words_of({".db3": measured(1.0, 4.0)})
