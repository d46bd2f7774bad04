"""One MAVProxy with two vehicles, a link each: the simulated one (system 1), a bridge without devices (system 2)."""

import subprocess
import sys

import pytest
from console import MAVPROXY, Console
from fakes.ports import free_port
from second_vehicle import SecondVehicle

from bridge import exit_codes
from tui import cli

LEGS = """
name: there and back
legs:
  - {name: rest, phase: rest, duration_s: 3}
  - {name: surge, duration_s: 3, push_surge_n: 24, alternate: 8}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("mavproxy")


@pytest.fixture(scope="module")
def dive(folder):
    """A dive of the simulated vehicle that tells something."""
    legs = folder / "legs.yaml"
    legs.write_text(LEGS, encoding="utf-8")
    words = ["simulate", "--vehicle", "ruvifist:hovering", "--mission", str(legs), "--seed", "100001"]
    assert cli.main([*words, "--out", str(folder / "earlier")]) == exit_codes.DONE
    return next((folder / "earlier").iterdir())


@pytest.fixture(scope="module")
def second():
    with SecondVehicle() as vehicle:
        yield vehicle


@pytest.fixture(scope="module")
def mavproxy(folder, second):
    """MAVProxy with vehicle 1 meant, once it hears both for long enough."""
    if MAVPROXY is None:
        pytest.skip("MAVProxy is not installed: pip install -e '.[dev]'")
    settings = folder / ".config" / "seatrial"
    settings.mkdir(parents=True)
    (settings / "alarms.yaml").write_text("limits: {battery_v: 99}\n", encoding="utf-8")
    port = free_port()
    simulate = f"simulate --vehicle ruvifist:hovering --mission idle --link tcpin:127.0.0.1:{port}"
    words = [sys.executable, "-P", "-m", "tui", *simulate.split()]
    with subprocess.Popen(words, cwd=folder, stderr=subprocess.PIPE, text=True) as simulator:
        try:
            assert "afloat" in simulator.stderr.readline()
            with Console(folder, [f"tcp:127.0.0.1:{port}", second.master]) as console:
                console.wait_for("Loaded module gcs_plugin.mavproxy")
                console.wait_for("Detected vehicle 1:1")
                console.wait_for("Detected vehicle 2:1")
                console.until("seatrial vehicle 1", r"vehicle: 1 \(systems that beat: 1, 2\)")
                console.until("seatrial status", "meant: vehicle 1, component 1\nNOT RECORDING")
                yield console
        finally:
            simulator.terminate()
            simulator.stderr.close()
