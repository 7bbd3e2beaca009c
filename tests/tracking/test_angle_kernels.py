"""Cosine and sine: series for small angles, library functions for others."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from tracking.maths.elementary import SERIES, cosine_sine

LIMIT = float(np.sqrt(SERIES))


@given(st.floats(-10.0, 10.0))
@example(LIMIT)
@example(np.nextafter(LIMIT, 0.0))
@example(-np.nextafter(LIMIT, 0.0))
@example(5e-324)
def test_cosine_and_sine_are_those_of_the_library(angle):
    cosine, sine = cosine_sine(angle)
    assert cosine == pytest.approx(np.cos(angle), abs=3e-16)
    assert sine == pytest.approx(np.sin(angle), rel=3e-16, abs=1e-323)
