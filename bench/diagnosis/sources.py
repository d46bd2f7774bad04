"""The code that the figures of the diagnosis hang on (`bench.stamp`), named apart from what it imports."""

ANSWERS = (
    "bench/diagnosis/plan.py",
    "bench/diagnosis/trials.py",
    "bridge/*.py",
    "bridge/effects",
    "bridge/messages",
    "bridge/vehicle",
    "configs/thrusters/*.csv",
    "identify/*.py",
    "identify/challenge",
    "identify/diagnose",
    "identify/estimators",
    "identify/ingest",
    "identify/report/text.py",
)
RIVALS = (*ANSWERS, "bench/diagnosis/rivals")
SPEED = (*ANSWERS, "bench/diagnosis/speed.py", "tui/commands/diagnose.py")
_PAGE = tuple(f"bench/diagnosis/{name}.py" for name in ("beside", "goals", "page", "tables"))
SECTION = (*SPEED, *_PAGE, "bench/diagnosis/rivals")
POWER = (*ANSWERS, *_PAGE)
