"""Adds an autopilot's own log to the telemetry of a dive, on the telemetry's clock.

Readings that were heard stay as they are. The log supplies missing signals, and fills holes in signals that it has more
often than they arrived, if log and telemetry agree on the readings that both have.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from bridge.errors import LogError
from bridge.firmware.ardusub import ARDUSUB
from bridge.wire.clock_line import ClockLine
from identify.dive import Signal
from identify.ingest.mavlink.dataflash import read_dataflash
from identify.ingest.mavlink.frames import load_frames
from identify.ingest.mavlink.messages import vehicle_runs, vehicle_system
from identify.ingest.mavlink.turns import UNRELATED, match
from identify.words import listed

ENDING: Final = ".bin"
SAME_S: Final = 0.2
"""Largest apparent difference between two times of the same clock: messages are dated when they are sent."""
APART: Final = 0.3
"""Largest median difference between two signals that agree, over the standard deviation of the heard signal."""

WORDS: Final = {
    "velocity": "velocity", "gyro": "rates of turn", "specific_force": "acceleration", "attitude": "attitude",
    "depth": "depth", "pressure": "pressure", "altitude": "altitude", "pwm": "thruster commands",
    "voltage": "voltage", "armed": "arming", "gnss": "position",
}  # fmt: skip
WHOLE_ONLY: Final = ("armed", "gnss", "pressure")
"""Signals taken only if nothing of them was heard; their holes are not filled."""
OTHERWISE: Final = {"depth": "pressure", "pressure": "depth"}
"""Signals that are not taken if the recording has the same quantity in another form."""


def logs_beside(folder: Path) -> list[Path]:
    """The autopilot's logs in a dive folder, without the dive's own recordings (`telemetry...`), sorted by name."""
    candidates = (file for file in folder.iterdir() if file.suffix.lower() == ENDING and file.is_file())
    return sorted(file for file in candidates if not file.name.startswith("telemetry"))


def with_logs(fields: dict[str, Any], heard: Sequence[Path], logs: Sequence[Path]) -> dict[str, Any]:
    """Fill the fields of a dive, read from the recordings `heard`, from logs; skip a log that can't be used.

    The notes say what each log contributed, or why it was skipped.
    """
    for log in logs:
        try:
            fields = merged(fields, heard, log)
        except LogError as error:
            fields = fields | {"notes": (*fields["notes"], f"{log.name} is left out: {error.reason}.")}
    return fields


def merged(fields: dict[str, Any], heard: Sequence[Path], log: Path) -> dict[str, Any]:
    """Fill the fields of a dive from a log, with a note. Raises LogError if that is impossible."""
    theirs, parameters = read_dataflash(log)
    try:
        line, known = _clock(fields, theirs, parameters, heard)
    except LogError as error:
        raise LogError(str(error), log) from None
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
    """The log's clock against the telemetry's, and a description of it. Raises LogError."""
    system, dated_by_autopilot = _vehicle(heard)
    stated_system = next((parameters[name] for name in ARDUSUB.system_names if name in parameters), None)
    if stated_system is not None and stated_system != system:
        raise LogError(
            f"it is of system {stated_system:.0f}, and the dive of system {system}: check that it is this vehicle's"
        )
    matched = match(fields, theirs)
    line, span_s = matched.line, _span(fields)
    if not dated_by_autopilot:
        return line, f"its clock {line.words(*span_s)}"
    if abs(line.offset_s) > SAME_S + matched.within_s:
        raise LogError(
            f"it lies {abs(line.offset_s):.1f} s off the times that the same autopilot told: it is of another boot"
        )
    return ClockLine(line.at_s, 0.0, 0.0, 0.0, 0.0), "the autopilot dated its telemetry by the same clock"


def _vehicle(heard: Sequence[Path]) -> tuple[int, bool]:
    """The vehicle's system in the recordings, and whether its boot time is the autopilot's own. Raises LogError."""
    frames = load_frames(heard)
    system, _ = vehicle_system(frames, str(heard[0]))
    run = vehicle_runs(frames, str(heard[0]))[0]
    beat = run.get("HEARTBEAT", autopilot=ARDUSUB.autopilot)
    return system, bool(beat) and bool((beat.components == run.primary).all())


def _span(fields: dict[str, Any]) -> tuple[float, float]:
    """First and last time of all signals."""
    times = [part.time_s for part in fields.values() if isinstance(part, Signal) and len(part)]
    if not times:
        raise LogError(f"{UNRELATED}: the telemetry holds no signal")
    return min(float(part[0]) for part in times), max(float(part[-1]) for part in times)


def _filled(
    fields: dict[str, Any], moved: dict[str, Signal], theirs: dict[str, Any], note: str, beyond_s: float
) -> dict[str, Any]:
    out, brings, fills, differ = dict(fields), [], [], []
    for name, words in WORDS.items():
        logged, heard = moved.get(name), fields.get(name)
        if logged is None or len(logged) == 0 or (heard is None and OTHERWISE.get(name) in fields):
            continue
        if heard is None or len(heard) == 0:
            out[name] = logged
            brings.append(words)
            if name == "velocity":
                out |= {kind: theirs[kind] for kind in ("velocity_is_filtered", "velocity_at_origin")}
            continue
        other_kind = name == "velocity" and fields["velocity_is_filtered"] != theirs["velocity_is_filtered"]
        if name in WHOLE_ONLY or other_kind:
            continue
        holes = in_holes(heard, logged)
        if not holes.any():
            continue
        alike = _as_heard(name, heard, logged)
        if alike is None:
            differ.append(words)
            continue
        new = Signal(alike.time_s[holes], alike.value[holes])
        out[name] = _together(heard, new)
        fills.append(f"{words} ({len(new)} reading{'' if len(new) == 1 else 's'})")
    if out.get("pwm") is not fields.get("pwm"):
        out["commands_hold"] = theirs["commands_hold"]
    sentences = [note]
    if brings:
        sentences.append(f"It brings {listed(brings)}.")
    if fills:
        sentences.append(f"It fills up {listed(fills)}.")
    if not brings and not fills:
        sentences.append("It holds nothing that was not heard.")
    if differ:
        sentences.append(f"Left out, for differing from what was heard: {listed(differ)}.")
    if beyond_s >= 1.0:
        lie, are = ("lies", "is") if round(beyond_s) == 1 else ("lie", "are")
        sentences.append(f"{beyond_s:.0f} s of it {lie} before or after what was heard, and {are} left out.")
    motors = fields["motors"] or theirs["motors"]
    return out | {"motors": motors, "notes": (*fields["notes"], " ".join(sentences))}


def in_holes(mine: Signal, other: Signal) -> NDArray[np.bool_]:
    """Which readings (n,) of `other` lie in holes of `mine`.

    A hole lies between two readings of `mine` that are more than two steps of `other` apart, before the first reading
    or after the last. A reading within half a step of `other` of a reading of `mine` is left out.
    """
    step_s = 1.0 / other.rate_hz if other.rate_hz else np.inf
    after = np.searchsorted(mine.time_s, other.time_s)
    edges_s = np.concatenate(([-np.inf], mine.time_s, [np.inf]))
    before_s, after_s = edges_s[after], edges_s[after + 1]
    near_s = np.minimum(other.time_s - before_s, after_s - other.time_s)
    return np.asarray((after_s - before_s > 2 * step_s) & (near_s > step_s / 2))


def _as_heard(name: str, mine: Signal, other: Signal) -> Signal | None:
    """`other` in the columns of `mine`; None if the two disagree on the readings that both have.

    Outputs beyond the logged ones keep the last command that was heard.
    """
    value = other.value
    width = mine.value.shape[1]
    if name == "pwm" and value.shape[1] < width:
        value = np.column_stack((value, mine.held_at(other.time_s)[:, value.shape[1] :]))
    value = value[:, :width]
    if name == "attitude":
        value = np.where((value * mine.at(other.time_s)).sum(axis=1, keepdims=True) < 0, -value, value)
    alike = Signal(other.time_s, value)
    inside = mine.between(other.time_s[0], np.nextafter(other.time_s[-1], np.inf))
    size = np.maximum(np.nanstd(inside.value, axis=0), 1e-6) if len(inside) else np.ones(width)
    apart = np.abs(alike.at(inside.time_s) - inside.value) / size
    apart = apart[np.isfinite(apart).all(axis=1)]
    if len(apart) == 0 or float(np.median(apart, axis=0).max()) > APART:
        return None
    return alike


def _together(mine: Signal, new: Signal) -> Signal:
    return Signal(
        np.concatenate((mine.time_s, new.time_s)), np.concatenate((mine.value, new.value))
    ).in_order()
