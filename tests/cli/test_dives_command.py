"""`seatrial dives`: the list of dive folders, and the small file that makes it quick."""

import json
import math
import os
import sys
from pathlib import Path

import numpy as np
import pytest

from bridge import exit_codes
from bridge.vehicle.config import load_vehicle
from bridge.wire.framing import Encoder
from bridge.wire.readings import Reading, encode
from bridge.wire.tlog import TlogWriter
from gcs_plugin.dives.folder import About, DiveFolder, Event, new_folder
from identify.estimators.excitation import Span
from identify.ingest.open import read_dive
from tui import cli, dive_reading
from tui.dive_list import GLANCE, Glance, letters, short_name
from tui.dive_reading import row_of

BOOT_US = 1_790_000_000_000_000
SURGE_FILE = (Path(__file__).resolve().parents[1] / "data" / "vehicles" / "one_axis.yaml").read_text("utf-8")


def frames():
    """A minute of a square wave of thrust at 10 Hz and the motion, as (time, frame)."""
    encoder, rng, speed = Encoder(1, 1), np.random.default_rng(100_006), 0.0
    for k in range(600):
        push = 30.0 if (k // 80) % 2 else -30.0
        speed += 0.1 * (push - 50.0 * speed) / 100.0
        for signal, values in (
            ("dvl", (speed + 0.004 * rng.normal(), 0.0, 0.0, 0.004)),
            ("tau_cmd", (push, 0.0, 0.0, 0.0, 0.0, 0.0)),
        ):
            yield 0.1 * k, encoder.frame(*encode(Reading(signal, 1.0 + 0.1 * k, values)))


@pytest.fixture(scope="module")
def telemetry(tmp_path_factory):
    """The recording, of which each twentieth frame is lost."""
    path = tmp_path_factory.mktemp("recorded") / "telemetry.tlog"
    with TlogWriter(path) as writer:
        for k, (time_s, raw) in enumerate(frames()):
            if k % 20:
                writer.write(BOOT_US + round(time_s * 1e6), raw)
    return path.read_bytes()


@pytest.fixture
def vehicle(tmp_path):
    path = tmp_path / "one-axis.yaml"
    path.write_text(SURGE_FILE, encoding="utf-8")
    return path


@pytest.fixture
def dives(tmp_path, telemetry, vehicle):
    """Three dive folders: two of the vehicle, and one that nobody can read."""
    root, weed = tmp_path / "dives", Event("2026-11-20T09:20:00Z", "touched weed")
    about = About(str(vehicle), "", "only", "calm, 12 m of tether", (weed,))
    for name, data in (
        ("2026-11-20T0912Z-hovering", telemetry),
        ("2026-11-20T1015Z-nobody", telemetry),
        ("2026-11-20T1100Z-broken", b"nothing of the kind" * 10),
        ("no dive", None),
    ):
        (root / name).mkdir(parents=True)
        if data is not None:
            (root / name / "telemetry.tlog").write_bytes(data)
    DiveFolder(root / "2026-11-20T0912Z-hovering").describe(about)
    DiveFolder(root / "2026-11-20T1015Z-nobody").describe(About())
    return root


@pytest.fixture
def looks(monkeypatch):
    """Counts the recordings that are read."""
    seen = []
    read = dive_reading._looked

    def counted(folder, *more):
        seen.append(folder.name)
        return read(folder, *more)

    monkeypatch.setattr(dive_reading, "_looked", counted)
    return seen


def test_of_dives_of_one_name_what_is_said_names_the_folders(dives, capsys):
    (dives / "2026-11-20T1015Z-nobody").rename(dives / "2026-11-20T1015Z-hovering")
    cli.main(["dives", str(dives)])
    said = capsys.readouterr().out.splitlines()
    assert "2026-11-20T0912Z-hovering: noted: calm, 12 m of tether" in said
    assert any(
        line.startswith("2026-11-20T1015Z-hovering: what it could identify is not known") for line in said
    )
    assert any(line.startswith("broken: can't be read: ") for line in said)


def test_the_list_says_length_loss_excitation_notes_and_what_was_learnt(dives, capsys):
    hovering = dives / "2026-11-20T0912Z-hovering"
    result = {"method": "likelihood", "outcome": "converged", "parameters": []}
    (hovering / "answer.json").write_text(json.dumps(result), encoding="utf-8")
    (hovering / "gap.json").write_text(json.dumps({"verdict": "explained"}), encoding="utf-8")
    runs = [
        {"dive": name, "mode": "both", "raising": {"go": go}}
        for name, go in (("other", True), (hovering.name, False))
    ]
    (hovering / "validation.json").write_text(json.dumps(runs), encoding="utf-8")
    (hovering / "hovering.param").write_text("FF0_M_U,100\n", encoding="utf-8")
    (hovering / "hovering.param.json").write_text("{}", encoding="utf-8")
    assert cli.main(["dives", str(dives)]) == exit_codes.PARTLY
    shown = capsys.readouterr().out
    (line,) = [line for line in shown.splitlines() if line.endswith("  hovering")]
    assert line.split() == ["2026-09-21", "14:13", "1:00", "0.2", "4.9", "-", "U·····", "U·····", "hovering"]
    assert "hovering: identified by likelihood: converged\n" in shown
    assert "hovering: diagnosed: explained\n" in shown
    assert "hovering: validated in both: NO-GO\n" in shown
    assert "both: GO" not in shown
    assert "hovering: parameters hovering.param\n" in shown
    assert "hovering: noted: calm, 12 m of tether\n" in shown
    assert "hovering: noted at 2026-11-20T09:20:00Z touched weed\n" in shown
    assert "nobody: what it could identify is not known: no vehicle file is known" in shown
    assert "broken: can't be read: " in shown
    assert "no dive" not in shown


def test_json_holds_all_of_it(dives, tmp_path, capsys):
    out = tmp_path / "dives.json"
    cli.main(["dives", str(dives), "--json", str(out)])
    capsys.readouterr()
    by_name = {row["name"]: row for row in json.loads(out.read_text(encoding="utf-8"))}
    assert set(by_name) == {"hovering", "nobody", "broken"}
    hovering = by_name["hovering"]
    assert hovering["duration_s"] == pytest.approx(60.0, abs=0.5)
    assert hovering["loss"] == pytest.approx(0.05, abs=0.01)
    assert [c["name"] for c in hovering["excitation"] if c["identifiable"]] == ["M_u", "D_u"]
    assert hovering["axes"][0]["axis"] == "surge"
    assert by_name["nobody"]["excitation"] is None
    assert by_name["broken"]["error"]


def test_a_vehicle_otherwise_judges_only_dives_whose_own_is_not_known(dives, tmp_path, refused):
    gone = dives / "2026-11-20T1030Z-gone"
    gone.mkdir()
    (gone / "telemetry.tlog").write_bytes((dives / "2026-11-20T1015Z-nobody" / "telemetry.tlog").read_bytes())
    DiveFolder(gone).describe(About("elsewhere.yaml", "", "only"))
    (dives / "2026-11-20T1015Z-nobody" / "dive.yaml").unlink()
    light = tmp_path / "light.yaml"
    light.write_text(SURGE_FILE.replace("name: one-axis", "name: light"), encoding="utf-8")
    used = {}

    def load(name):
        used[Path(name).name] = used.get(Path(name).name, 0) + 1
        return load_vehicle(name)

    for folder in (dives / "2026-11-20T0912Z-hovering", dives / "2026-11-20T1015Z-nobody", gone):
        assert row_of(folder, otherwise=str(light), load=load).glance.relative_std["M_u"] < 0.1
    assert used == {"one-axis.yaml:only": 1, "light.yaml": 2}
    assert "nowhere.yaml: no such file" in refused("dives", gone, "--otherwise", "nowhere.yaml")


RUBBISH = b"nothing of the kind, " * 200


@pytest.mark.parametrize(
    ("before", "within", "after", "where"),
    [
        (b"", b"", b"", ""),
        (b"", b"", RUBBISH, "4200 bytes at its end"),
        (b"", RUBBISH, b"", "4200 bytes between its messages"),
        (RUBBISH, b"", RUBBISH, "8400 bytes between its messages and at its end"),
    ],
)
def test_bytes_that_belong_to_no_message_are_told_with_their_number_and_place(
    tmp_path, capsys, before, within, after, where
):
    record = Encoder(1, 1).frame(*encode(Reading("dvl", 1.0, (0.1, 0.0, 0.0, 0.004))))
    whole = tmp_path / "whole.tlog"
    with TlogWriter(whole) as writer:
        for k in range(100):
            writer.write(BOOT_US + 100_000 * k, record)
    folder = tmp_path / "2026-11-20T0912Z-lake"
    folder.mkdir()
    data = whole.read_bytes()
    halves = data[: len(data) // 2], data[len(data) // 2 :]
    (folder / "telemetry.tlog").write_bytes(before + halves[0] + within + halves[1] + after)
    stray = f"2026-11-20T0912Z-lake/telemetry.tlog: {where} belong to no message and were left out"
    assert row_of(folder).glance.stray == (stray if where else "")
    cli.main(["dives", str(folder)])
    assert (f"lake: {stray}." in " ".join(capsys.readouterr().out.split())) == bool(where)


def test_the_second_list_reads_no_recording(dives, looks, capsys):
    cli.main(["dives", str(dives)])
    first = capsys.readouterr().out
    assert len(looks) == 3
    cli.main(["dives", str(dives)])
    assert len(looks) == 3
    assert capsys.readouterr().out == first


def test_a_recording_that_grew_or_another_vehicle_file_is_looked_at_anew(dives, looks, vehicle):
    folder = dives / "2026-11-20T0912Z-hovering"
    row_of(folder)
    with (folder / "telemetry.tlog").open("ab") as file:
        file.write((folder / "telemetry.tlog").read_bytes()[:2000])
    row_of(folder)
    assert len(looks) == 2
    vehicle.write_text(SURGE_FILE.replace("72.0", "80.0"), encoding="utf-8")
    row_of(folder)
    assert len(looks) == 3
    row_of(folder)
    assert len(looks) == 3


@pytest.mark.parametrize(
    "spoilt",
    [
        "",
        "{",
        "[]",
        '{"key": 1}',
        None,
        {"began_unix_s": 1e300},
        {"duration_s": math.inf},
        {"relative_std": {"M_u": "well"}},
        {"spans": [{"axis": 3}]},
        {"more": 1},
    ],
    ids=str,
)
def test_a_damaged_or_missing_glance_is_made_again(dives, looks, spoilt):
    folder = dives / "2026-11-20T0912Z-hovering"
    before = row_of(folder).glance
    data = json.loads((folder / GLANCE).read_text("utf-8"))
    (folder / GLANCE).unlink()
    if isinstance(spoilt, dict):
        spoilt = json.dumps(data | {"glance": data["glance"] | spoilt})
    if spoilt is not None:
        (folder / GLANCE).write_text(spoilt, encoding="utf-8")
    assert row_of(folder).glance == before
    assert len(looks) == 2


def test_what_a_glance_does_not_know_is_as_unknown_when_it_is_read_again(dives, monkeypatch):
    folder = dives / "2026-11-20T0912Z-hovering"
    seen = Glance(1.7e9, relative_std={"M_u": math.inf, "D_u": 0.1}, spans=(Span("surge", 2.0),))
    monkeypatch.setattr(dive_reading, "_looked", lambda *_: seen)
    row_of(folder)
    monkeypatch.setattr(dive_reading, "_looked", lambda *_: pytest.fail("looked at anew"))
    again = row_of(folder).glance
    assert repr(again) == repr(seen)  # NaN is like no other


def test_a_folder_that_can_not_be_written_is_listed_all_the_same(dives):
    folder = dives / "2026-11-20T0912Z-hovering"
    (folder / f"{GLANCE}.{os.getpid()}.part").mkdir()
    assert row_of(folder).glance.relative_std
    assert not (folder / GLANCE).exists()


def test_a_vehicle_file_that_is_gone_is_told_and_the_rest_is_shown(dives, vehicle, capsys):
    vehicle.unlink()
    cli.main(["dives", str(dives)])
    shown = capsys.readouterr().out
    assert "the dive's vehicle file is not there; give one with --vehicle" in shown
    assert "------" in shown


def test_a_damaged_dive_yaml_is_told_however_the_dive_was_listed_before(dives, vehicle, capsys):
    folder = dives / "2026-11-20T1015Z-nobody"
    row_of(folder)
    (folder / "dive.yaml").write_text("vehicle: [1,2", encoding="utf-8")
    unknown = row_of(folder)
    judged = row_of(folder, otherwise=f"{vehicle}:only")
    assert (unknown.glance.relative_std, judged.glance.relative_std["M_u"] < 0.1) == (None, True)
    assert unknown.damaged == judged.damaged
    assert f"{folder}/dive.yaml" in judged.damaged
    for words in ([], ["--vehicle", f"{vehicle}:only"], ["--otherwise", f"{vehicle}:only"]):
        capsys.readouterr()
        cli.main(["dives", str(folder), *words])
        shown = " ".join(capsys.readouterr().out.split())
        assert f"nobody: {judged.damaged}" in shown
        assert ("no vehicle file is known" in shown) == (not words)
        assert "nothing to identify" not in shown
    DiveFolder(folder).path.joinpath("dive.yaml").unlink()
    assert row_of(folder).damaged == ""


def test_a_folder_without_dives_says_so_and_one_that_is_not_there_is_refused(tmp_path, capsys):
    assert cli.main(["dives", str(tmp_path)]) == exit_codes.DONE
    assert "holds no dive" in capsys.readouterr().out
    assert cli.main(["dives", str(tmp_path / "nowhere")]) == exit_codes.BAD_INPUT


def test_a_recording_that_can_not_be_opened_is_a_line_with_its_error(dives, capsys):
    for name in ("dangling", "pipe"):
        (dives / name).mkdir()
    (dives / "dangling" / "telemetry.tlog").symlink_to("/nonexistent")
    os.mkfifo(dives / "pipe" / "telemetry.tlog")
    assert cli.main(["dives", str(dives)]) == exit_codes.PARTLY
    shown = " ".join(capsys.readouterr().out.split())
    assert "dangling: can't be read: " in shown
    assert "telemetry.tlog: no such file" in shown
    assert "telemetry.tlog: is no file; take it away" in shown
    assert "U·····" in shown


def test_letters_are_capitals_to_a_tenth_small_to_three_tenths_and_dots_beyond():
    std = {"M_u": 0.09, "M_v": 0.11, "M_w": 0.3, "I_p": 0.31}
    assert letters(std, "mass") == "Uvw···"
    assert letters(None, "damping") == "------"


def test_names_are_what_follows_the_date():
    assert short_name(Path("2026-11-20T0912Z-hovering-off")) == "hovering-off"
    assert short_name(Path("lake-42")) == "lake-42"
    assert short_name(Path("2026-11-20T0912Z")) == "2026-11-20T0912Z"
    assert short_name(Path("2026-11-20T0912Z-2")) == "2026-11-20T0912Z-2", (
        "the second nameless dive of that minute"
    )
    assert Glance().relative_std is None


def test_a_folder_whose_name_holds_line_ends_makes_no_line_of_its_own(tmp_path, telemetry):
    folder = tmp_path / "2026-11-20T0912Z-lake\nall good"
    folder.mkdir()
    (folder / "telemetry.tlog").write_bytes(telemetry)
    assert row_of(folder).name == "lake?all good"


@pytest.fixture
def holed(vehicle, tmp_path):
    """A dive folder that lacks twenty seconds in its middle."""
    folder = DiveFolder(tmp_path / "holed" / "2026-11-20T0912Z-holed")
    folder.path.mkdir(parents=True)
    folder.describe(About(str(vehicle), "", "only"))
    with TlogWriter(folder.path / "telemetry.tlog") as writer:
        for time_s, raw in frames():
            if not 20.0 < time_s < 40.0:
                writer.write(BOOT_US + round(time_s * 1e6), raw)
    return folder.path


NOT_HEARD = (
    "Nothing was heard of the vehicle for 20 s at a stretch, from 0:20 on: "
    "another recording of the dive may have it, see `seatrial merge`."
)


def test_a_dive_that_lacks_its_middle_says_for_how_long_nothing_was_heard(holed, capsys, tmp_path):
    assert cli.main(["dives", str(holed.parent), "--json", str(tmp_path / "list.json")]) == exit_codes.DONE
    shown = capsys.readouterr().out
    (line,) = [line for line in shown.splitlines() if line.endswith("  holed")]
    assert line.split()[2:7] == ["1:00", "0.1", "33.2", "20", "s"]
    assert NOT_HEARD in " ".join(shown.split())
    (listed,) = json.loads((tmp_path / "list.json").read_text(encoding="utf-8"))
    assert (round(listed["unheard_s"], 3), listed["unheard"]) == (20.0, NOT_HEARD)
    assert NOT_HEARD in read_dive(holed).notes


@pytest.mark.parametrize("verb", [["validate"], ["identify", "--method", "likelihood"]])
def test_what_is_made_of_a_dive_that_lacks_its_middle_says_so(holed, vehicle, capsys, verb):
    cli.main([*verb, str(holed), "--vehicle", str(vehicle)])
    assert NOT_HEARD in " ".join(capsys.readouterr().out.split())


def test_a_dive_given_twice_is_not_compared_with_itself(holed, vehicle, capsys):
    twice = ["validate", str(holed), str(holed), "--vehicle", str(vehicle)]
    assert cli.main(twice) == exit_codes.BAD_INPUT
    assert "the same recording as " in capsys.readouterr().err


@pytest.mark.skipif(sys.platform == "win32", reason="nothing is locked there")
def test_a_dive_that_is_recorded_and_holds_nothing_yet_says_so(capsys, tmp_path):
    folder = new_folder(tmp_path / "dives", 1_790_000_000.0, "deck")
    recording = folder.open_telemetry(1)
    at = ["dives", str(folder.path.parent), "--json", str(tmp_path / "list.json")]
    assert cli.main(at) == exit_codes.DONE
    assert "deck: is being recorded, nothing heard yet" in capsys.readouterr().out
    (listed,) = json.loads((tmp_path / "list.json").read_text(encoding="utf-8"))
    assert (listed["error"], listed["underway"]) == ("", "is being recorded, nothing heard yet")
    recording.close()
    assert cli.main(at) == exit_codes.BAD_INPUT
    assert "deck: can't be read: " in capsys.readouterr().out
