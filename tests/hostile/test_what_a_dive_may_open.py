"""What a dive says opens no other file than a vehicle's, and nothing in it is ever run."""

import ast
import gzip
import os
import random
from collections.abc import Iterator
from pathlib import Path

import pytest

from bridge.errors import ConfigError, LogError, ParamRejected
from bridge.file_size import MOST_SMALL_BYTES, read_small
from bridge.new_file import open_new
from bridge.tlog import FEW_BYTES, MOST_BYTES, MOST_FOLDS, UNFOLD_BYTES, load_bytes
from bridge.vehicle.config import CONFIGS
from gcs_plugin.dive_order import GLANCE
from gcs_plugin.fetch.mirror import Mirror
from gcs_plugin.fetch.whole import write_records
from gcs_plugin.folder import About, DiveFolder
from gcs_plugin.params.files import LARGEST_FILE_BYTES, read_parameters
from gcs_plugin.params.sidecar import read_sidecar
from identify.ingest.open import read_dive
from tui.dive_list import row_of
from tui.recordings import vehicle_named

ROOT = Path(__file__).resolve().parents[2]
PRODUCT = ("bridge", "gcs_plugin", "identify", "tui", "blueos")


def about(folder: Path, named: str) -> About:
    DiveFolder(folder).describe(About(named, "", "hovering"))
    return DiveFolder(folder).about()


@pytest.mark.parametrize(
    "named", ["../../etc/passwd", "/etc/passwd", "/dev/zero", "fifo.yaml", "fifo", "folder.yaml", ""]
)
def test_nothing_but_a_vehicle_file_is_opened_on_a_dives_word(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, named: str
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder.yaml").mkdir()
    for name in ("fifo", "fifo.yaml"):
        os.mkfifo(tmp_path / name)
    said = about(tmp_path, named)
    assert said.vehicle_path is None
    assert vehicle_named(said, "ruvifist") == "ruvifist"
    if named:
        with pytest.raises(
            ConfigError, match="the dive's vehicle file is not there; give one with --vehicle"
        ):
            vehicle_named(said)


def test_the_list_of_dives_opens_none_either(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "fifo.yaml")
    about(tmp_path, str(tmp_path / "fifo.yaml"))
    (tmp_path / "telemetry.tlog").write_bytes(b"")
    assert row_of(tmp_path).name == tmp_path.name


def test_a_vehicle_file_is_opened_where_the_dive_says_and_else_where_ours_lie(tmp_path: Path) -> None:
    own = tmp_path / "own.yaml"
    own.write_bytes((CONFIGS / "vehicles" / "ruvifist.yaml").read_bytes())
    assert vehicle_named(about(tmp_path, str(own))) == f"{own}:hovering"
    ours = CONFIGS / "vehicles" / "ruvifist.yaml"
    assert vehicle_named(about(tmp_path, "/gone/ruvifist.yaml")) == f"{ours}:hovering"
    assert vehicle_named(about(tmp_path, "/gone/../../ruvifist.yaml")) == f"{ours}:hovering"


FORBIDDEN = {
    "eval", "exec", "pickle.load", "pickle.loads", "marshal.loads", "shelve.open", "np.load", "numpy.load",
    "torch.load", "yaml.full_load", "yaml.unsafe_load", "os.system", "os.popen",
}  # fmt: skip


def calls(tree: ast.AST) -> Iterator[tuple[str, ast.Call]]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            yield ast.unparse(node.func), node


def test_nothing_that_runs_what_it_reads_is_called_anywhere() -> None:
    found, files = [], [file for room in PRODUCT for file in (ROOT / room).rglob("*.py")]
    assert len(files) > 200
    for file in files:
        place = str(file.relative_to(ROOT))
        for name, call in calls(ast.parse(file.read_text(encoding="utf-8"))):
            loader = name == "yaml.load" and place != "bridge/plain.py"
            shell = any(word.arg == "shell" for word in call.keywords)
            if name in FORBIDDEN or loader or shell:
                found.append(f"{place}:{call.lineno} {name}")
    assert found == []


def test_a_file_that_unfolds_beyond_all_measure_is_cut_before_it_fills_the_memory(tmp_path: Path) -> None:
    path = tmp_path / "dive.tlog.gz"
    for good, most in ((b"", FEW_BYTES), (random.Random(0).randbytes(300_000), 2 * MOST_FOLDS * 300_000)):
        path.write_bytes(gzip.compress(good) + gzip.compress(bytes(1 << 26)))
        data, whole = load_bytes(path)
        assert data.startswith(good)
        assert FEW_BYTES < len(data) < most + UNFOLD_BYTES * 1040
        assert not whole


def test_nothing_is_written_through_a_link_that_a_dive_holds(tmp_path: Path) -> None:
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


@pytest.fixture(params=["a pipe", "a device", "a link to a device"])
def endless(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """What gives bytes without an end, or none at all; who opens it to read fails instead of hanging."""
    path = tmp_path / "telemetry.tlog"
    if request.param == "a pipe":
        os.mkfifo(path)
    elif request.param == "a device":
        path = Path("/dev/zero")
    else:
        path.symlink_to("/dev/zero")
    monkeypatch.setattr(Path, "read_bytes", lambda _: pytest.fail("opened"))
    monkeypatch.setattr(Path, "read_text", lambda *_, **__: pytest.fail("opened"))
    return path


def test_a_recording_that_has_no_end_is_refused_before_it_is_opened(endless: Path) -> None:
    with pytest.raises(LogError) as refused:
        load_bytes(endless)
    assert str(refused.value) == f"{endless}: is no file; take it away"


def test_a_parameter_file_that_has_no_end_is_refused_before_it_is_opened(endless: Path) -> None:
    with pytest.raises(ParamRejected) as refused:
        read_parameters(endless)
    assert str(refused.value) == f"{endless}: is no file; give a .param file"


def test_a_dive_whose_recording_is_a_pipe_is_refused_in_one_sentence(tmp_path: Path) -> None:
    pipe = tmp_path / "telemetry.tlog"
    os.mkfifo(pipe)
    with pytest.raises(LogError) as refused:
        read_dive(tmp_path)
    assert str(refused.value) == f"{pipe}: is no file; take it away"


def test_pipes_beside_a_recording_are_no_results_of_ours_and_hold_nothing_up(tmp_path: Path) -> None:
    (tmp_path / "telemetry.tlog").write_bytes(b"")
    for name in ("identified.json", GLANCE, "x.param.json"):
        os.mkfifo(tmp_path / name)
    assert row_of(tmp_path).learnt == ()
    with pytest.raises(ParamRejected, match=r"x\.param\.json: not a sidecar .*a pipe or a device"):
        read_sidecar(tmp_path / "x.param")
    os.mkfifo(tmp_path / "dive.yaml")
    with pytest.raises(ConfigError) as refused:
        DiveFolder(tmp_path).about()
    assert str(refused.value) == f"{tmp_path / 'dive.yaml'}: is no file; take it away"


def test_a_result_larger_than_any_of_ours_is_not_read(tmp_path: Path) -> None:
    path = grown(tmp_path / "identified.json", MOST_SMALL_BYTES + 1)
    with pytest.raises(OSError, match="more than the 64 MB"):
        read_small(path)
    assert read_small(grown(path, 3)) == 3 * "\0"


def test_what_is_fetched_is_written_through_no_link(tmp_path: Path) -> None:
    ours, folder = tmp_path / "ours.txt", tmp_path / "ring"
    folder.mkdir()
    ours.write_text("ours", encoding="utf-8")
    (folder / "a.tlog.part").symlink_to(ours)
    with pytest.raises(LogError, match="is no file; take it away"):
        Mirror(folder).append("a.tlog", b"theirs")
    assert ours.read_text(encoding="utf-8") == "ours"


def grown(path: Path, size: int) -> Path:
    """A file that says it is so long, and takes no room on the disk."""
    with path.open("wb") as file:
        file.truncate(size)
    return path


@pytest.mark.parametrize("name", ["telemetry.tlog", "telemetry.tlog.gz", "telemetry.bin", "telemetry.csv"])
def test_a_recording_larger_than_any_dive_is_refused_before_it_is_opened(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    path = grown(tmp_path / name, MOST_BYTES + 1)
    monkeypatch.setattr(Path, "read_bytes", lambda _: pytest.fail("opened"))
    with pytest.raises(LogError) as refused:
        load_bytes(path)
    assert str(refused.value) == (
        f"{path}: 2.1 GB is more than the 2.1 GB that are read of a file, which hold a dive of a day; give a part of it"
    )


def test_a_recording_as_large_as_the_largest_dive_is_opened(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Path, "read_bytes", lambda _: b"as it is")
    assert load_bytes(grown(tmp_path / "telemetry.tlog", MOST_BYTES)) == (b"as it is", True)


def test_a_parameter_file_of_more_than_some_megabytes_is_refused_before_it_is_opened(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = grown(tmp_path / "large.param", LARGEST_FILE_BYTES + 1)
    monkeypatch.setattr(Path, "read_text", lambda *_, **__: pytest.fail("opened"))
    with pytest.raises(ParamRejected, match="4000001 bytes is too long for a parameter file; give another"):
        read_parameters(path)
