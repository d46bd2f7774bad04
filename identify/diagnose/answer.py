"""A diagnosis as plain data, in the form of the answers' schema, version 2."""

import math
from typing import Any

from identify.diagnose.result import AxisShrink, Diagnosis, Found, Gap, Shrink


def plain(diagnosis: Diagnosis) -> dict[str, Any]:
    """The answer; None for absent parts."""
    character, next_dive = diagnosis.character, diagnosis.next
    return {
        "verdict": diagnosis.verdict,
        "gap": _gap(diagnosis.gap),
        "effects": [_effect(found) for found in diagnosis.found],
        "character": None
        if character is None
        else {
            "dof": list(character.dof),
            "frame": character.frame,
            "parity": character.parity,
            "timing": character.timing,
            "depends_on": list(character.depends_on),
        },
        "shrink": {"heldout": _heldout(diagnosis.heldout), "check": _check(diagnosis.check)},
        "next": None
        if next_dive is None
        else {
            "manoeuvre": "; ".join(next_dive.manoeuvres) or None,
            "sensor": "; ".join(next_dive.sensors) or None,
            "splits": list(next_dive.splits),
        },
    }


def _gap(gap: Gap) -> dict[str, Any]:
    return {
        "before": gap.before,
        "floor": 1,
        "force": {dof: _number(force) for dof, force in gap.force.items()},
        "where": [{"dof": part.dof, "phase": part.phase, "share": part.share} for part in gap.where],
        "depends_on": [
            {"dof": part.dof, "variable": part.variable, "parity": part.parity, "strength": part.strength}
            for part in gap.depends_on
        ],
        "unexplained": _number(gap.unexplained),
        "disturbance": {part.dof: _number(part.share) for part in gap.disturbance},
    }


def _effect(one: Found) -> dict[str, Any]:
    gain = one.feedforward
    return {
        "name": one.name,
        "also": list(one.also),
        "likeness": one.likeness,
        "probability": one.probability,
        "parameters": {
            name: {
                "value": value.value,
                "unit": value.unit,
                "low95": _number(value.low95),
                "high95": _number(value.high95),
            }
            for name, value in one.parameters.items()
        },
        "feedforward_gain": None if gain is None else {"before": gain.before_m_s, "after": gain.after_m_s},
    }


def _heldout(one: Shrink | None) -> dict[str, Any] | None:
    if one is None:
        return None
    return {"value": _number(one.value), "low95": _number(one.low95), "high95": _number(one.high95)}


def _check(one: Shrink | None) -> dict[str, Any] | None:
    if one is None:
        return None
    return {
        "before": _number(one.before),
        "after": _number(one.after),
        "floor": _number(one.floor),
        "value": _number(one.value),
        "by_axis": by_axis(one),
    }


def by_axis(one: Shrink) -> dict[str, dict[str, float | None]]:
    """The shrink of each degree of freedom; drifts in m/s or rad/s."""
    return {axis.dof: _axis(axis) for axis in one.by_axis}


def _axis(one: AxisShrink) -> dict[str, float | None]:
    return {
        "before": _number(one.before),
        "after": _number(one.after),
        "floor": _number(one.floor),
        "nrmse_before": _number(one.nrmse_before),
        "nrmse_after": _number(one.nrmse_after),
        "nrmse_baseline": _number(one.nrmse_baseline),
    }


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None
