"""The answer of `seatrial diagnose` to a field dive, run as by a crew: the command, its JSON and its CSV."""

import contextlib
import io
import json
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bench.field.draw import draw
from bench.field.export import COMPANION, Rates
from bench.field.regressions import NAMES, ForecastRow, drifts_of, foretold_by
from bench.remembered import Data
from bench.stamp import CURVES, makes_answer, reached
from bridge.arrays import Array
from bridge.errors import FitError

SYMBOLS = "uvwpqr"
SOURCES = (reached("bench/field/answers.py", "tui/commands/diagnose.py", belongs=makes_answer), CURVES)
"""Code that makes, diagnoses and predicts the dives."""


@dataclass(frozen=True)
class Planned:
    seed: int
    number: int
    effect: str
    rates: Rates = COMPANION

    @property
    def name(self) -> str:
        return f"{self.seed} {self.number:03d} {self.effect}"


def planned_job(planned: Planned) -> Data:
    """Make a dive of the plan, and diagnose it as a crew does.

    Returns its truth, the answer (None with the reason if refused), the CPU seconds, and the drifts of each method on
    the check dive.
    """
    from tui.cli import main

    case = replace(draw(planned.seed, planned.number, planned.effect), rates=planned.rates)
    truth = case.truth()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        vehicle, recorded, check = (folder / each for each in ("vehicle.yaml", "dive.tlog", "check.tlog"))
        vehicle.write_text(case.vehicle.text, encoding="utf-8")
        recorded.write_bytes(case.recording(0))
        check.write_bytes(case.recording(1))
        answer, foretold = folder / "answer.json", folder / "check.csv"
        words = ["diagnose", str(recorded), "--vehicle", str(vehicle), "--check", str(check)]
        words += ["--json", str(answer), "--predict", str(foretold)]
        said = io.StringIO()
        began = time.process_time()
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(said):
            code = main(words)
        seconds = time.process_time() - began
        prediction = read_foretold(foretold.read_text(encoding="utf-8")) if foretold.exists() else None
        return {
            "truth": truth,
            "answer": json.loads(answer.read_text(encoding="utf-8")) if answer.exists() else None,
            "refusal": said.getvalue().strip().rpartition("\n")[2] if code else "",
            "seconds": seconds,
            "drifts": {} if prediction is None else _drifts(folder, prediction, truth),
        }


def _drifts(folder: Path, foretold: ForecastRow, truth: Data) -> Data:
    """Rms drift by method, after 1 s and 5 s, of each axis; None if it ran away or was not flown. Nothing of a log in
    which the plain regressions know no force, since pulses come too seldom."""
    try:
        ways = {NAMES[0]: foretold.after, NAMES[1]: foretold.before} | foretold_by(folder, foretold, truth)
    except FitError:
        return {}
    return {name: drifts_of(foretold, way) for name, way in ways.items()}


def read_foretold(text: str) -> ForecastRow:
    """Read the CSV of the check dive; an axis that was not flown is NaN."""
    rows = [line for line in text.splitlines() if not line.startswith("#")]
    columns = rows[0].split(",")
    values = np.array([[float(cell) for cell in row.split(",")] for row in rows[1:]])

    def way(quantity: str) -> Array:
        out = np.full((len(values), 6), np.nan)
        for dof, symbol in enumerate(SYMBOLS):
            if f"{quantity}_{symbol}" in columns:
                out[:, dof] = values[:, columns.index(f"{quantity}_{symbol}")]
        return out

    window = values[:, columns.index("window")].astype(np.int64)
    return ForecastRow(values[:, 0], window, way("measured"), way("before"), way("after"))
