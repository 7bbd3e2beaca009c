"""Integrity figures, and scores of reflections and of wrong covariances."""

import numpy as np
import pytest

from tracking import Constellation, NodeConfig, Status, TeamEstimate
from tracking.metrics.consistency import pair_nees
from tracking.metrics.integrity import (
    beyond_protection,
    longest,
    protection_radius,
    wrong_while_ok,
)
from tracking.metrics.score import score
from tracking.vehicles import VEHICLES

GROUP = Constellation(nodes=tuple(NodeConfig(id=k) for k in range(3)), dimensions=2)
T = np.arange(0.0, 10.0, 0.5)


def estimate(std=0.1, status=Status.OK):
    e = TeamEstimate.empty(GROUP, T)
    pos = np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [1.0, 2.0, 0.0]])
    i, j = GROUP.pairs.T
    e.pos_ij_w[:] = pos[j] - pos[i]
    e.cov[..., 0, 0] = e.cov[..., 1, 1] = std**2
    e.status[:] = status
    return e, e.pos_ij_w.copy()


@pytest.mark.parametrize(
    ("off", "std", "status", "wrong"),
    [
        (0.29, 0.05, Status.OK, False),  # harmless
        (0.31, 0.05, Status.OK, True),
        (0.31, 0.2, Status.OK, False),  # within three standard deviations
        (0.31, 0.05, Status.AMBIGUOUS, False),
        (0.31, 0.0, Status.OK, True),
    ],
)
def test_wrong_is_far_off_by_its_own_covariance_and_ok(off, std, status, wrong):
    e, truth = estimate(std, status)
    e.pos_ij_w[:, 0, 1] += off
    assert (wrong_while_ok(e, truth)[:, 0] == wrong).all()
    assert not wrong_while_ok(e, truth)[:, 1:].any()


def test_the_standard_deviation_counts_along_the_error():
    e, truth = estimate()
    e.cov[..., 0, 0], e.cov[..., 1, 1] = 1.0, 0.01**2
    e.pos_ij_w[:, 0, 0] += 1.0
    e.pos_ij_w[:, 1, 1] += 1.0
    assert wrong_while_ok(e, truth)[0].tolist() == [False, True, False]


def test_the_protection_radius_is_the_expected_error_times_that_of_the_vehicle():
    e, truth = estimate(0.1)
    d = e.constellation.dimensions
    expected = VEHICLES["none"].protection * 0.1 * np.sqrt(d)
    np.testing.assert_allclose(protection_radius(e), expected)
    everything = np.ones(e.status.shape, dtype=bool)
    assert beyond_protection(e, truth, everything) == 0.0
    e.pos_ij_w[:3, 0, 0] += 1.01 * expected
    assert beyond_protection(e, truth, everything) == pytest.approx(3 / e.status.size)
    e.status[:] = Status.LOST
    assert np.isinf(protection_radius(e)).all()
    assert beyond_protection(e, truth, everything) is None


def test_the_longest_stretch_is_that_of_one_pair():
    flags = np.zeros((20, 3), dtype=bool)
    flags[2:6, 0] = flags[6:9, 1] = flags[12:14, 0] = True
    assert longest(T, flags) == pytest.approx(2.0)
    assert longest(T, np.zeros_like(flags)) == 0.0
    flags[:] = True
    assert longest(T, flags) == pytest.approx(T[-1] - T[0])


def test_a_score_counts_the_whole_run_and_knows_mirror_images():
    e, truth = estimate()
    e.pos_ij_w[:4, 0, 1] += 1.0
    has_truth = np.ones(truth.shape[:2], dtype=bool)
    found = score(e, truth, has_truth, 5.0)
    assert found.integrity_share == pytest.approx(4 / 60)
    assert found.integrity_worst_s == pytest.approx(2.0)
    mirrored, truth = estimate()
    mirrored.pos_ij_w[..., 1] *= -1.0
    found = score(mirrored, truth, has_truth, 0.0)
    assert found.rmse_mirror == pytest.approx(0.0, abs=1e-9)
    assert found.rmse_shape > 0.5


def test_a_covariance_that_is_not_positive_is_not_left_out():
    e, truth = estimate()
    e.cov[0, 0] = 0.0
    e.cov[1, 0, 0, 0] = -1.0
    e.cov[2, 0, 1, 1] = 0.0
    nees, known = pair_nees(e, truth)
    assert known[:3, 0].tolist() == [False, True, True]
    assert np.isinf(nees[1:3, 0]).all()
    assert (nees[3:, 0] == 0.0).all()
