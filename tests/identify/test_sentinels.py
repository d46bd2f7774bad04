"""Numbers by which a sensor says that it read nothing."""

import numpy as np
import pytest
from built_recordings import of_table, write

from identify.ingest.mapping.proposal_of_runs import propose
from identify.ingest.open import read_dive, read_streams

T = np.arange(0.0, 30.0, 0.1)
SPEED = 0.4 + 0.3 * np.sin(0.5 * T)
LOST = slice(40, 60)


def rows(said, unit=1.0):
    """A DVL's table whose x reads `said`, and once -`said`, while it sees no bottom."""
    x = unit * SPEED
    x[LOST] = said
    x[50] = -said
    lines = [f"{t:.1f},{u:.9g},{unit * 0.1 * np.sin(t):.9g}" for t, u in zip(T, x, strict=True)]
    return "\n".join(["t,vx,vy", *lines])


@pytest.mark.parametrize(
    ("said", "unit"),
    [(8888.0, 1000.0), (-32768.0, 1000.0), (8.888, 1.0), (-32.768, 1.0), (99.99, 1.0), (88.888, 1.0)],
)
def test_a_velocity_that_the_sensor_gives_for_none_is_unknown_told_and_in_no_range(tmp_path, said, unit):
    name = "m/s" if unit == 1.0 else "mm/s"
    velocity = f"time: {{column: t}}\nvelocity: {{columns: [vx, vy, null], unit: {name}}}\n"
    dive = of_table(tmp_path, rows(said, unit), velocity)
    unknown = np.zeros(len(T), np.bool_)
    unknown[LOST] = True
    assert np.isnan(dive.velocity.value[:, 0]).tolist() == unknown.tolist()
    assert dive.velocity.value[~unknown, 0] == pytest.approx(SPEED[~unknown])
    assert f"{-abs(said):g} and {abs(said):g} in vx: taken for no reading." in dive.notes
    proposal = propose(read_streams(tmp_path / "dive.csv").streams, tmp_path / "dive.csv")
    assert proposal.columns.velocity.unit == name
    (profile,) = (each for each in proposal.profiles if each.name == "vx")
    assert profile.largest == pytest.approx(unit * SPEED.max(), rel=0.01)


def test_a_number_that_others_come_near_or_that_comes_once_is_a_reading(tmp_path):
    rpm = np.linspace(0.0, 9999.0, 300)
    rpm[-3:] = 9999.0
    depth = 1.0 + 0.01 * T
    depth[7] = 99.99
    lines = [f"{t:.1f},{n:.9g},{d:.9g}" for t, n, d in zip(T, rpm, depth, strict=True)]
    read = read_streams(write(tmp_path / "log.csv", "\n".join(["t,rpm_1,depth", *lines]).encode()))
    assert read.notes == ()
    assert read.streams[0].columns["rpm_1"] == pytest.approx(rpm)
    assert read.streams[0].columns["depth"][7] == 99.99


@pytest.mark.parametrize("said", [32.0, -99.0, 999.0, -1000.0])
def test_a_round_number_for_no_velocity_changes_no_unit_and_is_left_out_as_beyond_any_vehicle(tmp_path, said):
    log = write(tmp_path / "log.csv", rows(said).encode())
    columns = propose(read_streams(log).streams, log).columns
    assert columns.velocity.unit == "m/s"
    (tmp_path / "map.yaml").write_text("time: {column: t}\nvelocity: {columns: [vx, vy, null], unit: m/s}\n")
    dive = read_dive(log, tmp_path / "map.yaml")
    assert np.abs(dive.velocity.value[:, :2]).max() < 1.0
    assert any("no vehicle reaches" in note for note in dive.notes)


def test_a_word_on_columns_that_the_map_does_not_use_is_spared(tmp_path):
    dive = of_table(
        tmp_path, rows(8.888), "time: {column: t}\nvelocity: {columns: [null, vy, null], unit: m/s}\n"
    )
    assert not any("no reading" in note for note in dive.notes)
