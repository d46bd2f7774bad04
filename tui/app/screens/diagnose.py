"""Diagnose: the gap between model and recording, its causes, how far they shrink it, and the next dive."""

from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar, Final

from tui.app.desk import can_check
from tui.app.drawing import Lines
from tui.app.header import Tab
from tui.app.jobs import Kept, newer
from tui.app.keys import LOOKS, Action, bindings
from tui.app.screens import diagnose_lines
from tui.app.screens.diagnose_lines import Answer, answer
from tui.app.screens.on_dive import DiveScreen

JSON, REPORT, PARAM = "diagnosis.json", "diagnosis.html", "diagnosed.param"
MAKES: Final = {
    "where": diagnose_lines.where,
    "which": diagnose_lines.which,
    "far": diagnose_lines.how_far,
    "next": diagnose_lines.what_next,
}


class DiagnoseScreen(DiveScreen):
    """Result of `seatrial diagnose`; a key chooses the check dive."""

    VERB = "diagnose"
    SECTIONS: ClassVar[dict[str, str]] = {
        "where": "WHERE the gap lies, % of its square",
        "which": "WHICH causes it has",
        "far": "HOW FAR it shrinks",
        "next": "WHAT TO DIVE NEXT",
    }
    ACTIONS: ClassVar[tuple[Action, ...]] = (
        Action(
            "diagnose.start", "d", "start", "Diagnose", "diagnose the chosen dive, in a process of its own"
        ),
        Action(
            "diagnose.check", "c", "check", "Check on", "the next older dive to check it on, then none", LOOKS
        ),
        Action("diagnose.section", "s", "section", "Section", "the next section, where not all fit", LOOKS),
        Action("diagnose.cancel", "x", "cancel", "Cancel", "end the diagnosis that runs"),
        Action(
            "diagnose.parameters", "p", "parameters", "Parameters", "what it would upload, beside the vehicle"
        ),
    )
    BINDINGS = bindings(ACTIONS)  # type: ignore[assignment]
    LEGEND: ClassVar[tuple[tuple[str, str], ...]] = (
        ("░ ▒ ▓ █", "0.5, 3, 10, 30 % of the squared gap and more"),
        ("floors", "drift over what noise alone gives: 1 is no gap, 0.8 to 1.2 is noise"),
        ("nats", "what held-out pieces gain by a cause; its bar is logarithmic"),
    )

    def __init__(self, title: str, tabs: Sequence[Tab]) -> None:
        super().__init__(title, tabs)
        self._kept: Kept[Answer] = Kept(answer)
        self._other = 0

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        if action == "check":
            return not self.at_work and bool(self.others)
        if action == "parameters":
            accepted = self.dive is not None and newer(self.dive / PARAM, self.dive / JSON)
            return not self.at_work and accepted and self.unkept is None
        return super().check_action(action, parameters)

    def action_check(self) -> None:
        self._other = (self._other + 1) % (len(self.others) + 1)
        self.draw()

    async def action_parameters(self) -> None:
        if self.dive is not None:
            self.desk.param = self.dive / PARAM
            await self.begin_on("parameters")

    def comparable(self, dive: Path) -> tuple[Path, ...]:
        return tuple(filter(can_check, super().comparable(dive)))

    def on_other_dive(self) -> None:
        self._other = 0

    def result(self) -> Answer | None:
        return self._kept.read(self.dive / JSON, self.unkept) if self.dive is not None else None

    def verdict(self, cells: int) -> Lines:
        diagnosis = self.result()
        return diagnose_lines.verdict(diagnosis, cells) if diagnosis is not None else ()

    def section(self, name: str, cells: int, rows: int) -> Lines:
        del rows
        diagnosis = self.result()
        return MAKES[name](diagnosis, cells) if diagnosis is not None else ()

    def aim(self) -> tuple[str, str]:
        check = self._check_dive()
        return "diagnoses", "without a check dive" if check is None else f"checked on {check.name}"

    def words(self, dive: Path, vehicle: str) -> tuple[str, ...]:
        check = self._check_dive()
        leaves = (("--json", JSON), ("--report", REPORT), ("--accept", PARAM))
        outputs = (word for option, name in leaves for word in (option, str(dive / name)))
        checked = ("--check", str(check)) if check is not None else ()
        return (self.VERB, str(dive), "--vehicle", vehicle, *checked, *outputs)

    def _check_dive(self) -> Path | None:
        return self.others[self._other] if self._other < len(self.others) else None
