"""Velocities that are passed on faster than they are measured count once; those of honest sensors stay as they are."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from bench.missions.mission import draw_one
from identify.checks.impossible import without_repeated
from identify.dive import Dive, Signal
from identify.ingest.open import read_dive

SEALED = Path(__file__).resolve().parents[2].parent / "shared" / "sealed"
COLUMNS = "time: {column: t, unit: s}\nvelocity: {columns: [u, v, w], unit: m/s}\n"
RNG = np.random.default_rng(100_351)


@cache
def mission():
    return draw_one(100_351, seconds=60.0).dive


def dive_of(value, rate_hz=20.0):
    return Dive("d", Path("d.tlog"), "0" * 64, velocity=Signal(np.arange(len(value)) / rate_hz, value))


def measured(count):
    return 0.3 * RNG.standard_normal((count, 3))


@pytest.mark.parametrize("times", [2, 3, 4])
def test_only_the_first_of_velocities_that_come_equally_often_is_kept(times):
    once = measured(100)
    found = without_repeated(dive_of(np.repeat(once, times, axis=0)))
    assert np.array_equal(found.velocity.value, once)
    assert np.array_equal(found.velocity.time_s, np.arange(0, 100 * times, times) / 20.0)
    assert found.notes == (
        f"Each velocity comes {times} times over: they are passed on at 20 Hz and measured at a part of that, so only "
        "the first of each is taken for a reading.",
    )


def test_a_rate_that_does_not_divide_the_other_is_told_too():
    once = measured(100)
    found = without_repeated(dive_of(once[(np.arange(250) * 0.4 + 1e-9).astype(int)]))
    assert np.array_equal(found.velocity.value, once)
    assert found.notes[0].startswith("Each velocity comes 2.5 times over: ")


def test_lost_readings_stay_and_part_no_copies():
    once = measured(100)
    value = np.repeat(once, 2, axis=0)
    value[[7, 50]] = np.nan
    found = without_repeated(dive_of(value)).velocity.value
    assert np.isnan(found).all(axis=1).sum() == 2
    assert np.array_equal(found[np.isfinite(found).all(axis=1)], once)


def test_a_sensor_without_noise_that_rests_and_goes_stays_as_it_is():
    time_s = np.arange(0.0, 60.0, 0.1)
    surge = np.maximum(np.sin(0.3 * time_s), 0.0)
    dive = dive_of(np.column_stack([surge, 0 * surge, 0 * surge]), 10.0)
    assert without_repeated(dive) is dive
    resting = dive_of(np.zeros((600, 3)))
    assert without_repeated(resting) is resting


def test_coarse_steps_stay_as_they_are():
    coarse = dive_of(np.round(0.4 * RNG.standard_normal((600, 3))))
    assert without_repeated(coarse) is coarse


def test_an_honest_dive_stays_as_it_is():
    assert without_repeated(mission()) is mission()
    without = replace(mission(), velocity=None)
    assert without_repeated(without) is without


@pytest.mark.skipif(
    not (SEALED / "open_1").exists(), reason="the dives made elsewhere are not beside this checkout (shared)"
)
@pytest.mark.parametrize("name", ["open_1", "open_2"])
def test_a_dive_made_elsewhere_stays_as_it_is(name):
    assert not any("times over" in note for note in read_dive(SEALED / name / "dive.tlog.gz").notes)


def test_a_recording_of_a_dvl_that_repeats_is_read_once_each(tmp_path):
    """A table, the shortest way into a dive."""
    rows = [
        "t,u,v,w",
        *(f"{0.1 * i:.1f},{v[0]},{v[1]},{v[2]}" for i, v in enumerate(measured(60).repeat(2, 0))),
    ]
    table, columns = tmp_path / "dvl.csv", tmp_path / "columns.yaml"
    table.write_text("\n".join(rows), encoding="utf-8")
    columns.write_text(COLUMNS, encoding="utf-8")
    found = read_dive(table, columns)
    assert len(found.velocity) == 60
    assert any("comes 2 times over" in note for note in found.notes)
