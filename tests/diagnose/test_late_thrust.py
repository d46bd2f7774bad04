"""Thrust that comes late behind the velocity of an autopilot's own filter is found, however late."""

from dataclasses import replace
from pathlib import Path

import pytest

from bench.field.draw import draw
from bridge.vehicle.config import load_vehicle
from identify.diagnose.recording import fitted_nominal
from identify.diagnose.search import explain
from identify.effects.actuators import COMMAND_DELAY, thruster_lag
from identify.effects.hydrodynamics import QUADRATIC_DRAG
from identify.ingest.open import read_dive

DELAY_S = 0.27


def test_a_long_delay_is_found_with_its_size_and_only_where_it_is_there(tmp_path: Path) -> None:
    case = draw(560_000, 23, "command_delay", size=DELAY_S / 0.15, seconds=120.0)
    for name, data in case.files().items():
        (tmp_path / name).write_bytes(data)
    file = load_vehicle(str(tmp_path / "vehicle.yaml"))
    (kind,) = file.vehicle.configurations
    library = (COMMAND_DELAY, thruster_lag(file.vehicle.thrust_curve.lag_s), QUADRATIC_DRAG)
    nominal = fitted_nominal(read_dive(tmp_path / "dive.tlog.gz", None, file), file, kind)
    assert nominal.late_thrust_s == (pytest.approx(DELAY_S, abs=0.02), 0.0)
    found = {cause.effect: cause.values for cause in explain(nominal, library, lambda *_: None).causes}
    assert set(found) == {COMMAND_DELAY, QUADRATIC_DRAG}
    assert found[COMMAND_DELAY][0] == pytest.approx(DELAY_S, abs=0.02)
    misled = replace(nominal, late_thrust_s=(0.9, 0.0))
    begun = explain(misled, (COMMAND_DELAY,), lambda *_: None)
    assert all(cause.values[0] < 0.5 for cause in begun.causes)
