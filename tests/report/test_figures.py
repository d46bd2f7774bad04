"""Figures of a page, as files and zoomed without a script, and the provenance at its end."""

import platform
from argparse import Namespace
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pytest

from bridge.errors import LogError
from bridge.vehicle.config import load_vehicle
from identify.dive import Dive, Signal
from identify.report.page import (
    Figure,
    Report,
    Section,
    file_name,
    provenance,
    with_provenance,
    write_figures,
)
from identify.report.plot import Line, lines_panel, stack
from tui.files import settings


def figure(name):
    line = Line(np.array([0.0, 1.0]), np.array([0.0, 1.0]))
    return Figure(name, "caption", stack([lines_panel("y", "x", [line])]))


def test_each_figure_is_two_files_and_one_name_twice_is_told_apart(tmp_path):
    first, second = (
        Section("a", figures=(figure("path dive-7"), figure("depth"))),
        Section("b", figures=(figure("depth"),)),
    )
    written = write_figures(tmp_path / "new" / "figures", Report("t", "", "", (first, second)))
    names = ["path-dive-7.svg", "path-dive-7.png", "depth.svg", "depth.png", "depth-2.svg", "depth-2.png"]
    assert [path.name for path in written] == names
    assert sorted(path.name for path in (tmp_path / "new" / "figures").iterdir()) == sorted(names)
    assert all(path.stat().st_size > 1000 for path in written)
    (tmp_path / "file").write_text("")
    with pytest.raises(LogError, match="file/f: the figures can't be written"):
        write_figures(tmp_path / "file" / "f", Report("t", "", "", (first,)))


def test_a_figure_does_not_take_the_place_of_another_whose_name_ends_in_a_number(tmp_path):
    drawn = tuple(figure(name) for name in ("depth", "depth", "depth 2", "depth"))
    written = write_figures(tmp_path, Report("t", "", "", (Section("a", figures=drawn),)))
    stems = [path.stem for path in written if path.suffix == ".svg"]
    assert stems == ["depth", "depth-2", "depth-2-2", "depth-3"]


@pytest.mark.parametrize(
    ("words", "name"),
    [
        ("tracking surge ../../etc/PID (2)", "tracking-surge-etc-pid-2"),
        ("Fig. 17 (a): Überlauf", "fig-17-a-uberlauf"),
        ("潜水", "figure"),
        ("x" * 300, "x" * 100),
    ],
)
def test_a_name_is_taken_by_every_file_system(words, name):
    assert file_name(words) == name


FILE = load_vehicle("ruvifist:hovering")


def dive(name, sha256):
    depth = Signal(np.array([5.0, 105.0]), np.zeros((2, 1)))
    return Dive(name, Path("/somewhere") / name / "telemetry.tlog", sha256, depth=depth)


def test_every_recording_stands_once_with_its_hash_and_the_vehicle_file_with_its_own():
    first, other = dive("one", "ab" * 32), dive("other", "cd" * 32)
    sources, *_ = provenance([first, other, first], FILE, {}).tables
    assert sources.shown == (
        ("one", "telemetry.tlog", "1 min 40 s", "recording", "ab" * 32),
        ("other", "telemetry.tlog", "1 min 40 s", "recording", "cd" * 32),
        ("ruvifist", "ruvifist.yaml", "—", "vehicle file", FILE.sha256),
    )


def test_provenance_ends_the_page_with_versions_and_settings():
    report = with_provenance(Report("t", "s", "v", (Section("Part"),)), [], FILE, {"method": "pinn"})
    assert [section.heading for section in report.sections] == ["Part", "Provenance"]
    assert report.sections[-1].tables[-1].shown == (("method", "pinn"),)
    rows = dict(report.sections[-1].tables[1].shown)
    assert rows["Python"] == platform.python_version()
    assert (rows["numpy"], rows["torch"]) == (version("numpy"), version("torch"))
    assert "seatrial" in rows


def test_settings_are_what_was_given_and_where_results_go_is_none_of_them():
    given = Namespace(
        dives=["a", "b"], vehicle="ruvifist", network=[4, 1, 2], check=None, yes=False, json="-", report="x.html",
        figures="f", max_speed=0,
    )  # fmt: skip
    assert settings(given) == {"dives": "a b", "vehicle": "ruvifist", "network": "4 1 2", "max speed": "0"}
