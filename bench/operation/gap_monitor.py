"""The live gap monitor on simulated dives: how soon it finds an effect that sets in, which it names, false alarms.

The dives are of the paper's vehicle without bytes (`bridge.simulator.direct`), with the noise of its sensors; their
readings go into the monitor itself, faster than real time. The monitor's model has masses and dampings that are off by
as much as those of an identification.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from bench.campaigns import CONFIGURATIONS, VEHICLE
from bench.remembered import Data, Remembered
from bench.stamp import PAPERS_VEHICLE, reached, stamp
from bench.words import blocks, in_a_word, paragraph, table
from bridge.simulator.direct import Itinerary, TruthRun, simulate_truth
from bridge.simulator.missions import mission_named
from bridge.simulator.truth import load_truth
from bridge.vehicle.coefficients import BY_NAME
from bridge.vehicle.config import VehicleFile, load_vehicle
from bridge.vehicle.legs import Leg, Mission
from bridge.vehicle.references import Reference
from bridge.wire.readings import Reading
from gcs_plugin.monitor.live import LiveGap

SOURCES = (reached("bench/operation/gap_monitor.py"), *PAPERS_VEHICLE)

MASS_OFF, DAMPING_OFF = 0.01, 0.03
"""Relative standard deviations of the model's coefficients from the truth."""

NOT_IDENTIFIED = ("I_p", "I_q", "D_p", "D_q")
"""No thruster pushes the vehicle in roll or pitch, so that no identification of its dives tells these."""

BEFORE_S, AFTER_S = 150.0, 150.0
WITHIN_S, GOAL = 60.0, 0.9
DVL_NOISE_M_S, GYRO_NOISE_RAD_S, FOG_NOISE_RAD_S = 0.004, 0.0007, 0.0001
CALM_SEED, ONSET_SEED = 8100, 8300

Effects = dict[str, float]


@dataclass(frozen=True)
class Onset:
    """An effect, drawn anew for each dive; `named`: how the label of the right cause begins, of these effects;
    `mission`: which the vehicle dives, None for that of its configuration."""

    words: str
    draw: Callable[[np.random.Generator], Effects]
    named: Callable[[Effects], str]
    mission: Mission | None = None


def _propeller(first: int, last: int, rng: np.random.Generator) -> Effects:
    return {f"T{rng.integers(first, last + 1)}_gain": float(rng.uniform(0.3, 0.7))}


def _current(rng: np.random.Generator) -> Effects:
    speed, angle = rng.uniform(0.05, 0.2), rng.uniform(-math.pi, math.pi)
    return {"current_n": float(speed * math.cos(angle)), "current_e": float(speed * math.sin(angle))}


def _tether(rng: np.random.Generator) -> Effects:
    return {"tether": float(rng.uniform(0.5, 3.0))}


def _weed(rng: np.random.Generator) -> Effects:
    return {"X_uu": float(rng.uniform(40.0, 100.0)), "Y_vv": float(rng.uniform(60.0, 150.0))}


def _thruster(effects: Effects) -> str:
    return f"weak_thruster of thruster {next(iter(effects))[1]}"


UP_AND_DOWN = Mission(
    "up and down",
    tuple(Leg(10.0, "yo-yo", "diving", heave_m_s=w, transient_s=3.0) for w in (0.1, 0.0, -0.1, 0.0) * 15),
    start_depth_m=2.0,
)

ONSETS = {
    "propeller": Onset("a fouled propeller, 30 to 70 % less thrust", partial(_propeller, 1, 4), _thruster),
    "current": Onset("a current of 0.05 to 0.2 m/s", _current, lambda _: "steady_current"),
    "tether": Onset("a tether snags, 0.5 to 3 N/m", _tether, lambda _: "tether"),
    "weed": Onset("weed on the hull, drag of 40 to 100 N s2/m2 ahead", _weed, lambda _: "fouling"),
    "vertical": Onset(
        "a fouled vertical propeller, while the depth is held", partial(_propeller, 5, 8), _thruster
    ),
    "up and down": Onset(
        "a fouled vertical propeller, while the depth changes at 0.1 m/s",
        partial(_propeller, 5, 8),
        _thruster,
        UP_AND_DOWN,
    ),
}


@dataclass(frozen=True)
class Part:
    """A mission from a time on, for so long."""

    mission: Mission
    from_s: float
    duration_s: float

    @property
    def start_depth_m(self) -> float:
        return self.mission.reference(self.from_s).depth_m

    @property
    def start_heading_rad(self) -> float:
        return self.mission.reference(self.from_s).heading_rad

    def reference(self, time_s: float) -> Reference:
        """The mission's reference so long after the start."""
        return self.mission.reference(self.from_s + time_s)


def page(cache: Path, calm: int, onsets: int) -> str:
    """The section of docs/benchmarks.md, of `calm` whole missions and `onsets` dives of each effect, half and half of
    both configurations."""
    kept = Remembered(cache / f"gap-monitor-{stamp(*SOURCES)}.jsonl")
    jobs = {f"calm {n}": partial(calm_dive, CONFIGURATIONS[n % 2], CALM_SEED + n) for n in range(calm)}
    jobs |= {
        f"{name} {n}": partial(onset_dive, name, CONFIGURATIONS[n % 2], ONSET_SEED + n)
        for name in ONSETS
        for n in range(onsets)
    }
    return words(kept.fill(jobs, "gap monitor"))


def calm_dive(configuration: str, seed: int) -> Data:
    """A whole mission without any effect: its hours, and the times of alarms."""
    file = load_vehicle(f"{VEHICLE}:{configuration}")
    mission = mission_named(configuration, file.vehicle.configurations[configuration])
    alarms = _alarms(file, configuration, mission, seed, {}, 0.0)
    return {"hours": mission.duration_s / 3600, "alarms": [time_s for time_s, _ in alarms]}


def onset_dive(name: str, configuration: str, seed: int) -> Data:
    """A part of a mission in which an effect sets in; `after_s`: from its onset to the first alarm, None without one;
    `early`: alarms before; `named`: whether the likeliest cause was the right one."""
    rng = np.random.default_rng([seed, *name.encode()])
    onset = ONSETS[name]
    effects = onset.draw(rng)
    file = load_vehicle(f"{VEHICLE}:{configuration}")
    mission = onset.mission or mission_named(configuration, file.vehicle.configurations[configuration])
    at_s = float(rng.uniform(BEFORE_S, mission.duration_s - AFTER_S))
    part = Part(mission, at_s - BEFORE_S, BEFORE_S + AFTER_S)
    alarms = _alarms(file, configuration, part, int(rng.integers(2**31)), effects, BEFORE_S)
    after = [(time_s - BEFORE_S, label) for time_s, label in alarms if time_s >= BEFORE_S]
    return {
        "effects": effects,
        "after_s": after[0][0] if after else None,
        "early": len(alarms) - len(after),
        "named": bool(after) and after[0][1].startswith(onset.named(effects)),
    }


def _alarms(
    file: VehicleFile, configuration: str, mission: Itinerary, seed: int, effects: Effects, onset_s: float
) -> list[tuple[float, str]]:
    """Time of each alarm, s after the start, and the label of its likeliest cause, "" for none."""
    truth = load_truth(file, configuration)
    run = simulate_truth(
        file, configuration, mission, seed=seed, truth=replace(truth, onset=effects, onset_s=onset_s)
    )
    rng = np.random.default_rng(seed + 1)
    off = {
        name: value
        * math.exp((MASS_OFF if BY_NAME[name].kind == "mass" else DAMPING_OFF) * rng.standard_normal())
        for name, value in truth.model.items()
        if name not in NOT_IDENTIFIED
    }
    number = file.vehicle.veh_cfg(configuration)
    live = LiveGap(file, {BY_NAME[name].parameter_id(number): value for name, value in off.items()})
    alarms, before = [], False
    for reading in readings(run, number, rng):
        live.take(reading)
        gap = live.gap
        now = gap is not None and gap.since_s is not None
        if gap is not None and now and not before:
            alarms.append((reading.time_s, gap.causes[0].label if gap.causes else ""))
        before = now
    return alarms


def readings(run: TruthRun, veh_cfg: int, rng: np.random.Generator) -> list[Reading]:
    """The readings that the bridge would send: commands, attitude, rates, and a velocity at every second tick."""
    out = [Reading("veh_cfg", 0.0, (float(veh_cfg),)), Reading("alive", math.nan, (1.0, 12.0, 0.0))]
    rates = run.nu[:, 3:] + GYRO_NOISE_RAD_S * rng.standard_normal((len(run.time_s), 3))
    fog = run.nu[:, 5] + FOG_NOISE_RAD_S * rng.standard_normal(len(run.time_s))
    velocity = run.nu[:, :3] + DVL_NOISE_M_S * rng.standard_normal((len(run.time_s), 3))
    for k, time_s in enumerate(run.time_s.tolist()):
        attitude = (*run.state[k, 3:7].tolist(), *rates[k].tolist())
        out += [
            Reading("pwm", time_s, tuple(run.actuations[k].pwm_us)),
            Reading("imu", time_s, (0.0, 0.0, -9.8, *rates[k].tolist(), math.nan)),
            Reading("fog", time_s, (float(fog[k]),)),
            Reading("attitude", time_s, attitude),
        ]
        if k % 2 == 0:
            out.append(Reading("dvl", time_s, (*velocity[k].tolist(), DVL_NOISE_M_S)))
    return out


def words(results: dict[str, Data]) -> str:
    calm = [data for key, data in results.items() if key.startswith("calm ")]
    hours = sum(data["hours"] for data in calm)
    false = sum(len(data["alarms"]) for data in calm)
    rows = []
    in_time_of_all = flown = 0
    for name, onset in ONSETS.items():
        dives = [data for key, data in results.items() if key.startswith(f"{name} ")]
        after = [data["after_s"] for data in dives if data["after_s"] is not None]
        in_time = sum(after_s <= WITHIN_S for after_s in after)
        named = sum(data["named"] for data in dives)
        share = f"{named / len(after):.0%}" if after else "-"
        median = f"{np.median(after):.0f} s" if after else "-"
        shares = f"{in_time / len(dives):.0%}", f"{len(after) / len(dives):.0%}"
        rows.append((onset.words, len(dives), *shares, median, share))
        in_time_of_all, flown = in_time_of_all + in_time, flown + len(dives)
    early = sum(data["early"] for key, data in results.items() if not key.startswith("calm "))
    minutes = sum(not key.startswith("calm ") for key in results) * BEFORE_S / 60
    within = f"found within {WITHIN_S:g} s", f"within {AFTER_S:g} s"
    return blocks(
        "## The live gap monitor",
        paragraph(
            "`watch`, the app and MAVProxy compare the vehicle with the model in force, second by second, and raise an",
            "alarm once it has departed from it for half a minute. The paper's vehicle dives both its missions, and an",
            "effect sets in at a drawn moment, at rest or under way; the model's masses are off by",
            f"{100 * MASS_OFF:g} %, its dampings by {100 * DAMPING_OFF:g} % (standard deviations); of roll and pitch,",
            "which no thruster pushes, it has none, as an identification of these missions has none. `named`: the",
            "likeliest cause at the moment of the alarm is the right one, and the right thruster, as a share of the",
            f"dives with an alarm within {AFTER_S:g} s. The vehicle is 1 N light, so that each of its four vertical",
            "thrusters holds 0.25 N of it while the depth is held: what it then lacks is less than the 0.35 N",
            "(standard deviation) by which the simulated sea pushes. It shows in roll and pitch: all four answer the",
            "noise of the depth and of the DVL alike, by which a sound vehicle neither rolls nor pitches. A model",
            "without either names the thruster by that, and not how much it lacks.",
        ),
        table(("what sets in", "dives", *within, "median time", "named"), rows),
        paragraph(
            f"Of all {flown}, {in_time_of_all / max(flown, 1):.0%} were found within {WITHIN_S:g} s: goal of",
            f"{GOAL:.0%} {in_a_word(in_time_of_all >= GOAL * flown)}.",
            f"False alarms: {false} in {hours:.1f} h of {len(calm)} whole missions without any effect, and {early}",
            f"in the {minutes:.0f} minutes before the onsets.",
        ),
    )
