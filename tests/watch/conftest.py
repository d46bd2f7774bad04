"""A watch, and a vehicle that says what a test tells it to."""

import pytest
from vehicle_on_air import OnAir

from bridge.vehicle.config import load_vehicle
from gcs_plugin.watch.watcher import Watcher


@pytest.fixture
def watcher():
    return Watcher(load_vehicle("ruvifist"))


@pytest.fixture
def vehicle(watcher):
    return OnAir(watcher)
