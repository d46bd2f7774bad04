"""A dive with a hidden effect, from recording to answer; what can't be diagnosed is refused in a sentence."""

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
from identify.challenge.seal import tlog_of
from identify.diagnose import diagnose as module
from identify.diagnose.diagnose import diagnose
from identify.diagnose.result import plain
from identify.diagnose.wording import percent_sure
from identify.dive import Signal
from identify.effects.actuators import COMMAND_DELAY, DEAD_ZONE, THRUST_GAIN
from identify.effects.environment import STEADY_CURRENT
from identify.effects.hydrodynamics import COUPLED_DAMPING, QUADRATIC_DRAG
from identify.effects.sensors import DVL_DELAY
from identify.estimators.refusals import refuse_unmoved, refuse_unpushed
from tui.cli import main

SCHEMA = Path(__file__).resolve().parents[1] / "data" / "answers.schema.json"
SMALL = (COUPLED_DAMPING, STEADY_CURRENT, DEAD_ZONE, QUADRATIC_DRAG, THRUST_GAIN)


@pytest.fixture(scope="module")
def case():
    return draw_case(391_603, names=["quadratic_drag"], size=0.9, seconds=80.0)


@pytest.fixture(scope="module")
def found(case):
    return diagnosed(case, *SMALL, check=check_of(case))


@pytest.mark.slow
def test_the_hidden_effect_is_named_with_its_parameters(found):
    assert found.findings[0].name == "quadratic_drag"
    values = found.findings[0].parameters
    assert values
    for value in values.values():
        assert value.low95 < value.value < value.high95
    assert found.findings[0].gain_nats > 20
    assert found.tried[0].accepted
    assert any("lasts 79 s: with so little of it to hold out" in note for note in found.notes)


def test_the_gap_lies_where_it_truly_does_and_shares_sum_to_one(case, found):
    shares = {}
    for one in found.gap.where:
        shares[one.dof] = shares.get(one.dof, 0.0) + one.share
    assert sum(shares.values()) == pytest.approx(1.0)
    assert max(shares, key=lambda dof: shares[dof]) in case.truth()["dof"]
    assert found.gap.before > 1.2


def test_with_the_effect_in_the_drift_falls_towards_its_floor_here_held_out_and_on_another_dive(found):
    before, after = (
        next(one for one in of if one.horizon_s == 5.0) for of in (found.gap.drifts, found.gap.after)
    )
    assert after.total < 0.5 * (before.total + 1.0)
    for shrink in (found.heldout, found.check):
        assert shrink.after < shrink.before
        assert shrink.value > 0.5


def test_the_feed_forward_would_gain_by_it(found):
    gain = found.findings[0].feedforward
    assert gain.after_m_s < gain.before_m_s


def test_what_is_told_as_less_probable_than_not_is_not_accepted(case, found, monkeypatch):
    assert [one.name for one in found.accepted.effects] == ["quadratic_drag"]
    monkeypatch.setattr(module, "unexplained_nats", lambda _left: 1e9)
    unsure = diagnosed(case, *SMALL)
    assert unsure.findings[0].probability < 0.5
    assert unsure.accepted.effects == ()
    percent = percent_sure(unsure.findings[0].probability)
    assert unsure.accepted.sentences[0].startswith(
        f"Quadratic drag was not accepted: it is {percent} probable"
    )
    # A simulator that is known by such a dive holds the cause beside the numbers that were fitted with it.
    assert unsure.numbers["D_u"].value == found.accepted.values["D_u"].value
    assert unsure.numbers["D_u"].value < unsure.accepted.values["D_u"].value


def test_against_a_model_accepted_before_the_feed_forward_gains_by_masses_and_dampings_too(case, found):
    accepted = {name: Prior(1.5 * one.value, 0.01 * one.value) for name, one in found.numbers.items()}
    later = diagnosed(case, *SMALL, accepted=accepted)
    (gain,) = (one.feedforward for one in later.findings if one.name == "quadratic_drag")
    own = found.findings[0].feedforward
    assert gain.before_m_s > 1.5 * own.before_m_s
    assert gain.after_m_s == pytest.approx(own.after_m_s, rel=0.02)


def test_the_answer_keeps_to_the_schema(found):
    jsonschema.validate(plain(found), json.loads(SCHEMA.read_text()))


def refused(case, dive, check=None):
    with pytest.raises(FitError) as error:
        diagnosed(case, *SMALL, dive=dive, check=check)
    sentence = str(error.value)
    assert sentence.startswith(tuple(str(one.source) for one in (dive, check) if one is not None))
    return sentence


def test_a_dive_without_velocity_is_judged_by_its_turning_and_its_depth(case):
    lost = Signal(dive_of(case).velocity.time_s, np.full_like(dive_of(case).velocity.value, np.nan))
    for velocity in (None, lost):
        said = diagnosed(case, QUADRATIC_DRAG, dive=replace(dive_of(case), velocity=velocity))
        *unread, unseen = said.provisos
        assert [one.split(" was")[0] for one in unread] == ["Surge", "Sway", "Heave"]
        assert "depth alone says too little of it" in unread[2]
        assert all("no velocity" in one and "record the DVL" in one for one in unread)
        assert unseen.startswith("In roll, pitch and yaw no unknown force was looked for")
        assert "I_r" in said.numbers


def test_a_velocity_that_is_never_a_number_is_not_told_to_be_late(case):
    lost = Signal(dive_of(case).velocity.time_s, np.full_like(dive_of(case).velocity.value, np.nan))
    filtered = replace(dive_of(case), velocity=lost, velocity_is_filtered=True)
    said = diagnosed(case, QUADRATIC_DRAG, dive=filtered)
    assert not any("How late it is" in one for one in said.provisos)


def test_a_wrench_without_pulses_tells_of_all_but_single_thrusters_and_their_curve(case):
    said = diagnosed(case, DEAD_ZONE, QUADRATIC_DRAG, dive=replace(dive_of(case), pwm=None, rpm=None))
    assert {one.name for one in said.tried} == {"quadratic_drag"}
    (proviso,) = said.provisos
    assert "record ACTUATOR_OUTPUT_STATUS or SERVO_OUTPUT_RAW" in proviso
    assert [one.name for one in said.findings] == ["quadratic_drag"]


def test_commands_sampled_seldom_leave_a_delay_and_a_lag_unjudged(case):
    dive = dive_of(case)
    every = round(dive.pwm.rate_hz / 2.0)
    seldom = replace(dive, pwm=Signal(dive.pwm.time_s[::every], dive.pwm.value[::every]), tau_cmd=None)
    said = diagnosed(case, COMMAND_DELAY, QUADRATIC_DRAG, dive=seldom)
    assert {one.name for one in said.tried} == {"quadratic_drag"}
    assert any("a delay or a lag of the thrusters was not judged" in one for one in said.provisos)


def test_how_late_an_autopilots_own_velocity_is_is_no_late_dvl(case):
    dive = replace(dive_of(case), velocity_is_filtered=True)
    said = diagnosed(case, DVL_DELAY, QUADRATIC_DRAG, dive=dive)
    assert {one.name for one in said.tried} == {"quadratic_drag"}
    assert any("a late DVL was not judged" in one for one in said.provisos)


def with_pulses(dive, of_neutral):
    """The dive with other pulses (n, k), as made from how far they were off neutral; the wrench not recorded."""
    off = dive.pwm.value - 1500.0
    return replace(dive, pwm=Signal(dive.pwm.time_s, 1500.0 + of_neutral(off)), tau_cmd=None)


def test_a_dive_in_which_no_thruster_pushed_is_refused(case):
    for still in (np.zeros_like, lambda off: np.sign(off)):
        assert "no thruster pushed in all the dive" in refused(case, with_pulses(dive_of(case), still))


def test_a_vehicle_that_was_never_armed_is_refused(case):
    dive = dive_of(case)
    unarmed = Signal(dive.pwm.time_s[:1], np.zeros((1, 1)))
    assert "the vehicle was never armed" in refused(case, replace(dive, armed=unarmed))


def test_a_check_dive_in_which_no_thruster_pushed_is_refused(case):
    still = with_pulses(check_of(case), np.zeros_like)
    with pytest.raises(FitError, match="no thruster pushed"):
        diagnosed(case, *SMALL, check=still)


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


def test_a_vehicle_that_is_held_while_its_thrusters_run_is_refused(case):
    dive = dive_of(case)
    rng = np.random.default_rng(1)

    def held(signal, noise):
        return replace(signal, value=noise + noise * rng.standard_normal(signal.value.shape))

    still = replace(
        dive,
        velocity=held(dive.velocity, 0.002),
        gyro=held(dive.gyro, 0.004),
        fog=None if dive.fog is None else held(dive.fog, 1e-4),
    )
    assert "the vehicle hardly moved" in refused(case, still)


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
    delay = next(item for item in diagnosed(case, dive=early).findings if item.name == "command_delay")
    assert delay.probability > 0.9
    assert delay.parameters["delay"].value == pytest.approx(0.8, abs=0.01)


def test_a_mass_that_no_vehicle_has_is_refused_in_a_sentence(case):
    vehicle = case.file.vehicle
    shape = replace(vehicle.configurations[case.configuration], dry_mass_kg=1e9)
    heavy = replace(case.file, vehicle=replace(vehicle, configurations={case.configuration: shape}))
    with pytest.raises(FitError, match=r"no solution; .* mass or an inertia in the vehicle file"):
        diagnose(dive_of(case), heavy, case.configuration, effects=SMALL, progress=quiet)


def test_twenty_seconds_are_refused(case):
    dive = dive_of(case)
    start, _ = dive.span_s
    assert "too short" in refused(case, dive.between(start, start + 20.0))
    assert "too short" in refused(case, dive, dive.between(start, start + 10.0))


def test_a_dive_or_a_check_of_another_vehicle_is_refused(case):
    dive = dive_of(case)
    other = replace(dive, name="other", veh_cfg=Signal(dive.veh_cfg.time_s, dive.veh_cfg.value + 7))
    assert "VEH_CFG" in refused(case, other)
    assert "VEH_CFG" in refused(case, dive, other)


@pytest.fixture(scope="module")
def folder(case, tmp_path_factory):
    out = tmp_path_factory.mktemp("dives")
    (out / "vehicle.yaml").write_text(case.vehicle.text)
    (out / "dive.tlog").write_bytes(tlog_of(dive_of(case)))
    (out / "check.tlog").write_bytes(tlog_of(check_of(case)))
    return out


class TestCommand:
    @pytest.fixture(autouse=True)
    def few(self, monkeypatch):
        monkeypatch.setattr(module, "library", lambda _configuration, _lag_s: SMALL)

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

    def test_what_was_accepted_earlier_is_held_beside_the_dive(self, case, folder, tmp_path, capsys):
        values = zip((*MASSES, *DAMPINGS), (*case.vehicle.mass, *case.vehicle.damping), strict=True)
        parameters = [
            {"name": one.name, "identifiable": True, "given_thrust": 1.3 * v, "given_thrust_std": 0.02 * v}
            for one, v in values
        ]
        earlier, answer = tmp_path / "earlier.json", tmp_path / "a.json"
        told = {
            "method": "likelihood", "outcome": "converged", "configuration": case.configuration,
            "parameters": parameters, "vehicle": {"name": case.name, "sha256": "0" * 64},
        }  # fmt: skip
        earlier.write_text(json.dumps(told))
        assert self.run(folder, "--accepted", earlier, "--json", answer) == 0
        assert "thrust_gain" in {one["name"] for one in json.loads(answer.read_text())["effects"]}
        earlier.write_text(json.dumps(told | {"configuration": "another"}))
        capsys.readouterr()
        assert self.run(folder, "--accepted", earlier) == 2
        assert "another" in capsys.readouterr().err
