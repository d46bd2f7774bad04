"""Coefficients and noise levels as they are trained: what they stand for, and how both hang together."""

import numpy as np
import pytest
import torch

from bridge.vehicle.config import Configuration, Thruster
from identify.estimators.pinn.raw import Moments, Noise, Prior, of_logarithm, raw_of, slope

SHAPE = Configuration(
    dry_mass_kg=40.0,
    inertia_kgm2=(3.0, 9.0, 10.0),
    thrusters=(Thruster((1.0, 0.0, 0.0), (0.0, 0.0, 0.0)),),
)
MAP = raw_of(SHAPE, (0, 5), torch.device("cpu"))
RAW = torch.tensor([-2.0, 0.3, 1.0, 4.0, 0.1, -0.5, 2.0, 0.7, -3.0, 3.0], dtype=torch.float64)


def row(*values):
    return torch.tensor(values, dtype=torch.float64)


def test_masses_and_dampings_are_positive_whatever_is_trained_and_trims_are_free():
    values = MAP.values(torch.full((10,), -30.0, dtype=torch.float64))
    assert (values[:8] > 0).all()
    assert (values[8:] < 0).all()


def test_raw_parameters_and_values_are_each_others_inverse():
    torch.testing.assert_close(MAP.raw(MAP.values(RAW)), RAW)


def test_the_slopes_of_values_logarithms_and_priors_are_those_of_automatic_differentiation():
    def jacobian(function):
        return torch.func.jacrev(function)(RAW)

    torch.testing.assert_close(torch.diag(MAP.slope(RAW)), jacobian(MAP.values))

    def logarithm(raw):
        values = MAP.values(raw)
        return torch.cat([values[:8].log(), values[8:]])

    torch.testing.assert_close(torch.diag(MAP.to_logarithm(RAW)), jacobian(logarithm))
    _, tilt = MAP.prior(RAW)
    torch.testing.assert_close(torch.diag(tilt), jacobian(lambda raw: MAP.prior(raw)[0]))


def test_the_priors_pull_on_nothing_at_their_middle():
    residual, _ = MAP.prior(MAP.raw(MAP.middle))
    torch.testing.assert_close(residual, torch.zeros_like(residual))


def test_a_mass_that_no_axis_weighs_is_held_closer_than_one_that_is_fitted():
    assert (MAP.spread[[1, 2, 3, 4]] < 0.5).all()
    assert (MAP.spread[[0, 5]] > 1.0).all()


def test_coefficients_come_in_the_order_of_masses_dampings_and_trims():
    given, values = MAP.coefficients(RAW), MAP.values(RAW)
    torch.testing.assert_close(torch.cat([given.mass, given.damping, given.trim]), values)
    assert (len(given.mass), len(given.damping), len(given.trim)) == (6, 2, 2)


NOISE = Noise(row(0.004, 0.001), row(3.0), row(1.6))


def test_noise_levels_and_their_logarithms_are_each_others_inverse():
    again = of_logarithm(NOISE.logarithm(), 1)
    torch.testing.assert_close(again.sensor, NOISE.sensor)
    torch.testing.assert_close(again.disturbance, NOISE.disturbance)
    torch.testing.assert_close(again.time_constant_s, NOISE.time_constant_s)


def test_a_noise_level_one_spread_above_its_middle_is_one_standard_deviation_off():
    prior = Prior(NOISE, row(1.0, 0.001))
    above = of_logarithm(NOISE.logarithm() + prior.spread(), 1)
    torch.testing.assert_close(prior.residual(above), torch.ones(4, dtype=torch.float64))


def path(disturbance_n, time_s, steps):
    """Moments of a disturbance that is known exactly at every node, and its nodes."""
    rng = np.random.default_rng(2)
    kept = np.exp(-0.1 / time_s)
    d = [disturbance_n * rng.normal()]
    for _ in range(steps):
        d.append(kept * d[-1] + disturbance_n * np.sqrt(1 - kept**2) * rng.normal())
    d = torch.tensor(d, dtype=torch.float64)[:, None]
    zero = torch.zeros(1, dtype=torch.float64)
    return Moments(row(0.0, 0.0), zero, d[:-1] ** 2, d[:-1] * d[1:], d[1:] ** 2, d[0] ** 2), d[:, 0]


def test_the_slope_in_the_levels_of_a_known_disturbance_is_that_of_its_likelihood():
    moments, d = path(3.0, 1.6, 200)
    step_s = torch.full((200,), 0.1, dtype=torch.float64)

    def half_loss(logarithms):
        level, kept = logarithms[0].exp(), torch.exp(-step_s / logarithms[1].exp())
        off, spread = d[1:] - kept * d[:-1], level**2 * (1 - kept**2)
        first = d[0] ** 2 / level**2 + 2 * logarithms[0]
        return 0.5 * ((off**2 / spread + spread.log()).sum() + first)

    at = row(np.log(2.0), np.log(1.1))
    found = slope(moments, step_s, Noise(NOISE.sensor, row(2.0), row(1.1)))
    torch.testing.assert_close(found[2:], torch.func.grad(half_loss)(at), rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize(("level", "sign"), [(1.0, -1), (9.0, 1)])
def test_a_level_that_is_too_low_is_drawn_up_and_one_too_high_down(level, sign):
    moments, _ = path(3.0, 1.6, 400)
    found = slope(
        moments, torch.full((400,), 0.1, dtype=torch.float64), Noise(NOISE.sensor, row(level), row(1.6))
    )
    assert sign * float(found[2]) > 0
