"""The diagnosis of every planned dive: answers, kept with the truth.

The key of an answer holds a stamp of its code, so that answers of older code never count for the present code.
"""

import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from bench.diagnosis.plan import Planned
from bench.remembered import Data, Job, Remembered
from bench.stamp import CURVES, reached, stamp
from bridge.errors import SeatrialError
from identify.challenge.answer import Answer, answer_of
from identify.challenge.case import Case, check_of, dive_of
from identify.challenge.tlog import tlog_of
from identify.diagnose.diagnose import diagnose
from identify.diagnose.result import Diagnosis, plain
from identify.dive import Dive
from identify.effects.effect import Effect
from identify.effects.library import library
from identify.ingest.open import read_dive

SOURCES = (reached("bench/diagnosis/trials.py"), CURVES)
CHECKED = ("one", "two")
"""Groups with a check dive, because they have a gap that can be closed."""


@dataclass(frozen=True)
class Trial:
    """A planned dive, its truth, the answer (None with the reason if the diagnosis refused), and the CPU seconds."""

    group: str
    truth: dict[str, Any]
    answer: Answer | None
    refusal: str
    seconds: float

    @property
    def name(self) -> str:
        return str(self.truth["name"])


def measured(plan: Sequence[Planned], kept: Remembered, words: str) -> list[Trial]:
    """The trials of all dives; those missing in `kept` are diagnosed, one core each."""
    jobs: dict[str, Job] = {f"{dive.name}:{stamp(*SOURCES)}": partial(trial_job, dive) for dive in plan}
    return [trial(data) for data in kept.fill(jobs, words).values()]


def trial_job(planned: Planned) -> Data:
    """Diagnose a dive; return a `Trial` as JSON."""
    case = planned.case()
    check = recorded_check(case) if planned.group in CHECKED else None
    dive, effects = recorded_dive(case), effects_for(case)
    diagnosed: Diagnosis | None = None
    refusal = ""
    began = time.process_time()
    try:
        diagnosed = diagnose(
            dive, case.file, case.configuration, check=check, effects=effects, progress=lambda *_report: None
        )
    except SeatrialError as error:
        refusal = str(error)
    seconds = time.process_time() - began
    return {
        "group": planned.group,
        "truth": case.truth(),
        "answer": None if diagnosed is None else plain(diagnosed),
        "refusal": refusal,
        "seconds": seconds,
    }


def effects_for(case: Case) -> tuple[Effect, ...]:
    """The library without the effects that the case leaves out."""
    shape = case.file.vehicle.configurations[case.configuration]
    full = library(shape, case.file.vehicle.thrust_curve.lag_s)
    return tuple(effect for effect in full if effect.name not in case.without)


def trial(data: Data) -> Trial:
    answer = None if data["answer"] is None else answer_of(data["answer"])
    return Trial(data["group"], data["truth"], answer, data["refusal"], data["seconds"])


def recorded_dive(case: Case) -> Dive:
    return _recorded(dive_of(case), case)


def recorded_check(case: Case) -> Dive:
    """Another mission of the same vehicle."""
    return _recorded(check_of(case), case)


def _recorded(dive: Dive, case: Case) -> Dive:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{dive.name}.tlog"
        path.write_bytes(tlog_of(dive))
        return read_dive(path, None, case.file)
