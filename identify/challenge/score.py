"""`score`: compares the answers of a diagnosis with the hidden truth and gives rates with Wilson intervals."""

import math
import statistics
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import permutations
from typing import Any

from identify.challenge.answer import Answer, Named, errors
from identify.challenge.indistinguishable import alike
from identify.challenge.planted_effects import ABSORBED
from identify.statistics import wilson

CLEAR = 0.5
"""Size over the noise floor from which an effect counts as clear."""

WIDE = 1.5
"""Drift on a check dive, in floors, from which there is a gap worth closing."""

BINS = 10
"""Bins of probability, to compare stated probabilities with the share that was right."""


class Measure(Enum):
    """A measure of the score; the value is its sentence."""

    NAMED_FIRST = "one hidden: named first"
    FIRST_OR_ALIKE = "one hidden: named first, or called equally likely"
    CLEAR_NAMED_FIRST = f"one hidden, {CLEAR:g} or more over the floor: named first"
    BOTH_NAMED = "two hidden: both named"
    CLEAR_BOTH_NAMED = f"two hidden, each {CLEAR:g} or more over the floor by itself: both named"
    RIGHT_DOF = "right degree of freedom"
    RIGHT_DOF_OF_GAP = "where a gap is told: right degree of freedom"
    FALSE_ALARMS = "false alarms where nothing hides"
    FALSE_ALARMS_ONE_POLE = "false alarms where the disturbance has one pole, as the nominal model takes it"
    UNKNOWN_AS_UNKNOWN = "unknown called unknown"
    CLEAR_UNKNOWN_AS_UNKNOWN = f"unknown, {CLEAR:g} or more over the floor: called unknown"
    UNKNOWN_AS_NO_GAP = "unknown: called no gap"
    KNOWN_AS_UNKNOWN = "known called unknown"
    KNOWN_AS_NO_GAP = "known called no gap"
    ABSORBED_OR_NAMED = "taken up by a refit: no gap, or named"
    MAGNITUDES_INSIDE = "magnitudes within their 95 % intervals"
    TWO_MAGNITUDES_INSIDE = "two hidden: magnitudes within their 95 % intervals"
    UNANSWERED = "without an answer"
    CLASS_SIZE = "mean class size"
    WRONG_CAUSES = "causes named that do not hide, a case"
    MAGNITUDE_ERROR = "magnitude error, median"
    TWO_MAGNITUDE_ERROR = "two hidden: magnitude error, median"
    SHRINK_ERROR = "predicted less measured shrink, mean size"
    SHRINK_ERROR_MEDIAN = "predicted less measured shrink, median size"
    SHRINK_ERROR_WIDE = f"predicted less measured shrink, mean size, of gaps of {WIDE:g} floors or more"
    SHRINK = "measured shrink, median"
    GAP_CLOSED = "share of all gaps on check dives that is closed"
    CALIBRATION_ERROR = "calibration error of probabilities"


@dataclass(frozen=True)
class Rate:
    """`hits` in `of` cases."""

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
    """All rates, and further numbers (None if no case gives one)."""

    rates: dict[Measure, Rate]
    numbers: dict[Measure, float | None]
    effects: tuple[EffectScore, ...]
    unanswered: tuple[str, ...]


@dataclass(frozen=True)
class Judged:
    """A hidden truth and the answer to it; an answer that is missing names nothing and is no false alarm."""

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

    def named_first(self) -> bool:
        """Whether the cause named first is the hidden effect, or one indistinguishable from it."""
        return bool(self.named) and self._matches(self.truth["effects"][0], self.named[0].name, self.named[0])

    def first_or_alike(self) -> bool:
        """Whether the cause named first, or a cause that the answer calls equally likely, is the hidden effect."""
        return bool(self.named) and self._matches_class(self.truth["effects"][0], self.named[0])

    def both_named(self) -> bool:
        """Whether two different named causes are the two hidden effects, or can't be told from them."""
        return any(
            all(
                self._matches(effect, cause.name, cause)
                for effect, cause in zip(self.truth["effects"], pair, strict=True)
            )
            for pair in permutations(self.named, 2)
        )

    def smallest_size(self) -> float:
        """Smallest size over the floor of the hidden effects, each taken alone; NaN if the sealed truth lacks sizes."""
        return min(float(effect.get("size", math.nan)) for effect in self.truth["effects"])

    def named_for(self, effect: Mapping[str, Any]) -> Named | None:
        """The named cause that has the hidden effect's own name.

        If only one effect is hidden, only the cause named first counts.
        """
        able = self.named if len(self.truth["effects"]) > 1 else self.named[:1]
        matches = (
            cause
            for cause in able
            if cause.name == effect["name"] and self._matches(effect, cause.name, cause)
        )
        return next(matches, None)

    def right(self, named: Named) -> bool:
        """Whether a named cause is hidden, or one that the answer calls equally likely."""
        return any(
            self._matches_class(effect, named) for effect in self.truth["effects"] if not effect["novel"]
        )

    def right_dof(self) -> bool:
        """Whether the degree of freedom to which the answer gives most of the gap is one that a hidden effect moves."""
        return self.answer is not None and self.answer.first_dof in self.truth["dof"]

    def _matches_class(self, effect: Mapping[str, Any], named: Named) -> bool:
        return any(self._matches(effect, name, named) for name in (named.name, *named.also))

    def _matches(self, effect: Mapping[str, Any], name: str, named: Named) -> bool:
        """Whether a name is that of a hidden effect, or of one that no diagnosis could tell from it.

        If the effect is of a single thruster, a number that the answer gives has to be right too.
        """
        if name not in alike(effect["name"], bool(self.truth["rpm"])):
            return False
        if effect["name"] == name and effect["number"]:
            return named.may_be_of(effect["number"])
        return True


def score(truths: Sequence[Mapping[str, Any]], answers: Mapping[str, Answer]) -> Score:
    cases = [Judged(truth, answers.get(truth["name"])) for truth in truths]
    by = {kind: [c for c in cases if c.kind == kind] for kind in ("none", "one", "two", "novel", "absorbed")}
    known = by["one"] + by["two"]
    clear = [case for case in by["one"] if case.truth["size"] >= CLEAR]
    none = [case for case in by["none"] if case.answer is not None]
    errors_one, inside = _magnitudes(by["one"] + by["absorbed"])
    errors_two, inside_two = _magnitudes(by["two"])
    rates = {
        Measure.NAMED_FIRST: _rate(by["one"], Judged.named_first),
        Measure.FIRST_OR_ALIKE: _rate(by["one"], Judged.first_or_alike),
        Measure.CLEAR_NAMED_FIRST: _rate(clear, Judged.named_first),
        Measure.BOTH_NAMED: _rate(by["two"], Judged.both_named),
        Measure.CLEAR_BOTH_NAMED: _rate(
            [case for case in by["two"] if case.smallest_size() >= CLEAR], Judged.both_named
        ),
        Measure.RIGHT_DOF: _rate(known + by["novel"], Judged.right_dof),
        Measure.RIGHT_DOF_OF_GAP: _rate(
            [case for case in known + by["novel"] if case.verdict not in ("", "no_gap")], Judged.right_dof
        ),
        Measure.FALSE_ALARMS: _rate(none, lambda c: c.verdict != "no_gap"),
        Measure.FALSE_ALARMS_ONE_POLE: _rate(
            [case for case in none if case.truth["poles"] == 1], lambda c: c.verdict != "no_gap"
        ),
        Measure.UNKNOWN_AS_UNKNOWN: _rate(by["novel"], lambda c: c.verdict == "unknown"),
        Measure.CLEAR_UNKNOWN_AS_UNKNOWN: _rate(
            [case for case in by["novel"] if case.truth["size"] >= CLEAR], lambda c: c.verdict == "unknown"
        ),
        Measure.UNKNOWN_AS_NO_GAP: _rate(by["novel"], lambda c: c.verdict == "no_gap"),
        Measure.KNOWN_AS_UNKNOWN: _rate(known, lambda c: c.verdict == "unknown"),
        Measure.KNOWN_AS_NO_GAP: _rate(known, lambda c: c.verdict == "no_gap"),
        Measure.ABSORBED_OR_NAMED: _rate(by["absorbed"], lambda c: c.verdict == "no_gap" or c.named_first()),
        Measure.MAGNITUDES_INSIDE: inside,
        Measure.TWO_MAGNITUDES_INSIDE: inside_two,
        Measure.UNANSWERED: _rate(cases, lambda c: c.answer is None),
    }
    numbers = {
        Measure.CLASS_SIZE: _mean(1.0 + len(named.also) for case in cases for named in case.named),
        Measure.WRONG_CAUSES: _mean(
            float(sum(not case.right(named) for named in case.named)) for case in cases if case.answer
        ),
        Measure.MAGNITUDE_ERROR: _median(errors_one),
        Measure.TWO_MAGNITUDE_ERROR: _median(errors_two),
        **_shrinks(known),
        Measure.CALIBRATION_ERROR: _calibration(cases),
    }
    unanswered = tuple(str(case.truth["name"]) for case in cases if case.answer is None)
    return Score(rates, numbers, _effect_scores(by["one"]), unanswered)


def _rate(cases: Sequence[Judged], is_hit: Callable[[Judged], bool]) -> Rate:
    return Rate(sum(map(is_hit, cases)), len(cases))


def _mean(values: Iterable[float]) -> float | None:
    finite = [value for value in values if math.isfinite(value)]
    return statistics.fmean(finite) if finite else None


def _median(values: Iterable[float]) -> float | None:
    finite = [value for value in values if math.isfinite(value)]
    return statistics.median(finite) if finite else None


def _magnitudes(cases: Sequence[Judged]) -> tuple[list[float], Rate]:
    """Relative errors of the magnitudes given for right causes, and how many lie in their intervals."""
    relative: list[float] = []
    inside: list[bool] = []
    for case in cases:
        for effect in case.truth["effects"]:
            named = case.named_for(effect)
            if named is None:
                continue
            for name, error in errors(effect["parameters"], named).items():
                _, low, high = named.parameters[name]
                relative.append(error)
                if math.isfinite(low) and math.isfinite(high):
                    inside.append(low <= effect["parameters"][name] <= high)
    return relative, Rate(sum(inside), len(inside))


def _shrinks(cases: Sequence[Judged]) -> dict[Measure, float | None]:
    answers = [case.answer for case in cases if case.answer is not None]
    apart = [abs(answer.predicted - answer.measured) for answer in answers]
    wide = [abs(answer.predicted - answer.measured) for answer in answers if answer.before >= WIDE]
    known = [
        (answer.before, answer.after) for answer in answers if math.isfinite(answer.before - answer.after)
    ]
    gap = sum(max(before - 1.0, 0.0) for before, _ in known)
    return {
        Measure.SHRINK_ERROR: _mean(apart),
        Measure.SHRINK_ERROR_MEDIAN: _median(apart),
        Measure.SHRINK_ERROR_WIDE: _mean(wide),
        Measure.SHRINK: _median(answer.measured for answer in answers),
        Measure.GAP_CLOSED: (sum(before - after for before, after in known) / gap if gap > 0 else None),
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
        found_sizes = [float(case.truth["size"]) for case in cases_of_name if case.named_first()]
        missed_sizes = [float(case.truth["size"]) for case in cases_of_name if not case.named_first()]
        out.append(
            EffectScore(
                name,
                Rate(len(found_sizes), len(cases_of_name)),
                min(found_sizes, default=math.nan),
                max(missed_sizes, default=math.nan),
            )
        )
    return tuple(out)
