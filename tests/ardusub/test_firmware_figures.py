"""Figures with the firmware in the loop, printed by `pytest -s`: how well it follows, and how it ends."""

import sys
import time

import numpy as np
import pytest
from fakes.ardusub import ALT_HOLD
from fakes.firmware import Firmware
from rig import Aboard, Pilot, arm, given_back, ready, taken
from test_dvl_and_recording import WITH_DVL, Dvl
from test_flights import BATTERY, LIMITS

from bench.ardusub.firmware import SteppedLink
from bench.ardusub.flight import vehicle_file
from bench.operation.flying import InTurn
from bridge.ardusub.companion import companion_file
from bridge.firmware.ardusub import MANUAL
from bridge.flight.flight import End
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.mode import Mode
from gcs_plugin.flying.plan import flight_plan
from gcs_plugin.flying.run import PlanFlight, Wanted
from identify.estimators.table import DEFAULT, estimator
from identify.ingest.open import read_dive
from identify.planning.limits import Limits
from identify.run.plan import before_dives, plan
from tui.flight_recording import recorded_crew

pytestmark = pytest.mark.soak
DEATHS = 20


def say(text):
    sys.stderr.write(f"\n{text}\n")


@pytest.fixture
def firmware(tmp_path):
    made = Firmware(tmp_path / "sitl", depth_m=10.0)
    yield made
    made.close()


def afloat(firmware, flight_mode, **options):
    """Armed, with a companion, a pilot and a DVL; and these as acts."""
    aboard, pilot = Aboard(firmware, file=WITH_DVL, **options), Pilot(firmware)
    acts = (aboard, pilot, Dvl(firmware, aboard))
    assert firmware.until(lambda: aboard.companion.law, 30.0, *acts)
    ready(firmware, aboard, pilot)
    assert firmware.until(lambda: aboard.companion.heard.has_switches(firmware.clock.boot_s()), 20.0, *acts)
    firmware.run(6.0, *acts)
    firmware.set_mode(flight_mode)
    arm(firmware, aboard, pilot, *acts[2:])
    return aboard, pilot, acts


def followed_mm_s(firmware, aboard, pilot, acts, axis, dof):
    """Rms of the body's velocity minus the reference over steps of a stick, mm/s."""
    off = []

    def look():
        off.append(aboard.companion.law.reference_m_s[dof] - firmware.body.state[7 + dof])

    for value in (300, 0, -300, 150, 0):
        pilot.sticks[axis] = value
        firmware.run(3.0, *acts, look)
    return 1e3 * float(np.sqrt(np.mean(np.square(off))))


@pytest.mark.parametrize(("axis", "dof"), [("x", 0), ("y", 1)])
def test_the_feedforward_follows_the_sticks_reference_several_times_better_than_sticks_alone(
    firmware, axis, dof
):
    aboard, pilot, acts = afloat(firmware, ALT_HOLD)
    errors_mm_s = {}
    for mode in (Mode.SHADOW, Mode.ALONE, Mode.BOTH):
        aboard.set_mode(mode)
        assert firmware.until(lambda: taken(aboard) or not mode.applies_feedforward, 20.0, *acts)  # noqa: B023
        errors_mm_s[mode] = followed_mm_s(firmware, aboard, pilot, acts, axis, dof)
    say(f"{axis}: " + ", ".join(f"{mode.word} {value:.1f} mm/s" for mode, value in errors_mm_s.items()))
    assert errors_mm_s[Mode.ALONE] < errors_mm_s[Mode.SHADOW] / 5
    assert errors_mm_s[Mode.BOTH] < errors_mm_s[Mode.SHADOW] / 5


def test_a_companion_that_dies_ends_disarmed_each_time(firmware):
    took = []
    for _ in range(DEATHS):
        aboard, pilot, acts = afloat(firmware, MANUAL) if not took else begun_again(firmware)
        aboard.set_mode(Mode.ALONE)
        assert firmware.until(lambda: taken(aboard), 20.0, *acts)  # noqa: B023
        pilot.sticks["x"] = 300
        firmware.run(1.0, *acts)
        began_s = firmware.clock.boot_s()
        pilot.heard.clear()
        assert firmware.until(lambda: disarmed(pilot), 8.0, pilot)  # noqa: B023
        took.append(firmware.clock.boot_s() - began_s)
    say(f"disarmed {len(took)} of {DEATHS} times, after {min(took):.1f} to {max(took):.1f} s")
    assert max(took) < 4.5


def begun_again(firmware):
    """A new companion after one died: it gives the sticks back, and the vehicle is armed again."""
    aboard, pilot = Aboard(firmware, file=WITH_DVL), Pilot(firmware)
    acts = (aboard, pilot, Dvl(firmware, aboard))
    assert firmware.until(lambda: given_back(aboard) and aboard.companion.law, 30.0, *acts)
    assert pilot.read("SYSID_MYGCS") == 255
    arm(firmware, aboard, pilot, *acts[2:])
    return aboard, pilot, acts


def test_a_plan_is_flown_until_enough_is_known_and_the_vehicle_is_back(tmp_path):
    """`fly` until the masses are known to 3 %, the identifications beside it as slow as here."""
    file = load_vehicle(str(vehicle_file(tmp_path / "file")))
    firmware = Firmware(tmp_path / "sitl", depth_m=4.0, settings=BATTERY)
    try:
        aboard, pilot = Aboard(firmware, file=companion_file(file)), Pilot(firmware)
        acts = (aboard, Dvl(firmware, aboard, noise_m_s=0.004))
        pilot.flies = False
        ready(firmware, aboard, pilot, *acts)
        assert firmware.until(lambda: not aboard.companion.no_flight(firmware.clock.boot_s()), 30.0, *acts)
        proposal = plan(before_dives(file), Limits(space_m=6.0, depth_space_m=2.0, speed_m_s=0.5), 300.0)
        flown = flight_plan("firmware", 3.0, [part.manoeuvre.steps for part in proposal.parts])
        crew, recorder, folder = recorded_crew(
            SteppedLink(firmware, *acts), file, "standard", tmp_path, firmware.clock, say
        )
        identifying = InTurn(folder.path, file, "standard", firmware.clock, time.monotonic)
        crew.find(1)
        wanted = Wanted(("M_u", "M_v", "M_w", "I_r"), 0.03)
        flight = PlanFlight(crew, flown, LIMITS, wanted, identifying, say)
        flight.begin(5.0)
        while not flight.over:
            flight.step()
        recorder.close()
        say(f"{flight.outcome}")
        answer = estimator(DEFAULT)(read_dive(folder.path, None, file), file, "standard", lambda *_: None)
        for p in answer.parameters:
            say(f"{p.name} {p.value:.4g} ({p.low95:.4g} to {p.high95:.4g})")
        assert flight.outcome.end is End.FINISHED
        assert flight.outcome.all_known
        assert float(np.hypot(*firmware.body.state[:2])) < 0.5
    finally:
        firmware.close()


def disarmed(pilot):
    return [m for m in pilot.of("HEARTBEAT") if m.get_srcComponent() == 1 and not m.base_mode & 128]
