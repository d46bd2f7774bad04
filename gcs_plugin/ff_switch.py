"""Switching the feed-forward: FF_MODE is sent until the vehicle has said twice over that it is so. Pure.

An answer may be the echo of a write that the vehicle then did not keep. So the last word has a read-back that is asked
for after a quiet period, and the telemetry, which the vehicle makes from the mode that it flies; where either says
something else, all begins anew. Nothing here gives up: who drives it may.

OFF waits for nobody: it is sent from the first tick to whoever is known from before, heard or not, and to the system
that is named, known or not, since a link may carry one way only. It is done by the vehicle's own words alone.

Any other mode gives way to OFF: it is sent until the vehicle has said once that it took it, and only asked for from
then on. Where the vehicle says another mode after that, or off where it was raised before, or another program of this
computer has ordered OFF, it is sent no more and that is its refusal.
"""

from collections.abc import Iterable
from typing import Any, Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.framing import Frame, decode
from bridge.messages.readings import Reading
from bridge.messages.readings import decode as decode_reading
from bridge.parameters import MODE
from bridge.vehicle.feedforward import Mode
from gcs_plugin.ff_vehicle import SwitchedVehicle
from gcs_plugin.ff_words import word
from gcs_plugin.known_vehicles import KnownVehicle
from gcs_plugin.params.client import Heard
from gcs_plugin.params.transfer import Source
from gcs_plugin.station import GROUND_STATION

NEVER_HEARD: Final = (1, dialect.MAV_COMP_ID_ONBOARD_COMPUTER)
"""The components that are sent OFF in a system that nobody has heard: a bridge's own, or that of a companion."""


class Switch:
    """Brings the feed-forward to `mode`: of `system`, or of every vehicle that is heard where that is None.

    Give it every frame of a link (or what it is to know of them), send what `tick` returns, until it is `done`. While
    `twins` says that two vehicles share one address nobody can tell whether both obeyed: another mode than off is sent
    on and never done, off is done by what was answered, once nothing says otherwise for longer, and says so.

    `known` are those who were heard before, by the clock of `tick`: with `system`, they are sent off at once.
    `was` is the mode before, where it is known. Set `overruled` where another program has ordered OFF since.
    """

    def __init__(
        self,
        mode: Mode | int,
        system: int | None = None,
        known: Iterable[KnownVehicle] = (),
        was: float = float(Mode.OFF),
    ) -> None:
        self.mode = Mode(mode)
        self.twins = ""
        self.overruled = False
        self._was = was
        self._system = system
        self._vehicles: dict[int, SwitchedVehicle] = {}
        self._now_s = 0.0
        self._was_done = False
        for vehicle in known if self.mode is Mode.OFF else ():
            self._of(vehicle.source, 0.0).know(vehicle)
        if self.mode is Mode.OFF and system is not None and not self._vehicles:
            unheard = tuple((system, component) for component in NEVER_HEARD)
            self._vehicles[system] = SwitchedVehicle(self.mode, 0.0, unheard=unheard)

    @property
    def done(self) -> bool:
        """Whether every vehicle that has a feed-forward has said by both ways that it is so, at one time."""
        having = [vehicle for vehicle in self._vehicles.values() if not vehicle.lacks_it]
        certain = self.mode is Mode.OFF or not self.twins
        return self._was_done or (bool(having) and certain and all(v.in_mode for v in having))

    @property
    def waits_for(self) -> tuple[int, ...]:
        """The systems that have a feed-forward and are not known to be in the mode."""
        return tuple(n for n, v in sorted(self._vehicles.items()) if not v.lacks_it and not v.in_mode)

    @property
    def silent(self) -> tuple[int, ...]:
        """The systems that it waits for, where none of them has been heard since it began."""
        waits_for = self.waits_for
        return () if any(self._vehicles[n].heard_s is not None for n in waits_for) else waits_for

    @property
    def sent(self) -> int:
        """How often the mode was sent."""
        return sum(vehicle.sent for vehicle in self._vehicles.values())

    @property
    def heard(self) -> bool:
        """Whether any vehicle is heard, not only known from before."""
        return any(vehicle.heard_s is not None for vehicle in self._vehicles.values())

    @property
    def lacking(self) -> bool:
        """Whether all that is heard has no feed-forward."""
        return self.heard and all(vehicle.lacks_it for vehicle in self._vehicles.values())

    @property
    def refusal(self) -> str:
        """What a vehicle has said against it, "" for nothing; a second late where its words are not heard.

        Of another mode than off also that OFF was ordered, or the mode taken back: then nothing more is sent.
        """
        if self._gives_way:
            return self._way_given
        said = (
            f"vehicle {n}: {v.against()}"
            for n, v in self._vehicles.items()
            if v.explained(self._now_s) and v.answer != self.mode
        )
        return "; ".join(said)

    @property
    def words(self) -> str:
        """What is seen, as of the last tick, in a sentence without an end."""
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
        """The messages to send now."""
        self._now_s, self._was_done = now_s, self.done
        if self._gives_way:
            return []
        return [m for vehicle in self._vehicles.values() for m in vehicle.tick(now_s, bool(self.twins))]

    def again(self) -> None:
        """Order it once more, of those too that have done it: one of them may have been switched since."""
        self._was_done = False
        for vehicle in self._vehicles.values():
            vehicle.again(self._now_s)

    def on_frame(self, frame: Frame, now_s: float) -> None:
        """A frame arrived; of any kind."""
        source = (frame.system, frame.component)
        if frame.message_id in _READINGS:
            reading = decode_reading(frame)
            if reading is not None:
                self.on_reading(reading, source, now_s)
        elif frame.message_id in _ANSWERS:
            message = decode(frame)
            if message is None:
                return
            if frame.message_id == dialect.MAVLINK_MSG_ID_STATUSTEXT:
                # Whoever speaks is no vehicle for it: only one that is known is listened to.
                if source[0] in self._vehicles:
                    self._vehicles[source[0]].on_text(message.text)
            elif frame.message_id == dialect.MAVLINK_MSG_ID_PARAM_VALUE:
                self.on_value(message.param_id, message.param_value, source, now_s)
            elif message.target_system in (0, GROUND_STATION[0]):
                self.on_error(message.param_id, message.error, source, now_s)

    def on_reading(self, reading: Reading, source: Source, now_s: float) -> None:
        """A heartbeat or what the vehicle tells of its mode; other readings say nothing here."""
        if reading.signal == "ff_mode":
            self._of(source, now_s).on_told(reading.values[0], source, now_s)
        elif reading.signal == "alive":
            armed, kind, autopilot = reading.values
            if Heard(source, int(kind), int(autopilot), bool(armed), now_s).is_vehicle:
                self._of(source, now_s).on_beat(source, now_s)

    def on_value(self, name: str, value: float, source: Source, now_s: float) -> None:
        """A PARAM_VALUE arrived."""
        if name == MODE:
            self._of(source, now_s).on_value(value, source, now_s)
            self._was_done = self.done

    def on_error(self, name: str, code: int, source: Source, now_s: float) -> None:
        """A PARAM_ERROR arrived."""
        if name == MODE:
            self._of(source, now_s).on_error(code, source, now_s)

    @property
    def _gives_way(self) -> bool:
        lowered = any(vehicle.lowered for vehicle in self._vehicles.values())
        return self.mode is not Mode.OFF and (self.overruled or lowered)

    @property
    def _way_given(self) -> str:
        raised = word(self.mode)
        if self.overruled:
            return f"OFF was ordered meanwhile and wins: {raised} is sent no more; look, and ask again if need be"
        said = "; ".join(
            f"vehicle {n}: it says {word(v.other or 0.0)} after {word(self.mode if v.taken else v.was)}"
            for n, v in sorted(self._vehicles.items())
            if v.lowered
        )
        return (
            f"{said}, as if another has switched it: {raised} is sent no more; look, and ask again if need be"
        )

    def _of(self, source: Source, now_s: float) -> SwitchedVehicle:
        """The vehicle of a source; one that is not asked for is watched by nobody."""
        if self._system not in (None, source[0]):
            return SwitchedVehicle(self.mode, now_s)
        return self._vehicles.setdefault(source[0], SwitchedVehicle(self.mode, now_s, was=self._was))


_READINGS: Final = (dialect.MAVLINK_MSG_ID_HEARTBEAT, dialect.MAVLINK_MSG_ID_NAMED_VALUE_FLOAT)
_ANSWERS: Final = (
    dialect.MAVLINK_MSG_ID_PARAM_VALUE,
    dialect.MAVLINK_MSG_ID_PARAM_ERROR,
    dialect.MAVLINK_MSG_ID_STATUSTEXT,
)
