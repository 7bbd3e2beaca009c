"""The bound, the smoother, and the metrics of consistency and of joins."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from agents.simulate import simulate
from relpos_env.matched import matched_params
from relpos_env.scenarios import recordable
from tracking import ConfigError, Status, TeamEstimate, Tracker, TrackerParams
from tracking.bounds import posterior_bound
from tracking.consistency import chi_square_band, pair_nees
from tracking.filters import FilterParams
from tracking.gospa import labelled_gospa
from tracking.horizon import Horizon, HorizonParams
from tracking.measurements import Kind
from tracking.metrics import score


@pytest.fixture(scope="module")
def drive():
    return simulate(scenario="cars-los", seconds=40.0, seed=77)


def test_bound_is_what_the_filter_expects_of_itself(drive):
    """With the parameters of the world, the filter's own covariance is near the bound."""
    params = matched_params(recordable("cars-los"))
    bound = posterior_bound(drive, params)
    tracker = Tracker(drive.constellation, TrackerParams(filter=FilterParams(joint=params)))
    estimate = tracker.run(drive.block, bound.t).take(0)
    expected = np.sqrt(np.trace(estimate.cov[..., :3, :3], axis1=-2, axis2=-1).mean())
    assert expected == pytest.approx(bound.rmse, rel=0.15)
    assert bound.rmse_shape < bound.rmse
    truth, known = drive.truth.pairs(drive.constellation, bound.t)
    found = score(estimate, truth, known, 0.0)
    assert found.rmse_shape is not None
    assert 0.7 * bound.rmse_shape < found.rmse_shape < 1.6 * bound.rmse_shape


def test_better_ranges_lower_the_bound(drive):
    params = matched_params(recordable("cars-los"))
    error = params.range_error
    better = replace(error, white_std=0.003, fast_std=0.003, slow_std=0.004)
    one = posterior_bound(drive, params)
    other = posterior_bound(drive, replace(params, range_error=better))
    assert other.rmse_shape < 0.5 * one.rmse_shape
    assert other.rmse < one.rmse


def run_until(drive, t):
    tracker = Tracker(drive.constellation)
    event = int(np.searchsorted(drive.block.t[0], t, side="right"))
    estimate = tracker.step(drive.block.take(slice(0, event)), t)
    later = int(np.searchsorted(drive.block.t[0], t + 0.1, side="right"))
    return tracker, estimate, drive.block.take(slice(event, later))


def test_smoothing_leaves_the_tracker_where_it_was(drive):
    tracker, _, later = run_until(drive, 20.0)
    twin, _, _ = run_until(drive, 20.0)
    tracker.smooth(later, 20.0)
    one, other = tracker.step(later, 20.1), twin.step(later, 20.1)
    np.testing.assert_array_equal(one.pos_ij_w, other.pos_ij_w)
    np.testing.assert_array_equal(one.cov, other.cov)


def test_smoothing_with_nothing_later_is_the_estimate(drive):
    """At the moment of a range: in between, smoothing lets the wheels speak once more."""
    heard = (drive.block.kind[0] == Kind.RANGE) & (drive.block.t[0] < 20.0)
    moment = float(drive.block.t[0, heard][-1])
    tracker, estimate, later = run_until(drive, moment)
    smooth = tracker.smooth(later.take(slice(0, 0)), moment)
    np.testing.assert_allclose(smooth.pos_ij_w, estimate.pos_ij_w, atol=1e-6)
    np.testing.assert_allclose(smooth.cov, estimate.cov, atol=1e-3)
    np.testing.assert_array_equal(smooth.status, estimate.status)


def test_smoothing_knows_more(drive):
    tracker, estimate, later = run_until(drive, 20.0)
    smooth = tracker.smooth(later, 20.0)
    trace = [np.trace(e.cov[0], axis1=-2, axis2=-1) for e in (smooth, estimate)]
    assert (trace[0] < trace[1]).all()


@pytest.mark.parametrize("ahead", [0.0, 0.02, 0.05, 0.1])
def test_a_group_that_starts_among_what_is_later_is_not_estimated_yet(drive, ahead):
    """Of cars that drive already: all rotations would be followed from then on."""
    moving = drive.block.take(drive.block.t[0] > 15.0)
    tracker = Tracker(drive.constellation)
    edges, status = np.arange(15.0, 17.0, 0.01), None
    for t in edges:
        event, later = np.searchsorted(moving.t[0], [t, t + ahead], side="right")
        now = tracker.step(moving.take(slice(0, event)), t)
        smooth = tracker.smooth(moving.take(slice(event, later)), t)
        np.testing.assert_array_equal(smooth.status, now.status)
        moving, status = moving.take(slice(event, None)), now.status
    assert (status >= Status.AMBIGUOUS).all()


def test_only_joint_looks_back(drive):
    tracker = Tracker(drive.constellation, filter="ekf")
    with pytest.raises(ConfigError, match="joint"):
        tracker.smooth(drive.block.take(slice(0, 0)), 1.0)


@settings(max_examples=8)
@given(seed=st.integers(0, 2**31))
def test_late_doubled_and_shuffled_measurements_change_nothing(drive, seed):
    """Whatever arrives within the delay, in any order and however often."""
    rng = np.random.default_rng(seed)
    block = drive.block.take(slice(0, 3000))
    arrival = block.t[0] + rng.uniform(0.0, 0.08, block.n_events)
    twice = rng.random(block.n_events) < 0.2
    events = np.concatenate([np.arange(block.n_events), np.nonzero(twice)[0]])
    came = np.concatenate([arrival, arrival[twice] + rng.uniform(0.0, 0.01, twice.sum())])
    order = np.argsort(came)
    events, came = events[order], came[order]
    horizon, tracker = Horizon(HorizonParams(delay=0.1)), Tracker(drive.constellation)
    end = float(block.t[0, -1])
    estimate, taken = None, 0
    for now in np.arange(0.1, end + 0.4, 0.05):
        until = int(np.searchsorted(came, now, side="right"))
        due = horizon.step(block.take(events[taken:until]), now)
        estimate, taken = tracker.step(due, horizon.t), until
    assert horizon.n_late[0] == 0
    expected = Tracker(drive.constellation).step(block, horizon.t)
    np.testing.assert_array_equal(estimate.pos_ij_w, expected.pos_ij_w)
    assert horizon.n_doubled[0] == twice.sum()


def test_bands_hold_the_mean_of_squares():
    low, high = chi_square_band(400, 3)
    assert low < 1.0 < high
    draws = np.random.default_rng(0).standard_normal((2000, 400, 3))
    means = np.mean(draws**2, axis=(1, 2))
    assert np.mean((means > low) & (means < high)) == pytest.approx(0.95, abs=0.02)
    with pytest.raises(ConfigError, match="n and dof"):
        chi_square_band(0, 3)
    with pytest.raises(ConfigError, match="probability"):
        chi_square_band(3, 3, 1.0)


def test_errors_drawn_from_the_covariance_have_a_nees_of_one(drive):
    _, estimate, _ = run_until(drive, 20.0)
    once = estimate.take(0)
    rng = np.random.default_rng(1)
    root = np.linalg.cholesky(once.cov[:, :2, :2])
    nees = []
    for _ in range(400):
        truth = once.pos_ij_w.copy()
        truth[:, :2] += (root @ rng.standard_normal((len(root), 2, 1)))[..., 0]
        value, known = pair_nees(once, truth)
        nees.append(value[known].mean())
    assert np.mean(nees) == pytest.approx(1.0, abs=0.1)


def test_gospa_counts_what_is_missed_and_what_is_not_there(drive):
    _, estimate, _ = run_until(drive, 20.0)
    names = TeamEstimate.__slots__[1:]
    arrays = {n: getattr(estimate, n) for n in names}
    truth = estimate.pos_ij_w.copy()
    truth[0, 0, 0] += 0.3
    there = np.ones((1, 3), dtype=bool)
    found = labelled_gospa(estimate, truth, there)
    assert found.total[0] == pytest.approx(0.3)
    status = estimate.status.copy()
    status[0, 1] = Status.ABSENT
    there[0, 2] = False
    changed = TeamEstimate(estimate.constellation, **{**arrays, "status": status})
    found = labelled_gospa(changed, truth, there, cutoff=2.0)
    assert (found.missed[0], found.false[0]) == (1, 1)
    assert found.total[0] == pytest.approx(np.sqrt(0.09 + 2.0 * 2))
    truth[0, 0, 0] += 50.0
    assert labelled_gospa(estimate, truth, np.ones((1, 3), dtype=bool)).rms == pytest.approx(1.0)
    with pytest.raises(ConfigError, match="cutoff"):
        labelled_gospa(estimate, truth, there, cutoff=0.0)
