"""Dive folders: named by UTC, never shared, never overwritten."""

import pytest

from bridge.errors import ConfigError, LogError
from gcs_plugin.folder import About, Event, list_folders, load_folder, new_folder

SECOND_S = 1_795_165_923.0


def test_a_folder_is_named_by_utc_and_name(tmp_path):
    assert (
        new_folder(tmp_path / "dives", SECOND_S, "Hovering / No. 2").path.name
        == "2026-11-20T0912Z-hovering-no-2"
    )


def test_two_dives_of_one_minute_get_folders_of_their_own(tmp_path):
    names = [new_folder(tmp_path, SECOND_S, "hovering").path.name for _ in range(3)]
    assert names == [f"2026-11-20T0912Z-hovering{end}" for end in ("", "-2", "-3")]


def test_dives_are_listed_oldest_first_and_other_folders_left_out(tmp_path):
    (tmp_path / "notes").mkdir()
    later = new_folder(tmp_path, SECOND_S + 3600, "a")
    earlier = new_folder(tmp_path, SECOND_S, "b")
    assert list_folders(tmp_path) == [earlier, later]
    assert list_folders(tmp_path / "none") == []


def test_what_is_known_of_a_dive_is_kept_beside_it(tmp_path):
    folder = new_folder(tmp_path, SECOND_S, "x")
    assert folder.about() == About()
    folder.describe(About("v.yaml", "abc", "hovering", "calm: 3 °C\nclear"))
    folder.add_event(SECOND_S, "a new file")
    assert folder.about() == About(
        "v.yaml", "abc", "hovering", "calm: 3 °C\nclear", (Event("2026-11-20T09:12:03Z", "a new file"),)
    )


def test_a_damaged_description_is_named(tmp_path):
    folder = new_folder(tmp_path, SECOND_S, "x")
    (folder.path / "dive.yaml").write_text("vehicle_fil: x\n")
    with pytest.raises(ConfigError, match="did you mean 'vehicle_file'"):
        folder.about()


def test_recordings_come_in_the_order_in_which_they_were_begun(tmp_path):
    folder = new_folder(tmp_path, SECOND_S, "x")
    with pytest.raises(LogError, match="holds no telemetry"):
        load_folder(folder.path)
    for number in (1, 2, 10):
        folder.open_telemetry(number).close()
    names = [path.name for path in load_folder(folder.path).telemetry()]
    assert names == ["telemetry.tlog", "telemetry.2.tlog", "telemetry.10.tlog"]
    with pytest.raises(LogError, match="no such dive folder"):
        load_folder(tmp_path / "none")


def test_a_place_that_can_not_hold_folders_is_said(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(LogError, match="no dive folder can be made there"):
        new_folder(tmp_path / "file", SECOND_S, "x")
