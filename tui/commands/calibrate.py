"""`seatrial calibrate`: plan, fly, identify, upload and set to shadow; the vehicle ends where it began.

The plan may be one that was made before. Each step is the verb of its name with its own gates; the first that says no
ends it, and nothing after it is done.
"""

import argparse
import math
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

from bridge import exit_codes
from bridge.command_line import check_folder
from bridge.exit_codes import UsageError
from bridge.flight.flight import End
from bridge.flight.limits import FlightLimits, load_limits
from bridge.text import typed
from bridge.vehicle.coefficients import DAMPINGS, MASSES, YAW
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.mode import Mode
from gcs_plugin.flying.plan import load_plan
from gcs_plugin.flying.run import Wanted
from identify.planning.limits import START_DEPTH_M
from identify.statistics import Z95
from identify.words import listed
from tui import show
from tui.cli import module_of, verb_parser
from tui.commands import fly
from tui.dive_list import results_beside
from tui.parameter_files import read_json

SPEED_SHARE = 0.8
"""Share of the limit's speed that a plan uses: the remainder is for current and sea."""
ROOM_SHARE = 0.75
MOST_SPEED_M_S, MOST_ROOM_M = 0.5, 6.0


def run(arguments: argparse.Namespace) -> int:
    check_folder("--out", arguments.out)
    # The upload comes after the flight: too late to find that out then.
    check_folder("--receipts", arguments.receipts)
    limits = load_limits(Path(arguments.limits))
    file = load_vehicle(arguments.vehicle)
    configuration = file.configuration_chosen()
    vehicle = f"{arguments.vehicle.removesuffix(f':{configuration}')}:{configuration}"
    plan = Path(arguments.plan or Path(arguments.out) / "calibrate-plan.yaml")
    foretold = plan.with_suffix(".json")
    if arguments.plan is None:
        plan.parent.mkdir(parents=True, exist_ok=True)
        within = [word for pair in plan_limits(limits).items() for word in pair]
        asked = (
            "--minutes",
            f"{arguments.minutes:g}",
            "--to",
            f"{arguments.to:g}",
            *(("--know", *arguments.know) if arguments.know else ()),
        )
        files = ("--out", str(plan), "--json", str(foretold))
        code = step(
            "plan", "--vehicle", vehicle, *asked, *within, *files, began_unix_s=arguments.began_unix_s
        )
        if code != exit_codes.DONE:
            return code
    flight_plan = load_plan(plan)
    fly.check_made_for(file, plan, flight_plan)
    wanted = fly.wanted_of(arguments, file, flight_plan)
    console = show.results(arguments.json)
    for table in fly.shown(flight_plan, limits, wanted):
        show.put(console, table)
    tell = partial(fly.tell, console)
    foresight = read_json(foretold) if foretold.is_file() else {}
    # Another verb's answer may have that name: only what `plan` wrote of this plan foretells it.
    is_of_plan = Path(str(foresight.get("mission", ""))).name == plan.name
    vague = too_vague(foresight, wanted, limits) if is_of_plan else ""
    if vague or not arguments.armed:
        tell(
            f"nothing was sent: {vague or '--armed arms the vehicle, flies this, and uploads what it tells in shadow'}"
        )
        show.write_json(fly.proposed(plan, flight_plan, limits, wanted, vague), arguments.json)
        return exit_codes.NO if vague else exit_codes.DONE
    outcome, folder = fly.flown(arguments, file, flight_plan, limits, wanted)
    complete = outcome.end is End.FINISHED and outcome.all_known
    tell(f"{fly.sentence(outcome)}{'' if complete else '; nothing is uploaded'}")
    done: dict[str, Any] = {"flight": fly.to_json(outcome, wanted), "folder": str(folder.path), "steps": {}}
    if not complete:
        show.write_json(done, arguments.json)
        return exit_codes.NO
    given = {"--link": arguments.link, "--sign-key": arguments.sign_key, "--system": arguments.system}
    link = [word for name, value in given.items() if value is not None for word in (name, str(value))]
    left = results_beside(folder.path)
    outputs = [word for option, path in left.items() for word in (option, str(path))]
    receipts = ("--receipts", arguments.receipts)
    upload = ("upload", str(left["--param"]), "--vehicle", str(file.path), "--yes", *receipts)
    steps = {
        "identify": (str(folder.path), "--vehicle", vehicle, *outputs),
        "params": (*upload, *link),
        "ff": (Mode.SHADOW.word, "--yes", *link),
    }
    diagnose = typed("seatrial", "diagnose", folder.path, "--vehicle", vehicle)
    upload_by_hand = typed("seatrial", "params", "upload", left["--param"], "--vehicle", file.path)
    ways_out = {
        "identify": f"nothing was uploaded, and the dive is kept in {folder.path}: see {diagnose}, or calibrate again "
        "with more --minutes",
        "params": f"the model is kept in {left['--param']}, and the vehicle has its old one: mend what it says, then "
        f"{upload_by_hand}, and seatrial ff {Mode.SHADOW.word}",
        "ff": f"the model is in the vehicle, and not in shadow: mend what it says, then seatrial ff {Mode.SHADOW.word}",
    }
    for name, words in steps.items():
        # An OFF that was ordered at any time of all this wins over the shadow at its end.
        code = done["steps"][name] = step(name, *words, began_unix_s=arguments.began_unix_s)
        if code != exit_codes.DONE:
            tell(f"calibrate ends at {name}: {ways_out[name]}")
            break
    else:
        tell(
            "calibrated: the model is in the vehicle, in shadow; fly a minute by hand, validate it, then raise it"
        )
    show.write_json(done, arguments.json)
    return code


def too_vague(plan: Mapping[str, Any], wanted: Wanted, limits: FlightLimits) -> str:
    """Why no flight of a plan, the JSON of `plan`, would tell the wanted parameters, and ways out; "" if one may."""
    widths = {each["name"]: Z95 * (each["after"]["relative_std"] or 0.0) for each in plan["parameters"]}
    vague = {name: widths[name] for name in wanted.names if widths[name] > wanted.share}
    if not vague:
        return ""
    known = listed(
        [f"{name} to {_above(100 * width, 100 * wanted.share)} %" for name, width in vague.items()]
    )
    sharp = " ".join(name for name in wanted.names if name not in vague)
    # An interval narrows with the root of the time.
    planned = plan["duration_s"] / 60
    minutes = max(math.ceil(planned * (max(vague.values()) / wanted.share) ** 2), math.ceil(planned) + 1)
    longer = f"about --minutes {minutes}" + (
        f" with a time_s of more than {60 * minutes} in the limits" if 60 * minutes > limits.time_s else ""
    )
    ways = [f"--to {math.ceil(100 * max(vague.values()))}", longer]
    # How fast it turns is not the limits' to say.
    ways += ["wider limits"] if {*vague} - {MASSES[YAW].name, DAMPINGS[YAW].name} else []
    ways += [f"--know {sharp}"] if sharp else []
    return f"all of this plan tells {known} alone, and --to asks for {100 * wanted.share:g} %: give " + (
        ", or ".join(ways)
    )


def _above(percent: float, asked_percent: float) -> str:
    """A width to two digits, or to as many as show that it is above that asked for."""
    texts = (f"{percent:.{digits}g}" for digits in range(2, 9))
    return next((text for text in texts if float(text) > asked_percent), f"{percent}")


def plan_limits(limits: FlightLimits) -> dict[str, str]:
    """Options of `plan` that stay within the limits of a flight. Raises UsageError where no plan fits in."""
    above, below = START_DEPTH_M - limits.shallowest_m, limits.deepest_m - START_DEPTH_M
    if min(above, below) <= 0:
        raise UsageError(
            f"a plan begins at {START_DEPTH_M:g} m of depth, and the limits are {limits.shallowest_m:g} to "
            f"{limits.deepest_m:g} m; change them"
        )
    return {
        "--space": f"{min(MOST_ROOM_M, ROOM_SHARE * limits.distance_m):g}",
        "--depth-space": f"{ROOM_SHARE * min(above, below):g}",
        "--speed": f"{min(MOST_SPEED_M_S, SPEED_SHARE * limits.speed_m_s):g}",
    }


def step(name: str, *words: str, began_unix_s: float) -> int:
    """Run a verb as its own command line would, and return its exit code; `began_unix_s` as in `tui.cli.main`."""
    fly.tell(show.words(), f"calibrate: {name}")
    arguments = verb_parser(name).parse_args(words)
    arguments.began_unix_s = began_unix_s
    return int(module_of(name).run(arguments))
