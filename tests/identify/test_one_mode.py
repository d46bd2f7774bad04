"""A dive in which FF_MODE changed is judged by one part of it, and says so."""

from dataclasses import replace

import numpy as np
import pytest
from test_raising import RATE_HZ, failed, flown, judged

from bridge.vehicle.feedforward import Mode
from identify.dive import Dive, Signal
from identify.glance.one_mode import in_one_mode


def in_modes(*parts: tuple[Mode, float]) -> Dive:
    """A dive of three axes, each moving for 45 s from 10, 65 and 120 s on, in modes up to the time beside each."""
    dive = flown(Mode.BOTH)
    time_s = np.arange(0.0, 180.0, 1.0)
    mode = np.full(len(time_s), float(parts[-1][0]))
    for one, until_s in reversed(parts):
        mode[time_s < until_s] = float(one)
    return replace(dive, ff_mode=Signal(time_s, mode[:, None]))


def test_a_dive_in_one_mode_is_judged_whole() -> None:
    found = in_one_mode(flown(Mode.SHADOW))
    assert (found.mode, found.changed) == (Mode.SHADOW, None)
    assert found.dive.duration_s == flown(Mode.SHADOW).duration_s


def test_the_part_in_which_the_reference_moves_for_longest_is_judged_and_told() -> None:
    dive = in_modes((Mode.OFF, 62.0), (Mode.SHADOW, 180.0))
    found = in_one_mode(dive)
    assert found.mode is Mode.SHADOW
    assert found.dive.nu_ref is not None
    assert found.dive.nu_ref.time_s[0] == pytest.approx(62.0, abs=1 / RATE_HZ)
    assert found.changed is not None
    assert found.changed.passed
    assert found.changed.words == (
        "changed in the dive (off 62 s, shadow 117 s); judged is the part in shadow of 117 s"
    )
    assert "mode" not in failed(judged(dive))


def test_a_long_wait_in_another_mode_is_not_taken_for_the_dive() -> None:
    assert in_one_mode(in_modes((Mode.SHADOW, 66.0), (Mode.OFF, 180.0))).mode is Mode.OFF
    still = in_modes((Mode.OFF, 5.0), (Mode.SHADOW, 65.0), (Mode.OFF, 180.0))
    assert still.nu_ref is not None
    rest = still.nu_ref.value.copy()
    rest[still.nu_ref.time_s > 65.0] = 0.0
    assert in_one_mode(replace(still, nu_ref=Signal(still.nu_ref.time_s, rest))).mode is Mode.SHADOW


def test_a_feed_forward_that_was_taken_back_while_the_vehicle_moved_is_no_go() -> None:
    found = judged(in_modes((Mode.BOTH, 20.0), (Mode.OFF, 180.0)))
    assert failed(found) == ["mode"]
    assert found.sentence.startswith("NO-GO, don't raise it: mode. Find out why it was taken back")
    assert found.criteria[0].words.startswith(
        "taken back while the reference moved: changed in the dive (both 20 s"
    )


def test_off_after_the_mission_is_no_failure() -> None:
    found = judged(in_modes((Mode.BOTH, 172.0), (Mode.OFF, 180.0)))
    assert found.flown is Mode.BOTH
    assert "mode" not in failed(found)


def test_a_mode_that_nobody_knows_is_named_by_its_number() -> None:
    dive = flown(Mode.SHADOW)
    assert dive.ff_mode is not None
    value = dive.ff_mode.value.copy()
    value[-20:] = 9.0
    found = in_one_mode(replace(dive, ff_mode=Signal(dive.ff_mode.time_s, value)))
    assert found.changed is not None
    assert "mode 9 1 s" in found.changed.words


def test_a_dive_without_a_mode_has_none_and_is_left_as_it_is() -> None:
    dive = replace(flown(Mode.SHADOW), ff_mode=None)
    assert (in_one_mode(dive).mode, in_one_mode(dive).dive) == (None, dive)
