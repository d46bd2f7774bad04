"""The signals of a dive, and the velocities of its vehicle's model along it, as topics of an MCAP file, which Foxglove
and PlotJuggler open.

A topic has a field for each number, whose unit ends the field's name.

Messages are of ROS 2 (CDR, with their definitions in the file): both programs read these without further files, they
are rows of binary numbers, and unlike JSON they hold NaN, which stands for a reading that is unknown.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.config import VehicleFile
from identify.diagnose.filters.nominal import nominal_of
from identify.diagnose.gap.simulation import simulation_of
from identify.diagnose.shrink.check_dive import with_coefficients
from identify.diagnose.shrink.held_out import differences
from identify.diagnose.shrink.shrink import HORIZON_S
from identify.dive import Dive, Signal
from identify.ingest.files.optional_libraries import library
from identify.ingest.ros.recorded import EXTRA
from identify.ingest.rotation import euler_angles

VELOCITIES = ("u_m_s", "v_m_s", "w_m_s", "p_rad_s", "q_rad_s", "r_rad_s")
ACCELERATIONS = ("u_m_s2", "v_m_s2", "w_m_s2", "p_rad_s2", "q_rad_s2", "r_rad_s2")
WRENCH = ("x_n", "y_n", "z_n", "k_n_m", "m_n_m", "n_n_m")
_XYZ = "xyz"


def _called(word: str, names: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(f"{word}_{name}" for name in names)


ATTITUDE = "attitude"
FIELDS: dict[str, tuple[str, ...]] = {
    "velocity": tuple(f"velocity_{axis}_m_s" for axis in _XYZ),
    "gyro": tuple(f"gyro_{axis}_rad_s" for axis in _XYZ),
    "fog": ("fog_rad_s",),
    "specific_force": tuple(f"specific_force_{axis}_m_s2" for axis in _XYZ),
    ATTITUDE: ("q_w", "q_x", "q_y", "q_z"),
    "pressure": ("pressure_pa",),
    "depth": ("depth_m",),
    "altitude": ("altitude_m",),
    "voltage": ("voltage_v",),
    "sticks": ("stick_x", "stick_y", "stick_z", "stick_r"),
    "tau_cmd": _called("tau", WRENCH),
    "tau_pid": _called("pid", WRENCH),
    "tau_ff": _called("feedforward", WRENCH),
    "nu_fb": _called("feedback", VELOCITIES),
    "nu_ref": _called("reference", (*VELOCITIES, *ACCELERATIONS, "heading_rad", "depth_m")),
    "ff_mode": ("mode",),
    "veh_cfg": ("configuration",),
    "armed": ("armed",),
    "gnss": ("latitude_deg", "longitude_deg", "speed_m_s", "course_rad"),
}
"""Fields by signal of a Dive, in the order of its columns. The controller's fields have a prefix."""
_BY_THRUSTER = {"pwm": "pwm_{}_us", "thrust_cmd": "thruster_{}_n", "effort": "effort_{}", "rpm": "rpm_{}"}
_ANGLES = ("roll_deg", "pitch_deg", "heading_deg")
TOPICS = {
    "pwm": "/commands/pwm",
    "thrust_cmd": "/commands/force",
    "effort": "/commands/effort",
    "sticks": "/commands/sticks",
    "tau_cmd": "/commands/wrench",
    "tau_pid": "/controller/wrench_pid",
    "tau_ff": "/controller/wrench_feedforward",
    "nu_fb": "/controller/feedback",
    "nu_ref": "/controller/reference",
    "ff_mode": "/controller/feedforward_mode",
    "veh_cfg": "/vehicle/configuration",
    "armed": "/vehicle/armed",
}
"""Topics by signal; a reading's is its own name."""
FILTERED = "_filtered"
"""Ends the topic of a velocity from an autopilot's filter."""


@dataclass(frozen=True)
class PlotTopic:
    """A topic with the names of its fields, samples at times (n,) in s of the dive, and values (n, fields)."""

    name: str
    fields: tuple[str, ...]
    time_s: Array
    value: Array


def topics(dive: Dive) -> Iterator[PlotTopic]:
    """All signals of a dive that hold a sample; the attitude also as angles."""
    for name, signal in dive.signals().items():
        if len(signal):
            is_filtered = name == "velocity" and dive.velocity_is_filtered
            yield _topic(name, TOPICS.get(name, f"/{name}{FILTERED if is_filtered else ''}"), signal)


def of_axes(name: str, word: str, time_s: Array, nu: Array, dofs: Sequence[int]) -> PlotTopic:
    """A topic of velocities nu (n, 6) in the degrees of freedom `dofs`, whose fields begin with `word`."""
    return PlotTopic(name, _called(word, tuple(VELOCITIES[dof] for dof in dofs)), time_s, nu[:, list(dofs)])


def _topic(name: str, topic: str, signal: Signal) -> PlotTopic:
    width = signal.value.shape[1]
    if name in _BY_THRUSTER:
        fields = tuple(_BY_THRUSTER[name].format(k + 1) for k in range(width))
        return PlotTopic(topic, fields, signal.time_s, signal.value)
    if name == ATTITUDE:
        angles = np.degrees(np.column_stack(euler_angles(signal.value)))
        value = np.column_stack([signal.value, angles])
        return PlotTopic(topic, (*FIELDS[name], *_ANGLES), signal.time_s, value)
    return PlotTopic(topic, FIELDS[name], signal.time_s, signal.value)


MODEL, MEASURED = "/model/velocity", "/model/measured"


def flown(dive: Dive, file: VehicleFile, configuration: str) -> Sequence[PlotTopic]:
    """Two topics: the velocities of the model fitted to the dive, and the measured ones, smoothed, at the same times.

    Both are of the vehicle's origin, in the degrees of freedom that could be fitted. The model flies open loop by the
    recorded thrust and attitude, begun anew from the measured velocity every 5 s. Empty for a dive shorter than 5 s.

    Raises FitError if the dive has no axis that a model can be fitted to.
    """
    fit = nominal_of(dive, file, configuration)
    model = simulation_of(fit, with_coefficients(fit, fit), fit.motion.nu)
    length = round(HORIZON_S / model.step_s)
    starts = np.arange(0, len(model.time_s) - length, length)
    if not len(starts):
        return ()
    at = (starts[:, None] + np.arange(1, length + 1)).ravel()
    measured = model.nu[at]
    simulated = measured + differences(model, starts).reshape(-1, 6)
    return (
        of_axes(MODEL, "model", model.time_s[at], simulated, model.dofs),
        of_axes(MEASURED, "measured", model.time_s[at], measured, model.dofs),
    )


PROFILE, DEFINED_AS, ENCODED_AS = "ros2", "ros2msg", "cdr"
LEAD = b"\x00\x01\x00\x00"
"""Begins a message in CDR: little-endian numbers, which follow each other without gaps if all have 8 bytes."""
PACKAGE = "seatrial_msgs"
TIME = "time_s"
NANOSECONDS = 1_000_000_000


@dataclass(frozen=True)
class Written:
    """What an MCAP file holds: messages by topic, and the Unix s that were added to the dive's times."""

    messages: Mapping[str, int]
    origin_s: float


def write_mcap(
    file: BinaryIO, topics: Sequence[PlotTopic], unix_at_boot_s: float | None, about: Mapping[str, str]
) -> Written:
    """Write topics in the order of their times; `about` becomes the file's metadata.

    The log's time is the dive's, in Unix time where the dive knows that; each message also has the dive's own time in
    full precision, as `time_s`. Times before 0 are counted from the whole second before the first. Raises LogError if
    the library is missing.
    """
    writers = library("mcap.writer", EXTRA, Path(str(getattr(file, "name", "mcap"))))
    writer = writers.Writer(file)
    writer.start(PROFILE, "seatrial")
    origin_ns = _origin_ns(topics, unix_at_boot_s)
    channels = [_channel(writer, topic) for topic in topics]
    times_ns = [origin_ns + np.rint(topic.time_s * NANOSECONDS).astype(np.int64) for topic in topics]
    rows = [np.column_stack([topic.time_s, topic.value]).astype("<f8") for topic in topics]
    of = np.repeat(np.arange(len(topics)), [len(each) for each in times_ns])
    places = np.concatenate([np.arange(len(each)) for each in times_ns] or [of])
    order = np.argsort(np.concatenate(times_ns or [of]), kind="stable")
    for k, row in zip(of[order].tolist(), places[order].tolist(), strict=True):
        time_ns = int(times_ns[k][row])
        writer.add_message(channels[k], time_ns, LEAD + rows[k][row].tobytes(), time_ns, row)
    writer.add_metadata("seatrial", dict(about))
    writer.finish()
    return Written({topic.name: len(topic.time_s) for topic in topics}, origin_ns / NANOSECONDS)


def _origin_ns(topics: Sequence[PlotTopic], unix_at_boot_s: float | None) -> int:
    if unix_at_boot_s is not None:
        # Unix time in nanoseconds has more digits than a float.
        whole_s, part_s = divmod(unix_at_boot_s, 1.0)
        return int(whole_s) * NANOSECONDS + round(part_s * NANOSECONDS)
    start_s = min((float(topic.time_s[0]) for topic in topics), default=0.0)
    return NANOSECONDS * -int(np.floor(min(start_s, 0.0)))


def _channel(writer: Any, topic: PlotTopic) -> int:
    last = "".join(word.capitalize() for word in topic.name.replace("/", "_").split("_"))
    definition = "".join(f"float64 {field}\n" for field in (TIME, *topic.fields))
    schema = writer.register_schema(f"{PACKAGE}/msg/{last}", DEFINED_AS, definition.encode("ascii"))
    return int(writer.register_channel(topic.name, ENCODED_AS, schema, {"offered_qos_profiles": ""}))
