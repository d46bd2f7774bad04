"""Report a recording's state to other programs on this computer, once a second, in the file of `gcs_plugin.holder`."""

import os
from pathlib import Path

from bridge.clock import Clock, EvenClock
from bridge.errors import LogError
from gcs_plugin.folder import utc_text
from gcs_plugin.holder import HeardVehicle, Holding, held, release, write_holding
from gcs_plugin.recorded import Notice
from gcs_plugin.recorder import Recorder
from tui import show
from tui.links import words_of
from tui.secured import Opener

MOST_NOTICES = 5


class RecordingState:
    """State of the recording of `links` into `folder`; in a second file while another recording is the default.

    `hub` is the address at which it serves its links, "" if it serves nobody; `opener` opened them, with the key in
    `sign_key`.
    """

    def __init__(
        self,
        clock: Clock,
        links: tuple[str, ...],
        folder: Path,
        hub: str,
        opener: Opener,
        sign_key: str = "",
    ) -> None:
        self._opener = opener
        self._sign_key = str(Path(sign_key).absolute()) if sign_key else ""
        self._clock, self._links, self._hub = clock, links, hub
        self._own_clock = EvenClock(clock)
        self.begin(folder)
        self._notices: tuple[str, ...] = ()
        self._fault = ""

    @property
    def way(self) -> str:
        """How other programs reach the links of this recording, in a sentence."""
        first = self._other()
        if first is not None:
            own_links = (
                f"; the links of this one are at {self._hub}, or by their names with --link"
                if self._hub
                else ""
            )
            return f"params, doctor, ff and note go by way of {words_of(first)}{own_links}"
        if not self._hub:
            return "its links serve nobody else"
        return f"params, doctor, ff and note go by way of it, at {self._hub}"

    def begin(self, folder: Path) -> None:
        """Begin a dive in this folder."""
        # A single assignment, because another thread may be writing the state.
        self._dive = (folder, utc_text(self._own_clock.unix_s()))

    def notice(self, said: Notice) -> None:
        """Keep a notice that an operator must read."""
        self._notices = (*self._notices, f"{said.level}: {said.sentence}")[-MOST_NOTICES:]

    def tell(self, recorder: Recorder) -> None:
        """Write the state now; if that fails, say so once."""
        folder, began_utc = self._dive
        holding = Holding(
            os.getpid(),
            self._hub,
            self._links,
            str(folder.absolute()),
            began_utc,
            recorder.recorded,
            recorder.recorded_bytes,
            recorder.lost,
            recorder.disk_left_s,
            self._notices,
            self._clock.unix_s(),
            "; ".join(filter(None, map(self._opener.words, self._links))),
            next(filter(None, map(self._opener.trouble, self._links)), ""),
            self._sign_key,
            recorder.unwritten.replace(f"{folder}/", ""),
            recorder.waiting,
            round(self._clock.unix_s() - self._own_clock.unix_s(), 3),
            recorder.taken_away.replace(f"{folder.resolve().parent.parent}/", ""),
            self._vehicles(recorder),
        )
        try:
            write_holding(holding, second=self._other() is not None)
            self._fault = ""
        except LogError as error:
            if not self._fault:
                show.say(show.words(), f"warning: {error}")
            self._fault = str(error)

    def end(self) -> None:
        """Remove the state."""
        release()

    def _vehicles(self, recorder: Recorder) -> tuple[HeardVehicle, ...]:
        boot_s, unix_s = self._clock.boot_s(), self._clock.unix_s()
        return tuple(
            HeardVehicle(*vehicle.source, vehicle.holds, round(unix_s - boot_s + vehicle.heard_s, 3))
            for vehicle in recorder.vehicles
        )

    def _other(self) -> Holding | None:
        holding = held(self._clock.unix_s())
        return holding if holding is not None and holding.pid != os.getpid() else None
