"""A simulated vehicle that hides nothing, with shaft speeds as its bridge records them, is given no false cause."""

import math

import pytest

from bridge.effects.actuators import COMMAND_DELAY, DEAD_ZONE_SHIFTED, SATURATION, thruster_lag
from bridge.framing import Framer
from bridge.simulator.dive import simulate_dive
from bridge.simulator.missions import Mission, rest, run, turn
from bridge.tlog import TlogWriter
from bridge.vehicle.config import load_vehicle
from identify.diagnose.diagnose import diagnose
from identify.ingest.open import read_dive

FILE = load_vehicle("ruvifist")
BEFORE_THE_SHAFT = (
    thruster_lag(FILE.vehicle.thrust_curve.lag_s), COMMAND_DELAY, DEAD_ZONE_SHIFTED, SATURATION,
)  # fmt: skip
MISSION = Mission(
    "there and back",
    tuple(
        run("ahead", 0.4, 0.0, 4.0)
        + run("aside", 0.0, 0.3, 2.5)
        + turn("about", math.radians(90.0), math.radians(10.0), "smooth")
        + run("back", -0.3, 0.0, 3.0)
        + rest("still", 3.0)
    ),
)


@pytest.fixture(scope="module")
def dive(tmp_path_factory):
    path = tmp_path_factory.mktemp("honest") / "telemetry.tlog"
    framer = Framer()
    with TlogWriter(path) as writer:

        def sink(unix_s, data):
            for frame in framer.feed(data):
                writer.write(int(unix_s * 1e6), frame.raw)

        simulate_dive(FILE, "hovering", MISSION, seed=100_203, sink=sink)
    return read_dive(path, None, FILE)


def test_shaft_speeds_half_of_which_are_told_late_make_no_cause(dive):
    assert dive.rpm is not None
    found = diagnose(dive, FILE, "hovering", effects=BEFORE_THE_SHAFT, progress=lambda _share, _words: None)
    assert (found.verdict, found.found) == ("no_gap", ())
