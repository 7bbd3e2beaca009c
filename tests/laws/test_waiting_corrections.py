"""Larger groups: corrections that wait are the same corrections."""

import numpy as np
import pytest

from tracking import Tracker
from tracking.filters.joint import state
from tracking.measurements import Kind


@pytest.fixture(scope="module")
def crowd(make_group):
    """Six nodes whose ranges come fifteen at a time, one of them too long for a while."""
    group = make_group(n=6, seconds=12.0)
    block = group.block
    hidden = (block.kind == Kind.RANGE) & (block.i == 0) & (block.j == 1)
    hidden &= (block.t > 6.0) & (block.t < 8.0)
    block.values[hidden, 0] += 1.5
    return group


def test_waiting_changes_nothing_but_rounding(crowd, monkeypatch):
    t_out = np.arange(1.0, 12.0, 0.13)
    waited = Tracker(crowd.constellation).run(crowd.block, t_out)
    monkeypatch.setattr(state, "room_to_wait", lambda _: 0)
    at_once = Tracker(crowd.constellation).run(crowd.block, t_out)
    np.testing.assert_array_equal(waited.status, at_once.status)
    np.testing.assert_allclose(waited.pos_ij_w, at_once.pos_ij_w, atol=1e-8)
    np.testing.assert_allclose(waited.cov, at_once.cov, atol=1e-8)
    np.testing.assert_allclose(waited.nlos_prob, at_once.nlos_prob, atol=1e-8)


def test_a_split_within_a_message_changes_nothing(crowd):
    end = crowd.block.t[0, -1]
    whole = Tracker(crowd.constellation).step(crowd.block, end)
    tracker = Tracker(crowd.constellation)
    for first in range(0, crowd.block.n_events, 7):
        part = crowd.block.take(slice(first, first + 7))
        split = tracker.step(part, part.t[0, -1])
    np.testing.assert_array_equal(split.pos_ij_w, whole.pos_ij_w)
    np.testing.assert_array_equal(split.cov, whole.cov)
