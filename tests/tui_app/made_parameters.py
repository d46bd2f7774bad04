"""A vehicle beside what was identified of it, verbs that answer with it or wait, and its screen with keys typed."""

from dataclasses import replace
from pathlib import Path

from fake_verbs import FakeVerbs
from fake_verbs import desk as desk_of
from made_dives import OUT
from made_view import FixedViews, view
from screen_text import NARROW, played, text

from bridge.reports import WRITING, Report, Written
from bridge.vehicle.coefficients import BY_NAME
from gcs_plugin.watch.picture import Armed

PARAM = OUT / "2026-11-21T0352Z-hovering" / "identified.param"
BEFORE = Path("receipts/2026-11-20T101500Z-before.param")
VALUES = {
    # coefficient: on the vehicle, in the file, half of its interval, last accepted, what is doubted
    "M_u": (96.5, 111.52, 2.1, 96.5, ""),
    "M_v": (150.0, 151.24, 3.25, 150.0, ""),
    "M_w": (160.0, 187.9, 4.4, None, "depth was never pushed for longer than 4 s"),
    "I_r": (8.25, 9.03, 0.21, 8.25, ""),
    "D_u": (41.0, 41.0, 1.2, 41.0, ""),
    "D_v": (60.0, 66.6, 5.1, 60.0, ""),
    "D_w": (88.0, 80.4, 6.2, None, ""),
    "D_r": (3.1, 3.42, 0.09, 3.1, ""),
}


def row(name, present, target, half, accepted, doubted, verdict=None, reason=""):
    known = BY_NAME[name]
    return {
        "name": known.parameter_id(1),
        "coefficient": name,
        "sentence": known.sentence,
        "unit": known.unit,
        "present": present,
        "target": target,
        "low95": target - half,
        "high95": target + half,
        "accepted": accepted,
        "accepted_at": None if accepted is None else "2026-11-20T101500Z",
        "change": (target - present) / half,
        "verdict": verdict or ("same" if present == target else "changed"),
        "reason": reason,
        "doubted": doubted,
    }


def rows():
    return [row(name, *values) for name, values in VALUES.items()]


def plan(**changed):
    return {
        "summary": "8 parameters: 7 changed, 1 same",
        "file": str(PARAM),
        "of": "hovering",
        "outcome": "converged",
        "vehicle": {"system": 1, "component": 1, "armed": False},
        "ff_mode": 1.0,
        "writes": True,
        "active_crc": 4711.0,
        "staged_crc": 4711,
        "needs_disarmed": True,
        "obstacle_armed": "",
        "notes": ["from hovering of ruvifist, configuration hovering, by pinn: converged"],
        "parameters": rows(),
    } | changed


def way_back():
    values = [
        (name, target, present, half, present, "") for name, (present, target, half, *_) in VALUES.items()
    ]
    rows = [{**row(*line), "low95": None, "high95": None, "change": None} for line in values]
    return plan(file=str(BEFORE), of="", outcome="", notes=[], parameters=rows)


def receipt(outcome="applied", sentence="7 parameters written and read back, set 13247 is active", failed=()):
    lines = [
        {
            "name": line["name"],
            "before": line["present"],
            "target": line["target"],
            "after": line["present"] if line["name"] in failed else line["target"],
            "outcome": "refused" if line["name"] in failed else "applied",
            "sentence": f"{line['name']} refused: the vehicle permits it not"
            if line["name"] in failed
            else "",
        }
        for line in rows()
    ]
    kept = "receipts/2026-11-21T085300Z-before.param"
    return {"outcome": outcome, "sentence": sentence, "parameters": lines, "preimage": kept}


def lines_written(count, share):
    """The reports of an upload that has written so many lines."""
    names = [line["name"] for line in rows() if line["verdict"] == "changed"][:count]
    return tuple(
        Report(WRITING, share, name, "STAGE", written=Written(name, "applied", "111.52 read back equal"))
        for name in names
    )


def staged(changed=(), active_crc=0.0):
    """The plan where the vehicle holds all lines but some, and does not fly them."""
    lines = [
        line
        if line["name"] in changed
        else {**line, "present": line["target"], "verdict": "staged", "change": 0.0}
        for line in rows()
    ]
    return plan(parameters=lines, active_crc=active_crc, staged_crc=8205)


class FakeVehicle(FakeVerbs):
    """Answers `params diff` with `compared`, a dry roll back with `back`, and writes with `written`, which ends by
    `code` and `errors`; `waits` makes a write, `silent` a reading wait to be let go.
    """

    def __init__(self, compared=None, back=None, written=None, waits=False, silent=False, **how):
        super().__init__(self._answer, **how)
        self.compared = plan() if compared is None else compared
        self.back = way_back() if back is None else back
        self.written = receipt() if written is None else written
        self._held = [is_write for is_write in (True, False) if (waits if is_write else silent)]

    @property
    def writes(self):
        return [words for words in self.words if "--yes" in words]

    def _answer(self, words):
        if "--yes" in words:
            return self.written or None
        return (self.back if words[1] == "rollback" else self.compared) or None

    def _waits(self, words):
        return ("--yes" in words) in self._held


def desk(vehicle=None, **options):
    return desk_of(vehicle or FakeVehicle(), dive=PARAM.parent, param=PARAM, **options)


def views(armed=Armed.DISARMED, ff_mode=1):
    made_view = view()
    return FixedViews(replace(made_view, picture=replace(made_view.picture, armed=armed, ff_mode=ff_mode)))


def on_screen(vehicle, *steps, shown=None, size=NARROW, **options):
    """Open the screen of that vehicle, and play the steps."""
    return played(desk(vehicle, **options), "5", *steps, views=shown or views(), size=size)


def line_of(app, name):
    return next(line for line in text(app).splitlines() if name in line)


def has(name, *words):
    """Whether the line of that name ends with these words."""
    return lambda app: tuple(line_of(app, name).split()[-len(words) :]) == words
