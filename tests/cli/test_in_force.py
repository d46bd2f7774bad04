"""A diagnosis takes for accepted what was in force when its dive began, by the receipts, and says so."""

import json
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
from test_diagnose_command import D_U, DRAG, diagnosis
from uploaded import uploaded

from bridge.clock import SimulatedClock
from bridge.errors import ConfigError, LogError
from bridge.exit_codes import UsageError
from bridge.vehicle.coefficients import AcceptedEffect
from bridge.vehicle.config import load_vehicle
from gcs_plugin.mavproxy import work
from gcs_plugin.params.sidecar import Interval, Sidecar, sidecar_path
from identify.diagnose.causes.candidates import Cause
from identify.diagnose.result import Accepted, Value
from identify.diagnose.words.causes import SINCE
from identify.diagnose.words.diagnosis import cause_lines, next_lines
from identify.dive import Dive, Signal
from identify.effects.actuators import COMMAND_DELAY
from identify.effects.environment import STEADY_CURRENT
from identify.run.diagnose import Before
from identify.run.in_force import read_in_force
from tui.accept_diagnosis import accept, before_of
from tui.parameter_files import Leave

FILE = load_vehicle("ruvifist")
SHAPE = FILE.vehicle.configurations["hovering"]
WEAK = AcceptedEffect("weak_thruster", "weak_thruster of thruster 1", {"gain": 0.8}, 1)
MODEL = Sidecar(
    "ab", "cd", "hovering", "diagnose", "1",
    {"FF1_M_U": Interval("M_u", "kg", 100.0, 121.0), "FF1_D_U": Interval("D_u", "N/(m/s)", 40.0, 60.0)},
    "ruvifist", "lake", "converged", dived="2026-09-21T14:00:00Z", effects=(WEAK,), doubted={"D_u": "too slow"},
)  # fmt: skip
TIME, UPLOAD_S = "2026-09-21T141500Z", 1_790_000_100.0
SAID = "In force since 2026-09-21 14:15 UTC by the receipts, and taken as accepted: weak thruster 1; --accepted none"


def dived(unix_s: float | None) -> Dive:
    return Dive(
        "d", Path("d"), "x", depth=Signal(np.array([0.0, 60.0]), np.ones((2, 1))), unix_at_boot_s=unix_s
    )


AFTER, EARLIER = dived(UPLOAD_S + 60), dived(UPLOAD_S - 60)


def before(dive: Dive, accepted: str | None = None) -> Before:
    return before_of(accepted, dive, FILE, "hovering", Leave())


def test_what_was_in_force_when_the_dive_began_is_accepted_and_told_with_the_way_to_leave_it_out(
    tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    assert before(AFTER) == Before()
    uploaded(tmp_path / "receipts", TIME, MODEL, FF1_M_U=110.0, FF1_D_U=50.0)
    taken = before(AFTER)
    assert taken.effects == (WEAK,)
    # The interval's middle on a logarithmic scale; what is doubted is not held against the dive.
    assert {name: prior.value for name, prior in taken.values.items()} == {"M_u": pytest.approx(110.0)}
    assert taken.notes[0].startswith(SAID)
    assert taken.notes[1] == "Of what is in force, D_u is doubted, and not held against this dive."
    assert before(AFTER, "receipts") == taken
    assert before(AFTER, "none") == Before()
    with pytest.raises(UsageError):
        before(AFTER, "no.param")


def test_what_came_later_was_rolled_back_has_no_causes_or_is_of_another_vehicle_is_not_taken(tmp_path):
    folder = str(tmp_path)
    uploaded(tmp_path, TIME, MODEL)
    assert before(EARLIER, folder) == Before()
    assert before(dived(None), folder) == Before()  # nobody knows when
    another = replace(FILE, vehicle=replace(FILE.vehicle, name="another"))
    assert before_of(folder, AFTER, another, "hovering", Leave()) == Before()
    assert before_of(folder, AFTER, FILE, "survey", Leave()) == Before()
    uploaded(tmp_path, "2026-09-21T141530Z", replace(MODEL, effects=(), method="likelihood"))
    assert before(AFTER, folder) == Before()
    assert before(dived(UPLOAD_S + 10), folder).effects == (WEAK,)


def test_a_set_in_which_all_is_doubted_is_flown_all_the_same(tmp_path):
    uploaded(tmp_path, TIME, replace(MODEL, outcome="disagrees", doubted={"M_u": "x", "D_u": "y"}))
    taken = before(AFTER, str(tmp_path))
    assert (taken.effects, taken.values) == ((WEAK,), None)


def test_mavproxys_diagnosis_reads_the_same_from_the_sidecars_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    preimage = uploaded(tmp_path / "receipts", TIME, MODEL)
    sidecar = sidecar_path(preimage.with_name(f"{TIME}-accepted.param"))
    assert read_in_force(sidecar, "2026-09-21T14:15:00Z", SHAPE, "hovering") == before(AFTER)
    assert read_in_force(sidecar, "2026-09-21T14:15:00Z", SHAPE, "survey") == Before()
    began: list[list[str]] = []
    monkeypatch.setattr(work, "Job", lambda _title, words, _now_s: began.append(words))
    for name, more in (
        ("2026-09-21T1416Z", []),
        ("2026-09-21T1414Z", []),
        ("2026-09-21T1416Z", ["--accepted", "none"]),
    ):
        (tmp_path / name).mkdir(exist_ok=True)
        ground = work.Work(SimulatedClock(), lambda _: None)
        ground.begin("diagnose", Path(name), more, "ruvifist:hovering")
    later, earlier, none = began
    assert later[later.index("--in-force") :][:4] == [
        "--in-force", str(sidecar.relative_to(tmp_path)), "--since", "2026-09-21T14:15:00Z",
    ]  # fmt: skip
    assert "--in-force" not in earlier + none
    with pytest.raises(ConfigError, match=r"here a folder of receipts, or none"):
        work.Work(SimulatedClock(), lambda _: None).begin(
            "diagnose", Path(later[3]), ["--accepted", "gap.param"], "ruvifist"
        )


@pytest.mark.parametrize("damage", ["", "[]", "{}", '{"effects": [{}], "configuration": "hovering"}'])
def test_a_damaged_sidecar_is_refused_or_holds_no_cause(tmp_path, damage):
    sidecar = tmp_path / "a.param.json"
    sidecar.write_text(damage, encoding="utf-8")
    if damage == "{}":
        assert read_in_force(sidecar, "", SHAPE, "hovering") == Before()
        return
    with pytest.raises((LogError, ConfigError)):
        read_in_force(sidecar, "", SHAPE, "hovering")
    sidecar.write_text(json.dumps(asdict(MODEL) | {"intervals": 3}), encoding="utf-8")
    with pytest.raises(ConfigError, match="no sidecar"):
        read_in_force(sidecar, "", SHAPE, "hovering")


def test_where_nothing_differs_from_what_was_accepted_nothing_is_written_to_accept(tmp_path):
    again = diagnosis(verdict="no_gap", accepted=Accepted(D_U, (WEAK,), ()))
    (said,) = accept(tmp_path / "x.param", again, AFTER, FILE)
    assert said.endswith("was not written: nothing differs from what was accepted before.")
    assert not (tmp_path / "x.param").exists()


def test_of_a_change_of_what_was_accepted_the_way_out_is_told():
    changed = replace(DRAG, cause=Cause(replace(DRAG.cause.effect, variant=SINCE), DRAG.cause.values))
    whole = Accepted({}, (AcceptedEffect("quadratic_drag", "quadratic drag", {"X_uu": 40.0}),), ())
    (line,) = next_lines(diagnosis(changed, accepted=whole))
    assert line == (
        "A change of quadratic drag, to X_uu 40.0: the vehicle makes up for it as it was. Accept and "
        "upload the new value, or roll back (seatrial params rollback)."
    )
    late, current = (
        replace(DRAG, cause=Cause(replace(effect, variant=SINCE), effect.start()))
        for effect in (COMMAND_DELAY, STEADY_CURRENT)
    )
    assert next_lines(diagnosis(late)) == (
        "A change of command delay: the model has it as it was. Accept the new value.",
    )
    assert next_lines(diagnosis(current)) == ()
    sized = {"X_uu": Value(12.0, "N s2/m2", 10.0, 14.0)}
    (cause,) = cause_lines(diagnosis(replace(changed, parameters=sized)))
    assert cause.endswith("Fitted: change of X_uu 12.0 N s²/m² (95 %: 10.0 to 14.0).")
    (cause,) = cause_lines(diagnosis(replace(DRAG, parameters=sized)))
    assert cause.endswith("Fitted: X_uu 12.0 N s²/m² (95 %: 10.0 to 14.0).")
    assert next_lines(diagnosis(DRAG)) == ()
    assert next_lines(diagnosis(replace(changed, probability=0.4))) == ()
