"""What the network promises of a dive: true values inside its intervals, the likelihood's answer, doubts said aloud."""

from dataclasses import replace

import closed_loop
import network_tasks
import numpy as np
import pytest
import torch
from soak import rest_in_soak

from bench.missions.mission import draw_one
from identify.dive import Signal
from identify.doubt import Outcome
from identify.estimators.axes.build import build_axes
from identify.estimators.likelihood import priors
from identify.estimators.pinn import training as pinn_fit
from identify.estimators.table import estimator
from identify.nuisance import disturbance, noise, time_constant

FILE = closed_loop.vehicle_file()

estimate = estimator("pinn")


def fit(dive):
    return estimate(dive, FILE, "only", network_tasks.quiet)


@pytest.mark.soak
def test_mass_and_damping_lie_in_their_intervals_as_often_as_they_should():
    inside, errors = closed_loop.hits(fit, seconds=90.0)
    assert inside >= 53
    assert 0.75 < np.std(errors) < 1.3


def test_on_a_rich_dive_of_all_axes_network_and_likelihood_come_to_the_same(monkeypatch):
    """With a disturbance of first order: the network knows no other."""
    monkeypatch.setattr(priors, "SECOND_POLE", -12.0)
    monkeypatch.setattr(priors, "SECOND_POLE_SPREAD", 0.1)
    mission = draw_one(100_000, seconds=60.0, kind="rocking")
    ours, theirs = (
        estimator(method)(mission.dive, mission.file, mission.configuration, network_tasks.quiet)
        for method in ("pinn", "likelihood")
    )
    both = [p.name for p in ours.parameters if p.identifiable and theirs[p.name].identifiable]
    assert {"M_u", "M_v", "M_w", "I_p", "I_q", "I_r", "D_u", "D_v", "D_w", "D_r"} <= set(both)
    for name in both:
        assert abs(ours[name].value - theirs[name].value) < 0.3 * theirs[name].std, name
        assert 0.8 < ours[name].std / theirs[name].std < 1.25, name
    for name, truth in mission.truth.items():
        assert not ours[name].identifiable or abs(ours[name].value - truth) < 3.5 * ours[name].std, name


@pytest.mark.soak
@pytest.mark.parametrize("factor", rest_in_soak([0.7, 1.3]))
def test_from_a_start_30_percent_off_in_every_coefficient_training_comes_to_the_same_end(factor):
    task = network_tasks.drawn(100_009, "together", 60.0)
    trainer, map_, start = task.trainer, task.trainer.map_, task.start
    plain = trainer.train(start)
    values = map_.values(start.raw)
    values[:-6] *= factor
    off = trainer.train(trainer.at(map_.raw(values), start.noise, start.equations.state))
    assert off.settled
    std = torch.linalg.inv(plain.curvature).diagonal()[: len(start.raw)].sqrt()
    assert float(((off.raw - plain.raw) / std).abs().max()) < 0.1


def test_one_wild_reading_in_three_hundred_does_not_move_the_answer():
    dive = closed_loop.dive(np.random.default_rng(6), seconds=120.0)
    plain = fit(dive)
    value = dive.velocity.value.copy()
    value[150::300, 0] += np.array([2.0, -3.0, 7.0, 1.5])
    spoiled = fit(replace(dive, velocity=Signal(dive.velocity.time_s, value)))
    for name in ("M_u", "D_u"):
        assert abs(spoiled[name].value - plain[name].value) < 0.3 * plain[name].std
        assert spoiled[name].std < 1.1 * plain[name].std


def test_a_dive_of_which_no_axis_can_be_fitted_is_called_not_identifiable_with_reasons():
    dive = closed_loop.dive(np.random.default_rng(8), seconds=60.0)
    blind = replace(dive, velocity=Signal(dive.velocity.time_s, np.full_like(dive.velocity.value, np.nan)))
    answer = fit(blind)
    assert answer.outcome is Outcome.NOT_IDENTIFIABLE
    assert "no velocity in surge" in answer["M_u"].reason
    assert answer.samples == 0


def test_every_pass_is_told_with_values_and_intervals_and_the_end_with_its_reason():
    reports = []
    dive = closed_loop.dive(np.random.default_rng(3), seconds=60.0)
    answer = estimate(dive, FILE, "only", lambda *report: reports.append(report))
    shares, texts = zip(*[report[:2] for report in reports], strict=True)
    assert list(shares) == sorted(shares)
    assert shares[-1] == 1.0
    assert list(texts[:-1]) == [f"pass {k + 1}" for k in range(len(texts) - 1)]
    assert {"M_u", "D_u"} <= set(reports[0][2])
    value, half = reports[-2][2]["M_u"]
    assert value == pytest.approx(answer["M_u"].value, rel=1e-3)
    assert half > 0
    assert texts[-1].startswith("the network has settled: ")


@pytest.mark.parametrize("most", [3, 5])
def test_the_bound_of_passes_holds_over_all_trainings_and_is_told(monkeypatch, most):
    """Readings that are wild by turns make it train again and again."""
    dive = closed_loop.dive(np.random.default_rng(3), seconds=60.0)
    texts, looks = [], iter(range(1000))

    def wild(trainer, _point):
        wild_steps = torch.zeros_like(trainer.data.known)
        wild_steps[next(looks) % 7] = True
        return wild_steps

    monkeypatch.setattr(pinn_fit, "_wild", wild)
    monkeypatch.setattr(pinn_fit, "MOST_PASSES", most)
    trained = pinn_fit.fit_network(
        dive, FILE, "only", build_axes(dive, FILE, "only"), lambda _, text, *_values: texts.append(text)
    )
    assert len(texts) == most + 1
    assert texts[-2] == f"pass {most}"
    assert not trained.settled
    assert texts[-1] == trained.reason
    assert "had not settled" in trained.reason


class _Asked(Exception):
    pass


@pytest.mark.parametrize(("there", "device"), [(True, "cuda"), (False, "cpu")])
def test_a_card_is_used_where_there_is_one(monkeypatch, there, device):
    def asked(_dive, _file, _configuration, _built, on, _progress):
        raise _Asked(on.type)

    monkeypatch.setattr(torch.cuda, "is_available", lambda: there)
    monkeypatch.setattr(pinn_fit, "task_of", asked)
    dive = closed_loop.dive(np.random.default_rng(3), seconds=30.0)
    with pytest.raises(_Asked, match=device):
        pinn_fit.fit_network(dive, FILE, "only", build_axes(dive, FILE, "only"), network_tasks.quiet)


def test_covariance_information_and_noise_belong_to_the_coefficients_that_were_fitted():
    answer = fit(closed_loop.dive(np.random.default_rng(3), seconds=120.0))
    assert answer.covariance_of == ("M_u", "D_u")
    assert np.sqrt(np.diag(answer.covariance)) == pytest.approx(
        [answer["M_u"].std, answer["D_u"].std], rel=1e-6
    )
    assert answer.information.of == ("M_u", "D_u", "surge_trim")
    assert np.linalg.eigvalsh(answer.information.matrix).min() > 0
    assert answer.nuisance[noise(0, "dvl", False)] == pytest.approx(0.004, rel=0.1)
    assert answer.nuisance[disturbance(0)] == pytest.approx(0.35, rel=0.3)
    assert answer.nuisance[time_constant(0)] == pytest.approx(1.5, rel=0.6)
