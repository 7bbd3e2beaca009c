"""Exponentials by a fraction and a table match the library."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.stats import norm

from tracking.maths.elementary import LEAST, MOST, exponential, likelihood


@given(st.floats(-700.0, MOST))
@example(0.0)
@example(-5e-324)
@example(0.5 * np.log(2.0))
@example(-0.5 * np.log(2.0))
def test_exponentials_are_those_of_the_library(x):
    assert exponential(x) == pytest.approx(np.exp(x), rel=5e-12)


@pytest.mark.parametrize("x", [-1e300, -np.inf, LEAST, LEAST - 1.0, np.nan])
def test_far_below_nothing_is_left(x):
    assert 0.0 <= exponential(x) < 1e-300


def test_above_it_ends():
    assert exponential(1e9) == exponential(MOST)


@given(st.floats(-3.0, 3.0), st.floats(1e-2, 10.0))
def test_likelihood_is_that_of_a_gaussian(off, variance):
    expected = norm.pdf(off, 0.0, np.sqrt(variance)) * np.sqrt(2.0 * np.pi)
    assert likelihood(off, variance) == pytest.approx(expected, rel=1e-9, abs=1e-300)
