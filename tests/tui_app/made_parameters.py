"""A vehicle beside what was identified of it, verbs that answer with it or wait, and its screen with keys typed."""

import asyncio
from dataclasses import replace
from pathlib import Path

from made_dives import OUT
from made_view import FixedViews, view
from screen_text import made, play, pressed, run, text
from textual.widgets import Input

from bridge.reports import WRITING, Report, Written
from bridge.vehicle.coefficients import BY_NAME
from gcs_plugin.watch.picture import Armed
from tui.app.desk import Desk
from tui.app.jobs import Done, Jobs

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
    return [row(name, *told) for name, told in VALUES.items()]


def plan(**what):
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
    } | what


def way_back():
    values = [(name, told[1], told[0], told[2], told[0], "") for name, told in VALUES.items()]
    rows = [{**row(*told), "low95": None, "high95": None, "change": None} for told in values]
    return plan(file=str(BEFORE), of="", outcome="", notes=[], parameters=rows)


def receipt(outcome="applied", sentence="7 parameters written and read back, set 13247 is active", failed=()):
    lines = [
        {
            "name": one["name"],
            "before": one["present"],
            "target": one["target"],
            "after": one["present"] if one["name"] in failed else one["target"],
            "outcome": "refused" if one["name"] in failed else "applied",
            "sentence": f"{one['name']} refused: the vehicle permits it not" if one["name"] in failed else "",
        }
        for one in rows()
    ]
    kept = "receipts/2026-11-21T085300Z-before.param"
    return {"outcome": outcome, "sentence": sentence, "parameters": lines, "preimage": kept}


def told_lines(count, share):
    of = WRITING
    names = [one["name"] for one in rows() if one["verdict"] == "changed"][:count]
    lines = [
        Report(of, share, name, written=Written(name, "applied", "111.52 read back equal")) for name in names
    ]
    return (*lines, Report(of, share, "staging"))


def staged(changed=(), active_crc=0.0):
    """The plan where the vehicle holds all lines but some, and does not fly them."""
    told = [
        one
        if one["name"] in changed
        else {**one, "present": one["target"], "verdict": "staged", "change": 0.0}
        for one in plan()["parameters"]
    ]
    return plan(parameters=told, active_crc=active_crc, staged_crc=8205)


class FakeVehicle:
    """Answers `params diff`, a dry roll back, and writes; `waits` makes a write wait after it told `tells`.

    `silent` makes a reading wait.
    """

    def __init__(
        self, compared=None, back=None, written=None, code=0, said=(), tells=(), waits=False, silent=False
    ):
        self.compared = plan() if compared is None else compared
        self.back = way_back() if back is None else back
        self.written = receipt() if written is None else written
        self.code, self.said, self.tells, self.waits = code, said, tells, waits
        self.words, self.go, self.speaks = [], asyncio.Event(), asyncio.Event()
        if not silent:
            self.speaks.set()

    @property
    def writes(self):
        return [words for words in self.words if "--yes" in words]

    async def __call__(self, words, hear):
        self.words.append(words)
        if "--yes" not in words:
            await self.speaks.wait()
            result = self.back if words[1] == "rollback" else self.compared
            return Done(0 if result else 3, result or None, errors=tuple(self.said))
        for told in self.tells:
            hear(told)
        if self.waits:
            await self.go.wait()
        return Done(self.code, self.written or None, errors=tuple(self.said))


def desk(vehicle=None, now_s=lambda: 0.0, **what):
    jobs = Jobs(vehicle or FakeVehicle(), now_s)
    return Desk("ruvifist:hovering", OUT, dive=PARAM.parent, param=PARAM, jobs=jobs, **what)


SIZES = ((80, 24), (160, 50))
NARROW = SIZES[0]


def views(armed=Armed.DISARMED, ff_mode=1):
    made_view = view()
    return FixedViews(replace(made_view, picture=replace(made_view.picture, armed=armed, ff_mode=ff_mode)))


async def done(app, pilot):
    """Until nothing runs, and it is shown."""
    while any(app.desk.jobs.runs(verb) for verb in ("params diff", "params upload")):
        await pilot.pause()
    app._show()
    await pilot.pause()
    while app.screen.has_class("-asking") and not isinstance(app.focused, Input):
        await pilot.pause()


async def typed(app, pilot, *keys):
    for key in keys:
        await pressed(pilot, key)
        await done(app, pilot)


def on_screen(vehicle, *steps, size=NARROW, shown=None, **what):
    """Open the screen of that vehicle, and play the steps."""

    async def begin(app, pilot):
        await typed(app, pilot, "5")
        await play(app, pilot, done, *steps)

    run(made(shown or views(), desk=desk(vehicle, **what)), size, begin)


def line_of(app, name):
    return next(line for line in text(app).splitlines() if name in line)


def has(name, *words):
    """Whether the line of that name ends with these words."""
    return lambda app: tuple(line_of(app, name).split()[-len(words) :]) == words
