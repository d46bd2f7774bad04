"""The code that the figures of the diagnosis depend on (`bench.stamp`)."""

from bench.field.sources import MADE
from bench.stamp import Part, reached

ANSWERS = (
    "bench/diagnosis/plan.py",
    *reached("bench/diagnosis/trials.py"),
    "configs/thrusters/*.csv",
)
SPEED = (*ANSWERS, *reached(*MADE, "bench/diagnosis/speed.py", "tui/commands/diagnose.py"))
SECTION = (*SPEED, *reached(*(f"bench/diagnosis/{name}.py" for name in ("goals", "page", "tables"))))
CARRIED = ("identify/effects/", "bridge/vehicle/")


def _decides(path: str) -> bool:
    return path.startswith(CARRIED) or not path.startswith(
        ("bridge/", "identify/ingest/", "identify/report/")
    )


DECIDED = (Part((*ANSWERS, "identify/challenge/score.py"), _decides),)
"""Code that plants an effect and names it, without the link and the files between: its values are tested separately,
and a change there does not discard rows of the power curves, which take hours."""
POWER = (*DECIDED, *(f"bench/diagnosis/{name}.py" for name in ("goals", "power", "tables")))
