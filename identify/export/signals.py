"""The signals of a dive, and the velocities of its vehicle's model along it, as topics with a field for each number,
whose unit ends the field's name.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.config import VehicleFile
from identify.diagnose.nominal import nominal_of
from identify.diagnose.shrink import HORIZON_S, differences, with_coefficients
from identify.diagnose.simulation import simulation_of
from identify.dive import Dive, Signal
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
