"""`validate --foretold`: where what was foretold is found, and the table of every axis."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bridge.exit_codes import UsageError
from bridge.vehicle.coefficients import AcceptedEffect
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.forecast import ForecastRow
from bridge.vehicle.mode import Mode
from gcs_plugin.params.files import write_parameters
from gcs_plugin.params.last_accepted import keep_accepted
from gcs_plugin.params.receipt import Line, Receipt
from gcs_plugin.params.sidecar import Sidecar, write_sidecar
from gcs_plugin.params.transfer import Outcome
from identify.dive import Dive, Signal
from identify.validation.against_forecast import began
from identify.validation.tracking import TrackingErrors, WholeError
from tui.commands.validate import foretellings, whole_table

FILE = load_vehicle("ruvifist")
ROW = ForecastRow("surge", "m/s", "both", "ff", 0.0133, 0.006, 0.18)
ABOUT = Sidecar(
    "ab", "cd", "hovering", "diagnose", "1", {}, "ruvifist", "lake", "converged", dived="2026-09-21T14:13:20Z",
    effects=(AcceptedEffect("weak_thruster", "weak thruster 1", {"gain": 0.8}, 1),), foretold=(ROW,),
)  # fmt: skip
FLAT = Signal(np.array([0.0, 1.0]), np.ones((2, 1)))
DIVE = Dive("d", Path("d"), "x", veh_cfg=FLAT)


def kept(path, about):
    write_parameters(path, {"FF1_M_U": 111.0})
    if about is not None:
        write_sidecar(path, about)
    return str(path)


def test_a_named_file_says_what_was_foretold_and_of_what(tmp_path):
    foretold = foretellings(kept(tmp_path / "mended.param", ABOUT), tmp_path, FILE)(
        DIVE, Mode.BOTH, "hovering"
    )
    of = (foretold.vehicle, foretold.configuration, foretold.dive, foretold.sha256)
    assert of == ("ruvifist", "hovering", "lake", "ab")
    assert (foretold.dived, foretold.effects, foretold.rows) == (ABOUT.dived, ("weak thruster 1",), (ROW,))


@pytest.mark.parametrize("about", [None, replace(ABOUT, foretold=())], ids=["no sidecar", "nothing foretold"])
def test_a_named_file_that_foretells_nothing_is_refused(tmp_path, about):
    path = kept(tmp_path / "plain.param", about)
    with pytest.raises(UsageError, match=r"foretells nothing; give the \.param that diagnose --accept wrote"):
        foretellings(path, tmp_path, FILE)


@pytest.mark.parametrize(
    "file",
    [replace(FILE, vehicle=replace(FILE.vehicle, name="another")), replace(FILE, configuration="survey")],
    ids=["vehicle", "configuration"],
)
def test_a_named_file_of_another_vehicle_or_configuration_is_refused_rather_than_passed_over(tmp_path, file):
    path = kept(tmp_path / "mended.param", ABOUT)
    with pytest.raises(
        UsageError, match="is of vehicle 'ruvifist', configuration 'hovering', so it foretells nothing"
    ):
        foretellings(path, tmp_path, file)


def test_a_named_file_that_is_not_there_is_said_so(tmp_path):
    with pytest.raises(UsageError, match=r"--foretold .*mended\.param: no such file; check the name"):
        foretellings(str(tmp_path / "mended.param"), tmp_path, FILE)


def test_without_a_name_and_without_receipts_nothing_was_foretold(tmp_path):
    assert foretellings(None, tmp_path / "receipts", FILE)(DIVE, Mode.BOTH, "hovering") is None


def test_a_dive_is_held_against_what_was_in_force_when_it_began_and_in_shadow_when_it_ended(tmp_path):
    preimage = tmp_path / "2026-09-21T141500Z-before.param"
    line = Line("FF1_M_U", 1.0, 111.0, 111.0, Outcome.APPLIED, "")
    receipt = Receipt(Outcome.APPLIED, "", 1, 1, (line,), preimage, None, "", 1.0, "", 1)
    keep_accepted(receipt, ABOUT, True)
    (tmp_path / "2026-09-21T141500Z-receipt.json").write_text(json.dumps(receipt.to_json()), "utf-8")
    foretold = foretellings(None, tmp_path, FILE)

    def dived(second: int) -> Dive:
        """A dive of 60 s that begins so many seconds after the upload."""
        flat = Signal(np.array([0.0, 60.0]), np.ones((2, 1)))
        return replace(DIVE, veh_cfg=flat, unix_at_boot_s=1_790_000_100.0 + second)

    assert began(dived(0)) == "2026-09-21T14:15:00Z"
    for second, both, shadow in ((-61, False, False), (-30, False, True), (1, True, True)):
        assert (foretold(dived(second), Mode.BOTH, "hovering") is not None) is both
        assert (foretold(dived(second), Mode.SHADOW, "hovering") is not None) is shadow
    assert foretold(dived(1), Mode.BOTH, "survey") is None
    # A vehicle's clock may be hours off: uploads are dated by this computer's, and so is its recording.
    behind = replace(dived(1), unix_at_boot_s=1_700_000_000.0, recorded_at_boot_s=1_790_000_101.0)
    assert foretold(behind, Mode.BOTH, "hovering") is not None
    ahead = replace(dived(1), recorded_at_boot_s=1_790_000_000.0)
    assert foretold(ahead, Mode.BOTH, "hovering") is None


def test_every_axis_has_a_row_for_the_whole_mission_while_others_move_and_at_rest():
    surge = WholeError("surge", "m/s", 0.0133, 0.18, 0.0161, 0.004, 0.001)
    yaw = WholeError("yaw", "rad/s", 0.0189, 0.07, float("nan"), 0.001, 0.0001)
    table = whole_table(
        {"ff": TrackingErrors("a", (), (surge, yaw)), "both": TrackingErrors("b", (), (surge,))}
    )
    assert table.rows == [
        ("surge", "whole mission", "13 mm/s", "13 mm/s"),
        ("surge", "while others move", "16 mm/s", "16 mm/s"),
        ("surge", "at rest", "4.0 mm/s", "4.0 mm/s"),
        ("yaw", "whole mission", "1.1 deg/s", "-"),
        ("yaw", "while others move", "-", "-"),
        ("yaw", "at rest", "0.057 deg/s", "-"),
    ]
    assert whole_table({"ff": TrackingErrors("a", ())}) is None
