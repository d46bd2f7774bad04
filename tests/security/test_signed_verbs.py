"""Verbs that open links, with a key: recording, output, and the key in neither."""

import json

import pytest
from fakes.recordings import raws
from pymavlink.dialects.v20 import ardupilotmega as dialect
from waiting import ended_once

import bridge.onboard.ports  # noqa: F401  (before any test replaces what it imports)
from bridge import exit_codes
from bridge.errors import LinkError
from bridge.links.link import memory_pair
from bridge.signing.key import is_of, is_signed, new_key, read_key, signed, write_key
from bridge.signing.link import EPOCH_UNIX_S, STEPS_A_S
from bridge.wire.framing import Encoder, Framer
from bridge.wire.tlog import read_tlog
from tui import cli
from tui.app import recorder as app_recorder

BEAT = dialect.MAVLink_heartbeat_message(12, 0, 0, 0, 4, 3)


@pytest.fixture(autouse=True)
def own_state(monkeypatch, tmp_path):
    """State between runs, in a folder of its own."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))


@pytest.fixture
def far_end(monkeypatch):
    """The other end of the link that the next verb opens."""
    near, far = memory_pair()

    def opened(spec):
        if spec != "any":
            raise LinkError(f"{spec}: is not there; plug it in")
        return near

    monkeypatch.setattr("bridge.links.open.open_link", opened)
    monkeypatch.setattr("bridge.onboard.ports.open_link", opened)
    return far


@pytest.fixture
def ends_with_what_was_sent(far_end, monkeypatch):
    """The next verb that listens ends once it has read all that its other end sent."""
    ended_once(monkeypatch, lambda: not far_end._outbox)


@pytest.fixture
def key_file(tmp_path):
    write_key(tmp_path / "the.key", new_key())
    return tmp_path / "the.key"


def signed_beats(key, count=20):
    from bridge.clock import SystemClock

    time = round((SystemClock().unix_s() - EPOCH_UNIX_S) * STEPS_A_S)
    encoder = Encoder(1, 1)
    return [signed(encoder.encode(BEAT), key.secret, 0, time + number) for number in range(count)]


def plain_beats(count=20):
    encoder = Encoder(1, 1)
    return [encoder.encode(BEAT) for _ in range(count)]


def sent_to(link):
    framer, frames = Framer(), []
    while link._inbox:
        frames += framer.feed(link.read(0))
    return frames


@pytest.mark.usefixtures("ends_with_what_was_sent")
def test_a_recording_of_a_signed_link_holds_unsigned_frames_and_nothing_holds_the_key(
    far_end, key_file, tmp_path, capsys
):
    key = read_key(key_file)
    for raw in (*signed_beats(key), *plain_beats(3)):
        far_end.write(raw)
    line = ["record", "--link", "any", "--sign-key", str(key_file), "--out", str(tmp_path / "dives")]
    code = cli.main([*line, "--heartbeat", "--json", "-"])
    said = capsys.readouterr()
    assert code == exit_codes.DONE
    (folder,) = (tmp_path / "dives").iterdir()
    assert raws(folder / "telemetry.tlog") == plain_beats()
    beats = sent_to(far_end)
    assert beats
    assert all(is_of(frame.raw, key.secret) for frame in beats)
    assert f"links are signed with the key {key.fingerprint}" in said.err
    assert "frames refused: 3 unsigned refused" in said.err
    for text in (said.out, said.err):
        assert key.secret.hex() not in text
    for file in tmp_path.rglob("*"):
        if file.is_file() and file != key_file:
            data = file.read_bytes()
            assert key.secret not in data
            assert key.secret.hex().encode() not in data.lower()


@pytest.mark.usefixtures("ends_with_what_was_sent")
def test_a_recording_in_which_all_was_refused_blames_the_keys_and_no_cable(
    far_end, key_file, tmp_path, capsys
):
    for raw in plain_beats(3):
        far_end.write(raw)
    line = ["record", "--link", "any", "--sign-key", str(key_file), "--out", str(tmp_path / "dives")]
    assert cli.main(line) == exit_codes.LINK
    said = " ".join(capsys.readouterr().err.split())
    assert (
        "all that arrived on any was refused, so no dive folder is kept; check the keys of both sides" in said
    )
    assert "cable" not in said


def test_a_recording_that_lets_nothing_in_says_so_within_three_seconds(
    far_end, key_file, tmp_path, capsys, monkeypatch
):
    for raw in plain_beats():
        far_end.write(raw)
    reports = []
    monkeypatch.setattr("tui.commands.record.write_holding", lambda holding, **_: reports.append(holding))
    line = ["record", "--link", "any", "--sign-key", str(key_file), "--out", str(tmp_path / "dives")]
    assert cli.main([*line, "--seconds", "3"]) == exit_codes.LINK
    assert "system 1, component 1, sends is refused, since it is not signed; give its side the same key" in (
        capsys.readouterr().err
    )
    assert "give its side the same key" in reports[-1].trouble
    assert reports[-1].refused == "20 unsigned refused"
    assert reports[-1].sign_key == str(key_file)


@pytest.mark.usefixtures("ends_with_what_was_sent")
def test_watch_of_a_signed_link_shows_what_it_refuses(far_end, key_file, capsys):
    far_end.write(b"".join((*signed_beats(read_key(key_file)), *signed_beats(new_key(), 4))))
    line = ["watch", "--link", "any", "--sign-key", str(key_file), "--once"]
    cli.main(line)
    assert "\n4 of another key refused\n" in capsys.readouterr().out


def test_doctor_has_a_line_for_what_a_signed_link_refused(far_end, key_file, tmp_path, capsys):
    far_end.write(b"".join(plain_beats(4)))
    line = [
        "doctor",
        "--link",
        "any",
        "--sign-key",
        str(key_file),
        "--seconds",
        "0.3",
        "--out",
        str(tmp_path),
    ]
    cli.main([*line, "--json", "-"])
    (result,) = [load for load in json.loads(capsys.readouterr().out) if load["name"] == "signing"]
    assert result == {"name": "signing", "level": "warning", "sentence": "any: 4 unsigned refused"}


def test_a_bridge_with_a_key_signs_takes_no_unsigned_order_and_says_so_to_its_ground(
    far_end, key_file, tmp_path, capsys
):
    ground = Encoder(255, 190)
    order = dialect.MAVLink_param_set_message(1, 1, b"FF_MODE", 0.0, 9)
    far_end.write(ground.encode(order))
    line = ["bridge", "--vehicle", "ruvifist:hovering", "--link", "any", "--sign-key", str(key_file)]
    cli.main([*line, "--parameters", str(tmp_path / "store.json"), "--seconds", "3"])
    frames = sent_to(far_end)
    assert frames
    assert all(is_signed(frame.raw) for frame in frames)
    texts = b"".join(frame.payload for frame in frames if frame.message_id == 253)
    assert b"system 255/190 is refused: unsigned" in texts
    assert not [frame for frame in frames if frame.message_id == 22]
    assert "system 255, component 190, sends is refused, since it is not signed" in capsys.readouterr().err


def test_a_key_that_others_can_read_stops_a_verb_before_it_opens_a_link(key_file, tmp_path, capsys):
    key_file.chmod(0o644)
    line = ["record", "--link", "any", "--sign-key", str(key_file), "--out", str(tmp_path / "dives")]
    assert cli.main(line) == exit_codes.BAD_INPUT
    assert "others can read or change this key" in capsys.readouterr().err


def test_keys_are_made_and_told_apart_and_never_shown(tmp_path, capsys):
    file = tmp_path / "a.key"
    assert cli.main(["keys", "make", str(file)]) == exit_codes.DONE
    assert cli.main(["keys", "show", str(file)]) == exit_codes.DONE
    made, shown = capsys.readouterr().out.splitlines()
    key = read_key(file)
    assert key.fingerprint in made
    assert shown == f"{file}: key {key.fingerprint}"
    assert key.secret.hex() not in made + shown
    assert cli.main(["keys", "make", str(file)]) == exit_codes.BAD_INPUT
    assert read_key(file) == key


@pytest.mark.parametrize(("typed", "code"), [(("sea", "sea"), 0), (("sea", "see"), 2), (("", ""), 2)])
def test_a_key_of_a_passphrase_is_typed_twice(tmp_path, monkeypatch, typed, code):
    words = iter(typed)
    monkeypatch.setattr("getpass.getpass", lambda _: next(words))
    assert cli.main(["keys", "make", str(tmp_path / "a.key"), "--passphrase"]) == code
    assert (tmp_path / "a.key").exists() == (code == 0)


def test_the_recording_that_the_app_begins_gets_the_key(key_file):
    words = app_recorder.options(["any"], "dives", "", str(key_file))
    assert words == ["--link", "any", "--out", "dives", "--sign-key", str(key_file)]
    assert "--sign-key" not in app_recorder.options(["any"], "dives", "")


@pytest.mark.usefixtures("ends_with_what_was_sent")
def test_a_side_without_a_key_says_at_once_that_the_other_signs(far_end, tmp_path, capsys):
    sent = signed_beats(new_key())
    far_end.write(b"".join(sent))
    cli.main(["record", "--link", "any", "--out", str(tmp_path / "dives")])
    said = capsys.readouterr().err
    assert said.count("system 1 signs what it sends, and may refuse all that comes from here") == 1


@pytest.mark.usefixtures("ends_with_what_was_sent")
def test_two_sides_without_a_key_hear_nothing_of_signing(far_end, tmp_path, capsys):
    far_end.write(b"".join(plain_beats(300)))
    cli.main(["record", "--link", "any", "--out", str(tmp_path / "dives")])
    assert "sign" not in capsys.readouterr().err
    (folder,) = (tmp_path / "dives").iterdir()
    assert len(list(read_tlog(folder / "telemetry.tlog"))) == 300
