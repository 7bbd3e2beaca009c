"""Range errors of a recording, estimated from its ground truth, and the resulting bound."""

from dataclasses import replace

import numpy as np
import pytest

from agents.evaluation.track import track_log
from agents.simulation.simulate import simulate
from relpos_env.core.oracle_params import matched_params
from relpos_env.scenarios import recordable
from tracking.calibration.distances import range_table
from tracking.calibration.range_errors import measure_range_errors
from tracking.errors import LogError
from tracking.filters.joint.params import JointParams
from tracking.filters.joint.supervision.params import SupervisionParams
from tracking.filters.params import FilterParams
from tracking.log import Truth
from tracking.measurements import Kind
from tracking.metrics.bound import UNKNOWN_TURN, posterior_bound, recorded_bound
from tracking.tracker import TrackerParams


@pytest.fixture(scope="module")
def drive():
    return simulate(scenario="cars-los", seconds=60.0, seed=11)


def ways(log, t):
    """Return the distance travelled by each node, from positions at the times of ranges [m]."""
    pos, _ = log.truth.positions(log.constellation, t)
    steps = np.linalg.norm(np.diff(pos, axis=0), axis=2)
    return np.concatenate([np.zeros((1, steps.shape[1])), np.cumsum(steps, axis=0)])


def with_errors(log, white, parts, wild, seed):
    """Return the log with simulated range errors: white, correlated (std, length), outliers."""
    rng, table = np.random.default_rng(seed), range_table(log.block, log.constellation, log.truth)
    error, way = white * rng.standard_normal(len(table.t)), ways(log, table.t)
    for a, b in log.constellation.pairs:
        of = np.nonzero((table.i == a) & (table.j == b))[0]
        step = np.diff(way[of][:, [a, b]].sum(axis=1), prepend=np.nan)
        for std, length in parts:
            kept, value = np.exp(-step / length), 0.0
            for k, at in enumerate(of):
                new = std * rng.standard_normal()
                value = new if k == 0 else kept[k] * value + np.sqrt(1.0 - kept[k] ** 2) * new
                error[at] += value
    error += (rng.random(len(error)) < wild) * rng.uniform(0.5, 2.0, len(error))
    values = log.block.values.copy()
    values[0, log.block.kind[0] == Kind.RANGE, 0] = table.true + error
    return replace(log, block=replace(log.block, values=values))


@pytest.mark.parametrize("wild", [0.0, 0.05])
@pytest.mark.parametrize(
    ("white", "fast", "slow"),
    [(0.02, (0.05, 0.1), (0.09, 1.5)), (0.05, (0.03, 0.4), (0.04, 4.0)), (0.01, (0.04, 0.2), None)],
)
def test_noise_and_what_stays_are_told_apart(drive, white, fast, slow, wild):
    parts = [part for part in (fast, slow) if part]
    found = measure_range_errors(with_errors(drive, white, parts, wild, seed=1))
    variance = found.white_std**2 + found.fast_std**2 + found.slow_std**2
    expected = np.sqrt(white**2 + sum(std**2 for std, _ in parts))
    assert found.white_std == pytest.approx(white, rel=0.25)
    assert np.sqrt(variance) == pytest.approx(expected, rel=0.25)
    # The variograms agree at the correlation lengths of the parts.
    for way in (fast[1], slow[1] if slow else 1.0):
        model = white**2 + sum(s**2 * (1.0 - np.exp(-way / at)) for s, at in parts)
        gamma = found.white_std**2 + sum(
            std**2 * (1.0 - np.exp(-way / at))
            for std, at in (
                (found.fast_std, found.fast_length),
                (found.slow_std, found.slow_length),
            )
        )
        assert np.sqrt(gamma) == pytest.approx(np.sqrt(model), rel=0.2)


def test_what_is_not_measured_stays_as_it_was(drive):
    like = replace(matched_params(recordable("cars-los")).range_error, nonlinearity_gain=2.5)
    assert measure_range_errors(drive, like).nonlinearity_gain == 2.5


def test_labelled_ranges_do_not_count(drive):
    values, rng = drive.block.values.copy(), np.random.default_rng(2)
    is_range = drive.block.kind[0] == Kind.RANGE
    hidden = rng.random(int(is_range.sum())) < 0.4
    values[0, is_range, 0] += 3.0 * hidden * rng.random(len(hidden))
    spoiled = replace(drive, block=replace(drive.block, values=values), nlos=hidden)
    found, as_is = measure_range_errors(spoiled), measure_range_errors(drive)
    assert found.white_std == pytest.approx(as_is.white_std, rel=0.1)


def test_the_bound_of_a_recording_is_near_that_of_its_world(drive):
    """The noise is measured, and the rotation unknown, since the cars start at rest."""
    params = matched_params(recordable("cars-los"))
    world = posterior_bound(drive, params, turn_std=UNKNOWN_TURN[2])
    found = recorded_bound(drive, params)
    assert found.rmse == pytest.approx(world.rmse, rel=0.2)
    assert found.rmse_shape == pytest.approx(world.rmse_shape, rel=0.2)


def test_who_does_not_know_the_rotation_knows_less(drive):
    params = matched_params(recordable("cars-los"))
    known = posterior_bound(drive, params, skip=0.0)
    open_turn = posterior_bound(drive, params, skip=0.0, turn_std=UNKNOWN_TURN[2])
    assert open_turn.rmse > 1.2 * known.rmse
    assert open_turn.rmse_shape == pytest.approx(known.rmse_shape, rel=0.1)
    assert open_turn.rmse_shape < open_turn.rmse_yaw < open_turn.rmse


def test_in_space_yaw_lies_between_the_world_and_the_shape():
    person = simulate(scenario="human", seconds=15.0, seed=5)
    bound = recorded_bound(person, skip=5.0)
    assert bound.rmse_shape < bound.rmse_yaw < bound.rmse


def test_it_says_why_it_cannot_be_told(drive):
    with pytest.raises(LogError, match="truth"):
        measure_range_errors(replace(drive, truth=Truth.empty()))
    still = replace(drive.truth, pos_w=np.zeros_like(drive.truth.pos_w))
    with pytest.raises(LogError, match="ranges"):
        measure_range_errors(replace(drive, truth=still))


def test_nothing_is_ok_while_a_tenth_of_the_ranges_does_not_fit():
    """In a steel hall, a quarter of the ranges is too long by more than 0.5 m."""
    log = simulate(scenario="warehouse", seconds=60.0, seed=22)
    strict = track_log(log, findings=()).score
    lenient = JointParams(supervision=SupervisionParams(group_outlier_ratio=1.0))
    params = TrackerParams(filter=FilterParams(joint=lenient))
    trusting = track_log(log, findings=(), params=params).score
    assert strict.integrity_share < 0.05 < trusting.integrity_share
    assert strict.ok_share < 0.3 < trusting.ok_share
