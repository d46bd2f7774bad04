"""What lies in a dive under the name of a result of ours, and is no file, is neither read, waited for nor followed."""

import asyncio
import json
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from bridge.clock import SimulatedClock
from bridge.ftp.files import Segments
from bridge.new_file import clear_way
from bridge.ring.segments import Segment, segments_in
from gcs_plugin.mavproxy.work import Work
from identify.report.page import Report, write_report
from tui.app.jobs import Kept
from tui.app.screens.identify_lines import found, places
from tui.job import work

THINGS = ["a pipe", "a link", "a link to nothing", "a link to a device"]


@pytest.fixture
def ours(tmp_path: Path) -> Path:
    path = tmp_path / "ours.txt"
    path.write_text("ours", encoding="utf-8")
    return path


@pytest.fixture(params=THINGS)
def put(request: pytest.FixtureRequest, ours: Path) -> Callable[[Path], Path]:
    """Puts something at a place that is no file of its own."""

    def at(place: Path) -> Path:
        if request.param == "a pipe":
            os.mkfifo(place)
        else:
            targets = {"a link": ours, "a link to nothing": ours.with_name("nothing")}
            place.symlink_to(targets.get(request.param, "/dev/null"))
        return place

    return at


def test_a_result_goes_to_its_own_place_in_the_app(
    tmp_path: Path, ours: Path, put: Callable[[Path], Path]
) -> None:
    place = put(tmp_path / "identified.json")
    done = asyncio.run(work(["dives", str(tmp_path), "--json", str(place)], lambda _: None))
    assert done.code == 0
    assert json.loads(place.read_text(encoding="utf-8")) == []
    assert not place.is_symlink()
    assert ours.read_text(encoding="utf-8") == "ours"
    assert not ours.with_name("nothing").exists()


def test_so_it_does_in_mavproxy(
    tmp_path: Path, put: Callable[[Path], Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    begun: list[list[str]] = []
    monkeypatch.setattr("gcs_plugin.mavproxy.work.Job", lambda _title, words, *_: begun.append(words))
    place, named = put(tmp_path / "identified.json"), put(tmp_path / "named.param")
    Work(SimulatedClock(), lambda _: None).begin("identify", tmp_path, ["--param", str(named)], "ruvifist")
    assert str(place) in begun[0]
    assert not os.path.lexists(place)
    assert os.path.lexists(named)  # where the user says is his own


def test_files_and_folders_stay(tmp_path: Path, ours: Path) -> None:
    (tmp_path / "folder").mkdir()
    for name in ("folder", ours.name, "nothing"):
        clear_way(tmp_path / name)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["folder", ours.name]


def test_a_page_is_written_through_no_link(tmp_path: Path, ours: Path, put: Callable[[Path], Path]) -> None:
    put(tmp_path / f"page.html.{os.getpid()}.part")
    put(tmp_path / "page.html")
    page = write_report(tmp_path / "page.html", Report("title", "", "all is well"))
    assert "all is well" in page.read_text(encoding="utf-8")
    assert ours.read_text(encoding="utf-8") == "ours"


def test_pipes_under_the_names_of_results_hold_no_screen_up(tmp_path: Path) -> None:
    (tmp_path / "telemetry.tlog").write_bytes(b"")
    for path in (tmp_path / "diagnosis.json", places(tmp_path)["--json"]):
        os.mkfifo(path)
    assert Kept(lambda data: data).read(tmp_path / "diagnosis.json") is None
    assert found(tmp_path, tmp_path / "receipts") is None


def test_a_ring_hands_out_files_alone(tmp_path: Path, put: Callable[[Path], Path]) -> None:
    name = Segment(1, 2, 3, 4).name
    put(tmp_path / name)
    assert segments_in(tmp_path) == []
    assert Segments(tmp_path).sizes() == []
    with pytest.raises(FileNotFoundError):
        Segments(tmp_path).read(name, 0, 9)
