"""The code that the figures of the field dives depend on (`bench.stamp`)."""

from bench.stamp import reached

MADE = tuple(
    f"bench/field/{name}.py"
    for name in (
        "autopilot", "dive", "draw", "export", "mission", "planted_effects", "scenario", "simulate", "vehicle",
    )
)  # fmt: skip
ANSWERS = (
    *reached(
        *MADE,
        "bench/baselines/regression.py",
        "bench/field/regressions.py",
        "bench/field/answers.py",
        "identify/diagnose/result.py",
        "identify/diagnose/diagnose.py",
        "identify/ingest/open.py",
        "tui/commands/diagnose.py",
    ),
    "configs/thrusters/*.csv",
)
"""Code that makes, diagnoses and predicts the dives, all that the command runs through."""

SECTION = (
    *ANSWERS,
    *reached("bench/field/score.py", "bench/field/section.py", "bench/diagnosis/goals.py"),
)
GROUND_STATION = (*SECTION, "bench/field/ground_station.py")
