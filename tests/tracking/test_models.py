"""Every measurement model of the registry against finite differences."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tracking.filters.joint.params import NlosParams
from tracking.geometry import rotate
from tracking.models import MODELS, Model
from tracking.models.lever_arm import antenna_in_world
from tracking.models.nlos import nlos_posterior, transition_probs
from tracking.records import record_of

STEP = 1e-6


def bearing(r0, r1):
    """User model as in docs/how-to/adding.md: direction of a neighbour [rad]."""
    squared = r0 * r0 + r1 * r1
    return math.atan2(r1, r0), -r1 / squared, r0 / squared


def mistaken(r0, r1):
    z_hat, d0, d1 = bearing(r0, r1)
    return z_hat, -d0, d1


OWN = {
    "bearing": Model(bearing, 2, 0, "BearingParams.std"),
    "mistaken": Model(mistaken, 2, 0, "BearingParams.std"),
}


def function(name):
    """Return a model as a function of state and constants, with angles in place of cos and sin."""
    if name != "non-holonomic":
        return (MODELS | OWN)[name].function

    def with_yaw(v0, v1, error, ahead, slip, yaw, _, yaw_rate, aside):
        c, s = math.cos(yaw + error), math.sin(yaw + error)
        return MODELS[name].function(v0, v1, error, ahead, slip, c, s, yaw_rate, aside)

    return with_yaw


@settings(max_examples=50, deadline=None)
@pytest.mark.parametrize("name", [*MODELS, "bearing"])
@given(seed=st.integers(0, 2**31))
def test_derivatives_are_finite_differences(name, seed):
    check_derivatives(name, seed)


def test_a_wrong_derivative_is_found():
    with pytest.raises(AssertionError):
        check_derivatives("mistaken", 1)


def check_derivatives(name, seed):
    model, rng = (MODELS | OWN)[name], np.random.default_rng(seed)
    x = rng.uniform(0.2, 2.0, model.n_state + model.n_constants) * rng.choice([-1.0, 1.0])
    call = function(name)
    _, *derivatives = call(*x)
    assert len(derivatives) == model.n_state
    for k, derivative in enumerate(derivatives):
        up, down = x.copy(), x.copy()
        up[k], down[k] = x[k] + STEP, x[k] - STEP
        slope = (call(*up)[0] - call(*down)[0]) / (2.0 * STEP)
        assert derivative == pytest.approx(slope, abs=1e-6)


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 2**31))
def test_an_antenna_is_rotated_by_the_orientation(seed):
    rng = np.random.default_rng(seed)
    q, lever = rng.standard_normal(4), rng.standard_normal(3)
    q /= np.linalg.norm(q)
    np.testing.assert_allclose(antenna_in_world(*q, *lever), rotate(q, lever), atol=1e-12)


@settings(max_examples=50, deadline=None)
@given(
    enter=st.floats(0.01, 10.0), leave=st.floats(0.01, 10.0), dt=st.floats(0.0, 5.0),
    n=st.integers(2, 5),
)  # fmt: skip
def test_transitions_over_a_time_are_those_over_its_parts(enter, leave, dt, n):
    """Chapman-Kolmogorov equation."""

    def matrix(over):
        a, b = transition_probs(enter, leave, over)
        return np.array([[1.0 - a, a], [b, 1.0 - b]])

    parts = np.linalg.matrix_power(matrix(dt / n), n)
    np.testing.assert_allclose(parts, matrix(dt), atol=1e-9)


@settings(max_examples=100, deadline=None)
@given(st.lists(st.floats(1e-3, 1.0), min_size=8, max_size=8))
def test_the_nlos_posterior_is_bayes_rule(numbers):
    before, enter, leave, los, entered, left, nlos, odds = numbers
    least = record_of(NlosParams())[0]
    after, switched, total, _ = nlos_posterior(least, *numbers)
    prior = np.array([[1.0 - before], [before]]) * [[1.0 - enter, enter], [leave, 1.0 - leave]]
    joint = prior * np.array([[los, entered * odds], [left, nlos * odds]])
    assert total == pytest.approx(joint.sum())
    assert after == pytest.approx(np.clip(joint[:, 1].sum() / joint.sum(), 1e-4, 1.0 - 1e-4))
    assert switched == pytest.approx((joint[0, 1] + joint[1, 0]) / joint.sum())
