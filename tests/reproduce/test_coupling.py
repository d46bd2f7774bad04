"""Full matrices by least squares: exact where the data are, zero off the diagonal where there is nothing."""

import numpy as np
import pytest

from bench.reproduce.measures import DOFS, matrices
from bridge.errors import FitError
from identify.filters import AlignedDive

MASS = np.array([[110.0, 3.0, -5.0], [3.0, 115.0, 8.0], [-5.0, 8.0, 16.0]])
DAMPING = np.array([[56.0, 4.0, 1.0], [-2.0, 53.0, 6.0], [0.5, -1.5, 26.0]])


def motion(seed, mass, damping, noise=0.0, moving=(1.0, 1.0, 1.0)):
    """A grid on which tau obeys the full model; sums of sines on each axis."""
    rng = np.random.default_rng(seed)
    time_s = np.arange(0.0, 600.0, 0.1)
    n = len(time_s)
    nu3, dot3 = np.zeros((n, 3)), np.zeros((n, 3))
    for axis, reach in enumerate(moving):
        for omega, phase in zip(rng.uniform(0.05, 0.8, 4), rng.uniform(0, 6.28, 4), strict=True):
            nu3[:, axis] += 0.1 * reach * np.sin(omega * time_s + phase)
            dot3[:, axis] += 0.1 * reach * omega * np.cos(omega * time_s + phase)
    momentum = nu3 @ mass
    u, v, r = nu3.T
    coriolis = np.column_stack(
        (-r * momentum[:, 1], r * momentum[:, 0], u * momentum[:, 1] - v * momentum[:, 0])
    )
    tau3 = dot3 @ mass + coriolis + nu3 @ damping.T + noise * rng.standard_normal((n, 3))
    nu, nu_dot, tau = (np.zeros((n, 6)) for _ in range(3))
    nu[:, DOFS], nu_dot[:, DOFS], tau[:, DOFS] = nu3, dot3, tau3
    attitude = np.tile([1.0, 0.0, 0.0, 0.0], (n, 1))
    return AlignedDive(time_s, nu, nu_dot, tau, attitude, np.ones(n, np.bool_), np.ones(6, np.bool_))


def test_exact_data_give_both_matrices_exactly():
    found = {term.name: term.value for term in matrices(motion(1, MASS, DAMPING))}
    letters = "uvr"
    for i in range(3):
        for j in range(3):
            assert found[f"D_{letters[i]}{letters[j]}"] == pytest.approx(DAMPING[i, j], abs=1e-6)
            if i <= j:
                assert found[f"M_{letters[i]}{letters[j]}"] == pytest.approx(MASS[i, j], abs=1e-6)


def test_nothing_off_the_diagonal_is_found_within_its_errors():
    inside = []
    for seed in range(5):
        terms = matrices(motion(seed, np.diag(np.diag(MASS)), np.diag(np.diag(DAMPING)), noise=1.0))
        inside += [abs(t.value) < 1.96 * t.std for t in terms if not t.diagonal]
    assert len(inside) == 45
    assert np.mean(inside) > 0.85


def test_a_share_is_taken_of_the_diagonal_neighbours():
    term = next(t for t in matrices(motion(2, MASS, DAMPING)) if t.name == "D_vr")
    assert term.share == pytest.approx(6.0 / np.sqrt(53.0 * 26.0), abs=1e-6)


def test_a_dive_without_sway_is_refused():
    with pytest.raises(FitError, match="surge, sway and yaw"):
        matrices(motion(3, MASS, DAMPING, moving=(1.0, 0.0, 1.0)))
