"""`seatrial applet`: the feed-forward inside ArduSub: deploy it, check it, remove it."""

import argparse
from dataclasses import asdict
from pathlib import Path

from bridge import clock as clocks
from bridge import exit_codes
from bridge.ardusub.applet import NAME
from bridge.command_line import check_folder
from bridge.links import secured
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.mode import word_of
from gcs_plugin.applet import Deployment, State
from tui import links, show

QUESTIONS = {
    "deploy": f"write {NAME} into vehicle {{}}'s autopilot, and reboot it where its scripting is off?",
    "remove": f"remove {NAME} from vehicle {{}}'s autopilot?",
}


def run(arguments: argparse.Namespace) -> int:
    if arguments.action == "deploy":
        check_folder("--receipts", arguments.receipts)
    file = load_vehicle(arguments.vehicle)
    clock = clocks.SystemClock()
    opener = secured.Opener(arguments.sign_key, clock, secured.on_words)
    link = links.coming_back(links.link_for(arguments.link, opener.open), arguments.link, clock, opener.open)
    try:
        with show.progress("looking for the vehicle"):
            deployment = Deployment(link, clock, file, file.configuration_chosen(), arguments.system)
        refused = arguments.action == "deploy" and deployment.fault
        if arguments.action != "check" and not refused and not arguments.yes:
            question = QUESTIONS[arguments.action].format(deployment.target[0])
            if not show.agreed(deployment.client, question, arguments.action):
                show.say(show.words(), "nothing was sent")
                return exit_codes.INTERRUPTED
        with show.progress(arguments.action) as tell:
            if arguments.action == "deploy":
                receipt = deployment.deploy(Path(arguments.receipts), lambda words: tell(0.5, words))
                if receipt is not None:
                    show.say(show.results(arguments.json), f"values before: {receipt.preimage}")
            elif arguments.action == "remove":
                deployment.remove(lambda words: tell(0.5, words))
            state = deployment.look()
    finally:
        link.close()
    show.say(show.results(arguments.json), *lines(state))
    show.write_json(asdict(state) | {"good": state.good}, arguments.json)
    good = not state.runs and state.there is None if arguments.action == "remove" else state.good
    return exit_codes.DONE if good else exit_codes.NO


def lines(state: State) -> list[str]:
    said = [f"wiring: {state.fault or 'fail-safe, the mixer is mirrored on the lower outputs'}"]
    if state.folder is None:
        return [*said, "scripting: off"]
    if state.there is None:
        script = "none"
    elif state.fault:
        script = "there; remove it: seatrial applet remove"
    else:
        script = (
            "that of the vehicle file" if state.there else "another than the vehicle file's: deploy again"
        )
    said.append(f"script in {state.folder}: {script}")
    if not state.runs:
        return [*said, "runs: no, the mixer alone drives the thrusters"]
    force = f"set {state.active:.0f} in force" if state.active else "no set in force: seatrial params upload"
    runs = "yes" if state.is_mine or state.fault else "yes, but another than the vehicle file's"
    return [*said, f"runs: {runs}; feed-forward {word_of(state.mode)}, {force}"]
