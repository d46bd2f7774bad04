"""A simulated vehicle that hides nothing, with shaft speeds as its bridge records them, is given no false cause."""

import pytest

from bridge.framing import Framer
from bridge.simulator.dive import simulate_dive
from bridge.simulator.missions import validation
from bridge.tlog import TlogWriter
from bridge.vehicle.config import load_vehicle
from identify.diagnose.diagnose import diagnose
from identify.effects.actuators import COMMAND_DELAY, DEAD_ZONE_SHIFTED, SATURATION, thruster_lag
from identify.ingest.open import read_dive

FILE = load_vehicle("ruvifist")
BEFORE_THE_SHAFT = (
    thruster_lag(FILE.vehicle.thrust_curve.lag_s), COMMAND_DELAY, DEAD_ZONE_SHIFTED, SATURATION,
)  # fmt: skip


@pytest.fixture(scope="module")
def dive(tmp_path_factory):
    path = tmp_path_factory.mktemp("honest") / "telemetry.tlog"
    framer = Framer()
    with TlogWriter(path) as writer:

        def sink(unix_s, data):
            for frame in framer.feed(data):
                writer.write(int(unix_s * 1e6), frame.raw)

        simulate_dive(FILE, "survey", validation(sways=False), seed=4, sink=sink)
    return read_dive(path, None, FILE)


def test_shaft_speeds_half_of_which_are_told_late_make_no_cause(dive):
    assert dive.rpm is not None
    found = diagnose(dive, FILE, "survey", effects=BEFORE_THE_SHAFT, progress=lambda *_report: None)
    assert (found.verdict, found.findings) == ("no_gap", ())
