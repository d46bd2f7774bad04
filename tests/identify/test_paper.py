"""The source paper's method on exact linear dynamics, and what noise does to its mass."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from bench.reproduce.paper import (
    PAPER,
    PaperNetwork,
    PaperOptions,
    closed_form,
    data_loss,
    estimate,
    estimate_with_curves,
    fixed_values,
    inverse_softplus,
    lessons,
    physics_loss,
    predicted_wrench,
    tensors,
    window_ends,
)
from bridge.vehicle.config import Configuration, Vehicle, VehicleFile
from identify.dive import Dive, Signal
from identify.doubt import Outcome

TRUE = {"M_u": 96.4, "D_u": 42.13, "M_v": 110.0, "D_v": 53.0, "I_r": 16.0, "D_r": 21.8}
SHAPE = Configuration(dry_mass_kg=72.0, inertia_kgm2=(3.0, 9.0, 10.5), thrusters=())
FILE = VehicleFile(Path("v.yaml"), Vehicle("v", {"v": SHAPE}), None, "0")
QUICK = PaperOptions(hidden=8, depth=1, epochs=40, batch=128, cutoff_hz=5.0, physical_rate=4.0, threads=1)


def silent(_fraction, _text):
    """Progress that nobody watches."""


def exact_dive(seconds=120.0, sway=0.15, noise=0.0):
    """Surge, sway and yaw as sines, and the wrench that the true parameters ask for, without lag."""
    time_s = np.arange(int(seconds * 10)) / 10
    nu, nu_dot = np.zeros((2, len(time_s), 6))
    for dof, amplitude, hz in ((0, 0.3, 0.031), (1, sway, 0.047), (5, 0.2, 0.063)):
        nu[:, dof] = amplitude * np.sin(2 * np.pi * hz * time_s)
        nu_dot[:, dof] = amplitude * 2 * np.pi * hz * np.cos(2 * np.pi * hz * time_s)
    values = {**fixed_values(SHAPE), **TRUE}
    tau = np.column_stack(predicted_wrench(values, list(nu_dot.T), list(nu.T), [0.0] * 6))
    # A command holds until the next: shifted by half a step, its mean over a sample's interval is the sample's.
    command = Signal(time_s - 0.05, tau)
    measured = nu[:, :3] + noise * np.random.default_rng(1).standard_normal((len(time_s), 3))
    return Dive(
        "d",
        Path("d.tlog"),
        "0",
        velocity=Signal(time_s, measured),
        gyro=Signal(time_s, nu[:, 3:]),
        tau_cmd=command,
        commands_hold=True,
    )


def problem(dive, options=QUICK):
    learnt = lessons(dive, FILE, "v", options)
    return learnt.grid, learnt.data


def test_the_network_is_the_one_of_table_1():
    network = PaperNetwork(PAPER.hidden, PAPER.depth, PAPER.dropout)
    assert (network.lstm.hidden_size, network.lstm.num_layers, PAPER.window) == (1024, 5, 20)
    first, drop, activation, second, last_drop = network.head
    assert isinstance(first, torch.nn.Linear)
    assert isinstance(second, torch.nn.Linear)
    assert isinstance(activation, torch.nn.Tanh)
    assert (first.in_features, first.out_features) == (1024, 512)
    assert (second.in_features, second.out_features) == (512, 6)
    assert [d.p for d in (drop, last_drop) if isinstance(d, torch.nn.Dropout)] == [0.2, 0.2]


def test_the_gradient_of_the_parameters_does_not_depend_on_the_network_at_all():
    grid, data = problem(exact_dive(noise=0.01))
    rows = torch.arange(64)
    windows = torch.tensor(np.random.default_rng(0).standard_normal((len(rows), 20, 7)), dtype=torch.float32)
    gradients, losses = [], []
    for seed, hidden in ((1, 8), (2, 24)):
        torch.manual_seed(seed)
        network = PaperNetwork(hidden, 2, 0.2)
        raw = torch.linspace(1.0, 6.0, len(data.names), dtype=torch.float64, requires_grad=True)
        l_data = data_loss(network(windows), windows[:, -1, 1:])
        total = physics_loss(raw, fixed_values(SHAPE), data, tensors(data), rows) + 3.0 * l_data.double()
        torch.autograd.backward(total)
        gradients.append(raw.grad.numpy().copy())
        losses.append(l_data.item())
    assert losses[0] != losses[1]
    assert np.array_equal(gradients[0], gradients[1])
    assert np.abs(gradients[0]).min() > 0
    assert len(grid) > len(rows)


def test_softplus_starts_at_the_dry_mass():
    _, curves = estimate_with_curves(exact_dive(40.0), FILE, "v", silent, replace(QUICK, epochs=1))
    start = dict(zip(curves.names, curves.values[0], strict=True))
    assert start["M_u"] == pytest.approx(72.0)
    assert start["I_r"] == pytest.approx(10.5)
    assert torch.nn.functional.softplus(inverse_softplus(torch.tensor(0.3))).item() == pytest.approx(0.3)


def test_the_closed_form_is_exact_without_noise():
    _, data = problem(exact_dive())
    best = closed_form(data, fixed_values(SHAPE))
    # Central differences flatten a sine of 0.063 Hz, sampled at 10 Hz, by 0.03 %.
    assert best == pytest.approx(TRUE, rel=2e-3)


@pytest.mark.soak
def test_training_tends_to_the_closed_form():
    noisy = exact_dive(noise=0.002)
    _, data = problem(noisy)
    best = closed_form(data, fixed_values(SHAPE))
    fractions: list[float] = []
    answer, curves = estimate_with_curves(
        noisy, FILE, "v", lambda fraction, _: fractions.append(fraction), QUICK
    )
    assert {name: answer[name].value for name in best} == pytest.approx(best, rel=5e-3)
    # The noise is what keeps both from the truth.
    assert best["M_u"] < 0.95 * TRUE["M_u"]
    assert answer.outcome is Outcome.CONVERGED
    assert curves.values.shape == (QUICK.epochs + 1, 6)
    assert curves.learning_rate[-1] < 0.01 * curves.learning_rate[1]
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1.0


def test_torch_is_left_as_it_was():
    threads, state = torch.get_num_threads(), torch.random.get_rng_state()
    estimate(exact_dive(40.0), FILE, "v", silent, replace(QUICK, epochs=1, threads=threads + 1))
    assert torch.get_num_threads() == threads
    assert torch.equal(torch.random.get_rng_state(), state)
    assert not torch.are_deterministic_algorithms_enabled()


def test_an_axis_that_was_not_driven_is_left_out_with_its_reason():
    answer = estimate(exact_dive(60.0, sway=0.0), FILE, "v", silent, replace(QUICK, epochs=1))
    assert not answer["M_v"].identifiable
    assert "sway was not excited" in answer["M_v"].reason
    assert "surge, sway and yaw alone" in answer["D_w"].reason
    assert set(answer.values()) == {"M_u", "D_u", "I_r", "D_r"}


def test_it_states_no_interval_and_its_json_has_none():
    answer = estimate(exact_dive(40.0), FILE, "v", silent, replace(QUICK, epochs=1))
    surge = answer["M_u"]
    assert all(math.isnan(x) for x in (surge.std, surge.low95, surge.high95))
    plain = next(p for p in answer.to_json()["parameters"] if p["name"] == "M_u")
    assert (plain["std"], plain["low95"], plain["high95"]) == (None, None, None)
    assert any("states no interval" in note for note in answer.notes)
    assert any("LSTM of 1 x 8 (the paper's: 5 x 1024)" in note for note in answer.notes)
    assert answer["X_udot"].value == pytest.approx(surge.value - 72.0)


def test_windows_do_not_cross_a_gap():
    grid, _ = problem(exact_dive(40.0))
    valid = grid.valid.copy()
    valid[100:103] = False
    ends = window_ends(replace(grid, valid=valid), 20)
    assert ends[ends < 100].max() == 99
    assert ends[ends > 100].min() == 103 + 19
