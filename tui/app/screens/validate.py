"""Validate: may the feed-forward be raised, how well the vehicle tracked its reference, and the curves."""

from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar, Final

from tui.app.drawing import Lines
from tui.app.header import Tab
from tui.app.jobs import Kept
from tui.app.keys import LOOKS, Action, bindings
from tui.app.screens import validate_lines
from tui.app.screens.on_dive import DiveScreen
from tui.app.screens.validate_lines import Run, runs

JSON, REPORT = "validation.json", "validation.html"
MOST_BESIDE: Final = 3


class ValidateScreen(DiveScreen):
    """Result of `seatrial validate` on the chosen dive and on dives compared with it."""

    VERB = "validate"
    SECTIONS: ClassVar[dict[str, str]] = {
        "criteria": "GO OR NO-GO for raising the feed-forward",
        "curves": "CURVES",
        "errors": "ERRORS, mean of the absolute, by phase",
    }
    ACTIONS: ClassVar[tuple[Action, ...]] = (
        Action(
            "validate.start", "v", "start", "Validate", "validate the chosen dive, in a process of its own"
        ),
        Action(
            "validate.beside",
            "c",
            "compare",
            "Compare",
            "beside one more of the newest other dives, up to 3",
            LOOKS,
        ),
        Action("validate.section", "s", "section", "Section", "the next section, where not all fit", LOOKS),
        Action("validate.axis", "a", "axis", "Axis", "the curves of the next axis", LOOKS),
        Action(
            "validate.run",
            "m",
            "run",
            "Mode",
            "curves and verdict of the next dive that stands beside",
            LOOKS,
        ),
        Action("validate.cancel", "x", "cancel", "Cancel", "end the validation that runs"),
    )
    BINDINGS = bindings(ACTIONS)  # type: ignore[assignment]
    LEGEND: ClassVar[tuple[tuple[str, str], ...]] = (
        ("● ok", "as it must be"),
        ("▲ no", "not so: don't raise the mode"),
        ("◐ ?", "this dive does not show it"),
        ("━ ┈", "solid and dotted curve, as the title of each says"),
    )

    def __init__(self, title: str, tabs: Sequence[Tab]) -> None:
        super().__init__(title, tabs)
        self._kept: Kept[tuple[Run, ...]] = Kept(runs)
        self._run = ""
        self._axis = self._count = 0

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        if action == "compare":
            return not self.at_work and bool(self.others)
        if action == "axis":
            return len(validate_lines.axes(self.result())) > 1
        if action == "run":
            return len(self.result()) > 1
        return super().check_action(action, parameters)

    def action_compare(self) -> None:
        self._count = (self._count + 1) % (min(len(self.others), MOST_BESIDE) + 1)
        self.draw()

    def action_axis(self) -> None:
        self._axis += 1
        self.draw()

    def action_run(self) -> None:
        results, at = self.result(), self._looked_at()
        if at is not None:
            self._run = results[(results.index(at) + 1) % len(results)].dive
        self.draw()

    def on_other_dive(self) -> None:
        self._run = ""
        self._count = min(self._count, len(self.others))

    def result(self) -> tuple[Run, ...]:
        return (self._kept.read(self.dive / JSON, self.unkept) if self.dive is not None else None) or ()

    def verdict(self, cells: int) -> Lines:
        run = self._looked_at()
        return validate_lines.verdict(run, cells) if run is not None else ()

    def section(self, name: str, cells: int, rows: int) -> Lines:
        results, run = self.result(), self._looked_at()
        if run is None:
            return ()
        if name == "criteria":
            return validate_lines.criteria(run, cells)
        if name == "errors":
            return validate_lines.errors(results, run.dive, cells)
        axes = validate_lines.axes(results)
        return validate_lines.curves(run, axes[self._axis % len(axes)], cells, rows) if axes else ()

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
        return "validates", f"beside {', '.join(names)}" if names else "by itself"

    def words(self, dive: Path, vehicle: str) -> tuple[str, ...]:
        dives = map(str, (dive, *self._compared()))
        leaves = ("--json", str(dive / JSON), "--report", str(dive / REPORT))
        return (self.VERB, *dives, "--vehicle", vehicle, *leaves)

    def _compared(self) -> tuple[Path, ...]:
        return self.others[: self._count]

    def _looked_at(self) -> Run | None:
        """The dive on display: at first the chosen dive."""
        results = self.result()
        wanted = self._run or (self.dive.name if self.dive is not None else "")
        return next((run for run in results if run.dive == wanted), results[0] if results else None)
