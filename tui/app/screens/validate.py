"""Validate: may the feed-forward be raised, how well the vehicle tracked its reference, and the curves."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar, Final

import numpy as np

from bridge.errors import ConfigError
from bridge.schema import build
from bridge.vehicle.coefficients import DOFS
from bridge.vehicle.mode import Mode
from identify.validation.axis_criteria import Criterion
from identify.validation.raising import BASELINE
from identify.validation.tracking_curves import CURVES, WRENCH_UNITS, Followed
from tui.app.curves import Curve, plot, seconds_row
from tui.app.desk import VALIDATED, can_check
from tui.app.drawing import SHOWN_IN, Line, Lines, Role, Span, apart, cut, number, stacked, with_head, wrapped
from tui.app.header import PHONE, Tab
from tui.app.jobs import Kept, real
from tui.app.keys import LOOKS, Action, bindings
from tui.app.next_step import raising_words
from tui.app.screens.on_dive import SectionScreen

REPORT: Final = "validation.html"
MOST_OTHERS: Final = 3


ROWS: Final = {
    "acceleration": "Acceleration",
    "steady_state": "Steady state",
    "deceleration": "Deceleration",
    "overall": "Overall",
}
EFFORTS: Final = {
    "delay_s": "delay, ms",
    "pid_magnitude": "steady |PID|",
    "pid_minus_ff": "steady |PID - FF|",
}

WHOLE: Final = ("rms", "unasked")

MARKS: Final[dict[bool | None, tuple[str, Role]]] = {
    True: ("● ok ", "quiet"),
    False: ("▲ no ", "bad"),
    None: ("◐ ?  ", "warn"),
}
PHASE_CELLS, PHASE_CELLS_OF_A_PHONE = 24, 17
BOTH_PARTS_CELLS: Final = 13
BOTH_PARTS: Final = ("rms: all / others move", "rms: all / others")
"""The head of both parts, and where that has no room."""
LEAST_WORDS_CELLS: Final = 24
"""With less room beside its name, a criterion's words stand below it."""
LEAST_SPANS: Final = {"m/s": 0.05, "mm/s": 20.0, "deg/s": 1.0, "N": 1.0, "N m": 0.5}
ERRORS_IN: Final = SHOWN_IN | {"m/s": ("mm/s", 1e3)}
DIGITS: Final = {"mm/s": 1, "deg/s": 2}
EFFORT_DIGITS: Final = 2
AROUND_S: Final = 3.0
NO_VERDICT: Final = "No verdict: the dive tells no FF_MODE, or no axis that its reference moves was measured."


@dataclass(frozen=True)
class Verdict:
    """Go or no-go for raising the feed-forward."""

    go: bool
    sentence: str
    criteria: tuple[Criterion, ...]


@dataclass(frozen=True)
class Run:
    """One dive, flown in `mode`. `errors` by axis, then by ROWS and EFFORTS; NaN if the phase does not occur. `whole`
    by axis, then by WHOLE; `foretold` is the sentence on the foretold errors, "" if nothing was foretold."""

    label: str
    dive: str
    verdict: Verdict | None
    units: Mapping[str, str]
    errors: Mapping[str, Mapping[str, float]]
    curves: tuple[Followed, ...]
    whole: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    foretold: str = ""
    mode: str = ""

    @property
    def is_compared(self) -> bool:
        """Whether anything of its reference moved."""
        return any(math.isfinite(errors["overall"]) for errors in self.errors.values())


def runs(data: Any) -> tuple[Run, ...] | None:
    """Parse a validation into its dives in the order of their modes; None if it is not a validation."""
    try:
        return tuple(_run(entry) for entry in data) or None
    except (KeyError, TypeError, ValueError, AttributeError, ConfigError):
        return None


def _run(data: Mapping[str, Any]) -> Run:
    dive, raising = str(data["dive"]), data["raising"]
    if strange := {entry["unit"] for entry in data["axes"]} - WRENCH_UNITS.keys():
        raise ValueError(f"no errors in {strange}")
    return Run(
        _short(str(data["run"]), str(data["mode"]), dive),
        dive,
        None if raising is None else _verdict(raising),
        {entry["axis"]: str(entry["unit"]) for entry in data["axes"]},
        {entry["axis"]: {key: real(entry[key]) for key in (*ROWS, *EFFORTS)} for entry in data["axes"]},
        tuple(Followed.from_json(entry) for entry in data["curves"]),
        {
            DOFS[DOFS.index(entry["axis"])]: {key: real(entry[key]) for key in WHOLE}
            for entry in data.get("whole", ())
        },
        str(data.get("as_foretold", "")),
        str(data["mode"]),
    )


def _verdict(raising: Mapping[str, Any]) -> Verdict:
    criteria = [
        {"quantity": each["what"], "passed": each["passed"], "words": each["words"]}
        for each in raising["criteria"]
    ]
    shown = {"go": raising["go"], "sentence": raising["sentence"], "criteria": criteria}
    return build(Verdict, shown, "raising")


def _short(label: str, mode: str, dive: str) -> str:
    """The mode; of two dives in one mode, with the hour of each, since their names are long."""
    hour = dive.partition("T")[2][:5]
    if hour and (number_of := re.search(r"-\d+$", dive)):
        hour += number_of[0]
    return f"{hour} {mode}".strip() if label != mode and hour else label


def verdict_lines(run: Run, cells: int, raising: str = "") -> Lines:
    """Go or no-go as a mark and a word, then the sentence; of a GO in shadow also `raising`, the effect of the key."""
    judgement = run.verdict
    if judgement is None:
        is_baseline = run.mode == Mode.OFF.word and run.is_compared
        return wrapped(f"{run.dive} is {BASELINE}" if is_baseline else NO_VERDICT, "plain", cells)
    mark: Span = (" ● GO ", "strong") if judgement.go else (" ▲ NO-GO ", "bad")
    head = apart((mark,), ((cut(run.dive, cells - 12), "quiet"),), cells)

    raises = raising if judgement.go and run.mode == Mode.SHADOW.word else ""
    return (head, *stacked((run.foretold, judgement.sentence, raises), "strong", cells))


def criteria_lines(run: Run, cells: int) -> Lines:
    """A line per criterion, or several if its words are long; those that are not met come first."""
    judged = sorted(
        run.verdict.criteria if run.verdict is not None else (), key=lambda each: each.passed is not False
    )
    label_cells = max((len(_label(criterion)) for criterion in judged), default=0)
    return tuple(line for criterion in judged for line in _criterion(criterion, label_cells, cells))


def _label(criterion: Criterion) -> str:
    """With a colon, since some read on into their words: "thruster 1 made up for: asked as if it gave 79 %"."""
    return f"{criterion.quantity}:"


def _criterion(criterion: Criterion, label_cells: int, cells: int) -> Lines:
    mark, role = MARKS[criterion.passed]
    indent = len(mark) + label_cells + 2
    words_role: Role = "plain" if criterion.passed is not False else "strong"
    if cells - indent < LEAST_WORDS_CELLS:
        below = wrapped(criterion.words, words_role, cells, " " * (len(mark) + 1))
        return (((mark, role), (f" {_label(criterion)}", "plain")), *below)
    head: Line = ((mark, role), (f" {_label(criterion):<{label_cells}} ", "plain"))
    return with_head(head, criterion.words, words_role, cells)


def error_lines(runs: Sequence[Run], chosen: str, cells: int) -> Lines:
    """Mean absolute tracking errors as in the paper's Table 5, the least of a row strong; then delay and PID."""
    left = PHASE_CELLS if cells >= PHONE else PHASE_CELLS_OF_A_PHONE
    width = max(min((cells - left - 2) // len(runs), 16), 7)
    lines: list[Line] = []
    for axis in dict.fromkeys(axis for run in runs for axis in run.errors):
        unit = next(run.units[axis] for run in runs if axis in run.units)
        shown, factor = ERRORS_IN[unit]
        lines.append(((f"{f'{axis}, {shown}':<{left}}", "strong"), *_labels(runs, chosen, width)))
        for key, words in ROWS.items():
            values = [run.errors.get(axis, {}).get(key, math.nan) * factor for run in runs]
            lines.append(_row(words, values, DIGITS[shown], left, width, mark=True))
        for key, words in EFFORTS.items():
            values = [run.errors.get(axis, {}).get(key, math.nan) for run in runs]
            if key == "delay_s":
                lines.append(_row(words, [1000 * value for value in values], 0, left, width, mark=False))
            else:
                force = "N m" if unit == "rad/s" else "N"
                lines.append(_row(f"{words}, {force}", values, EFFORT_DIGITS, left, width, mark=False))
        lines.append(())
    return (*whole_lines(runs, chosen, left, width), *lines[:-1])


def _labels(runs: Sequence[Run], chosen: str, width: int) -> Line:
    return tuple(
        (f"{cut(run.label, width - 1):>{width}}", "strong" if run.dive == chosen else "quiet") for run in runs
    )


def whole_lines(runs: Sequence[Run], chosen: str, left: int, width: int) -> Lines:
    """Every axis, rms over the whole mission and, where that has room, while it was not asked to move; no lines if no
    dive tells it."""
    keys = WHOLE if width >= BOTH_PARTS_CELLS else WHOLE[:1]
    lines: list[Line] = []
    for axis in dict.fromkeys(axis for run in runs for axis in run.whole):
        shown, factor = ERRORS_IN["m/s" if DOFS.index(axis) < 3 else "rad/s"]
        line: Line = ((f"{f'  {axis}, {shown}':<{left}}", "quiet"),)
        for run in runs:
            parts = (run.whole.get(axis, {}).get(key, math.nan) for key in keys)
            said = " / ".join(number(factor * value, DIGITS[shown]) for value in parts)
            line = (*line, (f"{cut(said, width - 1):>{width}}", "plain"))
        lines.append(line)
    if not lines:
        return ()
    both = next((words for words in BOTH_PARTS if len(words) <= left), BOTH_PARTS[-1])
    head: Span = (f"{both if keys == WHOLE else 'rms: whole':<{left}}", "strong")
    return ((head, *_labels(runs, chosen, width)), *lines, ())


def _row(words: str, values: Sequence[float], digits: int, left: int, width: int, *, mark: bool) -> Line:
    known = [value for value in values if math.isfinite(value)]
    least = min(known) if mark and len(known) > 1 else math.nan
    said: Span = (cut(f"  {words}", left).ljust(left), "quiet")
    return (
        said,
        *((f"{number(v, digits):>{width}}", "strong" if v == least else "plain") for v in values),
    )


def curve_lines(run: Run, axis: str, cells: int, rows: int) -> Lines:
    """Speed with its reference, their difference, and feed-forward with PID, stacked on one time axis."""
    followed = next((followed for followed in run.curves if followed.axis == axis), None)
    if followed is None:
        return wrapped(
            f"{run.dive} has no curves of {axis}: its reference does not move there", "quiet", cells
        )
    moving = _moving(followed)
    each, spare_rows = divmod(rows - 1, 3)
    return (
        *_speed(moving, cells, each + (spare_rows > 1)),
        *_difference(moving, cells, each),
        *_wrench(moving, cells, each + (spare_rows > 0)),
        *seconds_row(moving.time_s, cells),
    )


def _moving(whole: Followed) -> Followed:
    """The part in which the axis's reference moves, and a little before and after."""
    moves = np.flatnonzero(np.nan_to_num(whole.reference))
    step_s = float(whole.time_s[1] - whole.time_s[0])
    margin = round(AROUND_S / step_s) + 1
    part = slice(max(int(moves[0]) - margin, 0), int(moves[-1]) + margin + 1) if moves.size else slice(None)
    return replace(whole, **{name: getattr(whole, name)[part] for name in ("time_s", *CURVES)})


def _speed(curve: Followed, cells: int, rows: int) -> Lines:
    unit, factor = SHOWN_IN.get(curve.unit, (curve.unit, 1.0))
    measured, reference = (
        Curve("measured", factor * curve.measured),
        Curve("reference", factor * curve.reference),
    )
    title = f"{curve.axis} speed, {unit}"
    return plot(title, curve.time_s, measured, reference, LEAST_SPANS[unit], cells, rows)


def _difference(curve: Followed, cells: int, rows: int) -> Lines:
    unit, factor = ERRORS_IN[curve.unit]
    error = Curve("measured less reference", factor * (curve.measured - curve.reference))
    return plot(f"{curve.axis} error, {unit}", curve.time_s, error, None, LEAST_SPANS[unit], cells, rows)


def _wrench(curve: Followed, cells: int, rows: int) -> Lines:
    unit = curve.wrench_unit
    title = f"{curve.axis} {'force' if unit == 'N' else 'moment'}, {unit}"
    fed, pid = Curve("feed-forward", curve.tau_ff), Curve("PID", curve.tau_pid)
    return plot(title, curve.time_s, fed, pid, LEAST_SPANS[unit], cells, rows)


def axes_of(runs: Sequence[Run]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(curve.axis for run in runs for curve in run.curves))


class ValidateScreen(SectionScreen):
    """Result of `seatrial validate` on the chosen dive and on dives compared with it."""

    VERB = "validate"
    SECTIONS: ClassVar[dict[str, str]] = {
        "criteria": "GO OR NO-GO for the feed-forward",
        "curves": "CURVES",
        "errors": "ERRORS: rms, then mean by phase",
    }
    ACTIONS: ClassVar[tuple[Action, ...]] = (
        Action("validate.start", "v", "Validate", "validate the chosen dive, in a process of its own"),
        Action(
            "validate.beside", "c", "Compare", "v then compares with one more of the newest, up to 3", LOOKS
        ),
        Action("validate.section", "s", "Section", "the next section, where not all fit", LOOKS),
        Action("validate.axis", "a", "Axis", "the curves of the next axis", LOOKS),
        Action("validate.run", "m", "Mode", "curves and verdict of the next dive that stands beside", LOOKS),
        Action("validate.cancel", "x", "Cancel", "end the validation that runs"),
    )
    BINDINGS = bindings(ACTIONS)  # type: ignore[assignment]
    LEGEND: ClassVar[tuple[tuple[str, str], ...]] = (
        ("● ok", "as it must be"),
        ("▲ no", "not so: don't raise the mode"),
        ("◐ ?", "this dive does not show it"),
        ("1.8 / 2.0", "error over the whole mission / while the axis is not asked to move"),
        ("━ ┈", "solid and dotted curve, as the title of each says"),
    )

    def __init__(self, title: str, tabs: Sequence[Tab]) -> None:
        super().__init__(title, tabs)
        self._kept: Kept[tuple[Run, ...]] = Kept(runs)
        self._run = ""
        self._axis = self._count = 0

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        if action == "beside":
            return not self.at_work and bool(self.others)
        if action == "axis":
            return not self.awaits and len(axes_of(self.result())) > 1
        if action == "run":
            return not self.awaits and len(self.result()) > 1
        return super().check_action(action, parameters)

    def action_beside(self) -> None:
        self._count = (self._count + 1) % (min(len(self.others), MOST_OTHERS) + 1)
        self.draw()

    def action_axis(self) -> None:
        self._axis += 1
        self.draw()

    def action_run(self) -> None:
        results, at = self.result(), self._looked_at()
        if at is not None:
            self._run = results[(results.index(at) + 1) % len(results)].dive
        self.draw()

    def comparable(self, dive: Path) -> tuple[Path, ...]:
        # One that lay afloat, for an upload, follows no reference: its column would be empty.
        return tuple(filter(can_check, super().comparable(dive)))

    def on_other_dive(self) -> None:
        self._run = ""
        self._count = min(self._count, len(self.others))

    def result(self) -> tuple[Run, ...]:
        return (self._kept.read(self.dive / VALIDATED, self.unkept) if self.dive is not None else None) or ()

    def verdict(self, cells: int) -> Lines:
        run = self._looked_at()
        if run is None:
            return ()
        situation = self.view.situation if self.view is not None and not self.view_only else None
        key = self._station_app.key_of_action("ff.raise")
        return verdict_lines(run, cells, raising_words(situation, key) if situation is not None else "")

    def section(self, name: str, cells: int, rows: int) -> Lines:
        results, run = self.result(), self._looked_at()
        if run is None:
            return ()
        if name == "criteria":
            return criteria_lines(run, cells)
        if name == "errors":
            return error_lines(results, run.dive, cells)
        axes = axes_of(results)
        return curve_lines(run, axes[self._axis % len(axes)], cells, rows) if axes else ()

    def head(self, name: str) -> tuple[str, str]:
        title, run = self.SECTIONS[name], self._looked_at()
        if name != "curves" or run is None:
            return title, ""
        keys = (
            (self.key_of(f"validate.{action}"), word) for action, word in (("axis", "axis"), ("run", "mode"))
        )
        return f"{title} of {run.label}", "  ".join(f"[{key}] {word}" for key, word in keys if key)

    def aim(self) -> tuple[str, str]:
        names = [path.name for path in self._compared()]
        how = f"beside {', '.join(names)}" if names else "by itself"
        key = self.key_of("validate.beside")
        most = len(names) == min(len(self.others), MOST_OTHERS)
        return "validates", f"{how}; [{key}] {'by itself' if most else 'beside one more'}" if key else how

    def words(self, dive: Path, vehicle: str) -> tuple[str, ...]:
        dives = map(str, (dive, *self._compared()))
        leaves = ("--json", str(dive / VALIDATED), "--report", str(dive / REPORT))
        return (self.VERB, *dives, "--vehicle", vehicle, "--receipts", str(self.desk.receipts), *leaves)

    def _compared(self) -> tuple[Path, ...]:
        return self.others[: self._count]

    def _looked_at(self) -> Run | None:
        """The dive on display: at first the chosen dive."""
        results = self.result()
        wanted = (self._run, self.dive.name if self.dive is not None else "")
        looked_at = (run for name in wanted for run in results if run.dive == name)
        return next(looked_at, results[0] if results else None)
