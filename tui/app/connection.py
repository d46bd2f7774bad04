"""The app's connection to a vehicle: through the running recording, as other programs, or by a link of its own."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from bridge.clock import Clock
from bridge.errors import LinkError
from bridge.links.link import Link
from bridge.vehicle.config import VehicleFile, load_vehicle
from bridge.vehicle.mode import Mode
from gcs_plugin.feedforward.switch import Switch
from gcs_plugin.params.last_accepted import accepted_values
from gcs_plugin.peers import KnownVehicle, newest
from gcs_plugin.recording import orders
from gcs_plugin.recording.state import Holding
from gcs_plugin.watch.alarms import SHIPPED, Settings
from gcs_plugin.watch.watcher import Watcher
from tui import links
from tui.app import recorder
from tui.app.connecting import Choice
from tui.app.desk import RECEIPTS
from tui.app.station import LinkSource, Station

OF_RECORDING = "the recording"
"""Name of the link that the running recording serves; its port differs with every recording."""
NO_LINK = "no link is known yet; connect one first"


def why_not_recorded(running: Holding, link: str) -> str:
    """Why a link is not recorded beside a recording that runs and does not hold it."""
    return (
        f"{', '.join(running.links)} is recorded already, and the app goes by one recording: end it first "
        f"(End recording), look at {link} without recording it (Look only), or give `seatrial record` both links, for "
        "one dive"
    )


class Connection:
    """Connection that survives lost links, ended recordings, and another choice by the user.

    `recorded` are the links that a recording is to hold; `looked_at` is the link read without recording, "" for none.
    `open_by_name` opens a link, and `trouble` says why a link accepts nothing.
    """

    def __init__(
        self,
        clock: Clock,
        recorded: tuple[str, ...],
        looked_at: str,
        out: str,
        vehicle: tuple[str, VehicleFile | None],
        sign_key: str,
        open_by_name: Callable[[str], Link],
        trouble: Callable[[str], str],
        receipts: Path = RECEIPTS,
        alarms: Settings = SHIPPED,
        *,
        silent: bool,
    ) -> None:
        self._receipts, self._alarms = receipts, alarms
        self._clock, self._out, self._silent = clock, out, silent
        self._vehicle, self._file = vehicle
        self._recorded, self._looked_at, self._sign_key = recorded, looked_at, sign_key
        self._open_by_name, self._trouble = open_by_name, trouble
        self.station: Station | None = None

    def links(self) -> tuple[str, ...]:
        """The links that a recording begun now would hold: those named, else those of the recording last seen."""
        return self._recorded

    def link(self) -> str:
        """The link that a verb must be given to reach the vehicle shown; "" where that of the recording leads there."""
        return self._looked_at

    def recording(self, now_unix_s: float) -> Holding | None:
        """The recording of the vehicle shown, running or hanging."""
        if self._looked_at:
            return links.holder_of(self._looked_at)
        holding = recorder.recording(now_unix_s)
        # A recording that has heard nothing leads to no vehicle.
        if holding is not None and holding.frames:
            self._recorded, self._sign_key = holding.links, holding.sign_key or self._sign_key
        return holding

    def source(self) -> LinkSource:
        """The link as it is now, opened again whenever it is lost."""
        spec = self._looked_at
        if spec:
            return LinkSource(
                lambda: self._open_by_name(spec),
                spec,
                self._clock,
                lambda: self._trouble(spec),
                silent=self._silent,
            )
        return LinkSource(
            lambda: links.of_recording(links.holding_now()), OF_RECORDING, self._clock, silent=self._silent
        )

    def watcher(self) -> Watcher:
        return Watcher(
            self._file,
            unix_at_zero_s=self._clock.unix_s() - self._clock.boot_s(),
            settings=self._alarms,
            accepted=partial(accepted_values, self._receipts, self._file.vehicle.name if self._file else ""),
            recorded=lambda: links.recorded_by(links.holding_of(self._looked_at or None)),
        )

    def switch(self, heard: Sequence[KnownVehicle]) -> Switch:
        """The switch that forces off the vehicles heard here, and those known to the recording by which OFF goes."""
        known = links.known_now(self._clock, self._looked_at or None)
        return Switch(Mode.OFF, known=newest([*heard, *known]))

    def record(self) -> None:
        """Begin a recording where none runs. Raises LinkError."""
        if not self._recorded:
            raise LinkError(NO_LINK)
        looked_at, running = self._looked_at, links.holding_now()
        if (
            looked_at
            and running is not None
            and not any(links.holds(running, link) for link in self._recorded)
        ):
            raise LinkError(why_not_recorded(running, looked_at))
        self._look_at("")
        try:
            recorder.begin_again(recorder.options(self._recorded, self._out, self._vehicle, self._sign_key))
        except LinkError:
            self._look_at(looked_at)
            raise

    def next_dive(self) -> Path:
        """Let the recording go on in a new folder; return that of the finished dive.

        Raises LinkError, too where another recording takes the order than is shown.
        """
        self._refuse_another()
        finished, _ = orders.next_dive(self._clock)
        return finished

    def end(self) -> Path:
        """End the recording; return the folder of its dive. Raises as `next_dive`."""
        self._refuse_another()
        return orders.end(self._clock)

    def _refuse_another(self) -> None:
        shown = links.holder_of(self._looked_at) if self._looked_at else None
        first = links.holding_now()
        if shown is not None and first is not None and shown.pid != first.pid:
            raise LinkError(
                f"{links.words_of(shown)} takes no order from here: Ctrl-C in its terminal ends it"
            )

    def connect(self, choice: Choice) -> None:
        """Connect as chosen. Raises LinkError if another recording runs, or none can be begun."""
        running = links.holding_now()
        if not choice.records:
            self._recorded = (choice.link,)
            self._look_at(choice.link)
        elif running is not None and not links.holds(running, choice.link):
            raise LinkError(why_not_recorded(running, choice.link))
        else:
            self._recorded = running.links if running is not None else (choice.link,)
            self.record()

    def name_vehicle(self, vehicle: str) -> None:
        """Read the vehicle by this FILE[:CONFIGURATION] from now on. Raises ConfigError if there is no such file."""
        self._file = load_vehicle(vehicle)
        self._vehicle = vehicle
        if self.station is not None:
            self.station.change(self.source(), self.watcher())

    def _look_at(self, looked_at: str) -> None:
        if looked_at != self._looked_at and self.station is not None:
            self._looked_at = looked_at
            self.station.change(self.source(), self.watcher())
