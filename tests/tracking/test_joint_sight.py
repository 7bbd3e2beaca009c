"""What the joint filter believes of a range's slow error when the sight may have changed."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.tracking.test_joint_kernels import running
from tracking.filters.joint._motion_kernels import predict
from tracking.filters.joint._sight_kernels import change_sight

SHARES = st.floats(0.0, 0.99)


def believing(seed, hidden, *, waiting):
    """Random states and covariance; a correction may wait to be taken off."""
    c, s, scratch, _ = running(2, seed=seed)
    rng = np.random.default_rng(seed)
    n = s.x.shape[1]
    A = rng.standard_normal((n, n))
    s.P[0] = A @ A.T / n
    s.nlos[:], s.stays[:] = hidden, 1.0
    if waiting:
        H = rng.standard_normal(n)
        s = s._replace(waiting=np.zeros((1, 8, n)))  # as in groups large enough
        s.n_waiting[0] = 1
        s.waiting[0, 0] = s.P[0] @ H / np.sqrt(H @ s.P[0] @ H + 1.0)
    return c, s, scratch


def covariance(s):
    """With what waits taken off."""
    rows = s.waiting[0, : s.n_waiting[0]]
    return s.P[0] - rows.T @ rows


@settings(deadline=None, max_examples=30)
@given(st.integers(0, 99), st.floats(0.0, 1.0), SHARES)
def test_by_so_much_it_is_forgotten(seed, hidden, switched):
    """Mean and variance move towards those of a new error; nothing else changes."""
    c, s, _ = believing(seed, hidden, waiting=True)
    at, before, x = s.pairs["at_e"][0] + 1, covariance(s), s.x[0].copy()
    change_sight(c, s, 0, 0, switched)
    after, stays = covariance(s), 1.0 - switched
    new = c["slow_var"] + hidden * c["excess_var"]
    expected = stays**2 * before[at, at] + (1.0 - stays**2) * new
    assert after[at, at] == pytest.approx(expected)
    assert s.x[0, at] == pytest.approx(stays * x[at] + switched * hidden * c["excess"])
    others = np.arange(len(x)) != at
    np.testing.assert_array_equal(s.x[0, others], x[others])
    np.testing.assert_allclose(after[at, others], stays * before[at, others], atol=1e-12)
    np.testing.assert_allclose(after[others][:, others], before[others][:, others], atol=1e-12)
    assert np.linalg.eigvalsh(after).min() > -1e-12


@settings(deadline=None, max_examples=30)
@given(st.integers(0, 99), st.floats(0.0, 1.0), SHARES)
def test_a_change_that_waits_for_the_prediction_is_the_same_as_one_at_once(seed, hidden, switched):
    c, s, scratch = believing(seed, hidden, waiting=False)
    x, P = s.x[0].copy(), s.P[0].copy()
    s.pre[:] = 0.0
    change_sight(c, s, 0, 0, switched)
    predict(c, s, 0, 0.0, scratch)
    at_once = s.x[0].copy(), s.P[0].copy()
    s.x[0], s.P[0] = x, P
    s.stays[0, 0] = 1.0 - switched
    predict(c, s, 0, 0.0, scratch)
    np.testing.assert_allclose(s.x[0], at_once[0], atol=1e-12)
    np.testing.assert_allclose(s.P[0], at_once[1], atol=1e-12)
