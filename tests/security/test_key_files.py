"""Files of keys: nobody else reads them, and nothing shows what is in them."""

import os
import stat

import pytest

from bridge.errors import ConfigError
from bridge.signing.key import SigningKey, new_key, of_passphrase, read_key, write_key


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
