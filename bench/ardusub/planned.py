"""A plan that the companion flies beside the real firmware, against the paper's mission flown by sticks: time to know
as much.

Beside the flight identifications take the time that this computer's processors spend on them.
"""

import shutil
import time
from pathlib import Path
from typing import Any, Final

from bench.ardusub.firmware import SETTINGS, Firmware, Passing, Stepped
from bench.ardusub.flight import Aboard, Pilot, fly, vehicle_file
from bench.flying import LIMITS, as_well, figures, flight, plan_of
from bridge.ardusub.companion import companion_file
from bridge.simulator.json_plant import json_body
from bridge.simulator.missions import hovering
from bridge.simulator.truth import Truth
from bridge.vehicle.config import load_vehicle
from gcs_plugin.flying.plan import FlightPlan
from gcs_plugin.flying.run import Outcome, Wanted
from identify.planning.limits import Limits
from tui.flying import widths_of

BATTERY: Final = {"BATT_MONITOR": 4, "BATT_VOLT_PIN": 13, "BATT_CURR_PIN": 12, "SIM_BATT_VOLTAGE": 16}
"""A battery whose voltage the limits can hold."""
WITHIN: Final = Limits(space_m=4.5, depth_space_m=0.9, speed_m_s=0.5)
READY_S: Final = 60.0


def measured(path: Path, folder: Path, truth: Truth) -> dict[str, Any]:
    """Laps by hand, and a plan flown until as much is known; `folder` is made anew."""
    shutil.rmtree(folder, ignore_errors=True)
    vehicle = vehicle_file(folder)
    file, laps = load_vehicle(str(vehicle)), hovering()
    configuration = next(iter(file.vehicle.configurations))
    hand = fly(path, folder / "laps", laps, truth, depth_m=LIMITS.deepest_m)
    by_hand = widths_of(hand.recording, str(vehicle), configuration)
    flown_plan = plan_of(file, WITHIN)
    wanted = as_well(by_hand, flown_plan)
    outcome, took_s = flown(path, folder / "planned", vehicle, truth, flown_plan, wanted)
    return figures(laps.duration_s, by_hand, wanted, outcome, took_s)


def flown(
    path: Path,
    folder: Path,
    vehicle: Path,
    truth: Truth,
    flown_plan: FlightPlan,
    wanted: Wanted,
    seed: int = 1,
) -> tuple[Outcome, list[float]]:
    """Fly a plan from the surface until all that is wanted is known; the seconds of each identification."""
    file = companion_file(load_vehicle(str(vehicle)))
    configuration = next(iter(file.vehicle.configurations))
    firmware = Stepped(
        Firmware(path, folder, json_body(file, configuration, truth, seed=seed), {**SETTINGS, **BATTERY})
    )
    try:
        clock = firmware.clock
        aboard = Aboard(firmware.process, file, folder / "ring", seed)
        pilot = Pilot(firmware.ground, clock)
        pilot.sticks = {}
        firmware.until(lambda: pilot.standing_by, READY_S, aboard, pilot.step)
        firmware.until(lambda: not aboard.companion.no_flight(clock.boot_s()), READY_S, aboard, pilot.step)
        link = Passing(firmware, aboard)
        return flight(
            link,
            clock,
            load_vehicle(str(vehicle)),
            configuration,
            flown_plan,
            wanted,
            folder,
            time.process_time,
        )
    finally:
        firmware.close()
