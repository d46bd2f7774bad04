"""The verbs of the command seatrial: for each a sentence, an example, and its options, as `--help` prints them.

The module of the same name in `tui.commands` does the work and is imported only to run it; nothing heavy is imported
here, so that help appears at once. The verbs stand in the order in which `seatrial --help` lists them.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from bridge.command_line import actions_of, port, seconds, seed, since, size
from bridge.onboard import program
from bridge.vehicle.mode import BY_WORD, Mode
from tui.options import (
    MissionTarget,
    NewFile,
    NewFolder,
    Options,
    Output,
    ParameterTarget,
    Target,
    hub_port,
    speed,
)

MODES = {
    Mode.OFF: "the PID alone; sent until the vehicle confirms, without asking",
    Mode.SHADOW: "the feed-forward is computed and recorded, not applied",
    Mode.ALONE: "the feed-forward without the PID of its axes",
    Mode.BOTH: "the feed-forward and the PID",
}
AXES = {"surge": 0, "sway": 1, "heave": 2, "yaw": 5}
CONDITIONS = {
    "water_temperature_c": ("--water-temperature", "C", "of the water"),
    "salinity": ("--salinity", "S", "practical: 0 for fresh water, 35 for the ocean"),
    "tether_out_m": ("--tether-out", "M", "length of tether in the water"),
    "ballast_kg": (
        "--ballast",
        "KG",
        "mass in air beyond the vehicle file's dry mass; below 0 for mass taken off",
    ),
    "payload_kg": ("--payload-mass", "KG", "likewise, of the payload"),
    "payload": ("--payload", "TEXT", "the payload"),
    "weather": ("--weather", "TEXT", "wind and sea"),
}
"""Option, unit and meaning of each condition of a dive, by its field in `gcs_plugin.dives.conditions.Conditions`."""
_LINK = "--link udpin:127.0.0.1:14550"
_PARAMS_UPLOAD = f"seatrial params upload hovering.json --vehicle ruvifist {_LINK}"
_PARAMS = {
    "show": ("show the vehicle's parameters", f"seatrial params show FF0_ {_LINK}"),
    "diff": ("show the changes of an upload; sends no write", f"seatrial params diff hovering.param {_LINK}"),
    "upload": ("write a file to the vehicle and prove it", _PARAMS_UPLOAD),
    "rollback": ("bring back the values before an upload", f"seatrial params rollback {_LINK}"),
}
_KEYS_MAKE = "seatrial keys make seatrial.key"
_GUESS = "seatrial vehicle guess 00000042.BIN --out our_rov.yaml"
_KEYS = {
    "make": ("make a key in a new file that nobody else can read", _KEYS_MAKE),
    "show": ("say which key a file holds, by its fingerprint", "seatrial keys show seatrial.key"),
}


_SEAL = "seatrial challenge seal --cases 20 --seed 7 --out hidden"
_CHALLENGE = {
    "seal": ("make dives with hidden effects and lock the answers", _SEAL),
    "score": ("open the answers and judge those given", "seatrial challenge score hidden --answers answers"),
}
_APPLET = {
    "deploy": ("install the script and start it", f"seatrial applet deploy --vehicle bluerov2 {_LINK}"),
    "check": (
        "check wiring and script, and whether it runs; sends no write",
        f"seatrial applet check --vehicle bluerov2 {_LINK}",
    ),
    "remove": ("remove the script", f"seatrial applet remove --vehicle bluerov2 {_LINK}"),
}


@dataclass(frozen=True)
class Verb:
    """A verb: a sentence on it, a command line as an example, and its options."""

    sentence: str
    example: str
    add_options: Callable[[Options], None]


VERBS: dict[str, Verb] = {}


def verb(sentence: str, example: str) -> Callable[[Callable[[Options], None]], None]:
    """Decorator: the function adds the options of the verb of its name."""

    def listed(add_options: Callable[[Options], None]) -> None:
        VERBS[add_options.__name__.strip("_")] = Verb(sentence, example, add_options)

    return listed


@verb(
    "dive, record, identify, upload and dive again with a simulated vehicle",
    "seatrial demo --seed 3 --out demo",
)
def _demo(options: Options) -> None:
    options.seed()
    options.out("folder in which this run makes one", "demo")
    options.json()


@verb(
    "run on the vehicle: read its sensors, stream MAVLink, hold its parameters",
    f"seatrial bridge {program.OPTIONS}",
)
def _bridge(options: Options) -> None:
    program.add_arguments(options.parser)


@verb(
    "dive a mission with a simulated vehicle and its simulated devices",
    "seatrial simulate --vehicle ruvifist:survey --mission survey --seed 1",
)
def _simulate(options: Options) -> None:
    options.vehicle(
        "the vehicle file; the FILE.truth.yaml next to it holds the simulated vehicle's true values",
        required=True,
    )
    options.value(
        "--mission",
        "NAME",
        "survey, hovering, validation, or a YAML file of legs; idle: afloat and disarmed until Ctrl-C; ardusub: "
        "the body for ArduSub's own simulator, until Ctrl-C",
        required=True,
    )
    options.takes_dive()
    options.seed()
    options.value("--mode", None, "mode of the feed-forward (default: as stored)", choices=BY_WORD)
    options.value(
        "--heading", None, "reference of the heading in turns", choices=("smooth", "linear"), default="smooth"
    )
    options.value("--parameters", "FILE", "the vehicle's parameter store (default: none)")
    options.value(
        "--accepted", "FILE", "true values of the vehicle: the .param of diagnose --accept, effects included"
    )
    options.value(
        "--onset",
        ("S", "NAME=VALUE"),
        "effects that set in S seconds into the dive: T2_gain=0.5, X_uu=40, delay=0.15 (s) and others of the truth "
        "file, current_n=0.1 and current_e (m/s), wave_height=0.3 (m) and wave_period (s), tether=2 (N/m, from where "
        "it is then)",
        nargs="+",
    )
    options.links("also stream to this link")
    options.value("--speed", "N|max", "times real time (default: max, with --link 1)", type=speed)
    options.seconds("end idle or ardusub after this time")
    options.json("the dive")


@verb(
    "the terminal app: watch the vehicle live, over ssh and in tmux as well",
    f"seatrial tui {_LINK} --vehicle ruvifist",
)
def _tui(options: Options) -> None:
    options.links("a link to record and to show; may be given again (default: what is being recorded)")
    options.vehicle("the vehicle file, which names the sensors to expect")
    options.takes_dive()
    options.receipts("folder for receipts and the values before each upload")
    options.switch("--unrecorded", "show the link without recording it")
    options.positive("--fps", "N", "refreshes a second", 4.0)
    options.value("--theme", None, "default: the last one used", choices=("dark", "light", "sunlight"))
    options.value("--keymap", "FILE", "keys by action (default: ~/.config/seatrial/keymap.yaml)", type=Path)
    options.switch("--view-only", "show only: send, start and write nothing")
    web = Options(options.parser.add_argument_group("in a browser"))
    web.switch("--web", "serve the app as a page, view only")
    web.value("--host", "ADDRESS", "the page's address (default: 127.0.0.1, this computer alone)")
    web.value("--port", "PORT", "the page's port (default: 8000)", type=port)
    web.switch("--control", "allow whoever opens the page to do all that the app can")


@verb("record every frame of one or more links into a dive folder", f"seatrial record {_LINK} --out dives")
def _record(options: Options) -> None:
    actions = Options(options.parser.add_mutually_exclusive_group(required=True))
    actions.value("--link", "SPEC", "a link; may be given again", action="append")
    actions.switch("--next", "continue the running recording in a new dive folder")
    actions.switch("--end", "end the running recording")
    options.takes_dive()
    options.value("--name", None, "last part of the dive folder's name", default="")
    options.vehicle("the vehicle file to name in dive.yaml")
    options.switch("--same-conditions", "take water, tether, ballast and so on from the dive before")
    options.seconds("stop after this time (default: at Ctrl-C)")
    options.switch("--heartbeat", "send HEARTBEATs as a ground station, for a vehicle that waits for one")
    options.sign_key()
    options.value(
        "--hub",
        "PORT",
        "port of this computer through which params, doctor, ff and others use the links, or none "
        "(default: a free one)",
        type=hub_port,
        default=0,
    )
    options.json("the counts of each dive")


@verb(
    "fetch the vehicle's own recording of a dive and fill the gaps",
    "seatrial fetch dives/2026-11-20T0912Z-hovering --link udpin:192.168.2.1:14550",
)
def _fetch(options: Options) -> None:
    options.value(
        "dive",
        "DIVE",
        "the dive folder to complete (default: that of the running recording, which then continues "
        "in a new one; else the newest in --out)",
        nargs="?",
    )
    options.switch(
        "--new",
        "make a dive folder of the vehicle's recording since it was switched on, for a dive that "
        "the ground did not hear",
    )
    options.positive("--minutes", "N", "of --new: only the last minutes")
    options.out("folder of the dives", "dives")
    options.value("--name", None, "of --new: last part of the dive folder's name", default="")
    options.vehicle("of --new: the vehicle file to name in dive.yaml")
    options.link()
    options.system("of --new: its MAVLink system, if several vehicles are heard")
    options.value(
        "--patience",
        "N",
        "give up after this many seconds without an answer; the fetched part is kept",
        type=seconds,
        default=60.0,
    )
    options.json("the outcome")


@verb(
    "add another recorder's log to a dive, on one clock: the autopilot's, or another .tlog",
    "seatrial merge dives/2026-11-20T0912Z-hovering 00000042.BIN",
)
def _merge(options: Options) -> None:
    options.value("dive", "DIVE", "the dive folder to add them to")
    options.value(
        "files",
        "FILE",
        "another recording of the dive: the autopilot's log (.BIN), or a .tlog of the "
        "vehicle or of another ground station; it stays as it is",
        nargs="+",
    )
    options.json("the outcome")


@verb("note an event in the dive that is being recorded", 'seatrial note "tether caught on the ladder"')
def _note(options: Options) -> None:
    options.value("text", "TEXT", "what happened", nargs="+")
    options.value("--dive", "DIVE", "the folder of a dive: TEXT replaces its notes")


@verb(
    "record the conditions of a dive: water, tether, ballast, payload, weather",
    "seatrial conditions dives/2026-11-20T0912Z-hovering --water-temperature 11.5 --salinity 35 --ballast 2",
)
def _conditions(options: Options) -> None:
    options.value(
        "dive",
        "DIVE",
        "a dive folder (default: the dive that is being recorded, else the newest in dives)",
        nargs="?",
    )
    for name, (option, metavar, sentence) in CONDITIONS.items():
        options.value(option, metavar, f'{sentence}; "" for not known', dest=name)
    options.switch("--same", "as in the dive before, except those given here")
    options.json("the conditions")


@verb(
    "the present state of a vehicle: armed, link, sensors, depth, velocities, battery",
    f"seatrial watch --vehicle ruvifist {_LINK}",
)
def _watch(options: Options) -> None:
    options.link("a link (default: through the running recording)")
    options.vehicle("the vehicle file, which names its sensors (default: the one of the running recording)")
    options.system(
        "which vehicle, if several are heard on the link (default: the vehicle file's, else the first)"
    )
    options.receipts("folder of the receipts, which tell the model in force")
    options.seconds("stop after this time (default: at Ctrl-C)")
    options.switch("--once", "listen for 3 s, print the tables, and end with 1 if a sensor is missing or bad")
    options.json("the last picture")


@verb(
    "list dive folders: date, length, losses, what each could identify, its results",
    "seatrial dives dives --vehicle ruvifist",
)
def _dives(options: Options) -> None:
    options.value("folder", "FOLDER", "holds the dive folders", nargs="?", default="dives")
    options.vehicle("the vehicle file to judge by (default: the one named by each dive)")
    options.value(
        "--otherwise",
        "FILE[:CONFIGURATION]",
        "the vehicle file for a dive that names none, or a missing one",
        default="",
    )
    options.json("the list")


@verb(
    "say what a recording holds and file it as a dive folder",
    "seatrial import 00000042.BIN --out dives/lake-42",
)
def _import(options: Options) -> None:
    options.value(
        "file",
        "FILE",
        "a dive folder or a recording: .tlog, .BIN, or with --columns .csv, .bag, .mcap, .ulg, .mat ...",
    )
    options.value(
        "--out", "FOLDER", "the dive folder to make; without it, only the content is listed", type=NewFolder
    )
    options.vehicle_file("the vehicle file to name in the dive folder")
    options.columns()
    options.value(
        "--map",
        "YAML",
        "propose a column map from names, ranges and physics, show each column, and write the map (without YAML: "
        "FILE's name with -columns.yaml, in this folder)",
        nargs="?",
        const="",
        type=NewFile,
    )
    options.json("its content")


@verb(
    "propose the vehicle file of an ArduSub by a log: its parameters, or its motion; and check its motors",
    _GUESS,
)
def _vehicle(options: Options) -> None:
    guess = ("frame, order and directions of the thrusters, and which motors are reversed or swapped", _GUESS)
    for _, parser in actions_of(options.parser, {"guess": guess}):
        action = Options(parser)
        action.value("log", "LOG", "a .tlog, a DataFlash .BIN or a dive folder of the autopilot")
        action.value("--out", "FILE", "write the vehicle file", type=NewFile)
        action.json("the findings")


@verb(
    "the feed-forward inside an ArduSub, as a script of its own",
    f"seatrial applet deploy --vehicle bluerov2 {_LINK}",
)
def _applet(options: Options) -> None:
    for name, parser in actions_of(options.parser, _APPLET):
        action = Options(parser)
        action.vehicle("the vehicle file from which the script is made", required=True)
        action.link()
        action.system()
        if name == "deploy":
            action.receipts("folder for the receipt and the values before")
        if name != "check":
            action.yes()
        action.json()


@verb(
    "identify mass and damping from dives, with intervals",
    "seatrial identify dives/2026-11-20T0912Z-hovering --vehicle ruvifist --json hovering.json",
)
def _identify(options: Options) -> None:
    options.value(
        "dives",
        "DIVE",
        "a dive folder or a recording: .tlog, .BIN, or with --columns .csv, .bag, .mcap, .ulg, .mat ...",
        nargs="+",
    )
    options.vehicle_of_dive()
    options.value(
        "--method",
        "METHOD[+METHOD]",
        "likelihood, pinn or paper; two of them are compared (default: likelihood+pinn; "
        "likelihood if the vehicle file's damping is not linear)",
    )
    options.network("the paper's own")
    options.columns()
    options.json()
    options.value("--param", "FILE", "write a .param with its sidecar, for one dive", type=ParameterTarget)
    options.report("write a report with plots")
    options.switch(
        "--together",
        "all are runs of one dive, and so are the recordings in a folder: one answer for all, with a state and a trim "
        "for each",
    )


@verb(
    "identify many dives, here or on a Dask cluster: one table, and how the vehicle drifts",
    "seatrial batch dives --vehicle ruvifist --out batch --csv dives.csv",
)
def _batch(options: Options) -> None:
    options.value(
        "dives",
        "DIVES",
        "recordings, dive folders, folders of them, or quoted patterns such as 'dives/2026-*'",
        nargs="+",
    )
    options.vehicle(
        "the vehicle file of all dives; each dive's VEH_CFG chooses the configuration unless one is named",
        required=True,
    )
    options.value("--method", None, "one of identify's", default="likelihood")
    options.value(
        "--scheduler", "ADDRESS", "of a Dask cluster, as tcp://10.0.0.5:8786 (default: this computer's cores)"
    )
    options.value("--processes", "N", "on this computer (default: one a core)", type=size)
    options.switch(
        "--diagnose", "also diagnose each dive: verdict and causes by dive, and which effects grow or shrink"
    )
    options.accepted("with --diagnose, ")
    options.out(
        "folder for the page trends.html, and for results.jsonl, from which a stopped batch continues",
        "batch",
    )
    options.columns()
    options.json("everything")
    options.value("--csv", "FILE", "write the table as CSV; - for standard output", type=Output)


@verb(
    "propose the next dive, and how well each parameter would be known after it",
    "seatrial plan --vehicle ruvifist:hovering --after hovering.json --out plan.yaml",
)
def _plan(options: Options) -> None:
    options.vehicle("the vehicle file", required=True)
    options.value(
        "--after",
        "DIVE",
        "start from the knowledge of this dive: a recording, or the JSON that identify wrote of one",
    )
    options.columns()
    options.plan_minutes("total time")
    options.positive("--space", "METRES", "room across", 6.0)
    options.positive(
        "--depth-space",
        "METRES",
        "room up and down (default: as much as --space); never more than the 1.5 m of depth a plan begins at",
    )
    options.positive("--speed", "M_S", "highest speed, m/s; up and down half of it", 0.5)
    options.value("--axes", "AXIS", "surge sway heave yaw (all)", nargs="+", choices=AXES, default=list(AXES))
    options.value(
        "--know", "NAME", "which parameters it is to tell (default: all of the axes)", nargs="+", default=[]
    )
    options.positive(
        "--to",
        "PERCENT",
        "first those known worse than this, half of the 95 per cent interval (default: all)",
    )
    options.value(
        "--out",
        "FILE",
        "the mission, for simulate and for the crew; an older plan is replaced",
        type=MissionTarget,
        default="plan.yaml",
    )
    options.json("the plan")


def _flight(options: Options) -> None:
    options.value(
        "--limits",
        "FILE",
        "the limit file: depth, altitude, distance, speed, tilt, battery, time",
        required=True,
    )
    options.vehicle("the vehicle file", required=True)
    options.link()
    options.switch("--armed", "arm it and fly; without this the flight is shown and nothing is sent")
    options.positive(
        "--to",
        "PERCENT",
        "stop once every parameter is known to this (half of its 95 per cent interval)",
        3.0,
    )
    options.value("--know", "NAME", "which parameters (default: all that the plan determines)", nargs="+")
    options.value("--countdown", "S", "seconds before it moves, 3 to 60", type=seconds, default=10.0)
    options.takes_dive()
    options.system()
    options.json("the outcome")


@verb(
    "let the vehicle fly what plan proposes, within limits, until enough is known; any key ends it",
    f"seatrial fly plan.yaml --limits limits.yaml --vehicle ruvifist:hovering {_LINK} --armed",
)
def _fly(options: Options) -> None:
    options.value("plan", "PLAN", "the mission that plan wrote")
    _flight(options)


@verb(
    "plan, fly, identify, and upload in shadow, within limits: the vehicle ends where it began",
    f"seatrial calibrate --limits limits.yaml --vehicle ruvifist:hovering {_LINK} --armed",
)
def _calibrate(options: Options) -> None:
    _flight(options)
    options.value("--plan", "FILE", "fly this plan instead of making one")
    options.plan_minutes("longest flight that is planned")
    options.receipts("folder for the receipt of the upload")


@verb(
    "write accepted results into the vehicle file, as known before the next dive",
    "seatrial prior hovering.json --vehicle our.yaml",
)
def _prior(options: Options) -> None:
    options.value("file", "FILE", "the JSON of identify, or a .param with its sidecar, that was accepted")
    options.vehicle_file("your vehicle file, which takes the priors", required=True)
    options.positive(
        "--widen", "PERCENT", "extra uncertainty since then (default: 3 for masses, 10 for dampings)"
    )
    options.despite_doubts("accept an identification that did not converge, and doubted values")
    options.json("the priors")


@verb("show, compare, upload and roll back the parameters of a vehicle", _PARAMS_UPLOAD)
def _params(options: Options) -> None:
    sent = "a .param, .parm or .params file, or the JSON of identify"
    before = "the -before.param of an upload (default: that of the last upload in force)"
    for name, parser in actions_of(options.parser, _PARAMS):
        action = Options(parser)
        if name == "show":
            action.value("patterns", "PATTERN", "start of a name, or one with *", nargs="*")
            action.value("--out", "FILE", "write them as .param, .parm or .params", type=ParameterTarget)
        elif name == "rollback":
            action.value("file", "FILE", before, nargs="?")
            action.vehicle_file("the vehicle file; a FILE that says it is of another vehicle is refused")
        else:
            action.value("file", "FILE", sent)
            action.vehicle_file("the vehicle file; needed where FILE is JSON")
            action.value("--only", "NAME", "only these parameters", nargs="+")
        if name != "show":
            action.switch("--any-vehicle", "accept a file of another vehicle")
        if name == "upload":
            action.despite_doubts()
            action.value(
                "--accept-implausible",
                "NAME",
                "write these although they are implausible, incomplete, or switch the feed-forward on",
                dest="accepts",
                nargs="+",
                default=[],
            )
        if name in ("upload", "rollback"):
            action.yes()
            action.switch("--dry-run", "show the changes; sends no write")
            action.switch("--armed", "write to an armed vehicle too, while its feed-forward is off")
        action.receipts("folder of receipts, values before, and accepted values")
        action.link()
        action.system()
        action.seconds("time to wait for the vehicle", 5.0)
        action.json()


@verb("switch the feed-forward of a vehicle: off, shadow, ff or both", f"seatrial ff off {_LINK}")
def _ff(options: Options) -> None:
    modes = "; ".join(f"{mode.word}, {sentence}" for mode, sentence in MODES.items())
    options.value("mode", "MODE", modes, choices=BY_WORD)
    options.link()
    options.system("its MAVLink system, if several vehicles are heard (default of off: each of them)")
    options.yes()
    options.switch("--disarmed", "with --yes: only if it is still disarmed; off goes to any")
    options.seconds("how long to try (default: 15; of off: until it is done)")
    options.json("the outcome")


@verb(
    "write the identified model in the files of other simulators, or a dive for Foxglove and PlotJuggler",
    "seatrial export hovering.json --vehicle ruvifist --to gazebo --out hovering.sdf",
)
def _export(options: Options) -> None:
    options.value(
        "file",
        "MODEL",
        "the JSON of identify, the .param of diagnose --accept, or a vehicle file whose "
        "configuration has a model; with --to mcap a dive folder or a recording",
    )
    options.value(
        "--to",
        "TARGET",
        "the simulator: gazebo, stonefish or ardusub-json; or mcap, a dive's signals to plot",
        required=True,
    )
    options.vehicle_file(
        "the vehicle file, if MODEL is JSON or .param; of a dive, to add its model's velocities"
    )
    options.columns()
    options.value("--out", "FILE", "the file (default: standard output; mcap needs a file)", type=Output)
    options.despite_doubts()
    options.json("the parts that did not fit")


@verb(
    "say where model and recording differ, from which causes, and how far those close the gap",
    "seatrial diagnose dives/2026-11-20T0912Z-hovering --vehicle ruvifist --report gap.html",
)
def _diagnose(options: Options) -> None:
    options.value(
        "dives",
        "DIVE",
        "a dive folder or a recording: .tlog, .BIN, or with --columns .csv, .bag, .mcap, .ulg, .mat ...; several, or a "
        "folder of them, are runs of one dive",
        nargs="+",
    )
    options.vehicle_of_dive()
    options.value(
        "--check", "DIVE", "another dive of that vehicle, on which to measure how far the gap shrinks"
    )
    options.value(
        "--against",
        "SIM",
        "a simulator's recording of that vehicle, driven with nearly the same commands: say what the "
        "simulator lacks",
    )
    options.columns()
    options.json("the answer")
    options.report("write a page with the findings")
    options.value(
        "--predict",
        "CSV",
        "write the velocities of the check dive: measured, and predicted without and with the causes",
        type=Target,
    )
    options.accepted(
        otherwise="; or a folder of receipts: the causes that were in force when the dive began (default: receipts, if "
        "there); none: no model"
    )
    options.value(
        "--accept",
        "FILE",
        "write the model with the causes as a .param with its sidecar, for `seatrial params upload`",
        type=ParameterTarget,
    )
    options.value(
        "--without", "EFFECT", "do not try this effect; may be given several times", action="append"
    )


@verb(
    "tracking errors of dives in acceleration, steady state and deceleration",
    "seatrial validate dives/pid dives/both --vehicle ruvifist",
)
def _validate(options: Options) -> None:
    options.value("dives", "DIVE", "a dive folder or a recording, one for each mode", nargs="+")
    options.vehicle_file("the vehicle file, with the position of its DVL", required=True)
    options.columns()
    options.value(
        "--foretold",
        "PARAM",
        "the .param of diagnose --accept: compare the dives after it with its prediction "
        "(default: the last upload, by the receipts)",
    )
    options.receipts("folder of the receipts")
    options.json("the errors")
    options.report("write a page with the errors and the curves")


@verb(
    "send a recorded dive to a link, on its own clock",
    "seatrial replay dives/2026-11-20T0912Z-hovering --link udpout:127.0.0.1:14550 --speed 4",
)
def _replay(options: Options) -> None:
    options.value("dive", "DIVE", "a dive folder, a .tlog or a .tlog.gz")
    options.value("--link", "SPEC", "the link to send it to", required=True)
    options.sign_key()
    options.value("--speed", "N", "times real time", type=float, default=1.0)
    options.value("--from", "S", "start this many seconds into it", type=since, default=0.0, dest="start_s")


@verb(
    "make dives with hidden effects and locked answers, and score the answers given",
    _SEAL,
)
def _challenge(options: Options) -> None:
    parsers = {name: Options(parser) for name, parser in actions_of(options.parser, _CHALLENGE)}
    seal, score = parsers["seal"], parsers["score"]
    seal.value("--cases", "N", "how many", type=size, default=20)
    seal.value("--seed", "S", "keep it secret from those who are judged", type=seed, required=True)
    seal.value("--out", "FOLDER", "a new folder for cases, answers and hash", type=NewFolder, required=True)
    seal.value(
        "--without",
        "EFFECT",
        "also hide this effect, as one that the library lacks; then diagnose with --without",
    )
    score.value("folder", "FOLDER", "the folder of seal")
    score.value("--answers", "FOLDER", "with case_001.json and so on", required=True)
    score.value("--hash", "SHA256", "the hash that seal printed, published before the answers were given")
    score.value("--key", "FILE", "the key to the answers (FOLDER.key)")
    for action in (seal, score):
        action.json()


@verb(
    "the source paper's campaigns and figures on the simulated vehicle, on one page",
    "seatrial reproduce --seed 1 --out reproduction",
)
def _reproduce(options: Options) -> None:
    options.seed()
    options.out("folder in which this run makes one", "reproduction")
    options.network("its own, for hours without a graphics card")
    options.figures()
    options.json()


@verb("make a key that signs the link, and tell which key a file holds", _KEYS_MAKE)
def _keys(options: Options) -> None:
    for name, parser in actions_of(options.parser, _KEYS):
        action = Options(parser)
        action.value("key", "FILE", "the file of the key")
        if name == "make":
            action.switch(
                "--passphrase",
                "ask for a passphrase, and make the key that MAVProxy and QGroundControl make of it",
            )


@verb(
    "check vehicle file, links, clocks, disk and sensors; with --wet, thrusters and mountings",
    f"seatrial doctor --vehicle ruvifist:hovering {_LINK}",
)
def _doctor(options: Options) -> None:
    options.vehicle("the vehicle file, which names its devices")
    options.link(
        "the link to the vehicle; without it, that of the running recording, else the ports of its devices"
    )
    options.out("folder for recordings", "dives")
    options.switch("--wet", "in the water: arm, push with each thruster once, disarm; about a minute")
    options.value("--confirm", "NAME", "the vehicle's name, so that --wet does not ask for it")
    options.seconds("how long to listen", 6.0)
    options.json("the findings")
