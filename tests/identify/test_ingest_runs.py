"""A recording in which the vehicle restarted: the run in which its thrusters moved it is used."""

from pathlib import Path

import pytest
from built_recordings import NAN, Stamped, contract_dive, heartbeat, odometry, outputs, recording, write

from identify.ingest.open import read_dive


def test_a_restart_leaves_the_longest_run(tmp_path: Path) -> None:
    later = [(t + 100.0, s, c, m) for t, s, c, m in contract_dive(10)]
    dive = read_dive(write(tmp_path / "a.tlog", recording([*contract_dive(6), *later])))
    assert dive.velocity is not None
    assert len(dive.velocity) == 100
    assert dive.armed is not None
    assert dive.armed.time_s[0] == pytest.approx(5.0, abs=0.05)
    assert any("restarted 1 time" in note for note in dive.notes)


def run_of(arrived_s: float, seconds: int, pwm: float, armed: bool = True) -> list[Stamped]:
    """A vehicle that starts when its first message arrives, and drives one thruster all the time."""
    said: list[Stamped] = []
    for k in range(10 * seconds):
        t = k / 10
        said.append((arrived_s + t, 1, 1, odometry(t, (0.1, 0.0, 0.0))))
        said.append((arrived_s + t, 1, 1, outputs(t, [1500.0, pwm])))
        if k % 10 == 0:
            said.append((arrived_s + t, 1, 1, heartbeat(armed=armed)))
    return said


@pytest.mark.parametrize("afloat", [(1500.0, True), (1600.0, False), (0.0, True), (NAN, False)])
def test_a_dive_is_used_rather_than_the_longer_time_afloat_after_a_restart(
    tmp_path: Path, afloat: tuple[float, bool]
) -> None:
    dive = read_dive(
        write(tmp_path / "a.tlog", recording([*run_of(0.0, 12, 1600.0), *run_of(60.0, 40, *afloat)]))
    )
    assert dive.velocity is not None
    assert len(dive.velocity) == 120
    assert (
        "The vehicle restarted 1 time during the recording; of 2 runs the one that began at 14:13 UTC, 12 s, is used "
        "(its thrusters moved it the most, for 12 s); the other lasts 40 s."
    ) in dive.notes


def test_where_no_run_was_driven_the_longest_is_used(tmp_path: Path) -> None:
    idle = [*run_of(0.0, 12, 1500.0), *run_of(60.0, 20, 1500.0), *run_of(120.0, 5, 1500.0)]
    dive = read_dive(write(tmp_path / "a.tlog", recording(idle)))
    assert dive.velocity is not None
    assert len(dive.velocity) == 200
    assert any("(it is the longest); the others last 12 s, 5 s." in note for note in dive.notes)


def test_an_output_that_stands_off_1500_while_disarmed_is_at_its_neutral_there(tmp_path: Path) -> None:
    afloat = run_of(60.0, 10, 1100.0, armed=False)
    later = [
        (60.0 + k / 10, 1, 1, message)
        for k in range(100, 400)
        for message in (
            odometry(k / 10, (0.0, 0.0, 0.0)), outputs(k / 10, [1500.0, 1100.0]), heartbeat(armed=True)
        )
    ]  # fmt: skip
    dive = read_dive(write(tmp_path / "a.tlog", recording([*run_of(0.0, 12, 1600.0), *afloat, *later])))
    assert dive.velocity is not None
    assert len(dive.velocity) == 120
