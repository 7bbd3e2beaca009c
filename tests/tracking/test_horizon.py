"""The delayed horizon puts late data in order for any order of arrival."""

from dataclasses import fields

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tracking.late_data.horizon import Horizon, HorizonParams
from tracking.measurements import Kind, MeasurementBlock


def ranges(t):
    t = np.asarray(t, dtype=np.float64)
    ones = np.ones(len(t), dtype=np.int64)
    return MeasurementBlock.of_kind(Kind.RANGE, t, 0 * ones, t[:, None], j=ones)


@settings(max_examples=60)
@given(st.lists(st.floats(0.0, 0.099), min_size=1, max_size=60), st.integers(1, 7))
def test_order_of_arrival_does_not_matter(delays, n_blocks):
    n = len(delays)
    t = np.linspace(0.0, 1.0, n)
    arrival = t + np.array(delays)
    horizon = Horizon(HorizonParams(delay=0.1))
    out = []
    edges = np.linspace(0.0, 1.2, n_blocks + 1)[1:]
    before = -1.0
    for now in edges:
        arrived = (arrival > before) & (arrival <= now)
        order = np.argsort(arrival[arrived], kind="stable")
        out.append(horizon.step(ranges(t[arrived][order]), now))
        before = now
    out.append(horizon.flush())
    whole = MeasurementBlock.concatenate(out)
    expected = ranges(t).sorted()
    for f in fields(whole):
        np.testing.assert_array_equal(getattr(whole, f.name), getattr(expected, f.name))
    assert horizon.n_late[0] == 0


def test_too_late_is_dropped_and_counted():
    horizon = Horizon(HorizonParams(delay=0.1))
    assert horizon.step(ranges([0.1, 0.5]), 0.55).n_events == 1
    late = horizon.step(ranges([0.2]), 0.6)
    assert late.t[0].tolist() == [0.5]
    assert horizon.n_late[0] == 1


def test_nothing_younger_than_the_delay_comes_out():
    horizon = Horizon(HorizonParams(delay=0.25))
    assert horizon.step(ranges([0.9]), 1.0).n_events == 0
    assert horizon.flush().n_events == 1
