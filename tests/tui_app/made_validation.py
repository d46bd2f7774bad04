"""A validation as `seatrial validate --json` writes it: dives in shadow, with the feed-forward alone, with both."""

import json
import math
from pathlib import Path

from made_diagnosis import CHECK, DIVE, OLDER, desk_with

from tui.app.desk import Desk

STEP_S, COUNT = 0.5, 240
TOP = {"surge": 0.4, "sway": 0.3, "yaw": 0.21}
FACTORS = {"surge": (112.0, 56.0), "sway": (112.0, 53.0), "yaw": (16.0, 26.0)}
OK, NO, UNKNOWN = True, False, None
FORETOLD = "As foretold: surge 13 -> 5.2 mm/s, flown 5.7; yaw 1.0 -> 0.16 deg/s, flown 0.17."


def criteria(surge=OK):
    sized = "112 kg fed, PID 110 ± 6.3: ×1.01 (0.71 to 1.41)"
    twice = "223 kg fed, PID 110 ± 6.3: ×2.03 (0.71 to 1.41)"
    rows = [
        ("surge likeness", OK, "0.99 between feed-forward and PID, at least 0.8"),
        ("surge mass", surge, sized if surge else twice),
        ("surge damping", OK, "56.2 N/(m/s) fed, PID 56.1 ± 0.64: ×1.00 (0.71 to 1.41)"),
        ("yaw mass", UNKNOWN, "16 kg m² fed, PID 16.6 ± 14: not shown well enough"),
        ("thrusters", OK, "24 % of its limit for the hardest-driven, at most 80 %"),
    ]
    return [{"what": name, "passed": passed, "words": words} for name, passed, words in rows]


def curves(lag_s):
    made = []
    for place, (axis, top) in enumerate(TOP.items()):
        mass, damping = FACTORS[axis]
        wanted = [_speed(k * STEP_S - 5.0 - 35.0 * place, top) for k in range(COUNT)]
        late = [_speed(k * STEP_S - 5.0 - 35.0 * place - lag_s, top) for k in range(COUNT)]
        slope = [(b - a) / STEP_S for a, b in zip(wanted, [*wanted[1:], 0.0], strict=True)]
        fed = [mass * s + damping * w for s, w in zip(slope, wanted, strict=True)]
        made.append(
            {
                "axis": axis,
                "unit": "rad/s" if axis == "yaw" else "m/s",
                "wrench_unit": "N m" if axis == "yaw" else "N",
                "start_s": 1.0,
                "step_s": STEP_S,
                "reference": wanted,
                "measured": [None if axis == "sway" and 60 <= k < 64 else v for k, v in enumerate(late)],
                "tau_ff": fed,
                "tau_pid": [damping * v for v in late] if lag_s else [0.0] * COUNT,
            }
        )
    return made


def whole(scale):
    """Every axis over the whole mission; surge is asked to move in all of it."""
    of = {
        "surge": (0.0466, None),
        "sway": (0.0345, 0.0037),
        "heave": (0.0017, 0.0017),
        "yaw": (0.0461, 0.0125),
    }
    return [
        {
            "axis": axis,
            "unit": "rad/s" if axis == "yaw" else "m/s",
            "rms": scale * rms,
            "asked": 0.2,
            "unasked": None if unasked is None else scale * unasked,
            "rest": None,
            "noise": 0.001,
        }
        for axis, (rms, unasked) in of.items()
    ]


def run(label, dive, scale, lag_s, raising, foretold=""):
    axes = [
        {
            "axis": axis,
            "unit": "rad/s" if axis == "yaw" else "m/s",
            "acceleration": 0.0928 * scale,
            "steady_state": 0.0220 * scale,
            "deceleration": 0.0809 * scale,
            "overall": 0.0595 * scale,
            "delay_s": lag_s,
            "acceleration_less_delay": 0.008 * scale,
            "pid_effort": 0.1,
            "pid_magnitude": 22.5 * scale,
            "pid_minus_ff": None,
            "noise": 0.001,
            "speeds": [],
        }
        for axis in TOP
    ]
    return {
        "run": label,
        "mode": label.rpartition(" ")[2],
        "dive": dive,
        "axes": axes,
        "whole": whole(scale),
        "foretold": [],
        "as_foretold": foretold,
        "raising": raising,
        "curves": curves(lag_s),
    }


def raising(go=True, flown="shadow"):
    sentence = (
        f"GO: the feed-forward may be raised from {flown} to both (seatrial ff both). "
        "Not known from this dive: yaw mass."
        if go
        else "NO-GO, don't raise it: surge mass. Identify from this dive, upload, and dive in shadow again."
    )
    return {"go": go, "from": flown, "to": "both", "sentence": sentence, "criteria": criteria(go)}


def validation(go=True):
    return [
        run("shadow", DIVE, 1.0, 1.2, raising(go)),
        run("ff", CHECK, 0.1, 0.0, raising(flown="ff"), FORETOLD),
        run("both", OLDER, 0.02, 0.0, None),
    ]


def validated_desk(root: Path, *, go=True, validated=True, **options) -> Desk:
    """Three dives, the one in shadow chosen; beside it its validation."""
    desk = desk_with(root, diagnosed=False, **options)
    if validated:
        (root / DIVE / "validation.json").write_text(json.dumps(validation(go)), encoding="utf-8")
    return desk


def _speed(t, top):
    """Up in 5 s, held for 10 s, down in 5 s."""
    if not 0 <= t < 20:
        return 0.0
    share = min(t / 5.0, (20.0 - t) / 5.0, 1.0)
    return top * (1 - math.cos(math.pi * share)) / 2
