"""Switching the feed-forward: send FF_MODE until two independent reports of the vehicle confirm the mode. Pure.

An answer may echo a write that the vehicle did not keep. So the mode is confirmed by a read-back after a quiet period,
together with the telemetry, which shows the mode that it flies. If either reports another mode, the switch
starts again. The state machine never gives up; its caller may.

OFF is sent from the first tick, to every vehicle known from before and to the named system, heard or not, since a link
may carry only one way. Only the vehicle's own reports end it. A companion behind ArduPilot must be heard on the link
once before: until then the autopilot itself executes the companion's orders.

Any other mode yields to OFF: it is sent until the vehicle has confirmed it once, and after that only requested. If the
vehicle then reports another mode, or reports off although it was raised before, or another program on this computer
has ordered OFF, the mode is not sent any more and the switch is refused.
"""

from collections.abc import Iterable
from typing import Any, Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.vehicle.mode import Mode, word_of
from bridge.vehicle.parameters import MODE
from bridge.wire.framing import Frame, decode
from bridge.wire.readings import Reading
from bridge.wire.readings import decode as decode_reading
from bridge.wire.status_codes import CrewText
from gcs_plugin.feedforward.switched_vehicle import SwitchedVehicle
from gcs_plugin.peers import GROUND_STATION, KnownVehicle, Source, heartbeat_read
from gcs_plugin.watch.channels import StatusTexts

LACKING_S: Final = 10.0
"""Delay before it is believed that a vehicle has no feed-forward: its companion computer may be heard late."""


def caution(mode: Mode, system: int, was: float, active: float | None, *, armed: bool) -> str:
    """A warning of a mode that a vehicle in mode `was` accepts though it may not be meant, "" for none.

    `active` is its FF_ACTIVE, None if unknown.
    """
    if not mode.applies_feedforward and active == 0.0:
        return f"warning: vehicle {system} has no parameters in force: {mode.word} computes zero; upload some first"
    if not armed and mode.raises(Mode(int(was)) if was in set(Mode) else Mode.OFF):
        return (
            f"warning: disarmed, vehicle {system} takes {mode.word} whatever its shadow showed, and flies it once "
            "armed; the go of `seatrial validate` for a dive in shadow says whether it may"
        )
    return ""


NEVER_HEARD: Final = (1, dialect.MAV_COMP_ID_ONBOARD_COMPUTER)
"""Components that OFF is sent to in a system that was never heard: the bridge has either of these ids."""


class Switch:
    """Switches the feed-forward of `system`, or of every vehicle heard if that is None, to `mode`.

    Pass every frame of a link to `on_frame` and send the messages that `tick` returns, until `done`. While `twins`
    says that two vehicles share an address, it is unknown whether both obeyed: a mode other than off is sent on and
    never done; off is done when the answers confirm it and nothing contradicts them for a longer quiet period, and
    `words` says so.

    `known` are vehicles heard before, with times on the clock of `tick`; off is sent to them at once. `was` is the mode
    before the switch, off if unknown. With `while_disarmed` nothing is sent before a HEARTBEAT says that the vehicle is
    disarmed, and nothing to one that was armed meanwhile: a disarmed vehicle takes any mode, an armed one flies it. Set
    `overruled` when another program has ordered OFF since.
    """

    def __init__(
        self,
        mode: Mode | int,
        system: int | None = None,
        known: Iterable[KnownVehicle] = (),
        was: float = float(Mode.OFF),
        *,
        while_disarmed: bool = False,
    ) -> None:
        self.mode = Mode(mode)
        self.twins = ""
        self.overruled = False
        self._was, self._while_disarmed, self._armed = was, while_disarmed, False
        self._system = system
        self._vehicles: dict[int, SwitchedVehicle] = {}
        self._now_s = 0.0
        self._was_done = False
        self._lacking_since_s: float | None = None
        self._texts = StatusTexts(self._on_text)
        for vehicle in known if self.mode is Mode.OFF else ():
            self._of(vehicle.source, 0.0).know(vehicle)
        if self.mode is Mode.OFF and system is not None and not self._vehicles:
            unheard = tuple((system, component) for component in NEVER_HEARD)
            self._vehicles[system] = SwitchedVehicle(self.mode, 0.0, unheard=unheard)

    @property
    def done(self) -> bool:
        """Whether every vehicle with a feed-forward confirms the mode, by read-back and telemetry, at the same time."""
        having = [vehicle for vehicle in self._vehicles.values() if not vehicle.lacks_it]
        certain = self.mode is Mode.OFF or not self.twins
        return self._was_done or (bool(having) and certain and all(v.in_mode for v in having))

    @property
    def waits_for(self) -> tuple[int, ...]:
        """Systems with a feed-forward that have not confirmed the mode."""
        return tuple(n for n, v in sorted(self._vehicles.items()) if not v.lacks_it and not v.in_mode)

    @property
    def silent(self) -> tuple[int, ...]:
        """The systems in `waits_for` if none of them has been heard since the switch began; otherwise empty."""
        waits_for = self.waits_for
        return () if any(self._vehicles[n].heard_s is not None for n in waits_for) else waits_for

    @property
    def sent(self) -> int:
        """Number of times that the mode was sent, to all vehicles."""
        return sum(vehicle.sent for vehicle in self._vehicles.values())

    @property
    def heard(self) -> bool:
        """Whether any vehicle was heard since the switch began, as opposed to known from before."""
        return any(vehicle.heard_s is not None for vehicle in self._vehicles.values())

    @property
    def lacking(self) -> bool:
        """Whether no vehicle that was heard has a feed-forward."""
        return self.heard and all(vehicle.lacks_it for vehicle in self._vehicles.values())

    def hopeless(self, now_s: float) -> bool:
        """Whether it is long enough that no vehicle that was heard has had a feed-forward."""
        return self._lacking_since_s is not None and now_s - self._lacking_since_s >= LACKING_S

    @property
    def refusal(self) -> str:
        """Why a vehicle refuses the mode, "" if it does not; delayed by a second if its explanation does not arrive.

        For a mode other than off, also that OFF was ordered or the mode was lowered: then nothing more is sent.
        """
        if self._gives_way:
            return self._way_given
        reasons = (
            f"vehicle {n}: {v.against()}"
            for n, v in self._vehicles.items()
            if v.explained(self._now_s) and v.answer != self.mode
        )
        return "; ".join(reasons)

    @property
    def words(self) -> str:
        """State of every vehicle as of the last tick, as a sentence without a full stop."""
        if self._gives_way and not self.done:
            return self._way_given
        seen = [
            f"vehicle {system}: {vehicle.words(self._now_s)}"
            for system, vehicle in sorted(self._vehicles.items())
        ]
        if not seen:
            return self.twins or "no vehicle heard, nothing is sent yet"
        but = f"; but two vehicles answer: {self.twins}" if self.done else f"; {self.twins}"
        return "; ".join(seen) + (but if self.twins else "")

    def tick(self, now_s: float) -> list[Any]:
        self._now_s, self._was_done = now_s, self.done
        if not self.lacking:
            self._lacking_since_s = None
        elif self._lacking_since_s is None:
            self._lacking_since_s = now_s
        if self._gives_way or (self._while_disarmed and not any(v.beating for v in self._vehicles.values())):
            return []
        return [m for vehicle in self._vehicles.values() for m in vehicle.tick(now_s, bool(self.twins))]

    def again(self) -> None:
        """Order the mode again, also from vehicles that have confirmed it: they may have been switched since."""
        self._was_done = False
        for vehicle in self._vehicles.values():
            vehicle.again(self._now_s)

    def on_frame(self, frame: Frame, now_s: float) -> None:
        source = (frame.system, frame.component)
        self._texts.hear(frame)
        if frame.message_id in _READINGS:
            reading = decode_reading(frame)
            if reading is not None:
                self._on_reading(reading, source, now_s)
        elif frame.message_id in _ANSWERS:
            message = decode(frame)
            if message is None or message.param_id != MODE:
                return
            if frame.message_id == dialect.MAVLINK_MSG_ID_PARAM_VALUE:
                self._of(source, now_s).on_value(message.param_value, source, now_s)
                self._was_done = self.done
            elif message.target_system in (0, GROUND_STATION[0]):
                self._of(source, now_s).on_error(message.error, source, now_s)

    def _on_reading(self, reading: Reading, source: Source, now_s: float) -> None:
        """A HEARTBEAT, or the FF_MODE in a vehicle's telemetry; other readings are ignored."""
        if reading.signal == "ff_mode":
            self._of(source, now_s).on_telemetry(reading.values[0], source, now_s)
        elif reading.signal == "alive":
            beat = heartbeat_read(reading.values, now_s)
            if beat.is_vehicle:
                vehicle = self._of(source, now_s)
                vehicle.on_beat(beat, source, now_s)
                meant = vehicle is self._vehicles.get(source[0])
                self._armed = self._armed or (beat.armed and meant and not self.sent)

    def _on_text(self, source: Source, severity: int, text: CrewText) -> None:
        """A STATUSTEXT arrived; it does not make its sender a vehicle: only known vehicles are listened to."""
        del severity
        if source[0] in self._vehicles:
            self._vehicles[source[0]].on_text(text)

    @property
    def _gives_way(self) -> bool:
        lowered = any(vehicle.lowered for vehicle in self._vehicles.values())
        return self.mode is not Mode.OFF and (self.overruled or lowered or self._armed_meanwhile)

    @property
    def _armed_meanwhile(self) -> bool:
        return self._while_disarmed and self._armed

    @property
    def _way_given(self) -> str:
        raised = word_of(self.mode)
        if self.overruled:
            return f"OFF was ordered meanwhile and wins: {raised} is sent no more; look, and ask again if need be"
        if self._armed_meanwhile:
            return f"the vehicle was armed meanwhile: {raised} was not sent; look, and ask again"
        lowered = "; ".join(
            f"vehicle {n}: it says {word_of(v.other or 0.0)} after {word_of(self.mode if v.taken else v.was)}"
            for n, v in sorted(self._vehicles.items())
            if v.lowered
        )
        return f"{lowered}, as if another has switched it: {raised} is sent no more; look, and ask again if need be"

    def _of(self, source: Source, now_s: float) -> SwitchedVehicle:
        """The vehicle of a source; for a system that is not to be switched, a new object that is then discarded."""
        if self._system not in (None, source[0]):
            return SwitchedVehicle(self.mode, now_s)
        return self._vehicles.setdefault(source[0], SwitchedVehicle(self.mode, now_s, was=self._was))


_READINGS: Final = (dialect.MAVLINK_MSG_ID_HEARTBEAT, dialect.MAVLINK_MSG_ID_NAMED_VALUE_FLOAT)
_ANSWERS: Final = (dialect.MAVLINK_MSG_ID_PARAM_VALUE, dialect.MAVLINK_MSG_ID_PARAM_ERROR)
