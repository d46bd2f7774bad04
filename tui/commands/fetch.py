"""`seatrial fetch`: fetch the part of a dive that the vehicle stored and the ground did not receive."""

import argparse
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from bridge import clock as clocks
from bridge import exit_codes
from bridge.clock import Clock
from bridge.errors import LinkError, LogError, NotOfThisDive
from bridge.exit_codes import UsageError
from bridge.firmware.table import records_nothing
from bridge.links import secured
from bridge.links.link import Link
from bridge.text import say_warning
from bridge.vehicle.config import load_vehicle
from bridge.wire.framing import Frame
from bridge.wire.tlog import each_nonempty, read_tlog
from bridge.wire.whole_recording import WHOLE
from gcs_plugin.dives.folder import About, DiveFolder, about_vehicle, list_folders, load_folder, new_folder
from gcs_plugin.fetch.fetching import Fetching, fetch
from gcs_plugin.fetch.into_dive import (
    Boot,
    boots_in,
    boots_told,
    refuse_recorded,
    remade,
    segments_of_dive,
    segments_of_newest_boot,
)
from gcs_plugin.fetch.merge_order import Hole
from gcs_plugin.fetch.merging import merge_recordings, newest_frames, write_records
from gcs_plugin.fetch.mirror import Mirror
from gcs_plugin.fetch.requests import Listing
from gcs_plugin.locks import merge_lock
from gcs_plugin.params.client import ParameterClient
from gcs_plugin.recording import orders
from tui import links, show
from tui.commands.merge import beyond_words, guessed_words, lacking_words

FIND_S = 10.0


MIRROR = ".ring"
AGAIN = "fetch again"
HURT = "The vehicle's recording is damaged (places: {count}); what stood there may be missing"
LET_GO = "its ring was full or let its oldest go; merge what others recorded then"
HURT_BEYOND = (
    "The vehicle's recording is damaged before or after this dive (places: {count}), which costs it nothing"
)
OF_WHOLE = ("damaged_beyond", "holes", "lost", "beyond", "guessed")
OF_NEW = ("minutes", "name", "vehicle", "system")
"""Options of --new alone."""
FETCH_SHARE = 0.9
"""Share of the work; the rest is merging both recordings."""


def run(arguments: argparse.Namespace) -> int:
    if arguments.new and arguments.dive:
        raise UsageError(f"{arguments.dive}: --new makes a folder of its own; leave one of both out")
    given = [f"--{name}" for name in OF_NEW if getattr(arguments, name)]
    if given and not arguments.new:
        raise UsageError(
            f"{' and '.join(given)} {'is' if len(given) == 1 else 'are'} for --new; a dive that was heard has its own "
            "beginning and end, name and vehicle"
        )
    file = load_vehicle(arguments.vehicle) if arguments.vehicle else None
    about = about_vehicle(file, file.configuration or "") if file else About()
    clock = clocks.SystemClock()
    opener = secured.Opener(arguments.sign_key, clock, secured.on_words)
    folder = None if arguments.new else dive_of(arguments, clock)
    first = links.link_for(arguments.link, opener.open)
    link = links.coming_back(first, arguments.link, clock, opener.open, say_warning)
    try:
        with show.progress("fetching") as tell:
            fetcher = Fetcher(link, clock, arguments.patience, tell)
            if folder is not None:
                done = fetcher.whole(folder)
            else:
                client = ParameterClient(link, clock)
                vehicle = client.find_vehicle(FIND_S, arguments.system)
                if why := records_nothing(client.autopilot):
                    raise LinkError(f"vehicle {vehicle[0]}: {why}")
                name = arguments.name or about.configuration
                done = fetcher.new(Path(arguments.out), vehicle, arguments.minutes, name, about)
    except (LinkError, LogError) as error:
        if folder is None or arguments.link or not isinstance(error, LinkError | NotOfThisDive):
            raise
        raise type(error)(f"{error}{asked_by_way(folder)}") from None
    finally:
        link.close()
    show.say(show.results(arguments.json), done.words)
    outcome = {
        "recording": str(done.path), "frames": done.frames, "missing": done.missing,
        "fetched_bytes": done.fetched_bytes, "damaged": done.damaged,
        "holes": [vars(hole) for hole in done.holes], "lost": done.lost, "beyond": done.beyond,
    }  # fmt: skip
    show.write_json(outcome, arguments.json)
    return exit_codes.DONE if done.is_whole else exit_codes.NO


def asked_by_way(folder: DiveFolder) -> str:
    """Name the recording that a fetch without --link went through, which may be another vehicle's; "" if none runs."""
    holding = links.holding_now()
    if holding is None:
        return ""
    return (
        f" (asked by way of {links.words_of(holding)}, on {', '.join(holding.links)}: where that is another vehicle "
        f"than that of {folder.path}, name its own link with --link)"
    )


def dive_of(arguments: argparse.Namespace, clock: Clock) -> DiveFolder:
    """Return the dive in question. If it is being recorded, end it: the recording goes on in a new folder.

    Raises UsageError if there is no dive, LogError if one that is recorded states no boot, LinkError if its recording
    hangs.
    """
    holding = links.holding_now() if arguments.dive else links.usable_now()
    recorded = Path(holding.folder) if holding is not None else None
    asked = links.holder_of(arguments.link) if arguments.link else None
    if arguments.dive:
        path = Path(arguments.dive)
    elif asked is not None:
        path = Path(asked.folder)
    elif recorded is not None:
        path = recorded
    else:
        made = [folder.path for folder in list_folders(Path(arguments.out)) if folder.heard()]
        if not made:
            raise UsageError(f"{arguments.out}: holds no dive to make whole; name one, or give --new")
        path = made[-1]
    if recorded is not None and path.resolve() == recorded.resolve():
        refuse_untold(load_folder(path))  # a dive that can't be made whole is not ended for it
        finished, following = orders.next_dive(clock)
        show.say(show.words(), f"{finished} is over; the recording goes on in {following}")
    return load_folder(path)


@dataclass(frozen=True)
class Fetched:
    """Result of a fetch: the recording, its frames, and how many of them only the vehicle had.

    `damaged`: number of places without a readable frame in the vehicle's recording, as fetched; OF_WHOLE as in
    `MergedRecording`.
    """

    path: Path
    frames: int
    missing: int
    fetched_bytes: int
    damaged: int
    damaged_beyond: int = 0
    holes: tuple[Hole, ...] = ()
    lost: int = 0
    beyond: int = 0
    guessed: int = 0

    @property
    def is_whole(self) -> bool:
        """Whether there is no sign of frames that every recording lacks."""
        return not (self.holes or self.lost)

    @property
    def words(self) -> str:
        """`1200 of 96000 frames had not been heard; the dive is whole in dives/.../telemetry.whole.tlog`."""
        missing = f"{self.missing} of {self.frames} frames had not been heard"
        if self.damaged:
            subject = "all that can be read is"
        else:
            subject = "the dive is whole" if self.is_whole else "what there is of the dive is"
        lacking = lacking_words(self.holes, self.lost)
        sentences = (
            f"{missing if self.missing else f'all {self.frames} frames had been heard'}; {subject} in {self.path}",
            f"{lacking}, the vehicle neither: {LET_GO}" if lacking else "",
            HURT.format(count=self.damaged) if self.damaged else "",
            HURT_BEYOND.format(count=self.damaged_beyond) if self.damaged_beyond else "",
            guessed_words(self.guessed),
            beyond_words(self.beyond),
        )
        return ". ".join(filter(None, sentences))


@dataclass(frozen=True)
class Fetcher:
    """Fetches over `link`, waiting `patience_s` for an answer."""

    link: Link
    clock: Clock
    patience_s: float
    tell: Callable[[float, str], None]

    def whole(self, folder: DiveFolder) -> Fetched:
        """Complete a dive. Raises LogError if the ring has nothing of it, another fetch is running or the dive is
        still recorded, LinkError if the vehicle can't deliver it."""
        refuse_recorded(folder, self.clock.unix_s(), AGAIN)
        boots = heard_in(folder)
        mirror = Mirror(folder.path.resolve().parent / MIRROR)
        with mirror.locked():
            fetching = Fetching(mirror, lambda listing: segments_of_dive(listing, boots), self.clock.boot_s())
            source = boots[-1].source
            self._fetch(fetching, source)
            ring = _paths(mirror, fetching.chosen)
            with merge_lock(folder.path, AGAIN):
                made = remade(folder, source, lambda ground: merge_recordings(ground, ring, source), AGAIN)
            path = folder.path / WHOLE
        of_whole = {name: getattr(made, name) for name in OF_WHOLE}
        return Fetched(path, len(made.records), made.missing, fetching.fetched, made.damaged, **of_whole)

    def new(
        self, root: Path, vehicle: tuple[int, int], minutes: float | None, name: str, about: About
    ) -> Fetched:
        """Make a dive folder of the vehicle's newest boot, or of its last minutes. Raises as `whole`."""
        mirror = Mirror(root / MIRROR)
        most_ms = None if minutes is None else round(minutes * 60_000)
        choose = partial(segments_of_newest_boot, most_ms=most_ms)
        with mirror.locked():
            fetching = Fetching(mirror, choose, self.clock.boot_s())
            self._fetch(fetching, vehicle)
        ring = _paths(mirror, fetching.chosen)
        records, damaged = newest_frames(ring, None if most_ms is None else most_ms * 1000)
        folder = new_folder(root, records[0][0] / 1e6, name)
        folder.describe(about)
        path = folder.path / "telemetry.tlog"
        write_records(path, records)
        return Fetched(path, len(records), len(records), fetching.fetched, damaged)

    def _fetch(self, fetching: Fetching, vehicle: tuple[int, int]) -> None:
        def progress(now: Fetching) -> None:
            held, total = now.held_bytes, now.total_bytes
            words = f"fetching, {held / 1e6:.1f} of {total / 1e6:.1f} MB" if total else "asking for the list"
            self.tell(FETCH_SHARE * held / max(total, 1), words)

        fetch(self.link, self.clock, fetching, vehicle, self.patience_s, progress)
        self.tell(FETCH_SHARE, "putting both recordings together")


def heard_in(folder: DiveFolder) -> list[Boot]:
    """The boots in a dive's recording. Raises LogError if it states none."""
    refuse_untold(folder)
    return boots_in(_frames(folder))


def refuse_untold(folder: DiveFolder) -> None:
    """Raise LogError if the dive's recording states no boot of the vehicle; read no further than the first."""
    if next(boots_told(_frames(folder)), None) is None:
        raise LogError(
            f"{folder.path}: nothing in it tells which recording of the vehicle's is of this dive; its bridge must run "
            "with --ring, and for a dive of which nothing was heard give --new"
        )


def _frames(folder: DiveFolder) -> Iterator[Frame]:
    return (frame for records in each_nonempty(folder.heard(), read_tlog) for _, frame in records)


def _paths(mirror: Mirror, chosen: Listing) -> list[Path]:
    """Paths of the segments in the mirror, as far as they exist."""
    paths = (mirror.path(segment.name) for segment, _ in chosen)
    return [path for path in paths if path.exists()]
