"""Files named by a dive, a command or a result are bounded, read and never run."""

import ast
import asyncio
import copy
import gzip
import json
import os
import random
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import strange_things
from fuzz_files import IDENTIFIED
from fuzz_files import identification as fuzz_files_identification
from strange_things import THINGS

from bridge.clock import SimulatedClock
from bridge.errors import ConfigError, LogError, ParamError, ParamRejected
from bridge.exit_codes import UsageError
from bridge.files import clear_way, open_new
from bridge.onboard import store
from bridge.onboard.file_server import Segments
from bridge.schema import load_yaml
from bridge.vehicle.config import CONFIGS, load_vehicle
from bridge.wire.segments import Segment, segments_in
from bridge.wire.tlog import load_bytes
from gcs_plugin.dives.folder import About, DiveFolder, vehicle_named
from gcs_plugin.dives.recordings import GLANCE
from gcs_plugin.fetch.merging import write_records
from gcs_plugin.fetch.mirror import Mirror
from gcs_plugin.mavproxy.work import Work
from gcs_plugin.params.files import read_parameters
from gcs_plugin.params.sidecar import read_sidecar
from gcs_plugin.recording.state import held
from identify.batch.jobs import IDENTIFY, job_for
from identify.batch.recordings import Recording
from identify.batch.run import Cache
from identify.challenge.seal import read_key
from identify.report.page import Report, write_report
from tui.accepted_priors import accepted_in
from tui.app import themes
from tui.app.identification import load_identified
from tui.app.jobs import Kept, work
from tui.app.keys import load_keymap
from tui.commands.challenge import _answer
from tui.commands.params import targets_of_identification
from tui.commands.plan import check_plan
from tui.dive_list import results_beside
from tui.dive_reading import row_of
from tui.parameter_files import Leave, read_identification

ours = strange_things.ours

ROOT = Path(__file__).resolve().parents[2]
PRODUCT = ("bridge", "gcs_plugin", "identify", "tui", "blueos")


def about(folder, named):
    DiveFolder(folder).describe(About(named, "", "hovering"))
    return DiveFolder(folder).about()


@pytest.mark.parametrize(
    "named", ["../../etc/passwd", "/etc/passwd", "/dev/zero", "fifo.yaml", "fifo", "folder.yaml", ""]
)
def test_nothing_but_a_vehicle_file_is_opened_on_a_dives_word(tmp_path, monkeypatch, named):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder.yaml").mkdir()
    for name in ("fifo", "fifo.yaml"):
        os.mkfifo(tmp_path / name)
    dive = about(tmp_path, named)
    assert dive.vehicle_path is None
    assert vehicle_named(dive, "ruvifist") == "ruvifist"
    if named:
        with pytest.raises(
            ConfigError, match="the dive's vehicle file is not there; give one with --vehicle"
        ):
            vehicle_named(dive)


def test_a_vehicle_file_is_opened_where_the_dive_says_and_else_where_ours_lie(tmp_path):
    vehicle_file = tmp_path / "own.yaml"
    vehicle_file.write_bytes((CONFIGS / "vehicles" / "ruvifist.yaml").read_bytes())
    assert vehicle_named(about(tmp_path, str(vehicle_file))) == f"{vehicle_file}:hovering"
    ours = CONFIGS / "vehicles" / "ruvifist.yaml"
    assert vehicle_named(about(tmp_path, "/gone/ruvifist.yaml")) == f"{ours}:hovering"
    assert vehicle_named(about(tmp_path, "/gone/../../ruvifist.yaml")) == f"{ours}:hovering"


FORBIDDEN = {
    "eval", "exec", "pickle.load", "pickle.loads", "marshal.loads", "shelve.open", "np.load", "numpy.load",
    "torch.load", "yaml.full_load", "yaml.unsafe_load", "os.system", "os.popen",
}  # fmt: skip


MAY_CALL = re.compile(
    r"\b(?:eval|exec|pickle|marshal|shelve|load|full_load|unsafe_load|system|popen|shell)\b"
)
"""A word of each; a file without any is not parsed."""


def calls(text):
    for node in ast.walk(ast.parse(text)) if MAY_CALL.search(text) else ():
        if isinstance(node, ast.Call):
            yield ast.unparse(node.func), node


def test_nothing_that_runs_what_it_reads_is_called_anywhere():
    result, files = [], [file for room in PRODUCT for file in (ROOT / room).rglob("*.py")]
    assert len(files) > 200
    for file in files:
        place = str(file.relative_to(ROOT))
        for name, call in calls(file.read_text(encoding="utf-8")):
            words = {word.arg: ast.unparse(word.value) for word in call.keywords}
            if name == "np.load" and words.get("allow_pickle") == "False":
                continue
            loader = name == "yaml.load" and place != "bridge/plain.py"
            if name in FORBIDDEN or loader or "shell" in words:
                result.append(f"{place}:{call.lineno} {name}")
    assert result == []


def test_a_file_that_unfolds_beyond_all_measure_is_cut_before_it_fills_the_memory(tmp_path):
    path = tmp_path / "dive.tlog.gz"
    for good, most in ((b"", 2**24), (random.Random(0).randbytes(300_000), 200 * 300_000)):
        path.write_bytes(gzip.compress(good) + gzip.compress(bytes(1 << 26)))
        data, whole = load_bytes(path)
        assert data.startswith(good)
        assert 2**24 < len(data) < most + 1024 * 1040
        assert not whole


def test_nothing_is_written_through_a_link_that_a_dive_holds(tmp_path):
    ours, folder = tmp_path / "ours.txt", tmp_path / "dive"
    folder.mkdir()
    for name in ("dive.part", "telemetry.whole.tlog.part", ".glance.part"):
        ours.write_text("ours", encoding="utf-8")
        (folder / name).symlink_to(ours)
        with open_new(folder / name) as made:
            made.write(b"theirs")
        assert (folder / name).read_bytes() == b"theirs"
        assert ours.read_text(encoding="utf-8") == "ours"
        (folder / name).unlink()
    for name in (f"dive.yaml.{os.getpid()}.part", "telemetry.whole.tlog.part"):
        (folder / name).symlink_to(ours)
    DiveFolder(folder).describe(About("ruvifist", "", "hovering"))
    write_records(folder / "telemetry.whole.tlog", [(1, b"theirs")])
    assert ours.read_text(encoding="utf-8") == "ours"
    assert DiveFolder(folder).about().configuration == "hovering"


ODD = "no file, but a pipe or a device"
LARGE = "more than the 64 MB that any of ours has"
VEHICLE = load_vehicle("ruvifist")


def pipe(path):
    os.mkfifo(path)


def device(path):
    path.symlink_to("/dev/zero")


def grown(path, size=64_000_001):
    """A file that says it is so long, and takes no room on the disk."""
    with path.open("wb") as file:
        file.truncate(size)
    return path


@pytest.fixture
def shut(monkeypatch):
    """From its call on no file may be opened: who does so fails instead of hanging."""
    return lambda: monkeypatch.setattr(Path, "open", lambda *_, **__: pytest.fail("opened"))


def hashed_map(path):
    """A job whose key holds the hash of a column map."""
    return job_for(IDENTIFY, Recording("dive", path.parent, (), "ab"), VEHICLE, "likelihood", path)


TAKE_AWAY, YAML = "a.json: is no file; take it away", f"a.json: is {ODD}; give a YAML file"
ENDLESS: dict[str, tuple[Callable[[Path], Any], type[Exception], str]] = {
    "a recording": (load_bytes, LogError, TAKE_AWAY),
    "a parameter file": (read_parameters, ParamRejected, "a.json: is no file; give a .param file"),
    "a sidecar": (lambda path: read_sidecar(path.with_suffix("")), ParamRejected, "a pipe or a device"),
    "YAML": (load_yaml, ConfigError, YAML),
    "a vehicle file": (lambda path: load_vehicle(str(path)), ConfigError, YAML),
    "a keymap": (lambda path: load_keymap(path, ()), ConfigError, YAML),
    "an identification": (read_identification, UsageError, ODD),
    "what a vehicle keeps": (store.load, ParamError, ODD),
    "an answer to a case": (_answer, LogError, ODD),
    "a plan": (lambda path: check_plan(str(path)), UsageError, "exists and is no plan, so it stays"),
    "a key of answers": (read_key, LogError, "holds no key"),
    "what a batch keeps": (Cache, LogError, f"the results can't be kept there ({ODD})"),
    "a column map": (hashed_map, OSError, ODD),
}


@pytest.mark.parametrize("name", ENDLESS)
@pytest.mark.parametrize("put", [pipe, device])
def test_what_has_no_end_is_refused_in_one_sentence_before_it_is_opened(tmp_path, shut, put, name):
    read, refusal, words = ENDLESS[name]
    path = tmp_path / "a.json"
    path.with_suffix("").touch()
    put(path)
    shut()
    with pytest.raises(refusal, match=re.escape(words)) as refused:
        read(path)
    assert "\n" not in str(refused.value)


GB = "2.1 GB is more than the 2.1 GB that are read of a file, which hold a dive of a day; give a part of it"


@pytest.mark.parametrize(
    ("name", "size", "read", "refusal", "words"),
    [
        *((f"telemetry.{end}", 2**31 + 1, load_bytes, LogError, GB) for end in ("tlog.gz", "bin", "csv")),
        ("a.param", 4_000_001, read_parameters, ParamRejected, "4000001 bytes is too long for a parameter file"),
        ("a.json", 64_000_001, read_identification, UsageError, LARGE),
        ("a.json", 64_000_001, store.load, ParamError, LARGE),
        ("a.yaml", 64_000_001, hashed_map, OSError, LARGE),
        ("key", 64_000_001, read_key, LogError, "holds no key"),
    ],
)  # fmt: skip
def test_what_is_larger_than_any_of_ours_is_refused_before_it_is_opened(
    tmp_path, shut, name, size, read,
    refusal, words
):  # fmt: skip
    path = grown(tmp_path / name, size)
    shut()
    with pytest.raises(refusal, match=re.escape(words)):
        read(path)


def test_a_recording_as_large_as_the_largest_dive_is_opened(tmp_path, monkeypatch):
    monkeypatch.setattr(Path, "read_bytes", lambda _: b"as it is")
    assert load_bytes(grown(tmp_path / "telemetry.tlog", 2**31)) == (b"as it is", True)


def test_pipes_beside_a_recording_are_no_results_of_ours_and_hold_nothing_up(tmp_path):
    about(tmp_path, str(tmp_path / "fifo.yaml"))
    (tmp_path / "telemetry.tlog").write_bytes(b"")
    for path in ("fifo.yaml", "diagnosis.json", GLANCE, results_beside(tmp_path)["--json"]):
        os.mkfifo(tmp_path / path)
    assert row_of(tmp_path).learnt == ()
    assert Kept(lambda data: data).read(tmp_path / "diagnosis.json") is None
    assert load_identified(tmp_path, tmp_path / "receipts") is None


def test_what_is_fetched_is_written_through_no_link(tmp_path):
    ours, folder = tmp_path / "ours.txt", tmp_path / "ring"
    folder.mkdir()
    ours.write_text("ours", encoding="utf-8")
    (folder / "a.tlog.part").symlink_to(ours)
    with pytest.raises(LogError, match="is no file; take it away"):
        Mirror(folder).append("a.tlog", b"theirs")
    assert ours.read_text(encoding="utf-8") == "ours"


@pytest.mark.parametrize("put", [pipe, device, grown])
def test_what_lies_where_the_program_keeps_its_state_holds_nothing_up(tmp_path, monkeypatch, shut, put):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    (tmp_path / "seatrial").mkdir()
    for name in ("tui.json", "recording.json"):
        put(tmp_path / "seatrial" / name)
    shut()
    assert themes.load_theme() == themes.ORDER[0]
    assert held(0.0) is None


@pytest.fixture(params=[thing for thing in THINGS if thing != "a folder"])
def put(request, ours):
    """Puts something at a place that is no file of its own."""

    def at(place):
        strange_things.put(place, request.param, ours)
        return place

    return at


def test_a_result_goes_to_its_own_place_in_the_app(tmp_path, ours, put):
    place = put(tmp_path / "identified.json")
    done = asyncio.run(work(["dives", str(tmp_path), "--json", str(place)], lambda _: None, lambda: 0))
    assert done.code == 0
    assert json.loads(place.read_text(encoding="utf-8")) == []
    assert not place.is_symlink()
    assert ours.read_text(encoding="utf-8") == "ours"
    assert not ours.with_name("nothing").exists()


def test_so_it_does_in_mavproxy(tmp_path, put, monkeypatch):
    begun: list[list[str]] = []
    monkeypatch.setattr("gcs_plugin.mavproxy.work.Job", lambda _title, words, *_: begun.append(words))
    place, named = put(tmp_path / "identified.json"), put(tmp_path / "named.param")
    Work(SimulatedClock(), lambda _: None).begin("identify", tmp_path, ["--param", str(named)], "ruvifist")
    assert str(place) in begun[0]
    assert not os.path.lexists(place)
    assert os.path.lexists(named)  # where the user says is his own


def test_files_and_folders_stay(tmp_path, ours):
    (tmp_path / "folder").mkdir()
    for name in ("folder", ours.name, "nothing"):
        clear_way(tmp_path / name)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["folder", ours.name]


def test_a_page_is_written_through_no_link(tmp_path, ours, put):
    put(tmp_path / f"page.html.{os.getpid()}.part")
    put(tmp_path / "page.html")
    page = write_report(tmp_path / "page.html", Report("title", "", "all is well"))
    assert "all is well" in page.read_text(encoding="utf-8")
    assert ours.read_text(encoding="utf-8") == "ours"


def test_a_ring_hands_out_files_alone(tmp_path, put):
    name = Segment(1, 2, 3, 4).name
    put(tmp_path / name)
    assert segments_in(tmp_path) == []
    assert Segments(tmp_path).sizes() == []
    with pytest.raises(FileNotFoundError):
        Segments(tmp_path).read(name, 0, 9)


ANY = Leave(any_vehicle=True, doubts=True)


def put_answer(folder, place, value):
    data = copy.deepcopy(json.loads(IDENTIFIED))
    holder = data
    for key in place[:-1]:
        holder = holder[key]
    holder[place[-1]] = value
    path = folder / "i.json"
    path.write_text(json.dumps(data), encoding="utf-8")
    return path


def test_the_one_that_all_are_made_of_is_taken(tmp_path):
    (tmp_path / "i.json").write_bytes(IDENTIFIED)
    accepted, targets = fuzz_files_identification(tmp_path)
    assert accepted.configuration == "hovering"
    assert list(accepted.priors) == ["M_u"]
    assert list(targets.values.values()) == [150.5]


@pytest.mark.parametrize(
    ("place", "value"),
    [
        (("parameters", 0, "name"), ["M_u"]),
        (("parameters", 0, "high95"), "1e400"),
        (("thrust_scale", "shift"), {}),
        (("prior_dives",), 1.5),
        (("doubts", 0), "M_u"),
        (("vehicle",), []),
    ],
)
def test_one_with_something_else_in_a_place_is_refused(tmp_path, place, value):
    path = put_answer(tmp_path, place, value)
    sentence = f"{path}: is not an identification; give the file that `seatrial identify --json` wrote"
    with pytest.raises(UsageError) as refused:
        targets_of_identification(path, "ruvifist:hovering", ANY)
    assert str(refused.value) == sentence
    with pytest.raises(UsageError) as refused:
        accepted_in(path, None, ANY)
    assert str(refused.value) == sentence
