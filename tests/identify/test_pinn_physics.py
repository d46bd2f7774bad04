"""The network's balance of momentum: Fossen's own terms, exact slopes, and nothing left over in an exact motion."""

import numpy as np
import pytest
import torch

from bridge.vehicle.dynamics import coriolis
from identify.estimators.pinn.physics import Coefficients, Interval, balance, by_coefficients, coriolis_forms

MASS = torch.tensor([100.0, 120.0, 135.0, 9.0, 14.0, 16.0], dtype=torch.float64)


def wave(*shape, phase=0.0):
    return (torch.arange(int(np.prod(shape)), dtype=torch.float64) * 1.7 + phase).sin().reshape(shape)


def case(dofs, placed):
    """Three intervals of a made-up dive: what is known, coefficients, and states at its four nodes."""
    n = len(dofs)
    others = 0.3 * wave(3, 6, phase=1.0)
    others[:, list(dofs)] = 0.0
    stiffness = torch.zeros(n, dtype=torch.float64)
    stiffness[list(placed)] = 25.0
    known = Interval(
        dofs,
        placed,
        torch.tensor([0.1, 0.08, 0.13], dtype=torch.float64),
        20.0 * wave(3, n, phase=2.0),
        0.3 * wave(3, n, phase=3.0),
        others,
        stiffness,
        torch.as_tensor(coriolis_forms()),
    )
    given = Coefficients(MASS, 50.0 + 10.0 * wave(n), wave(n, phase=4.0))
    return known, given, 0.4 * wave(4, 2 * n + len(placed), phase=5.0)


CASES = [((0,), ()), ((0, 1, 5), ()), ((2, 3, 4), (1, 2)), ((0, 1, 2, 3, 4, 5), (2, 3, 4))]


def test_the_forms_give_the_coriolis_forces_of_the_one_definition():
    draw = np.random.default_rng(0)
    for _ in range(5):
        mass, nu = draw.uniform(1.0, 100.0, 6), draw.normal(size=6)
        said = np.einsum("ijkl,j,k,l->i", coriolis_forms(), mass, nu, nu)
        np.testing.assert_allclose(said, np.array(coriolis(mass.tolist(), nu.tolist())), atol=1e-9)


def test_the_forms_are_symmetric_in_the_two_velocities():
    np.testing.assert_array_equal(coriolis_forms(), coriolis_forms().transpose(0, 1, 3, 2))


@pytest.mark.parametrize(("dofs", "placed"), CASES)
def test_every_slope_of_the_balance_is_that_of_automatic_differentiation(dofs, placed):
    known, given, state = case(dofs, placed)
    n = len(dofs)

    def residual(mass, damping, trim, at):
        return balance(known, Coefficients(mass, damping, trim), at).residual

    by_mass, by_damping, by_trim, by_state = torch.func.jacrev(residual, argnums=(0, 1, 2, 3))(
        given.mass, given.damping, given.trim, state
    )
    found = balance(known, given, state)
    leans = by_coefficients(known, given, state, found)
    torch.testing.assert_close(leans, torch.cat([by_mass, by_damping, by_trim], dim=2))
    for k in range(3):
        torch.testing.assert_close(found.before[k], by_state[k, :, k])
        torch.testing.assert_close(found.after[k], by_state[k, :, k + 1])
    assert found.residual.shape == (3, n)


@pytest.mark.parametrize(("dofs", "placed"), CASES)
def test_the_slope_in_the_mean_velocity_is_damping_and_the_differentiated_coriolis_force(dofs, placed):
    known, given, state = case(dofs, placed)
    found = balance(known, given, state)

    def force(nu):
        return torch.stack(coriolis(tuple(MASS), tuple(nu)))[list(dofs)]

    for k in range(3):
        turned = torch.func.jacrev(force)(found.mean[k])[:, list(dofs)]
        expected = known.step_s[k] * (turned + torch.diag(given.damping))
        torch.testing.assert_close(found.by_mean[k], expected)


def steady(nu, push, disturbance=0.0):
    """Residuals (1, 6) of a steady motion `nu` (6,) under `push` (6,)."""
    known = Interval(
        tuple(range(6)),
        (),
        torch.tensor([0.1], dtype=torch.float64),
        push[None],
        torch.zeros(1, 6, dtype=torch.float64),
        torch.zeros(1, 6, dtype=torch.float64),
        torch.zeros(6, dtype=torch.float64),
        torch.as_tensor(coriolis_forms()),
    )
    given = Coefficients(MASS, 0.5 * MASS, torch.zeros(6, dtype=torch.float64))
    state = torch.cat([nu, torch.full((6,), disturbance, dtype=torch.float64)])[None].expand(2, 12)
    return balance(known, given, state).residual


def test_a_steady_turn_under_the_force_that_holds_it_leaves_nothing_over():
    nu = torch.tensor([0.5, -0.2, 0.1, 0.05, -0.1, 0.3], dtype=torch.float64)
    holds = torch.stack(coriolis(tuple(MASS), tuple(nu))) + 0.5 * MASS * nu
    torch.testing.assert_close(steady(nu, holds), torch.zeros(1, 6, dtype=torch.float64))


def test_a_disturbance_pushes_as_a_thrust_does():
    still = torch.zeros(6, dtype=torch.float64)
    nothing = steady(still, torch.full((6,), -2.0, dtype=torch.float64), disturbance=2.0)
    torch.testing.assert_close(nothing, torch.zeros(1, 6, dtype=torch.float64))


def test_an_exact_run_up_under_constant_thrust_leaves_next_to_nothing_over():
    """M u' + D u = F from rest: the mean velocity is Euler and Maclaurin's, off by h^4 / 720 of the fourth slope."""
    mass, damping, force = 100.0, 50.0, 30.0
    for h in (0.2, 0.1):
        u = force / damping * (1 - np.exp(-damping / mass * np.array([0.0, h])))
        known, _, _ = case((0,), ())
        one = Interval(
            (0,),
            (),
            torch.tensor([h], dtype=torch.float64),
            torch.tensor([[force]], dtype=torch.float64),
            torch.zeros(1, 1, dtype=torch.float64),
            torch.zeros(1, 6, dtype=torch.float64),
            torch.zeros(1, dtype=torch.float64),
            known.forms,
        )
        given = Coefficients(
            torch.full((6,), mass, dtype=torch.float64),
            torch.tensor([damping], dtype=torch.float64),
            torch.zeros(1, dtype=torch.float64),
        )
        state = torch.zeros(2, 2, dtype=torch.float64)
        state[:, 0] = torch.as_tensor(u)
        fourth_slope = -force / mass * (damping / mass) ** 3 * np.exp(-0.5 * damping * h / mass)
        left = float(balance(one, given, state).residual[0, 0])
        assert left == pytest.approx(-damping * h**5 / 720 * fourth_slope, rel=2e-2)
