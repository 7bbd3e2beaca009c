"""Rotations and scores against closed forms."""

import numpy as np
import pytest

from tracking.constellation import Constellation, NodeConfig
from tracking.estimate import Status, TeamEstimate
from tracking.geometry import (
    best_rotation,
    quat_conjugate,
    quat_from_yaw,
    quat_multiply,
    quat_to_matrix,
    rotate,
    yaw_of,
)
from tracking.metrics.score import score


def random_quaternions(n, seed=0):
    q = np.random.default_rng(seed).standard_normal((n, 4))
    return q / np.linalg.norm(q, axis=1, keepdims=True)


def test_quaternions_form_the_rotation_group():
    a, b = random_quaternions(20, 1), random_quaternions(20, 2)
    np.testing.assert_allclose(
        quat_to_matrix(quat_multiply(a, b)), quat_to_matrix(a) @ quat_to_matrix(b), atol=1e-12
    )
    np.testing.assert_allclose(
        quat_multiply(a, quat_conjugate(a)), np.tile([1.0, 0, 0, 0], (20, 1)), atol=1e-12
    )
    v = np.random.default_rng(3).standard_normal((20, 3))
    np.testing.assert_allclose(rotate(quat_conjugate(a), rotate(a, v)), v, atol=1e-12)


def test_yaw():
    yaw = np.linspace(-3.0, 3.0, 7)
    np.testing.assert_allclose(yaw_of(quat_from_yaw(yaw)), yaw, atol=1e-12)


@pytest.mark.parametrize("planar", [True, False])
def test_best_rotation_finds_the_rotation(planar):
    rng = np.random.default_rng(4)
    source = rng.standard_normal((5, 8, 3))
    R = quat_to_matrix(quat_from_yaw(rng.uniform(-3, 3, 5)) if planar else random_quaternions(5))
    target = source @ np.swapaxes(R, -1, -2)
    np.testing.assert_allclose(best_rotation(source, target, planar=planar), R, atol=1e-9)


def make_run(pos, truth):
    constellation = Constellation(nodes=tuple(NodeConfig(id=k) for k in range(3)), dimensions=3)
    n = len(pos)
    estimate = TeamEstimate(
        constellation,
        t=np.arange(n, dtype=float),
        pos_ij_w=pos,
        vel_ij_w=np.zeros_like(pos),
        cov=np.broadcast_to(np.eye(6), (n, 3, 6, 6)).copy(),
        q_wb=np.tile([1.0, 0, 0, 0], (n, 3, 1)),
        has_orientation=np.ones((n, 3), dtype=bool),
        age=np.zeros((n, 3)),
        nis=np.zeros((n, 3)),
        nlos_prob=np.zeros((n, 3)),
        status=np.full((n, 3), Status.OK),
    )
    return score(estimate, truth, np.ones((n, 3), dtype=bool), 0.0)


def closed_triangles(n, seed=0):
    p = np.random.default_rng(seed).standard_normal((n, 3, 3))
    return np.stack([p[:, 1] - p[:, 0], p[:, 2] - p[:, 0], p[:, 2] - p[:, 1]], axis=1)


def test_a_constant_yaw_costs_rmse_but_not_rmse_yaw():
    truth = closed_triangles(50)
    R = quat_to_matrix(quat_from_yaw(-0.4))
    result = make_run(truth @ R.T, truth)
    assert result.rmse > 0.3
    assert result.rmse_yaw == pytest.approx(0.0, abs=1e-9)
    assert result.yaw_deg == pytest.approx(np.degrees(0.4))


def test_turning_rotations_cost_rmse_yaw_but_not_rmse_shape():
    truth = closed_triangles(50)
    R = quat_to_matrix(random_quaternions(50))
    result = make_run(truth @ np.swapaxes(R, -1, -2), truth)
    assert result.rmse_yaw > 0.3
    assert result.rmse_shape == pytest.approx(0.0, abs=1e-9)


def test_a_mirror_image_stays_an_error():
    truth = np.tile(np.eye(3), (4, 1, 1))
    assert make_run(-truth, truth).rmse_shape > 0.5
    assert make_run(truth * [1.0, 1.0, -1.0], truth).rmse_shape > 0.5


def test_nees_is_one_where_the_covariance_is_right():
    truth = closed_triangles(4000)
    noisy = truth + np.random.default_rng(6).standard_normal(truth.shape)
    assert make_run(noisy, truth).nees == pytest.approx(1.0, abs=0.05)
