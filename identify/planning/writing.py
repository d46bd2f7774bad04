"""Writes a proposal as instructions for a crew, as a mission for `seatrial simulate`, and as plain data."""

import json
import math
import textwrap
from collections.abc import Sequence
from typing import Any

import numpy as np

from bridge.vehicle.coefficients import COEFFICIENTS, DOFS
from bridge.vehicle.legs import Leg
from identify.planning.knowledge import NAMES, Knowledge
from identify.planning.limits import REST_S, START_DEPTH_M, Limits, Tank
from identify.planning.manoeuvres import WAYS, Manoeuvre
from identify.planning.propose import Part, Proposal
from identify.statistics import Z95

NOTABLE_M = 0.05
NO_ROOM = "stays in place"
DOUBT_MARK = "*"
DOUBT = "That dive's doubt:"
TITLE = "# Plan for"
GUESSED = (
    "What no prior and no dive has told firmly is planned with a guessed value: it has no interval around it, only how "
    "sharply, in per cent, the dive would find the true one."
)

ADVICE = (
    "Surge and sway are pushed open loop, as a stick does in ArduSub's ALT_HOLD or a force added to the controller's "
    "output; heave and yaw are asked for as rates, so that the controller keeps depth and heading. A current or an "
    "uneven trim carries a vehicle off that is pushed: leave more room for that, and end a manoeuvre early if need be. "
    "The room of each manoeuvre holds a reserve for drift by small disturbances, from where it begins: before each, "
    "bring the vehicle back to the middle.",
    "The intervals hold given the vehicle file's thrust: where all of it is off by one share, so are all masses and "
    "dampings, and no manoeuvre shows it. They hold for a vehicle as its file has it, with linear damping, or with "
    "quadratic beside it where the file says so.",
)


def needs(part: Part) -> str:
    """Room that a manoeuvre takes, in words; NO_ROOM if it takes none."""
    rooms = []
    if part.needs_m > NOTABLE_M:
        rooms.append(f"{_up(part.needs_m)} m across")
    if part.trial.depth_m > NOTABLE_M:
        rooms.append(f"{_up(part.trial.depth_m)} m up and down")
    return " and ".join(rooms) or NO_ROOM


def instruction(part: Part) -> str:
    room = needs(part)
    return f"{part.manoeuvre.sentence}, {room if room == NO_ROOM else f'needs {room}'}"


def pulses(manoeuvre: Manoeuvre, tank: Tank) -> str:
    """Pulse widths of a push, for pilots who command thrusters by pulse width; empty for a rate."""
    wrench = [0.0] * 6
    for drive, amplitude in zip(manoeuvre.drives, manoeuvre.amplitudes, strict=True):
        if drive.key.startswith("push"):
            wrench[drive.dof] = amplitude
    if not any(wrench):
        return ""
    widths, rest_us = [], tank.file.vehicle.thrust_curve.neutral_us
    for i, way in enumerate((1.0, -1.0)):
        direction = " and ".join(WAYS[dof][i] for dof in manoeuvre.dofs)
        widths.append(f"{direction}: {_grouped(tank.pulses([way * w for w in wrench]), rest_us)}")
    return "; ".join(widths)


def interval(name: str, relative_std: float, knowledge: Knowledge) -> dict[str, float]:
    """Relative standard error and 95 % interval of a coefficient, from the standard deviation of its logarithm.

    NaN if unknown. A guessed value has no interval around it, because the true value lies elsewhere.
    """
    if not math.isfinite(relative_std):
        return dict.fromkeys(("relative_std", "low95", "high95"), math.nan)
    if name in knowledge.guessed:
        return {"relative_std": relative_std, "low95": math.nan, "high95": math.nan}
    value = knowledge.values[name]
    low, high = value * np.exp(-Z95 * relative_std), value * np.exp(Z95 * relative_std)
    return {"relative_std": relative_std, "low95": float(low), "high95": float(high)}


def notes(knowledge: Knowledge) -> tuple[str, ...]:
    doubts = tuple(f"{DOUBT} {sentence}" for sentence in knowledge.doubts)
    return (*doubts, *knowledge.sentences, *((GUESSED,) if knowledge.guessed else ()), *ADVICE)


def legend(proposal: Proposal, knowledge: Knowledge) -> tuple[str, ...]:
    """Meaning of DOUBT_MARK at promised coefficients, and the doubts behind it; empty if no coefficient is marked."""
    marked = [
        name
        for name, after in zip(NAMES, proposal.after, strict=True)
        if name in knowledge.doubted and math.isfinite(after)
    ]
    if not marked:
        return ()
    reasons = dict.fromkeys(sentence for name in marked for sentence in knowledge.doubted[name])
    return (
        f"{DOUBT_MARK}: the dive before is in doubt here: what is promised of {', '.join(marked)} holds only if "
        "the cause of that doubt is mended.",
        *(f"{DOUBT} {sentence}" for sentence in reasons),
    )


def mission_text(proposal: Proposal, title: str, command: str, tank: Tank) -> str:
    """YAML of a mission, with the crew's instructions as comments; `command` dives it in simulation, "" for none."""
    lines = [f"{TITLE} {title}", *([f"# Dive it in simulation: {command}"] if command else []), "#"]
    lines += [f"# {line}" for sentence in ADVICE for line in _broken(sentence)]
    vehicle = json.dumps(f"{tank.file.vehicle.name}:{tank.configuration_name}", ensure_ascii=False)
    lines += ["name: plan", f"vehicle: {vehicle}", f"start_depth_m: {START_DEPTH_M:g}", "legs:"]
    pause = "  " + Leg(REST_S, "rest", "rest").yaml_line()
    for number, part in enumerate(proposal.parts, start=1):
        lines += [pause, f"  # {number}. {instruction(part)}"]
        lines += [f"  #    {line}" for line in _broken(f"By hand: {part.manoeuvre.by_hand}.")]
        if at_thrusters := pulses(part.manoeuvre, tank):
            lines += [f"  #    {line}" for line in _broken(f"Pulse widths, us: {at_thrusters}.")]
        lines += ["  " + step.yaml_line() for step in part.manoeuvre.steps]
    return "\n".join([*lines, pause, ""])


def to_json(proposal: Proposal, tank: Tank, limits: Limits) -> dict[str, Any]:
    """Vehicle, configuration and proposal as plain data, with NaN for missing numbers."""
    file, knowledge = tank.file, tank.knowledge
    return {
        "vehicle": {"name": file.vehicle.name, "sha256": file.sha256},
        "configuration": tank.configuration_name,
        "duration_s": proposal.duration_s,
        "limits": {**vars(limits), "depth_space_m": limits.heave_m},
        "manoeuvres": [
            {
                "kind": part.manoeuvre.kind,
                "drives": [
                    {"axis": DOFS[drive.dof], "mission_key": drive.key, "amplitude": amplitude, "unit": drive.unit}
                    for drive, amplitude in zip(
                        part.manoeuvre.drives, part.manoeuvre.amplitudes, strict=True
                    )
                ],
                "period_s": part.manoeuvre.period_s,
                "seconds": part.manoeuvre.duration_s,
                "needs_m": part.needs_m,
                "needs_depth_m": part.trial.depth_m,
                "instruction": instruction(part),
                "by_hand": part.manoeuvre.by_hand,
            }
            for part in proposal.parts
        ],
        "parameters": [
            {
                "name": coefficient.name,
                "symbol": coefficient.symbol,
                "unit": coefficient.unit,
                "value": knowledge.values[coefficient.name],
                "guessed": coefficient.name in knowledge.guessed,
                "doubted": coefficient.name in knowledge.doubted,
                "before": interval(coefficient.name, float(before), knowledge),
                "alone": interval(coefficient.name, float(alone), knowledge),
                "after": interval(coefficient.name, float(after), knowledge),
            }
            for coefficient, before, alone, after in zip(
                COEFFICIENTS, proposal.before, proposal.alone, proposal.after, strict=True
            )
        ],
        "notes": list(notes(knowledge)),
    }  # fmt: skip


def _grouped(widths_us: Sequence[float], rest_us: float) -> str:
    groups: dict[int, list[str]] = {}
    for number, width in enumerate(widths_us, start=1):
        if abs(width - rest_us) >= 1:
            groups.setdefault(round(width), []).append(str(number))
    return ", ".join(f"{width} on {' '.join(numbers)}" for width, numbers in sorted(groups.items()))


def _up(metres: float) -> str:
    """Round up to a decimetre."""
    return f"{math.ceil(10 * metres - 1e-9) / 10:.1f}"


def _broken(sentence: str) -> list[str]:
    return textwrap.wrap(sentence, 110)
