"""The numbers of the source paper, each with its place: Vangi et al., "Deep physics for deep seas".

Only numbers stated in its text, tables and captions; the curves in its figures are pictures and are not read off.
"""

from dataclasses import dataclass

SOURCE = 'Vangi, Bucci, Liverani, Colasanto, Ridolfi and Allotta, "Deep physics for deep seas"'


@dataclass(frozen=True)
class Published:
    """One number of the paper; `where` names its table, figure, equation or section."""

    value: float
    unit: str
    where: str


TABLE_3 = {
    "X_udot": Published(24.4, "kg", "Table 3"),
    "D_u": Published(42.13, "N/(m/s)", "Table 3"),
    "D_r": Published(21.8, "N m/(rad/s)", "Table 3"),
}
"""Survey; the paper calls X "added mass"."""

TABLE_4 = {
    "X_udot": Published(39.60, "kg", "Table 4"),
    "Y_vdot": Published(40.41, "kg", "Table 4"),
    "D_u": Published(56.24, "N/(m/s)", "Table 4"),
    "D_v": Published(53.05, "N/(m/s)", "Table 4"),
    "D_r": Published(26.07, "N m/(rad/s)", "Table 4"),
}
"""Hovering."""

PARAMETERS = {"survey": TABLE_3, "hovering": TABLE_4}

TABLE_5 = {
    ("surge", "Acceleration"): 0.0091,
    ("surge", "Steady state"): 0.0036,
    ("surge", "Deceleration"): 0.0048,
    ("surge", "Overall"): 0.0051,
    ("sway", "Acceleration"): 0.0069,
    ("sway", "Steady state"): 0.0030,
    ("sway", "Deceleration"): 0.0026,
    ("sway", "Overall"): 0.0035,
}
"""Table 5: feed-forward and PID together, hovering, m/s."""

SAMPLE_HZ = Published(10.0, "Hz", "section 4")
SURVEY_SAMPLES = Published(10_500, "samples", "section 4")
SURVEY_DISTANCE = Published(400.0, "m", "section 4: just under")
SURVEY_SPEEDS_M_S = (0.5, 0.4, 0.3, 0.2)
HOVERING_SAMPLES = Published(8_000, "samples", "section 4")
HOVERING_DISTANCE = Published(200.0, "m", "section 4: around")
HOVERING_SPEEDS_M_S = (0.4, 0.3, 0.2)
TRANSIENT = Published(5.0, "s", "section 4")
TOP_SPEED = Published(0.5, "m/s", "section 3.1, Fig. 10")

SHADOW_SURGE = Published(2.40, "N", "Fig. 10")
SHADOW_YAW = Published(1.7, "N m", "Fig. 11")
RAMP = Published(15.0, "s", "Fig. 11: 7 s to 22 s")
SURVEY_ACCELERATION = Published(0.0212, "m/s", "Figs 12, 13")
SURVEY_STEADY = Published(0.0336, "m/s", "Figs 12, 13")
SURGE_DELAY = Published(0.3, "s", "Figs 12, 14")
HEADING_LAG = Published(1.0, "s", "Fig. 14")
HOVERING_TARGET = Published(0.4, "m/s", "Fig. 15")
HOVERING_SETTLED = Published(0.3705, "m/s", "Fig. 15")
HOVERING_ACCELERATION = Published(0.0080, "m/s", "Fig. 15")
HOVERING_STEADY = Published(0.0295, "m/s", "Fig. 15")
SWAY_ACCELERATION = Published(0.0169, "m/s", "Fig. 16")
SWAY_STEADY = Published(0.0021, "m/s", "Fig. 16")
SURGE_PID = Published(-1.1528, "N", "Fig. 17")
SWAY_PID = Published(1.6706, "N", "Fig. 17")

ABSTRACT_SURGE = Published(5.0, "N", "abstract: below")
ABSTRACT_YAW = Published(2.0, "N", "abstract: below")
ABSTRACT_SPEED = Published(0.03, "m/s", "abstract: about")

MASS_RISE = Published(0.6230, "1", "section 4")
DRAG_RISE = Published(0.3349, "1", "section 4")
THRUSTER_ANGLE = Published(0.593412, "rad", "eq. 17")
THRUST_RATIO = Published(1.604, "1", "eq. 17")
POWER_RISE = Published(0.55, "1", "section 4")
POWER_SPEED = Published(0.2, "m/s", "section 4")

LSTM_DEPTH, LSTM_HIDDEN, HEAD, INPUTS, OUTPUTS = 5, 1024, 512, 7, 6
"""Table 1 and Fig. 3."""
