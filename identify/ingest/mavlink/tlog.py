"""Reads a dive from a `.tlog`: messages of the telemetry contract, version 1, otherwise those that autopilots send.

Velocity is that of the best message available, in the axes that MAVLink defines: ODOMETRY in those of `child_frame_id`;
VISION_POSITION_DELTA as a change of position over `time_delta_usec`, in the body's axes at its end;
VISION_SPEED_ESTIMATE and LOCAL_POSITION_NED north-east-down.
"""

import math
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from bridge.firmware import table
from bridge.firmware.description import Firmware
from bridge.vehicle.config import GRAVITY_M_S2
from bridge.wire.readings import CONTRACT_VERSION
from identify.dive import STAMPED_S, Kind, Note, Signal
from identify.ingest import rotation
from identify.ingest.commands import driven_outputs, holding_of_a_loop, samples_of_a_loop
from identify.ingest.mavlink import held_pressure
from identify.ingest.mavlink.frames import Frames, load_frames, message_name
from identify.ingest.mavlink.low_pass import before_low_pass
from identify.ingest.mavlink.messages import Batch, Messages, unheard_notes, vehicle_runs
from identify.ingest.runs import Run, chosen, driven_s
from identify.words import listed

LOCAL_NED, LOCAL_ENU, LOCAL_OFFSET_NED, LOCAL_FRD = 1, 4, 7, 20
BODY_NED, BODY_OFFSET_NED, BODY_FRD = 8, 9, 12
OF_BODY, OF_EARTH = (BODY_NED, BODY_OFFSET_NED, BODY_FRD), (LOCAL_NED, LOCAL_OFFSET_NED, LOCAL_ENU)
"""MAV_FRAMEs. By MAVLink's list, a velocity in BODY_NED or BODY_OFFSET_NED is a velocity in BODY_FRD."""

FUSED = (3, 5, 8)
"""MAV_ESTIMATOR_TYPEs that smooth, because they fuse accelerations: visual-inertial, the same with GPS, autopilot."""

GYRO_BITS, ACCELERATION_BITS, FOG_BIT = 0b111000, 0b000111, 0b100000
DOWNWARD, NO_ECHO = 25, 1
ARMED = 128
GENERIC = (12, 0)
"""MAV_AUTOPILOTs that may command thrusters without a firmware of the table: PX4, and a vehicle's own program."""
FIX_2D = 2
HAS_DATE_S = 1e9
MILLI_G = GRAVITY_M_S2 * 1e-3

_ARRAYS = {"TAU_PID": 6, "TAU_FF": 6, "TAU_CMD": 6, "NU_FB": 6, "NU_REF": 14}

AS_OFTEN = 0.9
"""Messages of equal rate differ in number by less than this share, because some of each are lost."""

OF_AIR = (
    "The pressure (SCALED_PRESSURE2) stays while the vehicle sinks by the autopilot, so it is that of the air in its "
    "hull, or the vehicle floats and waves lift it: it was left out, and the depth is the autopilot's."
)


@dataclass(frozen=True)
class Velocity:
    """A velocity in body axes; whether it comes from a filter that fuses it with accelerations, and whether it is the
    body's origin's."""

    signal: Signal
    filtered: bool
    at_origin: bool = False


def velocity_of(messages: Messages, attitude: Signal | None) -> Velocity | None:
    """Velocity from the best source; None without a velocity, or if it needs an attitude that is missing."""
    odometry = messages.get("ODOMETRY")
    if signal := _odometry(odometry, attitude):
        estimators = odometry.fields["estimator_type"][_read(odometry)]
        return Velocity(signal, bool(np.isin(estimators, FUSED).all()))
    deltas = messages.get_from_anyone("VISION_POSITION_DELTA")
    ours = _are_of(deltas, messages.components("DEBUG_FLOAT_ARRAY"))
    if signal := _deltas(deltas, ours=ours):
        return Velocity(signal, False, at_origin=ours)
    signal = _of_earth(messages.get_from_anyone("VISION_SPEED_ESTIMATE"), ("x", "y", "z"), attitude)
    if signal:
        return Velocity(signal, False)
    signal = _of_earth(messages.get("LOCAL_POSITION_NED"), ("vx", "vy", "vz"), attitude)
    return Velocity(signal, True) if signal else None


def _odometry(batch: Batch, attitude: Signal | None) -> Signal | None:
    velocity = batch.columns("vx", "vy", "vz")
    velocity[batch.fields["quality"] < 0] = np.nan
    in_body, in_pose, *in_earth = _by_axes(batch)
    if in_body.any():
        return _where(batch.time_s, velocity, in_body)
    if in_pose.any():
        attitudes = batch.fields["q"].astype(np.float64)
        return _where(batch.time_s, rotation.to_body(attitudes, velocity), in_pose)
    for earth_frame, rows in zip(OF_EARTH, in_earth, strict=True):
        if rows.any():
            ned = velocity[:, [1, 0, 2]] * np.array([1, 1, -1]) if earth_frame == LOCAL_ENU else velocity
            return _turned(batch.time_s, ned, rows, attitude)
    return None


def _by_axes(batch: Batch) -> tuple[NDArray[np.bool_], ...]:
    """The ODOMETRY (n,) whose velocity is in the body's axes; in those of its pose; in each of the earth's. The first
    that are any are read."""
    frame, child = batch.fields["frame_id"], batch.fields["child_frame_id"]
    attitudes = batch.fields["q"].astype(np.float64)
    # The attitude in the message rotates from the body to the frame of its pose.
    in_pose = (child == frame) & np.isin(child, (LOCAL_NED, LOCAL_OFFSET_NED, LOCAL_FRD))
    in_pose &= np.abs(np.linalg.norm(attitudes, axis=1) - 1.0) < 0.1
    return np.isin(child, OF_BODY), in_pose, *(child == earth_frame for earth_frame in OF_EARTH)


def _read(batch: Batch) -> NDArray[np.bool_]:
    """The ODOMETRY (n,) whose velocity is read."""
    return next((rows for rows in _by_axes(batch) if rows.any()), np.zeros(len(batch), np.bool_))


def _passed_over(batch: Batch) -> tuple[str, ...]:
    """A note on the frames of ODOMETRY whose velocity is not read."""
    child = batch.fields["child_frame_id"]
    read = np.unique(child[_read(batch)])
    unread = np.setdiff1d(child, read)
    if not len(unread):
        return ()
    other = f"; that in child_frame_id {listed([*map(str, read)])} was" if len(read) else ""
    return (f"The velocity of ODOMETRY in child_frame_id {listed([*map(str, unread)])} was not read{other}.",)


def _are_of(batch: Batch, companions: Collection[int]) -> bool:
    """Whether all come from our companion: one of the components that send the contract's arrays."""
    return bool(np.isin(batch.components, list(companions)).all())


def _deltas(batch: Batch, *, ours: bool) -> Signal:
    """Mean velocity over each VISION_POSITION_DELTA, dated at its middle and in the body axes of that instant.

    Drivers that state no time (time_usec 0, such as BlueOS's for Water Linked) send the DVL's own velocity times the
    interval, which was never turned. So does our companion (`ours`): its velocity is that of the end, and of the
    body's origin, for which ArduSub takes it.
    """
    step_s = batch.fields["time_delta_usec"].astype(np.float64) * 1e-6
    with np.errstate(divide="ignore", invalid="ignore"):
        velocity = batch.fields["position_delta"].astype(np.float64) / step_s[:, None]
    if ours:
        return _where(batch.time_s, velocity, step_s > 0)
    half = 0.5 * batch.fields["angle_delta"].astype(np.float64)
    stated = (batch.fields["time_usec"] > 0) & np.isfinite(half).all(axis=1)
    velocity[stated] = rotation.turned_by(half[stated], velocity[stated])
    # Behind a link that stalled, messages arrive at once, and a long step's middle before that of the step before.
    return _where(batch.time_s - step_s / 2, velocity, step_s > 0).in_order()


def _of_earth(batch: Batch, names: tuple[str, str, str], attitude: Signal | None) -> Signal | None:
    return _turned(batch.time_s, batch.columns(*names), np.ones(len(batch.time_s), np.bool_), attitude)


def _turned(
    time_s: Array, north_east_down: Array, good: NDArray[np.bool_], attitude: Signal | None
) -> Signal | None:
    """Turn a north-east-down velocity into body axes, while the attitude is known."""
    if attitude is None or len(attitude) < 2:
        return None
    inside = (time_s >= attitude.time_s[0]) & (time_s <= attitude.time_s[-1])
    quaternion = rotation.attitude_at(attitude, time_s)
    return _where(time_s, rotation.to_body(quaternion, north_east_down), inside & good)


def read_tlog(paths: Sequence[Path], source: str) -> dict[str, Any]:
    """Fields of a Dive (all but its name, source and hash) from the files of a recording.

    Raises LogError if they hold no frame, no vehicle, or several vehicles; the error names the recording as `source`.
    """
    frames = load_frames(paths)
    messages, restart_notes = _most_driven(vehicle_runs(frames, source))
    signals: dict[str, Signal | None] = _contract(messages)
    firmware = _firmware(messages)
    of_autopilot = _of_autopilots(messages, firmware)
    for field, signal in of_autopilot.items():
        if not signals.get(field):
            signals[field] = signal
    own_pulses = signals["pwm"] is of_autopilot["pwm"]
    holds_pressure, notes = _holds_pressure(messages, firmware), messages.notes + restart_notes
    notes += _passed_over(messages.get("ODOMETRY"))
    pressure, depth = signals["pressure"], signals["depth"]
    if holds_pressure and pressure and depth and held_pressure.is_of_air(pressure, depth):
        signals["pressure"], notes = None, (*notes, OF_AIR)
    velocity = velocity_of(messages, signals.get("attitude"))
    if velocity is not None:
        signals["velocity"] = velocity.signal
        if not velocity.filtered and signals.get("pressure"):
            # The autopilot's own depth comes out of its filter, late; a DVL beside it is judged by the pressure.
            signals["depth"] = None
    if holds_pressure and (held := signals["pressure"]):
        read = None if velocity is None or velocity.filtered else velocity.signal
        signals["pressure"] = held_pressure.dated(held, read, signals.get("attitude"))
    sent = np.unique(frames.message[frames.system == messages.system], return_counts=True)
    return {
        **{field: signal for field, signal in signals.items() if signal},
        "velocity_is_filtered": velocity is not None and velocity.filtered,
        "velocity_at_origin": velocity is not None and velocity.at_origin,
        "commands_hold": _holding(messages, firmware, signals["pwm"] if own_pulses else None),
        "stamped_s": STAMPED_S if firmware is None else firmware.stamped_s,
        "unix_at_boot_s": _unix_at_boot_s(messages),
        "recorded_at_boot_s": messages.arrived_at_boot_s,
        "motors": _motors(messages),
        "notes": notes + _damage(frames) + unheard_notes(frames, messages.system),
        "counts": {message_name(int(number)): int(count) for number, count in zip(*sent, strict=True)}
        | frames.counts,
    }


def _firmware(messages: Messages) -> Firmware | None:
    """The firmware of the vehicle's autopilot; None without an autopilot, or for an unsupported one."""
    return next(
        (each for each in table.FIRMWARES if messages.get("HEARTBEAT", autopilot=each.autopilot)), None
    )


def _motors(messages: Messages) -> int:
    for firmware in table.FIRMWARES:
        if stated := _stated(messages, (firmware.frame,)):
            return firmware.motors_of(stated[firmware.frame])
    return 0


def _most_driven(runs: tuple[Messages, ...]) -> tuple[Messages, tuple[str, ...]]:
    """The run with the longest thruster activity, and a note if there are several, or two vehicles."""
    if len(runs) == 1 and not runs[0].twins:
        return runs[0], ()
    best, notes = chosen([Run(run.began_unix_s, run.span_s, _driven_s(run)) for run in runs])
    run = runs[best]
    return run, (_shared(run),) if run.twins else notes


def _shared(run: Messages) -> Note:
    """A note on two vehicles with one address: each jump between their clocks looks like a restart."""
    return Note(
        f"Two vehicles speak as system {run.system}, component {run.primary}: their messages are mixed in this "
        "recording, and tell of neither. Give one another id (system_id in its vehicle file), and dive again.",
        Kind.RESTART,
    )


def _driven_s(run: Messages) -> float:
    pwm = _outputs(run.get("ACTUATOR_OUTPUT_STATUS"))
    if pwm is None:
        pwm = _servos(run.get("SERVO_OUTPUT_RAW", port=0))
    tau = run.by_name("DEBUG_FLOAT_ARRAY").get("TAU_CMD") if pwm is None else None
    return driven_s(pwm, None if tau is None else Signal(tau.time_s, _data(tau, 6)), _armed(run))


def _contract(messages: Messages) -> dict[str, Signal | None]:
    imu = messages.get("HIGHRES_IMU", id=0)
    arrays = messages.by_name("DEBUG_FLOAT_ARRAY")
    arrays = {k: b for k, b in arrays.items() if b.fields["array_id"][0] // 256 == CONTRACT_VERSION}
    named = messages.by_name("NAMED_VALUE_FLOAT")
    pwm = _outputs(messages.get("ACTUATOR_OUTPUT_STATUS"))
    signals = {
        "gyro": _updated(imu, GYRO_BITS, ("xgyro", "ygyro", "zgyro")),
        "specific_force": _updated(imu, ACCELERATION_BITS, ("xacc", "yacc", "zacc")),
        "fog": _fog(messages.get("HIGHRES_IMU", id=1)),
        "attitude": _attitude(messages),
        "pressure": _columns(messages.get("SCALED_PRESSURE2"), ("press_abs",), 100.0),
        "altitude": _altitude(messages.get("DISTANCE_SENSOR", orientation=DOWNWARD)),
        "pwm": pwm,
        "rpm": _rpm(arrays.get("RPM"), pwm),
        "voltage": _pack_voltage(messages.get("BATTERY_STATUS", id=0)),
        "ff_mode": _columns(named.get("FF_MODE"), ("value",)),
        "veh_cfg": _columns(named.get("VEH_CFG"), ("value",)),
        "armed": _armed(messages),
        "gnss": _gnss(messages.get("GPS_RAW_INT")),
    }
    for name, width in _ARRAYS.items():
        batch = arrays.get(name)
        signals[name.lower()] = None if batch is None else Signal(batch.time_s, _data(batch, width))
    return signals


def _holds_pressure(messages: Messages, firmware: Firmware | None) -> bool:
    """Whether the pressure is that of an autopilot that holds it, not of another sender, which is of the time of its
    stamp."""
    if firmware is None or not firmware.holds_pressure:
        return False
    pressures = messages.get("SCALED_PRESSURE2").components[:1]
    return bool(
        np.isin(pressures, messages.get("HEARTBEAT", autopilot=firmware.autopilot).components[:1]).any()
    )


def _of_autopilots(messages: Messages, firmware: Firmware | None) -> dict[str, Signal | None]:
    """An autopilot's messages, for signals without the contract's own message. A simulator's truth is ignored."""
    gyro, force = _scaled_imu(messages)
    signals = {
        "gyro": gyro,
        "specific_force": force,
        "depth": _columns(messages.get("GLOBAL_POSITION_INT"), ("relative_alt",), -1e-3)
        or _columns(messages.get("VFR_HUD"), ("alt",), -1.0),
        "pwm": _servos(messages.get("SERVO_OUTPUT_RAW", port=0)),
        "sticks": _columns(messages.get_from_anyone("MANUAL_CONTROL"), ("x", "y", "z", "r")),
        "voltage": _supply_voltage(messages.get("SYS_STATUS")),
    }
    if firmware is None:
        return signals
    if firmware.loop_s:
        signals["pwm"] = samples_of_a_loop(signals["pwm"], firmware.loop_s)
    return before_low_pass(signals, firmware.corners, _stated(messages, firmware.corners.values()))


def _holding(messages: Messages, firmware: Firmware | None, pulses: Signal | None) -> bool | None:
    """Whether the autopilot's own pulses hold until the next; None without any, or where that is not known."""
    if firmware is None or not firmware.loop_s:
        return None
    return holding_of_a_loop(pulses, _stated(messages, (firmware.loop,)).get(firmware.loop, math.nan))


def _stated(messages: Messages, names: Iterable[str]) -> dict[str, float]:
    """Those of these parameters that the run states, as it last does."""
    stated = ((name, messages.get("PARAM_VALUE", param_id=name.encode())) for name in names)
    return {name: float(batch.fields["param_value"][-1]) for name, batch in stated if batch}


def _columns(batch: Batch | None, names: tuple[str, ...], scale: float = 1.0) -> Signal | None:
    return None if batch is None else Signal(batch.time_s, batch.columns(*names) * scale)


def _data(batch: Batch, width: int | None = None) -> Array:
    return batch.fields.first("data", width).astype(np.float64)


def _where(time_s: Array, value: Array, good: NDArray[np.bool_]) -> Signal:
    return Signal(time_s[good], value[good])


def _updated(batch: Batch, bits: int, names: tuple[str, ...]) -> Signal:
    """Fields of the messages that mark them as new in `fields_updated`."""
    return _where(batch.time_s, batch.columns(*names), batch.fields["fields_updated"] & bits == bits)


def _fog(batch: Batch) -> Signal:
    """The yaw rate of messages that hold nothing else of an IMU: the second IMU of an autopilot has all its axes."""
    new = batch.fields["fields_updated"] & (GYRO_BITS | ACCELERATION_BITS)
    return _where(batch.time_s, batch.columns("zgyro"), new == FOG_BIT)


def _attitude(messages: Messages) -> Signal | None:
    """ATTITUDE_QUATERNION, or ATTITUDE if that comes faster."""
    quaternion, euler = messages.get("ATTITUDE_QUATERNION"), messages.get("ATTITUDE")
    if len(quaternion) >= len(euler):
        return _columns(quaternion, ("q1", "q2", "q3", "q4"))
    angles = euler.columns("roll", "pitch", "yaw")
    return Signal(euler.time_s, rotation.quaternions_from_euler(*angles.T))


def _scaled_imu(messages: Messages) -> tuple[Signal | None, Signal | None]:
    """Rates of turn and specific force.

    The rates come from ATTITUDE, which the autopilot uses for control, or from an IMU that is sent faster. The
    specific force comes from the fastest of SCALED_IMU2, SCALED_IMU, RAW_IMU.
    """
    candidates = [messages.get("SCALED_IMU2"), messages.get("SCALED_IMU"), messages.get("RAW_IMU", id=0)]
    # A missing second IMU is reported as zeros.
    imu = max((b for b in candidates if b.columns("xacc", "yacc", "zacc").any()), key=len, default=None)
    force = _columns(imu, ("xacc", "yacc", "zacc"), MILLI_G)
    attitude = messages.get("ATTITUDE")
    if attitude and (imu is None or len(attitude) > AS_OFTEN * len(imu)):
        return _columns(attitude, ("rollspeed", "pitchspeed", "yawspeed")), force
    return _columns(imu, ("xgyro", "ygyro", "zgyro"), 1e-3), force


def _outputs(batch: Batch) -> Signal | None:
    return driven_outputs(batch.time_s, batch.fields["actuator"].astype(np.float64))


def _servos(batch: Batch) -> Signal | None:
    """Pulses in microseconds, one column per output, up to the first output that is never driven."""
    return driven_outputs(batch.time_s, batch.columns(*(f"servo{i}_raw" for i in range(1, 17))))


def _rpm(batch: Batch | None, pwm: Signal | None) -> Signal | None:
    if batch is None:
        return None
    if pwm is not None:
        return Signal(batch.time_s, _data(batch, pwm.value.shape[1]))
    data = _data(batch)
    used = np.flatnonzero(data.any(axis=0))
    return Signal(batch.time_s, data[:, : int(used.max(initial=0)) + 1])


def _altitude(batch: Batch) -> Signal:
    """Distance to the bottom by the first of several sounders that look down."""
    cm, number = batch.columns("current_distance"), batch.fields["id"]
    none = batch.fields["signal_quality"] == NO_ECHO
    cm[none | (cm[:, 0] == 0) | (cm[:, 0] > batch.fields["max_distance"])] = np.nan
    first = number == number.min(initial=255)
    return Signal(batch.time_s[first], cm[first] * 1e-2)


def _pack_voltage(batch: Batch) -> Signal:
    """Sum of the cells if the autopilot lists them separately; 65535 marks an absent cell."""
    cells = batch.fields["voltages"].astype(np.float64)
    cells[cells == 65535] = 0.0
    pack_v = cells.sum(axis=1, keepdims=True) * 1e-3
    return _where(batch.time_s, pack_v, pack_v[:, 0] > 0)


def _supply_voltage(batch: Batch) -> Signal:
    """The autopilot's own reading, in V: 0 and 65535 mV are none."""
    millivolts = batch.columns("voltage_battery")
    return _where(batch.time_s, millivolts * 1e-3, (millivolts[:, 0] > 0) & (millivolts[:, 0] < 65535))


def _armed(messages: Messages) -> Signal:
    """Armed state from the heartbeats of the thrusters' commander: an autopilot before an onboard computer."""
    kinds = (*(firmware.autopilot for firmware in table.FIRMWARES), *GENERIC)
    autopilots = (messages.get("HEARTBEAT", autopilot=kind) for kind in kinds)
    batch = next(filter(None, autopilots), None) or messages.get("HEARTBEAT")
    return Signal(batch.time_s, ((batch.fields["base_mode"] & ARMED) != 0).astype(np.float64)[:, None])


def _gnss(batch: Batch) -> Signal:
    fields = batch.fields
    value = batch.columns("lat", "lon", "vel", "cog") * np.array([1e-7, 1e-7, 1e-2, np.pi / 18000])
    value[fields["vel"] == 65535, 2] = np.nan
    value[fields["cog"] == 65535, 3] = np.nan
    return _where(batch.time_s, value, fields["fix_type"] >= FIX_2D)


def _unix_at_boot_s(messages: Messages) -> float | None:
    batch = messages.get("SYSTEM_TIME")
    unix_s = batch.fields["time_unix_usec"].astype(np.float64) * 1e-6
    dated = unix_s > HAS_DATE_S
    return float(np.median((unix_s - batch.time_s)[dated])) if dated.any() else None


def _damage(frames: Frames) -> tuple[str, ...]:
    lost, skipped = frames.counts.get("checksum", 0), frames.counts.get("skipped", 0)
    notes = []
    if lost:
        of = f"({skipped} byte{'' if skipped == 1 else 's'})"
        are = f"{lost} stretches {of} are" if lost > 1 else f"1 stretch {of} is"
        done = "were" if lost > 1 else "was"
        read = "1 message was" if len(frames) == 1 else f"{len(frames)} messages were"
        notes.append(f"{are} damaged or of another dialect and {done} skipped; {read} read.")
    empty = frames.counts.get("files empty", 0)
    if empty:
        files = f"{empty} of its files hold" if empty > 1 else "1 of its files holds"
        notes.append(f"{files} nothing, and the others are used.")
    if frames.counts.get("cut"):
        notes.append("The recording ends in the middle of a record; what comes before is used.")
    return tuple(notes)
