"""The monitor of a vehicle on the air: readings and parameters in, its gap out. Times are the vehicle's boot times."""

import math
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Mapping
from itertools import pairwise
from typing import Final

import numpy as np

from bridge.arrays import Array
from bridge.errors import ConfigError
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.mode import Mode
from bridge.vehicle.parameters import ACTIVE, set_crc, vehicle_table
from bridge.wire.readings import Reading
from gcs_plugin.monitor.gap import Gap, GapMonitor
from gcs_plugin.monitor.model import Model, model_of
from gcs_plugin.monitor.predictor import SECOND, STEP_S, Predictor, Second
from gcs_plugin.params.meaning import coefficient_of
from gcs_plugin.peers import Heartbeat, heartbeat_read
from gcs_plugin.sequences import ROUND_S

NEEDED: Final = {"dvl": "DVL velocity", "imu": "rates", "attitude": "attitude", "pwm": "pulses"}
"""The signals that a comparison needs, in words."""

PATIENT_BEATS: Final = 5
"""After this many heartbeats without a signal it counts as not sent."""

LONGEST_HOLE_S: Final = 1.0
LATE_S: Final = 3.0
"""A signal later than the others by that much has fallen silent."""

SETTLED_S: Final = 2.0
"""Parameters are taken over when none has changed for so long: a set is written line by line."""

STALE_S: Final = 15.0
"""The gap is unknown where nothing could be judged for so long."""

KEPT_S: Final = 8.0


class _Samples:
    """The last seconds of a signal, values (w,) at rising times."""

    def __init__(self) -> None:
        self.time_s: list[float] = []
        self.values: list[tuple[float, ...]] = []

    @property
    def last_s(self) -> float:
        return self.time_s[-1] if self.time_s else -math.inf

    def put(self, time_s: float, values: tuple[float, ...]) -> None:
        if self.time_s and len(values) != len(self.values[-1]):
            self.clear()
        if time_s > self.last_s:
            self.time_s.append(time_s)
            self.values.append(values)

    def clear(self) -> None:
        self.time_s, self.values = [], []

    def drop(self, before_s: float) -> None:
        """Forget all older values."""
        self._drop(bisect_left(self.time_s, before_s))

    def drop_used(self, end_s: float) -> None:
        """Forget all older values but the last, from which on the next second begins."""
        self._drop(max(bisect_right(self.time_s, end_s) - 1, 0))

    def _drop(self, count: int) -> None:
        del self.time_s[:count], self.values[:count]

    def covers(self, start_s: float, end_s: float) -> bool:
        """Whether values lie at both ends or beyond, and no hole that reaches in between them is long."""
        if not self.time_s[0] <= start_s < end_s <= self.last_s:
            return False
        first, last = bisect_right(self.time_s, start_s) - 1, bisect_left(self.time_s, end_s)
        return all(b - a <= LONGEST_HOLE_S for a, b in pairwise(self.time_s[first : last + 1]))

    def at(self, time_s: Array) -> Array:
        """Values (n, w), straight between samples."""
        table = np.array(self.values)
        return np.stack([np.interp(time_s, self.time_s, column) for column in table.T], axis=1)

    def held(self, time_s: Array) -> Array:
        """Values (n, w), each held until the next."""
        places = np.searchsorted(self.time_s, time_s + 1e-6, side="right") - 1
        return np.array(self.values)[np.maximum(places, 0)]


class LiveGap:
    """Takes readings and parameters; `gap` is None while it can't be known: without a model, a vehicle file, a DVL, or
    while the vehicle is disarmed.

    `held`: values of its parameters by id, as they were last accepted; the vehicle file's are those it starts with.
    """

    def __init__(self, file: VehicleFile | None, held: Mapping[str, float]) -> None:
        self._file = file
        rows = () if file is None else vehicle_table(file.vehicle)
        self._rows = {row.name: row for row in rows}
        self._values = {row.name: row.default for row in rows}
        self._values |= {name: value for name, value in held.items() if name in self._rows}
        # As the vehicle stated them: the values that were written, and the number of the set in force.
        self._staged: dict[str, float] = {}
        self._active: float | None = None
        self._changed_s = -math.inf
        self._armed = self._acts = self._has_autopilot = False
        self._beats, self._unheard = 0, set(NEEDED)
        self._veh_cfg: float | None = None
        self._signals = {name: _Samples() for name in (*NEEDED, "fog", "battery")}
        self._next_s = math.nan
        self._newest_s = self._judged_s = -math.inf
        self._work: tuple[Predictor, GapMonitor] | None = None
        self._is_made = False

    @property
    def gap(self) -> Gap | None:
        stale = self._newest_s > self._judged_s + STALE_S
        return None if self._work is None or not self._armed or stale else self._work[1].gap

    @property
    def lacks(self) -> str:
        """The signals, file or model that a vehicle lacks to be compared with its model, in words; "" for none."""
        if self._beats < PATIENT_BEATS:
            return ""
        if self._file is None:
            return "needs a vehicle file"
        if self._unheard:
            unheard = ", ".join(words for name, words in NEEDED.items() if name in self._unheard)
            return f"no {unheard} from our bridge"
        if not (self._armed and self._is_made and self._work is None):
            return ""
        # A vehicle takes no mode that acts without a model.
        return (
            "the model that it flies with is not known here"
            if self._acts
            else "no identified model is known here"
        )

    def parameter(self, name: str, value: float) -> None:
        """Take a parameter that the vehicle states. A written set holds once it is in force, as far as known."""
        if name == ACTIVE:
            holds = self._active not in (None, value)
            self._active = value
        elif coefficient_of(name) is not None:
            self._staged[name] = value
            holds = self._active is None
        else:
            return
        if holds or self._active == set_crc(self._staged):
            stated = {name: value for name, value in self._staged.items() if name in self._values}
            if self._values != self._values | stated:
                self._values |= stated
                self._changed_s, self._is_made = self._newest_s, False

    def take(self, reading: Reading) -> None:
        self._unheard.discard(reading.signal)
        if reading.signal == "alive":
            self._beats += 1
            self._beat(heartbeat_read(reading.values, reading.time_s))
        elif reading.signal == "ff_mode":
            self._acts = reading.values[0] in (Mode.ALONE, Mode.BOTH)
        elif (
            reading.signal == "veh_cfg"
            and reading.values[0] != self._veh_cfg
            and math.isfinite(reading.values[0])
        ):
            self._veh_cfg, self._is_made = reading.values[0], False
        samples = self._signals.get(reading.signal)
        if samples is None or self._file is None or not self._armed:
            return
        # A battery's message carries no time; it changes slowly.
        time_s = reading.time_s if math.isfinite(reading.time_s) else self._newest_s
        if math.isfinite(time_s - self._newest_s):
            # An attitude's time goes round after 49.7 days, and those of the others go on.
            time_s += ROUND_S * round((self._newest_s - time_s) / ROUND_S)
        if time_s < self._newest_s - 2 * KEPT_S:
            self._begin_again()
        self._newest_s = max(self._newest_s, time_s)
        if all(map(math.isfinite, _wanted(reading))):
            samples.put(time_s, _wanted(reading))
        # Without a model, or while a signal is silent, no second is judged that would drop them.
        if samples.time_s and samples.time_s[0] < self._newest_s - 2 * KEPT_S:
            samples.drop(self._newest_s - KEPT_S)
        if reading.signal == "dvl":
            self._go_on()

    def _beat(self, beat: Heartbeat) -> None:
        """Follow whether the vehicle is armed, by its autopilot once that is heard: a camera beats too."""
        self._has_autopilot = self._has_autopilot or beat.is_autopilot
        if not (beat.is_autopilot if self._has_autopilot else beat.is_vehicle):
            return
        if beat.armed and not self._armed:
            self._begin_again()
            self._is_made = False
        self._armed = beat.armed

    def _begin_again(self) -> None:
        """Start from here: after a hole in the readings, or a new boot."""
        for samples in self._signals.values():
            samples.clear()
        self._newest_s = self._changed_s = self._judged_s = -math.inf
        self._lose_track()

    def _lose_track(self) -> None:
        self._next_s = math.nan
        if self._work is not None:
            self._work[0].reset()

    def _go_on(self) -> None:
        """Work through the seconds that are complete."""
        if not self._is_made:
            if self._newest_s < self._changed_s + SETTLED_S:
                return
            self._make()
        needed = [self._signals[name] for name in NEEDED]
        if self._work is None or any(not samples.time_s for samples in needed):
            return
        if math.isnan(self._next_s):
            self._next_s = max(samples.time_s[0] for samples in needed)
            self._judged_s = max(self._judged_s, self._next_s)
        while True:
            end_s = self._next_s + SECOND * STEP_S
            if min(samples.last_s for samples in needed) < end_s:
                if self._newest_s > end_s + LATE_S:
                    self._lose_track()
                    for samples in self._signals.values():
                        samples.drop(self._newest_s - STEP_S)
                return
            self._second(self._next_s, end_s)
            if math.isnan(self._next_s):
                return
            self._next_s = end_s
            for samples in self._signals.values():
                samples.drop_used(end_s)

    def _second(self, start_s: float, end_s: float) -> None:
        assert self._work is not None
        if not all(self._signals[name].covers(start_s, end_s) for name in NEEDED):
            self._lose_track()
            for samples in self._signals.values():
                samples.drop(end_s)
            return
        predictor, monitor = self._work
        second = self._cut(start_s, end_s)
        if second.pwm.shape[1] != predictor.thrusters:
            return
        drift = predictor.step(second)
        if drift is not None:
            monitor.add(drift)
            self._judged_s = end_s

    def _cut(self, start_s: float, end_s: float) -> Second:
        assert self._file is not None
        signals, time_s = self._signals, np.linspace(start_s, end_s, SECOND + 1)
        rates = signals["imu"].at(time_s)
        fog = signals["fog"]
        if fog.time_s and fog.covers(start_s, end_s):
            rates[:, 2] = fog.at(time_s)[:, 0]
        dvl = self._file.vehicle.sensors.dvl
        arm = np.zeros(3) if dvl is None else np.array(dvl.mounting.position_m)
        velocity = signals["dvl"].at(time_s) - np.cross(rates, arm)
        battery = signals["battery"]
        volts = battery.values[-1][0] if battery.values else math.nan
        attitude = signals["attitude"].held(time_s)
        return Second(np.hstack([velocity, rates]), attitude, signals["pwm"].held(time_s[:-1]), volts)

    def _make(self) -> None:
        """Make the model of the parameters in force."""
        self._is_made, self._work = True, None
        model = self._model()
        if model is not None:
            self._work = (Predictor(model), GapMonitor(model))
            self._next_s = math.nan

    def _model(self) -> Model | None:
        assert self._file is not None
        vehicle = self._file.vehicle
        try:
            said = self._veh_cfg
            name = self._file.configuration if said is None else None
            name = name or vehicle.configuration_at(None if said is None else round(said))
            number = vehicle.veh_cfg(name)
            coefficients = {
                row.coefficient: self._values[row.name]
                for row in self._rows.values()
                if row.veh_cfg == number
            }
            return model_of(coefficients, self._file, name)
        except ConfigError:
            return None


_PARTS: Final[Mapping[str, Callable[[tuple[float, ...]], tuple[float, ...]]]] = {
    "dvl": lambda values: values[:3],
    "imu": lambda values: values[3:6],
    "attitude": lambda values: values[:4],
    "battery": lambda values: values[:1],
}


def _wanted(reading: Reading) -> tuple[float, ...]:
    part = _PARTS.get(reading.signal)
    return reading.values if part is None else part(reading.values)
