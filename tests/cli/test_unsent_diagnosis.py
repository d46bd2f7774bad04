"""A diagnosis that was accepted into a file and never uploaded is told where its causes are flown once more."""

from dataclasses import replace
from pathlib import Path

import pytest
from test_in_force import AFTER, EARLIER, FILE, MODEL, TIME
from uploaded import uploaded

from gcs_plugin.params.files import write_parameters
from gcs_plugin.params.sidecar import Sidecar, write_sidecar
from identify.dive import Dive
from tui.commands.validate import send_first

FOUND = replace(MODEL, dived="2026-09-21T14:14:30Z")
"""Of a dive between EARLIER and AFTER."""
SAID = (
    "by the receipts, what makes up for weak thruster 1 was never sent: upload it (seatrial params upload gap.param, "
    "in the app Parameters), or diagnose this dive"
)


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def kept(path: str, model: Sidecar) -> None:
    Path(path).parent.mkdir(parents=True, exist_ok=True)
    write_parameters(Path(path), {"FF1_M_U": 111.0})
    write_sidecar(Path(path), model)


def said(dive: Dive) -> str:
    return send_first(Path("receipts"), FILE, dive, "hovering")


def test_what_was_accepted_and_never_sent_is_named_with_the_way_to_send_it():
    assert said(AFTER) == ""
    kept("gap.param", FOUND)
    assert said(AFTER) == SAID
    assert said(EARLIER) == ""  # it was diagnosed later
    assert said(replace(AFTER, sha256="ab")) == ""  # the dive that was diagnosed


@pytest.mark.parametrize("stands", [True, False])
def test_what_the_app_left_beside_another_dive_is_named_where_its_diagnosis_stands(monkeypatch, stands):
    monkeypatch.setattr(
        "tui.unsent_diagnosis.is_acceptable", lambda dive: stands and dive.name == "2026-09-21T1414Z"
    )
    kept("out/2026-09-21T1414Z/diagnosed.param", FOUND)
    dive = replace(AFTER, source=Path("out/2026-09-21T1416Z/telemetry.tlog"))
    assert ("params upload out/2026-09-21T1414Z/diagnosed.param, in the app" in said(dive)) is stands


@pytest.mark.parametrize(
    "other", [{"effects": ()}, {"vehicle": "another"}, {"configuration": "survey"}], ids=str
)
def test_a_model_without_causes_or_of_another_vehicle_is_not(other):
    kept("gap.param", replace(FOUND, **other))
    assert said(AFTER) == ""


def test_nor_is_what_was_sent_at_any_time_nor_a_file_that_can_t_be_read():
    kept("gap.param", FOUND)
    uploaded(Path("receipts"), "2026-09-21T150000Z", FOUND)
    assert said(AFTER) == ""
    Path("other.param.json").write_text("{", encoding="utf-8")
    Path("other.param").touch()
    assert said(AFTER) == ""


def test_nor_where_causes_were_in_force():
    kept("gap.param", replace(FOUND, dive_sha256="ef"))
    assert said(AFTER) == SAID
    uploaded(Path("receipts"), TIME, MODEL)
    assert said(AFTER) == ""
