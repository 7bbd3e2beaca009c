"""The bound, the smoother, and the metrics of consistency and GOSPA."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from agents.simulation.simulate import simulate
from relpos_env.core.oracle_params import matched_params
from relpos_env.scenarios import recordable
from tracking import (
    ConfigError,
    Constellation,
    NodeConfig,
    Status,
    TeamEstimate,
    Tracker,
    TrackerParams,
)
from tracking.filters import FilterParams
from tracking.filters.joint.params import JointParams, RangeErrorParams
from tracking.late_data.horizon import Horizon, HorizonParams
from tracking.log import Log, Truth
from tracking.measurements import Kind, MeasurementBlock
from tracking.metrics.bound import posterior_bound
from tracking.metrics.consistency import chi_square_band, pair_nees
from tracking.metrics.gospa import labelled_gospa
from tracking.metrics.score import score
from tracking.vehicles import VEHICLES


@pytest.fixture(scope="module")
def drive():
    return simulate(scenario="cars-los", seconds=40.0, seed=77)


def test_bound_is_what_the_filter_expects_of_itself(drive):
    """With the parameters of the world, the covariance of the filter is close to the bound."""
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
    """Tested at the time of a range; between ranges, smoothing applies wheel constraints again."""
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
    """With moving cars: smoothing would propagate all rotations from then on."""
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
    """Measurements may arrive within the delay in any order and repeatedly."""
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


PSD, SIGMA, HZ, SECONDS, SKIP = 0.4, 0.1, 10.0, 12.0, 2.0
FAR = 100.0 * np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.2], [0.1, -1.0]])


def far_nodes():
    """Return a linear Gaussian run: a node at rest at the origin, at an unknown position, and four
    distant nodes; accelerations and ranges have only white noise."""
    nodes = [NodeConfig(id=k, kind="static") for k in range(4)]
    group = Constellation(
        nodes=(*nodes, NodeConfig(id=4, vehicle="drone", imu_hz=HZ)), dimensions=2
    )
    carrier = replace(
        VEHICLES["drone"], accel_psd=PSD, bias_std=1e-9, vertical_bias_std=1e-9,
        heading_std=1e-9, initial_tilt_speed=0.0,
    )  # fmt: skip
    params = JointParams(
        vehicles={**VEHICLES, "drone": carrier},
        range_error=RangeErrorParams(white_std=SIGMA, fast_std=0.0, slow_std=0.0),
        static_drift=1e-9,
    )
    t = np.arange(1, int(SECONDS * HZ)) / HZ
    values = np.zeros((len(t), 7))
    values[:, 0] = 1.0
    four = np.full(len(t), 4)
    parts = [MeasurementBlock.of_kind(Kind.STATE, t, four, values)]
    for k in range(4):
        distance = np.full((len(t), 1), np.linalg.norm(FAR[k]))
        parts.append(MeasurementBlock.of_kind(Kind.RANGE, t, np.full(len(t), k), distance, j=four))
    pos = np.zeros((5, 3))
    pos[:4, :2] = FAR
    rows = np.repeat(np.arange(0.0, SECONDS + 0.1, 0.1), 5)
    truth = Truth(
        rows, np.tile(np.arange(5), len(rows) // 5), np.tile(pos, (len(rows) // 5, 1)),
        np.tile([1.0, 0.0, 0.0, 0.0], (len(rows), 1)), np.ones(len(rows), bool),
        np.ones(len(rows), bool),
    )  # fmt: skip
    block = MeasurementBlock.concatenate(parts).sorted()
    return Log(name="far", constellation=group, block=block, truth=truth), params, t


def kalman_runs(params, t, n_runs, seed):
    """Return errors of a textbook Kalman filter in simulated runs, (run, time, node, 2) [m]."""
    rng, dt = np.random.default_rng(seed), 1.0 / HZ
    F = np.eye(12)
    F[8:10, 10:12] = dt * np.eye(2)
    Q = np.zeros((12, 12))
    for a in (8, 9):
        Q[np.ix_([a, a + 2], [a, a + 2])] = PSD**2 * np.array(
            [[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]]
        )
    root = np.linalg.cholesky(Q + 1e-18 * np.eye(12))
    H = np.zeros((4, 12))
    for k, far in enumerate(FAR):
        u = -far / np.linalg.norm(far)
        H[k, 2 * k : 2 * k + 2], H[k, 8:10] = -u, u
    P0 = np.diag([*[params.start.position_std**2] * 10, *[params.start.speed_std**2] * 2])
    error = rng.standard_normal((n_runs, 12)) * np.sqrt(np.diag(P0))
    P, found = P0, np.zeros((n_runs, len(t), 5, 2))
    for k in range(len(t)):
        if k > 0:
            # The error is propagated by F and increased by the process noise.
            error = error @ F.T + rng.standard_normal((n_runs, 12)) @ root.T
            P = F @ P @ F.T + Q
        K = P @ H.T @ np.linalg.inv(H @ P @ H.T + SIGMA**2 * np.eye(4))
        noise = SIGMA * rng.standard_normal((n_runs, 4))
        error = error - (error @ H.T + noise) @ K.T
        P = (np.eye(12) - K @ H) @ P
        found[:, k] = error[:, :10].reshape(n_runs, 5, 2)
    return found


def test_the_bound_of_a_linear_gaussian_run_is_what_a_kalman_filter_errs_by():
    """Tested for all three alignments, over 400 simulated runs."""
    log, params, t = far_nodes()
    bound = posterior_bound(log, params, skip=SKIP)
    at = np.round((bound.t - t[0]) * HZ).astype(int)
    errors = kalman_runs(params, t, 400, seed=5)[:, at]
    estimate = TeamEstimate.empty(log.constellation, bound.t)
    estimate.status[:] = Status.OK
    estimate.cov[:] = np.eye(6)
    truth, known = log.truth.pairs(log.constellation, bound.t)
    i, j = log.constellation.pairs.T
    squared = []
    for run in errors:
        estimate.pos_ij_w[..., :2] = truth[..., :2] + run[:, j] - run[:, i]
        found = score(estimate, truth, known, 0.0)
        squared.append([found.rmse**2, found.rmse_yaw**2, found.rmse_shape**2])
    rms = np.sqrt(np.mean(squared, axis=0))
    np.testing.assert_allclose([bound.rmse, bound.rmse_yaw, bound.rmse_shape], rms, rtol=0.04)
    assert bound.rmse_yaw < 0.95 * bound.rmse
