"""The how-to for a foreign log is followed, command by command, on a log in axes of ROS."""

import json
import shlex
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO

import numpy as np
import pytest
import sketches
from page_runner import Typist
from soak import rest_in_soak

from identify.challenge.case import dive_of, draw_case
from identify.ingest.rotation import euler_angles
from tui import cli

FLU = np.array([1.0, -1.0, -1.0])
RUNS = 3


def write_foreign_log(folder, seconds, seed=100_011):
    """Write `our_log.csv`, a row for each time of any sensor, its thirds as runs in `runs`, and `our.yaml`, the vehicle
    file."""
    case = draw_case(seed, names=[], seconds=seconds)
    (folder / "our.yaml").write_text(case.vehicle.text, encoding="utf-8")
    dive = dive_of(case)
    signals = dive.signals()
    depth = signals["pressure"].value / 9800.0 - 10.3
    angles = np.degrees(np.column_stack(euler_angles(signals["attitude"].value)) * FLU)
    columns = [
        (signals["velocity"].time_s, signals["velocity"].value * FLU, ("vel.x", "vel.y", "vel.z")),
        (signals["gyro"].time_s, signals["gyro"].value * FLU, ("gyro.x", "gyro.y", "gyro.z")),
        (
            signals["specific_force"].time_s,
            signals["specific_force"].value * FLU,
            ("acc.x", "acc.y", "acc.z"),
        ),
        (signals["attitude"].time_s, angles, ("roll", "pitch", "yaw")),
        (signals["pressure"].time_s, -depth, ("position.z",)),
        (signals["pwm"].time_s, signals["pwm"].value, tuple(f"thruster_{k + 1}" for k in range(8))),
        (signals["voltage"].time_s, signals["voltage"].value, ("battery_voltage",)),
    ]
    times = np.unique(np.concatenate([time_s for time_s, _, _ in columns]))
    cells = [np.full((len(times), len(names)), np.nan) for _, _, names in columns]
    for table, (time_s, value, _) in zip(cells, columns, strict=True):
        table[np.searchsorted(times, time_s)] = value
    header = ",".join(("timestamp_ms", *(name for _, _, names in columns for name in names)))
    rows = np.column_stack([times * 1e3, *cells])
    lines = [",".join("" if np.isnan(cell) else f"{cell:.9g}" for cell in row) for row in rows]
    (folder / "our_log.csv").write_text("\n".join((header, *lines)) + "\n", encoding="utf-8")
    (folder / "runs").mkdir()
    for number, part in enumerate(np.array_split(np.arange(len(lines)), RUNS), start=1):
        text = "\n".join((header, *(lines[k] for k in part.tolist()))) + "\n"
        (folder / "runs" / f"run{number}.csv").write_text(text, encoding="utf-8")


NO_LINK = 0


class Here(Typist):
    """Runs each line in this process, its figures sketched: six processes mostly import, and a page mostly draws."""

    def _run(self, line):
        command, verb, *options = shlex.split(line)
        assert command == "seatrial"
        said = StringIO()
        with pytest.MonkeyPatch.context() as patch, redirect_stdout(said), redirect_stderr(said):
            patch.chdir(self.folder)
            patch.setattr("identify.report.picture.inline", sketches.inline)
            assert cli.main([verb, *options]) == 0, f"{line}\n{said.getvalue()}"
        self.said = said.getvalue()


@pytest.fixture(
    scope="module", params=rest_in_soak(((Here, 66.0), (Typist, 150.0))), ids=["here", "in a shell"]
)
def followed(tmp_path_factory, request):
    typed, seconds = request.param
    typist = typed(tmp_path_factory.mktemp("own"), NO_LINK)
    write_foreign_log(typist.folder, seconds)
    typist.follow("docs/howto/bring_your_own_log.md", but=("cp ",))
    yield typist
    typist.close()


def test_the_page_comes_from_the_log_to_its_masses_and_to_a_diagnosis(followed):
    fitted = json.loads((followed.folder / "hull.json").read_text(encoding="utf-8"))
    assert fitted["outcome"] == "converged"
    assert "No gap" in followed.said
    assert (followed.folder / "gap.html").stat().st_size > 10_000


def test_the_map_that_was_proposed_turns_the_log_to_forward_right_down(followed):
    text = (followed.folder / "columns.yaml").read_text(encoding="utf-8")
    assert text.count("scale: [1, -1, -1]") == 4
    assert "depth: {columns: [position.z], unit: m, scale: [-1]}" in text


def test_a_folder_of_runs_comes_to_one_answer_and_a_page(followed):
    fitted = json.loads((followed.folder / "runs.json").read_text(encoding="utf-8"))
    assert [run["name"] for run in fitted["runs"]["used"]] == ["run1", "run2", "run3"]
    assert (followed.folder / "runs.html").stat().st_size > 10_000
