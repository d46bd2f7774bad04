"""The code that the figures of the diagnosis hang on (`bench.stamp`)."""

from bench.stamp import ROOT, files, reached

ANSWERS = (
    "bench/diagnosis/plan.py",
    *reached("bench/diagnosis/recorded.py", "bench/diagnosis/trials.py"),
    "configs/thrusters/*.csv",
)
RIVALS = (*ANSWERS, *reached(*(str(file.relative_to(ROOT)) for file in files("bench/diagnosis/rivals"))))
SPEED = (*ANSWERS, "bench/diagnosis/speed.py", "tui/commands/diagnose.py")
_PAGE = tuple(f"bench/diagnosis/{name}.py" for name in ("beside", "goals", "page", "tables"))
SECTION = (*SPEED, *_PAGE, "bench/diagnosis/rivals")
CARRIED = ("bridge/effects/", "bridge/vehicle/")
DECIDED = tuple(
    source
    for source in ANSWERS
    if source.startswith(CARRIED)
    or not source.startswith(("bridge/", "identify/ingest/", "identify/report/"))
)
"""What plants an effect and names it, without the wire and the files between: a row of the power curves, hours of
work, is not given up for those, whose values are tested by themselves."""
POWER = (*DECIDED, *(f"bench/diagnosis/{name}.py" for name in ("goals", "power", "tables")))
