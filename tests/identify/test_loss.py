"""Loss by sequence numbers, of what a recording holds."""

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav

from bridge.errors import LogError
from bridge.wire.framing import Encoder
from bridge.wire.redaction import FILE_TRANSFER
from bridge.wire.tlog import TlogWriter
from identify.ingest.mavlink.message_loss import Loss, loss_of

BOOT_US = 1_790_000_000_000_000


def attitudes(count, system=1, component=1, skip=0):
    encoder = Encoder(system, component)
    frames = [
        encoder.encode(mav.MAVLink_attitude_quaternion_message(100 * k, 1.0, 0, 0, 0, 0, 0, 0))
        for k in range(skip + count)
    ]
    return [(k, raw) for k, raw in enumerate(frames)][skip:]


def written(path, numbered, step_us=100_000, late_us=0):
    with TlogWriter(path) as writer:
        for k, raw in numbered:
            writer.write(BOOT_US + k * step_us + late_us * (k >= 300), raw)
    return [path]


def lost_in(tmp_path, numbered, **how):
    return loss_of(written(tmp_path / "a.tlog", numbered, **how), "a.tlog")


def test_what_is_missing_between_two_numbers_is_lost_and_nothing_where_they_go_round(tmp_path):
    assert loss_of(written(tmp_path / "whole.tlog", attitudes(1000)), "") == Loss(1000, 0)
    kept = [item for item in attitudes(1000) if item[0] % 10]
    loss = lost_in(tmp_path, kept)
    assert loss == Loss(900, 99)
    assert loss.share == pytest.approx(99 / 999)


def test_frames_of_two_links_count_once_and_late_ones_are_not_lost(tmp_path):
    sent = attitudes(500)
    order = sorted([*sent, *sent[::3]], key=lambda item: item[0])
    order[100], order[103] = order[103], order[100]
    assert lost_in(tmp_path, order) == Loss(500, 0)


def test_numbers_that_start_anew_after_a_silence_are_no_loss(tmp_path):
    again = [(300 + k, raw) for k, raw in attitudes(100, skip=77)]
    assert lost_in(tmp_path, [*attitudes(300), *again], late_us=60_000_000).lost == 0


def test_what_was_said_while_files_were_fetched_was_heard_though_a_whole_recording_leaves_it_out(tmp_path):
    encoder, numbered = Encoder(1, 1), []
    for k in range(900):
        if 300 <= k < 600 and k % 3:
            numbered.append((k, encoder.frame(FILE_TRANSFER, bytes([0, 255, 190, k % 256]))))
        else:
            numbered.append(
                (k, encoder.encode(mav.MAVLink_attitude_quaternion_message(100 * k, 1.0, 0, 0, 0, 0, 0, 0)))
            )
    heard = written(tmp_path / "telemetry.tlog", numbered)
    telemetry = [(k, raw) for k, raw in numbered if raw[7] != FILE_TRANSFER]
    whole = written(tmp_path / "telemetry.whole.tlog", telemetry)
    assert loss_of(whole, "") == Loss(700, 200)
    assert loss_of(whole, "", heard) == Loss(900, 0)
    gone = [(k, raw) for k, raw in telemetry if k not in range(450, 470)]
    assert loss_of(written(tmp_path / "gone.tlog", gone), "", heard) == Loss(893, 7)
    (tmp_path / "empty.tlog").touch()
    assert loss_of(whole, "", [tmp_path / "empty.tlog"]) == Loss(700, 200)


def clocked(count, first=0):
    """Numbers from `first` on; of each ten frames the first tells the boot clock."""
    encoder, frames = Encoder(1, 1), []
    for k in range(first + count):
        boot_ms = 100 * (k - first) % 2**32
        clock = mav.MAVLink_system_time_message(0, boot_ms)
        other = mav.MAVLink_attitude_quaternion_message(boot_ms, 1.0, 0, 0, 0, 0, 0, 0)
        frames.append(encoder.encode(other if (k - first) % 10 else clock))
    return frames[first:]


@pytest.mark.parametrize(("first", "unheard"), [(0, 0), (20, 3), (150, 0), (150, 3)])
def test_numbers_that_start_anew_with_the_vehicle_are_no_loss(tmp_path, first, unheard):
    heard = [*clocked(95, first), *clocked(200)[unheard:]]
    numbered = [item for item in enumerate(heard) if item[0] not in (33, 120)]
    assert lost_in(tmp_path, numbered) == Loss(95 + 200 - unheard - 2, 2)


def test_who_says_little_does_not_count(tmp_path):
    camera = [item for item in attitudes(1000, component=100) if item[0] % 50 == 0]
    assert lost_in(tmp_path, sorted([*attitudes(1000), *camera], key=lambda item: item[0])) == Loss(1000, 0)


def test_a_recording_without_a_vehicle_is_refused(tmp_path):
    encoder = Encoder(255, 190)
    beats = [(k, encoder.encode(mav.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))) for k in range(5)]
    with pytest.raises(LogError, match="no vehicle's telemetry"):
        lost_in(tmp_path, beats)


def busy(count, ring=False):
    """Fifty frames a second, each telling the boot clock; a vehicle with a ring tells its boot once a second."""
    encoder, frames = Encoder(1, 1), []
    for k in range(count):
        message = mav.MAVLink_attitude_quaternion_message(20 * k, 1.0, 0, 0, 0, 0, 0, 0)
        if ring and k % 50 == 0:
            message = mav.MAVLink_named_value_int_message(20 * k, b"BOOT_ID", 77)
        frames.append((k, encoder.encode(message)))
    return frames


@pytest.mark.parametrize(
    ("ring", "advice"),
    [
        (True, "`seatrial fetch` brings what the vehicle kept of it."),
        (False, "another recording of the dive may have it, see `seatrial merge`."),
    ],
)
def test_a_minute_unheard_is_lost_however_often_the_numbers_went_round(tmp_path, ring, advice):
    kept = [item for item in busy(6000, ring) if not 1000 < item[0] < 4000]
    loss = loss_of(written(tmp_path / "a.tlog", kept, step_us=20_000), "a.tlog")
    assert (loss.received, loss.lost, round(loss.unheard_s)) == (3001, 2999, 60)
    assert loss.note == f"Nothing was heard of the vehicle for 60 s at a stretch, from 0:20 on: {advice}"


def test_three_seconds_in_which_the_numbers_went_round_are_lost_too_and_no_silence(tmp_path):
    encoder = Encoder(1, 1)
    raw = [
        encoder.encode(mav.MAVLink_attitude_quaternion_message(5 * k, 1.0, 0, 0, 0, 0, 0, 0))
        for k in range(6000)
    ]
    kept = [(k, frame) for k, frame in enumerate(raw) if not 3000 <= k < 3600]
    loss = loss_of(written(tmp_path / "a.tlog", kept, step_us=5_000), "a.tlog")
    assert loss == Loss(5400, 600)


def test_a_link_that_holds_back_three_seconds_and_brings_them_at_once_has_lost_nothing(tmp_path):
    encoder = Encoder(1, 1)
    with TlogWriter(tmp_path / "a.tlog") as writer:
        for k in range(6000):
            held_until = 3600 if 3000 <= k < 3600 else k
            message = mav.MAVLink_attitude_quaternion_message(5 * k, 1.0, 0, 0, 0, 0, 0, 0)
            writer.write(BOOT_US + held_until * 5_000 + k, encoder.encode(message))
    assert loss_of([tmp_path / "a.tlog"], "a.tlog") == Loss(6000, 0)


def test_slow_heartbeats_between_two_dives_are_no_hole(tmp_path):
    sent, encoder = [], Encoder(1, 1)
    for at_s in [*(n / 50 for n in range(1500)), *range(36, 90, 6), *(90 + n / 50 for n in range(1500))]:
        message = mav.MAVLink_attitude_quaternion_message(round(1e3 * at_s), 1.0, 0, 0, 0, 0, 0, 0)
        if at_s in range(36, 90, 6):
            message = mav.MAVLink_heartbeat_message(12, 3, 0, 0, 4, 3)
        sent.append((at_s * 50, encoder.encode(message)))
    loss = loss_of(
        written(tmp_path / "a.tlog", [(round(k), raw) for k, raw in sent], step_us=20_000), "a.tlog"
    )
    assert loss == Loss(len(sent), 0)
