"""How much sooner a plan that the companion flies knows the masses than laps flown by hand, with the real firmware.

Both fly until they know the masses equally well; how well they know the drags then is measured as well. Identifications
during the flight count with the time that they take of this computer's processors.
"""

import shutil
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from bench.ardusub.firmware import SETTINGS, Firmware, SteppedFirmware, SteppedLink
from bench.ardusub.flight import Aboard, Pilot, fly, vehicle_file
from bench.operation.flying import LIMITS, as_well, flight, plan_of
from bridge.ardusub.companion import companion_file
from bridge.simulator.json_plant import json_body
from bridge.simulator.missions import AFLOAT_M, hovering
from bridge.simulator.truth import Truth
from bridge.vehicle.coefficients import MASSES
from bridge.vehicle.config import VehicleFile, load_vehicle
from bridge.vehicle.legs import Mission
from gcs_plugin.dives.folder import ABOUT
from gcs_plugin.flying.plan import FlightPlan
from gcs_plugin.flying.run import Outcome, Wanted
from identify.estimators.table import DEFAULT, estimator
from identify.ingest.open import read_dive
from identify.planning.limits import Limits
from identify.planning.propose import DOFS_PLANNED
from tui.flight_recording import widths_of

BATTERY: Final = {"BATT_MONITOR": 4, "BATT_VOLT_PIN": 13, "BATT_CURR_PIN": 12, "SIM_BATT_VOLTAGE": 16}
"""A battery whose voltage the limits can hold."""
WITHIN: Final = Limits(space_m=4.5, depth_space_m=0.9, speed_m_s=0.5)
READY_S: Final = 60.0
FLIGHTS: Final = 5
WIDEST, EACH = "widest", "each"
"""The aim of a flight: every mass as well as laps know the one they know worst, or each as well as laps do."""
SLOWER: Final = ("rows at 0.3", "rows at 0.2")


def laps() -> Mission:
    """The paper's hovering, its rows at the greatest of their three speeds alone, and its turns."""
    legs = tuple(leg for leg in hovering().legs if not leg.name.startswith(SLOWER))
    return Mission("laps", legs, start_depth_m=AFLOAT_M)


def measured(path: Path, folder: Path, truth: Truth) -> dict[str, Any]:
    """Fly the laps once, then the plan in several seas until as much is known; `folder` is made anew.

    Of the laps: their duration `hand_s` and relative interval widths `hand`. Of each flight: `known_s` until that was
    known, `identify_s` for one identification, the widths `flown`, and `masses` as [true, value, low, high].
    """
    shutil.rmtree(folder, ignore_errors=True)
    vehicle = vehicle_file(folder)
    file, by_sticks = load_vehicle(str(vehicle)), laps()
    configuration = next(iter(file.vehicle.configurations))
    hand = fly(path, folder / "laps", by_sticks, truth, depth_m=LIMITS.deepest_m)
    by_hand = widths_of(hand.recording, str(vehicle), configuration)
    masses = [MASSES[dof].name for dof in DOFS_PLANNED]
    flown_plan, widest = plan_of(file, WITHIN, masses), as_well(by_hand, masses)
    flights: dict[str, list[dict[str, Any]]] = {WIDEST: [], EACH: []}
    for way, wanted in ((WIDEST, widest), (EACH, replace(widest, each=by_hand))):
        for seed in range(1, FLIGHTS + 1):
            root = folder / f"{way}-{seed}"
            outcome, took_s = flown(path, root, vehicle, truth, flown_plan, wanted, seed)
            flights[way].append(
                {
                    "known_s": outcome.known_s,
                    "identify_s": float(np.mean(took_s)),
                    "flown": {name: outcome.widths[name] for name in flown_plan.coefficients},
                    "masses": masses_of(root, file, configuration, truth, wanted.names),
                }
            )
    return {
        "hand_s": by_sticks.duration_s,
        "share": widest.share,
        "hand": {name: by_hand[name] for name in flown_plan.coefficients},
        "flights": flights,
    }


def masses_of(
    root: Path, file: VehicleFile, configuration: str, truth: Truth, names: Sequence[str]
) -> dict[str, list[float]]:
    """Masses identified from the ground's recording in `root`, each [true, value, low, high] if thrust is exact."""
    (about,) = root.glob(f"*/{ABOUT}")
    answer = estimator(DEFAULT)(read_dive(about.parent, None, file), file, configuration, lambda *_: None)
    return {
        each.name: [truth.model[each.name], each.given_thrust, *each.at_thrust]
        for each in answer.parameters
        if each.name in names
    }


def flown(
    path: Path,
    folder: Path,
    vehicle: Path,
    truth: Truth,
    flown_plan: FlightPlan,
    wanted: Wanted,
    seed: int,
) -> tuple[Outcome, list[float]]:
    """Fly a plan from the surface until all that is wanted is known; also the seconds of each identification."""
    file = companion_file(load_vehicle(str(vehicle)))
    configuration = next(iter(file.vehicle.configurations))
    firmware = SteppedFirmware(
        Firmware(path, folder, json_body(file, configuration, truth, seed=seed), {**SETTINGS, **BATTERY})
    )
    try:
        clock = firmware.clock
        aboard = Aboard(firmware.process, file, folder / "ring", seed)
        pilot = Pilot(firmware.ground, clock)
        pilot.sticks = {}
        firmware.until(lambda: pilot.standing_by, READY_S, aboard, pilot.step)
        firmware.until(lambda: not aboard.companion.no_flight(clock.boot_s()), READY_S, aboard, pilot.step)
        link = SteppedLink(firmware, aboard)
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
