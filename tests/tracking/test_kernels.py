"""Compiled kernels against finite differences and reference implementations."""

import numpy as np
import pytest

from tracking.filters.pair import dynamics
from tracking.maths.mds import classical_mds
from tracking.maths.starting_rotations import starting_rotations


def random_pair(rng, d=3, size=6):
    """Return states and covariance of one pair, with the range's slow error if size is 7."""
    A = rng.standard_normal((size, size))
    P = A @ A.T + 0.1 * np.eye(size)
    x = rng.standard_normal(size) * 2.0
    if d == 2:
        x[[2, 5]] = 0.0
        P[[2, 5]], P[:, [2, 5]] = 0.0, 0.0
    return x[None, None].copy(), P[None, None].copy()


MODELS = {
    "range": lambda x, work: dynamics.predict_range(x, 0, 0, 0.1, -0.2, 0.05, work),
}


@pytest.mark.parametrize("size", [6, 7])
@pytest.mark.parametrize("name", MODELS)
def test_jacobians_are_finite_differences(name, size):
    rng = np.random.default_rng(1)
    for _ in range(20):
        x, _ = random_pair(rng, size=size)
        work, other = np.zeros((2, size)), np.zeros((2, size))
        MODELS[name](x, work)
        for k in range(size):
            up, down = x.copy(), x.copy()
            up[..., k] += 1e-6
            down[..., k] -= 1e-6
            slope = (MODELS[name](up, other) - MODELS[name](down, other)) / 2e-6
            assert slope == pytest.approx(work[0, k], abs=1e-7)


@pytest.mark.parametrize("size", [6, 7])
@pytest.mark.parametrize("d", [2, 3])
def test_predict_is_its_matrix_form(d, size):
    rng = np.random.default_rng(2)
    x, P = random_pair(rng, d, size)
    accel, dt, psd = rng.standard_normal(3), 0.07, 0.4
    eye = np.diag([1.0, 1.0, float(d == 3)])
    F = np.eye(size)
    F[:3, 3:6] = dt * np.eye(3)
    W = np.vstack([0.5 * dt**2 * eye, dt * eye, np.zeros((size - 6, 3))])
    expected_x = F @ x[0, 0] + W @ accel
    expected_P = F @ P[0, 0] @ F.T + W @ (psd**2 / dt * np.eye(3)) @ W.T
    dynamics.predict(x, P, 0, 0, dt, *accel, psd, d)
    np.testing.assert_allclose(x[0, 0], expected_x, atol=1e-12)
    np.testing.assert_allclose(P[0, 0], expected_P, atol=1e-12)


def test_predict_over_no_time_changes_nothing():
    x, P = random_pair(np.random.default_rng(3))
    before = x.copy(), P.copy()
    dynamics.predict(x, P, 0, 0, 0.0, 1.0, 2.0, 3.0, 0.5, 3)
    np.testing.assert_array_equal(x, before[0])
    np.testing.assert_array_equal(P, before[1])


@pytest.mark.parametrize("size", [6, 7])
def test_correct_is_the_joseph_form(size):
    rng = np.random.default_rng(4)
    x, P = random_pair(rng, size=size)
    H, R, nu = rng.standard_normal(size), 0.3, 0.7
    S = H @ P[0, 0] @ H + R
    K = P[0, 0] @ H / S
    A = np.eye(size) - np.outer(K, H)
    expected = x[0, 0] + K * nu, A @ P[0, 0] @ A.T + R * np.outer(K, K)
    work = np.zeros((2, size))
    work[0] = H
    assert dynamics.correct(x, P, 0, 0, work, nu, R) == pytest.approx(S)
    np.testing.assert_allclose(x[0, 0], expected[0], atol=1e-12)
    np.testing.assert_allclose(P[0, 0], expected[1], atol=1e-12)


def test_covariance_survives_many_updates():
    rng = np.random.default_rng(5)
    x, P = random_pair(rng)
    work = np.zeros((2, 6))
    for k in range(20000):
        x[0, 0, :3] = 3.0 * np.array([np.cos(k / 50), np.sin(k / 50), 0.2])
        dynamics.predict(x, P, 0, 0, 0.01, 0.0, 0.0, 0.0, 0.1, 3)
        dynamics.predict_range(x, 0, 0, 0.0, 0.0, 0.0, work)
        dynamics.correct(x, P, 0, 0, work, 0.01, 1e-6)
    np.testing.assert_array_equal(P, np.swapaxes(P, -1, -2))
    assert np.linalg.eigvalsh(P[0, 0]).min() > 0.0


def test_classical_mds_reproduces_distances():
    rng = np.random.default_rng(7)
    p = rng.uniform(-3.0, 3.0, (7, 3))
    distance = np.linalg.norm(p[None] - p[:, None], axis=-1)
    X = classical_mds(distance, 3)
    np.testing.assert_allclose(np.linalg.norm(X[None] - X[:, None], axis=-1), distance, atol=1e-9)


@pytest.mark.parametrize(("d", "count"), [(2, 32), (3, 48)])
def test_starting_rotations_are_orthogonal_and_half_of_them_mirror(d, count):
    R = starting_rotations(d, 16)
    assert len(R) == count
    np.testing.assert_allclose(
        R @ np.swapaxes(R, 1, 2), np.broadcast_to(np.eye(3), R.shape), atol=1e-12
    )
    assert np.sum(np.linalg.det(R) > 0) == count // 2
    assert len({tuple(np.round(r.ravel(), 6)) for r in R}) == count
