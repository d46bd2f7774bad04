"""A dive of two minutes without any effect, with its nominal model and its configuration."""

import pytest

from bench.missions.mission import draw_one
from identify.diagnose.nominal import nominal_of


@pytest.fixture(scope="module")
def mission():
    return draw_one(100_300, seconds=120.0)


@pytest.fixture(scope="module")
def nominal(mission):
    return nominal_of(mission.dive, mission.file, mission.configuration)


@pytest.fixture(scope="module")
def shape(mission):
    return mission.file.vehicle.configurations[mission.configuration]
