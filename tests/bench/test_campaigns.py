"""The benchmarks' dives of the paper's vehicle."""

from pathlib import Path

import numpy as np
import pytest

from bench import campaigns
from bench.campaigns import VEHICLE, dive, dived, with_model
from bench.speed import reading
from bench.stamp import files
from bridge.simulator.dive import WARM_UP_S
from bridge.simulator.truth import load_truth
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.legs import Leg, Mission
from bridge.vehicle.mode import Mode


def test_a_dive_with_feed_forward_flies_by_the_coefficients_that_it_is_given(tmp_path):
    """With half the damping in force the thrusters give about half of what a steady leg takes."""
    file = load_vehicle(f"{VEHICLE}:hovering")
    truth = load_truth(file, "hovering").model
    mission = Mission("ahead", (Leg(6.0, surge_m_s=0.3, transient_s=2.0),))
    speed_m_s = {}
    for share in (1.0, 0.5):
        flown = with_model(file, "hovering", {**truth, "D_u": share * truth["D_u"]})
        time_s, state = dive(flown, "hovering", mission, 7, Mode.ALONE, tmp_path / f"{share}.tlog")
        speed_m_s[share] = np.mean(state[time_s > WARM_UP_S + 4.0, 7])
    assert 0.2 < speed_m_s[1.0] < 0.4
    assert speed_m_s[0.5] < 0.9 * speed_m_s[1.0]


@pytest.mark.parametrize(
    ("module", "recorded"),
    [(campaigns, lambda cache: dived("survey", "survey", 1, cache)), (reading, lambda cache: reading.hour(cache, 1))],
    ids=["a campaign", "an hour"],
)  # fmt: skip
def test_a_kept_dive_is_dived_anew_where_the_code_that_dives_it_has_changed(
    module, recorded, tmp_path, monkeypatch
):
    (tmp_path / "dives").mkdir()
    stamped = []

    def stamp(*sources):
        stamped.extend(files(*sources))
        return "code"

    def dive(*_):
        raise InterruptedError

    monkeypatch.setattr(module, "stamp", stamp)
    monkeypatch.setattr(module, "dive", dive)
    with pytest.raises(InterruptedError):
        recorded(tmp_path)
    assert {Path(campaigns.__file__), Path(module.__file__)} <= set(stamped)
