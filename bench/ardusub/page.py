"""`python -m bench ardusub`: dives of the real firmware with the companion, identified and diagnosed, into
docs/ardusub.md.

Recordings and figures of a case are kept in runs/, so that a run that was stopped goes on. A dive is flown again if the
code that flew it has changed, and read again if the code that identified it has.
`python -m bench.ardusub CASE ...` measures only these cases, into runs/.
"""

import json
import subprocess
import sys
from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any, Final

import numpy as np

from bench.ardusub.cases import CASES, PLAIN, recording_of, truth_of, versions
from bench.ardusub.firmware import WHY_NOT, firmware_path
from bench.ardusub.flight import vehicle_file
from bench.ardusub.following import ALONE
from bench.ardusub.following import measured as measured_following
from bench.ardusub.planned import EACH, WIDEST
from bench.ardusub.planned import measured as measured_plan
from bench.stamp import CURVES, ROOT, files, stamp
from bench.words import blocks, percent
from bench.words import table as bench_table
from bridge import exit_codes
from bridge.errors import FitError
from bridge.files import write_whole
from bridge.simulator.truth import Truth
from bridge.vehicle.coefficients import DAMPINGS, DOFS, MASSES, QUADRATICS

SOURCES: Final = (
    "bench/ardusub", "bench/ardusub/*.yaml", "bench/operation/flying.py", "bridge", "bridge/ardusub/applet.lua",
    "gcs_plugin/flying", "identify", "tui/flight_recording.py", "configs/vehicles/bluerov2.yaml", CURVES,
)  # fmt: skip
"""The code that the figures of the real firmware's dives depend on (`bench.stamp`)."""
PLANS: Final = ("bench/operation/flying.py", "gcs_plugin/flying", "identify/planning", "identify/run/plan.py")
"""Of that, the code that bears on a flown plan alone."""

BEGIN: Final = "<!-- written by python -m bench ardusub -->"
BEGIN_FOLLOWED: Final = "<!-- the ways to follow the sticks, written by python -m bench ardusub -->"
END: Final = "<!-- end -->"
PUSHED_DOFS: Final = (0, 1, 2, 5)
PLAIN_DIVES: Final = 5
"""Dives with nothing planted, each in another sea: eight intervals of one dive tell little of how often they hold."""

PLANNED, FOLLOWING = "planned", "following"


def page(runs: Path, docs: Path) -> str:
    """Write the tables into docs/ardusub.md, and return a line for the page of all benchmarks.

    Where no firmware is at hand, they stay as they are.
    """
    path = firmware_path()
    if path is None:
        return f"Dives of the real ArduSub: [their table](ardusub.md#figures). Not measured anew: {WHY_NOT}."
    results = {name: measured(path, runs / "ardusub", name) for name in (*CASES, PLANNED, FOLLOWING)}
    target = docs / "ardusub.md"
    flown = f"Flown with ArduSub {' and '.join(versions(runs / 'ardusub'))}."
    text = with_block(target.read_text(encoding="utf-8"), BEGIN, f"{flown}\n\n{table(results)}")
    write_whole(target, with_block(text, BEGIN_FOLLOWED, followed(results[FOLLOWING])))
    return "Dives of the real ArduSub, its companion beside it: [their table](ardusub.md#figures)."


def with_block(text: str, begin: str, lines: str) -> str:
    """The text with `lines` between the mark `begin` and the next end."""
    before, _, after = text.partition(begin)
    return f"{before}{begin}\n{lines}\n{END}{after.partition(END)[2]}"


def measured(path: Path, runs: Path, name: str) -> dict[str, Any]:
    """The figures of a case, from runs/ where its code has not changed."""
    kept = runs / f"{name}-{_stamp_of(name)}.json"
    if kept.exists():
        return dict(json.loads(kept.read_text(encoding="utf-8")))
    if name == PLANNED:
        figures = measured_plan(path, runs / name, truth_of(CASES[PLAIN]))
    elif name == FOLLOWING:
        figures = measured_following(path, runs / name)
    elif name == PLAIN:
        recordings = [recording_of(path, runs, name, seed) for seed in range(1, PLAIN_DIVES + 1)]
        axes = identified([answer_of("identify", each) for each in recordings], truth_of(CASES[name]))
        figures = {"axes": axes, "answers": [diagnosed(answer_of("diagnose", each)) for each in recordings]}
    else:
        first = recording_of(path, runs, name, 1)
        model = first.parents[1] / "accepted.param"
        model.unlink(missing_ok=True)
        figures = diagnosed(answer_of("diagnose", first, "--accept", str(model)))
        accepted = ("--accepted", str(model), "--despite-doubts") if model.exists() else ()
        figures["log"] = diagnosed(answer_of("diagnose", log_of(first)))
        figures["after"] = diagnosed(answer_of("diagnose", recording_of(path, runs, name, 2), *accepted))
    write_whole(kept, json.dumps(figures, indent=1) + "\n")
    return figures


def _stamp_of(name: str) -> str:
    if name == PLANNED:
        return stamp(*SOURCES)
    plans = set(files(*PLANS))
    return stamp(*(str(path.relative_to(ROOT)) for path in files(*SOURCES) if path not in plans))


def log_of(recording: Path) -> Path:
    """The autopilot's own log of a dive."""
    return min((recording.parents[1] / "logs").glob("*.BIN"))


def answer_of(verb: str, recording: Path, *options: str) -> dict[str, Any]:
    """What `seatrial identify` or `diagnose` answers to a recording, as its JSON."""
    folder = recording.parents[1]
    file, out = vehicle_file(folder), folder / f"{verb}.json"
    method = ["--method", "likelihood"] if verb == "identify" else []
    command = [
        sys.executable,
        "-m",
        "tui",
        verb,
        str(recording),
        "--vehicle",
        str(file),
        *method,
        *options,
        "--json",
        str(out),
    ]
    out.unlink(missing_ok=True)
    # Code 1: an answer with doubts, or none.
    code = subprocess.run(command, cwd=ROOT, check=False, stdout=subprocess.DEVNULL).returncode
    if code not in (exit_codes.DONE, exit_codes.NO) or not out.exists():
        raise FitError(f"seatrial {verb} ended with {code}", of=str(recording))
    answer: dict[str, Any] = json.loads(out.read_text(encoding="utf-8"))
    return answer


def identified(answers: Sequence[dict[str, Any]], truth: Truth) -> dict[str, Any]:
    """Mass, and drag at the dive's usual speed, of each degree of freedom that was pushed.

    Each is [true, value, low, high] by dive, with the interval that holds if the thrust is exact.
    """
    figures: dict[str, Any] = {DOFS[dof]: {"mass": [], "drag": [], "speed": []} for dof in PUSHED_DOFS}
    for answer, dof in product(answers, PUSHED_DOFS):
        of_axis = figures[name := DOFS[dof]]
        mass = next(each for each in answer["parameters"] if each["name"] == MASSES[dof].name)
        drag = next(each for each in answer["drag_forces"] if each["axis"] == name)
        speed = drag["speed"]
        true_drag = (truth.model[DAMPINGS[dof].name] + truth.effects[QUADRATICS[dof].name] * speed) * speed
        interval = [mass["given_thrust"], mass["given_thrust_low95"], mass["given_thrust_high95"]]
        of_axis["mass"].append([truth.model[mass["name"]], *interval])
        of_axis["drag"].append([true_drag, drag["force"], drag["low95"], drag["high95"]])
        of_axis["speed"].append(speed)
    return figures


def diagnosed(answer: dict[str, Any]) -> dict[str, Any]:
    """The verdict, and the causes that are more probable than not, with their sizes."""
    causes = [each for each in answer["effects"] if each["probability"] > 0.5]
    return {"verdict": answer["verdict"], "causes": [_sized(each) for each in causes]}


def _sized(cause: dict[str, Any]) -> str:
    sizes = (
        f"{name} {size['value']:.3g} {'' if size['unit'] == '1' else size['unit']}".rstrip()
        for name, size in cause["parameters"].items()
    )
    return f"{cause['name']} ({', '.join(sizes)})"


def table(results: dict[str, dict[str, Any]]) -> str:
    rows = []
    for name, figures in results[PLAIN]["axes"].items():
        turns = name == DOFS[5]
        units = ("kg m2", "N m") if turns else ("kg", "N")
        speed = f"{figures['speed'][0]:.2g} {'rad/s' if turns else 'm/s'}"
        for words, unit, dives in (
            (f"mass in {name}" if not turns else "inertia in yaw", units[0], figures["mass"]),
            (f"drag in {name} at {speed}", units[1], figures["drag"]),
        ):
            off = ", ".join(f"{100 * (value / true - 1):+.1f}" for true, value, _, _ in dives)
            half = max(50 * (high - low) / true for true, _, low, high in dives)
            holding = sum(low <= true <= high for true, _, low, high in dives)
            rows.append(
                (
                    words,
                    f"{dives[0][0]:.3g} {unit}",
                    f"{off} %",
                    f"{half:.2g} %",
                    f"{holding} of {len(dives)}",
                )
            )
    head = ("plan flown by sticks, recorded by the companion", "true", "identified is off by, dive by dive")
    identifications = bench_table((*head, "95 % given the thrust, ±", "inside"), rows)
    rows = [
        (CASES[name].words, *(_answered(each) for each in (figures, figures["log"], figures["after"])))
        for name, figures in results.items()
        if name not in (PLAIN, PLANNED, FOLLOWING)
    ]
    head = (
        "planted in the body",
        "named",
        "by the autopilot's `.BIN` alone",
        "the next dive, with that accepted",
    )
    plain = Counter(map(_answered, results[PLAIN]["answers"]))
    nothing = ", ".join(f"{words} ({count})" for words, count in plain.most_common())
    return blocks(
        identifications,
        bench_table(head, rows),
        f"Of the {plain.total()} dives with nothing planted it says: {nothing}.",
        flown_by_itself(results[PLANNED]),
    )


def flown_by_itself(figures: Mapping[str, Any]) -> str:
    """How long the companion's plan took to know as much as laps by hand, as Markdown; of several flights the slowest,
    and the widest intervals."""
    names, hand_s, by_way = list(figures["hand"]), figures["hand_s"], figures["flights"]
    known_s = {way: [flight["known_s"] for flight in flights] for way, flights in by_way.items()}
    rows = [("laps by sticks, all of them", f"{hand_s:.0f} s", *map(percent, figures["hand"].values()))]
    for way, words in (
        (WIDEST, "every mass is known to the widest of these"),
        (EACH, "each mass is known as by laps"),
    ):
        widest = [max(flight["flown"][name] for flight in by_way[way]) for name in names]
        words = f"`fly` until {words}, the worst of {len(by_way[way])} flights"
        rows.append((words, f"{max(known_s[way]):.0f} s", *map(percent, widest)))
    every = [flight for flights in by_way.values() for flight in flights]
    masses = [mass for flight in every for mass in flight["masses"].values()]
    off = max(abs(value / true - 1) for true, value, _, _ in masses)
    holding = sum(low <= true <= high for true, _, low, high in masses)
    shares = {
        way: f"1/{hand_s / max(took):.1f} to 1/{hand_s / min(took):.1f}" for way, took in known_s.items()
    }
    return blocks(
        bench_table(("known to, % of the value", "after", *names), rows),
        f"The widest of the laps' intervals of a mass was {percent(figures['share'])} %: for that `fly` took "
        f"{shares[WIDEST]} of their time, and for each mass as by laps {shares[EACH]}, "
        f"{np.mean([flight['identify_s'] for flight in every]):.0f} s of it for each identification beside it. The "
        f"masses of these flights were off by {100 * off:.1f} % at most, and {holding} of {len(masses)} of their "
        "intervals hold the truth.",
    )


def followed(figures: Mapping[str, Any]) -> str:
    """How far the velocity was off its reference by each way to fly, as Markdown."""
    alone, latest_s = figures["off"][ALONE], figures["latest_s"]
    script = (
        "This firmware keeps overrides for ever: the applet adds nothing there."
        if latest_s is None
        else f"The latest tick of the applet's script came after {1e3 * latest_s:.0f} ms."
    )
    rows = [
        (
            words,
            *(f"{1e3 * off:.1f} mm/s" for off in by_axis),
            ", ".join(f"1/{of / off:.1f}" for of, off in zip(alone, by_axis, strict=True)),
        )
        for words, by_axis in figures["off"].items()
    ]
    return blocks(
        bench_table(("velocity against the reference, rms", "surge", "sway", f"of {ALONE}"), rows),
        f"{script} Flown with ArduSub {figures['version']}.",
    )


def _answered(figures: Mapping[str, Any]) -> str:
    return f"{figures['verdict']}: {', '.join(figures['causes']) or 'nothing'}"
