"""The recording of a flight, and the identifications that run during it.

A flight is recorded here, or by the recording that runs already and holds its link; that goes on in a folder of the
flight's own, and afterwards in another.
"""

import os
import shutil
import signal
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import partial
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path

from bridge.clock import Clock
from bridge.errors import SeatrialError
from bridge.links.link import Link
from bridge.vehicle.config import VehicleFile, load_vehicle
from gcs_plugin.dives.folder import DiveFolder, about_vehicle, new_folder
from gcs_plugin.flying.crew import Crew, Hub, Outbox, Recording
from gcs_plugin.flying.run import Widths
from gcs_plugin.peers import GROUND_STATION
from gcs_plugin.recording import orders
from gcs_plugin.recording.recorder import Recorder
from gcs_plugin.recording.state import held
from identify.estimators.table import DEFAULT, estimator
from identify.ingest.open import read_dive
from identify.planning.knowledge import widths

ASKED = "identify"
FLOWN = "flown by seatrial fly"


def recorded_crew(
    link: Link,
    file: VehicleFile,
    configuration: str,
    root: Path,
    clock: Clock,
    tell: Callable[[str], None],
    reopen: Callable[[str], Link] | None = None,
) -> tuple[Crew, Recorder, DiveFolder]:
    """A crew whose link is recorded into a new dive folder, with the ground's heartbeat."""
    folder = new_folder(root, clock.unix_s(), "fly")
    folder.describe(about_vehicle(file, configuration, FLOWN))
    outbox = Outbox()
    recorder = Recorder(
        [link],
        folder.open_telemetry,
        clock,
        lambda: shutil.disk_usage(folder.path).free,
        lambda notice: tell(f"{notice.level}: {notice.sentence}"),
        reopen,
        GROUND_STATION,
        outbox,
    )
    return Crew(Recording(recorder, outbox), link, clock, tell), recorder, folder


class RecordedHere:
    """A flight whose link is recorded here, from the beginning; a thread syncs the disk until `end`. `tell` gets a
    sentence on what could not be written then."""

    def __init__(
        self, crew: Crew, recorder: Recorder, folder: DiveFolder, tell: Callable[[str], None]
    ) -> None:
        self.crew, self._recorder, self._folder, self._tell = crew, recorder, folder, tell
        self._begun, self._end_sync = False, recorder.begin_sync()

    def begin(self) -> DiveFolder:
        """The folder of the flight that begins now."""
        self._begun = True
        return self._folder

    def end(self, words: str) -> None:
        """End the recording; `words` say how the flight went. Without a flight nothing of it is kept: it would be a
        dive that can't be read."""
        self._end_sync()
        self._recorder.close()
        if self._begun and self._recorder.kept.frames:
            try:
                self._folder.add_event(self._recorder.unix_us() / 1e6, words)
            except SeatrialError as error:
                self._tell(str(error))
        else:
            self._folder.discard(FLOWN)


class RecordedThere:
    """A flight by way of the recording that runs, whose hub `link` is."""

    def __init__(
        self, link: Link, file: VehicleFile, configuration: str, clock: Clock, tell: Callable[[str], None]
    ) -> None:
        self.crew = Crew(Hub(link, clock), link, clock, tell)
        self._link, self._about, self._tell = link, about_vehicle(file, configuration), tell
        self._folder: DiveFolder | None = None

    def begin(self) -> DiveFolder:
        """The folder of the flight that begins now: the recording goes on in it. Raises LinkError, LogError."""
        _, present = orders.next_dive(self.crew.clock)
        folder = self._folder = DiveFolder(present)
        of_vehicle = ("vehicle_file", "vehicle_sha256", "configuration")
        flown = {name: getattr(self._about, name) for name in of_vehicle}
        folder.change(lambda about: replace(about, **flown))
        return folder

    def end(self, words: str) -> None:
        """Let the recording go on in another dive; `words` say how the flight went."""
        self._link.close()
        if self._folder is None:
            return
        clock = self.crew.clock
        unix_s = clock.unix_s()
        holding = held(unix_s)
        note = partial(
            self._folder.add_event, unix_s if holding is None else holding.own_unix_s(unix_s), words
        )
        for act in (note, partial(orders.next_dive, clock, soon=True)):
            try:
                act()
            except SeatrialError as error:
                self._tell(str(error))


def widths_of(dive: Path, vehicle: str, configuration: str) -> Widths:
    """Identify the recording so far; nothing is known where it tells nothing."""
    file = load_vehicle(vehicle)
    try:
        return widths(estimator(DEFAULT)(read_dive(dive, None, file), file, configuration, lambda *_: None))
    except SeatrialError:
        return {}


class Alongside:
    """Identifies in a process of its own, so that the flight is watched all the while."""

    def __init__(self, dive: Path, file: VehicleFile, configuration: str) -> None:
        context = get_context("spawn")
        self._pipe, theirs = context.Pipe()
        of = dive, str(file.path), configuration
        self._worker = context.Process(target=_aside, args=(theirs, widths_of, of), daemon=True)
        # The flight has Ctrl-C: it ignores that from its first instruction on, as its parent does at this moment.
        before = signal.signal(signal.SIGINT, signal.SIG_IGN)
        try:
            self._worker.start()  # its imports take seconds, which pass during the countdown
        finally:
            signal.signal(signal.SIGINT, before)
        theirs.close()
        self.busy = False

    def ask(self) -> None:
        """Begin, if it is not at work."""
        if not self.busy and self._worker.is_alive():
            self._pipe.send(ASKED)
            self.busy = True

    def answer(self) -> Widths | None:
        """The answer that has come since the last call; nothing is known by a process that died."""
        if not self.busy or not self._pipe.poll():
            return None
        self.busy = False
        try:
            widths_now: Widths = self._pipe.recv()
        except (EOFError, ConnectionResetError):  # the latter where it died before it took what was asked
            return {}
        return widths_now

    def close(self) -> None:
        """End it at once: nobody takes an answer that is still to come."""
        self._worker.kill()
        self._worker.join()
        self._pipe.close()


def _aside(pipe: Connection, work: Callable[[Path, str, str], Widths], of: tuple[Path, str, str]) -> None:
    """Answer until the flight's end of the pipe is closed. The flight has the first word on the processor."""
    if hasattr(os, "nice"):
        os.nice(10)
    with suppress(EOFError):
        while pipe.recv() == ASKED:
            pipe.send(work(*of))
