"""`score`: compares the answers of a diagnosis with the hidden truth and gives rates with Wilson intervals."""

import json
import math
import statistics
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations
from pathlib import Path
from typing import Any

from bridge.errors import LogError
from identify.challenge.planted_effects import ABSORBED
from identify.challenge.vehicles import LAG_S
from identify.statistics import wilson

CLEAR = 0.5
"""Size over the noise floor from which an effect counts as clear."""

WIDE = 1.5
"""Drift on a check dive, in floors, from which there is a gap worth closing."""

BINS = 10
"""Bins of probability, to compare stated probabilities with the share that was right."""


@dataclass(frozen=True)
class Named:
    """A cause in an answer. parameters: value and 95 % interval (NaN if missing)."""

    name: str
    also: tuple[str, ...]
    probability: float
    parameters: dict[str, tuple[float, float, float]]


@dataclass(frozen=True)
class Answer:
    """A diagnosis as far as it is scored.

    dofs: shares of the gap by degree of freedom. predicted, measured: shrink of the gap on held-out legs and on
    the check dive. before, after: drifts on the check dive, in noise floors. NaN if missing.
    """

    verdict: str
    named: tuple[Named, ...]
    dofs: dict[str, float]
    predicted: float
    measured: float
    before: float = math.nan
    after: float = math.nan

    @property
    def first_dof(self) -> str | None:
        return max(self.dofs, key=lambda dof: self.dofs[dof]) if self.dofs else None


@dataclass(frozen=True)
class Rate:
    """Hits out of a number of cases."""

    hits: int
    of: int

    @property
    def share(self) -> float:
        return self.hits / self.of if self.of else math.nan

    def bounds(self) -> tuple[float, float]:
        """95 % interval of the share (Wilson 1927)."""
        return wilson(self.share, self.of) if self.of else (0.0, 1.0)


@dataclass(frozen=True)
class EffectScore:
    """Results for an effect over all cases that hide nothing else: how often it was named, and sizes over the floor."""

    name: str
    rate: Rate
    smallest_found: float
    largest_missed: float


@dataclass(frozen=True)
class Score:
    """All rates by their sentence, and further numbers (None if no case gives one)."""

    rates: dict[str, Rate]
    numbers: dict[str, float | None]
    effects: tuple[EffectScore, ...]
    unanswered: tuple[str, ...]


@dataclass(frozen=True)
class Judged:
    """A truth and its answer. A missing answer names nothing and is no false alarm."""

    truth: Mapping[str, Any]
    answer: Answer | None

    @property
    def kind(self) -> str:
        """`absorbed` if a refit absorbs every hidden effect whole, otherwise the kind of the case."""
        names = [effect["name"] for effect in self.truth["effects"]]
        return "absorbed" if names and all(name in ABSORBED for name in names) else str(self.truth["kind"])

    @property
    def verdict(self) -> str:
        return "" if self.answer is None else self.answer.verdict

    @property
    def named(self) -> tuple[Named, ...]:
        return () if self.answer is None else self.answer.named

    def first(self) -> bool:
        """Whether the cause named first is the hidden effect, or in its true class."""
        return bool(self.named) and self._is(self.truth["effects"][0], self.named[0].name, self.named[0])

    def first_or_alike(self) -> bool:
        """Whether the cause named first, or a cause that the answer calls equally likely, is the hidden effect."""
        return bool(self.named) and self._holds(self.truth["effects"][0], self.named[0])

    def both(self) -> bool:
        """Whether two different named causes are the two hidden effects, or in their true classes."""
        return any(
            all(
                self._is(effect, cause.name, cause)
                for effect, cause in zip(self.truth["effects"], pair, strict=True)
            )
            for pair in permutations(self.named, 2)
        )

    def smallest(self) -> float:
        """Smallest size over the floor of the hidden effects, each taken alone; NaN if the sealed truth lacks sizes."""
        return min(float(effect.get("size", math.nan)) for effect in self.truth["effects"])

    def named_for(self, effect: Mapping[str, Any]) -> Named | None:
        """The named cause that has the hidden effect's own name.

        If only one effect is hidden, only the cause named first counts.
        """
        able = self.named if len(self.truth["effects"]) > 1 else self.named[:1]
        matches = (
            cause for cause in able if cause.name == effect["name"] and self._is(effect, cause.name, cause)
        )
        return next(matches, None)

    def right(self, named: Named) -> bool:
        """Whether a named cause, or one of its class, is hidden."""
        return any(self._holds(effect, named) for effect in self.truth["effects"] if not effect["novel"])

    def where(self) -> bool:
        """Whether the answer puts the largest share of the gap into an affected degree of freedom."""
        return self.answer is not None and self.answer.first_dof in self.truth["dof"]

    def _holds(self, effect: Mapping[str, Any], named: Named) -> bool:
        return any(self._is(effect, name, named) for name in (named.name, *named.also))

    def _is(self, effect: Mapping[str, Any], name: str, named: Named) -> bool:
        """Whether a name matches an effect by true class; for a single thruster, also its number if given."""
        if name not in alike(effect["name"], bool(self.truth["rpm"])):
            return False
        number = named.parameters.get("thruster")
        same = effect["name"] == name and effect["number"] and number is not None
        return not same or (number is not None and round(number[0]) == effect["number"])


def score(truths: Sequence[Mapping[str, Any]], answers: Mapping[str, Answer]) -> Score:
    """Judge answers by case name."""
    cases = [Judged(truth, answers.get(truth["name"])) for truth in truths]
    by = {kind: [c for c in cases if c.kind == kind] for kind in ("none", "one", "two", "novel", "absorbed")}
    known = by["one"] + by["two"]
    clear = [case for case in by["one"] if case.truth["size"] >= CLEAR]
    none = [case for case in by["none"] if case.answer is not None]
    off, inside = _magnitudes(by["one"] + by["absorbed"])
    off_two, inside_two = _magnitudes(by["two"])
    rates = {
        "one hidden: named first": _rate(by["one"], Judged.first),
        "one hidden: named first, or called equally likely": _rate(by["one"], Judged.first_or_alike),
        f"one hidden, {CLEAR:g} or more over the floor: named first": _rate(clear, Judged.first),
        "two hidden: both named": _rate(by["two"], Judged.both),
        f"two hidden, each {CLEAR:g} or more over the floor by itself: both named": _rate(
            [case for case in by["two"] if case.smallest() >= CLEAR], Judged.both
        ),
        "right degree of freedom": _rate(known + by["novel"], Judged.where),
        "where a gap is told: right degree of freedom": _rate(
            [case for case in known + by["novel"] if case.verdict not in ("", "no_gap")], Judged.where
        ),
        "false alarms where nothing hides": _rate(none, lambda c: c.verdict != "no_gap"),
        "false alarms where the disturbance has one pole, as the nominal model takes it": _rate(
            [case for case in none if case.truth["poles"] == 1], lambda c: c.verdict != "no_gap"
        ),
        "unknown called unknown": _rate(by["novel"], lambda c: c.verdict == "unknown"),
        f"unknown, {CLEAR:g} or more over the floor: called unknown": _rate(
            [case for case in by["novel"] if case.truth["size"] >= CLEAR], lambda c: c.verdict == "unknown"
        ),
        "unknown: called no gap": _rate(by["novel"], lambda c: c.verdict == "no_gap"),
        "known called unknown": _rate(known, lambda c: c.verdict == "unknown"),
        "known called no gap": _rate(known, lambda c: c.verdict == "no_gap"),
        "taken up by a refit: no gap, or named": _rate(
            by["absorbed"], lambda c: c.verdict == "no_gap" or c.first()
        ),
        "magnitudes within their 95 % intervals": inside,
        "two hidden: magnitudes within their 95 % intervals": inside_two,
        "without an answer": _rate(cases, lambda c: c.answer is None),
    }
    numbers = {
        "mean class size": _mean(1.0 + len(named.also) for case in cases for named in case.named),
        "causes named that do not hide, a case": _mean(
            float(sum(not case.right(named) for named in case.named)) for case in cases if case.answer
        ),
        "magnitude error, median": _median(off),
        "two hidden: magnitude error, median": _median(off_two),
        **_shrinks(known),
        "calibration error of probabilities": _calibration(cases),
    }
    unanswered = tuple(str(case.truth["name"]) for case in cases if case.answer is None)
    return Score(rates, numbers, _effect_scores(by["one"]), unanswered)


def _rate(cases: Sequence[Judged], so: Callable[[Judged], bool]) -> Rate:
    return Rate(sum(map(so, cases)), len(cases))


def _mean(values: Iterable[float]) -> float | None:
    finite = [value for value in values if math.isfinite(value)]
    return statistics.fmean(finite) if finite else None


def _median(values: Iterable[float]) -> float | None:
    finite = [value for value in values if math.isfinite(value)]
    return statistics.median(finite) if finite else None


def _magnitudes(cases: Sequence[Judged]) -> tuple[list[float], Rate]:
    """Relative errors of the magnitudes given for right causes, and how many lie in their intervals."""
    off: list[float] = []
    inside: list[bool] = []
    for case in cases:
        for effect in case.truth["effects"]:
            named = case.named_for(effect)
            if named is None:
                continue
            for name, error in errors(effect["parameters"], named).items():
                _, low, high = named.parameters[name]
                off.append(error)
                if math.isfinite(low) and math.isfinite(high):
                    inside.append(low <= effect["parameters"][name] <= high)
    return off, Rate(sum(inside), len(inside))


def _shrinks(cases: Sequence[Judged]) -> dict[str, float | None]:
    answers = [case.answer for case in cases if case.answer is not None]
    apart = [abs(answer.predicted - answer.measured) for answer in answers]
    wide = [abs(answer.predicted - answer.measured) for answer in answers if answer.before >= WIDE]
    known = [
        (answer.before, answer.after) for answer in answers if math.isfinite(answer.before - answer.after)
    ]
    gap = sum(max(before - 1.0, 0.0) for before, _ in known)
    return {
        "predicted less measured shrink, mean size": _mean(apart),
        "predicted less measured shrink, median size": _median(apart),
        f"predicted less measured shrink, mean size, of gaps of {WIDE:g} floors or more": _mean(wide),
        "measured shrink, median": _median(answer.measured for answer in answers),
        "share of all gaps on check dives that is closed": (
            sum(before - after for before, after in known) / gap if gap > 0 else None
        ),
    }


def _calibration(cases: Sequence[Judged]) -> float | None:
    """Expected calibration error over equal bins of probability."""
    predictions = [(named.probability, case.right(named)) for case in cases for named in case.named]
    predictions = [(p, right) for p, right in predictions if math.isfinite(p)]
    total = 0.0
    for k in range(BINS):
        bin_ = [(p, right) for p, right in predictions if min(int(p * BINS), BINS - 1) == k]
        if bin_:
            total += abs(sum(p for p, _ in bin_) - sum(right for _, right in bin_))
    return total / len(predictions) if predictions else None


def _effect_scores(cases: Sequence[Judged]) -> tuple[EffectScore, ...]:
    names = sorted({case.truth["effects"][0]["name"] for case in cases})
    out = []
    for name in names:
        cases_of_name = [case for case in cases if case.truth["effects"][0]["name"] == name]
        found_sizes = [float(case.truth["size"]) for case in cases_of_name if case.first()]
        missed_sizes = [float(case.truth["size"]) for case in cases_of_name if not case.first()]
        out.append(
            EffectScore(
                name,
                Rate(len(found_sizes), len(cases_of_name)),
                min(found_sizes, default=math.nan),
                max(missed_sizes, default=math.nan),
            )
        )
    return tuple(out)


VERDICTS = ("no_gap", "explained", "partly", "ambiguous", "unknown")


@dataclass(frozen=True)
class Alike:
    """Causes that count as the same, with the reason; `without_rpm`: only if no shaft speeds are recorded."""

    names: frozenset[str]
    reason: str
    without_rpm: bool = False


SAME = (
    Alike(
        frozenset({"command_delay", "thruster_lag"}),
        "a delay and a lag differ in the second order of a short time only: cosine 0.91 to 0.99, with shaft speeds "
        "too, unless the log is faster than 50 Hz",
    ),
    Alike(
        frozenset({"fouling", "battery_sag"}),
        "growing drag and falling thrust look alike (cosine 0.86 to 0.96) while nothing tells how fast the shafts turn",
        without_rpm=True,
    ),
    Alike(
        frozenset({"load_sag", "thrust_curve"}),
        "both change thrust by how hard is pushed (cosine 0.93 to 0.99) while nothing tells how fast the shafts turn",
        without_rpm=True,
    ),
    Alike(
        frozenset({"net_buoyancy", "thrust_bias"}),
        "a vehicle that stays level can't tell weight from a constant push down",
    ),
    Alike(frozenset(ABSORBED), "each is taken up by a refit of masses and dampings, and shows in nothing else"),
)  # fmt: skip


def alike(name: str, rpm: bool) -> frozenset[str]:
    """Names that no method could distinguish from `name` in such a recording, `name` included."""
    out = {name}
    for group in SAME:
        if name in group.names and not (group.without_rpm and rpm):
            out |= group.names
    return frozenset(out)


def read_answer(path: Path) -> Answer | None:
    """Read the answer from a file; None if the file does not exist. Raises LogError if it holds no valid answer."""
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        return None
    except (OSError, UnicodeDecodeError):
        raise LogError(f"{path}: can't be read; give the JSON that diagnose wrote") from None
    try:
        return answer_of(json.loads(text))
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise LogError(f"{path}: is no answer of diagnose ({error}); give the JSON that it wrote") from None


def answer_of(data: dict[str, Any]) -> Answer:
    """Parse an answer in the schema's form; ValueError, KeyError, TypeError or AttributeError if it is invalid."""
    if data["verdict"] not in VERDICTS:
        raise ValueError(f"the verdict is '{data['verdict']}'")
    dofs: dict[str, float] = {}
    for place in data["gap"]["where"]:
        dofs[place["dof"]] = dofs.get(place["dof"], 0.0) + _number(place["share"])
    shrink = data["shrink"]
    check = shrink["check"] or {}
    return Answer(
        data["verdict"],
        tuple(named_in(effect) for effect in data["effects"]),
        dofs,
        _number((shrink["heldout"] or {}).get("value")),
        _number(check.get("value")),
        _number(check.get("before")),
        _number(check.get("after")),
    )


def named_in(effect: Mapping[str, Any]) -> Named:
    """A cause that an answer names, of its JSON."""
    parameters = {
        name: (_number(p["value"]), _number(p.get("low95")), _number(p.get("high95")))
        for name, p in effect["parameters"].items()
    }
    return Named(effect["name"], tuple(effect["also"]), _number(effect["probability"]), parameters)


def _number(value: Any) -> float:
    return math.nan if value is None else float(value)


ABSENT_AT = {"gain": 1.0, "scale": 1.0, "ratio": 1.0, "time_constant": LAG_S}
"""Parameter values at which an effect is absent, if not zero."""

VECTORS = ("x", "y", "z", "north", "east", "X", "Y", "Z", "roll", "pitch")
"""Components of a vector: the error of each is divided by the length of the vector."""

UNMEASURED = ("thruster", "period")


def errors(truth: dict[str, float], named: Named) -> dict[str, float]:
    """Relative error of each parameter that both the truth and the answer give."""
    length = math.hypot(*(truth[name] for name in VECTORS if name in truth))
    out = {}
    for name, true in truth.items():
        scale = length if name in VECTORS else abs(true - ABSENT_AT.get(name, 0.0))
        if name in named.parameters and name not in UNMEASURED and scale > 0:
            out[name] = abs(named.parameters[name][0] - true) / scale
    return out
