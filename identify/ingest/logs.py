"""An autopilot's own log beside the telemetry of a dive: what was not heard is taken from it, on the telemetry's clock.

What was heard stays as it is. The log fills a signal that lacks, and the holes of one that came more rarely than the
autopilot logged it, where both agree on what both have.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from bridge.clock_line import ClockLine
from bridge.errors import LogError
from identify.dive import Signal
from identify.ingest.dataflash import read_log
from identify.ingest.frames import load_frames
from identify.ingest.messages import vehicle_runs, vehicle_system
from identify.ingest.same_clock import UNTOLD, match

ENDING: Final = ".bin"
ARDUPILOT: Final = 3
SYSTEM_NAMES: Final = ("SYSID_THISMAV", "MAV_SYSID")
"""The parameter with the autopilot's system id, before version 4.7 and since."""
SAME_S: Final = 0.2
"""By how much two times of one clock may seem to differ: messages are dated when they are sent."""
APART: Final = 0.3
"""Median difference of two that agree, over the standard deviation of what was heard."""

WORDS: Final = {
    "velocity": "velocity", "gyro": "rates of turn", "specific_force": "acceleration", "attitude": "attitude",
    "depth": "depth", "altitude": "altitude", "pwm": "thruster commands", "voltage": "voltage", "armed": "arming",
    "gnss": "position",
}  # fmt: skip
WHOLE_ONLY: Final = ("armed", "gnss")
"""Taken where nothing of it was heard, never filled up."""


def logs_beside(folder: Path) -> list[Path]:
    """The autopilot's logs in a dive folder, but for a recording that is the dive's own; by name."""
    found = (file for file in folder.iterdir() if file.suffix.lower() == ENDING and file.is_file())
    return sorted(file for file in found if not file.name.startswith("telemetry"))


def with_logs(fields: dict[str, Any], heard: Sequence[Path], logs: Sequence[Path]) -> dict[str, Any]:
    """The fields of a dive, from the recordings `heard`, filled up from logs; one that is of no use is left out.

    What each gave, or why it gave nothing, is told in the notes.
    """
    for log in logs:
        try:
            fields = merged(fields, heard, log)
        except LogError as error:
            reason = str(error).removeprefix(f"{log}: ")
            fields = fields | {"notes": (*fields["notes"], f"{log.name} is left out: {reason}.")}
    return fields


def merged(fields: dict[str, Any], heard: Sequence[Path], log: Path) -> dict[str, Any]:
    """The fields of a dive, filled up from one log, with a note of it. Raises LogError where that can't be."""
    theirs, parameters = read_log(log)
    try:
        line, known = _clock(fields, theirs, parameters, heard)
    except LogError as error:
        raise LogError(f"{log}: {error}") from None
    start_s, end_s = _span(fields)
    moved = {
        name: Signal(line.here_s(signal.time_s), signal.value).between(start_s, end_s)
        for name, signal in theirs.items()
        if isinstance(signal, Signal)
    }
    first_s, last_s = line.here_s(np.array(_span(theirs)))
    beyond_s = max(0.0, min(start_s, last_s) - first_s) + max(0.0, last_s - max(end_s, first_s))
    return _filled(fields, moved, theirs, f"{log.name} is merged: {known}.", beyond_s)


def _clock(
    fields: dict[str, Any], theirs: dict[str, Any], parameters: dict[str, float], heard: Sequence[Path]
) -> tuple[ClockLine, str]:
    """The log's clock against the telemetry's, and what is known of it in words. Raises LogError."""
    system, dated_by_autopilot = _vehicle(heard)
    own = next((parameters[name] for name in SYSTEM_NAMES if name in parameters), None)
    if own is not None and own != system:
        raise LogError(
            f"it is of system {own:.0f}, and the dive of system {system}: check that it is this vehicle's"
        )
    found = match(fields, theirs)
    line, span_s = found.line, _span(fields)
    if not dated_by_autopilot:
        return line, f"its clock {line.words(*span_s)}"
    if abs(line.offset_s) > SAME_S + found.within_s:
        raise LogError(
            f"it lies {abs(line.offset_s):.1f} s off the times that the same autopilot told: it is of another boot"
        )
    return ClockLine(line.at_s, 0.0, 0.0, 0.0, 0.0), "the autopilot dated its telemetry by the same clock"


def _vehicle(heard: Sequence[Path]) -> tuple[int, bool]:
    """The system of the vehicle in recordings, and whether its boot time is the autopilot's own. Raises LogError."""
    frames = load_frames(heard)
    system, _ = vehicle_system(frames, str(heard[0]))
    run = vehicle_runs(frames, str(heard[0]))[0]
    beat = run.get("HEARTBEAT", autopilot=ARDUPILOT)
    if beat is None:
        return system, False
    return system, bool((frames.component[beat.fields.rows] == run.primary).all())


def _span(fields: dict[str, Any]) -> tuple[float, float]:
    """First and last time of all signals."""
    times = [one.time_s for one in fields.values() if isinstance(one, Signal) and len(one)]
    if not times:
        raise LogError(f"{UNTOLD}: the telemetry holds no signal")
    return min(float(one[0]) for one in times), max(float(one[-1]) for one in times)


def _filled(
    fields: dict[str, Any], moved: dict[str, Signal], theirs: dict[str, Any], note: str, beyond_s: float
) -> dict[str, Any]:
    out, brings, fills, differ = dict(fields), [], [], []
    for name, words in WORDS.items():
        other, own = moved.get(name), fields.get(name)
        if other is None or len(other) == 0 or (name == "depth" and "pressure" in fields and own is None):
            continue
        if own is None or len(own) == 0:
            out[name] = other
            brings.append(words)
            if name == "velocity":
                out["velocity_is_filtered"] = theirs["velocity_is_filtered"]
            continue
        other_kind = name == "velocity" and fields["velocity_is_filtered"] != theirs["velocity_is_filtered"]
        if name in WHOLE_ONLY or other_kind:
            continue
        holes = in_holes(own, other)
        if not holes.any():
            continue
        alike = _as_own(name, own, other)
        if alike is None:
            differ.append(words)
            continue
        new = Signal(alike.time_s[holes], alike.value[holes])
        out[name] = _together(own, new)
        fills.append(f"{words} ({len(new)} readings)")
    told = [note]
    if brings:
        told.append(f"It brings {_listed(brings)}.")
    if fills:
        told.append(f"It fills up {_listed(fills)}.")
    if not brings and not fills:
        told.append("It holds nothing that was not heard.")
    if differ:
        told.append(f"Left out, for differing from what was heard: {_listed(differ)}.")
    if beyond_s >= 1.0:
        told.append(f"{beyond_s:.0f} s of it lie before or after what was heard, and are left out.")
    return out | {"notes": (*fields["notes"], " ".join(told))}


def in_holes(own: Signal, other: Signal) -> NDArray[np.bool_]:
    """Which readings (n,) of `other` lie where nothing was heard: between two of `own` that are more than two of the
    other's steps apart, or before the first or after the last, and no nearer to one than half a step."""
    step_s = 1.0 / other.rate_hz if other.rate_hz else np.inf
    after = np.searchsorted(own.time_s, other.time_s)
    edges_s = np.concatenate(([-np.inf], own.time_s, [np.inf]))
    before_s, after_s = edges_s[after], edges_s[after + 1]
    near_s = np.minimum(other.time_s - before_s, after_s - other.time_s)
    return np.asarray((after_s - before_s > 2 * step_s) & (near_s > step_s / 2))


def _as_own(name: str, own: Signal, other: Signal) -> Signal | None:
    """`other` in the columns of `own`; None where they do not agree on what both have.

    Outputs beyond those that were logged keep the command that was heard last.
    """
    value = other.value
    width = own.value.shape[1]
    if name == "pwm" and value.shape[1] < width:
        value = np.column_stack((value, own.held_at(other.time_s)[:, value.shape[1] :]))
    value = value[:, :width]
    if name == "attitude":
        value = np.where((value * own.at(other.time_s)).sum(axis=1, keepdims=True) < 0, -value, value)
    alike = Signal(other.time_s, value)
    inside = own.between(other.time_s[0], np.nextafter(other.time_s[-1], np.inf))
    size = np.maximum(np.nanstd(inside.value, axis=0), 1e-6) if len(inside) else np.ones(width)
    apart = np.abs(alike.at(inside.time_s) - inside.value) / size
    apart = apart[np.isfinite(apart).all(axis=1)]
    if len(apart) == 0 or float(np.median(apart, axis=0).max()) > APART:
        return None
    return alike


def _together(own: Signal, new: Signal) -> Signal:
    time_s = np.concatenate((own.time_s, new.time_s))
    order = np.argsort(time_s, kind="stable")
    return Signal(time_s[order], np.concatenate((own.value, new.value))[order])


def _listed(words: Sequence[str]) -> str:
    return " and ".join(part for part in (", ".join(words[:-1]), words[-1]) if part)
