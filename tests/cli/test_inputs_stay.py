"""No option may name a file that the same command reads: a recording can't be dived again."""

import os
import shutil
from pathlib import Path

import pytest

from tui import cli, exit_codes

ROOT = Path(__file__).resolve().parents[2]
RECORDED = b"what was recorded"


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A folder with one of each kind of input."""
    monkeypatch.chdir(tmp_path)
    vehicle = (ROOT / "tests" / "data" / "vehicles" / "survey.yaml").read_text(encoding="utf-8")
    Path("our.yaml").write_text(vehicle, encoding="utf-8")
    shutil.copy(ROOT / "configs" / "thrusters" / "t200.csv", "t200.csv")
    Path("dives/one").mkdir(parents=True)
    for name in ("d.tlog.gz", "map.yaml", "a.json", "a.param", "a.param.json", "m.yaml", "a.json.json",
                 "dives/one/telemetry.tlog", "dives/one/dive.yaml"):  # fmt: skip
        Path(name).write_bytes(RECORDED)
    os.symlink("d.tlog.gz", "soft.html")
    os.link("dives/one/telemetry.tlog", "hard.csv")
    return tmp_path


VEHICLE = ("--vehicle", "our.yaml")


@pytest.mark.parametrize(
    ("line", "read"),
    [
        (("identify", "d.tlog.gz", *VEHICLE, "--report", "d.tlog.gz"), "d.tlog.gz"),
        (("identify", "d.tlog.gz", *VEHICLE, "--report", "soft.html"), "d.tlog.gz"),
        (("identify", "d.tlog.gz", *VEHICLE, "--json", "./our.yaml"), "our.yaml"),
        (("identify", "d.tlog.gz", *VEHICLE, "--json", "t200.csv"), "t200.csv"),
        (("identify", "d.tlog.gz", *VEHICLE, "--columns", "map.yaml", "--json", "map.yaml"), "map.yaml"),
        (("identify", "dives/one", *VEHICLE, "--json", "dives/one/dive.yaml"), "dives/one/dive.yaml"),
        (("identify", "a.param.json", *VEHICLE, "--param", "a.param"), "a.param.json"),
        (("batch", "d.tlog.gz", *VEHICLE, "--csv", "d.tlog.gz"), "d.tlog.gz"),
        (("batch", "dives", *VEHICLE, "--csv", "hard.csv"), "dives/one/telemetry.tlog"),
        (("batch", "d*.gz", *VEHICLE, "--json", "d.tlog.gz"), "d.tlog.gz"),
        (("plan", *VEHICLE, "--out", "our.yaml"), "our.yaml"),
        (("plan", *VEHICLE, "--after", "a.json", "--json", "a.json"), "a.json"),
        (("prior", "a.json", *VEHICLE, "--json", "our.yaml"), "our.yaml"),
        (("prior", "a.param", *VEHICLE, "--json", "a.param.json"), "a.param.json"),
        (("validate", "dives/one", *VEHICLE, "--json", "dives/one/telemetry.tlog"), "telemetry.tlog"),
        (("import", "d.tlog.gz", "--json", "d.tlog.gz"), "d.tlog.gz"),
        (("record", "--link", "udpin:127.0.0.1:1", *VEHICLE, "--json", "our.yaml"), "our.yaml"),
        (("simulate", *VEHICLE, "--mission", "m.yaml", "--json", "m.yaml"), "m.yaml"),
        (("simulate", *VEHICLE, "--mission", "m.yaml", "--parameters", "our.yaml"), "our.yaml"),
        (("params", "diff", "a.param", "--link", "udpin:127.0.0.1:1", "--json", "a.param"), "a.param"),
        (("doctor", *VEHICLE, "--json", "our.yaml"), "our.yaml"),
        (("dives", "dives", "--otherwise", "our.yaml", "--json", "our.yaml"), "our.yaml"),
        (("dives", "dives", "--json", "dives/one/telemetry.tlog"), "dives/one/telemetry.tlog"),
    ],
)
def test_a_target_that_is_an_input_is_refused_and_left_as_it_was(place, capsys, line, read):
    before = {path: path.read_bytes() for path in place.rglob("*") if path.is_file()}
    assert cli.main(line) == exit_codes.BAD_INPUT
    told = " ".join(capsys.readouterr().err.split())
    assert f"{read}, which this command reads: nothing was done; name another file" in told
    assert {path: path.read_bytes() for path in place.rglob("*") if path.is_file()} == before


@pytest.mark.usefixtures("place")
def test_a_result_beside_the_recording_may_be_written_again(capsys):
    Path("dives/one/found.json").write_text("{}", encoding="utf-8")
    line = ("identify", "dives/one", *VEHICLE, "--json", "dives/one/found.json")
    assert cli.main(line) == exit_codes.BAD_INPUT
    assert "which this command reads" not in capsys.readouterr().err


@pytest.mark.usefixtures("place")
def test_the_sidecar_and_the_json_may_not_be_one_file(capsys):
    line = ("identify", "d.tlog.gz", *VEHICLE, "--param", "new.param", "--json", "new.param.json")
    assert cli.main(line) == exit_codes.BAD_INPUT
    assert "--json names the same file" in " ".join(capsys.readouterr().err.split())
