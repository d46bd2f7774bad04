"""Runs the diagnosis on dives with a drawn force, and on dives with one effect of its library, and judges it."""

from dataclasses import dataclass
from typing import Any

from bench.diagnosis.trials import effects_for, recorded_dive
from bench.remembered import Data
from bench.unknown.planted import unknown_of
from bridge.errors import SeatrialError
from bridge.vehicle.coefficients import DOFS
from identify.challenge.case import Case, draw_case
from identify.challenge.planted_effects import ABSORBED, PLANTS
from identify.diagnose.diagnose import diagnose
from identify.diagnose.result import plain

KNOWN = tuple(name for name in PLANTS if name not in ABSORBED)
"""The effects that remain visible after a refit."""

LIKELY = 0.5
"""Least probability at which a cause counts as named."""


@dataclass(frozen=True)
class Judged:
    """A dive with its verdict, `refused` if the diagnosis gave none.

    hidden: name of the effect, "" for a drawn force; parts, dofs, multiple: the force's grammar, degrees of freedom
    and drift in floors; causes: the likely causes; where: degrees of freedom of the reported unexplained remainder.
    """

    seed: int
    hull: str
    hidden: str
    parts: dict[str, str]
    dofs: tuple[str, ...]
    multiple: float
    verdict: str
    causes: tuple[str, ...]
    where: tuple[str, ...]

    @property
    def right_axis(self) -> bool:
        """Whether the reported remainder lies in a degree of freedom of the force."""
        return bool({*self.dofs} & {*self.where})

    @property
    def called(self) -> bool:
        """Whether the dive is said to hold an unexplained force: verdict unknown, or partly with the right degree of
        freedom."""
        return self.verdict == "unknown" or (self.verdict == "partly" and self.right_axis)


def unknown_job(seed: int) -> Data:
    """Diagnose a drawn force."""
    unknown = unknown_of(seed)
    sentence = unknown.sentence
    parts = {
        "goes with": sentence.goes_with,
        "parity": sentence.parity,
        "memory": sentence.memory,
        "timing": sentence.timing,
        "rhythm": sentence.rhythm,
    }
    dofs = [DOFS[dof] for dof in sentence.dofs]
    return _diagnosed(unknown.case) | {"parts": parts, "dofs": dofs, "multiple": unknown.multiple}


def known_job(seed: int, name: str) -> Data:
    """Diagnose an effect of the library, planted in another form than the library's."""
    return _diagnosed(draw_case(seed, kind="one", names=(name,))) | {"hidden": name}


def _diagnosed(case: Case) -> Data:
    dive = recorded_dive(case)
    try:
        answer = plain(
            diagnose(
                dive, case.file, case.configuration, effects=effects_for(case), progress=lambda *_report: None
            )
        )
    except SeatrialError as error:
        answer = {"verdict": "refused", "effects": [], "character": None, "why": str(error)}
    return {"seed": case.seed, "hull": case.configuration, "answer": answer}


def judged(data: Data) -> Judged:
    answer: dict[str, Any] = data["answer"]
    likely = [effect["name"] for effect in answer["effects"] if (effect["probability"] or 0.0) >= LIKELY]
    return Judged(
        data["seed"],
        data["hull"],
        data.get("hidden", ""),
        data.get("parts", {}),
        tuple(data.get("dofs", ())),
        data.get("multiple", 0.0),
        answer["verdict"],
        tuple(likely),
        tuple((answer["character"] or {}).get("dof", ())),
    )
