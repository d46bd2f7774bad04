"""A made list of dives as `seatrial dives --json` gives it."""

import math
from pathlib import Path

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.vehicle.coefficients import COEFFICIENTS, DOFS
from bridge.wire.framing import Encoder

BEGAN_UNIX_S = 1_795_236_720.0  # 2026-11-21 04:52 UTC
OUT = Path("dives")


def excitation(**std):
    known = {c.name: std.get(c.name, 0.007) for c in COEFFICIENTS}
    return [
        {"name": name, "relative_std": value if math.isfinite(value) else None, "identifiable": value <= 0.3}
        for name, value in known.items()
    ]


def axes(thrust=46.0, speed=0.8):
    return [
        {"axis": axis, "seconds": 805.9, "thrust": thrust / (n + 1), "speed": speed / (n + 1)}
        for n, axis in enumerate(DOFS)
    ]


def dive(name, hours_earlier=0.0, **changed):
    date = {0: "2026-11-21T0452Z", 1: "2026-11-21T0352Z", 26: "2026-11-20T0252Z"}.get(hours_earlier, "old")
    return {
        "folder": str(OUT / f"{date}-{name}"),
        "name": name,
        "began_unix_s": BEGAN_UNIX_S - 3600 * hours_earlier,
        "duration_s": 807.0,
        "size_bytes": 16_949_608,
        "loss": 0.012,
        "excitation": excitation(),
        "axes": axes(),
        **dict.fromkeys(("why_not", "error", "stray", "restarts", "lacking", "unheard"), ""),
        **dict.fromkeys(("damaged", "underway"), ""),
        "unheard_s": 0.0,
        "notes": "",
        "conditions": "",
        "events": [],
        "learnt": [],
        "worked_on": [],
    } | changed


def record(path, *unix_s):
    """A recording with a heartbeat at each of these times."""
    frame = Encoder(1, 1).encode(dialect.MAVLink_heartbeat_message(12, 3, 0, 0, 4, 3))
    path.write_bytes(b"".join(round(1e6 * stamp).to_bytes(8, "big") + frame for stamp in unix_s))


DECK = dive(
    "deck",
    duration_s=41.0,
    excitation=excitation(**{c.name: math.inf for c in COEFFICIENTS}),
    axes=axes(0.0, 0.0),
)
HOVERING = dive(
    "hovering",
    1,
    notes="new propellers\nat the quay",
    events=["2026-11-21T03:58:12Z tether caught on the ladder"],
    excitation=excitation(M_w=0.12, I_p=0.5, I_q=math.inf, D_q=0.31),
    learnt=["page identified.html", "identified by likelihood: converged", "parameters identified.param"],
    worked_on=["identified"],
)
DAMAGED = dive(
    "survey",
    26,
    duration_s=None,
    loss=None,
    excitation=None,
    axes=[],
    error="dives/2026-11-20T0252Z-survey/telemetry.tlog: holds no MAVLink frame; check that it is the right file",
)
DIVES = [DAMAGED, HOVERING, DECK]
