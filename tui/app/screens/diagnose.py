"""The screen Diagnose: the gap between model and recording, its causes, how far they shrink it, and the next dive."""

from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar, Final

from gcs_plugin.params.sidecar import sidecar_path
from tui.app.desk import ACCEPTABLE, DIAGNOSED, can_check, nearest_first
from tui.app.diagnosis import Answer, Foretold, answer, foretold
from tui.app.drawing import Lines, stacked
from tui.app.header import Tab
from tui.app.jobs import Kept, newer
from tui.app.keys import LOOKS, Action, bindings
from tui.app.screens.diagnose_lines import (
    how_far_lines,
    next_dive_lines,
    verdict_lines,
    where_lines,
    which_lines,
)
from tui.app.screens.on_dive import SectionScreen
from tui.options import NONE_ACCEPTED

REPORT: Final = "diagnosis.html"
LINES_OF: Final = {
    "where": where_lines,
    "which": which_lines,
    "far": how_far_lines,
    "next": next_dive_lines,
}
"""The lines of each of `DiagnoseScreen.SECTIONS`."""


class DiagnoseScreen(SectionScreen):
    """Result of `seatrial diagnose`; a key chooses the check dive."""

    VERB = "diagnose"
    SECTIONS: ClassVar[dict[str, str]] = {
        "where": "WHERE force is missing",
        "which": "WHICH causes it has",
        "far": "HOW FAR it shrinks",
        "next": "WHAT TO DIVE NEXT",
    }
    ACTIONS: ClassVar[tuple[Action, ...]] = (
        Action("diagnose.start", "d", "Diagnose", "diagnose the chosen dive, in a process of its own"),
        Action("diagnose.check", "c", "Check on", "the next dive to check it on, then none", LOOKS),
        Action("diagnose.section", "s", "Section", "the next section, where not all fit", LOOKS),
        Action("diagnose.cancel", "x", "Cancel", "end the diagnosis that runs"),
        Action("diagnose.parameters", "p", "Parameters", "what it would upload, beside the vehicle"),
    )
    BINDINGS = bindings(ACTIONS)  # type: ignore[assignment]
    LEGEND: ClassVar[tuple[tuple[str, str], ...]] = (
        ("░ ▒ ▓ █", "where force is missing: a trace, a little, much, most of it"),
        ("noise", "the drift that noise alone would make: no model gets below it"),
        ("nats", "what held-out pieces gain by a cause; its bar is logarithmic"),
    )

    def __init__(self, title: str, tabs: Sequence[Tab]) -> None:
        super().__init__(title, tabs)
        self._kept: Kept[Answer] = Kept(answer)
        self._foretold: Kept[Foretold] = Kept(foretold)
        self._other = 0

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        if action == "check":
            return not self.at_work and bool(self.others)
        if action == "parameters":
            return not self.at_work and self._accepts
        return super().check_action(action, parameters)

    @property
    def _accepts(self) -> bool:
        """Whether the diagnosis left a model with its causes."""
        return (
            self.dive is not None
            and newer(self.dive / ACCEPTABLE, self.dive / DIAGNOSED)
            and self.unkept is None
        )

    def action_check(self) -> None:
        self._other = (self._other + 1) % (len(self.others) + 1)
        self.draw()

    async def action_parameters(self) -> None:
        if self.dive is not None:
            self.desk.param = self.dive / ACCEPTABLE
            await self.begin_on("parameters")

    def comparable(self, dive: Path) -> tuple[Path, ...]:
        return nearest_first(self.desk, dive, tuple(filter(can_check, super().comparable(dive))))

    def on_other_dive(self) -> None:
        self._other = 0

    def result(self) -> Answer | None:
        return self._kept.read(self.dive / DIAGNOSED, self.unkept) if self.dive is not None else None

    def verdict(self, cells: int) -> Lines:
        diagnosis = self.result()
        return verdict_lines(diagnosis, cells) if diagnosis is not None else ()

    def section(self, name: str, cells: int, _: int) -> Lines:
        diagnosis = self.result()
        if diagnosis is None:
            return ()
        ahead: Foretold | None = None
        if name == "far" and self.dive is not None and self._accepts:
            ahead = self._foretold.read(sidecar_path(self.dive / ACCEPTABLE))
        ahead = ahead or Foretold()
        return (
            *stacked(ahead.words, "strong", cells),
            *stacked(ahead.why, "quiet", cells),
            *LINES_OF[name](diagnosis, cells),
        )

    def aim(self) -> tuple[str, str]:
        check = self._check_dive()
        how = "without a check dive" if check is None else f"checked on {check.name}"
        key = self.key_of("diagnose.check")
        return "diagnoses", f"{how}; [{key}] changes that" if key else how

    def words(self, dive: Path, vehicle: str) -> tuple[str, ...]:
        check = self._check_dive()
        leaves = (("--json", DIAGNOSED), ("--report", REPORT), ("--accept", ACCEPTABLE))
        outputs = (word for option, name in leaves for word in (option, str(dive / name)))
        checked = ("--check", str(check)) if check is not None else ()
        receipts = self.desk.receipts
        in_force = ("--accepted", str(receipts) if receipts.is_dir() else NONE_ACCEPTED)
        return (self.VERB, str(dive), "--vehicle", vehicle, *checked, *in_force, *outputs)

    def _check_dive(self) -> Path | None:
        return self.others[self._other] if self._other < len(self.others) else None
