"""`seatrial plan`: what to dive next, and how well each parameter would be known after it."""

import argparse
import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tui import exit_codes, numbers

if TYPE_CHECKING:
    from bridge.vehicle.config import VehicleFile
    from identify.dive import Dive
    from identify.planning.knowledge import Knowledge
    from identify.planning.propose import Proposal
    from tui.show import Table

EXAMPLE = "seatrial plan --vehicle ruvifist:hovering --after hovering.json --out plan.yaml"
AXES = {"surge": 0, "sway": 1, "heave": 2, "yaw": 5}
JSON_SUFFIX = ".json"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--vehicle", required=True, metavar="FILE[:CONFIGURATION]", help="the vehicle file")
    parser.add_argument(
        "--after",
        metavar="DIVE",
        help="start from what this dive tells: a recording, or the JSON that identify wrote of one",
    )
    parser.add_argument("--columns", metavar="MAP", help="YAML map from the columns of a CSV to signals")
    parser.add_argument(
        "--minutes", type=numbers.above_zero, default=5.0, metavar="N", help="time in all (default: 5)"
    )
    parser.add_argument(
        "--space", type=numbers.above_zero, default=6.0, metavar="METRES", help="room across (default: 6)"
    )
    parser.add_argument(
        "--speed",
        type=numbers.above_zero,
        default=0.5,
        metavar="M_S",
        help="fastest, in m/s; up and down half of it (default: 0.5)",
    )
    parser.add_argument(
        "--axes",
        nargs="+",
        choices=AXES,
        default=list(AXES),
        metavar="AXIS",
        help="surge sway heave yaw (all)",
    )
    parser.add_argument(
        "--out",
        default="plan.yaml",
        metavar="FILE",
        help="the mission, for simulate and for the crew; an older one is replaced (default: plan.yaml)",
    )
    parser.add_argument("--json", metavar="FILE", help="write the plan as JSON; - for standard output")


def run(arguments: argparse.Namespace) -> int:
    from bridge.vehicle.config import load_vehicle
    from identify.planning.limits import Limits, Tank
    from identify.planning.propose import propose
    from identify.planning.writing import mission_text, notes, to_json
    from tui import show
    from tui.outputs import check_file, check_files

    check_files({"--out": arguments.out, "--json": arguments.json})
    check_file("--out", arguments.out, (".yaml", ".yml"))
    check_plan(arguments.out)
    file = load_vehicle(arguments.vehicle)
    configuration, knowledge = known(file, arguments.after, arguments.columns)
    limits = Limits(arguments.space, arguments.speed)
    dofs = [AXES[axis] for axis in AXES if axis in arguments.axes]
    with show.progress("plan") as progress:
        proposal = propose(file, configuration, knowledge, limits, 60 * arguments.minutes, dofs, progress)
    title = f"{file.vehicle.name}, configuration {configuration}: {proposal.duration_s:.0f} s"
    spec = f"{arguments.vehicle.removesuffix(f':{configuration}')}:{configuration}"
    command = f"seatrial simulate --vehicle {spec} --mission {arguments.out}"
    tank = Tank(file, configuration, knowledge)
    Path(arguments.out).write_text(mission_text(proposal, title, command, tank), encoding="utf-8")
    console = show.results(arguments.json)
    show.put(console, manoeuvre_table(f"plan for {title}", proposal))
    show.put(console, interval_table(proposal, knowledge))
    for sentence in notes(knowledge):
        show.say(console, f"note: {sentence}")
    show.say(console, f"mission: {arguments.out}; dive it in simulation: {command}")
    found = to_json(proposal, knowledge, limits)
    about = {"name": file.vehicle.name, "sha256": file.sha256}
    show.write_json(
        {"vehicle": about, "configuration": configuration, "after": arguments.after, "mission": arguments.out, **found},
        arguments.json,
    )  # fmt: skip
    return exit_codes.DONE


def known(file: "VehicleFile", source: str | None, columns: str | None) -> "tuple[str, Knowledge]":
    """The configuration to plan for, and what is known of it."""
    from identify.ingest.open import read_dive
    from identify.planning.knowledge import after, before_any_dive

    if source is None:
        configuration = file.configuration or _only(file)
        return configuration, before_any_dive(file, configuration)
    if Path(source).suffix == JSON_SUFFIX:
        identified = identification(source)
        configuration = file.configuration or file.vehicle.configuration_named(
            str(identified.get("configuration"))
        )
    else:
        dive = read_dive(Path(source), Path(columns) if columns else None, file)
        configuration = file.configuration or file.vehicle.configuration_at(dive.configuration_index())
        identified = _identify(dive, file, configuration)
    return configuration, after(identified, file, configuration, source)


def _only(file: "VehicleFile") -> str:
    names = list(file.vehicle.configurations)
    if len(names) > 1:
        raise exit_codes.UsageError(
            f"vehicle '{file.vehicle.name}' has {', '.join(names)}; name one: --vehicle FILE:CONFIGURATION"
        )
    return names[0]


def check_plan(path: str) -> None:
    """Raise UsageError where a file stands that no plan wrote."""
    from identify.planning.writing import TITLE

    if Path(path).exists() and not Path(path).read_bytes().startswith(TITLE.encode()):
        raise exit_codes.UsageError(f"--out {path}: exists and is no plan, so it stays; name another file")


def identification(path: str) -> dict[str, Any]:
    """The JSON of one identification."""
    try:
        data = json.loads(Path(path).read_text(encoding="utf-8"))
    except (ValueError, UnicodeDecodeError):
        raise exit_codes.UsageError(f"--after {path}: is no JSON; give what identify --json wrote") from None
    if isinstance(data, list):
        raise exit_codes.UsageError(f"--after {path}: holds several dives; identify one, and give that")
    if not isinstance(data, dict):
        raise exit_codes.UsageError(f"--after {path}: is no identification; give what identify --json wrote")
    return data


def _identify(dive: "Dive", file: "VehicleFile", configuration: str) -> dict[str, Any]:
    from identify.estimators.table import DEFAULT, estimator
    from tui import show

    with show.progress(f"identify {dive.name}") as progress:
        return estimator(DEFAULT)(dive, file, configuration, progress).to_json()


def manoeuvre_table(title: str, proposal: "Proposal") -> "Table":
    """What to dive, in its order."""
    from identify.planning.writing import needs
    from tui import show

    return show.table(
        title,
        ("", "seconds", "needs", "manoeuvre"),
        [
            (str(number), f"{part.manoeuvre.duration_s:.0f}", needs(part), part.manoeuvre.sentence)
            for number, part in enumerate(proposal.parts, start=1)
        ],
        numbers=("seconds",),
    )


def interval_table(proposal: "Proposal", knowledge: "Knowledge") -> "Table":
    """How well each parameter is known before and after; those that nothing is or will be known of are left out."""
    from bridge.vehicle.coefficients import COEFFICIENTS
    from identify.planning.writing import interval
    from tui import show

    rows = []
    for coefficient, before, after in zip(COEFFICIENTS, proposal.before, proposal.after, strict=True):
        if math.isfinite(after):
            value = knowledge.values[coefficient.name]
            then = interval(coefficient.name, float(after), knowledge)
            rows.append(
                (coefficient.name, show.number(value), _share(before), _share(after), show.number(then["low95"]),
                 show.number(then["high95"]), coefficient.unit)
            )  # fmt: skip
    columns = ("name", "value", "± before", "± after", "low 95 %", "high 95 %", "unit")
    return show.table(
        "what each parameter would be known to, in 95 % intervals", columns, rows, numbers=columns[1:-1]
    )


def _share(relative_std: float) -> str:
    """Half of a 95 % interval as a share of the value."""
    from identify.planning.writing import Z95
    from tui import show

    return f"{show.number(100 * Z95 * relative_std, 2)} %" if math.isfinite(relative_std) else "unknown"
