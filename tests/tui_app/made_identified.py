"""A made identification as `seatrial identify --json` writes it, and what was told on the way."""

import json
import os
from pathlib import Path

from made_view import UNIX_S

from bridge.reports import Report
from bridge.vehicle.coefficients import COEFFICIENTS
from gcs_plugin.params.files import write_parameters
from tui.app.screens.identify import words_for
from tui.dive_list import results_beside

VALUES = dict(
    zip(
        [c.name for c in COEFFICIENTS],
        (111.7, 112.1, 135.4, 4.767, 16.61, 16.06, 56.42, 52.82, 98.61, 16.02, 29.71, 26.0),
        strict=True,
    )
)
REASON = "M_qdot is I_q less the rigid body's own 9.5 kg m2: the 7.11 that is left has a standard error of 3"
DOUBT = "Surge's thrust follows the waves unseen: record RPM, or take D_u from a dive in calm water."


def parameters(missing=("I_q",)):
    made = []
    for c in COEFFICIENTS:
        value = VALUES[c.name]
        known = {"name": c.name, "unit": c.unit, "value": value, "identifiable": c.name not in missing}
        interval = {"low95": 0.82 * value, "high95": 1.21 * value}
        interval |= {"given_thrust_low95": 0.97 * value, "given_thrust_high95": 1.03 * value}
        made.append(known | interval | ({"reason": REASON} if c.name in missing else {}))
    return made


def identified(**changed):
    return {
        "method": "likelihood",
        "outcome": "converged",
        "parameters": parameters(),
        "configuration": "hovering",
        "dive": {"name": "2026-11-21T0352Z-hovering"},
        "null_directions": [],
        "thrust_scale": {"sentence": "The intervals include what the thrust may be off by."},
        "doubts": [],
        "notes": ["The DVL had no bottom lock in 1 % of its samples."],
        "comparison": {
            "method": "pinn",
            "outcome": "converged",
            "sentences": ["Likelihood and pinn agree in all 11 parameters that both identify."],
        },
    } | changed


def passes(count=3):
    """What both methods tell, `count` passes of the second."""
    reports = [Report("likelihood", 0.3875, "fitting all axes together")]
    for n in range(1, count + 1):
        values = {name: (value * (1 + 0.2 / 4**n), 0.1 * value / n) for name, value in VALUES.items()}
        reports.append(Report("pinn", n / (n + 8), f"pass {n}", values=values))
    return tuple(reports)


def answer(method="likelihood"):
    """What a method tells once it is done."""
    values = {name: (value, 0.03 * value) for name, value in VALUES.items()}
    return Report(method, 1.0, "answered", values=values, answered=True)


PAGE = Report("page", 0.25, "writing the page")


def leave(words, result=None):
    """Write what the verb writes, where its words want it."""
    words = list(words)
    if words[0] == "identify":
        at = {option: Path(words[words.index(option) + 1]) for option in ("--json", "--param")}
        at["--json"].write_text(json.dumps(result or identified()), encoding="utf-8")
        ids = {c.parameter_id(0): VALUES[c.name] for c in COEFFICIENTS}
        write_parameters(at["--param"], ids, ("made",))


def dive_in(folder):
    """A dive's folder, with a recording in which is nothing."""
    dive = folder / "dives" / "2026-11-21T0352Z-hovering"
    dive.mkdir(parents=True)
    (dive / "telemetry.tlog").write_bytes(b"")
    return dive


def identified_dive(dive):
    """The dive, with an identification of a fixed time beside it."""
    leave(words_for(str(dive), "", results_beside(dive)))
    for path in results_beside(dive).values():
        if path.exists():
            os.utime(path, (UNIX_S, UNIX_S))
    return dive
