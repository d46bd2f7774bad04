"""`seatrial replay`: send a recorded dive to a link, at its recorded times."""

import argparse
import time
from itertools import chain
from pathlib import Path
from typing import Final

from bridge import clock as clocks
from bridge import exit_codes
from bridge.links import secured
from bridge.wire.redaction import carries_key
from bridge.wire.tlog import each_nonempty, read_tlog
from gcs_plugin.dives.folder import load_folder
from gcs_plugin.dives.replay import onward, play
from tui import show

LISTENS: Final = "udpin:"
"""A link that listens for datagrams sends to those alone who have spoken there."""

LOOK_S: Final = 0.5


def run(arguments: argparse.Namespace) -> int:
    path = Path(arguments.dive)
    files = load_folder(path).telemetry() if path.is_dir() else [path]
    records = list(onward(chain.from_iterable(each_nonempty(files, read_tlog))))
    first_us, last_us = records[0][0], records[-1][0]
    start_us, length_us = first_us + arguments.start_s * 1e6, max(last_us - first_us, 1)
    if start_us > last_us:
        raise exit_codes.UsageError(
            f"--from {arguments.start_s:g}: {path} is {length_us / 1e6:.0f} s long; name an earlier second"
        )
    clock = clocks.SystemClock()
    played = play(records, clock, time.sleep, arguments.speed, arguments.start_s)
    link = secured.Opener(arguments.sign_key, clock, secured.on_words).open(arguments.link)
    sent = left_out = 0
    try:
        if arguments.link.startswith(LISTENS):
            show.say(
                show.words(), f"waits until somebody speaks on {link.name}, and then plays; Ctrl-C ends it"
            )
            while not link.read(LOOK_S):
                pass
        with show.progress(f"replay {path.name}") as tell:
            for stamp_us, frame in played:
                if carries_key(frame.raw):  # with the key zeroed, the frame would erase a vehicle's own key
                    left_out += 1
                    continue
                link.read(0.0)  # a link that listens learns by it whom it answers
                link.write(frame.raw)
                sent += 1
                tell((stamp_us - first_us) / length_us, f"{(stamp_us - first_us) / 1e6:.0f} s")
    finally:
        link.close()
    frames = "frame" if sent == 1 else "frames"
    untold = f"; {left_out} of SETUP_SIGNING left out, which would set a key to sign with" if left_out else ""
    show.say(show.results(), f"{sent} {frames} sent to {link.name}{untold}")
    return exit_codes.DONE
