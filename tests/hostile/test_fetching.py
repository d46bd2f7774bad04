"""A vehicle that answers anything to the ground that fetches: an end and a sentence, and nothing beside its mirror."""

import gzip
import random
import re
import shutil
from dataclasses import replace
from itertools import combinations

import pytest
from figures import keep
from fuzz_bytes import KINDS
from lying_vehicle import ABSURD, LIES, SIZES, VEHICLE, Crafted, Lie, Vehicle, mutated, noise
from pymavlink.dialects.v20 import ardupilotmega as dialect
from test_fuzz import LONG, MOST_MORE_MB, SHORT, most_mb, soon

from bridge.errors import LogError, SeatrialError
from bridge.wire.framing import Encoder
from bridge.wire.ftp import Fault, Op, Packet, acknowledged, crc32, refused
from bridge.wire.segments import Segment
from bridge.wire.tlog import read_tlog
from bridge.wire.whole_recording import WHOLE
from gcs_plugin.dives.folder import About, DiveFolder
from gcs_plugin.fetch.fetching import Fetching, fetch
from gcs_plugin.fetch.merging import newest_frames, write_records
from gcs_plugin.fetch.mirror import Mirror
from gcs_plugin.fetch.requests import SegmentListing
from tui.commands.fetch import MIRROR, Fetcher

BOOT = 7
UNIX_US = 1_790_000_000_000_000
SEGMENTS, FRAMES = 4, 40
PATIENCE_S, LONGEST_S = 2.0, 600.0
A_VEHICLE_BYTES = 20_000
MIRRORED = re.compile(r"(\d{6}-[0-9a-f]{8}-\d{6}-\d{10}\.tlog(\.part|\.other-\d+)?|fetching\.lock)", re.ASCII)


def segment(number):
    return Segment(1, BOOT, number, number * FRAMES * 50)


def frames(number):
    """Frames of a segment, dated on the vehicle's clock."""
    encoder, out = Encoder(*VEHICLE), []
    for n in range(number * FRAMES, (number + 1) * FRAMES):
        imu = dialect.MAVLink_highres_imu_message(n * 50_000, 0.1, 0, -9.8, 0.1, n % 7, *[0] * 8, 63)
        boot = dialect.MAVLink_named_value_int_message(n * 50, b"BOOT_ID", BOOT)
        out += [(UNIX_US + n * 50_000, encoder.encode(item)) for item in (imu, boot)]
    return out


KEPT = [frames(number) for number in range(SEGMENTS + 1)]


def ring(folder, segments):
    folder.mkdir(exist_ok=True)
    for number in range(segments):
        write_records(folder / segment(number).name, KEPT[number])
    return folder


def heard(root):
    """The ground's recording, of every third frame of all segments but the last."""
    dive = DiveFolder(root / "dives" / "2026-11-20T0912Z-lake")
    dive.path.mkdir(parents=True)
    every = [(stamp + 40_000_000, raw) for kept in KEPT[:SEGMENTS] for stamp, raw in kept]
    write_records(dive.path / "telemetry.tlog", every[::3])
    return dive


def fetched(vehicle, dive, anew=False):
    """The sentence that a fetch ends with; empty where it fetched."""
    fetcher = Fetcher(vehicle, vehicle.world, PATIENCE_S, lambda *_: None)
    try:
        with soon(b"what the vehicle said"):
            if anew:
                made = fetcher.new(dive.path.parent, VEHICLE, None, "new", About())
                shutil.rmtree(made.path.parent)
            else:
                fetcher.whole(dive)
    except SeatrialError as error:
        return str(error)
    return ""


def keeps_to_its_place(root):
    """How many bytes the mirror holds; fails where a file lies that is none of its."""
    mirror = root / "dives" / MIRROR
    ours = {root / "ring", root / "dives", mirror, root / "dives" / "2026-11-20T0912Z-lake"}
    for path in root.rglob("*"):
        inside = path.parent == mirror and MIRRORED.fullmatch(path.name)
        assert inside or path in ours or path.parent in ours - {mirror, root}, path
        assert not path.is_symlink()
    return sum(path.stat().st_size for path in mirror.iterdir())


def is_fetched_whole(root, dive, segments=SEGMENTS):
    """From an honest vehicle, whatever lies in the mirror."""
    honest = Vehicle(ring(root / "ring", segments), None, random.Random(0), 1e9, LONGEST_S)
    assert fetched(honest, dive) == ""
    for number in range(SEGMENTS):
        name = segment(number).name
        assert Mirror(root / "dives" / MIRROR).path(name).read_bytes() == (root / "ring" / name).read_bytes()
    # While a file grows no checksum of it is known, and none is ever of a frame of a kind that nobody knows.
    made = [frame.raw for _, frame in read_tlog(dive.path / WHOLE) if frame.known]
    every = [raw for kept in KEPT[:SEGMENTS] for _, raw in kept]
    # To the last frame that the ground heard. Where a liar's fetch had kept the other frame of that instant, it stays.
    last = (len(every) - 1) // 3 * 3
    assert made in (every[: last + 1], every[: last + 2])


def attack(kind, total, seed, root):
    """Vehicle after vehicle lies, knowing the honest one's names, until they have said `total` bytes."""
    rng, said_bytes, dive = random.Random(f"{kind} {seed}"), 0, heard(root)
    mirror, before_mb = root / "dives" / MIRROR, most_mb()
    while said_bytes < total:
        lie: Lie = {"random": noise, "mutated": mutated}.get(kind) or Crafted()
        vehicle = Vehicle(ring(root / "ring", SEGMENTS), lie, rng, A_VEHICLE_BYTES, LONGEST_S)
        fetched(vehicle, dive, rng.random() < 0.3)
        said_bytes += max(vehicle.said, 1)
        keeps_to_its_place(root)
        if rng.random() < 0.3:
            # Once it has begun another: of one that grows no checksum is there, and its middle may be hurt.
            is_fetched_whole(root, dive, SEGMENTS + 1)
            (root / "ring" / segment(SEGMENTS).name).unlink()
        if rng.random() < 0.3:
            shutil.rmtree(mirror)
            mirror.mkdir()
    assert most_mb() - before_mb < MOST_MORE_MB


@pytest.mark.parametrize("kind", KINDS)
def test_no_answers_stop_a_fetch_and_an_honest_vehicle_is_fetched_whole_after_them(kind, tmp_path):
    attack(kind, SHORT // len(KINDS), 0, tmp_path)


@pytest.mark.soak
def test_no_number_of_answers_stops_a_fetch(tmp_path):
    """Half a minute of one core."""
    for kind in KINDS:
        attack(kind, LONG // len(KINDS), 1, tmp_path / kind)
    keep("hostile_fetch", f"{LONG:.0e} bytes of answers, no exception, no hang, honest vehicles whole")


EACH = [(op, name) for op, lies in LIES.items() for name in lies]


@pytest.mark.parametrize(("op", "name"), EACH, ids=lambda value: str(getattr(value, "name", value)))
def test_each_lie_told_for_ever_comes_to_an_end(op, name, tmp_path, monkeypatch):
    monkeypatch.setattr("gcs_plugin.fetch.requests.MOST_SEGMENTS", 1000)
    fetch_with_lies({op: LIES[op][name]}, tmp_path)


def fetch_with_lies(lies, root):
    """To all requests of a kind, without an end; all others are answered truly."""
    dive = heard(root)

    def answer(asked, true, rng):
        lie = lies.get(Op(asked.op))
        return true if lie is None else lie(asked, true, rng)

    fetched(Vehicle(ring(root / "ring", SEGMENTS), answer, random.Random(0), 1e9, LONGEST_S), dive)
    keeps_to_its_place(root)
    is_fetched_whole(root, dive)


def run(vehicle, mirror):
    fetching = Fetching(mirror, lambda listing: listing, vehicle.world.boot_s())
    fetch(vehicle, vehicle.world, fetching, VEHICLE, PATIENCE_S, lambda _: None)


def listing(size):
    return [f"F{segment(0).name}\t{size}".encode(), f"F{segment(1).name}\t0".encode()]


def test_what_is_missing_in_front_does_not_fill_the_memory(tmp_path):
    """The first bytes never come, and all that is asked for after them."""
    fetching, asked_for = Fetching(Mirror(tmp_path / "m"), lambda listing: listing, 0.0), []
    for tick in range(500):
        for asked in fetching.tick(tick * 0.01):
            if asked.op == Op.LIST:
                data = b"\0".join(listing(2**31))
                answer = refused(asked, Fault.END) if asked.offset else acknowledged(asked, data)
            elif asked.op == Op.READ:
                asked_for.append(asked.offset)
                answer = acknowledged(asked, bytes(asked.size) if asked.offset else b"")
            else:
                answer = acknowledged(asked)
            fetching.on_packet(answer, tick * 0.01)
    assert asked_for.count(0) > 100
    assert 261_144 < max(asked_for) < 262_144


def test_of_absurd_names_and_sizes_nothing_is_taken():
    listed = SegmentListing()
    assert listed.hear(Packet(0, 0, Op.ACK, data=b"\0".join(ABSURD)))
    assert listed.listing() == [(Segment(0, 0, 0, 0), 50)]
    listed = SegmentListing()
    sized = [f"F{segment(n).name}\t".encode() + size for n, size in enumerate(SIZES)]
    assert listed.hear(Packet(0, 0, Op.ACK, data=b"\0".join(sized)))
    assert listed.index == len(sized)
    assert listed.listing() == [
        (segment(0), 0),
        (segment(1), 1),
        (segment(3), 100_000),
        (segment(4), 2**32 - 1),
    ]


def test_sizes_that_no_disk_holds_are_refused_before_a_byte_is_written(tmp_path, monkeypatch):
    def lie(asked, true, _):
        if asked.op == Op.LIST and not asked.offset:
            return acknowledged(asked, b"\0".join(listing(2**32 - 1)))
        return refused(asked, Fault.END) if asked.op == Op.LIST else true

    monkeypatch.setattr(
        "gcs_plugin.fetch.mirror.shutil.disk_usage", lambda _: shutil._ntuple_diskusage(9, 8, 10**9)
    )
    vehicle = Vehicle(ring(tmp_path / "ring", 2), lie, random.Random(0), 1e9, LONGEST_S)
    with pytest.raises(LogError, match="needs 8590 MB, and 1000 MB are free"):
        run(vehicle, Mirror(tmp_path / "m"))
    assert not (tmp_path / "m").exists()


def test_what_another_said_under_the_same_name_is_set_aside_and_the_honest_one_fetched(tmp_path):
    """It had made up the bytes and their checksum."""
    dive, name = heard(tmp_path), segment(0).name
    data = random.Random(0).randbytes((ring(tmp_path / "ring", 2) / name).stat().st_size)

    def lie(asked, true, _):
        if asked.op == Op.READ:
            return replace(true, data=data[asked.offset :][: asked.size])
        return acknowledged(asked, crc32(data).to_bytes(4, "little")) if asked.op == Op.CRC32 else true

    fetched(Vehicle(tmp_path / "ring", lie, random.Random(0), 1e9, LONGEST_S), dive)
    mirror = tmp_path / "dives" / MIRROR
    assert (mirror / name).read_bytes() == data
    is_fetched_whole(tmp_path, dive)
    assert (mirror / f"{name}.other-1").read_bytes() == data
    keeps_to_its_place(tmp_path)


@pytest.mark.parametrize("size", [0, 1, 10**5])
def test_what_lies_whole_under_the_name_of_the_file_that_grows_is_compared_too(size, tmp_path):
    dive, name, mirror = heard(tmp_path), segment(SEGMENTS - 1).name, tmp_path / "dives" / MIRROR
    mirror.mkdir()
    (mirror / name).write_bytes(b"\1" * size)
    is_fetched_whole(tmp_path, dive)
    assert (mirror / f"{name}.other-1").read_bytes() == b"\1" * size
    true = tmp_path / "ring" / name
    assert (mirror / f"{name}.part").read_bytes() == true.read_bytes()
    shutil.copyfile(true, mirror / name)
    is_fetched_whole(tmp_path, dive)
    assert (mirror / name).read_bytes() == true.read_bytes()
    keeps_to_its_place(tmp_path)


def test_a_segment_that_would_unfold_is_left_alone(tmp_path):
    path = tmp_path / segment(0).name
    path.write_bytes(gzip.compress(b"".join(stamp.to_bytes(8, "big") + raw for stamp, raw in KEPT[0])))
    with pytest.raises(LogError, match="holds no frame"):
        newest_frames([path], None)


@pytest.mark.soak
def test_every_pair_of_lies_told_for_ever_comes_to_an_end(tmp_path, monkeypatch):
    monkeypatch.setattr("gcs_plugin.fetch.requests.MOST_SEGMENTS", 1000)
    for number, pair in enumerate(combinations(EACH, 2)):
        lies = {op: LIES[op][name] for op, name in pair}
        if len(lies) == 2:
            fetch_with_lies(lies, tmp_path / str(number))
            shutil.rmtree(tmp_path / str(number))
