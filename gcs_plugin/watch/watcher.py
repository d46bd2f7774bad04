"""Turn frames into a `Picture`: the state of one vehicle, whichever other senders are on its links.

It watches the first system with a vehicle's heartbeat, or the system it is given. As soon as the system named in the
vehicle file sends a heartbeat, it watches that one.
"""

import math
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.errors import ConfigError
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.mode import Mode
from bridge.vehicle.parameters import ACTIVE, COMMIT
from bridge.wire.framing import Frame, decode
from bridge.wire.readings import OF_THE_CONTRACT, Values
from bridge.wire.readings import decode as decode_reading
from bridge.wire.status_codes import CrewText, Topic
from gcs_plugin.monitor.gap import Gap
from gcs_plugin.monitor.live import NEEDED, STALE_S, LiveGap
from gcs_plugin.peers import COMPANIONS, GONE_S, Heartbeat, Peer, Peers, Source
from gcs_plugin.watch.alarms import CRITICAL, SHIPPED, Alarms, AlarmTrace, Settings
from gcs_plugin.watch.channels import FROM_ANYONE, TELLING, Channel, StatusTexts, heard
from gcs_plugin.watch.link_rows import LinkRows
from gcs_plugin.watch.past_gap import PastGap
from gcs_plugin.watch.picture import Armed, LinkRow, Picture, Said
from gcs_plugin.watch.sensors import SENSORS, always, expected_hz, sensor_rows
from gcs_plugin.watch.thruster_rows import thruster_names, thruster_rows
from gcs_plugin.watch.traces import Traces

TEXTS_KEPT: Final = 20
TWICE_WITHIN_S: Final = 1.0
"""The same frame again within this time came over a second link."""

SETTLED_BEATS: Final = 3
SETTLING_S: Final = 0.5
"""A component with this many heartbeats, this far apart, belongs to a vehicle that a crew looks at: it stays watched
however long it is silent."""

PASSED_S: Final = 10.0
"""A vehicle with fewer heartbeats than SETTLED_BEATS and none for this long only passed by: if another vehicle sends
heartbeats, that one is watched."""

SILENT_S: Final = 3.0
"""A longer time between two heartbeats means that the vehicle was switched off and on, or begins another dive."""

HAS_DATE_UNIX_S: Final = 1e9
_HEARTBEAT: Final[int] = dialect.MAVLINK_MSG_ID_HEARTBEAT
_SYSTEM_TIME: Final[int] = dialect.MAVLINK_MSG_ID_SYSTEM_TIME
_PARAM_VALUE: Final[int] = dialect.MAVLINK_MSG_ID_PARAM_VALUE
_OF_WORDS: Final = frozenset((_HEARTBEAT, dialect.MAVLINK_MSG_ID_STATUSTEXT))
_SILENT_BEAT: Final = Heartbeat(0, 0, 0, 0, -math.inf)

_OTHERS: Final = (
    "rates", "velocity", "velocity_ned", "depth", "alive", "clock", "tau_pid", "tau_ff", "tau_cmd", "nu_fb", "nu_ref",
    "ff_mode", "veh_cfg", "flight",
)  # fmt: skip


class Watcher:
    """Feed it every frame, of all links and both directions; ask it for a picture as often as needed.

    vehicle: the vehicle file, None if there is none.
    system: the vehicle to watch; by default that of the file, otherwise the first that sends heartbeats, unless it
        only passes by.
    unix_at_zero_s: Unix time minus the time of `feed`; without it, texts are dated by the vehicle's clock.
    settings: those of the alarms.
    accepted: returns the parameters last uploaded to a system, by id: the model in force as long as the vehicle itself
        states no others.
    recorded: returns the recordings of the dive so far, none if it is not recorded.

    `peers` are all senders heard.
    """

    def __init__(
        self,
        vehicle: VehicleFile | None,
        system: int | None = None,
        unix_at_zero_s: float = math.nan,
        settings: Settings = SHIPPED,
        accepted: Callable[[int], Mapping[str, float]] = lambda _: {},
        recorded: Callable[[], Sequence[Path]] = tuple,
    ) -> None:
        self._file, self._settings, self._accepted, self._recorded = vehicle, settings, accepted, recorded
        self._past_gap: PastGap | None = None
        self._vehicle = None if vehicle is None else vehicle.vehicle
        self._asked_for = system
        self._ground_unix_s = unix_at_zero_s
        self.peers = Peers()
        self._links = LinkRows(self.peers)
        self._begin(system)

    def _begin(self, system: int | None) -> None:
        """Forget everything heard, and watch `system` from now on."""
        self.system = system
        self._system_beats: dict[int, Heartbeat] = {}
        # Of components heard again after a silence: whether they were disarmed before it.
        self._rested: dict[int, bool] = {}
        self._beats_counted: dict[int, tuple[int, float]] = {}
        self._channels = {sensor.signal: Channel(sensor.says) for sensor in SENSORS}
        self._channels |= {signal: Channel(always) for signal in _OTHERS}
        self._traces = Traces(self._vehicle, self._channels)
        self._recent: dict[tuple[Source, int], tuple[bytes, float]] = {}
        self._vehicle_unix_s = math.nan
        self._said: deque[Said] = deque(maxlen=TEXTS_KEPT)
        self._said_at_s = 0.0
        self._first_s = math.inf  # when the vehicle was first heard
        self._texts = StatusTexts(self._tell)
        # The number of the set that flies, and when the vehicle last stated it.
        self._active_set: tuple[int | None, float] = (None, -math.inf)
        self._stated: dict[str, float] = {}
        self._live_gap = self._new_gap(system)
        self._compared_s = -math.inf  # when a reading that the gap is made of last came
        self._look_back(system)
        self._alarms = Alarms(self._settings, self._file)
        self._alarm_trace = AlarmTrace()

    def _new_gap(self, system: int | None) -> LiveGap:
        return LiveGap(self._file, {} if system is None else self._accepted(system))

    def _look_back(self, system: int | None) -> None:
        """Begin to read the recording of the dive up to now, for the gap monitor."""
        self.close()
        if system is not None and self._file is not None and (recordings := self._recorded()):
            self._past_gap = PastGap(self._new_gap(system), system, recordings)

    def close(self) -> None:
        """End the reading of the dive's past."""
        if self._past_gap is not None:
            self._past_gap.drop()
            self._past_gap = None

    def _go_on_from_past(self) -> None:
        """Once that recording is read, go on from its state."""
        if self._past_gap is not None and self._past_gap.ready:
            self._live_gap, self._past_gap = self._past_gap.up_to_now(), None
            # The set in force last: it tells whether those values are in it.
            for name, value in sorted(self._stated.items(), key=lambda stated: stated[0] == ACTIVE):
                self._live_gap.parameter(name, value)

    def feed(self, frame: Frame, arrived_s: float, link: str) -> None:
        """Take a frame; `arrived_s` never runs back."""
        self._links.tick(arrived_s)
        peer = self.peers.on_frame(frame, link, arrived_s)
        if not frame.known:
            return
        number = frame.message_id
        if number == _HEARTBEAT and peer is not None and peer.heartbeat is not None:
            self._beat(peer.source, peer.heartbeat)
        from_vehicle = frame.system == self.system
        is_ours = from_vehicle or (
            number in FROM_ANYONE
            and not any(peer.is_vehicle and peer.source[0] == frame.system for peer in self.peers)
        )
        if not is_ours or self._is_twice(frame, arrived_s):
            return
        if number in TELLING:
            reading = decode_reading(frame) if number in OF_THE_CONTRACT else None
            if reading is not None and from_vehicle:
                self._live_gap.take(reading)
                if reading.signal in NEEDED:
                    self._compared_s = arrived_s
                if self._past_gap is not None:
                    self._past_gap.hear(reading)
            for signal, rank, values in heard(frame, reading):
                if self._channels[signal].take((rank, frame.component), values, arrived_s):
                    self._traces.take(signal, values, arrived_s)
        if number == _SYSTEM_TIME:
            self._date(arrived_s)
        if from_vehicle:
            self._first_s = min(self._first_s, arrived_s)
            self._hear_parameter(frame, arrived_s)
            self._tell_restart(peer, arrived_s)
        if number in _OF_WORDS:
            self._said_at_s = arrived_s
            self._texts.hear(frame)

    def picture(self, now_s: float) -> Picture:
        """The picture at `now_s`, on the clock of `feed`."""
        self._go_on_from_past()
        commander = self._commander()
        beat = _SILENT_BEAT if commander is None else self._system_beats[commander]
        channels, traces = self._channels, self._traces
        configuration = self._configuration()
        mode = _whole(channels["ff_mode"].values)
        if beat.armed or mode in (Mode.OFF, Mode.SHADOW):
            self._let_pass(lambda said: said.until_armed)

        def hz(signal: str) -> float:
            return expected_hz(signal, self._vehicle, channels[signal].teller[1], beat.firmware)

        picture = Picture(
            now_s=now_s,
            armed=_armed(beat),
            armed_age_s=now_s - beat.time_s,
            links=self._link_rows(now_s, commander),
            sensors=sensor_rows(
                channels,
                self._vehicle,
                now_s,
                hz,
                traces.locked_share(now_s),
                now_s - self._first_s,
            ),
            traces=traces.now(now_s, hz),
            thrusters=thruster_rows(
                channels["pwm"], channels["rpm"], self._thruster_names(configuration), now_s, hz
            ),
            ff_mode=mode,
            ff_mode_age_s=channels["ff_mode"].age_s(now_s),
            flies=_whole(channels["flight"].values) is not None,
            active_set=self._active_set[0],
            active_set_age_s=now_s - self._active_set[1],
            configuration=configuration,
            said=tuple(self._said),
            twins="" if self.system is None else self.peers.fault(self.system),
            wrong_file=self._wrong_file(),
            gap=self._gap(now_s),
            lacks=self._live_gap.lacks,
            hidden=self._hidden(beat),
            unset=self._alarms.unset,
        )
        alarms = self._alarms.look(picture)
        self._alarm_trace.take(alarms, now_s, now_s + self._unix_at_zero_s)
        said = sorted((*picture.said, *self._alarm_trace.said(now_s)), key=lambda said: said.heard_s)
        return replace(picture, said=tuple(said), alarms=alarms)

    def _gap(self, now_s: float) -> Gap | None:
        """The gap; None too where its readings come no more at all, as of a bridge that fell silent beside an autopilot
        that beats on: the gap itself goes by their own times."""
        return self._live_gap.gap if now_s - max(self._compared_s, self._first_s) <= STALE_S else None

    # The senders.

    def _beat(self, source: Source, beat: Heartbeat) -> None:
        system, component = source
        before = self._system_beats.get(component)
        if system == self.system and before is not None and beat.time_s - before.time_s > SILENT_S:
            self._rested[component] = not before.armed
        if beat.is_vehicle and self._is_to_be_watched(system, beat.time_s):
            self._begin(system)
        if system == self.system and beat.is_vehicle:
            self._system_beats[component] = beat
            count, counted_s = self._beats_counted.get(component, (0, -math.inf))
            if beat.time_s >= counted_s + SETTLING_S:
                self._beats_counted[component] = count + 1, beat.time_s

    def _is_to_be_watched(self, system: int, now_s: float) -> bool:
        if self._asked_for is not None or system == self.system:
            return False
        file_system = None if self._vehicle is None else self._vehicle.system_id
        if self.system is None or system == file_system:
            return True
        return self.system != file_system and self._has_passed_by(now_s)

    def _has_passed_by(self, now_s: float) -> bool:
        """Whether the watched vehicle sent only a heartbeat or two: another boat's, or an echo of the last dive."""
        newest_s = max((beat.time_s for beat in self._system_beats.values()), default=-math.inf)
        most = max((count for count, _ in self._beats_counted.values()), default=0)
        return most < SETTLED_BEATS and now_s - newest_s > PASSED_S

    def _commander(self) -> int | None:
        """The component that decides whether the vehicle is armed: an autopilot before a companion computer."""
        beats = self._system_beats
        return min(beats, key=lambda component: (not beats[component].is_autopilot, component), default=None)

    def _hear_parameter(self, frame: Frame, arrived_s: float) -> None:
        if frame.message_id != _PARAM_VALUE:
            return
        message = decode(frame)
        if message is not None:
            name, value = message.param_id, message.param_value
            if name in (ACTIVE, COMMIT) and value.is_integer():  # a vehicle answers for both alike
                self._active_set = int(value), arrived_s
            self._stated[name] = value
            self._live_gap.parameter(name, value)

    def _is_twice(self, frame: Frame, arrived_s: float) -> bool:
        # Entries are in order of arrival: those that are too old stand at the front.
        recent = self._recent
        while recent and arrived_s - recent[oldest := next(iter(recent))][1] >= TWICE_WITHIN_S:
            del recent[oldest]
        key = ((frame.system, frame.component), frame.sequence)
        before = recent.pop(key, None)
        recent[key] = frame.raw, arrived_s
        return before is not None and before[0] == frame.raw

    def _link_rows(self, now_s: float, commander: int | None) -> tuple[LinkRow, ...]:
        def place(row: LinkRow) -> tuple[bool, bool, float]:
            # Among lost links, the link heard last comes first: its age is the vehicle's.
            silent_s = row.age_s if row.lost else 0.0
            return row.system != self.system, row.component != commander, silent_s

        shown = (
            row
            for row in self._links.rows(now_s)
            if row.system == self.system or not GONE_S < row.age_s < math.inf
        )
        return tuple(sorted(shown, key=place))

    def _tell(self, source: Source, severity: int, text: CrewText) -> None:
        del source
        if text.topic is Topic.SET_ACTIVE:
            if text.number is not None:
                self._active_set = text.number, self._said_at_s
            # What the new set lacks as well, the vehicle says again.
            self._let_pass(lambda said: said.of_set)
        unix_s = self._said_at_s + self._unix_at_zero_s
        said = Said(
            unix_s,
            severity,
            text.words,
            self._said_at_s,
            of_set=text.topic is Topic.SET_FAULT,
            until_armed=text.topic is Topic.ONCE_ARMED,
        )
        self._keep(said)

    def _keep(self, said: Said) -> None:
        """Keep a text. In place of the oldest, a newer one goes that is no alarm: a chatty vehicle clears none."""
        if len(self._said) == TEXTS_KEPT:
            lasts_s = self._settings.of("" if self._vehicle is None else self._vehicle.name).vehicle_s or 0.0
            alarming = [
                kept.severity <= CRITICAL and not kept.past and said.heard_s - kept.heard_s <= lasts_s
                for kept in self._said
            ]
            del self._said[alarming.index(False) if False in alarming else 0]
        self._said.append(said)

    def _let_pass(self, is_past: Callable[[Said], bool]) -> None:
        for place, said in enumerate(self._said):
            self._said[place] = replace(said, past=said.past or is_past(said))

    def _tell_restart(self, peer: Peer | None, arrived_s: float) -> None:
        if peer is not None and peer.restart is not None:
            unix_s = self._unix_at_zero_s
            words = peer.restart.words(unix_s)
            rested = self._rested.pop(peer.source[1], False)
            severity = dialect.MAV_SEVERITY_INFO if rested else dialect.MAV_SEVERITY_WARNING
            # When it booted is known to about a second, and it is silent for longer before.
            booted_s = peer.restart.booted_s - SILENT_S
            self._let_pass(lambda said: said.heard_s < booted_s)
            self._keep(Said(arrived_s + unix_s, severity, words, arrived_s))

    @property
    def _unix_at_zero_s(self) -> float:
        """Unix time minus the time of `feed`; NaN if neither side knows the date."""
        return self._vehicle_unix_s if math.isnan(self._ground_unix_s) else self._ground_unix_s

    def _date(self, arrived_s: float) -> None:
        values = self._channels["clock"].values
        if values and values[0] > HAS_DATE_UNIX_S:
            self._vehicle_unix_s = values[0] - arrived_s

    # The vehicle itself.

    def _configuration(self) -> str:
        """The configuration by VEH_CFG, otherwise by the user's choice, otherwise the only configuration there is."""
        if self._file is None or self._vehicle is None:
            return ""
        veh_cfg = _whole(self._channels["veh_cfg"].values)
        if veh_cfg is None and self._file.configuration is not None:
            return self._file.configuration
        try:
            return self._vehicle.configuration_at(veh_cfg)
        except ConfigError:
            return ""

    def _hidden(self, beat: Heartbeat) -> str:
        firmware, companions = beat.firmware, self._system_beats.keys() & set(COMPANIONS)
        if companions or firmware is None or not firmware.hides_companions:
            return ""
        return (
            f"no companion is heard, if there is one: {firmware.name} sends its words on to a ground that beats, and "
            "nothing is sent here; seatrial record hears it, and watch by way of that"
        )

    def _wrong_file(self) -> str:
        """Why the vehicle file is not this vehicle's, "" for no reason: a configuration that it does not have."""
        veh_cfg, vehicle = _whole(self._channels["veh_cfg"].values), self._vehicle
        if veh_cfg is None or vehicle is None or veh_cfg in vehicle.by_veh_cfg:
            return ""
        return (
            f"the vehicle says configuration {veh_cfg}, and the file of '{vehicle.name}' has {vehicle.listed}: "
            "name the vehicle's own with --vehicle"
        )

    def _thruster_names(self, configuration: str) -> tuple[str, ...]:
        if self._vehicle is None:
            return ()
        shapes = self._vehicle.configurations
        return thruster_names(shapes[configuration or next(iter(shapes))])


def _armed(beat: Heartbeat) -> Armed:
    if beat.time_s == -math.inf:
        return Armed.UNKNOWN
    if beat.in_failsafe:
        return Armed.FAILSAFE
    return Armed.ARMED if beat.armed else Armed.DISARMED


def _whole(values: Values) -> int | None:
    return int(values[0]) if values and values[0].is_integer() else None
