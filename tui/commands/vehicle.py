"""`seatrial vehicle guess`: propose a vehicle file for a log, by the autopilot's own parameters or its motion."""

import argparse
from pathlib import Path

from bridge import exit_codes
from identify.run.vehicle_of_log import Guess, guess
from identify.words import listed
from tui import show
from tui.files import Files
from tui.show import Table


def run(arguments: argparse.Namespace) -> int:
    path = Path(arguments.log)
    guessed = guess(path)
    console = show.results(arguments.json)
    with Files() as files:
        kept = bool(arguments.out) and files.text(Path(arguments.out), guessed.text(path.name))
        show.put(console, _table(guessed))
        show.say(console, *_sentences(guessed, arguments.out if kept else ""))
        files.json(guessed.to_json() | {"out": arguments.out if kept else None}, arguments.json)
    return files.code(exit_codes.NO if guessed.findings else exit_codes.DONE)


def _table(guessed: Guess) -> Table:
    wiring = guessed.wiring
    rows = [
        (str(output), str(motor), "reversed" if motor in wiring.reversed else "")
        for output, motor in enumerate(wiring.motors, 1)
    ]
    number = f"{guessed.firmware.frame} {guessed.firmware.frames.index(wiring.frame)}"
    title = f"frame {wiring.frame}, {number if guessed.by == 'parameters' else 'by the motion alone'}"
    return Table(title, ("output", "motor", "direction"), rows)


def _sentences(guessed: Guess, out: str) -> list[str]:
    wiring = guessed.wiring
    said = []
    if wiring.is_plain:
        kept = f"; the same is written to {out}" if out else ""
        said.append(f"vehicle file: {guessed.base} fits as it is{kept}")
    else:
        unlike = [
            *(["reversed motors"] if wiring.reversed else []),
            *([f"{len(wiring.swapped)} outputs with another motor"] if wiring.swapped else []),
        ]
        way = f"written to {out}" if out else "write it with --out FILE"
        said.append(f"vehicle file: {guessed.base}, but with {listed(unlike)}: {way}")
    said += [f"finding: {finding}" for finding in guessed.findings]
    if not guessed.findings:
        said.append(
            f"motion: goes with the thrust in {listed(guessed.judged)}"
            if guessed.judged
            else f"motion: not compared with the thrust: {guessed.unjudged}"
        )
    return said + [f"warning: {hint}" for hint in guessed.hints]
