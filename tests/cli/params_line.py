"""`params` on a command line: its vehicle in simulated time, a file of two values, and where a file comes from."""

import json
from pathlib import Path

import pytest
from fakes.vehicle import VEHICLE
from parameter_vehicle import at_any_link

from bridge.vehicle.config import load_vehicle
from gcs_plugin.params.sidecar import Interval, Sidecar, write_sidecar
from tui import cli

DESPITE_HALF = ("--accept-implausible", "FF1_M_U", "FF1_D_U")
"""Writes one of the two values of surge without the other all the same."""


@pytest.fixture
def vehicle(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    return at_any_link(monkeypatch)


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "new.param"
    path.write_text("FF1_M_U,111.5\nFF1_D_U,56.25\n", encoding="utf-8")
    return str(path)


def run(*line):
    return cli.main(["params", *line, "--link", "any"])


def identified(tmp_path, **changed):
    """The JSON of an identification of this vehicle, some of it changed."""
    file = load_vehicle(VEHICLE)
    data = {
        "outcome": "converged",
        "configuration": "hovering",
        "parameters": [
            {"name": "M_u", "value": 112.0, "identifiable": True},
            {"name": "D_u", "value": 56.0, "identifiable": True},
            {"name": "M_v", "value": 50.0, "identifiable": False},
        ],
        "vehicle": {"name": file.vehicle.name, "sha256": file.sha256},
        "notes": ["the thrusters saturated"],
    }
    path = tmp_path / "found.json"
    path.write_text(json.dumps(data | changed), encoding="utf-8")
    return str(path)


def with_sidecar(path, outcome):
    about = Sidecar("dive", "vehicle", "hovering", "likelihood", "0.1.0", {}, "ruvifist", "lake-7", outcome)
    write_sidecar(Path(path), about)


def with_intervals(path):
    mass = Interval("M_u", "kg", 101.5, 121.5)
    write_sidecar(
        Path(path), Sidecar("d", "v", "hovering", "likelihood", "1", {"FF1_M_U": mass}, "ruvifist", "lake")
    )
