"""The rivals' answers to planned dives: names, and drifts on the check dive, kept."""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from typing import Any

from bench.diagnosis.plan import Planned
from bench.diagnosis.rivals import bic, network
from bench.diagnosis.rivals.said import Said, closed
from bench.diagnosis.sources import RIVALS
from bench.diagnosis.trials import CHECKED, effects_for, finite, recorded_check, recorded_dive
from bench.remembered import Data, Job, Remembered
from bench.stamp import stamp
from identify.challenge.case import Case
from identify.challenge.score import Answer, Named
from identify.diagnose.nominal import Nominal, nominal_of

BIC, SPARSE, NETWORK = "BIC, one cause", "sparse regression (PySINDy)", "network on the residual"


@dataclass(frozen=True)
class RivalTrial:
    """A rival on a planned dive.

    before, after (6,): rms drifts on the check dive after 5 s, m/s and rad/s; empty if no check dive was flown.
    """

    rival: str
    truth: dict[str, Any]
    answer: Answer
    seconds: float
    before: tuple[float, ...]
    after: tuple[float, ...]


def available() -> dict[str, Callable[[Nominal, Case], Said]]:
    """The rivals; PySINDy comes with the extra `bench`."""
    available_rivals: dict[str, Callable[[Nominal, Case], Said]] = {
        BIC: lambda nominal, case: bic.named(nominal, effects_for(case))
    }
    if find_spec("pysindy") is not None:
        from bench.diagnosis.rivals import sindy

        available_rivals[SPARSE] = lambda nominal, _: sindy.named(nominal)
    available_rivals[NETWORK] = lambda nominal, _: network.named(nominal)
    return available_rivals


def measured(plan: Sequence[Planned], kept: Remembered) -> list[RivalTrial]:
    """All rivals on all dives; those missing in `kept` are run, one core each."""
    jobs: dict[str, Job] = {f"{dive.name}:{stamp(*RIVALS)}": partial(rivals_job, dive) for dive in plan}
    results = kept.fill(jobs, "rivals of the diagnosis")
    return [dive for data in results.values() for dive in trials(data)]


def rivals_job(one: Planned) -> Data:
    """All rivals on one dive, as JSON; they share the nominal fit, whose seconds count for each."""
    case = one.case()
    began = time.process_time()
    nominal = nominal_of(recorded_dive(case), case.file, case.configuration)
    fitted_s = time.process_time() - began
    check = nominal_of(recorded_check(case), case.file, case.configuration) if one.group in CHECKED else None
    out: dict[str, Any] = {}
    for rival, name in available().items():
        began = time.process_time()
        said = name(nominal, case)
        seconds = fitted_s + time.process_time() - began
        drifts = [] if check is None else closed(said, nominal, check)
        out[rival] = {
            "names": said.names,
            "seconds": seconds,
            "drifts": [[finite(value) for value in row] for row in drifts],
        }
    return {"truth": case.truth(), "rivals": out}


def trials(data: Data) -> list[RivalTrial]:
    """All rivals' trials of one dive from their JSON."""
    out = []
    for rival, said in data["rivals"].items():
        rows = [tuple(math.nan if v is None else v for v in row) for row in said["drifts"]] or [(), ()]
        names = tuple(
            Named(name, (), math.nan, {"thruster": (float(number), math.nan, math.nan)} if number else {})
            for name, number in said["names"]
        )
        answer = Answer("explained" if names else "no_gap", names, {}, math.nan, math.nan)
        out.append(RivalTrial(rival, data["truth"], answer, said["seconds"], *rows))
    return out
