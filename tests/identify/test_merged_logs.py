"""A log of the autopilot beside the telemetry of a dive: one clock, nothing heard replaced, strangers left out."""

import numpy as np
import pytest
from autopilot_log import Turning, heard, logged
from fakes.shared import shared

from bridge.errors import LogError
from bridge.vehicle.config import Water, load_vehicle
from bridge.wire.clock_line import ClockLine, fit_clock
from identify.dive import Signal
from identify.ingest.mavlink.autopilot_log import in_holes, merged
from identify.ingest.mavlink.tlog import read_tlog
from identify.ingest.mavlink.turns import match
from identify.ingest.open import read_dive, recording_files
from identify.ingest.same_dive import identity_of

DRIFTS = (0.0, 40e-6, -80e-6)


def since_its_own_boot(drift=0.0, booted_s=-12.7):
    """A clock that read 0 when the other read `booted_s`."""
    return lambda boot_s: (boot_s - booted_s) * (1.0 + drift)


def folder_of(tmp_path, turning, **how):
    folder = tmp_path / "dive"
    folder.mkdir()
    heard(folder / "telemetry.tlog", turning, **how)
    return folder


@pytest.mark.parametrize("drift", DRIFTS)
def test_a_planted_offset_and_drift_are_found_within_what_is_stated(tmp_path, drift):
    turning, clock = Turning(), since_its_own_boot(drift)
    ours = read_tlog([heard(tmp_path / "t.tlog", turning)], "t.tlog")
    other = tmp_path / "1.BIN"
    logged(other, turning, clock)
    theirs = read_dive(other)
    matched = match(ours, vars(theirs))
    time_s = np.array([110.0, 250.0, 390.0])
    truth_s = np.array([clock(time) - time for time in time_s])
    assert np.abs(matched.line.ahead_s(time_s) - truth_s).max() <= matched.within_s < 0.01
    assert abs(matched.line.drift - drift) <= 2 * matched.line.drift_std + 1e-6
    assert np.abs(matched.line.here_s(truth_s + time_s) - time_s).max() <= matched.within_s


def test_the_line_is_stated_as_well_as_it_is_known():
    rng, held = np.random.default_rng(0), 0
    for _ in range(200):
        time_s, std_s = np.sort(rng.uniform(0, 1500, 30)), rng.uniform(5e-4, 5e-3, 30)
        drift = rng.normal(0, 5e-5)
        wild = rng.choice([1, 1, 1, 1, 6], 30)
        line = fit_clock(time_s, 12.7 + drift * time_s + rng.normal(0, 1, 30) * std_s * wild, std_s)
        ends_s = np.array([0.0, 1500.0])
        held += bool(np.abs(line.ahead_s(ends_s) - 12.7 - drift * ends_s).max() <= line.within_s(0.0, 1500.0))
    assert 180 <= held <= 200


@pytest.mark.parametrize(
    ("offset_s", "drift", "words"),
    [
        (-12.7, 40e-6, "is 12.700 s behind, gains 40 ± 3 ppm, and is known to 4 ms"),
        (12.7, -40e-6, "is 12.700 s ahead, loses 40 ± 3 ppm, and is known to 4 ms"),
    ],
)
def test_a_line_says_which_clock_is_ahead_and_which_way_it_drifts(offset_s, drift, words):
    assert ClockLine(100.0, offset_s, drift, 1e-3, 1.5e-6).words(100.0, 1100.0) == words


def test_a_log_dropped_into_the_folder_fills_up_what_came_rarely(tmp_path):
    turning, clock = Turning(), since_its_own_boot(40e-6)
    folder = folder_of(tmp_path, turning)
    alone = read_dive(folder)
    logged(folder / "00000042.BIN", turning, clock)
    whole = read_dive(folder)
    assert any("too slow" in note for note in alone.notes)
    assert not any("too slow" in note for note in whole.notes)
    note = next(note for note in whole.notes if note.startswith("00000042.BIN is merged"))
    assert "its clock is 12." in note
    assert "gains" in note
    assert "It fills up thruster commands (" in note
    # All that was heard is there as it was heard, and all else is what the vehicle did then.
    kept = np.isin(whole.pwm.time_s, alone.pwm.time_s)
    assert (whole.pwm.value[kept] == alone.pwm.value).all()
    filled = Signal(whole.pwm.time_s[~kept], whole.pwm.value[~kept])
    assert len(filled) > 6000
    assert np.abs(filled.value[:, 0] - turning.pwm_us(filled.time_s)).max() <= 2.0
    assert (np.diff(whole.pwm.time_s) > 0).all()
    assert len(whole.gyro) == len(alone.gyro)


def test_how_filled_up_pulses_were_recorded_is_known_by_the_log(tmp_path):
    telemetry = heard(tmp_path / "t.tlog", turning := Turning())
    logged(log := tmp_path / "1.BIN", turning, since_its_own_boot())
    samples = read_tlog([telemetry], "t.tlog") | {"commands_hold": False}
    assert merged(samples, [telemetry], log)["commands_hold"] is None


def test_what_was_never_heard_is_brought_and_what_lies_beyond_the_dive_is_not(tmp_path):
    turning = Turning()
    folder = folder_of(tmp_path, turning, seconds=200.0, pwm_hz=20.0)
    path = folder / "telemetry.tlog"
    logged(folder / "7.bin", turning, since_its_own_boot(), start_s=50.0, seconds=300.0)
    whole = read_dive(folder)
    heard_s = read_tlog([path], "t")["gyro"].time_s
    assert whole.span_s == (heard_s[0], heard_s[-1])
    note = next(note for note in whole.notes if note.startswith("7.bin is merged"))
    assert "100 s of it lie before or after what was heard" in note


def test_the_pressure_of_a_log_tells_the_depth_of_a_dive_that_heard_none(tmp_path):
    turning = Turning()
    folder = folder_of(tmp_path, turning)
    assert read_dive(folder).depth_by(Water()) is None
    logged(folder / "7.bin", turning, since_its_own_boot(), sinks=True)
    whole = read_dive(folder)
    depth = whole.depth_by(Water())
    assert depth is not None
    assert np.diff(depth.at(np.array([150.0, 250.0]))[:, 0]) == pytest.approx(1.0, rel=0.05)
    assert any("It brings pressure." in note for note in whole.notes)


def test_a_log_brings_no_pressure_beside_a_depth_that_was_heard(tmp_path):
    turning = Turning()
    folder = folder_of(tmp_path, turning)
    log = logged(tmp_path / "7.bin", turning, since_its_own_boot(), sinks=True)
    telemetry = folder / "telemetry.tlog"
    fields = read_tlog([telemetry], "t")
    fields["depth"] = Signal(fields["gyro"].time_s, 0.01 * fields["gyro"].time_s[:, None])
    assert "pressure" not in merged(fields, [telemetry], log)


def test_of_a_pressure_that_was_heard_a_log_fills_no_holes(tmp_path):
    turning = Turning()
    folder = folder_of(tmp_path, turning)
    log = logged(tmp_path / "7.bin", turning, since_its_own_boot(), sinks=True)
    telemetry = folder / "telemetry.tlog"
    seldom = Signal(np.array([50.0, 150.0, 250.0]), np.array([[1.2e5], [1.3e5], [1.4e5]]))
    fields = read_tlog([telemetry], "t") | {"pressure": seldom}
    assert merged(fields, [telemetry], log)["pressure"] is seldom


def test_the_frame_that_a_log_states_is_held_against_the_vehicle_file_where_none_was_heard(tmp_path):
    turning = Turning()
    folder = folder_of(tmp_path, turning)
    bluerov2 = load_vehicle("bluerov2")
    assert read_dive(folder, vehicle=bluerov2).motors == 0
    logged(folder / "7.bin", turning, since_its_own_boot(), parameters={"FRAME_CONFIG": 2.0})
    with pytest.raises(
        LogError, match=r"drives 8 motors \(FRAME_CONFIG\), and vehicle 'bluerov2' has 6 thrusters"
    ):
        read_dive(folder, vehicle=bluerov2)


def test_originals_stay_and_the_dive_is_known_by_both(tmp_path):
    turning = Turning()
    folder = folder_of(tmp_path, turning)
    alone = identity_of(recording_files(folder))
    log = logged(folder / "1.BIN", turning, since_its_own_boot())
    before = [(file.name, file.read_bytes()) for file in sorted(folder.iterdir())]
    both = read_dive(folder)
    assert [(file.name, file.read_bytes()) for file in sorted(folder.iterdir())] == before
    assert recording_files(folder)[-1] == log
    assert both.sha256 != alone.sha256


def test_two_vehicles_files_are_refused(tmp_path):
    folder = folder_of(tmp_path, Turning(0))
    logged(folder / "other.BIN", Turning(1), since_its_own_boot())
    dive = read_dive(folder)
    (note,) = (note for note in dive.notes if note.startswith("other.BIN"))
    assert note.startswith("other.BIN is left out: it turned otherwise")
    assert len(dive.pwm) == 600


def test_a_log_of_another_system_is_refused_by_its_own_word(tmp_path):
    turning = Turning()
    folder = folder_of(tmp_path, turning)
    log = logged(folder / "2.BIN", turning, since_its_own_boot(), parameters={"SYSID_THISMAV": 2.0})
    telemetry = folder / "telemetry.tlog"
    with pytest.raises(LogError, match="it is of system 2, and the dive of system 1"):
        merged(read_tlog([telemetry], "t"), [telemetry], log)


def test_where_the_autopilot_dated_both_its_clock_is_taken_and_another_boot_refused(tmp_path):
    turning = Turning()
    folder = folder_of(tmp_path, turning, component=1, autopilot=3)
    logged(folder / "same.BIN", turning, lambda boot_s: boot_s)
    logged(folder / "before.BIN", turning, lambda boot_s: boot_s - 60.0)
    notes = {note.split()[0]: note for note in read_dive(folder).notes if ".BIN" in note}
    assert "the autopilot dated its telemetry by the same clock" in notes["same.BIN"]
    assert "it lies 60.0 s off the times that the same autopilot told" in notes["before.BIN"]


def test_a_vehicle_that_does_not_turn_tells_no_clock(tmp_path):
    class Still(Turning):
        def rate_rad_s(self, time_s):
            return 0.0 * super().rate_rad_s(time_s)

    folder = folder_of(tmp_path, Still())
    logged(folder / "1.BIN", Still(), since_its_own_boot())
    (note,) = (note for note in read_dive(folder).notes if note.startswith("1.BIN"))
    assert "no 30 s in common in which the vehicle turns" in note


def test_a_damaged_log_costs_the_dive_nothing(tmp_path):
    folder = folder_of(tmp_path, Turning())
    alone = read_dive(folder)
    (folder / "1.BIN").write_bytes(b"\xa3\x95\x80" * 40)
    (folder / "2.BIN").write_bytes(b"")
    whole = read_dive(folder)
    assert (whole.pwm.value == alone.pwm.value).all()
    assert [note.split(" is ")[0] for note in whole.notes if ".BIN" in note] == ["1.BIN", "2.BIN"]


def test_only_holes_are_filled():
    ours = Signal(np.array([0.0, 0.5, 0.6, 0.7, 1.5]), np.zeros((5, 1)))
    other = Signal(np.arange(-0.2, 2.0, 0.1), np.zeros((22, 1)))
    filled = [-0.2, -0.1, 0.1, 0.2, 0.3, 0.4, *np.arange(0.8, 1.45, 0.1), 1.6, 1.7, 1.8, 1.9]
    assert other.time_s[in_holes(ours, other)] == pytest.approx(filled, abs=1e-9)


def test_a_real_log_of_another_dive_is_refused():
    dives = shared("data", "ardusub_dives")
    telemetry = dives / "small.tlog"
    with pytest.raises(LogError, match="in common in which the vehicle turns"):
        merged(read_tlog([telemetry], "small"), [telemetry], dives / "small.BIN")
