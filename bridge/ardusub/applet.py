"""The applet: a Lua script by which ArduSub itself adds the feed-forward to its mixer's output.

`applet.lua` beside this module is the controller. This module writes the vehicle's numbers in front of it, as the
table K, and checks the outputs. A script that stops leaves the mixer in charge only where the lower outputs repeat the
mixer's and the thrusters hang on those from `FIRST_OUTPUT` on: the override of an output ends by itself. An output that
is a script's own (SERVOn_FUNCTION 94 to 109) keeps its last pulse for ever, disarmed too (measured, 4.5.7).
"""

import re
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from bridge.ardusub.hold import AT_REST_M_S, AT_REST_N, HELD_WITHIN_M_S, HOLD_SHARE
from bridge.ardusub.law import FASTEST, HELD_S, REFERENCE_RAD_S
from bridge.ardusub.mixing import LEAST_SHARE, check_rest, mixer_of
from bridge.errors import ConfigError
from bridge.firmware.ardusub import (
    ALT_HOLD,
    FILES,
    FIRST_MOTOR,
    FRAME,
    FRAMES,
    MANUAL,
    MOTOR_FACTORS,
    OUTPUTS,
    STABILIZE,
    function_name,
    whole_number,
)
from bridge.onboard.store import hull_mark
from bridge.text import MARK, printable
from bridge.vehicle import feedforward, shadow
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.controller import GAINS, load_gains
from bridge.vehicle.parameters import vehicle_table
from bridge.vehicle.thrusters import Allocator, QuadraticCurve, TableCurve, thrust_curve
from bridge.wire.readings import CONTRACT_VERSION

NAME: Final = "seatrial.lua"
ENABLE: Final = "SCR_ENABLE"
APPLET: Final = "FF_APPLET"
"""Parameter with the mark of the script that runs, or ran last."""
FIRST_OUTPUT: Final = 9
KEY: Final = 113
"""Of the autopilot's tables of parameters, which scripts share: this and the next."""
TICK_S: Final = 0.01
AHEAD_S: Final = HELD_S + TICK_S
"""How far the reference is looked ahead. A stick that comes 25 times a second is older by half its hold, on average;
ArduSub reads its inputs, and the script these, 100 times a second, each half a tick late."""
ADDED_SHARE: Final = 0.2
"""Most that is added, of the vehicle's reach: about as much as the companion's `MOST_ADDED` at ArduSub's usual joystick
gain of 0.5. A script does not know the gain."""
_SCRIPTS: Final = range(94, 110)
_CHANNELS: Final = (5, 6, 4)
"""ArduSub's inputs of forward, lateral and yaw."""
_FLOWN: Final = {STABILIZE: 2, ALT_HOLD: 2, MANUAL: 3}
_LAW: Final = Path(__file__).with_name("applet.lua")
_BITS: Final = 0xFFFFFF


@dataclass(frozen=True)
class Applet:
    """The script's text, and its mark, which it keeps in FF_APPLET."""

    text: str
    mark: int


def wiring_fault(values: Mapping[str, float], thrusters: int) -> str:
    """Why an applet may not run on an autopilot with these parameters, with the way out; "" if it may."""
    if ENABLE not in values:
        return f"its firmware has no {ENABLE}, so it can't run scripts: only the companion is left"
    try:
        functions = {n: whole_number(values, function_name(n)) for n in range(1, OUTPUTS + 1)}
    except ConfigError as error:
        return str(error)
    if of_script := [n for n, function in functions.items() if function in _SCRIPTS]:
        return (
            f"{function_name(of_script[0])} is {functions[of_script[0]]}, an output of scripts: where a script stops "
            "it keeps its last pulse, disarmed too, and a thruster on it runs on; set a motor's function"
        )
    frame = values.get(FRAME, -1.0)
    if frame not in MOTOR_FACTORS:
        return f"{FRAME} {frame:g} is not supported: 1 (vectored) and 2 (vectored_6dof) are"
    if (motors := len(MOTOR_FACTORS[int(frame)])) != thrusters:
        return (
            f"{FRAME} {frame:g} is not supported for a vehicle file of {thrusters} thrusters: it has {motors}; name "
            f"that vehicle's own file, such as {FILES[FRAMES[int(frame)]]}, or mend {FRAME}"
        )
    for motor in range(1, thrusters + 1):
        for output in (motor, FIRST_OUTPUT + motor - 1):
            if functions[output] != FIRST_MOTOR + motor - 1:
                return (
                    f"{function_name(output)} is {functions[output]}, not {FIRST_MOTOR + motor - 1}: wire the "
                    f"thrusters to outputs {FIRST_OUTPUT} to {FIRST_OUTPUT + thrusters - 1}, give these and outputs 1 "
                    f"to {thrusters} the functions {FIRST_MOTOR} to {FIRST_MOTOR + thrusters - 1}, and leave the lower "
                    "without a thruster; else a script that stops would not leave the mixer in charge"
                )
    return ""


def applet(file: VehicleFile, configuration: str, values: Mapping[str, float]) -> Applet:
    """The script for a vehicle behind an autopilot with the parameters `values`.

    Raises ConfigError for a wiring that can't be read, or thrusters that push otherwise than the frame takes them to.
    """
    vehicle = file.vehicle
    shape, folder = vehicle.configurations[configuration], file.path.parent
    check_rest(file)
    curve = thrust_curve(vehicle.thrust_curve, folder)
    if not isinstance(curve, TableCurve | QuadraticCurve):
        raise ConfigError("thrust_curve: an applet knows tables and quadratic curves alone")
    mixer = mixer_of(values, shape, curve)
    reach = Allocator(shape, curve).reach()[list(feedforward.FEEDFORWARD_DOFS)]
    gains, veh_cfg = load_gains(shape.gains, GAINS), vehicle.veh_cfg(configuration)
    rows = [row for row in vehicle_table(vehicle) if row.veh_cfg == veh_cfg]
    prefix = f"FF{veh_cfg}_"
    order = sorted(range(len(rows)), key=lambda index: rows[index].name)
    table: dict[str, object] = {
        "key": KEY,
        "prefix": prefix,
        "version": CONTRACT_VERSION,
        "hull": int(hull_mark(vehicle, folder), 16) & _BITS,
        "first_output": FIRST_OUTPUT,
        "channels": _CHANNELS,
        "flown": _FLOWN,
        "pace": REFERENCE_RAD_S,
        "fastest": FASTEST,
        "slope_per_s": feedforward.SLOPE_PER_S,
        "lead_share": feedforward.LEAD_SHARE,
        "ahead_s": AHEAD_S,
        "lead_s": vehicle.thrust_curve.lag_s + 0.5 * TICK_S + AHEAD_S,
        "most_added": ADDED_SHARE,
        "hold_share": HOLD_SHARE,
        "held_within_m_s": HELD_WITHIN_M_S,
        "at_rest_m_s": AT_REST_M_S,
        "at_rest_n": AT_REST_N,
        "reach": reach,
        "limit_n": min(shape.thruster_limit_n, curve.max_n, -curve.min_n),
        "least_n": LEAST_SHARE * min(shape.thruster_limit_n, curve.max_n, -curve.min_n),
        "scales_together": mixer.scales_together,
        "factors": [{"motor": motor, "": row} for motor, row in mixer.driven],
        "matrix": mixer.matrix,
        "inverse": mixer.inverse,
        "mass_kg": shape.dry_mass_kg,
        "speeds": gains.speeds_m_s,
        "kp": (gains.surge.kp, gains.sway.kp),
        "ki": (gains.surge.ki, gains.sway.ki),
        "integral_share": gains.integral_share,
        "block_s": shadow.BLOCK_S,
        "window": round(shadow.WINDOW_S / shadow.BLOCK_S),
        "moved_s": shadow.MOVED_S,
        "moved_share": shadow.MOVED_SHARE,
        "explained": shadow.LEAST_EXPLAINED,
        "order": [index + 1 for index in order],
        "params": [
            {
                "name": row.name.removeprefix(prefix),
                "coefficient": row.coefficient,
                "low": row.low,
                "high": row.high,
                "default": row.default,
            }
            for row in rows
        ],
    }
    if isinstance(curve, TableCurve):
        pwm_us, thrust_n = curve.points
        table["table"] = {
            "us": pwm_us,
            "n": thrust_n,
            "ahead": int(np.flatnonzero(thrust_n <= 0)[-1]) + 1,
            "astern": int(np.flatnonzero(thrust_n >= 0)[0]) + 1,
        }
    else:
        table |= {"most_n": curve.limit_n, "span_us": curve.span_us, "dead_us": curve.dead_band_us}
    law = _shortened(_LAW.read_text(encoding="utf-8"))
    mark = zlib.crc32(f"{_lua(table)}\n{law}".encode()) & _BITS or 1
    # A vehicle file may come with a stranger's dive: its name must not end the comment.
    named = printable(f"{vehicle.name}:{configuration}", MARK)
    head = f"-- {NAME}, made by seatrial for {named}; do not edit"
    return Applet(f"{head}\nlocal K = {_lua({'applet': mark} | table)}\n{law}", mark)


def _shortened(law: str) -> str:
    """The law without comments, indents and empty lines: an autopilot's memory is small."""
    lines = (re.sub(r"^\s*--.*", "", line).strip() for line in law.splitlines())
    return "\n".join(line for line in lines if line) + "\n"


def _lua(value: object) -> str:
    """A Lua literal; the key "" of a dictionary holds a list whose elements stand beside the other keys."""
    if isinstance(value, dict):
        parts = [
            ", ".join(map(_lua, item))
            if key == ""
            else f"[{key}] = {_lua(item)}"
            if isinstance(key, int)
            else f"{key} = {_lua(item)}"
            for key, item in value.items()
        ]
        return "{" + ", ".join(parts) + "}"
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | np.integer):
        return str(int(value))
    if isinstance(value, float | np.floating):
        return repr(float(value))
    return "{" + ", ".join(map(_lua, value)) + "}"  # type: ignore[call-overload]
