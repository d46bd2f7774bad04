"""Downward bias of the source paper's mass by noise in the acceleration, by noise level and cut-off: table and figure.

For white noise of variance s^2 in the acceleration a, independent of it, least squares gives the fraction var a / (var
a + s^2) of the mass: the errors-in-variables bias (Fuller 1987, section 1.1). The table uses the paper's survey, 392 m:
four legs at each of 0.5, 0.4, 0.3 and 0.2 m/s, double-S changes of 5 s, a turn in place after each, 10 Hz. The dynamics
are exactly linear, so the bias has no other cause.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.reproduce.paper import Samples, closed_form
from bench.words import table
from bridge.arrays import Array
from bridge.vehicle.references import DoubleS
from identify.align import low_pass
from identify.report.page import Figure, Report, Section, write_report
from identify.report.plot import Line, lines_panel, stack

RATE_HZ = 10.0
SPEEDS_M_S = (0.5, 0.4, 0.3, 0.2)
LEGS, LEG_M, TRANSIENT_S, TURN_S = 4, 24.5, 5.0, 15.0
TRUE_MASS_KG, TRUE_DAMPING = 96.4, 42.13
NOISE_M_S2 = (0.0, 0.005, 0.01, 0.02, 0.04)
CUTOFFS_HZ = (5.0, 2.0, 1.0, 0.5, 0.2)

SOURCES = (
    "bench/paper_noise.py",
    "bridge/vehicle",
    "identify/dive.py",
    "bench/paper_noise.py",
    "bench/reproduce/paper.py",
    "identify/align.py",
)
SEED = 1
DRAWN_HZ = (5.0, 1.0, 0.5, 0.2)


@dataclass(frozen=True)
class NoiseTable:
    """Error of the mass in per cent, (noise levels, cut-offs); a cut-off at half the rate filters nothing."""

    noise_m_s2: tuple[float, ...]
    cutoff_hz: tuple[float, ...]
    error_percent: Array


def noise_table(
    rng: np.random.Generator,
    noise_m_s2: Sequence[float] = NOISE_M_S2,
    cutoffs_hz: Sequence[float] = CUTOFFS_HZ,
) -> NoiseTable:
    """Return the table; velocity, acceleration and force go through the same zero-phase filter."""
    nu, nu_dot, tau = survey_surge()
    errors = np.zeros((len(noise_m_s2), len(cutoffs_hz)))
    for i, noise in enumerate(noise_m_s2):
        noisy = nu_dot + noise * rng.standard_normal(len(nu_dot))
        for j, cutoff in enumerate(cutoffs_hz):
            mass = surge_mass(*(low_pass(x, RATE_HZ, cutoff) for x in (nu, noisy, tau)))
            errors[i, j] = 100 * (mass / TRUE_MASS_KG - 1)
    return NoiseTable(tuple(noise_m_s2), tuple(cutoffs_hz), errors)


def survey_surge() -> tuple[Array, Array, Array]:
    """Surge velocity, acceleration and force (n,) of the mission, without noise: M u_dot + D u = tau."""
    u, u_dot = [], []
    for speed in SPEEDS_M_S:
        for _ in range(LEGS):
            cruise_s = LEG_M / speed - TRANSIENT_S
            for profile, lasts_s in (
                (DoubleS(0.0, speed, TRANSIENT_S), TRANSIENT_S + cruise_s),
                (DoubleS(speed, 0.0, TRANSIENT_S), TRANSIENT_S + TURN_S),
            ):
                for k in range(round(lasts_s * RATE_HZ)):
                    value, slope, _ = profile.at(k / RATE_HZ)
                    u.append(value)
                    u_dot.append(slope)
    nu, nu_dot = np.array(u), np.array(u_dot)
    return nu, nu_dot, TRUE_MASS_KG * nu_dot + TRUE_DAMPING * nu


def surge_mass(nu: Array, nu_dot: Array, tau: Array) -> float:
    """The mass that minimises the paper's loss."""
    others = np.zeros((len(nu), 5))
    nu6, nu_dot6, tau6 = (np.column_stack((x, others)) for x in (nu, nu_dot, tau))
    data = Samples(nu6, nu_dot6, tau6, np.zeros_like(nu6), (0,))
    fixed = dict.fromkeys(("M_v", "M_w", "I_p", "I_q", "I_r", "D_v", "D_w", "D_p", "D_q", "D_r"), 0.0)
    return closed_form(data, fixed)["M_u"]


def page(figure: Path) -> str:
    """The section of docs/benchmarks.md; writes the plot to the page `figure`."""
    biases = noise_table(np.random.default_rng(SEED))
    _plot(biases, figure)
    cutoffs = [f"{cutoff:g} Hz" if cutoff < 5 else "no filter" for cutoff in biases.cutoff_hz]
    rows = [
        (f"{noise:g}", *(f"{error:+.1f} %" for error in errors))
        for noise, errors in zip(biases.noise_m_s2, biases.error_percent, strict=True)
    ]
    lines = [
        "## The paper's mass against noise and cut-off",
        "",
        "Error of the surge mass of the paper's loss (its closed form) on its survey, where the acceleration alone is",
        "noisy: by the standard deviation of that noise (rows) and the cut-off of the zero-phase filter before it",
        "(columns).",
        "",
        *table(("noise, m/s2", *cutoffs), rows),
    ]
    lines += ["", f"[The same as a plot]({figure.name}).", ""]
    return "\n".join(lines)


def _plot(biases: NoiseTable, path: Path) -> None:
    noise = np.array(biases.noise_m_s2)
    drawn = [i for i, cutoff in enumerate(biases.cutoff_hz) if cutoff in DRAWN_HZ]
    words = [f"{biases.cutoff_hz[i]:g} Hz" if biases.cutoff_hz[i] < 5 else "no filter" for i in drawn]
    lines = [Line(noise, biases.error_percent[:, i], words[k], k) for k, i in enumerate(drawn)]
    panel = lines_panel(
        "error of the mass, %",
        "noise of the acceleration, m/s²",
        lines,
        (0.0, float(noise[-1])),
        height_in=3.5,
    )
    caption = "Error of the mass by noise, one line a cut-off of the zero-phase filter."
    section = Section("Noise and cut-off", figures=(Figure("mass against noise", caption, stack([panel])),))
    write_report(
        path,
        Report(
            "The paper's mass against noise",
            "closed form of the source paper's loss on its survey",
            "Noise in the measured acceleration makes the mass too low; a filter helps as far as it can.",
            (section,),
        ),
    )
