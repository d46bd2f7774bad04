"""A made view: a vehicle that surges ahead of nothing real, with a sensor of each condition, at a fixed time.

And a replay that stands still.
"""

import math
from dataclasses import replace
from datetime import UTC, datetime

import numpy as np

from gcs_plugin.recording.state import Holding
from gcs_plugin.watch.picture import (
    Armed,
    Condition,
    Freshness,
    LinkRow,
    Picture,
    Said,
    SensorRow,
    ThrusterRow,
    Trace,
)
from tui.app.view import Replayed, View

NOW_S = 812.4
UNIX_S = 1_795_251_151.0  # 2026-11-21 08:52:31 UTC
NEVER_S = math.inf
FRESH, STALE, GONE = Freshness


def trace(name, unit, value, rate_hz=8.0, reference=None, age_s=0.1, freshness=FRESH):
    time_s = np.arange(NOW_S - 60.0, NOW_S - age_s + 1e-9, 1 / rate_hz)
    asked = None if reference is None else reference(time_s)
    return Trace(name, unit, time_s, value(time_s), asked, age_s, freshness)


def steps(time_s):
    return np.where((time_s // 15) % 2 == 0, 0.4, 0.1)


def surge(time_s):
    return 0.25 + 0.15 * np.tanh(3 * np.sin(2 * np.pi * (time_s - 1.0) / 30)) + 0.01 * np.sin(9 * time_s)


def sway(time_s):
    lost = (time_s > NOW_S - 22) & (time_s < NOW_S - 17)
    return np.where(lost, np.nan, 0.03 * np.sin(time_s / 3) + 0.008 * np.cos(5 * time_s))


def traces():
    made = (
        trace("u", "m/s", surge, reference=steps),
        trace("v", "m/s", sway, reference=np.zeros_like),
        trace("w", "m/s", lambda t: 0.02 * np.sin(t / 4), reference=np.zeros_like),
        trace("p", "rad/s", lambda t: 0.02 * np.sin(t)),
        trace("q", "rad/s", lambda t: 0.015 * np.cos(t)),
        trace("r", "rad/s", lambda t: 0.2 * np.sin(t / 5), reference=lambda t: 0.2 * np.sin((t + 0.6) / 5)),
        trace("depth", "m", lambda t: 2.0 + 0.05 * np.sin(t / 6), reference=lambda t: np.full_like(t, 2.0)),
        trace("altitude", "m", lambda t: 1.84 - 0.05 * np.sin(t / 6)),
        trace("heading", "rad", lambda t: -np.cos(t / 5), reference=lambda t: -np.cos((t + 0.6) / 5)),
        trace(
            "voltage",
            "V",
            lambda t: 15.9 - 0.1 * (np.sin(t / 15) > 0),
            rate_hz=1.0,
            age_s=4.2,
            freshness=STALE,
        ),
        trace("current", "A", lambda t: 12 + 4 * np.sin(t / 15), rate_hz=1.0, age_s=14.0, freshness=GONE),
    )
    return {item.name: item for item in made}


SENSORS = (
    SensorRow("DVL", "dvl", 8.0, 5.0, 0.1, FRESH, Condition.BAD, "no bottom lock for 3.2 s"),
    SensorRow("altimeter", "altitude", 8.1, 5.0, 0.1, FRESH, Condition.OK, ""),
    SensorRow("IMU", "imu", 50.0, 25.0, 0.0, FRESH, Condition.OK, ""),
    SensorRow("gyro (FOG)", "fog", 18.0, 25.0, 0.1, FRESH, Condition.DEGRADED, "18 Hz, 25 wanted"),
    SensorRow("attitude", "attitude", 25.0, 10.0, 0.0, FRESH, Condition.OK, ""),
    SensorRow("depth", "pressure", 10.0, 5.0, 0.1, FRESH, Condition.OK, ""),
    SensorRow("thruster speed", "rpm", 10.0, 10.0, 0.0, FRESH, Condition.OK, ""),
    SensorRow("battery", "battery", 1.0, 1.0, 4.2, STALE, Condition.DEGRADED, ""),
    SensorRow("GNSS", "gnss", 0.0, 1.0, NEVER_S, GONE, Condition.MISSING, ""),
)
PULSES_US = (1612.0, 1588.0, 1412.0, 1500.0, 1530.0, 1470.0, 1900.0, 1100.0)
SAID = (
    Said(UNIX_S - 310, 6, "RUVIFIST bridge: 6 devices, hovering"),
    Said(UNIX_S - 95, 5, "FF set 13247 active"),
    Said(UNIX_S - 42, 4, "DVL: bottom lock lost"),
    Said(UNIX_S - 12, 3, "thruster 4: speed controller silent"),
)


def picture():
    thrusters = [
        ThrusterRow(n + 1, str(n + 1), pulse, (pulse - 1500) * 4, 0.1, FRESH)
        for n, pulse in enumerate(PULSES_US)
    ]
    thrusters[3] = replace(thrusters[3], age_s=14.0, freshness=GONE)
    thrusters[4] = replace(thrusters[4], age_s=2.1, freshness=STALE)
    return Picture(
        now_s=NOW_S,
        armed=Armed.ARMED,
        armed_age_s=0.4,
        links=(LinkRow("udpin:127.0.0.1:14550", 1, 1, 0.4, 0.02, 214.0, False),),
        sensors=SENSORS,
        traces=traces(),
        thrusters=tuple(thrusters),
        ff_mode=1,
        ff_mode_age_s=0.6,
        active_set=None,
        active_set_age_s=NEVER_S,
        configuration="hovering",
        said=SAID,
        twins="",
    )


def recording(lasted_s=751.0, disk_left_s=41 * 3600.0, lost=0, **more):
    """One that has just reported."""
    began_utc = datetime.fromtimestamp(UNIX_S - lasted_s, UTC).isoformat()
    state = {"written_unix_s": UNIX_S, "notices": ()} | more
    return Holding(
        4711, "tcp:127.0.0.1:5790", (), "dives/deck", began_utc, 1000, 50_000, lost, disk_left_s, **state
    )


def view():
    return View(picture(), UNIX_S, recording())


class FixedViews:
    """Views of one instant; counts what it is asked for."""

    def __init__(self, shown=None):
        self.shown = shown or view()
        self.forced = 0
        self.periods_s = []

    def then(self, shown):
        """A step after which the app is shown this, and looks."""

        def step(app):
            self.shown = shown
            app._refresh_view()

        return step

    def view(self):
        return self.shown

    def set_period(self, period_s):
        self.periods_s.append(period_s)

    def force_off(self):
        self.forced += 1


def replayed(**changed):
    return replace(Replayed("2026-11-21T0352Z-hovering", picture(), 192.0, 807.0, 4.0, False), **changed)


class StillReplay:
    """A replay that stands still, and counts what it is told."""

    def __init__(self, shown=None):
        quiet = replace(picture(), said=(), armed_age_s=0.2)
        self.now, self.told = shown or replayed(picture=quiet), []

    def shown(self):
        return self.now

    def toggle(self):
        self.told.append("toggle")

    def seek(self, by_s):
        self.told.append(by_s)

    def faster(self, steps):
        self.told.append(f"{steps:+d}")
