"""States of the residual gyroscope bias: rest measures them, and so do ranges."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_joint_kernels import running
from test_upright import walk

from tracking.filters.joint.ekf import imu_errors as gyroscope
from tracking.filters.joint.ekf import propagation
from tracking.filters.joint.hypotheses.alignment import Alignment
from tracking.filters.joint.updates.motion_constraints import update_gyro_bias_at_rest
from tracking.measurements import AHRS_STATUS, GYRO_BIAS, GYRO_VAR, N_VALUES
from tracking.vehicles import VEHICLES

START_STD = 0.009
"""[rad/s] Half a degree per second."""
TRUSTED = VEHICLES["hand"].gyro_std


def tell(s, bias, var, rests, begins=False):
    """Process a STATE event of node 0 with its gyroscope bias."""
    values = np.zeros((1, 1, N_VALUES))
    values[0, 0, AHRS_STATUS] = 2.0 if rests else 1.0
    values[0, 0, GYRO_BIAS : GYRO_BIAS + 3], values[0, 0, GYRO_VAR] = bias, var
    gyroscope.process_gyro_bias(s.nodes[0], s.preintegrated, 0, values, 0, 0, begins)


def group(open_turn=False):
    """Return three hand-held nodes, of which the first has just reported its gyroscope bias."""
    c, s, work, layout = running(3, "hand")
    s.nodes["has_ahrs_feedback"], s.preintegrated[:] = True, 0.0
    s.group["alignment"] = Alignment.LINEAR if open_turn else Alignment.FILTERED
    at = s.nodes["i_gyro_bias"][0] + np.arange(3)
    s.x[0, at], s.P[0] = 0.0, np.eye(s.x.shape[1])
    s.P[0, at, at] = START_STD**2
    return c, s, work, at


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**31), n=st.integers(1, 30))
def test_who_knows_no_more_ends_with_what_was_learned_at_rest(seed, n):
    """Filter and orientation stage start with equal estimates, and both use rest only."""
    rng = np.random.default_rng(seed)
    c, s, work, at = group()
    bias, var, noise = 0.002 * rng.standard_normal(3), START_STD**2, 1e-3**2
    tell(s, bias, var, rests=False, begins=True)
    for _ in range(n):
        z = 0.005 + 1e-3 * rng.standard_normal(3)
        bias = bias + var / (var + noise) * (z - bias)
        var *= noise / (var + noise)
        tell(s, bias, var, rests=True)
    s.nodes["by_gyroscope"] = True
    propagation.predict(c, s, 0, 0.0, work)
    update_gyro_bias_at_rest(s, 0, 0, work)
    for q in range(s.n_pending[0]):
        s.P[0] -= np.outer(s.pending_updates[0, q], s.pending_updates[0, q])
    np.testing.assert_allclose(s.x[0, at], 0.0, atol=1e-9)
    np.testing.assert_allclose(np.diagonal(s.P[0])[at], var, rtol=1e-6)


@pytest.mark.parametrize("open_turn", [False, True])
def test_what_is_learned_in_motion_only_moves_what_is_left(open_turn):
    c, s, work, at = group(open_turn)
    tell(s, np.zeros(3), START_STD**2, rests=False, begins=True)
    tell(s, np.array([1e-3, -2e-3, 3e-3]), 0.1 * START_STD**2, rests=False)
    propagation.predict(c, s, 0, 0.0, work)
    before = s.x.copy(), s.P.copy()
    update_gyro_bias_at_rest(s, 0, 0, work)
    np.testing.assert_array_equal(s.x, before[0])
    np.testing.assert_array_equal(s.P, before[1])
    np.testing.assert_allclose(s.x[0, at], [-1e-3, 2e-3, -3e-3], atol=1e-15)


@pytest.mark.parametrize("lean", [0.003, -0.004])
def test_ranges_tell_what_a_gyroscope_leans_by(lean):
    """The hand does not rotate, so the body is the world frame up to the first heading."""
    _, tracker = walk(0.0, told=True, lean=lean, seconds=30.0)
    s = tracker.save()["filter"]
    h, at = s.group["best"][0, 0], s.nodes["i_gyro_bias"][0, 0] + np.arange(2)
    std = np.sqrt(s.P[0, h, at, at])
    assert (std < TRUSTED / 3.0).all()
    np.testing.assert_array_less(np.abs(s.x[0, h, at] - [lean, 0.5 * lean]), 3.0 * std)


def test_a_gyroscope_of_which_nothing_is_told_leans_nowhere():
    _, tracker = walk(0.0, told=False, lean=0.003)
    s = tracker.save()["filter"]
    h, at = s.group["best"][0, 0], s.nodes["i_gyro_bias"][0, 0] + np.arange(3)
    np.testing.assert_array_equal(s.x[0, h, at], 0.0)
