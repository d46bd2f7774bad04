"""The source paper's fit with noise in the acceleration: how far too low its mass comes out, as table and figure."""

from pathlib import Path

import numpy as np

from identify.estimators.paper_noise import NoiseTable, noise_table
from identify.report.page import Figure, Report, Section, write_report
from identify.report.plot import Line, lines_panel, stack

SOURCES = (
    "bench/paper_noise.py",
    "bridge/vehicle",
    "identify/dive.py",
    "identify/estimators/paper_noise.py",
    "identify/estimators/paper_physics.py",
    "identify/filters.py",
)
SEED = 1
DRAWN_HZ = (5.0, 1.0, 0.5, 0.2)


def page(figure: Path) -> str:
    """The section of docs/benchmarks.md; writes the plot to the page `figure`."""
    table = noise_table(np.random.default_rng(SEED))
    _plot(table, figure)
    cutoffs = [f"{cutoff:g} Hz" if cutoff < 5 else "no filter" for cutoff in table.cutoff_hz]
    lines = [
        "## The paper's mass against noise and cut-off",
        "",
        "Error of the surge mass of the paper's loss (its closed form) on its survey, where the acceleration alone is",
        "noisy: by the standard deviation of that noise (rows) and the cut-off of the zero-phase filter before it",
        "(columns).",
        "",
        f"| noise, m/s2 | {' | '.join(cutoffs)} |",
        "|---" * (len(cutoffs) + 1) + "|",
    ]
    for noise, errors in zip(table.noise_m_s2, table.error_percent, strict=True):
        lines.append(f"| {noise:g} | {' | '.join(f'{error:+.1f} %' for error in errors)} |")
    lines += ["", f"[The same as a plot]({figure.name}).", ""]
    return "\n".join(lines)


def _plot(table: NoiseTable, path: Path) -> None:
    noise = np.array(table.noise_m_s2)
    drawn = [i for i, cutoff in enumerate(table.cutoff_hz) if cutoff in DRAWN_HZ]
    words = [f"{table.cutoff_hz[i]:g} Hz" if table.cutoff_hz[i] < 5 else "no filter" for i in drawn]
    lines = [Line(noise, table.error_percent[:, i], words[k], k) for k, i in enumerate(drawn)]
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
