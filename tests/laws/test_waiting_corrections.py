"""Larger groups: deferred rank-1 updates are equivalent to immediate ones."""

import numpy as np
import pytest

from agents.simulation.simulate import simulate
from tracking import Tracker
from tracking.filters.joint import smoothing, state
from tracking.filters.joint.params import JointParams, NoiseLearningParams
from tracking.filters.params import FilterParams
from tracking.measurements import Kind
from tracking.metrics.bound import posterior_bound
from tracking.tracker import TrackerParams


@pytest.fixture(scope="module")
def crowd(make_group):
    """Six nodes with 15 ranges per message, of which one is too long from 6 to 8 s."""
    group = make_group(n=6, seconds=12.0)
    block = group.block
    hidden = (block.kind == Kind.RANGE) & (block.i == 0) & (block.j == 1)
    hidden &= (block.t > 6.0) & (block.t < 8.0)
    block.values[hidden, 0] += 1.5
    return group


@pytest.fixture
def at_once(monkeypatch):
    """Return a function that disables the deferral of updates."""

    def no_room() -> None:
        for module in (state, smoothing):
            monkeypatch.setattr(module, "room_to_wait", lambda _: 0)

    return no_room


def test_waiting_changes_nothing_but_rounding(crowd, at_once):
    t_out = np.arange(1.0, 12.0, 0.13)
    # Range noise learned from exact ranges would be so small that rounding errors dominate.
    joint = JointParams(noise_learning=NoiseLearningParams(learns=False))
    params = TrackerParams(filter=FilterParams(joint=joint))
    waited = Tracker(crowd.constellation, params).run(crowd.block, t_out)
    at_once()
    same = Tracker(crowd.constellation, params).run(crowd.block, t_out)
    np.testing.assert_array_equal(waited.status, same.status)
    np.testing.assert_allclose(waited.pos_ij_w, same.pos_ij_w, atol=1e-8)
    np.testing.assert_allclose(waited.cov, same.cov, atol=1e-8)
    np.testing.assert_allclose(waited.nlos_prob, same.nlos_prob, atol=1e-8)


def test_smoothing_is_the_same(crowd, at_once):
    now = int(np.searchsorted(crowd.block.t[0], 9.0, side="right"))
    later = int(np.searchsorted(crowd.block.t[0], 9.1, side="right"))
    estimates = []
    for _ in range(2):
        tracker = Tracker(crowd.constellation)
        tracker.step(crowd.block.take(slice(0, now)), 9.0)
        estimates.append(tracker.smooth(crowd.block.take(slice(now, later)), 9.0))
        at_once()
    waited, same = estimates
    np.testing.assert_allclose(waited.pos_ij_w, same.pos_ij_w, atol=1e-8)
    np.testing.assert_allclose(waited.cov, same.cov, atol=1e-8)


def test_the_bound_is_the_same(at_once):
    log = simulate(scenario="human", seconds=8.0, seed=0)
    waited = posterior_bound(log, JointParams(), skip=2.0)
    at_once()
    same = posterior_bound(log, JointParams(), skip=2.0)
    assert waited.rmse == pytest.approx(same.rmse, rel=1e-8)
    assert waited.rmse_shape == pytest.approx(same.rmse_shape, rel=1e-8)


def test_a_split_within_a_message_changes_nothing(crowd):
    end = crowd.block.t[0, -1]
    whole = Tracker(crowd.constellation).step(crowd.block, end)
    tracker = Tracker(crowd.constellation)
    for first in range(0, crowd.block.n_events, 7):
        part = crowd.block.take(slice(first, first + 7))
        split = tracker.step(part, part.t[0, -1])
    np.testing.assert_array_equal(split.pos_ij_w, whole.pos_ij_w)
    np.testing.assert_array_equal(split.cov, whole.cov)
