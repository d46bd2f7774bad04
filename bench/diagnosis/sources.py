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
POWER = (*ANSWERS, *(f"bench/diagnosis/{name}.py" for name in ("goals", "power", "tables")))
