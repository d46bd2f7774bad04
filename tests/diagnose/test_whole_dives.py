"""Dives of the simulator, of real firmware and of others: what hides in them is named, and nothing else."""

from dataclasses import replace

import numpy as np
import pytest
from fakes.planted import explained, planted_nominal, quiet
from fakes.shared import shared
from fakes.vehicle import VEHICLE

from bridge.simulator.dive import simulate_dive
from bridge.simulator.missions import survey, validation
from bridge.simulator.truth import load_truth
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.thrusters import shaft_speed, thrust_by_shaft
from bridge.wire.framing import Framer
from bridge.wire.tlog import TlogWriter
from identify.challenge.case import dive_of, draw_case
from identify.diagnose.causes.candidates import Cause
from identify.diagnose.causes.weighing import weighing_of
from identify.diagnose.diagnose import diagnose
from identify.diagnose.findings import parameters_of
from identify.dive import Signal
from identify.effects.actuators import SATURATION, thruster_lag
from identify.ingest.open import read_dive
from identify.statistics import Z95

WHOLE_S = 1000.0
short_and_whole = pytest.mark.parametrize("seconds", [150.0, WHOLE_S])


def diagnosis_of(name, seconds, lag_s=0.03):
    file = load_vehicle(VEHICLE)
    curve = replace(file.vehicle.thrust_curve, lag_s=lag_s)
    file = replace(file, vehicle=replace(file.vehicle, thrust_curve=curve))
    dives = (read_dive(shared("sealed", name, f"{which}.tlog.gz")) for which in ("dive", "check"))
    dive, check = (
        recording.between(recording.span_s[0], recording.span_s[0] + seconds) for recording in dives
    )
    return diagnose(dive, file, "hovering", check=check, progress=quiet)


@pytest.mark.soak
def test_four_effects_at_once_are_all_named():
    hidden = ("weak_thruster", "steady_current", "quadratic_drag", "thruster_lag")
    case = draw_case(398_003, kind="two", names=hidden)
    diagnosis = diagnose(dive_of(case), case.file, case.configuration, progress=quiet)
    names = {name for cause in diagnosis.findings for name in (cause.name, *cause.also)}
    assert {*hidden} <= names
    assert len(diagnosis.findings) == len(hidden)


@pytest.mark.soak
@short_and_whole
def test_a_dive_that_hides_nothing_has_no_gap(seconds):
    diagnosis = diagnosis_of("open_1", seconds)
    assert diagnosis.verdict == "no_gap"
    assert diagnosis.findings == ()
    assert diagnosis.gap.before == pytest.approx(1.0, abs=0.15)
    assert diagnosis.check.after == pytest.approx(1.0, abs=0.15)


@pytest.mark.soak
@pytest.mark.parametrize("seed", [310_024, 310_001, 310_023, 310_026])
def test_a_quiet_gyro_that_sees_a_whole_dive_turn_makes_no_unknown_force(seed):
    """Its readings, dated an eighth of a millisecond off, did."""
    case = draw_case(seed, kind="none")
    diagnosis = diagnose(dive_of(case), case.file, case.configuration, progress=quiet)
    assert (diagnosis.verdict, diagnosis.findings) == ("no_gap", ())


@pytest.mark.soak
@short_and_whole
def test_a_drag_that_is_hidden_is_named_with_its_size_and_nothing_else_is(seconds):
    diagnosis = diagnosis_of("open_2", seconds)
    assert [finding.name for finding in diagnosis.findings] == ["quadratic_drag"]
    truth = {"X_uu": 30.37, "Y_vv": 28.65, "N_rr": 10.43}
    for name, value in truth.items():
        parameter = diagnosis.findings[0].parameters[name]
        std = (parameter.high95 - parameter.low95) / 3.92
        assert abs(parameter.value - value) < 3.3 * std, name
    assert diagnosis.check.after < diagnosis.check.before
    assert diagnosis.heldout.after < diagnosis.heldout.before


@pytest.mark.soak
@pytest.mark.parametrize("lag_s", [0.05, 0.01])
def test_a_lag_of_the_vehicle_file_that_is_20_ms_off_is_named_with_the_true_one(lag_s):
    diagnosis = diagnosis_of("open_1", WHOLE_S, lag_s)
    assert (diagnosis.verdict, [finding.name for finding in diagnosis.findings]) == (
        "explained",
        ["thruster_lag"],
    )
    true = diagnosis.findings[0].parameters["time_constant"]
    assert true.low95 < 0.03 < true.high95


TRUE = {"X_uu": 48.285, "Y_vv": 62.08, "Z_ww": 68.98}


@pytest.mark.soak
def test_the_firmwares_own_submarine_has_quadratic_drag_and_no_gap_where_its_file_has_both_drags():
    file = load_vehicle("ardusub_vectored")
    dive = read_dive(shared("data", "ardusub_sitl", "still.tlog.gz"), None, file)
    diagnosis = diagnose(dive, file, "vectored", progress=quiet)
    assert (diagnosis.verdict, [finding.name for finding in diagnosis.findings]) == (
        "explained",
        ["quadratic_drag"],
    )
    parameters = diagnosis.findings[0].parameters
    for name in ("X_uu", "Y_vv"):
        assert parameters[name].value == pytest.approx(TRUE[name], rel=0.05)
    # Its heave was only held.
    assert parameters["Z_ww"].low95 < TRUE["Z_ww"] < parameters["Z_ww"].high95
    shape = replace(file.vehicle.configurations["vectored"], damping="both")
    both = replace(file, vehicle=replace(file.vehicle, configurations={"vectored": shape}))
    diagnosis = diagnose(dive, both, "vectored", progress=quiet)
    assert (diagnosis.verdict, diagnosis.findings) == ("no_gap", ())
    assert any("Yaw was not judged: it settles within" in note for note in diagnosis.provisos)


FILE = load_vehicle("ruvifist")


def dived(folder, mission, truth=None):
    path = folder / "telemetry.tlog"
    framer = Framer()
    with TlogWriter(path) as writer:

        def sink(unix_s, data):
            for frame in framer.feed(data):
                writer.write(int(unix_s * 1e6), frame.raw)

        simulate_dive(FILE, "survey", mission, seed=4, sink=sink, truth=truth)
    return read_dive(path, None, FILE)


@pytest.fixture(scope="module")
def dive(tmp_path_factory):
    return dived(tmp_path_factory.mktemp("honest"), validation(sways=False))


@pytest.mark.soak
def test_a_propeller_that_breaks_in_mid_dive_is_named_with_when_and_how_much_and_nothing_else_is(tmp_path):
    truth = replace(load_truth(FILE, "survey"), onset={"T2_gain": 0.5}, onset_s=150.0)
    diagnosis = diagnose(dived(tmp_path, survey(), truth), FILE, "survey", progress=quiet)
    (finding,) = diagnosis.findings
    assert (diagnosis.verdict, finding.cause.key) == ("explained", ("weak_thruster", 2))
    assert finding.cause.effect.since_s == pytest.approx(150.0, abs=3.0)
    assert finding.parameters["gain"].value == pytest.approx(0.5, abs=0.02)


MOST_TOLD = 0.9
LIBRARY = (SATURATION,)


@pytest.fixture(scope="module")
def shafts_say():
    """The nominal fit of a vehicle that hides nothing, whose speed controllers tell no fast turning; and the thrust of
    what they tell at most, N."""
    case = draw_case(300_904, names=[], seconds=100.0, rpm=True)
    dive, curve = dive_of(case), case.file.vehicle.thrust_curve
    thrust_n = thrust_by_shaft(curve, dive.rpm.value)
    most_n = MOST_TOLD * np.abs(thrust_n).max()
    speeds = 60.0 * shaft_speed(curve, np.clip(thrust_n, -most_n, most_n))
    deaf = replace(dive, rpm=Signal(dive.rpm.time_s, speeds))
    return planted_nominal(case, deaf), most_n


def test_controllers_that_tell_no_fast_turning_limit_no_thrust(shafts_say):
    nominal, most_n = shafts_say
    alone = weighing_of(nominal, LIBRARY).fitted([Cause(SATURATION, np.array([most_n]))])
    assert alone.gain > 70.0
    assert alone.motion_nats < 3.0
    assert explained(nominal, *LIBRARY).causes == ()


def test_an_interval_ends_where_a_parameter_does(shafts_say):
    nominal, most_n = shafts_say
    lag, _ = thruster_lag(nominal.course.lag_s)
    fit = weighing_of(nominal, LIBRARY).fitted([Cause(SATURATION, np.array([most_n]))])
    wide = replace(fit, causes=(Cause(lag, np.array([0.08])),), covariance=np.array([[1.0]]))
    shafts_say = parameters_of(wide, 0)["time_constant"]
    assert (shafts_say.value, shafts_say.low95, shafts_say.high95) == (0.08, 0.0, pytest.approx(0.08 + Z95))
    close = replace(wide, causes=(Cause(lag, np.array([4.9])),))
    assert parameters_of(close, 0)["time_constant"].high95 == 5.0
