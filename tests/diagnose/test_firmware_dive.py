"""The real ArduSub firmware with a vehicle of quadratic drag alone: that must be found, and nothing else."""

from pathlib import Path

import pytest

from bridge.vehicle.config import load_vehicle
from identify.diagnose.diagnose import diagnose
from identify.ingest.open import read_dive

DIVE = Path(__file__).resolve().parents[2].parent / "shared" / "data" / "ardusub_sitl" / "still.tlog.gz"
TRUE = {"X_uu": 48.285, "Y_vv": 62.08, "Z_ww": 68.98}


def test_the_firmwares_own_submarine_has_quadratic_drag_and_nothing_else():
    if not DIVE.exists():
        pytest.skip("needs ../shared/data beside the checkout")
    file = load_vehicle("ardusub_vectored")
    found = diagnose(read_dive(DIVE, None, file), file, "vectored", progress=lambda *_: None)
    assert [one.name for one in found.findings] == ["quadratic_drag"]
    assert found.verdict == "explained"
    parameters = found.findings[0].parameters
    # Velocities come from the firmware's own filter: that widens nothing and shifts some.
    for name, value in TRUE.items():
        assert parameters[name].value == pytest.approx(value, rel=0.2)
