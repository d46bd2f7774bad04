"""Signatures of frames as the MAVLink guide says, and files of keys."""

import hashlib
import os
import stat

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import SimulatedClock
from bridge.errors import ConfigError, FrameError
from bridge.signing.key import (
    SigningKey,
    is_of,
    is_signed,
    link_and_time,
    new_key,
    of_passphrase,
    read_key,
    signed,
    unsigned,
    write_key,
)
from bridge.signing.link import EPOCH_UNIX_S, STEPS_A_S, Gate, Times
from bridge.wire.framing import CRC_EXTRA, Encoder, Framer, decode

SECRET = hashlib.sha256(b"one").digest()
OTHER = hashlib.sha256(b"another").digest()
BEAT = dialect.MAVLink_heartbeat_message(12, 0, 0, 0, 4, 3)
TIME = 0x123456789A


def plain(sequence_from=0):
    encoder = Encoder(1, 1)
    for _ in range(sequence_from):
        encoder.encode(BEAT)
    return encoder.encode(BEAT)


def frame_of(raw):
    framer = Framer()
    (frame,) = [*framer.feed(raw), *framer.flush()]
    return frame


def pymavlink_with(secret, time):
    mav = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    mav.signing.secret_key = secret
    mav.signing.link_id = 7
    mav.signing.timestamp = time
    mav.signing.sign_outgoing = True
    return mav


def test_the_bytes_of_a_signature_are_those_of_the_guide():
    raw = signed(plain(), SECRET, 5, TIME)
    assert raw[2] == 1
    assert raw[-13] == 5
    assert raw[-12:-6] == TIME.to_bytes(6, "little")
    assert raw[-6:] == hashlib.sha256(SECRET + raw[:-6]).digest()[:6]
    assert link_and_time(raw) == (5, TIME)


def test_what_pymavlink_signs_is_taken_here():
    raw = bytes(BEAT.pack(pymavlink_with(SECRET, TIME)))
    assert is_signed(raw)
    assert is_of(raw, SECRET)
    assert not is_of(raw, OTHER)
    assert link_and_time(raw) == (7, TIME)
    assert decode(frame_of(unsigned(raw))).get_type() == "HEARTBEAT"


def test_a_gate_takes_what_pymavlink_signs_and_pymavlink_takes_what_a_gate_signs():
    clock = SimulatedClock()
    time = round((clock.unix_s() - EPOCH_UNIX_S) * STEPS_A_S)
    gate = Gate("link", SigningKey(SECRET), Times(clock), clock, lambda _: None)
    theirs, ours = pymavlink_with(SECRET, time), Encoder(255, 190)
    for _ in range(3):
        assert gate.admit(frame_of(bytes(BEAT.pack(theirs))))
        assert theirs.decode(bytearray(gate.out(ours.encode(BEAT)))).get_srcSystem() == 255
    assert not gate.counts
    with pytest.raises(dialect.MAVError):
        theirs.decode(bytearray(signed(plain(), OTHER, 5, time + STEPS_A_S)))


def test_every_byte_of_a_signed_frame_is_under_its_signature():
    whole = signed(plain(), SECRET, 5, TIME)
    assert len(whole) == 34
    for place in range(len(whole)):
        raw = bytearray(whole)
        raw[place] ^= 1
        assert not is_of(bytes(raw), SECRET), place


def test_a_signature_taken_off_leaves_the_frame_as_it_was():
    assert unsigned(signed(plain(), SECRET, 5, TIME)) == plain()
    assert unsigned(plain()) == plain()


def test_a_frame_signed_anew_bears_one_signature():
    assert signed(signed(plain(), OTHER, 1, 9), SECRET, 5, TIME) == signed(plain(), SECRET, 5, TIME)


def test_a_message_that_nobody_knows_is_signed_with_a_right_checksum(monkeypatch):
    number = 30_001
    assert number not in CRC_EXTRA
    monkeypatch.setitem(CRC_EXTRA, number, b"\x2a")
    raw = Encoder(1, 1).frame(number, b"payload")
    monkeypatch.delitem(CRC_EXTRA, number)
    sealed = signed(raw, SECRET, 0, TIME)
    assert unsigned(sealed) == raw
    monkeypatch.setitem(CRC_EXTRA, number, b"\x2a")
    assert frame_of(sealed).known


def test_a_frame_with_a_wrong_checksum_has_a_wrong_one_without_its_signature():
    raw = bytearray(plain())
    raw[-1] ^= 0x10
    assert unsigned(signed(bytes(raw), SECRET, 0, TIME)) == bytes(raw)


def test_mavlink_1_can_not_be_signed():
    mav = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    with pytest.raises(FrameError, match="MAVLink 1 can't be signed"):
        signed(bytes(BEAT.pack(mav, force_mavlink1=True)), SECRET, 0, TIME)


def test_a_key_that_was_made_is_read_again(tmp_path):
    key = new_key()
    before = os.umask(0)
    try:
        write_key(tmp_path / "key", key)
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "key").stat().st_mode) == 0o600
    assert read_key(tmp_path / "key") == key
    assert new_key() != key


@pytest.mark.parametrize("mode", [0o640, 0o604, 0o620, 0o610, 0o644])
def test_a_key_that_others_can_come_at_is_refused(tmp_path, mode):
    write_key(tmp_path / "key", new_key())
    (tmp_path / "key").chmod(mode)
    with pytest.raises(ConfigError, match=r"others can read or change this key .* chmod 600"):
        read_key(tmp_path / "key")


def test_a_key_is_never_overwritten(tmp_path):
    key = new_key()
    write_key(tmp_path / "key", key)
    with pytest.raises(ConfigError, match="never overwritten"):
        write_key(tmp_path / "key", new_key())
    assert read_key(tmp_path / "key") == key


def test_a_file_that_is_absent_or_holds_no_key_is_said(tmp_path):
    with pytest.raises(ConfigError, match="make one with seatrial keys make"):
        read_key(tmp_path / "none")
    file = tmp_path / "key"
    for text in ("", "ab" * 31, "ab" * 33, "xy" * 32, "é" * 64):
        file.write_text(text)
        file.chmod(0o600)
        with pytest.raises(ConfigError, match="holds no key") as caught:
            read_key(file)
        assert not text or text not in str(caught.value)
    with pytest.raises(ConfigError, match="is no file"):
        read_key(tmp_path)


def test_no_text_that_is_made_of_a_key_shows_it():
    key = new_key()
    shown = f"{key} {key!r} {[key]} {key.fingerprint}"
    assert key.secret.hex()[:8] not in shown.replace("-", "")
    assert repr(key.secret) not in shown
    assert key.fingerprint == SigningKey(key.secret).fingerprint != new_key().fingerprint


def test_a_passphrase_gives_the_key_that_other_ground_stations_make_of_it():
    digest = "5e884898da28047151d0e56f8dc6292773603d0d6aabbdd62a11ef721d1542d8"  # sha256sum of it
    assert of_passphrase("password").secret.hex() == digest
