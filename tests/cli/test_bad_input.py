"""Mistakes of a new user: a clear sentence, an exit code, no traceback, and no input that is written to."""

import os
import shutil
from pathlib import Path

import pytest

from bridge import exit_codes

ROOT = Path(__file__).resolve().parents[2]
VEHICLE = str(ROOT / "tests" / "data" / "vehicles" / "survey.yaml")
DIVE = ROOT.parent / "shared" / "sealed" / "open_1"


LETTER = b"Dear vehicle,\nplease dive.\n" * 40


@pytest.mark.parametrize(
    ("name", "data", "words"),
    [
        ("nowhere.tlog", None, "nowhere.tlog: no such file"),
        ("empty.tlog", b"", "empty.tlog"),
        ("empty.tlog.gz", b"", "empty.tlog.gz"),
        ("empty.BIN", b"", "empty.BIN"),
        ("letter.tlog", LETTER, "letter.tlog"),
        ("letter.tlog.gz", LETTER, "letter.tlog.gz"),
        ("letter.BIN", LETTER, "letter.BIN"),
        ("dive.docx", b"PK", ".tlog"),
        ("dive.csv", b"a,b\n1,2\n", "--columns"),
        ("", None, "no recording"),
    ],
)
def test_what_is_no_dive_is_told_by_its_name(refused, tmp_path, name, data, words):
    if data is not None:
        (tmp_path / name).write_bytes(data)
    assert words in refused("identify", tmp_path / name, "--vehicle", VEHICLE)


@pytest.mark.parametrize(
    ("vehicle", "words"),
    [
        ("misspelt.yaml", "configurations: survey: unknown key 'dry_mas_kg'; did you mean 'dry_mass_kg'?"),
        ("empty.yaml", "expected keys and values, found nothing; give lines such as 'name: value'"),
        (f"{VEHICLE}:racing", "no configuration 'racing'; it has survey"),
        ("ruvifst:survey", "ruvifst: no such file; did you mean 'ruvifist'?"),
        ("zzz", "give a file, or one of ardusub_vectored, bluerov2, bluerov2_heavy, bolt, ruvifist"),
    ],
)
def test_what_is_no_vehicle_is_told_with_what_comes_nearest(refused, tmp_path, monkeypatch, vehicle, words):
    monkeypatch.chdir(tmp_path)
    text = Path(VEHICLE).read_text(encoding="utf-8").replace("dry_mass_kg", "dry_mas_kg")
    Path("misspelt.yaml").write_text(text, encoding="utf-8")
    Path("empty.yaml").touch()
    assert words in refused("identify", "dive.tlog", "--vehicle", vehicle)


@pytest.mark.parametrize("verb", ["record", "doctor"])
def test_a_serial_port_that_does_not_exist(refused, tmp_path, verb):
    line = (verb, "--link", "serial:/dev/ttyNowhere:115200", "--out", tmp_path / "dives")
    assert "/dev/ttyNowhere" in refused(*line, code=exit_codes.LINK)
    assert not (tmp_path / "dives").exists()


def test_a_bridge_of_a_vehicle_of_several_configurations_asks_which_it_dives_in(refused):
    assert "has survey, hovering; name one: --vehicle FILE:CONFIGURATION" in refused(
        "bridge", "--vehicle", "ruvifist", "--link", "udpout:127.0.0.1:9", "--seconds", "1"
    )


def test_a_parameter_file_with_a_value_that_is_none(refused, tmp_path):
    path = tmp_path / "bad.param"
    path.write_text("FF0_M_U,110\nFF0_D_U,nan\n", encoding="utf-8")
    assert "bad.param, line 2" in refused("params", "upload", path, "--link", "udpin:127.0.0.1:0", "--yes")


RUBBISH = bytes(range(255, 0, -1))
OF_NO_USE = {
    ("tui", "--unrecorded", "--link", "udpin:127.0.0.1:0", "--keymap", "FILE.yaml"): (
        "no such file; check the name",
        "is a folder; give a YAML file",
        "is no text; give a YAML file",
    ),
    ("diagnose", "DIVE", "--vehicle", VEHICLE, "--columns", "FILE.yaml"): (
        "no such column map; give a YAML file, or one of bolt,",
        "is a folder; give a YAML file",
        "is no text; give a YAML file",
    ),
    ("prior", "FILE.json", "--vehicle", VEHICLE): (
        "no such file; check the name",
        "is a folder; give the file that --json wrote",
        "is no text; give the file that --json wrote",
    ),
    ("prior", "FILE.param", "--vehicle", VEHICLE): (
        "no such file; check the name",
        "is a folder; give the JSON of `seatrial identify`, or a .param with its sidecar",
        "has no sidecar that tells its intervals; give the JSON of `seatrial identify`",
    ),
    ("plan", "--vehicle", f"{VEHICLE}:survey", "--after", "FILE.json"): (
        "no such file; check the name",
        "is a folder; give the file that --json wrote",
        "is no text; give the file that --json wrote",
    ),
    ("params", "diff", "FILE.param", "--link", "udpin:127.0.0.1:0"): (
        "no such file; check the name",
        "is a folder; give a .param file",
        "is no text; give a .param file",
    ),
    ("conditions", "FILE"): (
        "no such dive folder; check the name",
        "holds no telemetry.tlog and no dive.yaml; give the folder of a dive",
        "is a file; give the folder of a dive",
    ),
    ("note", "--dive", "FILE", "hello"): (
        "no such dive folder; check the name",
        "holds no telemetry.tlog and no dive.yaml; give the folder of a dive",
        "is a file; give the folder of a dive",
    ),
}


@pytest.mark.parametrize(("line", "sentences"), OF_NO_USE.items(), ids=" ".join)
def test_a_file_that_is_missing_a_folder_or_rubbish_says_which_and_what_to_give(
    tmp_path, refused, line, sentences
):
    table = tmp_path / "dive.csv"
    table.write_text("a,b\n1,2\n")
    words = [word.replace("DIVE", str(table)).replace("FILE", str(tmp_path / "bad")) for word in line]
    bad = next(Path(word) for word in words if "/bad" in word)
    makes = (lambda: None, bad.mkdir, lambda: (bad.rmdir(), bad.write_bytes(RUBBISH)))
    for make, sentence in zip(makes, sentences, strict=True):
        make()
        assert f"{bad}: {sentence}" in refused(*words)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[{}, {}]", "holds the results of several dives; identify one dive and give its file"),
        ("3", "holds no result of a dive; give the file that --json wrote"),
    ],
)
def test_json_of_something_else_is_told_for_what_it_is(refused, tmp_path, text, words):
    path = tmp_path / "a.json"
    path.write_text(text, encoding="utf-8")
    assert f"{path}: {words}" in refused("prior", path, "--vehicle", VEHICLE)


def test_a_folder_in_place_of_stored_parameters_stays_where_it_is(tmp_path, refused):
    line = ["--vehicle", VEHICLE, "--parameters", str(tmp_path)]
    for verb in (["simulate", "--mission", "survey"], ["bridge", "--link", "udpout:127.0.0.1:9"]):
        assert f"--parameters {tmp_path}: is a folder; name a file" in refused(*verb, *line)
    assert tmp_path.is_dir()


MISPLACED = [
    ("identify", "no.tlog", "--vehicle", "nobody", "--json", "OUT/x.json"),
    ("identify", "no.tlog", "--vehicle", "nobody", "--param", "x.txt"),
    ("identify", "no.tlog", "--vehicle", "nobody", "--json", "x.html", "--report", "x.html"),
    ("identify", "no.tlog", "--vehicle", "nobody", "--report", "page"),
    ("diagnose", "no.tlog", "--vehicle", "nobody", "--report", "page.pdf"),
    ("validate", "no.tlog", "--vehicle", "nobody", "--figures", "/dev/null/x"),
    ("record", "--link", "carrier:pigeon", "--out", "/dev/null/x"),
    ("simulate", "--vehicle", "nobody", "--mission", "survey", "--out", "/dev/null/x"),
    ("demo", "--out", "/dev/null/x"),
    ("demo", "--out", "OUT"),
    ("import", "no.tlog", "--out", "/dev"),
    ("plan", "--vehicle", "nobody", "--out", "x.txt"),
    ("params", "show", "--link", "carrier:pigeon", "--out", "x.txt"),
    ("calibrate", "--limits", "no.yaml", "--vehicle", "nobody", "--out", "/dev/null/x"),
    ("calibrate", "--limits", "no.yaml", "--vehicle", "nobody", "--receipts", "/dev/null/x"),
]


@pytest.mark.parametrize("line", MISPLACED, ids=" ".join)
def test_a_place_that_can_not_be_written_is_said_before_anything_is_read(refused, tmp_path, line):
    (tmp_path / "link").symlink_to(tmp_path / "gone")
    sentence = refused(*(word.replace("OUT", str(tmp_path / "link")) for word in line))
    assert sentence.startswith(f"seatrial: {line[-2]} ")


@pytest.mark.parametrize("line", [("record",), ("doctor",), ("params", "show")])
@pytest.mark.parametrize("spec", ["carrier:pigeon", "udpin:127.0.0.1:none"])
def test_a_malformed_link_is_wrong_usage(refused, tmp_path, line, spec):
    out = ("--out", tmp_path / "dives") if line[0] in ("record", "doctor") else ()
    assert spec.split(":")[0] in refused(*line, "--link", spec, *out)


@pytest.mark.parametrize(
    "line",
    [
        ["simulate", "--vehicle", "ruvifist:hovering", "--mission", "validation", "--seed", "-1"],
        ["demo", "--seed", "one"],
        ["record", "--link", "udpin:127.0.0.1:0", "--seconds", "-1"],
        ["record", "--link", "udpin:127.0.0.1:0", "--seconds", "nan"],
        ["params", "show", "--link", "udpin:127.0.0.1:0", "--seconds", "inf"],
        ["identify", "x.tlog", "--vehicle", "ruvifist", "--method", "paper", "--network", "0", "5", "100"],
    ],
)
def test_a_number_that_makes_no_sense_is_wrong_usage(line, refused, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert "is not a" in refused(*line)
    assert list(tmp_path.iterdir()) == []


RECORDED = b"what was recorded"


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A folder with one of each kind of input."""
    monkeypatch.chdir(tmp_path)
    vehicle = (ROOT / "tests" / "data" / "vehicles" / "survey.yaml").read_text(encoding="utf-8")
    Path("our.yaml").write_text(vehicle, encoding="utf-8")
    shutil.copy(ROOT / "configs" / "thrusters" / "t200.csv", "t200.csv")
    Path("dives/one").mkdir(parents=True)
    Path("answers").mkdir()
    for name in ("d.tlog.gz", "map.yaml", "a.json", "a.param", "a.param.json", "m.yaml", "a.json.json", "a.BIN", "key",
                 "answers/case_001.json", "limits.yaml",
                 "dives/one/telemetry.tlog", "dives/one/dive.yaml"):  # fmt: skip
        Path(name).write_bytes(RECORDED)
    os.symlink("d.tlog.gz", "soft.html")
    os.link("dives/one/telemetry.tlog", "hard.csv")
    return tmp_path


VEHICLE_FILE = ("--vehicle", "our.yaml")


@pytest.mark.parametrize(
    ("line", "read"),
    [
        (("identify", "d.tlog.gz", *VEHICLE_FILE, "--report", "soft.html"), "d.tlog.gz"),
        (("identify", "d.tlog.gz", *VEHICLE_FILE, "--json", "./our.yaml"), "our.yaml"),
        (("identify", "d.tlog.gz", *VEHICLE_FILE, "--json", "t200.csv"), "t200.csv"),
        (("identify", "d.tlog.gz", *VEHICLE_FILE, "--columns", "map.yaml", "--json", "map.yaml"), "map.yaml"),
        (("identify", "dives/one", *VEHICLE_FILE, "--json", "dives/one/dive.yaml"), "dives/one/dive.yaml"),
        (("identify", "a.param.json", *VEHICLE_FILE, "--param", "a.param"), "a.param.json"),
        (("diagnose", "a", *VEHICLE_FILE, "--against", "d.tlog.gz", "--json", "d.tlog.gz"), "d.tlog.gz"),
        (("batch", "dives", *VEHICLE_FILE, "--csv", "hard.csv"), "dives/one/telemetry.tlog"),
        (("batch", "d*.gz", *VEHICLE_FILE, "--json", "d.tlog.gz"), "d.tlog.gz"),
        (("plan", *VEHICLE_FILE, "--out", "our.yaml"), "our.yaml"),
        (("plan", *VEHICLE_FILE, "--after", "a.json", "--json", "a.json"), "a.json"),
        (("export", "our.yaml:survey", "--to", "gazebo", "--out", "our.yaml"), "our.yaml"),
        (("prior", "a.param", *VEHICLE_FILE, "--json", "a.param.json"), "a.param.json"),
        (("validate", "dives/one", *VEHICLE_FILE, "--json", "dives/one/telemetry.tlog"), "telemetry.tlog"),
        (("record", "--link", "udpin:127.0.0.1:1", *VEHICLE_FILE, "--json", "our.yaml"), "our.yaml"),
        (("simulate", *VEHICLE_FILE, "--mission", "m.yaml", "--json", "m.yaml"), "m.yaml"),
        (("simulate", *VEHICLE_FILE, "--mission", "m.yaml", "--parameters", "our.yaml"), "our.yaml"),
        (("params", "diff", "a.param", "--link", "udpin:127.0.0.1:1", "--json", "a.param"), "a.param"),
        (("vehicle", "guess", "a.BIN", "--json", "a.BIN"), "a.BIN"),
        (("fly", "m.yaml", "--limits", "limits.yaml", *VEHICLE_FILE, "--json", "m.yaml"), "m.yaml"),
        (("fly", "m.yaml", "--limits", "limits.yaml", *VEHICLE_FILE, "--json", "limits.yaml"), "limits.yaml"),
        (
            ("calibrate", "--plan", "m.yaml", "--limits", "a.json", *VEHICLE_FILE, "--json", "m.yaml"),
            "m.yaml",
        ),
        (
            ("validate", "d.tlog.gz", *VEHICLE_FILE, "--foretold", "a.param", "--json", "a.param.json"),
            "a.param.json",
        ),
        (("doctor", "--link", "udpin:127.0.0.1:1", "--sign-key", "key", "--json", "key"), "key"),
        (("challenge", "score", "x", "--key", "key", "--answers", "answers", "--json", "key"), "key"),
        (
            ("challenge", "score", "x", "--answers", "answers", "--json", "answers/case_001.json"),
            "answers/case_001.json",
        ),
        (("dives", "dives", "--otherwise", "our.yaml", "--json", "our.yaml"), "our.yaml"),
        (("dives", "dives", "--json", "dives/one/telemetry.tlog"), "dives/one/telemetry.tlog"),
    ],
)
def test_a_target_that_is_an_input_is_refused_and_left_as_it_was(place, refused, line, read):
    before = {path: path.read_bytes() for path in place.rglob("*") if path.is_file()}
    assert f"{read}, which this command reads: nothing was done; name another file" in refused(*line)
    assert {path: path.read_bytes() for path in place.rglob("*") if path.is_file()} == before


@pytest.mark.usefixtures("place")
def test_a_result_beside_the_recording_may_be_written_again(refused):
    Path("dives/one/found.json").write_text("{}", encoding="utf-8")
    line = ("identify", "dives/one", *VEHICLE_FILE, "--json", "dives/one/found.json")
    assert "which this command reads" not in refused(*line)


@pytest.mark.usefixtures("place")
@pytest.mark.parametrize("dive", ["dives/one", "d.tlog.gz"])
def test_a_result_named_after_its_recording_may_be_written_again(refused, dive):
    Path(f"{dive}.json").write_text("{}", encoding="utf-8")
    assert "which this command reads" not in refused(
        "identify", dive, *VEHICLE_FILE, "--json", f"{dive}.json"
    )


@pytest.mark.usefixtures("place")
def test_the_sidecar_and_the_json_may_not_be_one_file(refused):
    line = ("identify", "d.tlog.gz", *VEHICLE_FILE, "--param", "new.param", "--json", "new.param.json")
    assert "--json names the same file" in refused(*line)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("plan --vehicle ruvifist:hovering --out -", "--out -: can't go to standard output; name a file"),
        (
            "identify x.tlog --vehicle ruvifist --param -",
            "--param -: can't go to standard output; name a file",
        ),
        (
            "identify x.tlog --vehicle ruvifist --report -",
            "--report -: can't go to standard output; name a file",
        ),
        (
            "validate x.tlog --vehicle ruvifist --report page",
            "--report page: the name must end in .html or .htm; name it so",
        ),
        ("export x.tlog --to mcap --out -", "--to mcap: is no text that can be shown; add --out FILE.mcap"),
    ],
)
def test_a_file_that_is_no_text_for_a_pipe_is_not_written_under_the_name_of_a_dash(
    refused, monkeypatch, tmp_path, line, words
):
    monkeypatch.chdir(tmp_path)
    assert words in refused(*line.split())
    assert not any(tmp_path.iterdir())


WITHOUT_USE = {
    "plan --vehicle ruvifist:hovering --columns bolt": "--columns bolt: is for a recording that --after names",
    "plan --vehicle ruvifist:hovering --after hull.json --columns bolt": "--columns bolt: is for a recording",
    "plan --vehicle ruvifist:hovering --after d.tlog --columns bolt": "d.tlog needs no column map; leave it out",
    "record --next --name second": "--name: the recording that runs keeps what it was begun with; leave it out",
    "record --end --seconds 5 --heartbeat": "--seconds, --heartbeat: the recording that runs keeps what",
    "fetch --name second": "--name is for --new; a dive that was heard has its own",
    "fetch --vehicle ruvifist --system 2": "--vehicle and --system are for --new",
    "simulate --vehicle ruvifist:hovering --mission idle --link udpout:127.0.0.1:9 --seconds 0.1 --mode both": (
        "--mode: an idle vehicle keeps the mode of its --parameters; leave it out, and switch it with `seatrial ff`"
    ),
    "simulate --vehicle ruvifist:hovering --mission idle --link udpout:127.0.0.1:9 --seconds 0.1 --json -": (
        "--json: nothing is dived, so there is nothing to write; leave it out"
    ),
}


@pytest.mark.parametrize(("line", "words"), WITHOUT_USE.items())
def test_an_option_that_the_others_leave_without_use_is_refused_and_not_passed_over(
    refused, tmp_path, monkeypatch, line, words
):
    monkeypatch.chdir(tmp_path)
    Path("hull.json").write_text("{}", encoding="utf-8")
    Path("d.tlog").write_bytes(LETTER)
    assert words in refused(*line.split())
