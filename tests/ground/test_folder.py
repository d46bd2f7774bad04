"""Dive folders: named by UTC, never shared, with the conditions of their dive."""

import gzip
import math
import os
import subprocess
import sys
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.errors import ConfigError, LogError
from bridge.wire.framing import Encoder
from bridge.wire.readings import Reading, encode
from bridge.wire.tlog import TlogWriter
from gcs_plugin.dives.conditions import (
    NOTHING_SAID,
    Conditions,
    density_kg_m3,
    mistakes,
    of_texts,
    texts_of,
)
from gcs_plugin.dives.folder import (
    About,
    DiveFolder,
    Event,
    last_conditions,
    list_folders,
    load_folder,
    new_folder,
)
from gcs_plugin.dives.recordings import began, length_s
from gcs_plugin.dives.replay import Reel
from gcs_plugin.locks import folder_lock

SECOND_S = 1_795_165_923.0


@pytest.fixture
def folder(tmp_path):
    return new_folder(tmp_path, SECOND_S, "x")


def test_a_folder_is_named_by_utc_and_name_and_dives_of_one_minute_get_folders_of_their_own(tmp_path):
    names = [new_folder(tmp_path / "dives", SECOND_S, "Hovering / No. 2").path.name for _ in range(3)]
    assert names == [f"2026-11-20T0912Z-hovering-no-2{end}" for end in ("", "-2", "-3")]


def recorded(root, name, began_s, telemetry="telemetry.tlog", lasts_s=0.0):
    folder = root / name
    folder.mkdir()
    frame = Encoder(1, 1).encode(dialect.MAVLink_heartbeat_message(12, 0, 0, 0, 4, 3))
    data = b"".join(round(s * 1e6).to_bytes(8, "big") + frame for s in (began_s, began_s + lasts_s))
    (folder / telemetry).write_bytes(gzip.compress(data) if telemetry.endswith(".gz") else data)
    return DiveFolder(folder)


def test_dives_are_in_the_order_in_which_they_began_whatever_they_are_called(tmp_path):
    second = recorded(tmp_path, "a-off", SECOND_S + 90)
    third = recorded(tmp_path, "2026-11-20T0912Z-both", SECOND_S + 100, "telemetry.tlog.gz")
    fourth = recorded(tmp_path, "2026-11-20T0912Z-again", SECOND_S + 110)
    first = recorded(tmp_path, "z", SECOND_S)
    assert list_folders(tmp_path) == [first, second, third, fourth]


def test_a_recording_that_was_packed_since_is_read_as_it_was(tmp_path):
    folder = recorded(tmp_path, "dive", SECOND_S)
    before = Reel(load_folder(folder.path).telemetry())
    plain = folder.path / "telemetry.tlog"
    (folder.path / "telemetry.tlog.gz").write_bytes(gzip.compress(plain.read_bytes()))
    plain.unlink()
    after = Reel(load_folder(folder.path).telemetry())
    assert list(after.between(0.0, 1.0)) == list(before.between(0.0, 1.0)) != []


def test_a_dive_simulated_at_once_comes_before_what_was_recorded_after_it_although_that_ended_sooner(
    tmp_path,
):
    simulated = recorded(tmp_path, "at-once", SECOND_S, lasts_s=112.0)
    afloat = recorded(tmp_path, "afloat", SECOND_S + 10, lasts_s=60.0)
    assert list_folders(tmp_path) == [simulated, afloat]


@pytest.mark.parametrize(
    ("name", "words"),
    [("Müggelsee", "müggelsee"), ("Mu\u0308ggelsee", "müggelsee"), ("дно_2", "дно-2"), ("../..", "")],
)
def test_a_folder_keeps_the_letters_of_its_name_in_any_alphabet_and_nothing_else(tmp_path, name, words):
    path = new_folder(tmp_path, SECOND_S, name).path
    assert path.name == "-".join(filter(None, ("2026-11-20T0912Z", words)))
    assert path.parent == tmp_path


def test_a_recording_without_a_message_yet_comes_after_a_dive_that_ended_in_the_minute_of_its_name(tmp_path):
    begins = tmp_path / "2026-11-20T0912Z-begins"
    begins.mkdir()
    (begins / "telemetry.tlog").touch()
    ended = recorded(tmp_path, "ended", SECOND_S - 30, lasts_s=40.0)
    assert list_folders(tmp_path) == [ended, DiveFolder(begins)]


def test_a_name_dates_a_dive_only_where_its_recording_does_not(tmp_path):
    by_name = recorded(tmp_path, "2026-11-20T0913Z-no-clock", 12.0)  # the recorder believed in 1970
    before = recorded(tmp_path, "2026-11-21T0000Z-misnamed", SECOND_S)
    after = recorded(tmp_path, "2026-11-19T0000Z-misnamed", SECOND_S + 120)
    nobody_knows = recorded(tmp_path, "lake", 12.0)
    assert list_folders(tmp_path) == [nobody_knows, before, by_name, after]


def test_a_recording_that_has_just_begun_is_dated_by_its_first_frame_once_it_is_there(tmp_path):
    folder = DiveFolder(tmp_path / "off")
    folder.path.mkdir()
    with folder.open_telemetry(1) as writer:
        assert began(folder.path) is None
        writer.write(
            round(SECOND_S * 1e6), Encoder(1, 1).encode(dialect.MAVLink_heartbeat_message(12, 0, 0, 0, 4, 3))
        )
        assert began(folder.path) == SECOND_S


def test_the_order_is_told_without_reading_a_recording_twice(tmp_path, monkeypatch):
    dives = [recorded(tmp_path, name, SECOND_S + n) for n, name in enumerate("ab")]
    assert list_folders(tmp_path) == dives
    monkeypatch.setattr(Path, "open", None)
    assert list_folders(tmp_path) == dives


def test_a_recording_that_can_not_be_opened_hides_no_dive(tmp_path):
    good = recorded(tmp_path, "a", SECOND_S)
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / "telemetry.tlog").symlink_to("/nonexistent")
    (tmp_path / "c").mkdir()
    os.mkfifo(tmp_path / "c" / "telemetry.tlog")
    assert [folder.path.name for folder in list_folders(tmp_path)] == ["b", "c", "a"]
    assert list_folders(tmp_path)[-1] == good


def test_what_is_known_of_a_dive_is_kept_beside_it(folder):
    assert folder.about() == About()
    folder.describe(About("v.yaml", "abc", "hovering", "calm: 3 °C\nclear"))
    folder.add_event(SECOND_S, "a new file")
    assert folder.about() == About(
        "v.yaml", "abc", "hovering", "calm: 3 °C\nclear", (Event("2026-11-20T09:12:03Z", "a new file"),)
    )


@pytest.mark.parametrize(("notes", "kept"), [("", False), ("the tether was caught", True)])
def test_an_empty_dive_leaves_its_folder_only_with_a_note_in_it(folder, notes, kept):
    folder.describe(About("v.yaml", "abc", "hovering", notes))
    folder.open_telemetry(1).close()
    folder.discard()
    assert folder.path.exists() is kept
    assert not kept or [path.name for path in folder.path.iterdir()] == ["dive.yaml"]


def test_an_empty_dive_keeps_the_conditions_that_were_given_for_it_and_none_that_were_taken_over(tmp_path):
    recorded(tmp_path, "before", SECOND_S).describe(About(conditions=KNOWN))
    for conditions, kept in ((KNOWN, False), (FRESH, True)):
        folder = new_folder(tmp_path, SECOND_S + 3600.0, "waits")
        folder.describe(About("v.yaml", "abc", "hovering"))
        folder.set_conditions(conditions)
        folder.open_telemetry(1).close()
        folder.discard()
        assert folder.path.exists() is kept
    assert last_conditions(tmp_path, tmp_path / "about to begin") == FRESH


def test_an_empty_dive_whose_description_can_not_be_read_keeps_it(folder):
    folder.open_telemetry(1).close()
    (folder.path / "dive.yaml").write_text("notes: [the tether")
    folder.discard()
    assert [path.name for path in folder.path.iterdir()] == ["dive.yaml"]


def test_notes_written_by_many_programs_at_once_are_all_kept(folder):
    # On a loaded computer a writer may stand still with the lock for longer than any change takes.
    words = "import sys; from pathlib import Path; from gcs_plugin import locks; locks.CHANGE_S = 60.0; "
    words += "from gcs_plugin.dives.folder import DiveFolder; sys.stdin.read(1); "
    words += "[DiveFolder(Path(sys.argv[1])).add_event(1.8e9, sys.argv[2] + str(n)) for n in range(10)]"
    writers = [
        subprocess.Popen([sys.executable, "-c", words, str(folder.path), name], stdin=subprocess.PIPE)
        for name in "abc"
    ]
    for writer in writers:
        writer.stdin.write(b"x")
        writer.stdin.close()
    assert [writer.wait(60) for writer in writers] == [0, 0, 0]
    assert {event.text for event in folder.about().events} == {
        f"{name}{n}" for name in "abc" for n in range(10)
    }
    assert [path.name for path in folder.path.iterdir()] == ["dive.yaml"]


def test_where_a_folder_can_t_be_locked_or_its_holder_hangs_a_note_is_written_all_the_same(
    folder, monkeypatch
):
    monkeypatch.setattr("gcs_plugin.locks.CHANGE_S", 0.0)
    with folder_lock(folder.path):
        folder.note("held")
    assert folder.about().notes == "held"

    def unable(*_):
        raise OSError(95, "Operation not supported")

    monkeypatch.setattr("bridge.locks.fcntl.flock", unable)
    folder.note("no locks")
    assert folder.about().notes == "no locks"


def test_a_damaged_description_is_named(folder):
    (folder.path / "dive.yaml").write_text("vehicle_fil: x\n")
    with pytest.raises(ConfigError, match="did you mean 'vehicle_file'"):
        folder.about()


def test_recordings_come_in_the_order_in_which_they_were_begun(folder, tmp_path):
    with pytest.raises(LogError, match="holds no telemetry"):
        load_folder(folder.path)
    for number in (1, 2, 10):
        folder.open_telemetry(number).close()
    names = [path.name for path in load_folder(folder.path).telemetry()]
    assert names == ["telemetry.tlog", "telemetry.2.tlog", "telemetry.10.tlog"]
    with pytest.raises(LogError, match="no such dive folder"):
        load_folder(tmp_path / "none")


FRESH = Conditions(salinity=0.0, weather="swell")
KNOWN = Conditions(11.5, 35.0, 40.0, 2.0, -0.5, "camera", "calm")


@pytest.mark.parametrize(
    ("temperature_c", "salinity", "density"),
    [
        (5.0, 0.0, 999.96675),
        (5.0, 35.0, 1027.67547),
        (25.0, 0.0, 997.04796),
        (25.0, 35.0, 1023.34306),
    ],
)
def test_density_is_that_of_the_check_values_of_unesco_44(temperature_c, salinity, density):
    assert density_kg_m3(temperature_c, salinity) == pytest.approx(density, abs=1e-5)


@pytest.mark.parametrize(
    "values",
    [{"water_temperature_c": 50.0}, {"salinity": -1.0}, {"tether_out_m": -1.0}, {"ballast_kg": math.nan}],
)
def test_what_can_not_be_is_refused(values):
    with pytest.raises(ValueError, match="must lie from"):
        Conditions(**values)


@pytest.mark.parametrize("conditions", [KNOWN, NOTHING_SAID, FRESH, Conditions(payload="sonar 2.0")])
def test_what_a_form_shows_it_reads_back_and_a_decimal_comma_and_blanks(conditions):
    assert of_texts(texts_of(conditions)) == conditions
    typed = {"salinity": " 34,5 ", "weather": " a  b ", "ballast_kg": "   "}
    assert of_texts(typed) == Conditions(salinity=34.5, weather="a b")


def test_all_mistakes_are_told_each_by_its_field():
    texts = {"salinity": "salty", "tether_out_m": "nan", "weather": "99", "ballast_kg": "2"}
    wrong = {
        "salinity": "'salty' is no number; give one such as 12.5, or leave it empty",
        "tether_out_m": "must lie from 0 to 10000 m, it is nan; mend it, or leave it empty",
    }
    assert mistakes(texts) == wrong
    with pytest.raises(ConfigError) as caught:
        of_texts(texts)
    assert str(caught.value) == ". ".join(f"{name}: {sentence}" for name, sentence in wrong.items())


def test_last_times_are_those_of_the_newest_earlier_dive_that_has_any(tmp_path):
    dives = {"18T09": Conditions(salinity=1.0), "19T09": KNOWN, "19T10": NOTHING_SAID, "20T09": FRESH}
    for name, conditions in dives.items():
        folder = DiveFolder(tmp_path / f"2026-11-{name}00Z")
        folder.path.mkdir()
        folder.describe(About(notes="here", conditions=conditions))
    damaged = tmp_path / "2026-11-19T1100Z"
    damaged.mkdir()
    (damaged / "dive.yaml").write_text("{", encoding="utf-8")
    assert last_conditions(tmp_path, folder.path) == KNOWN
    assert last_conditions(tmp_path, tmp_path / "about to begin") == FRESH
    assert last_conditions(tmp_path / "none", folder.path) == NOTHING_SAID


def with_rates(folder, times_s, boot_s):
    """A recording of rates of turn at these times, which the vehicle's clock dates by `boot_s`."""
    encoder = Encoder(1, 1)
    with TlogWriter(folder / "telemetry.tlog") as writer:
        for time_s, clock_s in zip(times_s, boot_s, strict=True):
            frame = encoder.frame(*encode(Reading("imu", clock_s, (0.0,) * 7)))
            writer.write(round((SECOND_S + time_s) * 1e6), frame)


def test_a_dive_is_as_long_as_it_was_for_a_vehicle_that_dived_faster_than_real_time(tmp_path):
    with_rates(tmp_path, range(200), [30.0 + 4.0 * n for n in range(200)])
    assert length_s(tmp_path) == pytest.approx(4 * 199.0)


def test_a_dive_is_as_long_as_its_stamps_say_where_the_vehicle_started_anew(tmp_path):
    with_rates(tmp_path, range(200), [*range(1000, 1150), *range(50)])
    assert length_s(tmp_path) == pytest.approx(199.0)
