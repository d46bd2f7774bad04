"""After a dive without a link the ground fetches what the vehicle kept, whatever the link does: the dive is whole."""

import pytest
from diving_vehicle import BAD, Dive
from fakes.recordings import raws
from merged_dives import SOURCE, dive_of, fetcher_of
from soak import rest_in_soak

from bridge.errors import LinkTimeout, LogError
from bridge.onboard.ring import RingSize
from bridge.wire.framing import Encoder
from bridge.wire.ftp import Op, Packet
from bridge.wire.segments import Segment, segments_in
from bridge.wire.tlog import read_tlog
from bridge.wire.whole_recording import WHOLE
from gcs_plugin.dives.folder import About
from gcs_plugin.dives.replay import Reel
from gcs_plugin.fetch.fetching import Fetching, fetch
from gcs_plugin.fetch.into_dive import Boot, segments_of_dive, segments_of_newest_boot
from gcs_plugin.fetch.mirror import Mirror
from gcs_plugin.peers import ground_heartbeat
from identify.ingest.open import recording_files

pytestmark = pytest.mark.usefixtures("switched_off")


def everything(listing):
    return listing


def fetched(dive, mirror, choose=everything, patience_s=60.0):
    fetching = Fetching(mirror, choose, dive.world.boot_s())
    fetch(dive, dive.world, fetching, SOURCE, patience_s, lambda _: None)
    return fetching


def is_mirrored(mirror, dive, listing):
    """Whether each segment that was listed is there, byte for byte, up to its size then."""
    for segment, size in listing:
        data = (dive.folder / segment.name).read_bytes()[:size]
        assert mirror.path(segment.name).read_bytes() == data
    return bool(listing)


@pytest.mark.parametrize("seed", rest_in_soak(range(5)))
def test_a_ring_is_fetched_whole_over_a_link_that_loses_doubles_reorders_and_delays(tmp_path, seed):
    dive, mirror = Dive(tmp_path / "ring", seed), Mirror(tmp_path / "mirror")
    dive.dive(20.0)
    dive.link.outgoing.__dict__.update(BAD)
    dive.link.incoming.__dict__.update(BAD)
    fetching = fetched(dive, mirror)
    assert is_mirrored(mirror, dive, fetching.chosen)
    assert all(mirror.is_whole(segment.name) for segment, _ in fetching.chosen[:-1])
    assert fetching.fetched == fetching.total_bytes > 20_000


class KilledError(BaseException):
    """Stands in for a kill: nothing catches it."""


def messages_of(tmp_path, every):
    """Every so many of the messages that it takes without a fault, the first and the last among them."""
    dive = Dive(tmp_path / "count")
    dive.dive(5.0)
    sent = []
    dive.write = lambda data: (sent.append(data), dive.link.write(data))
    fetched(dive, Mirror(tmp_path / "counted"))
    return sorted({*range(1, len(sent) + 1, every), len(sent)})


at_any_message = pytest.mark.parametrize("every", rest_in_soak([4, 1]))


def at_message(dive, number, happens):
    """Let something happen as the ground sends its `number`-th message."""
    sent = []

    def write(data):
        sent.append(data)
        if len(sent) == number:
            happens()
        dive.link.write(data)

    dive.write = write


def killed():
    raise KilledError


@at_any_message
def test_a_ground_killed_at_any_message_goes_on_where_it_was(tmp_path, every):
    messages = messages_of(tmp_path, every)
    assert messages[-1] > 10
    for number in messages:
        dive, mirror = Dive(tmp_path / f"ring{number}"), Mirror(tmp_path / f"mirror{number}")
        dive.dive(5.0)
        at_message(dive, number, killed)
        with pytest.raises(KilledError):
            fetched(dive, mirror)
        there = sum(mirror.size(segment.name) for segment, _ in segments_in(dive.folder))
        again = fetched(dive, mirror)
        assert is_mirrored(mirror, dive, again.chosen)
        assert again.fetched == again.total_bytes - there


@at_any_message
def test_a_vehicle_that_starts_anew_at_any_message_is_fetched_whole(tmp_path, every):
    for number in messages_of(tmp_path, every):
        dive, mirror = Dive(tmp_path / f"ring{number}"), Mirror(tmp_path / f"mirror{number}")
        dive.dive(5.0)
        at_message(dive, number, dive.switch_on)
        assert is_mirrored(mirror, dive, fetched(dive, mirror).chosen)


@at_any_message
def test_a_link_cut_at_any_message_for_a_while_only_costs_that_while(tmp_path, every):
    for number in messages_of(tmp_path, every):
        dive, mirror = Dive(tmp_path / f"ring{number}"), Mirror(tmp_path / f"mirror{number}")
        dive.dive(5.0)
        at_message(dive, number, lambda dive=dive: dive.cut(True))
        with pytest.raises(LinkTimeout, match="what was fetched is kept"):
            fetched(dive, mirror, patience_s=5.0)
        dive.cut(False)
        assert is_mirrored(mirror, dive, fetched(dive, mirror).chosen)


def test_a_segment_that_is_damaged_on_the_way_to_the_disk_is_fetched_again(tmp_path):
    dive, mirror = Dive(tmp_path / "ring"), Mirror(tmp_path / "mirror")
    dive.dive(10.0)
    first = segments_in(dive.folder)[0][0].name
    mirror.append(first, b"\0" * 500)
    assert is_mirrored(mirror, dive, fetched(dive, mirror).chosen)


def test_a_segment_that_the_ring_lets_go_meanwhile_costs_only_itself(tmp_path):
    dive, mirror = Dive(tmp_path / "ring", bounds=RingSize(16_000, 4000)), Mirror(tmp_path / "mirror")
    dive.dive(10.0)
    oldest = segments_in(dive.folder)[0][0].name

    def choose(listing):
        (dive.folder / oldest).unlink()
        return listing

    fetching = fetched(dive, mirror, choose)
    assert not mirror.path(oldest).exists()
    assert is_mirrored(
        mirror, dive, [entry for entry in fetching.chosen if (dive.folder / entry[0].name).exists()]
    )


def test_a_vehicle_without_a_ring_is_named():
    fetching = Fetching(Mirror(None), everything, 0.0)
    (asked,) = fetching.tick(0.0)
    fetching.on_packet(Packet(asked.sequence + 1, 0, Op.NAK, 1, Op.LIST, data=b"\7"), 0.1)
    assert fetching.done
    assert "start its bridge with --ring FOLDER" in fetching.fault


def a_dive_under_water(tmp_path, seconds=(10.0, 20.0, 10.0), **faults):
    """Recorded on deck, cut off under water, heard again; the folder of the ground."""
    dive = Dive(tmp_path / "ring", **faults)
    for number, so_long in enumerate(seconds):
        dive.cut(number % 2 == 1)
        dive.dive(so_long)
    beat = Encoder(255, 190).encode(ground_heartbeat())
    return dive, dive_of(tmp_path, [*dive.heard, (dive.heard[-1][0], beat)]), beat


def merge_recordings(dive, folder):
    return fetcher_of(dive).whole(folder)


def whole_frames(folder):
    return [(stamp_us, frame.raw) for stamp_us, frame in read_tlog(folder.path / WHOLE)]


def span(dive):
    """The vehicle's frames from the first to the last that the ground heard."""
    sent, known = dive.kept(), {raw for _, raw in dive.heard}
    places = [place for place, raw in enumerate(sent) if raw in known]
    return sent[places[0] : places[-1] + 1]


@pytest.mark.parametrize("seed", rest_in_soak(range(3)))
def test_a_dive_is_whole_byte_for_byte_in_order_and_once_each(tmp_path, seed):
    dive, folder, beat = a_dive_under_water(tmp_path, seed=seed, **BAD)
    before = [path.read_bytes() for path in folder.heard()]
    sent = span(dive)
    done = merge_recordings(dive, folder)
    records = whole_frames(folder)
    assert [raw for _, raw in records if raw != beat] == sent
    assert beat in [raw for _, raw in records]
    assert done.missing == len(sent) - len({raw for _, raw in dive.heard})
    assert done.missing > len(sent) / 2
    assert [path.read_bytes() for path in folder.heard()] == before
    stamps = [stamp_us for stamp_us, _ in records]
    assert stamps == sorted(stamps)
    assert abs(stamps[-1] - stamps[0] - 40e6) < 1e6


def test_all_that_reads_a_dive_reads_the_whole_one(tmp_path):
    dive, folder, _ = a_dive_under_water(tmp_path)
    assert folder.telemetry() == recording_files(folder.path) == folder.heard()
    merge_recordings(dive, folder)
    assert folder.telemetry() == recording_files(folder.path) == [folder.path / WHOLE]
    assert [path.name for path in folder.heard()] == ["telemetry.tlog"]
    assert Reel(folder.telemetry()).length_s > 39.0


def test_a_vehicle_that_started_anew_under_water_is_whole_too(tmp_path):
    dive = Dive(tmp_path / "ring")
    dive.dive(5.0)
    for _ in range(2):  # the boot between is heard by nobody
        dive.switch_on()
        dive.cut(True)
        dive.dive(5.0)
    dive.cut(False)
    dive.dive(3.0)
    folder = dive_of(tmp_path, dive.heard)
    sent = span(dive)
    merge_recordings(dive, folder)
    assert raws(folder.path / WHOLE) == sent
    assert len(sent) > 0.8 * len(dive.kept())


def test_a_dive_of_which_nothing_was_heard_becomes_a_folder_of_its_own(tmp_path):
    dive = Dive(tmp_path / "ring")
    dive.cut(True)
    dive.dive(10.0)
    dive.cut(False)
    fetcher = fetcher_of(dive)
    sent = dive.kept()
    done = fetcher.new(tmp_path / "dives", SOURCE, None, "lake", About())
    kept = raws(done.path)
    assert kept[: len(sent)] == sent
    assert done.path.name == "telemetry.tlog"
    last = fetcher.new(tmp_path / "dives", SOURCE, 0.05, "lake", About())
    assert 0.5 < Reel([last.path]).length_s <= 3.0


def test_a_dive_that_tells_of_no_ring_says_what_to_do(tmp_path):
    folder = dive_of(tmp_path, [(1, Encoder(255, 190).encode(ground_heartbeat()))])
    with pytest.raises(LogError, match="must run with --ring"):
        merge_recordings(Dive(tmp_path / "ring"), folder)


def test_segments_of_other_dives_are_not_fetched():
    listing = [(Segment(boot, 70 + boot, n, n * 60_000), 10) for boot in (1, 2, 3) for n in range(10)]
    boots = [Boot(72, SOURCE, 150_000, 310_000)]
    assert [(s.boot, s.number) for s, _ in segments_of_dive(listing, boots)] == [
        (2, 2),
        (2, 3),
        (2, 4),
        (2, 5),
    ]
    over_two = [Boot(71, SOURCE, 480_000, 500_000), Boot(72, SOURCE, 1_000, 70_000)]
    assert [(s.boot, s.number) for s, _ in segments_of_dive(listing, over_two)] == [
        (1, 7),
        (1, 8),
        (1, 9),
        (2, 0),
        (2, 1),
    ]
    assert [s.number for s, _ in segments_of_newest_boot(listing, 90_000)] == [7, 8, 9]


def test_a_dive_about_the_moment_in_which_boot_time_wrapped_has_all_segments_of_its_time():
    """Milliseconds of 32 bits wrap after 49.7 days: what was sent before then begins later by its name."""
    begins_ms = [(2**32 - 150_000 + n * 60_000) % 2**32 for n in range(5)]
    listing = [(Segment(1, 71, n, begun_ms), 10) for n, begun_ms in enumerate(begins_ms)]

    def chosen(*heard_ms):
        return {
            s.number for s, _ in segments_of_dive(listing, [Boot(71, SOURCE, min(heard_ms), max(heard_ms))])
        }

    assert chosen(1_000, 15_000) == {2}
    assert chosen(2**32 - 20_000, 2**32 - 15_000) >= {2}
    assert chosen(2**32 - 149_000, 200_000) == {0, 1, 2, 3, 4}
