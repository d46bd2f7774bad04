"""From a finished dive to a verified upload, all real but the water: six keys, and the vehicle is read by another.

The keys are counted as a finger counts them: one for each press, the digits of the number of lines and Enter included.
The dive tells ten lines or more, as most do, so that the number has two digits.
"""

import asyncio
import contextlib
import time

import pytest
from screen_text import made

from bench.operation.station import VEHICLE, _afloat, _flown, by_the_recording
from bridge import exit_codes
from bridge.clock import SystemClock
from gcs_plugin.params.client import ParameterClient
from gcs_plugin.params.files import read_parameters
from gcs_plugin.recording.state import held
from tui import cli, links
from tui.app import recorder
from tui.app.desk import Desk

LEGS = """
name: there and back
legs:
  - {name: rest, phase: rest, duration_s: 3}
  - {name: surge, duration_s: 3, push_surge_n: 24, alternate: 6}
  - {name: sway, duration_s: 3, push_sway_n: 24, alternate: 6}
  - {name: heave, duration_s: 3, push_heave_n: 16, alternate: 6}
  - {name: yaw, duration_s: 3, push_yaw_nm: 6, alternate: 6}
"""
MOST_KEYS = 6


def vehicle_holds():
    """All parameters, as somebody else reads them."""
    with contextlib.closing(links.of_recording(links.holding_now())) as link:
        client = ParameterClient(link, SystemClock())
        client.find_vehicle()
        return client.read_all()


@pytest.fixture
def dives(tmp_path, monkeypatch):
    """The folder of the dives, one of them finished; the vehicle is afloat and recorded."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "legs.yaml").write_text(LEGS, encoding="utf-8")
    words = ["simulate", "--vehicle", VEHICLE, "--mission", "legs.yaml", "--seed", "100001", "--out", "dives"]
    with _afloat(tmp_path) as dives:
        assert cli.main(words) == exit_codes.DONE
        yield dives


@pytest.mark.soak
def test_from_a_finished_dive_to_a_verified_upload_in_six_keys(dives, tmp_path):
    station = by_the_recording()
    desk = Desk(VEHICLE, dives, tmp_path / "receipts", recorded=recorder.recorded)
    before = vehicle_holds()
    station.start()
    try:
        flown = asyncio.run(_flown(made(station, desk=desk)))
    finally:
        station.stop()
    (identified,) = dives.glob("*/identified.param")
    wanted, now = read_parameters(identified), vehicle_holds()
    assert len(wanted) == flown["lines"] >= 10
    assert flown["keys"] <= MOST_KEYS
    assert {name: now[name] for name in wanted} == wanted
    assert now["FF_ACTIVE"] not in (before["FF_ACTIVE"], 0.0)
    unchanged = {name for name in now if not name.startswith(("FF_ACTIVE", "FF_COMMIT"))} - set(wanted)
    assert {name: now[name] for name in unchanged} == {name: before[name] for name in unchanged}
    (accepted,) = (tmp_path / "receipts").glob("*-accepted.param")
    assert read_parameters(accepted) == wanted
    assert held(time.time()) is not None, "the recording went on all along"
