import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.simulator.kernel import derivative
from bridge.vehicle.config import Configuration, Thruster
from bridge.vehicle.dynamics import acceleration, restoring

small = st.floats(-2, 2)
positive = st.floats(0.5, 200)


@given(
    nu=st.tuples(*[small] * 6),
    tau=st.tuples(*[st.floats(-100, 100)] * 6),
    mass=st.tuples(*[positive] * 6),
    damping=st.tuples(*[positive] * 6),
    quadratic=st.tuples(*[st.floats(0, 50)] * 6),
    turn=st.tuples(*[st.floats(0.1, 1)] * 4),
    net_up=small,
)
@settings(max_examples=100, deadline=None)
def test_the_compiled_kernel_is_the_dynamics_of_the_vehicle(
    nu, tau, mass, damping, quadratic, turn, net_up
) -> None:  # type: ignore[no-untyped-def]
    attitude = np.array(turn) / np.linalg.norm(turn)
    body = Configuration(
        72.0,
        (1.0, 1.0, 1.0),
        (Thruster((1.0, 0.0, 0.0), (0.0, 0.0, 0.0)),),
        centre_of_gravity_below_buoyancy_m=0.05,
        net_buoyancy_n=net_up,
    )
    out = np.empty(13)
    state = np.concatenate([[0.0, 0.0, 5.0], attitude, nu])
    linear, squared = np.array(damping), np.array(quadratic)
    arm = 0.05 * 72.0 * 9.80665
    derivative(state, np.array(tau), np.array(mass), linear, squared, arm, net_up, 2000.0, out)
    wanted = acceleration(
        mass, tuple(linear + squared * np.abs(nu)), nu, tau, restoring(body, tuple(attitude))
    )
    np.testing.assert_allclose(out[7:], wanted, rtol=1e-9, atol=1e-9)


def test_position_moves_along_the_attitude_and_the_attitude_along_the_rates() -> None:
    out = np.empty(13)
    half = np.pi / 4
    east = np.array([0, 0, 5, np.cos(half), 0, 0, np.sin(half), 0.5, 0.2, 0.1, 0, 0, 0.3])
    derivative(east, np.zeros(6), np.ones(6), np.ones(6), np.zeros(6), 0.0, 0.0, 0.0, out)
    np.testing.assert_allclose(out[:3], [-0.2, 0.5, 0.1], atol=1e-12)
    np.testing.assert_allclose(
        out[3:7], 0.5 * 0.3 * np.array([-np.sin(half), 0, 0, np.cos(half)]), atol=1e-12
    )


def test_a_body_above_the_surface_is_pushed_back_down() -> None:
    out = np.empty(13)
    afloat = np.zeros(13)
    afloat[2:4] = -0.01, 1.0
    derivative(afloat, np.zeros(6), np.full(6, 100.0), np.ones(6), np.zeros(6), 0.0, 1.0, 2000.0, out)
    np.testing.assert_allclose(out[9], (0.01 * 2000.0 - 1.0) / 100.0)


@given(turn=st.tuples(*[st.floats(0.1, 1)] * 4), nu=st.tuples(*[small] * 6))
@settings(max_examples=50, deadline=None)
def test_position_and_attitude_follow_the_rotation_matrix_of_the_attitude(turn, nu) -> None:  # type: ignore[no-untyped-def]
    attitude, ahead = np.array(turn) / np.linalg.norm(turn), 1e-6
    out = np.empty(13)
    state = np.concatenate([[0.0, 0.0, 5.0], attitude, nu])
    derivative(state, np.zeros(6), np.ones(6), np.ones(6), np.zeros(6), 0.0, 0.0, 0.0, out)
    np.testing.assert_allclose(out[:3], matrix_of(attitude) @ nu[:3], atol=1e-9)
    p, q, r = nu[3:]
    skew = np.array([[0, -r, q], [r, 0, -p], [-q, p, 0]])
    numeric = (matrix_of(attitude + ahead * out[3:7]) - matrix_of(attitude - ahead * out[3:7])) / (2 * ahead)
    np.testing.assert_allclose(numeric, matrix_of(attitude) @ skew, atol=1e-6)


def matrix_of(quaternion: np.ndarray) -> np.ndarray:
    """Body to earth by Rodrigues' formula, from the quaternion's scalar and vector part."""
    scalar, vector = quaternion[0], quaternion[1:]
    cross = np.cross(vector, np.eye(3)).T
    return np.eye(3) + 2 * scalar * cross + 2 * cross @ cross
