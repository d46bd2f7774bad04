"""Every table at 80 columns, with the longest names and numbers there are: whole, and no wider."""

import argparse
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bridge.vehicle.coefficients import COEFFICIENTS, MASSES
from bridge.vehicle.config import load_vehicle
from gcs_plugin.doctor.checks import fail
from gcs_plugin.params.receipt import Receipt
from gcs_plugin.params.transfer import Outcome as Applied
from identify.checks.fit import too_little
from identify.comparison import compare
from identify.dive import Dive, Signal
from identify.identification import Identification, Outcome, Partner, added_mass, estimate
from identify.validate import PHASES, AxisErrors, Row, SteadyError, TrackingErrors
from tui import answers, demo, show
from tui.commands import demo as demo_command
from tui.commands import doctor, import_, validate

FILE = load_vehicle("ruvifist")
REASON = (
    "the dive says too little of it, and this sentence is as long as the longest of them all, or longer yet"
)


@pytest.fixture(autouse=True)
def _narrow(monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")


@pytest.fixture
def printed(capsys):
    """What was printed, after checking that none of it is wider than 80 or cut."""

    def read():
        out = capsys.readouterr().out
        assert "…" not in out
        assert max(map(len, out.splitlines())) <= 80, out
        return out

    return read


def cells(out):
    """The lines with one blank between cells."""
    return [" ".join(line.split()) for line in out.splitlines()]


def identification(configuration="hovering"):
    """Every coefficient with as many digits as there can be; those of roll can't be told."""
    totals = tuple(
        estimate(c.name, 1234.5678, 98.7654, 1000.1234, 1500.9876, REASON if c.dof == 3 else "")
        for c in COEFFICIENTS
    )
    totals = tuple(replace(t, partner=Partner("M_v", -0.87), share_from_prior=1.0) for t in totals)
    shape = FILE.vehicle.configurations[configuration]
    return Identification(
        "likelihood", Outcome.DISAGREES, (*totals, *(added_mass(t, shape) for t in totals[: len(MASSES)])),
        configuration, "2026-11-20T0912Z-hovering", "0" * 64, "ruvifist", FILE.sha256, 806.0, 1000, notes=(REASON,),
    )  # fmt: skip


def dive(**signals):
    return Dive(name="2026-11-20T0912Z-hovering", source=Path("a"), sha256="0", **signals)


def campaign(configuration):
    truth = {c.name: 1234.0 for c in COEFFICIENTS}
    return demo.Campaign(configuration, Path("a"), dive(), identification(configuration), truth)


def receipt(root):
    return Receipt(
        Applied.APPLIED, "24 written", 1, 1, (), root / "before.param", 7, "2026-11-20T09:12:00Z", 1.0
    )


def rows(runs):
    return [
        Row(axis, phase, unit, tuple(0.1234567 for _ in range(runs)))
        for axis, unit in (("surge", "m/s"), ("sway", "m/s"), ("yaw", "rad/s"))
        for phase in PHASES
    ]


def test_demo_shows_a_table_a_configuration_with_units_beside_the_names(printed):
    done = demo.Demo(FILE, tuple(map(campaign, demo.CAMPAIGNS)), receipt(Path("a")), {})
    for shown in demo_command.identified_tables(done):
        show.put(show.results(), shown)
    out = printed()
    assert cells(out).count("D_r, N m/(rad/s) 1235 1000 to 1501 1234 inside") == len(demo.CAMPAIGNS)
    assert all(f"{configuration}: identified" in out for configuration in demo.CAMPAIGNS)


def test_demo_shows_tracking_errors_beside_the_papers(printed):
    show.put(show.results(), demo_command.tracking_table(list(demo.MODES), rows(3)))
    out = printed()
    assert [line.split() for line in out.splitlines() if line.startswith(("motion", "Surge"))] == [
        ["motion", "phase", "PID", "FF", "both", "paper"],
        ["Surge", "motion,", "m/s", "Acceleration", "0.1235", "0.1235", "0.1235", "0.0091"],
    ]


def test_identify(printed):
    answers.tell(show.results(), dive(), identification())
    out = printed()
    assert "D_r 1235 1000 1501 N m/(rad/s) 11 M_v -0.87 100 yes" in cells(out)


def test_an_error_in_the_table_is_the_one_that_the_reason_names(printed):
    """Where the likelihood falls slowly on one side, that side decides."""
    low, high = 15.5 * math.exp(-1.96 * 0.3), 15.5 * math.exp(1.96 * 0.74)
    reason = too_little("I_q", "pitch", 0.74, 0.0, 15.5, "")
    loose = estimate("I_q", 15.5, 0.18 * 15.5, low, high, reason)
    found = identification()
    others = tuple(replace(p, identifiable=True, reason="") for p in found.parameters if p.name != "I_q")
    answers.tell(show.results(), dive(), replace(found, parameters=(*others, loose)))
    out = printed()
    (row,) = [line for line in cells(out) if line.startswith("I_q")]
    assert " 74 " in row
    assert "1: the dive says too little of pitch: the relative standard error is 74 %" in out


def test_identify_with_a_second_method(printed):
    other = replace(identification(), method="pinn", parameters=tuple(
        replace(p, value=3 * p.value, low95=2 * p.value, high95=4 * p.value) for p in identification().parameters
    ))  # fmt: skip
    answers.tell_comparison(show.results(), compare(identification(), other))
    assert "D_r 1235 3704 N m/(rad/s) 14 disagree" in cells(printed())


def test_validate_of_every_mode(printed):
    speeds = tuple(SteadyError(speed, -0.1234567, 0.1234567, 9) for speed in (0.2, 0.5))
    axes = tuple(
        AxisErrors(axis, "rad/s", *(0.1234567,) * 10, speeds=speeds) for axis in ("surge", "sway", "yaw")
    )
    runs = dict.fromkeys(("PID", "shadow", "FF", "both"), TrackingErrors("a", axes))
    show.put(show.results(), validate.error_table(list(runs), rows(len(runs))))
    show.put(show.results(), validate._lags(runs))
    show.put(show.results(), validate.speed_table(runs))
    out = cells(printed())
    assert "yaw, rad/s Steady state 0.123 0.123 0.123 0.123" in out
    assert "yaw, rad/s 0.20 -0.1235 -0.1235 -0.1235 -0.1235" in out


def test_doctor(printed):
    findings = [fail("bottom lock", REASON), fail("thruster 8", REASON)]
    doctor.tell(argparse.Namespace(json=None), findings)
    assert " ".join(printed().split()).count(REASON) == 2


def test_import(monkeypatch, printed, tmp_path):
    time_s = np.arange(0.0, 10000.0, 0.01)
    held = dive(velocity=Signal(time_s, np.full((len(time_s), 3), np.nan)))
    held = replace(held, notes=(REASON,))
    monkeypatch.setattr("identify.ingest.open.read_dive", lambda *_: held)
    line = argparse.Namespace(file=str(tmp_path), out=None, vehicle=None, columns=None, json=None)
    import_.run(line)
    out = printed()
    assert "velocity 1000000 100 0 0 100" in cells(out)


def test_demo_leaves_in_its_folder_what_was_identified_uploaded_and_received(monkeypatch, tmp_path):
    monkeypatch.setattr(demo, "_campaigns", lambda *_: tuple(map(campaign, demo.CAMPAIGNS)))
    monkeypatch.setattr(demo, "_upload", lambda *_: receipt(tmp_path))
    monkeypatch.setattr(demo, "_validation", lambda *_: dive())
    demo.run(tmp_path, 1, 0.0, lambda *_: None)
    assert {path.name for path in tmp_path.iterdir()} == {
        f"{configuration}{ending}"
        for configuration in demo.CAMPAIGNS
        for ending in (".json", ".param", ".param.json")
    } | {"receipt.json"}
    assert "FF0_M_U,1234" in (tmp_path / "survey.param").read_text(encoding="utf-8")
