"""`seatrial simulate`: the simulated vehicle dives a mission, recorded into a dive folder."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from bridge import exit_codes
from bridge.command_line import seconds, seed
from bridge.links import secured
from bridge.text import say, say_warning
from bridge.vehicle.mode import BY_WORD, Mode

if TYPE_CHECKING:
    import threading
    from collections.abc import Callable, Sequence

    from bridge.clock import SystemClock
    from bridge.links.link import Link
    from bridge.onboard.parameters import ParameterServer
    from bridge.signing.link import Trouble
    from bridge.simulator.missions import Mission
    from bridge.vehicle.config import VehicleFile

EXAMPLE = "seatrial simulate --vehicle ruvifist:survey --mission survey --seed 1"

IDLE = "idle"
IDLE_DEPTH_M = 0.2


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--vehicle",
        required=True,
        metavar="FILE[:CONFIGURATION]",
        help="the vehicle file; FILE.truth.yaml beside it holds what the simulated vehicle truly is",
    )
    parser.add_argument(
        "--mission",
        required=True,
        metavar="NAME",
        help="survey, hovering, validation, a YAML file of legs, or idle: afloat and disarmed until Ctrl-C",
    )
    parser.add_argument(
        "--out", default="dives", metavar="FOLDER", help="takes the dive folder (default: dives)"
    )
    parser.add_argument("--seed", type=seed, default=1, help="of noise and disturbance (default: 1)")
    parser.add_argument("--mode", choices=BY_WORD, help="what the feed-forward does (default: as stored)")
    parser.add_argument(
        "--heading",
        choices=("smooth", "linear"),
        default="smooth",
        help="how turns are led (default: smooth)",
    )
    parser.add_argument(
        "--parameters", metavar="FILE", help="where the vehicle keeps its parameters (default: nowhere)"
    )
    parser.add_argument(
        "--accepted",
        metavar="FILE",
        help="the vehicle truly is the .param of diagnose --accept, effects included",
    )
    parser.add_argument("--link", action="append", default=[], metavar="SPEC", help="also stream there")
    secured.add_argument(parser)
    parser.add_argument(
        "--speed", type=speed, metavar="N|max", help="times real time (default: max, with --link 1)"
    )
    parser.add_argument("--seconds", type=seconds, metavar="N", help="end idle after so long")
    parser.add_argument("--json", metavar="FILE", help="write what was dived as JSON; - for standard output")


def speed(text: str) -> float:
    """Parse a speed of simulated time: a positive number, or `max`."""
    value = float("inf") if text == "max" else float(text)
    if not value > 0:
        raise ValueError
    return value


def run(arguments: argparse.Namespace) -> int:
    from bridge.clock import SystemClock
    from bridge.command_line import check_folder, check_no_folder
    from bridge.errors import ConfigError
    from bridge.onboard.parameters import parameters_of
    from bridge.simulator.missions import mission_named
    from bridge.vehicle.config import load_vehicle
    from tui.files import check_file

    check_file("--json", arguments.json)
    if arguments.parameters:
        check_folder("--parameters", str(Path(arguments.parameters).parent))
        check_no_folder("--parameters", arguments.parameters)
    if arguments.mission != IDLE:
        check_folder("--out", arguments.out)
    file = load_vehicle(arguments.vehicle)
    vehicle = file.vehicle
    configuration = configuration_of(file, arguments.mission)
    if arguments.mission != IDLE and not vehicle.sensors.present():
        raise ConfigError(
            f"{file.path}: names no sensors, so a dive would record no reading; add 'sensors', such as a dvl and an imu"
        )
    if arguments.mission == IDLE and arguments.accepted:
        raise exit_codes.UsageError(
            "--accepted says how a vehicle moves, and an idle one lies still; give a mission"
        )
    shape = vehicle.configurations[configuration]
    mission = (
        None if arguments.mission == IDLE else mission_named(arguments.mission, shape, arguments.heading)
    )
    store = Path(arguments.parameters) if arguments.parameters else None
    parameters = parameters_of(file, store)
    if parameters.trouble:
        say_warning(parameters.trouble)
    clock, troubles = SystemClock(), Troubles()
    opener = secured.Opener(arguments.sign_key, clock, troubles, listed=secured.later)
    links = [opener.open(spec) for spec in arguments.link]
    try:
        if mission is None:
            return idle(arguments, file, configuration, parameters, links, clock, troubles)
        list_sockets(arguments.link)
        return dive(arguments, file, configuration, mission, parameters, links, clock.unix_s())
    finally:
        for link in links:
            link.close()


def list_sockets(links: "Sequence[str]") -> None:
    """Print which network sockets are open."""
    from bridge.links.addresses import of_links

    for sentence in of_links(links, "a link to the ground"):
        say(sentence)


class Troubles:
    """Reports refused systems: on the console, and by `say` to the ground once a vehicle exists that can send."""

    def __init__(self) -> None:
        self.say: Callable[[str], None] = lambda _: None

    def __call__(self, trouble: "Trouble") -> None:
        secured.on_words(trouble)
        self.say(trouble.brief)


def configuration_of(file: "VehicleFile", mission: str) -> str:
    """The named configuration; else the configuration with the mission's name, or the only one."""
    configurations = file.vehicle.configurations
    chosen = file.configuration or (mission if mission in configurations else None)
    if chosen is None and len(configurations) > 1:
        raise exit_codes.UsageError(
            f"vehicle '{file.vehicle.name}' has {', '.join(configurations)}; name one: --vehicle FILE:CONFIGURATION"
        )
    return chosen or next(iter(configurations))


def dive(
    arguments: argparse.Namespace,
    file: "VehicleFile",
    configuration: str,
    mission: "Mission",
    parameters: "ParameterServer",
    links: "Sequence[Link]",
    unix_s: float,
) -> int:
    """Dive a mission and record it."""
    import math

    from bridge.simulator.dive import real_time
    from gcs_plugin import simulated
    from tui import show
    from tui.accepted import accepted_truth

    times = arguments.speed or (1.0 if links else math.inf)
    if Mode(BY_WORD.get(arguments.mode, parameters.mode)).applies_feedforward and not parameters.active_crc:
        raise exit_codes.UsageError(
            f"--mode {arguments.mode or parameters.mode}: the simulated vehicle has no parameters to feed forward; "
            "upload some first into the --parameters FILE of an idle one, or give the vehicle file a 'model'"
        )
    truth = None
    if arguments.accepted:
        truth, lost = accepted_truth(Path(arguments.accepted), file, configuration)
        for sentence in lost:
            show.say(show.words(), f"note: {sentence}")
    with show.progress(f"dive {mission.name}") as tell:
        folder = simulated.record_dive(
            file,
            configuration,
            mission,
            Path(arguments.out),
            seed=arguments.seed,
            # Faster than real time, the dive starts earlier so that it ends now and not in the future.
            unix_s=unix_s - simulated.lasts_s(mission) * max(0.0, 1.0 - 1.0 / times),
            parameters=parameters,
            mode=BY_WORD.get(arguments.mode),
            truth=truth,
            progress=lambda share: tell(share, f"{share * mission.duration_s:.0f} s of {mission.name}"),
            links=links,
            pace=at_once if math.isinf(times) else real_time(times),
        )
    outcome = {
        "folder": str(folder.path),
        "mission": mission.name,
        "configuration": configuration,
        "seed": arguments.seed,
        "duration_s": mission.duration_s,
        "ff_mode": parameters.mode,
    }
    show.say(show.results(arguments.json), f"{mission.duration_s:.0f} s dived: {folder.path}")
    show.write_json(outcome, arguments.json)
    return exit_codes.DONE


def idle(
    arguments: argparse.Namespace,
    file: "VehicleFile",
    configuration: str,
    parameters: "ParameterServer",
    links: "Sequence[Link]",
    clock: "SystemClock",
    troubles: "Troubles",
) -> int:
    """Stay afloat and disarmed, and answer on the links, until the user stops it."""
    from bridge.command_line import until_stopped
    from bridge.simulator.body import Start
    from bridge.simulator.dive import SimulatedVehicle, real_time
    from tui import show

    if not links:
        raise exit_codes.UsageError("--mission idle waits for a ground on a link; give --link SPEC")
    start = Start(arguments.seed, IDLE_DEPTH_M, unix_at_boot_s=clock.unix_s())
    vehicle = SimulatedVehicle(file, configuration, links, start, parameters)
    troubles.say = vehicle.bridge.say
    words = show.words()

    def work(stop: "threading.Event") -> None:
        show.say(words, f"{file.vehicle.name} is afloat on {', '.join(arguments.link)}; Ctrl-C ends it")
        list_sockets(arguments.link)
        pace = real_time(arguments.speed or 1.0)
        while not stop.is_set():
            vehicle.rest()
            pace(vehicle.clock.boot_s())

    until_stopped(work, clock, arguments.seconds, lambda _: None)
    return exit_codes.DONE


def at_once(_: float) -> None:
    """Pace of simulated time that never waits."""
