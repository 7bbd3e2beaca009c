"""Slow range error of the joint filter after possible LOS/NLOS transitions."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm
from scipy.stats import norm

from tests.tracking.test_joint_kernels import running
from tracking.filters.joint.ekf.propagation import predict
from tracking.filters.joint.updates.range_errors import (
    reset_bias_on_transition,
    update_nlos_posterior,
)

SHARES = st.floats(0.0, 0.99)


def believing(seed, hidden, *, waiting):
    """Return random states and covariance, with a pending update if `waiting`."""
    c, s, work, _ = running(2, seed=seed)
    rng = np.random.default_rng(seed)
    n = s.x.shape[1]
    A = rng.standard_normal((n, n))
    s.P[0] = A @ A.T / n
    s.nlos[:], s.bias_retention[:] = hidden, 1.0
    if waiting:
        H = rng.standard_normal(n)
        s = s._replace(pending_updates=np.zeros((1, 8, n)))  # as in groups large enough
        s.n_pending[0] = 1
        s.pending_updates[0, 0] = s.P[0] @ H / np.sqrt(H @ s.P[0] @ H + 1.0)
    return c, s, work


def covariance(s):
    """Return the covariance after pending updates."""
    rows = s.pending_updates[0, : s.n_pending[0]]
    return s.P[0] - rows.T @ rows


@settings(max_examples=30)
@given(st.integers(0, 99), st.floats(0.0, 1.0), SHARES, st.floats(0.0, 1.0))
def test_by_so_much_it_is_forgotten(seed, hidden, switched, is_far):
    """Mean and variance move towards those of a new error; nothing else changes."""
    c, s, _ = believing(seed, hidden, waiting=True)
    at, before, x = s.pairs["i_range_error"][0] + 1, covariance(s), s.x[0].copy()
    reset_bias_on_transition(c, s, 0, 0, switched, is_far)
    after, stays = covariance(s), 1.0 - switched
    shares = np.array([1.0 - is_far, is_far])
    means = np.array([c["nlos_bias"], c["nlos_bias_large"]])
    excess = shares @ means
    nlos_bias_var = (
        shares @ (np.array([c["nlos_bias_var"], c["nlos_bias_large_var"]]) + means**2) - excess**2
    )
    # The moments of a mixture of cases, each with probability, mean and variance.
    chance = np.array([stays, switched * (1.0 - hidden), switched * hidden])
    mean = np.array([x[at], 0.0, excess])
    var = c["slow_var"] + np.array([before[at, at] - c["slow_var"], 0.0, nlos_bias_var])
    expected = chance @ (var + mean**2) - (chance @ mean) ** 2
    assert after[at, at] == pytest.approx(expected)
    assert s.x[0, at] == pytest.approx(stays * x[at] + switched * hidden * excess)
    others = np.arange(len(x)) != at
    np.testing.assert_array_equal(s.x[0, others], x[others])
    np.testing.assert_allclose(after[at, others], stays * before[at, others], atol=1e-12)
    np.testing.assert_allclose(after[others][:, others], before[others][:, others], atol=1e-12)
    assert np.linalg.eigvalsh(after).min() > -1e-12


@settings(max_examples=30)
@given(st.integers(0, 99), st.floats(0.0, 1.0), SHARES)
def test_a_change_that_waits_for_the_prediction_moves_the_mean_as_one_at_once(
    seed, hidden, switched
):
    """Covariances agree, too; its own variance is that of the equivalent decay over distance."""
    c, s, work = believing(seed, hidden, waiting=False)
    x, P = s.x[0].copy(), s.P[0].copy()
    s.preintegrated[:] = 0.0
    reset_bias_on_transition(c, s, 0, 0, switched, 0.0)
    predict(c, s, 0, 0.0, work)
    at_once = s.x[0].copy(), s.P[0].copy()
    s.x[0], s.P[0] = x, P
    s.bias_retention[0, 0] = 1.0 - switched
    predict(c, s, 0, 0.0, work)
    np.testing.assert_allclose(s.x[0], at_once[0], atol=1e-12)
    at, stays = s.pairs["i_range_error"][0] + 1, 1.0 - switched
    new = c["slow_var"] + hidden * c["nlos_bias_var"]
    assert s.P[0, at, at] == pytest.approx(stays**2 * P[at, at] + (1.0 - stays**2) * new)
    s.P[0, at, at] = at_once[1][at, at]
    np.testing.assert_allclose(s.P[0], at_once[1], atol=1e-12)


@settings(max_examples=50)
@given(st.floats(0.0, 1.0), st.floats(-1.0, 3.0), st.floats(0.001, 0.2), st.floats(-3.0, 3.0))
def test_sight_is_judged_by_the_rule_of_bayes(before, nu, variance, evidence):
    """The posterior is over LOS/NLOS before and after, and over small and large excesses."""
    c, s, _, _ = running(2, seed=1)
    s.P[0], s.nlos[0, 0] = np.eye(s.x.shape[1]), before
    at, dt, rates = s.pairs["i_range_error"][0] + 1, 0.1, (0.7, 2.5)
    slow = s.x[0, at]
    found = update_nlos_posterior(
        c, s, 0, 0, dt, nu, variance, (evidence, *rates), np.zeros(s.x.shape[1])
    )

    def density(mean, var):
        return norm.pdf(nu, mean, np.sqrt(var))

    # A Markov chain of two states: the exponential of its generator.
    chain = expm(dt * np.array([[-rates[0], rates[0]], [rates[1], -rates[1]]]))
    enter, leave = chain[0, 1], chain[1, 0]
    S, hidden = variance + c["white_var"], np.exp(evidence)
    near = (1.0 - c["nlos_large_share"]) * density(c["nlos_bias"], S + c["nlos_bias_var"])
    far = c["nlos_large_share"] * density(c["nlos_bias_large"], S + c["nlos_bias_large_var"])
    same = density(0.0, S)
    entered = (1.0 - before) * enter * (near + far) * hidden
    left = before * leave * density(-slow, S + 1.0 + c["slow_var"])
    stayed = np.array(
        [(1.0 - before) * (1.0 - enter) * same, before * (1.0 - leave) * same * hidden]
    )
    total = entered + left + stayed.sum()
    assert s.nlos[0, 0] == pytest.approx(np.clip((entered + stayed[1]) / total, 1e-4, 1 - 1e-4))
    assert found[0] == pytest.approx((entered + left) / total, abs=1e-9)
    assert found[1] == pytest.approx(total / (total + c["outlier_prob"] / c["outlier_span"]))
    assert found[3] == pytest.approx(far / (near + far))
