"""Recordings that are cut, damaged, wild or of something else: what they hold is read, or refused in one sentence."""

import gzip
import math
import random
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bags_made import ROS2, swim, write_bag
from built_recordings import (
    Stamped,
    array,
    attitude,
    contract_dive,
    heartbeat,
    odometry,
    recording,
    servos,
    write,
)
from fakes.shared import shared
from fastcrc.crc16 import mcrf4xx
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mav

from bridge.errors import LogError
from bridge.vehicle.config import load_vehicle
from bridge.wire.framing import CRC_EXTRA, Encoder
from bridge.wire.redaction import KEY_AT, SETUP_SIGNING
from bridge.wire.tlog import TlogReader
from identify.ingest.mavlink.frames import Fields, load_frames, locate, message_id
from identify.ingest.open import MAPPED, date_of, read_dive, read_streams
from identify.run.recordings import stray_bytes


@pytest.mark.parametrize("name", ["dive.tlog.gz", "dive.tlog"])
def test_a_cut_recording_is_read_to_where_it_ends(tmp_path: Path, name: str) -> None:
    data = recording(contract_dive())
    whole = gzip.compress(data) if name.endswith("gz") else data
    dive = read_dive(write(tmp_path / name, whole[: len(whole) * 2 // 3]))
    assert len(dive.velocity) > 30
    assert any("middle of a record" in note for note in dive.notes)


def test_damage_in_the_middle_costs_only_what_it_hit(tmp_path: Path) -> None:
    data = bytearray(recording(contract_dive()))
    data[5000:5040] = b"\xfd" * 40
    dive = read_dive(write(tmp_path / "a.tlog", bytes(data)))
    assert len(dive.velocity) >= 99
    assert any("damaged" in note for note in dive.notes)


@pytest.mark.parametrize("nothing", [b"", bytes(5), bytes(100)])
def test_a_file_that_was_begun_and_holds_nothing_takes_no_dive_with_it(
    tmp_path: Path, nothing: bytes
) -> None:
    write(tmp_path / "telemetry.tlog", nothing)
    write(tmp_path / "telemetry.2.tlog", recording(contract_dive(4)))
    write(tmp_path / "telemetry.3.tlog", recording(contract_dive(8)[380:]))
    dive = read_dive(tmp_path)
    assert len(dive.velocity) == 80
    assert "1 of its files holds nothing, and the others are used." in dive.notes
    for name in ("telemetry.2.tlog", "telemetry.3.tlog"):
        write(tmp_path / name, nothing)
    with pytest.raises(LogError, match=r"telemetry\.tlog: (is empty|holds no MAVLink frame)"):
        read_dive(tmp_path)


def test_one_wild_time_moves_nothing_but_its_own_message(tmp_path: Path) -> None:
    stamped = contract_dive()
    honest = read_dive(write(tmp_path / "honest.tlog", recording(stamped)))
    wild = next(k for k, item in enumerate(stamped) if item[0] > 9.0)
    stamped[wild] = (*stamped[wild][:3], odometry(9e8, (0.4, 0.2, -0.1)))
    dive = read_dive(write(tmp_path / "wild.tlog", recording(stamped)))
    assert dive.velocity.time_s == pytest.approx(honest.velocity.time_s, abs=0.03)
    assert dive.span_s == honest.span_s
    assert "1 message states a time that can't be; when it arrived is taken." in dive.notes
    assert not any("restarted" in note for note in dive.notes)


def test_a_wild_time_of_a_message_that_sets_no_clock_is_when_it_arrived(tmp_path: Path) -> None:
    stamped = contract_dive()
    stamped = [
        (t, s, c, array(9e8, "TAU_CMD", range(6)) if t > 14.9 and m.id == 350 else m)
        for t, s, c, m in stamped
    ]
    dive = read_dive(write(tmp_path / "wild.tlog", recording(stamped)))
    assert dive.tau_cmd.time_s[-1] == pytest.approx(14.9, abs=0.03)


def test_a_wild_time_before_all_others_is_when_it_arrived_too(tmp_path: Path) -> None:
    times_s = 3600.0 + 0.1 * np.arange(100)
    stamped = [(t, 1, 1, attitude(0.0 if k == 50 else t, 0.0)) for k, t in enumerate(times_s)]
    dive = read_dive(write(tmp_path / "wild.tlog", recording(stamped)))
    assert dive.attitude.time_s == pytest.approx(times_s, abs=0.01)


def test_a_sender_that_states_no_time_is_dated_by_arrival(tmp_path: Path) -> None:
    stamped = contract_dive()
    timeless = [(t, s, 197, odometry(0.0, (0.1, 0.2, 0.3))) for t, s, _, m in stamped if m.id == 331]
    rest = [item for item in stamped if item[3].id != 331]
    both = sorted([*rest, *timeless], key=lambda item: item[0])
    dive = read_dive(write(tmp_path / "timeless.tlog", recording(both)))
    assert dive.velocity.time_s == pytest.approx(5.0 + 0.1 * np.arange(100), abs=0.03)
    assert dive.span_s[0] == pytest.approx(5.0, abs=0.03)


def driver_beside(heard_at: Callable[[float], float]) -> list[Stamped]:
    """A minute of an attitude that states boot times, and of a DVL's driver that states none."""
    stamped: list[Stamped] = []
    for k in range(1200):
        t = 100.0 + k / 20
        step = mav.MAVLink_vision_position_delta_message(0, 100_000, [0, 0, 0], [0.05, 0, 0], 100)
        messages = [(1, attitude(t, 0.1)), *([(255, step)] if k % 2 == 0 else [])]
        stamped += [(heard_at(t), system, 1, message) for system, message in messages]
    return stamped


@pytest.mark.parametrize("set_s", [3600.0, -3600.0, 1.0, -1.0, 5e8])
def test_a_recorder_s_clock_that_is_set_dates_nothing_anew(tmp_path: Path, set_s: float) -> None:
    stamped = driver_beside(lambda t: t + set_s * (t > 131.52))
    dive = read_dive(write(tmp_path / "set.tlog", recording(stamped)))
    assert dive.velocity.time_s == pytest.approx(99.95 + 0.1 * np.arange(600), abs=1e-3)


@pytest.mark.parametrize("set_s", [0.0, -3600.0])
def test_a_link_that_stalls_is_no_clock_that_is_set_and_hides_none(tmp_path: Path, set_s: float) -> None:
    """What it held back is dated by its arrival, for nothing tells more."""

    def heard_at(t: float) -> float:
        return 131.61 + 1e-3 * (t - 131.0) if 131.0 < t < 131.61 else t + set_s * (t > 132.0)

    stamped = driver_beside(heard_at)
    time_s = read_dive(write(tmp_path / "stalled.tlog", recording(stamped))).velocity.time_s
    honest_s = 99.95 + 0.1 * np.arange(600)
    held_back = (honest_s > 130.951) & (honest_s < 131.551)
    assert time_s[~held_back] == pytest.approx(honest_s[~held_back], abs=1e-3)
    assert time_s[held_back] == pytest.approx(131.56, abs=1e-3)


def test_times_that_lie_years_apart_are_refused_in_one_sentence(tmp_path: Path) -> None:
    stamped = [(t if t < 10 else t + 4e8, s, c, m) for t, s, c, m in contract_dive() if m.id in (0, 331)]
    late = [(t, s, c, odometry(t, (0, 0, 0)) if m.id == 331 else m) for t, s, c, m in stamped]
    with pytest.raises(LogError, match=r"late\.tlog: its times lie 4\.63e\+03 days apart") as caught:
        read_dive(write(tmp_path / "late.tlog", recording(late)))
    assert "\n" not in str(caught.value)


def test_infinite_angles_are_unknown_and_warn_nobody(tmp_path: Path) -> None:
    stamped = contract_dive()
    for k, angle in enumerate((math.inf, 0.2, -math.inf) * 100):
        message = attitude(5.0 + k / 30, angle)
        stamped.append((5.0 + k / 30, 1, 1, message))
    dive = read_dive(write(tmp_path / "a.tlog", recording(sorted(stamped, key=lambda entry: entry[0]))))
    assert np.isfinite(dive.attitude.value).all(axis=1).tolist() == [False, True, False] * 100
    assert dive.attitude.value[1] == pytest.approx([math.cos(0.1), 0.0, 0.0, math.sin(0.1)])


def test_two_vehicles_in_one_recording_are_named(tmp_path: Path) -> None:
    second = [(t, 2, c, m) for t, s, c, m in contract_dive() if s == 1]
    with pytest.raises(LogError, match=r"several vehicles.*system 1 .*system 2"):
        read_dive(write(tmp_path / "a.tlog", recording([*contract_dive(), *second])))


def test_a_passer_by_does_not_spoil_a_recording(tmp_path: Path) -> None:
    passer_by = [(t, 2, c, m) for t, s, c, m in contract_dive(1) if s == 1]
    dive = read_dive(write(tmp_path / "a.tlog", recording([*contract_dive(), *passer_by])))
    assert len(dive.velocity) == 100
    assert any("system 1 is taken" in note for note in dive.notes)


def test_a_recording_of_the_ground_station_alone_says_so(tmp_path: Path) -> None:
    stamped = [(k / 1.0, 255, 190, heartbeat(mav.MAV_TYPE_GCS, 8, False)) for k in range(20)]
    with pytest.raises(LogError, match="no vehicle's telemetry"):
        read_dive(write(tmp_path / "a.tlog", recording(stamped)))


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("notes.tlog", b"this is a text file, renamed\n" * 50, "no MAVLink frame"),
        ("empty.tlog", b"", "is empty"),
        ("empty.csv", b"", "column map"),
        ("empty.BIN", b"", "is empty"),
        ("dive.docx", b"x", "can't tell what this is"),
        ("noise.BIN", bytes(range(256)) * 20, "no DataFlash records"),
    ],
)
def test_what_is_no_recording_gets_one_sentence(tmp_path: Path, name: str, content: bytes, said: str) -> None:
    with pytest.raises(LogError, match=said) as caught:
        read_dive(write(tmp_path / name, content))
    if name == "dive.docx":
        with pytest.raises(LogError, match=said):
            read_streams(tmp_path / name)
    assert "\n" not in str(caught.value)


def test_a_missing_file_and_an_empty_folder_are_named(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="no such file"):
        read_dive(tmp_path / "nowhere.tlog")
    with pytest.raises(LogError, match="holds no recording"):
        read_dive(tmp_path)


@pytest.mark.parametrize("ending", MAPPED)
def test_an_empty_file_of_any_form_is_said_to_be_empty(tmp_path: Path, ending: str) -> None:
    empty = write(tmp_path / f"log{ending}", b"")
    with pytest.raises(LogError, match=rf"log{ending}: is empty, nothing was recorded in it; copy it again"):
        read_streams(empty)


def test_of_a_bag_in_parts_the_empty_one_is_noted_and_the_others_are_read(tmp_path: Path) -> None:
    bag = write_bag(tmp_path, "mcap", swim(ROS2, 20)).parent
    write(bag / "bag_2.mcap", b"")
    (bag / "bag.mcap").rename(bag / "bag_1.mcap")
    recorded = read_streams(bag)
    assert {stream.name for stream in recorded.streams} == {"/imu", "/thrusters", "/dvl/twist"}
    assert recorded.notes[-1] == "bag_2.mcap is empty: nothing was recorded in it."


def test_a_folder_of_tables_says_to_name_one_and_what_takes_all(tmp_path: Path) -> None:
    for name in ("b.csv", "a.csv"):
        write(tmp_path / name, b"time,u\n0,1\n")
    with pytest.raises(
        LogError, match=r"is no dive folder, but holds a\.csv, b\.csv; name one of them, and its"
    ):
        read_streams(tmp_path)


@pytest.mark.parametrize("ending", ["tlog", "TLOG", "Tlog.GZ"])
def test_a_folder_of_several_dives_is_not_taken_for_one(tmp_path: Path, ending: str) -> None:
    for name in ("dive.tlog", f"check.{ending}"):
        write(tmp_path / name, recording(contract_dive(1)))
    with pytest.raises(LogError, match=rf"several recordings \(check.{ending}, dive.tlog\)"):
        read_dive(tmp_path)


def test_a_recording_whose_ending_is_in_capitals_is_read_and_dated_like_any(tmp_path: Path) -> None:
    places = [tmp_path / "small.tlog", tmp_path / "DIVES" / "BIG.TLOG"]
    for place in places:
        place.parent.mkdir(exist_ok=True)
        write(place, recording(contract_dive()) + b"junk")
    small, big = (read_dive(place) for place in (places[0], places[1].parent))
    assert (big.counts, read_dive(places[1]).name) == (small.counts, "BIG")
    undated = [replace(dive, unix_at_boot_s=None) for dive in (small, big)]
    assert date_of(undated[0]) == date_of(undated[1])
    assert stray_bytes(places[1].parent).removeprefix("DIVES/BIG.TLOG") == stray_bytes(
        places[0]
    ).removeprefix("small.tlog")


def test_what_a_recording_lacks_is_said(tmp_path: Path) -> None:
    stamped: list[Stamped] = []
    for k in range(20):
        stamped.append((k / 2, 1, 1, servos(k * 500_000, [1500, 1600])))
        stamped.append((k / 2, 1, 1, attitude(k / 2, 0.0)))
    notes = " ".join(read_dive(write(tmp_path / "a.tlog", recording(stamped))).notes)
    assert "There is no velocity to go by: mass and damping in surge, sway and heave" in notes
    assert "Thruster commands come at 2.0 Hz" in notes


def test_a_recording_that_does_not_fit_the_vehicle_is_noted(tmp_path: Path) -> None:
    path = write(tmp_path / "a.tlog", recording(contract_dive()))
    assert any("8 thrusters" in note for note in read_dive(path, vehicle=load_vehicle("ruvifist")).notes)


START_US = 1_790_000_000_000_000
HEARTBEAT = mav.MAVLink_heartbeat_message(12, 0, 128, 0, 4, 3)


def unknown_frame(payload: bytes) -> bytes:
    return bytes((0xFD, len(payload), 0, 0, 0, 7, 8)) + (60_123).to_bytes(3, "little") + payload + b"\x12\x34"


def heartbeat_frame(head: tuple[int, ...], payload: bytes) -> bytes:
    unsealed = bytes((head[0], len(payload), *head[1:])) + payload
    return unsealed + mcrf4xx(unsealed[1:] + CRC_EXTRA[0]).to_bytes(2, "little")


def signed_frame(payload: bytes) -> bytes:
    return heartbeat_frame((0xFD, 1, 0, 9, 2, 3, 0, 0, 0), payload) + bytes(range(13))


def old_frame() -> bytes:
    packed: bytes = HEARTBEAT.pack(mav.MAVLink(None, srcSystem=4, srcComponent=5), force_mavlink1=True)
    return packed


def records(seed: int, count: int) -> bytes:
    """Frames of every kind: MAVLink 1 and 2, signed, of an unknown id, of random payloads of any length."""
    rng = random.Random(seed)
    encoder = Encoder(1, 1)
    known = sorted(CRC_EXTRA)
    out = b""
    for i in range(count):
        kind = rng.randrange(12)
        if kind == 0:
            frame = old_frame()
        elif kind == 1:
            frame = signed_frame(rng.randbytes(9))
        elif kind == 2:
            frame = unknown_frame(rng.choice([rng.randbytes(9), b"\xfd" * 40, b""]))
        else:
            frame = encoder.frame(rng.choice(known), rng.randbytes(rng.randrange(1, 256)))
        step_us = rng.choice([0, 20, 5000, 150_000, -80_000, 3_600_000_000])
        out += (START_US + 5000 * i + step_us).to_bytes(8, "big") + frame
    return out


def flipped(data: bytes, rng: random.Random, every: int) -> bytes:
    damaged = bytearray(data)
    for _ in range(max(1, len(data) // every)):
        damaged[rng.randrange(len(damaged))] ^= 1 << rng.randrange(8)
    return bytes(damaged)


def keyless(number: int, payload: bytes) -> bytes:
    """What a frame that is read bears of a payload: nothing of a key that signs frames."""
    return payload[:KEY_AT].ljust(len(payload), b"\0") if number == SETUP_SIGNING else payload


def assert_alike(path: Path) -> None:
    """`locate` and TlogReader agree on every good frame, its time and every count."""
    reader = TlogReader(path)
    careful = [(stamp, frame) for stamp, frame in reader if frame.known]
    located = locate(path)
    assert located.counts == reader.counts
    assert set(located.counts) == set(reader.counts)
    assert located.stamp_us.tolist() == [stamp for stamp, _ in careful]
    for name in ("system", "component"):
        assert getattr(located, name).tolist() == [getattr(frame, name) for _, frame in careful]
    assert located.message.tolist() == [frame.message_id for _, frame in careful]
    content = located.data.tobytes()
    places = zip(located.message, located.start, located.length, strict=True)
    payloads = [keyless(number, content[a : a + n]) for number, a, n in places]
    assert payloads == [frame.payload for _, frame in careful]


@given(seed=st.integers(0, 10**6), cut=st.floats(0, 1), drop=st.integers(0, 40))
@settings(max_examples=40)
def test_a_file_cut_and_spliced_anywhere_is_read_alike(
    tmp_path_factory: pytest.TempPathFactory, seed: int, cut: float, drop: int
) -> None:
    path = tmp_path_factory.mktemp("cut") / "a.tlog"
    data = records(seed, 30)
    place = int(cut * len(data))
    for damaged in (old_record() + data[:place], old_record() + data[:place] + data[place + drop :]):
        path.write_bytes(damaged)
        assert_alike(path)


def old_record() -> bytes:
    """So that whatever follows is cut to, a recording stays one."""
    return START_US.to_bytes(8, "big") + old_frame()


@pytest.mark.parametrize("every", [30, 300, 3000])
def test_flipped_bits_are_read_alike(tmp_path: Path, every: int) -> None:
    rng = random.Random(every)
    path = tmp_path / "a.tlog"
    for seed in range(12):
        path.write_bytes(old_record() + flipped(records(seed, 60), rng, every))
        assert_alike(path)


def test_lost_and_wild_stamps_one_after_another_are_mended_alike(tmp_path: Path) -> None:
    rng = random.Random(4)
    frame = old_frame()
    path = tmp_path / "a.tlog"
    wild = (0, START_US, START_US + 90_000, START_US + 10**9, 2**63 + 5, 2**64 - 1, START_US - 10**9)
    mended = 0
    for count in (1, 2, 3, 40, 40, 40, 40, 40):
        stamps = [rng.choice(wild) if rng.random() < 0.6 else START_US + 5000 * i for i in range(count)]
        path.write_bytes(b"".join(stamp.to_bytes(8, "big") + frame for stamp in stamps))
        assert_alike(path)
        mended += locate(path).counts["stamps mended"]
    assert mended > 50


def test_frames_without_any_stamp_are_read_alike(tmp_path: Path) -> None:
    path = tmp_path / "a.tlog"
    path.write_bytes(old_frame() * 40)
    assert_alike(path)
    assert len(locate(path).start) == 40


def test_unknown_and_damaged_frames_are_counted_by_kind(tmp_path: Path) -> None:
    stamp = START_US.to_bytes(8, "big")
    good, broken = stamp + old_frame(), stamp + old_frame()[:-1] + b"\x00"
    path = tmp_path / "a.tlog"
    path.write_bytes(good + stamp + unknown_frame(bytes(9)) + good + broken + good + good[:-3])
    assert locate(path).counts == Counter(
        records=4, unknown=1, checksum=1, cut=1, skipped=len(broken) + len(good) - 3
    )


def test_every_byte_of_a_frame_is_under_its_checksum(tmp_path: Path) -> None:
    encoder = Encoder(1, 1)
    stamp = START_US.to_bytes(8, "big")
    path = tmp_path / "a.tlog"
    for length in (1, 7, 8, 9, 15, 16, 17):
        frame = encoder.frame(31, bytes(range(200, 200 + length)))
        for place in range(len(frame)):
            damaged = frame[:place] + bytes((frame[place] ^ 0x10,)) + frame[place + 1 :]
            path.write_bytes((stamp + old_frame()) * 2 + stamp + damaged + (stamp + old_frame()) * 2)
            assert set(locate(path).message) == {0}


@pytest.mark.parametrize(
    ("head", "size"),
    [((0xFE, 9, 2, 3, 0), 10), ((0xFD, 2, 0, 9, 2, 3, 0, 0, 0), 9), ((0xFC, 9, 2, 3, 0), 9)],
)
def test_a_frame_of_no_valid_form_is_none_though_its_checksum_is_right(
    tmp_path: Path, head: tuple[int, ...], size: int
) -> None:
    stamp = START_US.to_bytes(8, "big")
    path = tmp_path / "a.tlog"
    path.write_bytes(old_record() + stamp + heartbeat_frame(head, b"\1" * size) + old_record() * 3)
    assert_alike(path)
    assert len(locate(path).start) == 4


def test_a_field_is_what_the_full_payload_would_hold(tmp_path: Path) -> None:
    """MAVLink 2 cuts trailing zeros, so that a field may be there, half there or not at all."""
    encoder = Encoder(1, 1)
    values = [[1.5, -2.0], [0.0, 3.0], [0.0, 0.0], [2.0**-120, 0.0]]
    data = b""
    for pair in values:
        message = mav.MAVLink_debug_float_array_message(7, b"RPM", 256, [*pair, *[0.0] * 56])
        data += START_US.to_bytes(8, "big") + encoder.encode(message)
    first, second = tmp_path / "a.tlog", tmp_path / "b.tlog"
    first.write_bytes(data)
    second.write_bytes(old_record() + data)
    frames = load_frames([first, second])
    fields = Fields(frames, "DEBUG_FLOAT_ARRAY", frames.rows("DEBUG_FLOAT_ARRAY"))
    assert fields.first("data", 2).tolist() == values * 2
    assert fields["data"].shape == (8, 58)
    assert set(fields["name"]) == {b"RPM"}
    assert fields["time_usec"].tolist() == [7] * 8
    assert fields.at(np.array([5]))["data"][0, 1] == 3.0
    assert np.count_nonzero(frames.message == message_id("HEARTBEAT")) == 1


@pytest.mark.parametrize("name", ["sealed/open_1/check.tlog.gz", "data/ardusub_dives/small.tlog"])
def test_recordings_of_others_are_read_alike_whole_and_damaged(tmp_path: Path, name: str) -> None:
    source = shared(name)
    assert_alike(source)
    data = locate(source).data[:400_000].tobytes()
    path = tmp_path / "a.tlog"
    path.write_bytes(flipped(data, random.Random(1), 1000))
    assert_alike(path)
