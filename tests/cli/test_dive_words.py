"""What is said of a dive that is over tells what was lost where, and claims nothing else."""

from pathlib import Path

import pytest

from gcs_plugin.recording.recorder import Count
from tui.recording import RecordedDive

FOLDER = Path("dives/2026-11-20T0912Z-lake")


@pytest.mark.parametrize(
    ("count", "words"),
    [
        (Count(1, 12, 12, 960, 0), f"12 frames, 960 bytes, 0 lost here: {FOLDER}"),
        (Count(1, 12, 10, 800, 2), f"10 frames, 800 bytes, 2 lost here: {FOLDER}"),
        (
            Count(1, 12, 12, 960, 0, missed=5),
            f"12 frames, 960 bytes, 0 lost here, 5 lost on the way: {FOLDER}",
        ),
        (
            Count(1, 12, 12, 960, 0, unheard_s=58.25),
            f"12 frames, 960 bytes, 0 lost here, 58 s unheard at a stretch: {FOLDER}",
        ),
    ],
)
def test_the_last_words_of_a_dive(count, words):
    assert RecordedDive(FOLDER, count).words == words


@pytest.mark.parametrize(
    ("count", "advice"),
    [
        (Count(1, 12, 12, 960, 0, missed=5), ""),
        (
            Count(1, 12, 12, 960, 0, unheard_s=58.25, keeps_ring=True),
            "58 s unheard: `seatrial fetch` brings what the vehicle kept of it",
        ),
        (
            Count(1, 12, 12, 960, 0, unheard_s=58.25),
            "58 s unheard: another recording of the dive may have it, see `seatrial merge`",
        ),
    ],
)
def test_of_a_dive_with_a_silence_it_is_said_what_brings_it(count, advice):
    assert RecordedDive(FOLDER, count).advice == advice
