"""`record --next` and `--end`: a recording goes on in a new folder, and ends, and no frame is lost."""

import json
from pathlib import Path

import pytest
from fakes.processes import Running, TalkingVehicle
from fakes.recordings import raws
from waiting import until

from bridge import exit_codes
from bridge.clock import SystemClock
from bridge.links.open import open_link
from bridge.wire.framing import Framer
from gcs_plugin.dives.conditions import Conditions
from gcs_plugin.dives.folder import DiveFolder, list_folders
from gcs_plugin.recording.state import held
from tui import cli


def now():
    return held(SystemClock().unix_s())


@pytest.fixture
def recording(tmp_path, monkeypatch):
    """A recording in a process of its own, and the vehicle whose frames it takes."""
    monkeypatch.setattr("gcs_plugin.recording.orders.LEAST_DIVE_S", 0.0)
    vehicle = TalkingVehicle()
    dives, result = tmp_path / "dives", tmp_path / "told.json"
    running = Running(
        "record", "--link", vehicle.link, "--out", str(dives), "--json", str(result), "--same-conditions"
    )
    try:
        yield running, vehicle, result
    finally:
        running.kill()
        vehicle.close()


def recorded(capsys, *words):
    code = cli.main(["record", *words, "--json", "-"])
    return code, json.loads(capsys.readouterr().out)


def test_each_frame_lies_in_exactly_one_of_both_dives_and_link_and_hub_stay_open(recording, capsys):
    running, vehicle, result = recording
    first = until(now)
    client, framer, seen = open_link(first.hub), Framer(), []
    until(lambda: now().frames)
    DiveFolder(Path(first.folder)).set_conditions(Conditions(salinity=35.0))
    code, answer = recorded(capsys, "--next")
    assert code == exit_codes.DONE
    assert answer["finished"] == first.folder
    second = until(lambda: now() if now().frames else None)
    assert (second.folder, second.pid, second.hub) == (answer["folder"], first.pid, first.hub)
    until(lambda: len(vehicle.sent) > 600)
    vehicle.close()
    until(lambda: seen.extend(framer.feed(client.read(0.05))) or (seen and seen[-1].raw == vehicle.sent[-1]))
    client.close()
    assert recorded(capsys, "--end") == (
        exit_codes.DONE,
        {"finished": second.folder, "folder": None},
    )
    assert running.process.wait(120) == exit_codes.DONE
    dives = [raws(Path(item.folder) / "telemetry.tlog") for item in (first, second)]
    assert all(dives)
    assert dives[0] + dives[1] == vehicle.sent
    assert [frame.raw for frame in seen] == vehicle.sent[-len(seen) :]
    data = json.loads(result.read_text(encoding="utf-8"))
    assert (data["frames"], data["earlier"][0]["frames"]) == (len(dives[1]), len(dives[0]))
    assert DiveFolder(Path(second.folder)).about().conditions == Conditions(salinity=35.0)
    assert now() is None


def test_a_dive_goes_on_in_the_next_before_its_file_is_larger_than_any_that_is_read(
    tmp_path, monkeypatch, capsys
):
    monkeypatch.setattr("gcs_plugin.dives.recorded_dives.FULL_BYTES", 500)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    vehicle, out = TalkingVehicle(), tmp_path / "dives"
    try:
        line = ("record", "--link", vehicle.link, "--out", str(out), "--seconds", "3")
        assert cli.main(line) == exit_codes.DONE
    finally:
        vehicle.close()
    dives = [raws(folder.path / "telemetry.tlog") for folder in list_folders(out)]
    assert len(dives) > 1
    assert [raw for dive in dives for raw in dive] == vehicle.sent[: sum(map(len, dives))]
    said = " ".join(capsys.readouterr().err.split())
    assert said.count("it goes on in the next dive") == said.count("the next dive goes into")


def test_what_to_do_must_be_said(refused):
    assert "--link --next --end" in refused("record")
