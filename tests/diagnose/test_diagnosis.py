"""A diagnosis from its dive to its verdict, on drawn and made-up vehicles."""

import json
from dataclasses import replace
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from fakes.planted import diagnosed, quiet

from bridge.errors import FitError
from bridge.vehicle.coefficients import DAMPINGS, MASSES
from bridge.vehicle.config import Prior
from identify.challenge.case import check_of, dive_of, draw_case
from identify.challenge.tlog import tlog_of
from identify.diagnose import diagnose as answered
from identify.diagnose import prepared as module
from identify.diagnose.cleaned import refuse_short
from identify.diagnose.diagnose import diagnose
from identify.diagnose.notes import short_check_note, short_dive_note
from identify.diagnose.result import plain
from identify.diagnose.unjudged import able, lacking, unjudged_causes
from identify.dive import Signal
from identify.effects.actuators import COMMAND_DELAY, DEAD_ZONE, THRUST_GAIN
from identify.effects.environment import STEADY_CURRENT
from identify.effects.hydrodynamics import COUPLED_DAMPING, QUADRATIC_DRAG
from identify.effects.sensors import DEPTH_SCALE, DVL_DELAY
from identify.estimators.refusals import refuse_unmoved, refuse_unpushed
from tui.cli import main

SCHEMA = Path(__file__).resolve().parents[1] / "data" / "answers.schema.json"
SMALL = (COUPLED_DAMPING, STEADY_CURRENT, DEAD_ZONE, QUADRATIC_DRAG, THRUST_GAIN)


@pytest.fixture(scope="module")
def case():
    return draw_case(391_603, names=["quadratic_drag"], size=0.9, seconds=80.0)


@pytest.fixture(scope="module")
def diagnosis(case):
    return diagnosed(case, *SMALL, check=check_of(case))


@pytest.mark.slow
def test_the_hidden_effect_is_named_with_its_parameters(diagnosis):
    assert diagnosis.findings[0].name == "quadratic_drag"
    values = diagnosis.findings[0].parameters
    assert values
    for value in values.values():
        assert value.low95 < value.value < value.high95
    assert diagnosis.findings[0].gain_nats > 20
    assert diagnosis.tried[0].accepted
    assert any("together for 80 s: with so little of it to hold out" in note for note in diagnosis.notes)
    assert not any("Of the check dive" in note for note in diagnosis.notes)


def test_a_check_dive_is_fitted_by_the_file_under_its_conditions(case, monkeypatch):
    heavier = replace(case.file, sha256="heavier")
    fit = module.fitted_nominal

    def of_dive_alone(dive, file, *more):
        if file is heavier:
            raise FitError(f"{dive.name} by {file.sha256}")
        return fit(dive, file, *more)

    monkeypatch.setattr(module, "fitted_nominal", of_dive_alone)
    with pytest.raises(FitError, match=f"{check_of(case).name} by heavier"):
        diagnosed(case, DEAD_ZONE, check=check_of(case), check_file=heavier)


@pytest.mark.parametrize("seconds", [5.0, 20.0, 30.0])
def test_a_dive_counts_for_as_long_as_commands_and_motion_were_both_recorded(case, seconds):
    dive = dive_of(case)
    parts = {
        name: signal.between(dive.span_s[0], dive.span_s[0] + seconds)
        for name, signal in dive.signals().items()
        if name in ("pwm", "tau_cmd")
    }
    parted = replace(dive, **parts)
    (note,) = short_dive_note(parted)
    assert note.startswith(
        f"Thruster commands and motion were recorded together for {seconds:.0f} s: with so little"
    )
    (of_check,) = short_check_note(parted)
    assert f"were recorded together for {seconds:.0f} s, too short to tell how far" in of_check
    if seconds >= 20.0:
        refuse_short(parted, 20.0)
        return
    said = r"both in it for 5 s of 80 s, too short to tell one cause from another; record both for 20 s or more, with"
    with pytest.raises(FitError, match=said):
        refuse_short(parted, 20.0)


def test_the_gap_lies_where_it_truly_does_and_shares_sum_to_one(case, diagnosis):
    shares = {}
    for share in diagnosis.gap.where:
        shares[share.dof] = shares.get(share.dof, 0.0) + share.share
    assert sum(shares.values()) == pytest.approx(1.0)
    assert max(shares, key=lambda dof: shares[dof]) in case.truth()["dof"]
    assert diagnosis.gap.before > 1.2


def test_with_the_effect_in_the_drift_falls_towards_its_floor_here_held_out_and_on_another_dive(diagnosis):
    before, after = (
        next(drift for drift in of if drift.horizon_s == 5.0)
        for of in (diagnosis.gap.drifts, diagnosis.gap.after)
    )
    assert after.total < 0.5 * (before.total + 1.0)
    for shrink in (diagnosis.heldout, diagnosis.check):
        assert shrink.after < shrink.before
        assert shrink.value > 0.5


def test_the_feed_forward_would_gain_by_it(diagnosis):
    gain = diagnosis.findings[0].feedforward
    assert gain.after_m_s < gain.before_m_s


def test_a_simulator_that_is_known_by_a_dive_holds_also_a_cause_that_is_not_accepted(
    case, diagnosis, monkeypatch
):
    monkeypatch.setattr(answered, "unexplained_nats", lambda _left: 1e9)
    unsure = diagnosed(case, QUADRATIC_DRAG)
    assert [effect.name for effect in diagnosis.accepted.effects] == ["quadratic_drag"]
    assert unsure.accepted.effects == ()
    assert unsure.numbers["D_u"].value == pytest.approx(diagnosis.accepted.values["D_u"].value, rel=1e-6)
    assert unsure.numbers["D_u"].value < unsure.accepted.values["D_u"].value


def test_without_any_effect_to_try_no_cause_is_named_and_the_gap_is_unknown(case):
    bare = diagnose(dive_of(case), case.file, case.configuration, effects=(), progress=quiet)
    assert (bare.findings, bare.tried) == ((), ())
    assert bare.verdict == "unknown"


def test_against_a_model_accepted_before_the_feed_forward_gains_by_masses_and_dampings_too(case, diagnosis):
    accepted = {
        name: Prior(1.5 * value.value, 0.01 * value.value) for name, value in diagnosis.numbers.items()
    }
    later = diagnosed(case, QUADRATIC_DRAG, accepted=accepted)
    (gain,) = (finding.feedforward for finding in later.findings if finding.name == "quadratic_drag")
    plain_gain = diagnosis.findings[0].feedforward
    assert gain.before_m_s > 1.5 * plain_gain.before_m_s
    assert gain.after_m_s == pytest.approx(plain_gain.after_m_s, rel=0.02)


def test_the_answer_keeps_to_the_schema(diagnosis):
    jsonschema.validate(plain(diagnosis), json.loads(SCHEMA.read_text()))


def refused(case, dive, check=None):
    with pytest.raises(FitError) as error:
        diagnosed(case, THRUST_GAIN, dive=dive, check=check)
    sentence = str(error.value)
    assert (
        sum(sentence.count(str(recording.source)) for recording in (dive, check) if recording is not None)
        == 1
    )
    return sentence


def without_velocity(dive):
    """The dive with a velocity that is never a number."""
    return replace(dive, velocity=Signal(dive.velocity.time_s, np.full_like(dive.velocity.value, np.nan)))


def test_a_dive_without_velocity_is_judged_by_its_turning_and_its_depth(case):
    diagnosis = diagnosed(case, QUADRATIC_DRAG, dive=without_velocity(dive_of(case)))
    *unread, unseen = diagnosis.provisos
    assert [proviso.split(" was")[0] for proviso in unread] == ["Surge", "Sway", "Heave"]
    assert "depth alone does not determine it" in unread[2]
    assert all("no velocity" in proviso and "record the DVL" in proviso for proviso in unread)
    assert unseen.startswith("In roll, pitch and yaw no unknown force was looked for")
    assert "I_r" in diagnosis.numbers


def test_an_attitude_that_is_no_number_counts_as_none(case):
    dive = dive_of(case)
    value = dive.attitude.value.copy()
    value[100] = np.nan
    broken = diagnosed(case, QUADRATIC_DRAG, dive=replace(dive, attitude=Signal(dive.attitude.time_s, value)))
    assert [finding.name for finding in broken.findings] == ["quadratic_drag"]
    assert np.isfinite(broken.gap.before)


def test_a_wrench_without_pulses_tells_of_all_but_single_thrusters_and_their_curve(case):
    dive = replace(dive_of(case), pwm=None, rpm=None, velocity_is_filtered=True)
    diagnosis = diagnosed(case, DEAD_ZONE, QUADRATIC_DRAG, dive=dive)
    assert {trial.name for trial in diagnosis.tried} == {"quadratic_drag"}
    # How late an autopilot's filter is stands among the notes and not beside the verdict.
    (proviso,) = diagnosis.provisos
    assert (
        "record them (MAVLink's SERVO_OUTPUT_RAW or ACTUATOR_OUTPUT_STATUS, or columns that a map names)"
        in proviso
    )
    assert any("a late DVL was not judged" in note for note in diagnosis.notes)
    assert [finding.name for finding in diagnosis.findings] == ["quadratic_drag"]


def sinking_twice_as_deep(dive):
    """A level dive whose depth changes by twice the way that the velocity up and down makes."""
    time_s = np.arange(0.0, 150.0, 0.1)
    sensed = np.column_stack([0.0 * time_s, 0.0 * time_s, 0.3 * np.sin(time_s / 4.0)])
    return replace(
        dive,
        velocity=Signal(time_s, sensed),
        attitude=Signal(time_s, np.tile([1.0, 0.0, 0.0, 0.0], (len(time_s), 1))),
        depth=Signal(time_s, 5.0 - 2.0 * 0.3 * 4.0 * np.cos(time_s / 4.0)[:, None]),
    )


def with_an_output_of_no_number(dive):
    """TAU_CMD alone knows the wrench then."""
    value = dive.pwm.value.copy()
    value[:, 1] = np.nan
    return replace(dive, pwm=Signal(dive.pwm.time_s, value))


@pytest.mark.parametrize(
    ("spoilt", "unjudged", "words"),
    [
        (lambda dive: dive, (), ()),
        (lambda dive: replace(dive, pwm=None, rpm=None), (DEAD_ZONE,), ("SERVO_OUTPUT_RAW",)),
        (with_an_output_of_no_number, (DEAD_ZONE,), ("SERVO_OUTPUT_RAW",)),
        (lambda dive: replace(dive, pwm=Signal(dive.pwm.time_s[::10], dive.pwm.value[::10]), tau_cmd=None),
         (COMMAND_DELAY,), ("a delay or a lag of the thrusters was not judged",)),
        (lambda dive: replace(dive, velocity_is_filtered=True), (DVL_DELAY, DEPTH_SCALE),
         ("a late DVL was not judged", "a wrong scale of that sensor was not judged")),
        (lambda dive: replace(sinking_twice_as_deep(dive), velocity_is_filtered=True), (DVL_DELAY,),
         ("a late DVL was not judged",)),
        (lambda dive: replace(without_velocity(dive), velocity_is_filtered=True), (), ()),
    ],
    ids=["whole", "no pulses", "an output of no number", "seldom commands", "an autopilot's velocity",
         "an autopilot's that depth contradicts", "an autopilot's that is no number"],
)  # fmt: skip
def test_causes_that_need_what_was_not_recorded_are_not_tried_and_told(case, spoilt, unjudged, words):
    lacks = lacking(
        spoilt(dive_of(case)),
        dive_of(case),
        case.file.vehicle.configurations[case.configuration],
        case.file.vehicle.water,
    )
    tried = (DEAD_ZONE, COMMAND_DELAY, DVL_DELAY, DEPTH_SCALE, QUADRATIC_DRAG)
    shape = case.file.vehicle.configurations[case.configuration]
    assert {*tried} - {*able(tried, lacks, shape)} == {*unjudged}
    # A hull that has the drag itself can't lack it.
    left = {*tried} - {*able(tried, lacks, replace(shape, damping="both"))}
    assert left == {*unjudged, QUADRATIC_DRAG}
    for sentence, name in zip(unjudged_causes(lacks), words, strict=True):
        assert name in sentence


def test_what_the_check_dive_alone_lacks_is_said_of_the_check_dive(case):
    begun_s, _ = check_of(case).span_s
    check = check_of(case).between(begun_s, begun_s + 35.0)
    check = replace(check, pwm=None, frozen={"velocity": (check.span_s,)})
    diagnosis = diagnosed(case, QUADRATIC_DRAG, check=check)
    (said,) = diagnosis.provisos
    assert said.startswith("No pulses of the check dive tell what each thruster did")
    for begins in (
        f"The velocity of {check.name} repeats one value for",
        "Of the check dive thruster commands and motion were recorded together for 35 s, too short",
    ):
        assert any(note.startswith(begins) for note in diagnosis.notes)


def with_pulses(dive, of_neutral):
    """The dive with other pulses (n, k), as made from how far they were off neutral; the wrench not recorded."""
    off = dive.pwm.value - 1500.0
    return replace(dive, pwm=Signal(dive.pwm.time_s, 1500.0 + of_neutral(off)), tau_cmd=None)


def test_thrust_that_can_not_have_moved_the_vehicle_is_refused_and_any_more_is_not(case):
    def one_command(off_us):
        def pulses(off):
            out = np.zeros_like(off)
            out[100] = off_us
            return out

        return with_pulses(dive_of(case), pulses)

    assert (
        "the thrusters hardly pushed: by them alone the vehicle never goes faster than 2.2 mm/s"
        in refused(case, one_command(30.0))
    )
    refuse_unpushed(one_command(100.0), case.file, case.configuration)


def test_a_vehicle_that_cruises_steadily_is_not_held(case):
    dive = dive_of(case)
    cruise = np.zeros_like(dive.velocity.value)
    cruise[:, 0] = 0.5
    still = {
        name: replace(s, value=np.zeros_like(s.value))
        for name in ("gyro", "fog")
        if (s := getattr(dive, name))
    }
    refuse_unmoved(replace(dive, velocity=replace(dive.velocity, value=cruise), **still))


def test_a_delay_far_beyond_the_vehicle_file_s_is_named_with_its_size(case):
    dive = dive_of(case)
    early = replace(
        dive,
        pwm=Signal(dive.pwm.time_s - 0.8, dive.pwm.value),
        tau_cmd=None if dive.tau_cmd is None else Signal(dive.tau_cmd.time_s - 0.8, dive.tau_cmd.value),
    )
    diagnosis = diagnosed(case, COMMAND_DELAY, QUADRATIC_DRAG, dive=early)
    (delay,) = (item for item in diagnosis.findings if item.name == "command_delay")
    assert delay.probability > 0.9
    assert delay.parameters["delay"].value == pytest.approx(0.8, abs=0.01)


def test_a_mass_that_no_vehicle_has_is_refused_in_a_sentence(case):
    vehicle = case.file.vehicle
    shape = vehicle.configurations[case.configuration]
    shape = replace(shape, dry_mass_kg=1e9, inertia_kgm2=(*shape.inertia_kgm2[:2], 1e8))
    heavy = replace(case.file, vehicle=replace(vehicle, configurations={case.configuration: shape}))
    with pytest.raises(FitError, match=r"no solution; .* mass or an inertia in the vehicle file"):
        diagnose(dive_of(case), heavy, case.configuration, effects=SMALL, progress=quiet)


def held(dive):
    """The dive as its sensors would read it on a vehicle that is held while its thrusters run."""
    rng = np.random.default_rng(1)

    def noise_alone(signal, noise):
        return replace(signal, value=noise + noise * rng.standard_normal(signal.value.shape))

    return replace(
        dive,
        velocity=noise_alone(dive.velocity, 0.002),
        gyro=noise_alone(dive.gyro, 0.004),
        fog=None if dive.fog is None else noise_alone(dive.fog, 1e-4),
    )


@pytest.mark.parametrize(
    ("spoilt", "words"),
    [
        (lambda dive: with_pulses(dive, np.zeros_like), "no thruster pushed in all the dive"),
        (lambda dive: with_pulses(dive, np.sign), "no thruster pushed in all the dive"),
        (lambda dive: replace(dive, armed=Signal(np.zeros(1), np.zeros((1, 1)))), "the vehicle was never armed"),
        (held, "the vehicle hardly moved"),
        (lambda dive: dive.between(dive.span_s[0], dive.span_s[0] + 20.0), "too short"),
        (lambda dive: replace(dive, name="other", veh_cfg=Signal(dive.veh_cfg.time_s, dive.veh_cfg.value + 7)),
         "VEH_CFG"),
    ],
    ids=["no pulses", "next to no pulses", "unarmed", "held", "short", "another vehicle"],
)  # fmt: skip
def test_what_can_not_be_diagnosed_is_refused_and_so_is_such_a_check_dive(case, spoilt, words):
    assert words in refused(case, spoilt(dive_of(case)))
    assert words in refused(case, dive_of(case), spoilt(check_of(case)))


@pytest.fixture(scope="module")
def folder(case, tmp_path_factory):
    out = tmp_path_factory.mktemp("dives")
    (out / "vehicle.yaml").write_text(case.vehicle.text)
    (out / "dive.tlog").write_bytes(tlog_of(dive_of(case)))
    (out / "check.tlog").write_bytes(tlog_of(check_of(case)))
    return out


@pytest.mark.usefixtures("sketched")
class TestCommand:
    @pytest.fixture(autouse=True)
    def few(self, monkeypatch):
        monkeypatch.setattr(module, "library", lambda _configuration, _lag_s: (QUADRATIC_DRAG, THRUST_GAIN))

    def run(self, folder, *words):
        dive = ("diagnose", folder / "dive.tlog", "--vehicle", folder / "vehicle.yaml")
        return main([*map(str, (*dive, *words))])

    def test_it_says_what_it_found_and_writes_what_was_asked_for(self, folder, tmp_path, capsys):
        json_file, page, table = (tmp_path / name for name in ("a.json", "a.html", "a.csv"))
        check = ("--check", folder / "check.tlog", "--predict", table)
        assert self.run(folder, *check, "--json", json_file, "--report", page) == 0
        shown = capsys.readouterr().out
        assert all(words in shown for words in ("Quadratic drag", "X_uu", "On the check dive"))
        assert json.loads(json_file.read_text())["effects"][0]["name"] == "quadratic_drag"
        assert page.read_text().lower().startswith("<!doctype html>")
        assert "measured_u" in table.read_text()

    def test_a_table_needs_a_check_dive_and_a_recording_is_not_written_over(self, folder, tmp_path, capsys):
        check = folder / "check.tlog"
        assert self.run(folder, "--predict", tmp_path / "a.csv") == 2
        assert "--check" in capsys.readouterr().err
        assert self.run(folder, "--check", check, "--predict", check) == 2
        assert "would write over" in capsys.readouterr().err

    def accepted(self, case, share, std, path):
        """An identification that found `share` of the vehicle's masses and dampings, known to `std` of them."""
        values = zip((*MASSES, *DAMPINGS), (*case.vehicle.mass, *case.vehicle.damping), strict=True)
        parameters = [
            {
                "name": coefficient.name,
                "identifiable": True,
                "given_thrust": share * v,
                "given_thrust_std": std * v,
            }
            for coefficient, v in values
        ]
        answer = {
            "method": "likelihood", "outcome": "converged", "configuration": case.configuration,
            "parameters": parameters, "vehicle": {"name": case.name, "sha256": "0" * 64},
        }  # fmt: skip
        path.write_text(json.dumps(answer))
        return answer

    def test_what_was_accepted_earlier_is_held_beside_the_dive(self, case, folder, tmp_path, capsys):
        earlier, answer = tmp_path / "earlier.json", tmp_path / "a.json"
        answer_before = self.accepted(case, 1.3, 0.02, earlier)
        assert self.run(folder, "--accepted", earlier, "--json", answer) == 0
        (gain,) = [e for e in json.loads(answer.read_text())["effects"] if e["name"] == "thrust_gain"]
        assert gain["parameters"]["gain"]["value"] == pytest.approx(1.3, abs=0.05)
        earlier.write_text(json.dumps(answer_before | {"configuration": "another"}))
        capsys.readouterr()
        assert self.run(folder, "--accepted", earlier) == 2
        assert "another" in capsys.readouterr().err

    def test_a_change_that_no_thrust_curve_is_known_to_is_told_and_is_no_cause(
        self, case, folder, tmp_path, capsys, monkeypatch
    ):
        monkeypatch.setattr("identify.diagnose.changed.LEAST_FORCE", 0.5)
        earlier, answer = tmp_path / "earlier.json", tmp_path / "a.json"
        self.accepted(case, 1.3, 0.02, earlier)
        assert self.run(folder, "--accepted", earlier, "--json", answer) == 0
        assert "thrust_gain" not in {effect["name"] for effect in json.loads(answer.read_text())["effects"]}
        shown = " ".join(capsys.readouterr().out.split())
        assert "Beside what was accepted thrust gain (" in shown
        assert "no more than its values or the thrust curve are unsure by" in shown


def test_the_gain_of_a_depth_sensor_is_named_with_its_size() -> None:
    case = draw_case(100_011, names=["depth_scale"], size=1.0, seconds=80.0)
    diagnosis = diagnose(dive_of(case), case.file, case.configuration, progress=lambda *_report: None)
    (finding,) = diagnosis.findings
    assert (diagnosis.verdict, finding.name) == ("explained", "depth_scale")
    assert finding.parameters["scale"].value == pytest.approx(case.planted[0].parameters["scale"], rel=0.02)
