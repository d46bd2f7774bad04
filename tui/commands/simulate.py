"""`seatrial simulate`: the simulated vehicle dives a mission, recorded into a dive folder."""

import argparse
import math
import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from bridge import clock as clocks
from bridge import command_line, exit_codes
from bridge.clock import Clock
from bridge.command_line import check_folder, check_no_folder
from bridge.errors import ConfigError
from bridge.exit_codes import UsageError
from bridge.links import secured
from bridge.links.addresses import of_links
from bridge.links.link import Link
from bridge.onboard.parameters import ParameterServer, parameters_of
from bridge.onboard.store_lock import alone_with
from bridge.signing.link import Trouble
from bridge.simulator.body import Start
from bridge.simulator.devices import Surroundings
from bridge.simulator.dive import WARM_UP_S, SimulatedVehicle, real_time
from bridge.simulator.json_plant import PORT, json_body, serve
from bridge.simulator.missions import mission_named
from bridge.simulator.served import ServedDevices
from bridge.simulator.truth import GAIN, PLANTED, TYPICAL, Truth, load_truth
from bridge.text import say, say_warning
from bridge.vehicle.coefficients import BY_NAME, effect_coefficients, gain_name
from bridge.vehicle.config import Configuration, VehicleFile, load_vehicle
from bridge.vehicle.legs import Mission
from bridge.vehicle.mode import BY_WORD
from gcs_plugin import simulated
from identify.effects.library import not_simulated
from tui import show
from tui.parameter_files import Leave, accepted_model

IDLE = "idle"
ARDUSUB = "ardusub"
IDLE_DEPTH_M = 0.2


def run(arguments: argparse.Namespace) -> int:
    if arguments.parameters:
        check_folder("--parameters", str(Path(arguments.parameters).parent))
        check_no_folder("--parameters", arguments.parameters)
    if arguments.mission not in (IDLE, ARDUSUB):
        check_folder("--out", arguments.out)
        if arguments.seconds is not None:
            raise UsageError("--seconds: a dive lasts as long as its mission; leave it out")
    if arguments.mission in (IDLE, ARDUSUB) and arguments.json:
        raise UsageError("--json: nothing is dived, so there is nothing to write; leave it out")
    if arguments.mission == IDLE and arguments.mode:
        raise UsageError(
            "--mode: an idle vehicle keeps the mode of its --parameters; leave it out, and switch it with `seatrial ff`"
        )
    if arguments.mission == IDLE and not arguments.link:
        raise UsageError("--mission idle waits for a ground on a link; give --link SPEC")
    file = load_vehicle(arguments.vehicle)
    vehicle = file.vehicle
    configuration = file.configuration_chosen(arguments.mission)
    if arguments.mission == ARDUSUB:
        return under_ardusub(arguments, file, configuration)
    if arguments.mission != IDLE and not vehicle.sensors.present():
        raise ConfigError(
            f"{file.path}: names no sensors, so a dive would record no reading; add 'sensors', such as a dvl and an imu"
        )
    shape = vehicle.configurations[configuration]
    mission = (
        None if arguments.mission == IDLE else mission_named(arguments.mission, shape, arguments.heading)
    )
    if not arguments.parameters:
        return on_links(arguments, file, configuration, mission, None)
    store = Path(arguments.parameters)
    with alone_with(store, "vehicle", "this one --parameters of its own"):
        return on_links(arguments, file, configuration, mission, store)


def on_links(
    arguments: argparse.Namespace,
    file: VehicleFile,
    configuration: str,
    mission: Mission | None,
    store: Path | None,
) -> int:
    """Open the links, and dive the mission, or stay afloat for None, with the parameters that `store` keeps."""
    parameters = parameters_of(file, store)
    if parameters.trouble:
        say_warning(parameters.trouble)
    clock, troubles = clocks.SystemClock(), Troubles()
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


def list_sockets(links: Sequence[str]) -> None:
    for sentence in of_links(links, "a link to the ground"):
        say(sentence)


class Troubles:
    """Reports refused systems: on the console, and by `say` to the ground once a vehicle exists that can send."""

    def __init__(self) -> None:
        self.say: Callable[[str], None] = lambda _: None

    def __call__(self, trouble: Trouble) -> None:
        secured.on_words(trouble)
        self.say(trouble.brief)


def dive(
    arguments: argparse.Namespace,
    file: VehicleFile,
    configuration: str,
    mission: Mission,
    parameters: ParameterServer,
    links: Sequence[Link],
    unix_s: float,
) -> int:
    times = arguments.speed or (1.0 if links else math.inf)
    mode = BY_WORD.get(arguments.mode, parameters.mode)
    if mode.applies_feedforward and not parameters.active_crc:
        given = f"--mode {mode.word}" if arguments.mode else f"{arguments.parameters}: is in mode {mode.word}"
        raise UsageError(
            f"{given}, and the simulated vehicle has no parameters to feed forward; upload some first into the "
            "--parameters FILE of an idle one, or give --mode off"
        )
    truth = wanted_truth(arguments, file, configuration, WARM_UP_S + mission.duration_s)
    with command_line.interrupted_in_order(), show.progress(f"dive {mission.name}") as tell:
        folder = simulated.record_dive(
            file,
            configuration,
            mission,
            Path(arguments.out),
            seed=arguments.seed,
            unix_s=unix_s,
            parameters=parameters,
            mode=BY_WORD.get(arguments.mode),
            truth=truth,
            progress=lambda share: tell(share, f"{share * mission.duration_s:.0f} s of {mission.name}"),
            links=links,
            pace=(lambda _: None) if math.isinf(times) else real_time(times),
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
    file: VehicleFile,
    configuration: str,
    parameters: ParameterServer,
    links: Sequence[Link],
    clock: Clock,
    troubles: Troubles,
) -> int:
    """Stay afloat and disarmed, and answer on the links, until the user stops it."""
    # It lies still until a flight moves it: then it shows how it moves.
    truth = wanted_truth(arguments, file, configuration)
    start = Start(arguments.seed, IDLE_DEPTH_M, unix_at_boot_s=clock.unix_s(), truth=truth)
    vehicle = SimulatedVehicle(file, configuration, links, start, parameters)
    troubles.say = vehicle.bridge.say
    words = show.words()

    def work(stop: threading.Event) -> None:
        show.say(words, f"{file.vehicle.name} is afloat on {', '.join(arguments.link)}; Ctrl-C ends it")
        list_sockets(arguments.link)
        pace = real_time(arguments.speed or 1.0)
        while not stop.is_set():
            vehicle.rest()
            pace(vehicle.clock.boot_s())

    command_line.until_stopped(work, clock, arguments.seconds, lambda _: None)
    return exit_codes.DONE


def wanted_truth(
    arguments: argparse.Namespace, file: VehicleFile, configuration: str, lasts_s: float = math.inf
) -> Truth:
    """The vehicle's truth, or the --accepted model, with the effects of --onset in a dive that `lasts_s`."""
    if arguments.accepted:
        truth, lost = accepted_truth(Path(arguments.accepted), file, configuration)
        show.say(show.words(), *(f"note: {sentence}" for sentence in lost))
    else:
        truth = load_truth(file, configuration)
    shape = file.vehicle.configurations[configuration]
    return with_onset(truth, arguments.onset, shape, lasts_s) if arguments.onset else truth


def with_onset(truth: Truth, parts: Sequence[str], shape: Configuration, lasts_s: float = math.inf) -> Truth:
    """The truth with effects that set in during the dive: parts `S NAME=VALUE ...`, S seconds after boot.

    Raises UsageError for anything else, a thruster that this shape lacks, a value beyond what can be simulated of it,
    and a time at which the dive, that `lasts_s`, is over.
    """
    try:
        onset_s, pairs = float(parts[0]), [effect.partition("=") for effect in parts[1:]]
        if valueless := [name for name, equals, _ in pairs if not equals]:
            raise ValueError(f"{', '.join(valueless)} has no value")
        onset = {name: float(value) for name, _, value in pairs}
        if not onset:
            raise ValueError("it names no effect")
        if not 0.0 <= onset_s < lasts_s:
            raise ValueError(f"nothing would set in: the dive lasts from 0 to {lasts_s:.0f} s")
        thrusters = len(shape.thrusters)
        gains = {gain_name(number) for number in range(1, thrusters + 1)}
        absent = [name for name in onset if GAIN.fullmatch(name) and name not in gains]
        if absent:
            raise ValueError(f"{', '.join(absent)} is of no thruster: this vehicle has {thrusters}")
        for effect in effect_coefficients(shape):
            value = onset.get(effect.name, effect.low)
            if not effect.low <= value <= effect.high:
                raise ValueError(
                    f"{effect.name} is {value:g}, and can be from {effect.low:.3g} to {effect.high:.3g} here"
                )
        return replace(truth, onset=onset, onset_s=onset_s)
    except ValueError as error:
        raise UsageError(
            f"--onset {' '.join(parts)}: {error}; give seconds and effects, such as --onset 120 T2_gain=0.6"
        ) from None


def under_ardusub(arguments: argparse.Namespace, file: VehicleFile, configuration: str) -> int:
    """Be the body of ArduSub's own simulator, which then flies and keeps the time, until the user stops it."""
    given = (
        ("--link", arguments.link),
        ("--mode", arguments.mode),
        ("--parameters", arguments.parameters),
        ("--speed", arguments.speed),
    )
    if idle_words := [name for name, value in given if value]:
        raise UsageError(
            f"{', '.join(idle_words)}: ArduSub flies this vehicle, keeps its parameters and its time; leave it out"
        )
    truth = wanted_truth(arguments, file, configuration)
    clock, vehicle = clocks.SystemClock(), file.vehicle
    world = Surroundings(TYPICAL, vehicle.water, vehicle.thrust_curve, clock.unix_s())
    devices = ServedDevices(vehicle.sensors, world, np.random.default_rng((arguments.seed, 1)))
    body = json_body(file, configuration, truth, seed=arguments.seed, tell=devices)

    def work(stop: threading.Event) -> None:
        show.say(
            show.words(),
            f"{vehicle.name} waits for ArduSub at port {PORT}: ardusub --model JSON:127.0.0.1; Ctrl-C ends it",
            *devices.sockets,
        )
        for slot in devices.absent:
            say_warning(f"the {slot} is not simulated: only one whose port is tcp:127.0.0.1:PORT is")
        serve(body, PORT, stop)

    try:
        command_line.until_stopped(work, clock, arguments.seconds, lambda _: None)
    finally:
        devices.close()
    return exit_codes.DONE


def accepted_truth(path: Path, file: VehicleFile, configuration: str) -> tuple[Truth, tuple[str, ...]]:
    """The model of an accepted `.param` in the water of the vehicle's own truth, and its parts left out.

    Values that were not identified come from that truth, otherwise from the vehicle file's model. Raises UsageError
    for a file of another vehicle or configuration, ConfigError if a coefficient is found nowhere.
    """
    values, sidecar = accepted_model(path, file, Leave(doubts=True))
    if sidecar.configuration != configuration:
        raise UsageError(
            f"{path}: is of configuration '{sidecar.configuration}', not '{configuration}'; name its own"
        )
    linear = {name: value for name, value in values.items() if name in BY_NAME}
    shape = file.vehicle.configurations[configuration]
    shapes = file.vehicle.configurations | {configuration: replace(shape, model=shape.model | linear)}
    truth = load_truth(replace(file, vehicle=replace(file.vehicle, configurations=shapes)), configuration)
    effects = {name: value for name, value in values.items() if name not in linear}
    held = {name: value for name, value in effects.items() if name in PLANTED or GAIN.fullmatch(name)}
    lost = not_simulated(sidecar.effects, shape, file.vehicle.thrust_curve.lag_s)
    notes = (f"not simulated: {', '.join(lost)}",) if lost else ()
    return replace(truth, model=truth.model | linear, effects=held), notes
