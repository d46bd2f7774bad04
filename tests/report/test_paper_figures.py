"""The figures of a page as files: each as SVG and PNG, named by what it shows."""

from pathlib import Path

import numpy as np
import pytest

from bridge.errors import LogError
from identify.report.page import Figure, Report, Section
from identify.report.picture import file_name, write_figures
from identify.report.plot import Line, lines_panel, stack


def figure(name: str) -> Figure:
    line = Line(np.array([0.0, 1.0]), np.array([0.0, 1.0]))
    return Figure(name, "caption", stack([lines_panel("y", "x", [line])]))


def test_each_figure_is_two_files_and_one_name_twice_is_told_apart(tmp_path: Path):
    first, second = (
        Section("a", figures=(figure("path dive-7"), figure("depth"))),
        Section("b", figures=(figure("depth"),)),
    )
    written = write_figures(tmp_path / "new" / "figures", Report("t", "", "", (first, second)))
    names = ["path-dive-7.svg", "path-dive-7.png", "depth.svg", "depth.png", "depth-2.svg", "depth-2.png"]
    assert [path.name for path in written] == names
    assert sorted(path.name for path in (tmp_path / "new" / "figures").iterdir()) == sorted(names)
    assert all(path.stat().st_size > 1000 for path in written)


@pytest.mark.parametrize(
    ("words", "name"),
    [
        ("tracking surge ../../etc/PID (2)", "tracking-surge-etc-pid-2"),
        ("Fig. 17 (a): Überlauf", "fig-17-a-uberlauf"),
        ("潜水", "figure"),
        ("x" * 300, "x" * 100),
    ],
)
def test_a_name_is_taken_by_every_file_system(words: str, name: str):
    assert file_name(words) == name


def test_a_place_that_cannot_be_written_is_named(tmp_path: Path):
    (tmp_path / "file").write_text("")
    with pytest.raises(LogError, match="file/f: the figures can't be written"):
        write_figures(
            tmp_path / "file" / "f", Report("t", "", "", (Section("a", figures=(figure("depth"),)),))
        )
