"""The autopilots of these tests: a fake one, and the real firmware where it is at hand."""

import pytest
from fakes.ardusub import Ardusub
from fakes.firmware import Firmware


@pytest.fixture(params=["fake", "firmware"])
def autopilot(request, tmp_path):
    """ArduSub with two links, the simulated BlueROV2 under it where it is the firmware."""
    made = Ardusub() if request.param == "fake" else Firmware(tmp_path / "sitl")
    yield made
    made.close()


@pytest.fixture
def fake():
    return Ardusub()
